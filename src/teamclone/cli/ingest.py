"""`teamclone ingest`."""

from __future__ import annotations


def ingest() -> None:
    """To come."""
