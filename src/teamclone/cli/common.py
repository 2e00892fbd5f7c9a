"""Parts that all commands share: tables, JSON, progress, errors."""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Iterable, Sequence
from enum import StrEnum
from typing import Any, NoReturn, TextIO, TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from teamclone.errors import UsageError
from teamclone.system.settings import assignment

E = TypeVar("E", bound=StrEnum)


_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")
"""Characters that a terminal obeys instead of showing them, and those that turn the direction of writing."""


def visible(text: str) -> str:
    """Return a text with control characters as JSON writes them, since names in logs and of files are anybody's."""
    return _CONTROLS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def json_text(value: Any, *, indent: int | None = None) -> str:
    """Return a value as JSON, in ASCII where stdout is not UTF-8."""
    encoding = (sys.stdout.encoding or "").lower()
    escaped = encoding.replace("-", "") != "utf8"
    return visible(json.dumps(value, ensure_ascii=escaped, indent=indent, default=str))


def say(text: str = "", *, file: TextIO | None = None) -> None:
    """Print a text that may hold words of others, on stdout unless ``file`` is given."""
    print(visible(text), file=file)


def fail(text: str, *, code: int) -> NoReturn:
    """Print one line on stderr and exit."""
    say(f"teamclone: {' '.join(text.splitlines())}", file=sys.stderr)
    raise SystemExit(code)


def print_json(value: Any) -> None:
    """Print one JSON document on stdout; NaN becomes null, so that every reader takes it."""
    print(json_text(_finite(value), indent=2))


def json_line(value: Any) -> str:
    """Return a JSON document on one line; NaN becomes null."""
    return json_text(_finite(value))


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
    table = Table(
        title=None if title is None else visible(title),
        title_justify="left",
        title_style="bold",
        box=None,
        pad_edge=False,
        header_style="bold",
    )
    for index, header in enumerate(headers):
        table.add_column(header, justify="right" if index in right else "left", overflow="fold")
    for row in rows:
        table.add_row(*(visible(str(cell)) for cell in row))
    # Piped output is read by programs and long lines are theirs to break.
    terminal = sys.stdout.isatty()
    Console(force_terminal=terminal, width=None if terminal else 200, highlight=False, markup=False).print(table)


def progress(what: str) -> Progress:
    """Return a progress bar on stderr; silent without a terminal."""
    return Progress(
        TextColumn(what),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
        console=Console(stderr=True),
        disable=not sys.stderr.isatty(),  # a console is also asked by variables, which notebooks set
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
