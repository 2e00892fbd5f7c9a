"""``read_match``: one match from its files, whatever their format."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from teamclone.errors import LogError, UsageError
from teamclone.logs.align import executed_kind, first_body_commands, frame_of, slot_of
from teamclone.logs.columns import FRAMES, PLAYERS
from teamclone.logs.inflate import read_bytes
from teamclone.logs.match import (
    CommandLog,
    GameLog,
    Match,
    Problem,
    Severity,
    Team,
    default_player_types,
    empty_columns,
)
from teamclone.logs.rcg_binary import read_binary
from teamclone.logs.rcg_json import read_json
from teamclone.logs.rcg_text import read_text
from teamclone.logs.rcl import FIRST_LINE, read_commands, sender_names
from teamclone.rcss import state_bits
from teamclone.rcss.players import N_PLAYERS, TEAM_SLOTS
from teamclone.rcss.playmodes import PlayMode
from teamclone.system.files import digest

_LOG_NAME = re.compile(r"(?P<stem>.+)\.(?P<kind>rcg|rcl)(?P<packing>\.(?:gz|xz|zst|bz2))?\Z", re.IGNORECASE | re.DOTALL)
_FEWEST_SENT = 0.8
"""Below this share of sent ones among the executed body commands of play_on a command log belongs to another match.

Measured: over 0.998 for the logs of one match, under 0.6 for two matches of the same teams.
"""


_SIDES = (b"l", b"r")
"""Of a team, as the referee calls it."""
_ARCHIVE = re.compile(r"\.(tar(\.\w+)?|tgz|zip|7z)\Z", re.IGNORECASE)
_TAR = b"ustar"
"""What stands 257 bytes into a tar archive."""
_ZIP = b"PK\x03\x04"
"""What a zip archive begins with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LogPair:
    """The files of one match; one of them may be missing."""

    rcg: Path | None
    rcl: Path | None

    @property
    def path(self) -> Path:
        """The file that names the match."""
        path = self.rcg or self.rcl
        if path is None:
            raise ValueError("a pair of logs needs at least one file")
        return path


def find_matches(paths: Iterable[Path]) -> list[LogPair]:
    """Return the matches in files and folders (searched recursively), each once, ordered by path.

    Files are paired by name: ``x.rcg.gz`` goes with ``x.rcl`` in any packing. In folders the ``._`` files that macOS
    keeps beside others are passed over, and archives with a warning. A file named on its own is taken whatever it is
    called.

    Raises:
        UsageError: a path does not exist, or there is no log under any of them.
    """
    found: dict[tuple[Path, str], dict[str, Path]] = {}
    given = list(paths)
    for path in given:
        if path.is_dir():
            files = sorted(file for file in path.rglob("*") if _is_log_name(file.name) and file.is_file())
        elif path.exists():
            files = [path]
        else:
            raise UsageError(f"{path}: no such file or folder")
        for file in files:
            match = _LOG_NAME.match(file.name)
            if match is None:
                found.setdefault((file.parent, file.name), {})["rcg"] = file
                continue
            kind = match["kind"].lower()
            pair = found.setdefault((file.parent, match["stem"]), {})
            pair.setdefault(kind, file)
            partner = partner_of(file)
            if partner is not None:
                pair.setdefault("rcl" if kind == "rcg" else "rcg", partner)
    archives = sorted(file for path in given for file in path.rglob("*") if _ARCHIVE.search(file.name))
    if archives and found:
        names = f"{archives[0]}{f' and {len(archives) - 1} more' if len(archives) > 1 else ''}"
        logging.getLogger(__name__).warning("%s: an archive, passed over; unpack it to read the logs in it", names)
    if not found:
        unpack = f"; unpack {archives[0].name} first (tar xf)" if archives else ""
        raise UsageError(f"no .rcg or .rcl file under {', '.join(map(str, given)) or 'no path'}{unpack}")
    return [LogPair(rcg=pair.get("rcg"), rcl=pair.get("rcl")) for _, pair in sorted(found.items())]


def _is_log_name(name: str) -> bool:
    return _LOG_NAME.match(name) is not None and not name.startswith("._")


def partner_of(path: Path) -> Path | None:
    """Return the other log of the same match beside ``path``, by name; None where there is none."""
    match = _LOG_NAME.match(path.name)
    if match is None:
        return None
    other = "rcl" if match["kind"].lower() == "rcg" else "rcg"
    for packing in dict.fromkeys((match["packing"] or "", "", ".gz", ".xz", ".zst", ".bz2")):
        candidate = path.with_name(f"{match['stem']}.{other}{packing}")
        if candidate.is_file():
            return candidate
    return None


def read_match(source: str | os.PathLike[str] | BinaryIO, *, partner: str | os.PathLike[str] | None = None) -> Match:
    """Read a match.

    Args:
        source: a game log or a command log, as path or binary stream, plain or packed with gz, xz, zst or bz2. Its
            content shows which it is.
        partner: the other log. None looks for a file of the same name beside ``source``.

    Raises:
        LogError: nothing can be read from the source.
    """
    given = Path(source) if isinstance(source, str | os.PathLike) else source
    path = given if isinstance(given, Path) else None
    other = Path(partner) if partner is not None else None if path is None else partner_of(path)
    try:
        return _read_match(given, other)
    except MemoryError:
        raise LogError("needs more memory than this process may have", path=path) from None


def _read_match(source: Path | BinaryIO, other: Path | None) -> Match:
    path = source if isinstance(source, Path) else None
    data, broken = read_bytes(source)
    first = _Source(path=path, data=data, broken=broken)
    second = None
    problems: list[Problem] = []
    if other is not None:
        try:
            second = _Source(path=other, data=(content := read_bytes(other))[0], broken=content[1])
        except LogError as error:
            problems.append(_problem_of(error, other))
    return _bind(first, second, problems)


def read_pair(pair: LogPair) -> Match:
    """Read the match of a pair of files; a bad command log costs the commands, a bad game log the match.

    Raises:
        LogError: nothing can be read.
    """
    return read_match(pair.path, partner=pair.rcl if pair.rcg is not None else None)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Source:
    path: Path | None
    data: bytes
    broken: str | None

    @property
    def is_commands(self) -> bool:
        return FIRST_LINE.match(self.data) is not None


def _problem_of(error: LogError, path: Path | None) -> Problem:
    return Problem(
        code="unreadable",
        severity=Severity.ERROR,
        text=error.text,
        path=path,
        line=error.line,
        byte=error.byte,
        cycle=error.cycle,
    )


def _bind(first: _Source, second: _Source | None, problems: list[Problem]) -> Match:
    rcg, rcl = (second, first) if first.is_commands else (first, second)
    if second is not None and first.is_commands == second.is_commands:
        kind = "command" if first.is_commands else "game"
        problems.append(
            Problem(
                code="mismatched",
                severity=Severity.ERROR,
                text=f"is a {kind} log like {first.path}, expected its partner; left out",
                path=second.path,
            )
        )
        rcg, rcl = (None, first) if first.is_commands else (first, None)
    game = None
    if rcg is not None:
        try:
            game = read_game(rcg.data, path=rcg.path)
        except LogError as error:
            if rcl is None or rcg is first:
                raise
            problems.append(_problem_of(error, rcg.path))
            rcg = None
    if game is None:
        if rcl is None:
            raise LogError("holds neither a game log nor a command log", path=first.path)
        game = _game_of_commands(rcl.data)
        problems.append(
            Problem(
                code="no-game-log",
                severity=Severity.ERROR,
                text="no game log (.rcg) beside it: commands only, no frames",
                path=rcl.path,
            )
        )
    problems += [
        Problem(
            code="truncated",
            severity=Severity.WARNING,
            text=f"{source.broken}; the readable part is kept",
            path=source.path,
            byte=len(source.data),
        )
        for source in (rcg, rcl)
        if source is not None and source.broken is not None
    ]
    log = None
    if rcl is not None:
        log = _read_log(rcl, game, problems)
    elif rcg is not None and not problems:
        problems.append(
            Problem(
                code="no-command-log",
                severity=Severity.NOTE,
                text="no command log (.rcl) beside it",
                path=rcg.path,
            )
        )
    named = rcg or rcl
    if named is None:
        raise AssertionError("a match has a game log or a command log")
    own = tuple(problems) + game.problems + (log.problems if log else ()) + tuple(_oddities(game, rcg))
    return Match(
        match_id=digest(named.data),
        rcg_path=rcg.path if rcg else None,
        rcl_path=rcl.path if rcl and log else None,
        game=game,
        log=log,
        problems=own,
    )


def read_game(data: bytes, *, path: Path | None = None) -> GameLog:
    """Read a game log of any version from its decompressed bytes; its first bytes give the version.

    Raises:
        LogError: it is no game log, or holds no frame.
    """
    if data.startswith((b"ULG4", b"ULG5", b"ULG6")):
        second = data[data.find(b"\n") + 1 :][:16].lstrip()
        if data.startswith(b"ULG6") and second.startswith(b"["):
            return read_json(data, path=path)
        return read_text(data, path=path)
    if data.startswith(b"JSON") or data[:64].lstrip().startswith(b"["):
        return read_json(data, path=path)
    # Version 1 has no header: it begins with the 16-bit mode of its first record, 1 to 9.
    if data.startswith((b"ULG\x02", b"ULG\x03")) or (data[:1] == b"\x00" and data[1:2] and 1 <= data[1] <= 9):
        return read_binary(data, path=path)
    if data[257:262] == _TAR:
        raise LogError("is a tar archive: unpack it (tar xf) and name the logs or their folder", path=path)
    if data.startswith(_ZIP):
        raise LogError("is a zip archive, no game log: unpack it (unzip) and name the logs or their folder", path=path)
    raise LogError(
        f"is no game log (.rcg) of version 1 to 6 or JSON and no command log (.rcl): begins with {data[:8]!r}",
        path=path,
    )


def _game_of_commands(data: bytes) -> GameLog:
    """Return the game that a command log shows: the names, in the order of connection, and the goals announced."""
    names: list[str | None] = [*sender_names(data)[:2], None, None]
    goals = {
        side: [int(count) for count in re.findall(rb"\(referee goal_%b_(\d{1,4})\)" % side, data)] for side in _SIDES
    }
    left, right = (max(goals[side], default=0) for side in _SIDES)
    return GameLog(
        log_version="none",
        left=Team(name=names[0], score=left),
        right=Team(name=names[1], score=right),
        frames=empty_columns(FRAMES, 0),
        players=empty_columns(PLAYERS, 0, N_PLAYERS),
        player_types=default_player_types(0),
        server_params={},
        player_params={},
        complete=False,
    )


def _read_log(rcl: _Source, game: GameLog, problems: list[Problem]) -> CommandLog | None:
    try:
        log = read_commands(rcl.data, left=game.left.name, right=game.right.name, path=rcl.path)
    except LogError as error:
        problems.append(_problem_of(error, rcl.path))
        return None
    frame = frame_of(game.frames, log.commands["cycle"], log.commands["stoppage"], has_stoppage=log.has_stoppage)
    log = replace(log, commands=log.commands | {"frame": frame})
    teams = {name for name in (game.left.name, game.right.name) if name}
    # Where each line was read there is no sender but the teams, and no need to list them.
    senders = teams if all(problem.code == "refused-command" for problem in log.problems) else _senders(rcl)
    if len(game.frames["cycle"]) and ((senders - teams and teams - senders) or _foreign(game, log)):
        text = (
            f"is the command log of another match (teams {', '.join(sorted(_senders(rcl))) or 'unknown'}, "
            f"expected {', '.join(sorted(teams)) or 'none'}); left out"
        )
        problems.append(Problem(code="mismatched", severity=Severity.ERROR, text=text, path=rcl.path))
        return None
    return log


def _senders(rcl: _Source) -> set[str]:
    return set(sender_names(rcl.data))


def _foreign(game: GameLog, log: CommandLog) -> bool:
    """Return whether many commands that the server executed were not sent, so that the logs are of two matches.

    Not the other way round: a server may refuse most of what a legal team sends, kicks out of reach for example.
    """
    commands = log.commands
    index = first_body_commands(commands, game.frames["playmode"])
    frame, slot = commands["frame"][index], slot_of(commands["side"][index], commands["unum"][index])
    executed = executed_kind(game.frames, game.players)
    sent = np.zeros_like(executed)
    sent[frame, slot] = commands["kind"][index]
    counted = (executed != 0) & (sent != 0).any(axis=0)
    counted &= (game.frames["playmode"] == PlayMode.PLAY_ON)[:, np.newaxis]
    # A command log may break off before the game log does.
    counted[np.max(frame, initial=-1) + 1 :] = False
    if counted.sum() < N_PLAYERS:
        return False
    return bool((executed == sent)[counted].mean() < _FEWEST_SENT)


def _oddities(game: GameLog, source: _Source | None) -> list[Problem]:
    """Return oddities of the match itself: an unfinished log, absent teams, players that left."""
    if source is None or not len(game.frames["cycle"]):
        return []
    path = source.path
    problems = []
    if not game.complete:
        last = game.frames["cycle"][-1]
        problems.append(
            Problem(
                code="incomplete",
                severity=Severity.WARNING,
                text=f"the log was not closed by the server; it ends at cycle {last}",
                path=path,
                cycle=int(last),
            )
        )
    state = game.players["state"]
    on_field = (state & state_bits.STAND) != 0
    for side, team, slots in zip(("left", "right"), (game.left, game.right), TEAM_SLOTS, strict=True):
        if team.name is None or not on_field[:, slots].any():
            problems.append(
                Problem(code="no-team", severity=Severity.NOTE, text=f"no {side} team connected", path=path)
            )
            continue
        left_field = on_field[:-1, slots] & ~on_field[1:, slots] & ((state[1:, slots] & state_bits.RED_CARD) == 0)
        gone = np.flatnonzero(left_field.any(axis=0))
        if len(gone):
            frame = int(np.flatnonzero(left_field.any(axis=1))[0]) + 1
            problems.append(
                Problem(
                    code="disconnected",
                    severity=Severity.NOTE,
                    text=f"{len(gone)} player(s) of {team.name} left the field: "
                    + ", ".join(str(unum + 1) for unum in gone),
                    path=path,
                    cycle=int(game.frames["cycle"][frame]),
                )
            )
    return problems
