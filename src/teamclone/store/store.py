"""The interface of a store, however it keeps its rows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import pyarrow as pa

from teamclone.logs.match import Columns, Match
from teamclone.store import convert, schema
from teamclone.store.status import FileStatus


class Added(StrEnum):
    """The result of adding a match."""

    ADDED = "added"
    REPLACED = "replaced"
    """The store had this match with other commands, or without any."""
    UNCHANGED = "unchanged"
    """The store had all of it."""


@dataclass(frozen=True, slots=True)
class QueryRows:
    """The answer to a query, read batch by batch."""

    schema: pa.Schema
    batches: Iterator[pa.RecordBatch]


class Store(Protocol):
    """Many matches under one SQL schema (``teamclone.store.schema``).

    Readers may work while an ingest writes: they see each match complete or not at all.
    """

    @property
    def location(self) -> str:
        """The text that ``open_store`` opens the store by, in any process.

        It may hold a password, which its ``repr`` hides.
        """

    def match_ids(self) -> list[str]:
        """Return the ids of the matches, sorted."""

    def matches(self) -> pa.Table:
        """Return the table ``matches``, by start, file name and id."""

    def read_table(self, match_id: str, table: str, *, columns: Sequence[str] | None = None) -> pa.Table:
        """Return the rows of one match in one table, by ``Table.order``; ``columns`` None for all.

        Raises:
            StoreError: there is no such match, or its rows cannot be read.
            UsageError: there is no such table or column.
        """

    def read_match_columns(self, match_id: str, table: str, *, columns: Sequence[str] | None = None) -> Columns:
        """Return one match's rows as NumPy columns, typed as in ``Match``: NULL is NaN, text an object array.

        ``player_states`` columns have the shape (n_frames, 22), left 1..11 then right 1..11; those of every other table
        (n_rows,). ``columns`` None gives all but ``match_id``. Raises as ``read_table``.
        """
        wanted = schema.table(table)
        names = columns if columns is not None else [name for name in wanted.names if name != schema.MATCH_ID.name]
        return convert.numpy_columns(wanted, self.read_table(match_id, table, columns=names))

    def read_parameters(self, match_id: str) -> dict[str, dict[str, float | str]]:
        """Return the parameters of one match: ``{"server": {"ball_decay": 0.94, ...}, "player": {...}}``."""
        return convert.parameters(self.read_table(match_id, schema.PARAMETERS.name))

    def stream(self, query: str) -> QueryRows:
        """Return the answer to a query that only reads.

        Raises:
            UsageError: the query is wrong, or would change something.
        """

    def sql(self, query: str) -> pa.Table:
        """Return all of the answer to a query that only reads. Raises as ``stream``."""
        rows = self.stream(query)
        return pa.Table.from_batches(rows.batches, rows.schema)

    def add(self, match: Match) -> Added:
        """Take in a match: all of it or, if that fails, nothing.

        Raises:
            StoreError: the store cannot be written, for example because the disk is full.
        """

    def remove(self, match_id: str) -> None:
        """Forget a match; nothing happens where it is not there."""

    def files(self) -> list[FileStatus]:
        """Return the status of every source file ever ingested, by path."""

    def save_files(self, statuses: Iterable[FileStatus]) -> None:
        """Keep the status of these files, in place of an older status."""

    def writing(self) -> AbstractContextManager[None]:
        """Return a context in which an ingest writes.

        A store in a folder takes one at a time, deletes the remains of a killed one and, at the end, renews the
        database file for other programs; a server takes many.

        Raises:
            StoreError: another ingest holds it.
        """
