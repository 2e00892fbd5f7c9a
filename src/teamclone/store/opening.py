"""Opening a store by its location."""

from __future__ import annotations

from pathlib import Path

from teamclone.errors import UsageError
from teamclone.store.parquet import MARKER, ParquetStore
from teamclone.store.store import Store


def create_store(location: str | Path) -> Store:
    """Return the store in this folder, or in the schema that a URL ``postgresql://...`` names; made if there is none.

    Raises:
        StoreError: there is something else, or a store of another format; the server cannot be reached or refuses.
        UsageError: the URL is wrong.
    """
    if url := _url(location):
        from teamclone.store.postgres.store import PostgresStore

        return PostgresStore.create(url)
    return ParquetStore.create(Path(location))


def open_store(location: str | Path) -> Store:
    """Return the store in this folder, or in the schema that a URL ``postgresql://...`` names.

    Raises:
        StoreError: there is none, or it is of another format; the text names the numbers and the remedy. Or the server
            cannot be reached or refuses.
        UsageError: the URL is wrong.
    """
    if url := _url(location):
        from teamclone.store.postgres.store import PostgresStore

        return PostgresStore.open(url)
    return ParquetStore.open(Path(location))


def is_store(location: Path) -> bool:
    """Return whether this folder was made by ``create_store``, of whatever format."""
    return (location / MARKER).is_file()


def _url(location: str | Path) -> str | None:
    """Return the location if it is a server's, else None.

    Raises:
        UsageError: it is the URL of something else.
    """
    if isinstance(location, Path) or "://" not in location:
        return None
    kind = location.partition("://")[0]
    if kind not in ("postgresql", "postgres"):
        raise UsageError(f"expected a folder or postgresql://USER:PASSWORD@HOST:PORT/DATABASE, got a {kind} URL")
    return location
