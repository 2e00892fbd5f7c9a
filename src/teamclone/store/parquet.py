"""The embedded store: one folder of Parquet files a match, queried through DuckDB."""

from __future__ import annotations

import errno
import os
import re
import shutil
import sys
import tempfile
import uuid
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import asdict
from pathlib import Path

import duckdb
import pyarrow as pa
import pyarrow.parquet as pq

from teamclone import __version__
from teamclone.errors import StoreError, UsageError
from teamclone.logs.columns import COUNTERS, counter_name
from teamclone.logs.match import Match
from teamclone.store import convert, schema
from teamclone.store.convert import Sources, Tables
from teamclone.store.schema import Table
from teamclone.store.status import FileStatus
from teamclone.store.store import Added, QueryRows, Store
from teamclone.system.documents import document_bytes, first_line, read_json, write_document, write_errors
from teamclone.system.files import digest, held

KIND = "teamclone store"
MARKER = "store.json"
DATABASE = "store.duckdb"

ENCODINGS = {
    **dict.fromkeys(("line", "frame", "cycle", *map(counter_name, COUNTERS)), "DELTA_BINARY_PACKED"),
    # Not for whole numbers, where it would be smallest: DuckDB before 2 reads it of floats alone.
    **dict.fromkeys(("x", "y", "neck", "stamina", "capacity", "effort", "view_width"), "BYTE_STREAM_SPLIT"),
    **dict.fromkeys(("ball_x", "ball_y", "ball_vx", "ball_vy"), "BYTE_STREAM_SPLIT"),
    **dict.fromkeys(("focus_distance", "focus_direction"), "BYTE_STREAM_SPLIT"),
    **dict.fromkeys(("text", "arg0", "arg1", "body", "legs", "stoppage", "view_quality"), "PLAIN"),
}
"""Columns that the default, a dictionary, makes larger or slower (measured: 5.1 MB a match instead of 8.6 MB)."""

STATISTICS = ("match_id", "frame", "cycle")
"""Columns by which queries choose rows: the others need no least and greatest value."""


class ParquetStore(Store):
    """A store in a folder. The layout is described by ``schema.markdown()``."""

    def __init__(self, root: Path) -> None:
        """Name a folder that is known to be a store; use ``open`` or ``create``."""
        self.root = root.absolute()
        self._matches = self.root / "matches"
        self._files = self.root / "files"
        self._unfinished = self.root / "unfinished"

    @property
    def location(self) -> str:
        """The store's folder, absolute."""
        return str(self.root)

    # -- opening ---------------------------------------------------------------------------------------------------

    @classmethod
    def open(cls, root: Path) -> ParquetStore:
        """Open the store in a folder.

        Raises:
            StoreError: there is none, it is not teamclone's, or its format is another one.
        """
        marker = root / MARKER
        try:
            found = read_json(marker)
        except FileNotFoundError:
            problem = "holds no store" if root.is_dir() else "no such store"
            raise StoreError(f"{root}: {problem}; make one with `teamclone ingest PATH --store {root}`") from None
        except NotADirectoryError:
            raise StoreError(f"{root}: expected a store, which is a folder, but this is a file") from None
        except (ValueError, UnicodeDecodeError):
            raise StoreError(f"{marker}: not JSON; this is no teamclone store, or it is damaged: ingest anew") from None
        if not isinstance(found, dict) or found.get("kind") != KIND:
            raise StoreError(f"{marker}: was not written by teamclone; name another folder with --store")
        schema.check_format(found.get("format"), found.get("teamclone"), where=str(marker), place="folder")
        return cls(root)

    @classmethod
    def create(cls, root: Path) -> ParquetStore:
        """Make a store in a new or empty folder, or open the one that is there.

        Raises:
            StoreError: the folder holds other things, is a file, or cannot be written.
        """
        if (root / MARKER).exists():
            return cls.open(root)
        if root.exists() and not root.is_dir():
            raise StoreError(f"{root}: expected a folder for the store, but this is a file; name another with --store")
        if root.is_dir() and any(root.iterdir()):
            raise StoreError(f"{root}: this folder holds other things than a store; name an empty or a new one")
        with _writing(root):
            root.mkdir(parents=True, exist_ok=True)
            marker = {"kind": KIND, "format": schema.FORMAT, "teamclone": __version__}
            # Last, so that a folder with the marker is a whole store.
            store = cls(root)
            for folder in (store._matches, store._files, store._unfinished):
                folder.mkdir(exist_ok=True)
            write_document(store.root / MARKER, marker)
        return store

    # -- reading ---------------------------------------------------------------------------------------------------

    def match_ids(self) -> list[str]:
        """Return the ids of the matches, sorted."""
        return sorted(entry.name for entry in os.scandir(self._matches) if entry.is_dir())

    def matches(self) -> pa.Table:
        """Return the table ``matches``, by start, file name and id."""
        return self.sql("select * from matches order by started_at nulls last, game_log, match_id")

    def read_table(self, match_id: str, table: str, *, columns: Sequence[str] | None = None) -> pa.Table:
        """Read a match's rows of one table from its Parquet file; see `Store.read_table`."""
        wanted = schema.table(table)
        names = [field.name for field in wanted.select(columns)]
        path = self._matches / match_id / f"{table}.parquet"
        try:
            return pq.read_table(path, columns=names, partitioning=None, use_threads=False).select(names)
        except FileNotFoundError:
            if match_id not in (known := self.match_ids()):
                raise StoreError(schema.unknown("match", match_id, tuple(known), where=str(self.root))) from None
            raise StoreError(f"{path}: is missing; {_remedy(path)}") from None
        except (pa.ArrowException, OSError) as error:
            raise StoreError(f"{path}: cannot be read ({first_line(error)}); {_remedy(path)}") from error

    def stream(self, query: str) -> QueryRows:
        """Answer a query with DuckDB; see `Store.stream`."""
        connection = self._connect()
        try:
            statements = duckdb.extract_statements(query)
            if len(statements) != 1:
                raise UsageError(f"expected one SQL statement, got {len(statements)}")
            if statements[0].type != duckdb.StatementType.SELECT:
                raise UsageError(
                    f"expected a statement that only reads (SELECT, WITH, SHOW, DESCRIBE, SUMMARIZE), "
                    f"got {statements[0].type.name}"
                )
            reader = pa.RecordBatchReader.from_stream(connection.sql(query))
        except duckdb.Error as error:
            raise _query_error(error) from None
        return QueryRows(reader.schema, _batches(reader))

    def _connect(self) -> duckdb.DuckDBPyConnection:
        """Return a database in memory with the views, since the store may be read-only, moved, or growing.

        Queries see the matches and no other file of this machine, and cannot change that.
        """
        connection = duckdb.connect(
            config={
                # A name that nobody else can have taken. Made where a query needs more than the memory.
                "temp_directory": str(Path(tempfile.gettempdir()) / f"teamclone-duckdb-{uuid.uuid4().hex}"),
                "python_enable_replacements": "false",  # a query must not see Python's variables
                "autoinstall_known_extensions": "false",  # nor fetch code
            }
        )
        # Of a pattern the pattern itself is looked at, too.
        allowed = ", ".join(_quoted(folder) for folder in {str(self._matches), _pattern(self._matches)})
        closing = (
            f"set allowed_directories = [{allowed}]",
            "set enable_external_access = false",
            "set lock_configuration = true",
        )
        for statement in (*self._views(), *closing):
            try:
                connection.execute(statement)
            except duckdb.Error as error:
                raise _query_error(error) from None
        return connection

    def _views(self) -> list[str]:
        """Return statements that define all tables over the files that are there now."""
        empty = not self.match_ids()
        return [_view(table, None if empty else self._matches) for table in schema.TABLES]

    # -- writing ---------------------------------------------------------------------------------------------------

    def add(self, match: Match) -> Added:
        """Write a match to a folder of its own, then move it among the matches in one step; see `Store.add`."""
        sources = convert.sources_of(match)
        home = self._matches / match.match_id
        known = self._sources(match.match_id)
        if known is not None and known.cover(sources):
            return Added.UNCHANGED
        tables = convert.tables_of(match)  # what goes wrong here is the match's fault, not the store's
        with _writing(self.root):
            self._unfinished.mkdir(exist_ok=True)
            folder = Path(tempfile.mkdtemp(prefix=f"{match.match_id}-", dir=self._unfinished))
            try:
                folder.chmod(0o755)  # mkdtemp's are private, a store may be shared
                _write_match(folder, tables, match_id=match.match_id, sources=sources)
                if known is not None:
                    self.remove(match.match_id)
                try:
                    folder.rename(home)
                except OSError as error:
                    # Two files of one match were read at once, and the other was first.
                    if error.errno not in (errno.EEXIST, errno.ENOTEMPTY):
                        raise
                    return Added.UNCHANGED
                _sync(self._matches)
            finally:
                shutil.rmtree(folder, ignore_errors=True)
        return Added.ADDED if known is None else Added.REPLACED

    def remove(self, match_id: str) -> None:
        """Delete a match's folder; nothing happens where there is none."""
        # Away in one step, so that no reader finds half a match; the name is new, the folder may be left over.
        grave = self._unfinished / f"{match_id}-{uuid.uuid4().hex}"
        with suppress(FileNotFoundError):
            (self._matches / match_id).rename(grave)
        shutil.rmtree(grave, ignore_errors=True)

    def _sources(self, match_id: str) -> Sources | None:
        """Return the hashes that a match was read from; None if the store has not got it."""
        try:
            return Sources(**read_json(self._matches / match_id / "meta.json")["sources"])
        except (FileNotFoundError, ValueError, KeyError, TypeError):
            return None

    def files(self) -> list[FileStatus]:
        """Return the status of every source file, by path; rows that cannot be read are left out."""
        found = []
        for path in self._files.glob("*.json"):
            # A row that cannot be read only costs reading its file again.
            with suppress(ValueError, KeyError, TypeError, FileNotFoundError):
                found.append(FileStatus.from_json(read_json(path)))
        return sorted(found, key=lambda status: status.path)

    def save_files(self, statuses: Iterable[FileStatus]) -> None:
        """Write one JSON document for each status."""
        with _writing(self.root):
            for status in statuses:
                write_document(self._files / f"{status.key}.json", status.to_json())

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Hold the store's lock while an ingest writes; see `Store.writing`."""
        with _writing(self.root):
            lock = self.root / ".lock"
            lock.touch()
        busy = StoreError(f"{self.root}: another ingest is writing to this store; wait for its end")
        with held(lock, busy=busy):
            self._tidy()
            try:
                yield
            finally:
                self._tidy()
                with _writing(self.root):
                    self._renew_database()

    def _tidy(self) -> None:
        """Delete the remains of killed writers.

        Under another name first: a worker that lives on though its connection is lost must not find its folder half
        emptied and put that among the matches.
        """
        if self._unfinished.is_symlink():
            raise StoreError(f"{self._unfinished}: is a link; what lies there would be deleted: remove the link")
        for left in self._unfinished.glob("*"):
            grave = self._unfinished / uuid.uuid4().hex
            with suppress(OSError):
                left.rename(grave)
            if grave.is_dir() and not grave.is_symlink():
                shutil.rmtree(grave, ignore_errors=True)
            else:
                grave.unlink(missing_ok=True)
        with _writing(self.root):
            self._unfinished.mkdir(exist_ok=True)

    def _renew_database(self) -> None:
        """Write ``store.duckdb`` unless its views are right; in one step, as another program may have it open."""
        path = self.root / DATABASE
        wanted = self._views()
        mark = digest("\n".join(wanted).encode())
        with suppress(duckdb.Error), duckdb.connect(str(path), read_only=True) as current:
            row = current.execute("select comment from duckdb_views() where view_name = 'matches'").fetchone()
            if row == (mark,):
                return
        fresh = self._unfinished / f"{uuid.uuid4().hex}.duckdb"
        # Made elsewhere: DuckDB cannot write to a path with a question mark in it.
        with tempfile.TemporaryDirectory(prefix="teamclone-") as scratch:
            with duckdb.connect(str(Path(scratch) / DATABASE)) as made:
                for statement in wanted:
                    try:
                        made.execute(statement)
                    except duckdb.Error as error:
                        raise _query_error(error) from None
                made.execute(f"comment on view matches is '{mark}'")
            shutil.copyfile(Path(scratch) / DATABASE, fresh)
        fresh.replace(path)


def _view(table: Table, matches: Path | None) -> str:
    """Return the statement that defines a table over the folders of all matches.

    It has no rows where there are no matches yet.
    """
    if table.rows:
        return schema.create_fixed(table)
    if matches is None:
        body = "select " + ", ".join(f'null::{field.sql_type} as "{field.name}"' for field in table.fields)
        body += " where false"
    else:
        files = f"{_pattern(matches)}/*/{table.name}.parquet"
        body = f"select * from read_parquet({_quoted(files)}, hive_partitioning = false)"
    return f"create view {table.name} as {body}"


def _pattern(folder: Path) -> str:
    """Return a folder as the beginning of a pattern, since in its own name *, ? and [ would be some."""
    return "".join(f"[{sign}]" if sign in "*?[" else sign for sign in str(folder))


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


def _batches(reader: pa.RecordBatchReader) -> Iterator[pa.RecordBatch]:
    try:
        yield from reader
    except (pa.ArrowException, OSError) as error:  # an error while DuckDB computes rows
        raise _query_error(error) from None


def _query_error(error: Exception) -> StoreError | UsageError:
    """Return what to say of an error of DuckDB: of a file of the store, or of the query."""
    damaged = re.search(r"'([^']*\.parquet)'", str(error))
    if damaged is None:
        return UsageError(_sql_error(error))
    return StoreError(f"{damaged[1]}: cannot be read ({_sql_error(error)}); {_remedy(Path(damaged[1]))}")


def _sql_error(error: Exception) -> str:
    """Return DuckDB's text without its drawing of the query."""
    return " ".join(str(error).split("\n\nLINE ")[0].split())


def _remedy(path: Path) -> str:
    return f"remove the folder {path.parent} and ingest the match again"


def _write_match(folder: Path, tables: Tables, *, match_id: str, sources: Sources) -> None:
    """Write all files of a match; they are on disk when this returns."""
    for name, rows in tables.items():
        packed = {column: ENCODINGS[column] for column in rows.column_names if column in ENCODINGS}
        pq.write_table(
            rows,
            folder / f"{name}.parquet",
            compression="zstd",
            compression_level=3,
            use_dictionary=[column for column in rows.column_names if column not in packed],
            column_encoding=packed or None,
            write_statistics=[column for column in STATISTICS if column in rows.column_names],
        )
    meta = {
        "format": schema.FORMAT,
        "match_id": match_id,
        "teamclone": __version__,
        "sources": asdict(sources),
        "rows": {name: rows.num_rows for name, rows in tables.items()},
        "units": {
            table.name: {field.name: field.unit for field in table.fields if field.unit}
            for table in schema.MATCH_TABLES
        },
    }
    (folder / "meta.json").write_bytes(document_bytes(meta))
    # All at the end, so that the disk is not waited for while there is work.
    for path in (*folder.iterdir(), folder):
        _sync(path)


def _sync(path: Path) -> None:
    """Sync a file's content or a folder's entries to disk, to survive a power cut; not on Windows."""
    if sys.platform == "win32":
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _writing(root: Path) -> AbstractContextManager[None]:
    return write_errors(
        root,
        error=StoreError,
        full="make room and ingest again, what is there already stays",
        denied="name a folder of your own with --store",
        kinds=(OSError, pa.ArrowException, duckdb.IOException),
    )
