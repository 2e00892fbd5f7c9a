"""Game logs as text: versions 4, 5 and 6."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import LogError
from teamclone.logs import scan
from teamclone.logs.assemble import (
    TeamMark,
    checked_type,
    final_teams,
    frame_columns,
    limited_cycle,
    limited_score,
    player_type_columns,
)
from teamclone.logs.match import Columns, GameLog, Problem, Severity
from teamclone.logs.shows import read_shows
from teamclone.rcss.playmodes import BY_NAME

_PARAMETER = re.compile(rb'\(([A-Za-z_]\w*) (?:"([^"]*)"|([^()\s]*))\)')
_TEAM = re.compile(rb"\(team (\d+) (\S+) (\S+) (-?\d+) (-?\d+)(?: (\d+) (\d+) (\d+) (\d+))?\)\s*$")
_RESULT = b'"(result '
"""In the message that the server logs as it closes."""
_PLAYMODE = re.compile(rb"\(playmode (\d+) (\w+)\)\s*$")
_PIECE = 1 << 17

_WHAT = {
    scan.BAD_NUMBER: "a number is expected",
    scan.BAD_STRUCTURE: "the line is cut off or is no show record",
    scan.WRONG_PLAYERS: "the show has not each of the 22 players",
}


def read_text(data: bytes, *, path: Path | None = None) -> GameLog:
    """Read a text game log.

    Args:
        data: the decompressed log; begins with ``ULG4``, ``ULG5`` or ``ULG6``.
        path: its name, for messages.

    Raises:
        LogError: there is not one good frame, though the match began.
    """
    buffer = np.frombuffer(data, np.uint8)
    starts, stops = line_bounds(buffer)
    shows = np.flatnonzero(_begins(buffer, starts, stops, b"(show "))
    problems: list[Problem] = []
    if not len(shows):
        if _RESULT not in data:
            raise LogError("holds no frame: expected lines '(show ...)' behind the header", path=path)
        text = "holds no frame: the server was closed before the match began"
        problems.append(Problem(code="never-began", severity=Severity.NOTE, text=text, path=path))
    frames, players, good = _scan(buffer, starts[shows], stops[shows], shows, problems, path=path)
    frame_of_line = np.cumsum(good)
    modes: list[tuple[int, int]] = []
    teams: list[TeamMark] = []
    server_params: dict[str, float | str] = {}
    player_params: dict[str, float | str] = {}
    types: dict[int, dict[str, float]] = {}
    finished = False
    odd: list[int] = []
    for index in np.setdiff1d(np.arange(1, len(starts)), shows, assume_unique=True):
        line = data[starts[index] : stops[index]]
        shows_before = int(np.searchsorted(shows, index))
        frame = int(frame_of_line[shows_before - 1]) if shows_before else 0
        if match := _PLAYMODE.match(line):
            mode = BY_NAME.get(match[2].decode())
            if mode is None:
                problems.append(_unknown_mode(match, path=path, line=int(index) + 1))
            modes.append((frame, int(mode or 0)))
        elif match := _TEAM.match(line):
            teams.append(_team_mark(frame, match))
        elif line.startswith(b"(msg "):
            finished = finished or _RESULT in line
        elif line.startswith(b"(server_param "):
            server_params = parameters(line)
        elif line.startswith(b"(player_param "):
            player_params = parameters(line)
        elif line.startswith(b"(player_type "):
            try:
                number, fields = checked_type(parameters(line))
            except ValueError:
                odd.append(int(index))
            else:
                types[number] = fields
        elif line.strip():
            odd.append(int(index))
    if odd:
        problems.append(
            Problem(
                code="odd-line",
                severity=Severity.WARNING,
                text=f"{len(odd)} line(s) are no known record, the first is "
                f"{data[starts[odd[0]] : stops[odd[0]]][:40]!r}",
                path=path,
                line=odd[0] + 1,
            )
        )
    left_team, right_team = final_teams(teams)
    return GameLog(
        log_version=data[3:4].decode(),
        left=left_team,
        right=right_team,
        frames=frame_columns(cycle=frames["cycle"], ball=frames["ball"], modes=modes, teams=teams),
        players=players,
        player_types=player_type_columns(types),
        server_params=server_params,
        player_params=player_params,
        complete=finished,
        problems=tuple(problems),
    )


def _unknown_mode(match: re.Match[bytes], *, path: Path | None, line: int) -> Problem:
    return Problem(
        code="unknown-playmode",
        severity=Severity.WARNING,
        text=f"play mode {match[2].decode()!r} is unknown, kept as 0",
        path=path,
        line=line,
        cycle=limited_cycle(match[1]),
    )


def _team_mark(frame: int, match: re.Match[bytes]) -> TeamMark:
    """Return names and scores of a ``(team ...)`` line, which hold from ``frame`` on."""
    left, right = (None if name == b"null" else name.decode("utf-8", "replace") for name in match.group(2, 3))
    scores = [limited_score(float(value or 0)) for value in match.groups()[3:]]
    return TeamMark(
        frame=frame,
        left=left,
        right=right,
        scores=(scores[0], scores[1], scores[2], scores[3], scores[4], scores[5]),
    )


def parameters(line: bytes) -> dict[str, float | str]:
    """Parse ``(server_param (name value)(name value)...)``; true and false become 1 and 0."""
    values: dict[str, float | str] = {}
    for name, text, bare in _PARAMETER.findall(line, 1):
        if bare in {b"true", b"false"}:
            values[name.decode()] = float(bare == b"true")
            continue
        try:
            values[name.decode()] = float(bare) if bare else text.decode("utf-8", "replace")
        except ValueError:
            values[name.decode()] = bare.decode("utf-8", "replace")
    return values


def _pieces(buffer: NDArray[np.uint8]) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    """Yield the log in pieces that stay in the processor's cache, each with its place.

    A test of all at once would make a copy.
    """
    return ((at, buffer[at : at + _PIECE]) for at in range(0, len(buffer), _PIECE))


def count_byte(buffer: NDArray[np.uint8], byte: int) -> int:
    """Return how often a byte occurs."""
    return sum(int(np.count_nonzero(piece == byte)) for _, piece in _pieces(buffer))


def line_bounds(buffer: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where each line begins and ends (without its newline), shapes (n_lines,)."""
    newlines = [np.flatnonzero(piece == ord("\n")) + at for at, piece in _pieces(buffer)]
    stops = np.concatenate([*newlines, [len(buffer)]])
    starts = np.concatenate([[0], stops[:-1] + 1])
    if starts[-1] == len(buffer):
        return starts[:-1], stops[:-1]
    return starts, stops


def _begins(
    buffer: NDArray[np.uint8], starts: NDArray[np.int64], stops: NDArray[np.int64], word: bytes
) -> NDArray[np.bool_]:
    begins = stops - starts >= len(word)
    places = starts[begins]
    same = np.ones(len(places), np.bool_)
    for offset, byte in enumerate(word):
        same &= buffer[places + offset] == byte
    begins[begins] = same
    return begins


def _scan(
    buffer: NDArray[np.uint8],
    starts: NDArray[np.int64],
    stops: NDArray[np.int64],
    lines: NDArray[np.int64],
    problems: list[Problem],
    *,
    path: Path | None,
) -> tuple[Columns, Columns, NDArray[np.bool_]]:
    """Scan the show lines: cycle and ball, player columns, and which lines were good."""
    n = len(starts)
    shows = read_shows(buffer, starts, stops)
    good = shows.outcomes == scan.OK
    n_good = int(np.count_nonzero(good))
    if n_good < n:
        bad = np.flatnonzero(~good)
        first = int(bad[0])
        last_line = bool(len(bad) == 1 and first == n - 1 and stops[first] == len(buffer))
        text = _WHAT[int(shows.outcomes[first])]
        problems.append(
            Problem(
                code="truncated" if last_line else "bad-show",
                severity=Severity.WARNING,
                text=f"{text}; the last frame is left out"
                if last_line
                else f"{text}; {len(bad)} of {n} frames are left out",
                path=path,
                line=int(lines[first]) + 1,
                byte=int(shows.places[first]),
                cycle=int(shows.cycle[first]) if shows.cycle[first] >= 0 else None,
            )
        )
    if n and not n_good:
        raise LogError(str(problems[-1].text), path=path, line=int(lines[0]) + 1)
    keep = slice(None) if n_good == n else good
    players = {name: column[keep] for name, column in shows.players.items()}
    return {"cycle": shows.cycle[keep], "ball": shows.ball[keep]}, players, good
