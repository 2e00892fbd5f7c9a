"""The store in a PostgreSQL database: the tables of a schema, filled and read as Arrow by COPY."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Self

import pyarrow as pa
from adbc_driver_manager import dbapi

from teamclone import __version__
from teamclone.errors import StoreError, UsageError
from teamclone.logs.match import Match
from teamclone.store import convert, schema
from teamclone.store.convert import Sources
from teamclone.store.postgres.connection import ERRORS, Connections, close, fetch
from teamclone.store.postgres.location import Location
from teamclone.store.schema import Field, Table
from teamclone.store.status import FileOutcome, FileStatus
from teamclone.store.store import Added, QueryRows, Store

MARKER = "teamclone_store"

SQL_NAMES = schema.SQL_NAMES | {
    "int8": "smallint",  # PostgreSQL has no smaller type
    "float64": "double precision",
    "string": 'text collate "C"',  # sorts as Python and DuckDB do
}


class PostgresStore(Store):
    """A store in one schema of a PostgreSQL database (15 or newer).

    Every match is one transaction under a lock of its own, so that several ingests may work at once. Threads may share
    a store.
    """

    def __init__(self, location: Location) -> None:
        """Name a schema that is known to be a store; use ``open`` or ``create``."""
        self._location = location
        self._schema = _name(location.schema)
        self._connections = Connections(location)

    @property
    def location(self) -> str:
        """The store's URL, whose ``repr`` hides the password."""
        return self._location.url

    # -- opening ---------------------------------------------------------------------------------------------------

    @classmethod
    def open(cls, url: str) -> Self:
        """Open the store that a URL names.

        Raises:
            UsageError: the URL is wrong.
            StoreError: the server cannot be reached, its schema holds no store, or its format is another one.
        """
        store = cls(Location.parse(url))
        shown = store._location.shown

        def look(cursor: dbapi.Cursor) -> None:
            if not store._is_there(cursor):
                raise StoreError(
                    f"{shown}: schema {store._location.schema} holds no store; "
                    f"make one with `teamclone ingest PATH --store {shown}`"
                )

        store._connections.transaction(look)
        return store

    @classmethod
    def create(cls, url: str) -> Self:
        """Make a store in the schema that a URL names, or open the one that is there.

        Raises:
            UsageError: the URL is wrong.
            StoreError: the server cannot be reached, refuses, or the schema holds other things.
        """
        store = cls(Location.parse(url))
        store._connections.transaction(store._create)
        return store

    def _is_there(self, cursor: dbapi.Cursor) -> bool:
        """Return whether the schema holds a store of our format.

        Raises:
            StoreError: its format is another one.
        """
        if not fetch(cursor, "select to_regclass($1) is not null as known", f"{self._schema}.{MARKER}")[0]["known"]:
            return False
        for row in fetch(cursor, f"select format, teamclone from {self._schema}.{MARKER}"):
            schema.check_format(row["format"], row["teamclone"], where=self._location.shown, place="schema")
        return True

    def _create(self, cursor: dbapi.Cursor) -> None:
        name, shown = self._location.schema, self._location.shown
        self._lock(cursor, "create")
        if self._is_there(cursor):
            return
        if not fetch(cursor, "select 1 as one from pg_namespace where nspname = $1", name):
            cursor.execute(f"create schema {self._schema}")
        elif fetch(cursor, "select 1 as one from pg_class where relnamespace = $1::regnamespace limit 1", self._schema):
            raise StoreError(f"{shown}: schema {name} holds other things than a store; name another with ?schema=")
        for statement in self._definitions():
            cursor.execute(statement)

    def _definitions(self) -> Iterator[str]:
        """Yield the statements that make all tables."""
        yield f"create table {self._schema}.{MARKER} (format integer not null, teamclone text not null)"
        yield f"insert into {self._schema}.{MARKER} values ({schema.FORMAT}, {_text(__version__)})"
        for table in schema.TABLES:
            name = f"{self._schema}.{table.name}"
            yield f"create table {name} ({', '.join(self._columns(table))})"
            yield f"comment on table {name} is {_text(table.about)}"
            for field in table.fields:
                about = f"{field.about} [{field.unit}]" if field.unit else field.about
                yield f"comment on column {name}.{_name(field.name)} is {_text(about)}"
            if table.rows:
                values = ", ".join(f"({number}, {_text(word)})" for number, word in table.rows)
                yield f"insert into {name} values {values}"
        # A problem has no key, see schema.PROBLEMS.
        yield f"create index on {self._schema}.{schema.PROBLEMS.name} (match_id)"
        yield (
            f'create table {self._schema}.sources (match_id text collate "C" primary key '
            f"references {self._schema}.matches on delete cascade, game_log text, command_log text)"
        )
        yield (
            f"create table {self._schema}.files (key text primary key, path text not null, outcome text not null, "
            "rows bigint not null, match_id text, error text, size bigint not null, mtime_ns bigint not null, "
            "content text)"
        )

    def _columns(self, table: Table) -> Iterator[str]:
        for field in table.fields:
            yield f"{_name(field.name)} {SQL_NAMES[field.dtype]}"
        if table is not schema.PROBLEMS:
            yield f"primary key ({', '.join(map(_name, table.key))})"
        if table in schema.MATCH_TABLES and table is not schema.MATCHES:
            yield f"foreign key (match_id) references {self._schema}.matches on delete cascade"

    # -- reading ---------------------------------------------------------------------------------------------------

    def match_ids(self) -> list[str]:
        """Return the ids of the matches, sorted."""
        rows = self._connections.transaction(
            lambda cursor: fetch(cursor, f"select match_id from {self._schema}.matches")
        )
        return sorted(row["match_id"] for row in rows)

    def matches(self) -> pa.Table:
        """Return the table ``matches``, by start, file name and id."""
        fields = schema.MATCHES.fields
        return self._connections.transaction(
            lambda cursor: self._read(
                cursor, schema.MATCHES, fields, "order by started_at nulls last, game_log, match_id"
            )
        )

    def read_table(self, match_id: str, table: str, *, columns: Sequence[str] | None = None) -> pa.Table:
        """Read a match's rows of one table by COPY; see `Store.read_table`."""
        wanted = schema.table(table)
        fields = wanted.select(columns)
        if wanted not in schema.MATCH_TABLES:
            raise UsageError(f"table {table} is the same for all matches; ask for it with sql")
        where = f"where match_id = {_text(match_id)} order by {wanted.order}"

        def read(cursor: dbapi.Cursor) -> pa.Table:
            # The rows of a match lie together and the key has their order: by it no other match is read, nothing is
            # sorted on disk, whatever the server knows of the tables by now.
            fetch(
                cursor,
                "select set_config('enable_seqscan', 'off', true) as seqscan, "
                "set_config('enable_bitmapscan', 'off', true) as bitmapscan, "
                "set_config('enable_sort', 'off', true) as sort",
            )
            rows = self._read(cursor, wanted, fields, where)
            if rows.num_rows == 0 and not fetch(
                cursor, f"select 1 as one from {self._schema}.matches where match_id = $1", match_id
            ):
                known = sorted(row["match_id"] for row in fetch(cursor, f"select match_id from {self._schema}.matches"))
                raise StoreError(schema.unknown("match", match_id, tuple(known), where=self._location.shown))
            return rows

        return self._connections.transaction(read)

    def _read(self, cursor: dbapi.Cursor, table: Table, fields: tuple[Field, ...], rest: str) -> pa.Table:
        names = ", ".join(_name(field.name) for field in fields)
        cursor.execute(f"select {names} from {self._schema}.{table.name} {rest}")
        return cursor.fetch_arrow_table().cast(schema.arrow_schema(fields))

    def stream(self, query: str) -> QueryRows:
        """Answer a query in a read-only transaction on a connection of its own; see `Store.stream`."""
        _check_reads(query)
        connection, cursor = self._ask(query)
        try:
            reader = cursor.fetch_record_batch()
        except ERRORS as error:
            close(cursor, connection)
            raise self._connections.failure(error, asked=True) from None
        return QueryRows(_plain_schema(reader.schema), self._batches(reader, cursor, connection))

    def _ask(self, query: str) -> tuple[dbapi.Connection, dbapi.Cursor]:
        """Return a connection of its own that computes the answer to a query."""

        def ask() -> tuple[dbapi.Connection, dbapi.Cursor]:
            connection = self._connections.connect()
            cursor = connection.cursor()
            try:
                cursor.execute("begin transaction read only")
                cursor.execute(f"set local search_path to {self._schema}, public")
                # Only a query can be a cursor's: the server's own parser refuses COPY, SET, two statements, ...
                cursor.execute(f"declare question no scroll cursor for\n{query}")
                cursor.execute("close question")
                cursor.execute(query.rstrip("; \t\r\n") + "\n")
            except BaseException:
                close(cursor, connection)
                raise
            return connection, cursor

        return self._connections.again(ask, asked=True)

    def _batches(
        self, reader: pa.RecordBatchReader, cursor: dbapi.Cursor, connection: dbapi.Connection
    ) -> Iterator[pa.RecordBatch]:
        plain = _plain_schema(reader.schema)
        try:
            for batch in reader:
                yield pa.RecordBatch.from_arrays(
                    [_plain(column, kind) for column, kind in zip(batch.columns, plain.types, strict=True)],
                    schema=plain,
                )
        except (*ERRORS, pa.ArrowException) as error:  # an error while the server computes rows
            raise self._connections.failure(error, asked=True) from None
        finally:
            reader.close()
            close(cursor, connection)

    # -- writing ---------------------------------------------------------------------------------------------------

    def add(self, match: Match) -> Added:
        """Insert a match in one transaction under the match's lock; see `Store.add`."""
        sources = convert.sources_of(match)

        def add(cursor: dbapi.Cursor) -> Added:
            self._lock(cursor, match.match_id)
            known = self._sources(cursor, match.match_id)
            if known is not None and known.cover(sources):
                return Added.UNCHANGED
            if known is not None:
                cursor.execute(f"delete from {self._schema}.matches where match_id = {_text(match.match_id)}")
            _trust_keys(cursor)
            rows = convert.tables_of(match)
            for table in schema.MATCH_TABLES:  # matches first: the others refer to it
                cursor.adbc_ingest(table.name, rows[table.name], mode="append", db_schema_name=self._location.schema)
            fetch(
                cursor,
                f"insert into {self._schema}.sources values ($1, $2, $3) returning match_id",
                match.match_id,
                sources.game_log,
                sources.command_log,
            )
            return Added.ADDED if known is None else Added.REPLACED

        return self._connections.transaction(add)

    def remove(self, match_id: str) -> None:
        """Delete a match and its rows in all tables; nothing happens where it is not there."""

        def remove(cursor: dbapi.Cursor) -> None:
            self._lock(cursor, match_id)
            cursor.execute(f"delete from {self._schema}.matches where match_id = {_text(match_id)}")

        self._connections.transaction(remove)

    def _sources(self, cursor: dbapi.Cursor, match_id: str) -> Sources | None:
        found = fetch(cursor, f"select game_log, command_log from {self._schema}.sources where match_id = $1", match_id)
        return Sources(**found[0]) if found else None

    def files(self) -> list[FileStatus]:
        """Return the status of every source file, by path."""
        rows = self._connections.transaction(lambda cursor: fetch(cursor, f"select * from {self._schema}.files"))
        return sorted(map(_status, rows), key=lambda status: status.path)

    def save_files(self, statuses: Iterable[FileStatus]) -> None:
        """Insert the statuses, or update the rows of files that have one."""
        # In one order, so that two ingests do not wait for each other.
        rows = [_row(status) for status in sorted(statuses, key=lambda status: status.key)]
        if not rows:
            return
        names = list(rows[0])
        types = {"rows": pa.int64(), "size": pa.int64(), "mtime_ns": pa.int64()}
        batch = pa.RecordBatch.from_pydict(
            {name: pa.array([row[name] for row in rows], types.get(name, pa.string())) for name in names}
        )
        places = ", ".join(f"${place}" for place in range(1, len(names) + 1))
        changes = ", ".join(f"{name} = excluded.{name}" for name in names)
        statement = (
            f"insert into {self._schema}.files ({', '.join(names)}) values ({places}) "
            f"on conflict (key) do update set {changes}"
        )
        self._connections.transaction(lambda cursor: cursor.executemany(statement, batch))

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Do nothing: a match is a transaction under its own lock."""
        yield

    def _lock(self, cursor: dbapi.Cursor, what: str) -> None:
        """Wait until no other transaction writes ``what``, and lock it until this one ends."""
        # Where the writer's machine vanishes, the server notices and lets go.
        fetch(
            cursor,
            "select set_config('tcp_keepalives_idle', '30', true) as idle, "
            "set_config('tcp_keepalives_interval', '10', true) as interval, "
            "set_config('tcp_keepalives_count', '3', true) as count, "
            "pg_advisory_xact_lock(hashtextextended($1, 0)) is null as held",
            f"teamclone {self._location.schema} {what}",
        )


def _trust_keys(cursor: dbapi.Cursor) -> None:
    """Skip the check that each row's match exists, where the user may: this transaction just wrote the match.

    The check is one query a row and costs as much as all the rest (docs/howto/postgresql.md).
    """
    fetch(
        cursor,
        "select set_config('session_replication_role', 'replica', true) as role "
        "where has_parameter_privilege('session_replication_role', 'set')",
    )


def _name(name: str) -> str:
    """Return a name as SQL."""
    return '"' + name.replace('"', '""') + '"'


def _text(text: str) -> str:
    """Return a text as SQL."""
    return "'" + text.replace("'", "''") + "'"


# -- queries of users ------------------------------------------------------------------------------------------------

_FIRST_WORD = re.compile(r"(?:\s|\(|--[^\n]*(?:\n|$)|/\*.*?\*/)*(\w*)", re.DOTALL)
_QUERIES = ("select", "with", "values", "table")


def _check_reads(query: str) -> None:
    """Raise on a statement that is clearly no query; the server judges the rest."""
    found = _FIRST_WORD.match(query)
    word = found[1].lower() if found else ""
    if not word:
        raise UsageError("expected one SQL statement, got 0")
    if word not in _QUERIES:
        raise UsageError(
            f"expected a statement that only reads ({', '.join(_QUERIES).upper()}), got {word.upper()}; "
            "information_schema.columns lists the columns of a table"
        )


def _plain_schema(found: pa.Schema) -> pa.Schema:
    """Return the types of an answer without PostgreSQL's own: numeric as double, others as text or bytes."""

    def plain(kind: pa.DataType) -> pa.DataType:
        if not isinstance(kind, pa.OpaqueType):
            return kind
        return pa.float64() if kind.type_name == "numeric" else kind.storage_type

    return pa.schema([pa.field(field.name, plain(field.type)) for field in found])


def _plain(column: pa.Array, kind: pa.DataType) -> pa.Array:
    return (column.storage if isinstance(column, pa.ExtensionArray) else column).cast(kind)


# -- the status of files ---------------------------------------------------------------------------------------------


def _escaped(text: str | None) -> str | None:
    r"""Return a text that PostgreSQL takes: zero bytes and bytes of file names that are no UTF-8 become ``\u0000``."""
    if text is None:
        return None
    return re.sub("[\\\\\0\ud800-\udfff]", lambda sign: rf"\u{ord(sign[0]):04x}" if sign[0] != "\\" else r"\\", text)


def _unescaped(text: str | None) -> str | None:
    if text is None:
        return None
    return re.sub(r"\\(\\|u([0-9a-f]{4}))", lambda sign: chr(int(sign[2], 16)) if sign[2] else "\\", text)


def _row(status: FileStatus) -> dict[str, Any]:
    row = {"key": status.key, **status.to_json()}
    return row | {"outcome": str(status.outcome), "path": _escaped(status.path), "error": _escaped(status.error)}


def _status(row: dict[str, Any]) -> FileStatus:
    values = {name: value for name, value in row.items() if name != "key"}
    return FileStatus(
        **values
        | {
            "outcome": FileOutcome(row["outcome"]),
            "path": _unescaped(row["path"]),
            "error": _unescaped(row["error"]),
        }
    )
