"""`teamclone matches`."""

from __future__ import annotations


def matches() -> None:
    """To come."""
