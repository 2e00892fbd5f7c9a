"""Game logs as text: versions 4, 5 and 6."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
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
    player_type_columns,
    team_mark,
)
from teamclone.logs.match import Columns, GameLog, Problem, Severity
from teamclone.logs.shows import read_shows
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.playmodes import BY_NAME

_PARAMETER = re.compile(rb'\(([A-Za-z_]\w*) (?:"([^"]*)"|([^()\s]*))\)')
_TEAM = re.compile(rb"\(team (\d+) (\S+) (\S+) (-?\d+) (-?\d+)(?: (\d+) (\d+) (\d+) (\d+))?\)\s*$")
_RESULT = b'"(result '
"""In the message that the server logs as it closes."""
_PLAYMODE = re.compile(rb"\(playmode (\d+) (\w+)\)\s*$")
_PIECE = 1 << 17
_SHORTEST = len("(show 0((b)0 0 0 0))") + N_PLAYERS * len("((l1)0 0 0 0 0 0 0 0)")
"""Bytes of the shortest record that is whole. No columns are made for shorter lines: a file may be full of them."""

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
    statements = _Statements()
    known = np.zeros(len(starts), np.bool_)
    for word in _STATEMENTS:
        known |= _begins(buffer, starts, stops, word)
    frame_of_line = np.cumsum(good)
    odd = ~known
    odd[shows] = odd[0] = known[0] = False
    for index in np.flatnonzero(known).tolist():
        shows_before = int(np.searchsorted(shows, index))
        frame = int(frame_of_line[shows_before - 1]) if shows_before else 0
        odd[index] = not statements.take(data[starts[index] : stops[index]], frame=frame, line=index + 1)
    odd &= stops > starts
    for index in np.flatnonzero(odd & _IS_BLANK[buffer[np.minimum(starts, len(buffer) - 1)]]).tolist():
        odd[index] = bool(data[starts[index] : stops[index]].strip())
    problems += statements.problems(path=path)
    if n_odd := int(np.count_nonzero(odd)):
        first = int(np.argmax(odd))
        text = (
            f"{n_odd} line(s) are no known record, the first is "
            f"{data[starts[first] : min(stops[first], starts[first] + 40)]!r}"
        )
        problems.append(
            Problem(code="odd-line", severity=Severity.WARNING, text=text, path=path, line=first + 1),
        )
    left_team, right_team = final_teams(statements.teams)
    return GameLog(
        log_version=data[3:4].decode(),
        left=left_team,
        right=right_team,
        frames=frame_columns(
            cycle=frames["cycle"], ball=frames["ball"], modes=statements.modes, teams=statements.teams
        ),
        players=players,
        player_types=player_type_columns(statements.types),
        server_params=statements.server_params,
        player_params=statements.player_params,
        complete=statements.finished,
        problems=tuple(problems),
    )


_STATEMENTS = (b"(playmode ", b"(team ", b"(msg ", b"(server_param ", b"(player_param ", b"(player_type ")
"""What the lines begin with that are no frames."""
_IS_BLANK = np.zeros(256, np.bool_)
_IS_BLANK[list(b" \t\n\r\v\f")] = True


@dataclass(slots=True, kw_only=True)
class _Statements:
    """What a log says beside its frames. Of unknown play modes the first one and their number are kept."""

    modes: list[tuple[int, int]] = field(default_factory=list)
    teams: list[TeamMark] = field(default_factory=list)
    server_params: dict[str, float | str] = field(default_factory=dict)
    player_params: dict[str, float | str] = field(default_factory=dict)
    types: dict[int, dict[str, float]] = field(default_factory=dict)
    finished: bool = False
    n_unknown: int = 0
    unknown: tuple[int, re.Match[bytes]] | None = None

    def take(self, text: bytes, *, frame: int, line: int) -> bool:
        """Take a line in, of which ``frame`` is the next frame's index; return whether it could be read."""
        if match := _PLAYMODE.match(text):
            mode = BY_NAME.get(match[2].decode())
            if mode is None:
                self.n_unknown += 1
                self.unknown = self.unknown or (line, match)
            self.modes.append((frame, int(mode or 0)))
        elif match := _TEAM.match(text):
            left, right = (None if name == b"null" else name.decode("utf-8", "replace") for name in match.group(2, 3))
            scores = [float(value or 0) for value in match.groups()[3:]]
            mark, known = team_mark(frame, (left, right), scores, self.teams)
            self.teams.append(mark)
            return known
        elif text.startswith(b"(msg "):
            self.finished = self.finished or _RESULT in text
        elif text.startswith(b"(server_param "):
            self.server_params = parameters(text)
        elif text.startswith(b"(player_param "):
            self.player_params = parameters(text)
        elif text.startswith(b"(player_type "):
            try:
                number, fields = checked_type(parameters(text))
            except ValueError:
                return False
            self.types[number] = fields
        else:
            return False
        return True

    def problems(self, *, path: Path | None) -> list[Problem]:
        """Return what was unknown."""
        if self.unknown is None:
            return []
        line, match = self.unknown
        text = f"play mode {match[2][:40].decode()!r} is unknown, kept as 0"
        return [
            Problem(
                code="unknown-playmode",
                severity=Severity.WARNING,
                text=text if self.n_unknown == 1 else f"{text}; so are {self.n_unknown - 1} more",
                path=path,
                line=line,
                cycle=limited_cycle(match[1]),
            )
        ]


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
    del newlines
    starts = np.zeros_like(stops)
    np.add(stops[:-1], 1, out=starts[1:])
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
    scanned = stops - starts >= _SHORTEST
    if n:
        scanned[np.argmin(scanned)] = True  # the first one that is too short, for what it lacks and where
    shows = read_shows(buffer, starts[scanned], stops[scanned])
    whole = shows.outcomes == scan.OK
    good = np.zeros(n, np.bool_)
    good[scanned] = whole
    n_good = int(np.count_nonzero(good))
    if n_good < n:
        bad = np.flatnonzero(~good)
        first = int(bad[0])
        row = int(np.count_nonzero(scanned[:first]))
        last_line = bool(len(bad) == 1 and first == n - 1 and stops[first] == len(buffer))
        text = _WHAT[int(shows.outcomes[row])]
        problems.append(
            Problem(
                code="truncated" if last_line else "bad-show",
                severity=Severity.WARNING,
                text=f"{text}; the last frame is left out"
                if last_line
                else f"{text}; {len(bad)} of {n} frames are left out",
                path=path,
                line=int(lines[first]) + 1,
                byte=int(shows.places[row]),
                cycle=int(shows.cycle[row]) if shows.cycle[row] >= 0 else None,
            )
        )
    if n and not n_good:
        raise LogError(str(problems[-1].text), path=path, line=int(lines[0]) + 1)
    keep = slice(None) if whole.all() else whole
    players = {name: column[keep] for name, column in shows.players.items()}
    return {"cycle": shows.cycle[keep], "ball": shows.ball[keep]}, players, good
