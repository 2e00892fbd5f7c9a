"""Parts that all commands share: tables, JSON, progress, errors."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Sequence
from enum import StrEnum
from typing import Any, NoReturn, TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from teamclone.errors import UsageError
from teamclone.system.settings import assignment

E = TypeVar("E", bound=StrEnum)


def fail(text: str, *, code: int) -> NoReturn:
    """Print one line on stderr and exit."""
    print(f"teamclone: {' '.join(text.splitlines())}", file=sys.stderr)
    raise SystemExit(code)


def print_json(value: Any) -> None:
    """Print one JSON document on stdout; NaN becomes null, so that every reader takes it."""
    print(json.dumps(_finite(value), ensure_ascii=False, indent=2, default=str))


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return value


def print_table(
    headers: Sequence[str], rows: Iterable[Sequence[object]], *, title: str | None = None, numeric: Iterable[int] = ()
) -> None:
    """Print a table on stdout; ``numeric`` names the columns to align right."""
    right = set(numeric)
    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False, header_style="bold")
    for index, header in enumerate(headers):
        table.add_column(header, justify="right" if index in right else "left", overflow="fold")
    for row in rows:
        table.add_row(*(str(cell) for cell in row))
    # Piped output is read by programs and long lines are theirs to break.
    Console(width=None if sys.stdout.isatty() else 200, highlight=False, markup=False).print(table)


def progress(what: str) -> Progress:
    """Return a progress bar on stderr; silent without a terminal."""
    console = Console(stderr=True)
    return Progress(
        TextColumn(what),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
        console=console,
        disable=not console.is_terminal,
    )


def values_of(settings: Iterable[str]) -> dict[str, Any]:
    """Return the values of ``KEY=VALUE`` texts, see `settings.assignment`."""
    return dict(assignment(setting) for setting in settings)


def choice(kind: type[E], value: str, *, option: str) -> E:
    """Return a member of a StrEnum by its value; a usage error that lists the choices where there is none."""
    try:
        return kind(value)
    except ValueError:
        known = ", ".join(member.value for member in kind)
        raise UsageError(f"{option} {value!r} is unknown, choose one of: {known}") from None
