"""`teamclone sql`."""

from __future__ import annotations


def sql() -> None:
    """To come."""
