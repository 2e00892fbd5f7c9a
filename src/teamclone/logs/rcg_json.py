"""Game logs in JSON, as servers 17, 18 and 19 write them (rcssserver `serializermonitor.cpp`).

The three differ in their first line (``ULG6``, ``JSON``, none) and in the shape of a record: 17 and 18 write
``{"type": "show", ...}`` with the counters apart in ``"count"`` and the teams in a list, 19 writes ``{"show": {...}}``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from teamclone.errors import LogError
from teamclone.logs import columns
from teamclone.logs.assemble import (
    TeamMark,
    checked_type,
    final_teams,
    frame_columns,
    limited_score,
    player_type_columns,
)
from teamclone.logs.match import Columns, GameLog, Problem, Severity, empty_columns
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import BY_NAME, PlayMode

Record = dict[str, Any]

_SERVERS = {b"ULG6": "17", b"JSON": "18"}
"""First line to server version; 19 writes the array alone."""

_NUMBERS: dict[str, str] = {
    "type": "type",
    "state": "state",
    "x": "x",
    "y": "y",
    "vx": "vx",
    "vy": "vy",
    "body": "body",
    "neck": "neck",
    "px": "pointto_x",
    "py": "pointto_y",
    "vw": "view_width",
    "fdist": "focus_distance",
    "fdir": "focus_direction",
    "stamina": "stamina",
    "effort": "effort",
    "recovery": "recovery",
    "capacity": "capacity",
    "fnum": "attention_unum",
}
"""Key of a player's number to its column. Servers leave out ``fdist`` and ``fdir``, converters write them."""
_COUNTS: dict[str, str] = {kind.name.lower(): columns.counter_name(kind) for kind in columns.COUNTERS}
_COLUMNS = (*_NUMBERS.values(), *_COUNTS.values())


def _limits(dtype: np.dtype[Any]) -> tuple[float, float]:
    info = np.finfo(dtype) if dtype.kind == "f" else np.iinfo(dtype)
    return float(info.min), float(info.max)


_LOWEST, _HIGHEST = np.array(
    [_limits(np.dtype(column.dtype)) for name in _COLUMNS for column in columns.PLAYERS if column.name == name]
).T
"""The range of each column, shapes (n_columns,). No value that a server writes comes near its ends."""
_QUALITY = {"l": 0, "h": 1}
_SIDE = {"l": 1, "r": -1}
_SLOT = {"l": -1, "r": N_TEAM - 1}
"""Add the number for the row of a player."""


def read_json(data: bytes, *, path: Path | None = None) -> GameLog:
    """Read a JSON game log.

    Args:
        data: the decompressed file from its first byte.
        path: named in errors and problems.

    Raises:
        LogError: there is not one good frame.
    """
    header = data[:4]
    first_line = 2 if header in _SERVERS else 1
    start = data.find(b"\n") + 1 if header in _SERVERS else 0
    reader = _Reader(path=path, capacity=data.count(b'"show"', start))
    for line, record in _records(data, start=start, first_line=first_line, reader=reader):
        reader.take(record, line=line)
    if not reader.n_frames:
        raise LogError('holds no frame: expected records with "show" in a JSON array', path=path)
    return reader.finish(log_version=f"json-{_SERVERS.get(header, '19')}")


def _records(data: bytes, *, start: int, first_line: int, reader: _Reader) -> Iterator[tuple[int | None, Any]]:
    """Yield (line, record) of each record; the line is None where there is not one record a line."""
    lines = data[start:].splitlines()
    while lines and not lines[-1].strip():
        lines.pop()
    last = len(lines) - 1
    reader.closed = bool(lines) and lines[-1].rstrip().endswith(b"]")
    for index, raw in enumerate(lines):
        # A record is an object: brackets and commas at the ends of a line belong to the array around it.
        text = raw.strip().lstrip(b"[").rstrip(b",]")
        if not text:
            continue
        try:
            record = orjson.loads(text)
        except orjson.JSONDecodeError:
            if not reader.kinds and (whole := _whole_array(data[start:])) is not None:
                reader.closed = True
                for record in whole:
                    yield None, record
                return
            if index == last:
                reader.closed = False
                reader.truncated_at = first_line + index
            else:
                reader.warn("bad-record", "not JSON, left out", line=first_line + index)
            continue
        yield first_line + index, record


def _whole_array(text: bytes) -> list[Any] | None:
    try:
        records = orjson.loads(text)
    except orjson.JSONDecodeError:
        return None
    return records if isinstance(records, list) else None


@dataclass(slots=True, kw_only=True)
class _Reader:
    """The content read so far. The values of all players and frames stand in arrays from the start."""

    path: Path | None
    capacity: int
    closed: bool = False
    truncated_at: int | None = None
    kinds: set[str] = field(default_factory=set)
    n_frames: int = 0
    has_stime: bool = False
    version: str | None = None
    cycle: NDArray[np.int32] = field(init=False)
    stoppage: NDArray[np.int32] = field(init=False)
    ball: NDArray[np.float64] = field(init=False)
    numbers: NDArray[np.float64] = field(init=False)
    players: Columns = field(init=False)
    modes: list[tuple[int, int]] = field(default_factory=list)
    teams: list[TeamMark] = field(default_factory=list)
    types: dict[int, dict[str, float]] = field(default_factory=dict)
    server_params: dict[str, float | str] = field(default_factory=dict)
    player_params: dict[str, float | str] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.cycle = np.zeros(self.capacity, np.int32)
        self.stoppage = np.zeros(self.capacity, np.int32)
        self.ball = np.full((self.capacity, 4), np.nan)
        self.numbers = np.full((self.capacity, N_PLAYERS, len(_COLUMNS)), np.nan)
        self.players = empty_columns(columns.PLAYERS, self.capacity, N_PLAYERS)

    def warn(self, code: str, text: str, *, line: int | None) -> None:
        self.problems.append(Problem(code=code, severity=Severity.WARNING, text=text, path=self.path, line=line))

    def take(self, record: Any, *, line: int | None) -> None:
        """Take one record in; a bad one becomes a problem."""
        try:
            kind, body = _open(record)
            self._take(kind, body, line=line)
        except (AttributeError, IndexError, KeyError, OverflowError, TypeError, ValueError) as error:
            self.warn("bad-record", f"record left out: {type(error).__name__} {error}", line=line)

    def _take(self, kind: str, body: Any, *, line: int | None) -> None:
        match kind:
            case "show":
                self._show(body)
            case "playmode":
                mode = BY_NAME.get(body["mode"], PlayMode.NULL)
                self.modes.append((self.n_frames, mode))
                if mode is PlayMode.NULL:
                    self.warn("unknown-playmode", f"play mode {body['mode']!r} is unknown, kept as 0", line=line)
            case "team":
                self.teams.append(_team_mark(self.n_frames, body))
            case "server_param":
                self.server_params = _params(body)
            case "player_param":
                self.player_params = _params(body)
            case "player_type":
                number, fields = checked_type({"id": body["id"]} | _params(body))
                self.types[number] = fields
            case "version":
                self.version = str(body)
            case "header":
                self.version = str(body["version"])
            case "timestamp" | "msg" | "team_graphic":
                pass
            case _:
                raise ValueError(f"unknown record {kind!r}")
        self.kinds.add(kind)

    def _show(self, show: Record) -> None:
        ball = [show["ball"][key] for key in ("x", "y", "vx", "vy")]
        players = show["players"]
        slots = [_SLOT[player["side"]] + _unum(player["unum"]) for player in players]
        values = [
            [player.get(key, np.nan) for key in _NUMBERS]
            + [counts.get(key, np.nan) for counts in (player.get("count", player),) for key in _COUNTS]
            for player in players
        ]
        found = np.array(values, np.float64)
        if ((found < _LOWEST) | (found > _HIGHEST)).any() or np.abs(ball).max() > _HIGHEST.max():
            raise ValueError("a number beyond the range of its column")
        frame = self.n_frames
        self.cycle[frame] = show["time"]
        self.stoppage[frame] = show.get("stime", 0)
        self.ball[frame] = ball
        self.numbers[frame] = np.nan
        self.numbers[frame, slots] = found
        self.players["view_quality"][frame, slots] = [_QUALITY.get(player.get("vq"), 255) for player in players]
        self.players["attention_side"][frame, slots] = [_SIDE.get(player.get("fside"), 0) for player in players]
        self.has_stime |= "stime" in show
        self.n_frames += 1

    def finish(self, *, log_version: str) -> GameLog:
        n_frames = self.n_frames
        players = {name: values[:n_frames] for name, values in self.players.items()}
        for index, name in enumerate(_COLUMNS):
            values = self.numbers[:n_frames, :, index]
            known = np.isfinite(values)
            players[name][known] = values[known].astype(players[name].dtype)
        left, right = final_teams(self.teams)
        if not self.closed:
            self.problems.append(
                Problem(
                    code="truncated",
                    severity=Severity.WARNING,
                    text="the file ends before its closing ]; the records before it are kept",
                    path=self.path,
                    line=self.truncated_at,
                    cycle=int(self.cycle[n_frames - 1]),
                )
            )
        return GameLog(
            log_version=log_version,
            server_version=self.version if self.version != "unknown" else None,
            left=left,
            right=right,
            frames=frame_columns(
                cycle=self.cycle[:n_frames],
                ball=self.ball[:n_frames],
                modes=self.modes,
                teams=self.teams,
                # Converters from text do not know the counter.
                stoppage=self.stoppage[:n_frames] if self.has_stime else None,
            ),
            players=players,
            player_types=player_type_columns(self.types),
            server_params=self.server_params,
            player_params=self.player_params,
            complete=self.closed,
            problems=tuple(self.problems),
        )


def _open(record: Record) -> tuple[str, Any]:
    """Return the kind and content of a record of either shape."""
    if "type" in record:
        return record["type"], record
    ((kind, body),) = record.items()
    return kind, body


def _unum(value: Any) -> int:
    if value not in range(1, N_TEAM + 1):
        raise ValueError(f"player number {value}, expected 1 to {N_TEAM}")
    return int(value)


def _name(value: Any) -> str | None:
    if not isinstance(value, str | None):
        raise ValueError(f"a team is called {value!r}, expected a text")
    return value


def _team_mark(frame: int, body: Record) -> TeamMark:
    teams = {team["side"]: team for team in body["teams"]} if "teams" in body else body
    left, right = teams["l"], teams["r"]
    return TeamMark(
        frame=frame,
        left=_name(left["name"]),
        right=_name(right["name"]),
        scores=(
            limited_score(left["score"]),
            limited_score(right["score"]),
            limited_score(left.get("pen_score", 0)),
            limited_score(left.get("pen_miss", 0)),
            limited_score(right.get("pen_score", 0)),
            limited_score(right.get("pen_miss", 0)),
        ),
    )


def _params(body: Record) -> dict[str, float | str]:
    """Return numbers and booleans as float, the rest as text."""
    fields = body.get("params", body)
    return {name: value if isinstance(value, str) else float(value) for name, value in fields.items()}
