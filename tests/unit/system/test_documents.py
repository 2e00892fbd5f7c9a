"""Documents: what has not the shape that readers need is named by its place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from mutations import TEXTS, check_readers
from teamclone.errors import StoreError
from teamclone.system.documents import misfit, read_document, write_document

SHAPE = {"name": str, "size?": (int, type(None)), "parts": [{"at": float}], "figures": {"*": float}, "on": bool}
GOOD = {"name": "a", "size": None, "parts": [{"at": 1}, {"at": 2.5}], "figures": {"b": 1.0}, "on": True, "more": []}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, None),
        ({"size": 3}, None),
        ({"name": 5}, "name: expected a text, got 5"),
        ({"name": "a" * 100}, None),
        ({"size": True}, "size: expected a whole number, got true"),
        ({"size": 2**63}, f"size: expected a whole number, got {2**63}"),
        ({"parts": {}}, "parts: expected a list, got {}"),
        ({"parts": [{"at": 1}, {}]}, "parts[1].at: missing"),
        ({"parts": [{"at": "x" * 50}]}, f'parts[0].at: expected a number, got "{"x" * 39}...'),
        ({"figures": {"b": 1, "c": None}}, "figures.c: expected a number, got null"),
        ({"on": 1}, "on: expected true or false, got 1"),
    ],
)
def test_the_first_place_that_does_not_fit(change: dict[str, Any], words: str | None) -> None:
    assert misfit(GOOD | change, SHAPE) == words


def test_what_is_missing() -> None:
    without = {name: value for name, value in GOOD.items() if name not in ("size", "name")}
    assert misfit(without, SHAPE) == "name: missing"
    assert misfit([], SHAPE) == "expected an object, got []"


def read(path: Path) -> dict[str, Any]:
    return read_document(path, what="a thing", number=1, command="teamclone do", error=StoreError, shape=SHAPE)


def test_documents_of_any_shape_are_read_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "thing.json"
    write_document(path, {"format": 1, **GOOD})
    check_readers(path, lambda: read(path))


@pytest.mark.parametrize("text", [*TEXTS, b'{"format": 1, "a": NaN}', b'{"format": 1, "a": 1e999}'])
def test_what_is_no_document(tmp_path: Path, text: bytes) -> None:
    path = tmp_path / "thing.json"
    path.write_bytes(text)
    with pytest.raises(StoreError, match=r"thing\.json: not a thing \("):
        read(path)
