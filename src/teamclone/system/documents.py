"""JSON documents with a format number: one layout, written in one step, read back with a check of the format."""

from __future__ import annotations

import errno
import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from teamclone.errors import TeamcloneError
from teamclone.system.files import write_atomic


def write_document(path: Path, document: dict[str, Any]) -> None:
    """Write a document so that a reader sees the old one or the new one."""
    write_atomic(path, document_bytes(document))


def document_bytes(document: dict[str, Any]) -> bytes:
    """Lay a document out: objects over many lines, numbers of a list on one, so that a diff shows what changed.

    Raises:
        ValueError: a number is not finite.
    """
    # A name of a file may hold bytes that are no text; JSON can escape them.
    return f"{_layout(document)}\n".encode("utf-8", "backslashreplace")


def _layout(value: Any, indent: str = "") -> str:
    inner = indent + " "
    if isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
        lines = [f"{inner}{json.dumps(item, ensure_ascii=False, allow_nan=False, default=str)}" for item in value]
        return "[\n" + ",\n".join(lines) + f"\n{indent}]"
    if not isinstance(value, dict) or not value:
        return json.dumps(value, ensure_ascii=False, allow_nan=False, default=str)
    if set(value) == {"value", "low", "high"}:
        return json.dumps(value, ensure_ascii=False, allow_nan=False)
    lines = [
        f"{inner}{json.dumps(str(key), ensure_ascii=False)}: {_layout(item, inner)}" for key, item in value.items()
    ]
    return "{\n" + ",\n".join(lines) + f"\n{indent}}}"


Shape = Any
"""What a part of a document must be: a type, or

- a list of one shape: a list of such parts;
- a dictionary of shapes by name: an object with these parts, and perhaps others. A name that ends in ``?`` may be
  missing, and the name ``*`` stands for every name;
- a tuple of shapes: any of them.

A float may be a whole number, and a whole number has 64 bits.
"""
_WORDS = {str: "a text", int: "a whole number", float: "a number", bool: "true or false", dict: "an object"}
_WORDS |= {list: "a list", type(None): "null"}


def misfit(value: Any, shape: Shape, where: str = "") -> str | None:
    """Return the first place where a value has not a `Shape`, with what was expected and got; None where it has."""
    if isinstance(shape, tuple):
        found = [misfit(value, each, where) for each in shape]
        return found[0] if None not in found else None
    if isinstance(shape, list) and isinstance(value, list):
        return next(filter(None, (misfit(item, shape[0], f"{where}[{at}]") for at, item in enumerate(value))), None)
    if isinstance(shape, dict) and isinstance(value, dict):
        return next(filter(None, (_misfit_at(value, name, inner, where) for name, inner in shape.items())), None)
    kind = shape if isinstance(shape, type) else type(shape)
    if kind is float:
        fits = type(value) in (int, float)
    elif kind is int:
        fits = type(value) is int and abs(value) < 2**63
    else:
        fits = isinstance(value, kind)
    if fits:
        return None
    got = json.dumps(value, ensure_ascii=False, default=str)
    return f"{where}: expected {_WORDS[kind]}, got {got[:40]}{'...' if len(got) > 40 else ''}".removeprefix(": ")


def _misfit_at(value: dict[str, Any], name: str, shape: Shape, where: str) -> str | None:
    """Return what is wrong with the part of an object that a name of its shape stands for."""
    before = f"{where}." if where else ""
    if name == "*":
        return next(filter(None, (misfit(part, shape, f"{before}{key}") for key, part in value.items())), None)
    key = name.removesuffix("?")
    if key in value:
        return misfit(value[key], shape, f"{before}{key}")
    return None if key != name else f"{before}{key}: missing"


def read_json(path: Path) -> Any:
    """Return the content of a JSON file.

    Raises:
        ValueError: it is no JSON, has a number that is none or infinite, or is nested too deep.
        OSError: it cannot be read.
    """
    try:
        return json.loads(path.read_bytes(), parse_constant=_no_number, parse_float=_finite_number)
    except RecursionError:
        raise ValueError("nested too deep") from None


def _no_number(text: str) -> Any:
    raise ValueError(f"{text} is no number of JSON")


def _finite_number(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:40]} is too great")
    return value


def read_document(
    path: Path,
    *,
    what: str,
    number: int,
    command: str,
    error: type[TeamcloneError],
    shape: Shape = dict,
    folder: Path | None = None,
    again: str | None = None,
) -> dict[str, Any]:
    """Read a document of an expected format.

    Args:
        path: the document.
        what: the thing that it is or describes, with its article: ``a run``.
        number: the format that the caller reads.
        command: the command that makes such a document: ``teamclone train``.
        error: the class of the error.
        shape: see `Shape`.
        folder: the folder that the document describes, which the messages then name; None for a document of its own.
        again: the remedy for another format; None for giving ``command`` again.

    Raises:
        error: the document is missing, is none, or has another format number or shape.
    """
    again = again or f"make it again with `{command}`"
    try:
        document: dict[str, Any] = read_json(path)
        found = document["format"]
    except (FileNotFoundError, NotADirectoryError):
        if folder is None:
            raise error(f"{path}: missing; make it with `{command}`") from None
        problem = f"not {what}, it has no {path.name}" if folder.exists() else "no such folder"
        raise error(f"{folder}: {problem}; make one with `{command}`") from None
    except (ValueError, TypeError, KeyError) as problem:
        raise error(not_a_document(path, what if folder is None else f"the description of {what}", problem)) from None
    check_format(found, number=number, what=what.partition(" ")[2], where=folder or path, again=again, error=error)
    if wrong := misfit(document, shape):
        raise error(f"{path}: {wrong}; {again}")
    return document


def not_a_document(path: Path, what: str, problem: Exception) -> str:
    """Return an error text: ``run/environment.json: not the description of a run (...)``."""
    return f"{path}: not {what} ({problem!r})"


def check_format(
    found: object,
    *,
    number: int,
    what: str,
    where: Path | str,
    again: str,
    error: type[TeamcloneError],
    writer: object = None,
) -> None:
    """Raise unless a document has our format number.

    Args:
        found: the format number that was read.
        number: the one that this version reads.
        what: the kind of the document, without an article.
        where: its place.
        again: the remedy.
        error: the class of the error.
        writer: the version of teamclone that wrote it; None where that is not known.

    Raises:
        error: the numbers differ.
    """
    if found != number:
        by = "" if writer is None else f", written by teamclone {writer}"
        raise error(f"{where}: {what} of format {found}{by}, this version reads {number}; {again}")


@contextmanager
def write_errors(
    where: Path,
    *,
    error: type[TeamcloneError],
    full: str,
    denied: str,
    kinds: tuple[type[Exception], ...] = (OSError,),
) -> Iterator[None]:
    """Turn the system's refusal to write into one clear line.

    Args:
        where: the folder that is written to.
        error: the class of the error.
        full: the remedy when the disk is full.
        denied: the remedy when it cannot be written for another reason.
        kinds: the exceptions that are turned.
    """
    try:
        yield
    except kinds as problem:
        if getattr(problem, "errno", None) in (errno.ENOSPC, errno.EDQUOT) or "No space left" in str(problem):
            text = f"the disk is full; {full}"
        else:
            reason = getattr(problem, "strerror", None) or first_line(problem)
            text = f"cannot be written ({reason}); {denied}"
        raise error(f"{where}: {text}") from problem


def first_line(problem: Exception) -> str:
    """Return the first line of an exception's text, or its class where it has none."""
    return str(problem).splitlines()[0] if str(problem) else type(problem).__name__
