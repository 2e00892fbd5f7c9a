"""The status of each source file."""

from __future__ import annotations

import os
import re
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Self

from teamclone.system.documents import misfit
from teamclone.system.files import digest


class FileOutcome(StrEnum):
    """``ok``: read whole; ``partial``: some records or the rest of the file were lost; ``failed``: nothing was kept."""

    OK = "ok"
    PARTIAL = "partial"
    FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class FileStatus:
    """The status row of one source file.

    Attributes:
        path: absolute path when it was read.
        rows: frames of a game log, commands of a command log.
        match_id: the match its rows are in; None if it failed.
        error: the first thing that was wrong, with its place; None where nothing was.
        size: bytes on disk; -1 where the file could not be looked at.
        mtime_ns: time of the last change, nanoseconds since 1970.
        content: hash of the decompressed content; None if it failed.
    """

    path: str
    outcome: FileOutcome
    rows: int
    match_id: str | None
    error: str | None
    size: int
    mtime_ns: int
    content: str | None

    @property
    def key(self) -> str:
        """The name of this row in a store: `key_of` its path."""
        return key_of(Path(self.path))

    def describes(self, path: Path) -> bool:
        """Return whether the file was not changed since, by size and time."""
        return (self.size, self.mtime_ns) == stamp(path)

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name; `from_json` is the inverse."""
        return asdict(self)

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Self:
        """Make a status from the fields that `to_json` returned.

        Raises:
            ValueError, KeyError, TypeError: the values are not those of a status.
        """
        if problem := misfit(values, _SHAPE):
            raise ValueError(problem)
        match_id = values["match_id"]
        # It becomes a part of paths, and a store may be somebody else's.
        if match_id is not None and re.fullmatch("[0-9a-f]{16}", match_id) is None:
            raise ValueError(f"{match_id!r} is no match id")
        return cls(**{**values, "outcome": FileOutcome(values["outcome"])})


_TEXT = (str, type(None))
_SHAPE = {"path": str, "outcome": str, "rows": int, "match_id": _TEXT, "error": _TEXT}
_SHAPE |= {"size": int, "mtime_ns": int, "content": _TEXT}
"""Of a status row."""


def key_of(path: Path) -> str:
    """Return 16 hex digits that name a path, whatever bytes are in it."""
    return digest(os.fsencode(path.absolute()))


def stamp(path: Path) -> tuple[int, int]:
    """Return size in bytes and time of the last change in ns; (-1, 0) where the file cannot be read."""
    try:
        found = path.stat()
    except OSError:
        return -1, 0
    return found.st_size, found.st_mtime_ns
