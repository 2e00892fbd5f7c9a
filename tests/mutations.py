"""Documents of wrong shape: each part of one in turn missing, or something else."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from teamclone.errors import TeamcloneError

OTHERS: tuple[Any, ...] = (None, True, 5, -1, 10**30, 1.5, "x", "a\0b", "", [], ["x"], [5], {}, {"x": 5})
"""What a part may be by mistake or by malice."""
TEXTS = (b"", b"{", b"[]", b"3", b"null", b'"x"', b"\xff", b"[" * 100_000, b'{"a":' * 100_000, b"9" * 5000)
"""What may stand in place of a whole document."""
_ITEMS = 1
"""Of a list so many items are changed; the others are like them."""


def places(value: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield where the parts of a document are."""
    if at:
        yield at
    if isinstance(value, dict):
        for key, part in value.items():
            yield from places(part, (*at, key))
    elif isinstance(value, list):
        for index, part in enumerate(value[:_ITEMS]):
            yield from places(part, (*at, index))


def changed(document: Any, at: tuple[Any, ...], *, to: Any = ...) -> Any:
    """Return a document with another value at a place; without one where ``to`` is left out."""
    made = copy.deepcopy(document)
    home = made
    for key in at[:-1]:
        home = home[key]
    if to is ...:
        del home[at[-1]]
    else:
        home[at[-1]] = to
    return made


def texts(document: Any) -> Iterator[tuple[str, bytes]]:
    """Yield every change of a document, in words and as JSON."""
    for at in places(document):
        yield f"{at} left out", json.dumps(changed(document, at)).encode()
        for other in OTHERS:
            yield f"{at} became {other!r}", json.dumps(changed(document, at, to=other)).encode()
    for text in TEXTS:
        yield f"all became {text[:20]!r}", text


def check_readers(path: Path, read: Callable[[], object]) -> None:
    """Read a document in every change; what cannot be read must end in an error of teamclone."""
    whole = path.read_bytes()
    read()
    for words, text in texts(json.loads(whole)):
        path.write_bytes(text)
        try:
            with suppress(TeamcloneError):
                read()
        except Exception as error:
            raise AssertionError(f"{path.name}: {words}: {error!r}") from error
    path.write_bytes(whole)
