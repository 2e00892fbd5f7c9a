"""`teamclone dataset`."""

from __future__ import annotations


def dataset() -> None:
    """To come."""
