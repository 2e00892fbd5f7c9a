"""`teamclone sql`."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Iterator

    from teamclone.store.store import QueryRows

SHOWN = 200
"""Rows of a table on the terminal; --csv and --json print all."""


def sql(
    query: Annotated[str, typer.Argument(help="A statement that only reads; - takes it from standard input.")],
    store: Annotated[str, typer.Option(help="A folder or postgresql://USER:PASSWORD@HOST/DATABASE.")],
    as_csv: Annotated[bool, typer.Option("--csv", help="Print CSV, all rows.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON list of objects, all rows.")] = False,
) -> None:
    """Ask a store in SQL. docs/reference/data-model.md lists the tables."""
    from teamclone.errors import UsageError
    from teamclone.store import open_store

    if as_csv and as_json:
        raise UsageError("--csv and --json exclude each other")
    try:
        text = sys.stdin.read() if query == "-" else query
        text.encode()
    except UnicodeError:
        raise UsageError("expected a query in UTF-8, got bytes of another encoding") from None
    rows = open_store(store).stream(text)
    if as_csv:
        print_csv(rows)
    elif as_json:
        print_objects(rows)
    else:
        print_rows(rows)


def values(rows: QueryRows) -> Iterator[list[Any]]:
    """Yield the rows as Python values that JSON and CSV have."""
    import pyarrow as pa

    for batch in rows.batches:
        # Single precision by way of its shortest text: 0.1, not 0.10000000149011612.
        columns = [
            (column.cast(pa.string()).cast(pa.float64()) if column.type == pa.float32() else column).to_pylist()
            for column in batch.columns
        ]
        for row in zip(*columns, strict=True):
            yield [plain(value) for value in row]


def plain(value: Any) -> Any:
    """Return a value of a row as JSON and CSV have it.

    Decimals (the type of a sum of integers) become numbers, times and other types text, not-a-number None.
    """
    from decimal import Decimal

    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, Decimal):
        return int(value) if value == value.to_integral_value() else float(value)
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    return str(value)


def print_csv(rows: QueryRows) -> None:
    """Print CSV with a header; NULL is empty, a list or structure is JSON.

    A terminal gets control characters as escapes, as in every table; a file or program gets the values as they are.
    """
    import csv

    writer = csv.writer(_Shown() if sys.stdout.isatty() else sys.stdout, lineterminator="\n")
    writer.writerow(rows.schema.names)
    for row in values(rows):
        writer.writerow([json.dumps(value) if isinstance(value, list | dict) else value for value in row])


class _Shown:
    """Standard output, with control characters as escapes."""

    def write(self, text: str) -> None:
        from teamclone.cli.common import visible

        sys.stdout.write(visible(text))


def print_objects(rows: QueryRows) -> None:
    """Print a JSON list, an object a line, written as the rows come."""
    from teamclone.cli.common import json_text

    names, before = rows.schema.names, "["
    for row in values(rows):
        print(before + json_text(dict(zip(names, row, strict=True))), end="")
        before = ",\n "
    print("[]" if before == "[" else "]")


def print_rows(rows: QueryRows) -> None:
    """Print a table of the first rows, and on stderr a line about the others."""
    from itertools import islice

    import pyarrow as pa

    from teamclone.cli.common import print_table

    found = values(rows)
    shown = list(islice(found, SHOWN))
    numeric = [
        index
        for index, kind in enumerate(rows.schema.types)
        if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)
    ]
    print_table(
        rows.schema.names,
        [
            ["" if value is None else f"{value:.7g}" if isinstance(value, float) else value for value in row]
            for row in shown
        ],
        numeric=numeric,
    )
    if next(found, None) is not None:
        print(f"teamclone: these are the first {SHOWN} rows; --csv or --json prints all", file=sys.stderr)
