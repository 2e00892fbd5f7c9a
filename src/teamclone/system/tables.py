"""Tables as files for other programs: Parquet, CSV or JSON lines, by the ending of the name."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from teamclone.errors import UsageError

if TYPE_CHECKING:
    import pyarrow as pa

SUFFIXES = (".parquet", ".csv", ".jsonl")
"""Endings of a file of rows; each is a format."""


def check_suffix(out: Path) -> None:
    """Raise unless the ending of a file's name is one of SUFFIXES.

    Raises:
        UsageError: it is another one, or there is none.
    """
    if out.suffix not in SUFFIXES:
        raise UsageError(f"{out}: expected a name that ends in {', '.join(SUFFIXES)}, got {out.suffix or 'no ending'}")


class _Writer(Protocol):
    def write_table(self, table: pa.Table) -> None: ...

    def close(self) -> None: ...


class _JsonLines:
    """One JSON object a row and line."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", encoding="utf-8")

    def write_table(self, table: pa.Table) -> None:
        for batch in table.to_batches(max_chunksize=4096):
            self._file.writelines(f"{json.dumps(row, ensure_ascii=False)}\n" for row in batch.to_pylist())

    def close(self) -> None:
        self._file.close()


def writing_if(out: Path | None) -> AbstractContextManager[Callable[[pa.Table], None] | None]:
    """Return what `writing` does for a file that was asked for, None for none.

    Raises:
        UsageError: the ending of its name is none of SUFFIXES.
    """
    if out is None:
        return nullcontext()
    check_suffix(out)
    return writing(out)


@contextmanager
def writing(out: Path) -> Iterator[Callable[[pa.Table], None]]:
    """Return a function that appends a table to a file, which gets its name when all of it is there."""
    out.parent.mkdir(parents=True, exist_ok=True)
    temporary = out.with_name(f".{out.name}.part")
    temporary.unlink(missing_ok=True)  # it may be a link to anywhere
    writer: _Writer | None = None

    def write(table: pa.Table) -> None:
        nonlocal writer
        plain = table.cast(_plain(table.schema))
        if writer is None:
            writer = _writer(temporary, out.suffix, plain.schema)
        writer.write_table(plain)

    try:
        try:
            yield write
        finally:
            if writer is not None:
                writer.close()
        if writer is not None:
            temporary.replace(out)
    finally:
        temporary.unlink(missing_ok=True)


def _plain(schema: pa.Schema) -> pa.Schema:
    """Return a schema with words as words: a dictionary of words differs from match to match."""
    import pyarrow as pa

    return pa.schema(
        [field.with_type(pa.string()) if pa.types.is_dictionary(field.type) else field for field in schema]
    )


def _writer(path: Path, suffix: str, schema: pa.Schema) -> Any:
    import pyarrow.csv
    import pyarrow.parquet

    if suffix == ".parquet":
        return pyarrow.parquet.ParquetWriter(path, schema, compression="zstd")
    return pyarrow.csv.CSVWriter(path, schema) if suffix == ".csv" else _JsonLines(path)
