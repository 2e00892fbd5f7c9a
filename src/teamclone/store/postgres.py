"""The store in a PostgreSQL database: the tables of a schema, filled and read as Arrow by COPY."""

from __future__ import annotations

import re
import time
import weakref
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Self, TypeVar
from urllib.parse import parse_qsl, unquote

import pyarrow as pa
from adbc_driver_manager import AdbcStatusCode, dbapi
from adbc_driver_postgresql.dbapi import connect

from teamclone import __version__
from teamclone.errors import StoreError, UsageError
from teamclone.logs.match import Columns, Match
from teamclone.store import convert, schema
from teamclone.store.convert import Sources
from teamclone.store.schema import Field, Table
from teamclone.store.status import FileStatus, Outcome
from teamclone.store.store import Added, Rows

T = TypeVar("T")

SCHEMA = "teamclone"
"""The schema of a URL that names none."""

MARKER = "teamclone_store"

SQL_NAMES = schema.SQL_NAMES | {
    "int8": "smallint",  # PostgreSQL has no smaller type
    "float64": "double precision",
    "string": 'text collate "C"',  # sorts as Python and DuckDB do
}

PAUSES_S = (0.0, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0)
"""How long to wait before each new attempt to reach a server that was reached before: a restart takes seconds."""

FIRST_PAUSES_S = (0.2, 0.5, 1.0, 2.0)
"""The same at first contact, when a wrong address is as likely as a restart."""

DEFAULTS = {
    "connect_timeout": "10",
    "fallback_application_name": "teamclone",
    # A host that vanished is noticed after a minute, not after hours.
    "keepalives_idle": "30",
    "keepalives_interval": "10",
    "keepalives_count": "3",
}
"""Settings of the connection that a URL may override."""

_TRANSIENT = re.compile(
    r"refused|no such file|starting up|shutting down|not yet accepting|recovery mode|too many clients|timeout expired|"
    r"closed the connection|reset by peer|unreachable|terminating connection",
    re.IGNORECASE,
)
"""Why a connection may fail now and succeed a moment later."""

_AGAIN = ("08", "57P01", "57P02", "57P03", "53300", "40001", "40P01")
"""SQLSTATEs (or their class) after which the same transaction may succeed: lost connections, restarts, deadlocks."""

_reached: set[str] = set()
"""The servers that this process has spoken to."""


class Secret(str):
    """A URL that shows its password to nobody who only looks at it: its ``repr`` is masked, also inside others'."""

    __slots__ = ()

    def __repr__(self) -> str:
        return repr(masked(self))


def masked(location: str) -> str:
    """The URL with ``***`` for its password. Up to the last @, since a password may hold one that is not encoded."""
    location = re.sub(r"^(\w+://[^:@/?]*):.*@", r"\1:***@", location, flags=re.DOTALL)
    return re.sub(r"(password=)[^&]*", r"\1***", location)


@dataclass(frozen=True, slots=True, kw_only=True)
class Location:
    """What a URL ``postgresql://user:password@host:port/database?schema=...`` means.

    Attributes:
        url: the URL.
        uri: what libpq takes: without ``schema``, with ``DEFAULTS``.
        schema: the schema that holds the tables.
        shown: the URL for messages.
        passwords: what messages must not show.
    """

    url: Secret
    uri: Secret
    schema: str
    shown: str
    passwords: tuple[str, ...]

    @classmethod
    def parse(cls, url: str) -> Self:
        """
        Raises:
            UsageError: a part of the URL is wrong; the text does not show its password.
        """
        base, _, query = url.partition("?")
        shown = masked(url)
        authority, slash, path = base.partition("://")[2].partition("/")
        if "@" in path or "@" in authority.rpartition("@")[0] or "#" in base or ("@" in query and "@" not in base):
            raise UsageError(
                f"{shown}: expected postgresql://USER:PASSWORD@HOST:PORT/DATABASE; in the password write %40 for @, "
                "%2F for /, %3F for ?, %23 for #, or leave it to PGPASSWORD or ~/.pgpass"
            )
        options = dict(parse_qsl(query, keep_blank_values=True))
        name = options.pop("schema", SCHEMA)
        if not name or "\0" in name or name.startswith("pg_"):
            raise UsageError(f"{shown}: schema {name!r} cannot be used, name another one with ?schema=")
        kept = [part for part in query.split("&") if part and not part.startswith("schema=")]
        kept += [f"{option}={value}" for option, value in DEFAULTS.items() if option not in options]
        _, _, password = authority.rpartition("@")[0].partition(":")
        passwords = {password, unquote(password), options.get("password", ""), options.get("sslpassword", "")}
        return cls(
            url=Secret(url),
            uri=Secret(f"{base}{'' if slash else '/'}?{'&'.join(kept)}"),
            schema=name,
            shown=shown,
            passwords=tuple(sorted(passwords - {""}, key=len, reverse=True)),
        )


class PostgresStore:
    """A store in one schema of a PostgreSQL database (15 or newer).

    Every match is one transaction under a lock of its own, so that several ingests may work at once. Connections are
    kept for the next question and made anew when they are lost; threads may share a store.
    """

    def __init__(self, location: Location) -> None:
        """Of a schema that is known to be a store; use ``open`` or ``create``."""
        self._location = location
        self._schema = _name(location.schema)
        self._idle: deque[dbapi.Connection] = deque()
        weakref.finalize(self, _close_all, self._idle)

    @property
    def location(self) -> str:
        return self._location.url

    # -- opening ---------------------------------------------------------------------------------------------------

    @classmethod
    def open(cls, url: str) -> Self:
        store = cls(Location.parse(url))
        shown = store._location.shown

        def look(cursor: dbapi.Cursor) -> None:
            if not store._is_there(cursor):
                raise StoreError(
                    f"{shown}: schema {store._location.schema} holds no store; "
                    f"make one with `teamclone ingest PATH --store {shown}`"
                )

        store._transaction(look)
        return store

    @classmethod
    def create(cls, url: str) -> Self:
        store = cls(Location.parse(url))
        store._transaction(store._create)
        return store

    def _is_there(self, cursor: dbapi.Cursor) -> bool:
        """Whether the schema holds a store of our format.

        Raises:
            StoreError: its format is another one.
        """
        if not _rows(cursor, "select to_regclass($1) is not null as known", f"{self._schema}.{MARKER}")[0]["known"]:
            return False
        for row in _rows(cursor, f"select format, teamclone from {self._schema}.{MARKER}"):
            schema.check_format(row["format"], row["teamclone"], where=self._location.shown, place="schema")
        return True

    def _create(self, cursor: dbapi.Cursor) -> None:
        name, shown = self._location.schema, self._location.shown
        self._lock(cursor, "create")
        if self._is_there(cursor):
            return
        if not _rows(cursor, "select 1 as one from pg_namespace where nspname = $1", name):
            cursor.execute(f"create schema {self._schema}")
        elif _rows(cursor, "select 1 as one from pg_class where relnamespace = $1::regnamespace limit 1", self._schema):
            raise StoreError(f"{shown}: schema {name} holds other things than a store; name another with ?schema=")
        for statement in self._definitions():
            cursor.execute(statement)

    def _definitions(self) -> Iterator[str]:
        """The statements that make all tables."""
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
        rows = self._transaction(lambda cursor: _rows(cursor, f"select match_id from {self._schema}.matches"))
        return sorted(row["match_id"] for row in rows)

    def matches(self) -> pa.Table:
        fields = schema.MATCHES.fields
        return self._transaction(
            lambda cursor: self._read(
                cursor, schema.MATCHES, fields, "order by started_at nulls last, game_log, match_id"
            )
        )

    def read_table(self, match_id: str, table: str, *, columns: Sequence[str] | None = None) -> pa.Table:
        wanted = schema.table(table)
        fields = wanted.select(columns)
        if wanted not in schema.MATCH_TABLES:
            raise UsageError(f"table {table} is the same for all matches; ask for it with sql")
        where = f"where match_id = {_text(match_id)} order by {wanted.order}"

        def read(cursor: dbapi.Cursor) -> pa.Table:
            # The rows of a match lie together and the key has their order: by it no other match is read, nothing is
            # sorted on disk, whatever the server knows of the tables by now.
            _rows(
                cursor,
                "select set_config('enable_seqscan', 'off', true) as seqscan, "
                "set_config('enable_bitmapscan', 'off', true) as bitmapscan, "
                "set_config('enable_sort', 'off', true) as sort",
            )
            rows = self._read(cursor, wanted, fields, where)
            if rows.num_rows == 0 and not _rows(
                cursor, f"select 1 as one from {self._schema}.matches where match_id = $1", match_id
            ):
                known = sorted(row["match_id"] for row in _rows(cursor, f"select match_id from {self._schema}.matches"))
                raise StoreError(schema.unknown("match", match_id, tuple(known), where=self._location.shown))
            return rows

        return self._transaction(read)

    def _read(self, cursor: dbapi.Cursor, table: Table, fields: tuple[Field, ...], rest: str) -> pa.Table:
        names = ", ".join(_name(field.name) for field in fields)
        cursor.execute(f"select {names} from {self._schema}.{table.name} {rest}")
        return cursor.fetch_arrow_table().cast(schema.arrow_schema(fields))

    def read_match_columns(self, match_id: str, table: str, *, columns: Sequence[str] | None = None) -> Columns:
        wanted = schema.table(table)
        names = columns if columns is not None else [name for name in wanted.names if name != schema.MATCH_ID.name]
        return convert.numpy_columns(wanted, self.read_table(match_id, table, columns=names))

    def read_parameters(self, match_id: str) -> dict[str, dict[str, float | str]]:
        return convert.parameters(self.read_table(match_id, schema.PARAMETERS.name))

    def stream(self, query: str) -> Rows:
        _check_reads(query)
        connection, cursor = self._ask(query)
        try:
            reader = cursor.fetch_record_batch()
        except _ERRORS as error:
            _close(cursor, connection)
            raise self._failure(error, asked=True) from None
        return Rows(_plain_schema(reader.schema), self._batches(reader, cursor, connection))

    def _ask(self, query: str) -> tuple[dbapi.Connection, dbapi.Cursor]:
        """A connection of its own that computes the answer to a query."""

        def ask() -> tuple[dbapi.Connection, dbapi.Cursor]:
            connection = self._connect()
            cursor = connection.cursor()
            try:
                cursor.execute("begin transaction read only")
                cursor.execute(f"set local search_path to {self._schema}, public")
                # Only a query can be a cursor's: the server's own parser refuses COPY, SET, two statements, ...
                cursor.execute(f"declare question no scroll cursor for\n{query}")
                cursor.execute("close question")
                cursor.execute(query.rstrip("; \t\r\n") + "\n")
            except BaseException:
                _close(cursor, connection)
                raise
            return connection, cursor

        return self._again(ask, asked=True)

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
        except (*_ERRORS, pa.ArrowException) as error:  # what the server finds wrong while it computes
            raise self._failure(error, asked=True) from None
        finally:
            reader.close()
            _close(cursor, connection)

    def sql(self, query: str) -> pa.Table:
        rows = self.stream(query)
        return pa.Table.from_batches(rows.batches, rows.schema)

    # -- writing ---------------------------------------------------------------------------------------------------

    def add(self, match: Match) -> Added:
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
            _rows(
                cursor,
                f"insert into {self._schema}.sources values ($1, $2, $3) returning match_id",
                match.match_id,
                sources.game_log,
                sources.command_log,
            )
            return Added.ADDED if known is None else Added.REPLACED

        return self._transaction(add)

    def remove(self, match_id: str) -> None:
        def remove(cursor: dbapi.Cursor) -> None:
            self._lock(cursor, match_id)
            cursor.execute(f"delete from {self._schema}.matches where match_id = {_text(match_id)}")

        self._transaction(remove)

    def _sources(self, cursor: dbapi.Cursor, match_id: str) -> Sources | None:
        found = _rows(cursor, f"select game_log, command_log from {self._schema}.sources where match_id = $1", match_id)
        return Sources(**found[0]) if found else None

    def files(self) -> list[FileStatus]:
        rows = self._transaction(lambda cursor: _rows(cursor, f"select * from {self._schema}.files"))
        return sorted(map(_status, rows), key=lambda status: status.path)

    def save_files(self, statuses: Iterable[FileStatus]) -> None:
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
        self._transaction(lambda cursor: cursor.executemany(statement, batch))

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Nothing to hold and nothing to tidy: a match is a transaction under its own lock."""
        yield

    def _lock(self, cursor: dbapi.Cursor, what: str) -> None:
        """Wait until nobody else writes ``what``, and hold it until this transaction ends."""
        # Where the writer's machine vanishes, the server notices and lets go.
        _rows(
            cursor,
            "select set_config('tcp_keepalives_idle', '30', true) as idle, "
            "set_config('tcp_keepalives_interval', '10', true) as interval, "
            "set_config('tcp_keepalives_count', '3', true) as count, "
            "pg_advisory_xact_lock(hashtextextended($1, 0)) is null as held",
            f"teamclone {self._location.schema} {what}",
        )

    # -- connections -----------------------------------------------------------------------------------------------

    def _transaction(self, work: Callable[[dbapi.Cursor], T]) -> T:
        """What ``work`` gives, done in one transaction: all of it, or nothing and an error."""

        def once() -> T:
            connection = self._idle.pop() if self._idle else self._connect()
            cursor = connection.cursor()
            try:
                cursor.execute("begin")
                result = work(cursor)
                cursor.execute("commit")
            except BaseException:
                _close(cursor, connection)  # the server rolls back
                raise
            cursor.close()
            self._idle.append(connection)
            return result

        return self._again(once)

    def _again(self, attempt: Callable[[], T], *, asked: bool = False) -> T:
        """What ``attempt`` gives, tried again while the server is away."""
        pauses = iter(PAUSES_S if self._location.uri in _reached else FIRST_PAUSES_S)
        while True:
            try:
                return attempt()
            except _ERRORS as error:
                pause = next(pauses, None) if _passing(error) else None
                if pause is None:
                    raise self._failure(error, asked=asked) from None
                _close_all(self._idle)  # they are lost, too
                time.sleep(pause)

    def _connect(self) -> dbapi.Connection:
        connection: dbapi.Connection = connect(self._location.uri, autocommit=True)
        _reached.add(self._location.uri)
        return connection

    def _failure(self, error: Exception, *, asked: bool = False) -> StoreError | UsageError:
        """The error for the user; ``asked``: his own query may be what is wrong."""
        state = getattr(error, "sqlstate", None) or ""
        told = _told(error)
        for password in self._location.passwords:
            told = told.replace(password, "***")
        shown = self._location.shown
        if _connecting(error):
            return StoreError(f"{shown}: cannot connect ({told}){_remedy(told)}")
        if _passing(error):
            return StoreError(
                f"{shown}: lost the connection ({told}); what was added before stays, try again when the server is back"
            )
        if asked and "multiple commands" in told:
            return UsageError("expected one SQL statement, got several")
        if asked and not state.startswith(("53", "58", "XX")):
            return UsageError(told)
        if state == "53100":
            return StoreError(f"{shown}: the server's disk is full; make room and ingest again, what is there stays")
        if state == "42501":
            return StoreError(f"{shown}: {told}; docs/howto/postgresql.md lists the rights that a user needs")
        return StoreError(f"{shown}: {told}")


def _rows(cursor: dbapi.Cursor, query: str, *values: str | None) -> list[dict[str, Any]]:
    cursor.execute(query, values or None)
    found: list[dict[str, Any]] = cursor.fetch_arrow_table().to_pylist()
    return found


def _trust_keys(cursor: dbapi.Cursor) -> None:
    """Where the user may, let this transaction skip the check that each row's match exists: it just wrote the match.

    The check is one query a row and costs as much as all the rest (docs/howto/postgresql.md).
    """
    _rows(
        cursor,
        "select set_config('session_replication_role', 'replica', true) as role "
        "where has_parameter_privilege('session_replication_role', 'set')",
    )


def _close(*handles: dbapi.Cursor | dbapi.Connection) -> None:
    for handle in handles:
        with suppress(Exception):
            handle.close()


def _close_all(connections: deque[dbapi.Connection]) -> None:
    while connections:
        _close(connections.pop())


def _name(name: str) -> str:
    """A name as SQL."""
    return '"' + name.replace('"', '""') + '"'


def _text(text: str) -> str:
    """A text as SQL."""
    return "'" + text.replace("'", "''") + "'"


# -- errors ----------------------------------------------------------------------------------------------------------

_ERRORS = (dbapi.Error, OSError)
"""What the driver raises; the second while it reads the rows of an answer."""


def _connecting(error: Exception) -> bool:
    return "Failed to connect" in str(error)


def _passing(error: Exception) -> bool:
    """Whether the same may succeed in a moment."""
    if state := getattr(error, "sqlstate", None):
        return bool(state.startswith(_AGAIN))
    if _connecting(error):
        return bool(_TRANSIENT.search(str(error)))
    if "ERROR: " in str(error):  # the server answers
        return False
    return isinstance(error, OSError) or getattr(error, "status_code", None) is AdbcStatusCode.IO


def _told(error: Exception) -> str:
    """What the server says, on one line: its message, detail and hint without the query."""
    said = re.findall(r"(?:ERROR|FATAL|PANIC|DETAIL|HINT): +(.+)", str(error))
    if not said:
        first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        said = [re.sub(r"^[A-Z_]+: (\[libpq\] )?(Failed to connect: )?", "", first)]
    return "; ".join(re.sub(r"\.? SQLSTATE: \w+$", "", text).strip().rstrip(".") for text in said)


def _remedy(told: str) -> str:
    """What to do about a connection that failed."""
    for sign, remedy in (
        ("password", "check user and password (PGPASSWORD and ~/.pgpass work, too)"),
        ('role "', "check the user"),
        ('database "', "make it with `createdb`, or name another"),
        ("host name", "check the host"),
        ("too many", "allow more connections, or use fewer --jobs"),
        ("invalid", "see docs/howto/postgresql.md for the form of the URL"),
    ):
        if sign in told:
            return f"; {remedy}"
    return "; does the server run there, and may you reach it?"


# -- queries of users ------------------------------------------------------------------------------------------------

_FIRST_WORD = re.compile(r"(?:\s|\(|--[^\n]*(?:\n|$)|/\*.*?\*/)*(\w*)", re.DOTALL)
_QUERIES = ("select", "with", "values", "table")


def _check_reads(query: str) -> None:
    """Say clearly what is no query; what looks like one is the server's to judge."""
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
    """The types of an answer without PostgreSQL's own: numeric as double, others as they come (text or bytes)."""

    def plain(kind: pa.DataType) -> pa.DataType:
        if not isinstance(kind, pa.OpaqueType):
            return kind
        return pa.float64() if kind.type_name == "numeric" else kind.storage_type

    return pa.schema([pa.field(field.name, plain(field.type)) for field in found])


def _plain(column: pa.Array, kind: pa.DataType) -> pa.Array:
    return (column.storage if isinstance(column, pa.ExtensionArray) else column).cast(kind)


# -- the status of files ---------------------------------------------------------------------------------------------


def _escaped(text: str | None) -> str | None:
    r"""A text that PostgreSQL takes: zero bytes and bytes of file names that are no UTF-8 become ``\u0000``."""
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
            "outcome": Outcome(row["outcome"]),
            "path": _unescaped(row["path"]),
            "error": _unescaped(row["error"]),
        }
    )
