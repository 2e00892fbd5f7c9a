"""The errors that teamclone raises: one root, the facts in attributes, the remedy in the text."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path


class TeamcloneError(Exception):
    """An error that the user can act on. Its text is one line: what was expected, what was got, where, what to do."""


class UsageError(TeamcloneError):
    """A wrong option, key or name: the command line ends with exit code 2."""


class LogError(TeamcloneError):
    """A log file that cannot be read.

    Args:
        text: what is wrong and what to do.
        path: the file.
        line: line number in the decompressed file, from 1.
        byte: offset in the decompressed file, from 0.
        cycle: the server cycle that was being read.
    """

    def __init__(
        self,
        text: str,
        *,
        path: Path | str | None = None,
        line: int | None = None,
        byte: int | None = None,
        cycle: int | None = None,
    ) -> None:
        self.text, self.path, self.line, self.byte, self.cycle = text, path, line, byte, cycle
        super().__init__(place(path=path, line=line, byte=byte, cycle=cycle) + text)


def place(
    *, path: Path | str | None = None, line: int | None = None, byte: int | None = None, cycle: int | None = None
) -> str:
    """Return a place as the prefix of a message: ``match.rcg.gz: line 12: cycle 57: ``."""
    parts = [] if path is None else [str(path)]
    for name, value in (("line", line), ("byte", byte), ("cycle", cycle)):
        if value is not None:
            parts.append(f"{name} {value}")
    return "".join(f"{part}: " for part in parts)


class StoreError(TeamcloneError):
    """A store that is missing, foreign, of another format number, or that cannot be written."""


class DatasetError(TeamcloneError):
    """A dataset that is missing, foreign, of another format number, or empty after cleaning."""


class ClusterError(TeamcloneError):
    """A cluster that does not answer, has no workers, or went away."""


class PlayError(TeamcloneError):
    """Matches that cannot be played at all: no server, no room, or a folder that holds others."""


class LiveError(TeamcloneError):
    """A match that cannot be joined or followed, or whose server went away."""


class RunError(TeamcloneError):
    """A run folder that is missing, incomplete or of another format number."""


def choose(wrong: str, choices: Iterable[str]) -> str:
    """Return the remedy for an unknown name: ``did you mean a or b?``, or all choices where none is near."""
    known = list(choices)
    if not known:
        return "there is none"
    near = difflib.get_close_matches(wrong, known, n=3)
    return f"did you mean {' or '.join(near)}?" if near else f"choose from {', '.join(known)}"
