"""Game logs in JSON, as servers 17, 18 and 19 write them (rcssserver `serializermonitor.cpp`).

The three differ in their first line (``ULG6``, ``JSON``, none) and in the shape of a record: 17 and 18 write
``{"type": "show", ...}`` with the counters apart in ``"count"`` and the teams in a list, 19 writes ``{"show": {...}}``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
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
    player_type_columns,
    team_mark,
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
    reader = _Reader(path=path)
    for line, record in _records(data, start=start, first_line=first_line, reader=reader):
        reader.take(record, line=line)
    if not len(reader.frames):
        raise LogError('holds no frame: expected records with "show" in a JSON array', path=path)
    return reader.finish(log_version=f"json-{_SERVERS.get(header, '19')}")


def _records(data: bytes, *, start: int, first_line: int, reader: _Reader) -> Iterator[tuple[int | None, Any]]:
    """Yield (line, record) of each record; the line is None where there is not one record a line."""
    lines = data[start:].splitlines()
    while lines and not lines[-1].strip():
        lines.pop()
    last = len(lines) - 1
    reader.closed = bool(lines) and lines[-1].rstrip().endswith(b"]")
    line_by_line = False
    for index, raw in enumerate(lines):
        # A record is an object: brackets and commas at the ends of a line belong to the array around it.
        text = raw.strip().lstrip(b"[").rstrip(b",]")
        if not text:
            continue
        try:
            record = orjson.loads(text)
        except orjson.JSONDecodeError:
            # Asked once: the first line that is no record shows whether records stand on lines of their own.
            if not line_by_line and not reader.kinds and (whole := _whole_array(data[start:])) is not None:
                reader.closed = True
                for record in whole:
                    yield None, record
                return
            line_by_line = True
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


_BLOCK = 256
"""Frames that are read into one array before their numbers go to the columns.

A log's size does not say how many frames it has, and each takes many times the room of the shortest record.
"""


def _empty_block() -> Columns:
    made = empty_columns(columns.PLAYERS, _BLOCK, N_PLAYERS)
    return made | {
        "cycle": np.zeros(_BLOCK, np.int32),
        "stime": np.zeros(_BLOCK, np.int32),
        "ball": np.full((_BLOCK, 4), np.nan),
    }


@dataclass(slots=True, kw_only=True)
class _Frames:
    """The frames read so far: blocks of columns, and the numbers of the frames that are no block yet."""

    blocks: list[Columns] = field(default_factory=list)
    n_open: int = 0
    numbers: NDArray[np.float64] = field(default_factory=lambda: np.empty((_BLOCK, N_PLAYERS, len(_COLUMNS))))
    columns: Columns = field(default_factory=_empty_block)

    def __len__(self) -> int:
        return (_BLOCK * len(self.blocks)) + self.n_open

    def add(self, show: Record) -> None:
        """Add a frame; a bad one changes nothing."""
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
        qualities = [_QUALITY.get(player.get("vq"), 255) for player in players]
        sides = [_SIDE.get(player.get("fside"), 0) for player in players]
        frame, made = self.n_open, self.columns
        made["cycle"][frame] = show["time"]
        made["stime"][frame] = show.get("stime", 0)
        made["ball"][frame] = ball
        made["view_quality"][frame, slots] = qualities
        made["attention_side"][frame, slots] = sides
        self.numbers[frame] = np.nan
        self.numbers[frame, slots] = found
        self.n_open += 1
        if self.n_open == _BLOCK:
            self._close()

    def _close(self) -> None:
        for index, name in enumerate(_COLUMNS):
            values = self.numbers[: self.n_open, :, index]
            known = np.isfinite(values)
            self.columns[name][: self.n_open][known] = values[known].astype(self.columns[name].dtype)
        self.blocks.append({name: values[: self.n_open] for name, values in self.columns.items()})
        self.columns, self.n_open = _empty_block(), 0

    def finish(self) -> Columns:
        """Return the columns of all frames."""
        if self.n_open:
            self._close()
        names = list(self.columns)
        return {name: np.concatenate([block.pop(name) for block in self.blocks]) for name in names}


@dataclass(slots=True, kw_only=True)
class _Reader:
    """The content read so far. Of problems of one code the first one and their number are kept."""

    path: Path | None
    closed: bool = False
    truncated_at: int | None = None
    kinds: set[str] = field(default_factory=set)
    frames: _Frames = field(default_factory=_Frames)
    has_stime: bool = False
    version: str | None = None
    modes: list[tuple[int, int]] = field(default_factory=list)
    teams: list[TeamMark] = field(default_factory=list)
    types: dict[int, dict[str, float]] = field(default_factory=dict)
    server_params: dict[str, float | str] = field(default_factory=dict)
    player_params: dict[str, float | str] = field(default_factory=dict)
    warned: dict[str, tuple[Problem, int]] = field(default_factory=dict)

    def warn(self, code: str, text: str, *, line: int | None) -> None:
        if code in self.warned:
            first, number = self.warned[code]
        else:
            first = Problem(code=code, severity=Severity.WARNING, text=text, path=self.path, line=line)
            number = 0
        self.warned[code] = (first, number + 1)

    def take(self, record: Any, *, line: int | None) -> None:
        """Take one record in; a bad one becomes a problem."""
        try:
            kind, body = _open(record)
            self._take(kind, body, line=line)
        except (AttributeError, IndexError, KeyError, OverflowError, TypeError, ValueError) as error:
            self.warn("bad-record", f"record left out: {type(error).__name__} {str(error)[:200]}", line=line)

    def _take(self, kind: str, body: Any, *, line: int | None) -> None:
        match kind:
            case "show":
                self.frames.add(body)
                self.has_stime |= "stime" in body
            case "playmode":
                mode = BY_NAME.get(body["mode"], PlayMode.NULL)
                self.modes.append((len(self.frames), mode))
                if mode is PlayMode.NULL:
                    word = str(body["mode"])[:40]
                    self.warn("unknown-playmode", f"play mode {word!r} is unknown, kept as 0", line=line)
            case "team":
                names, scores = _teams(body)
                mark, known = team_mark(len(self.frames), names, scores, self.teams)
                self.teams.append(mark)
                if not known:
                    raise ValueError("a score that no match has")
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

    def finish(self, *, log_version: str) -> GameLog:
        made = self.frames.finish()
        problems = [
            first if number == 1 else replace(first, text=f"{first.text}; so are {number - 1} more")
            for first, number in self.warned.values()
        ]
        left, right = final_teams(self.teams)
        if not self.closed:
            problems.append(
                Problem(
                    code="truncated",
                    severity=Severity.WARNING,
                    text="the file ends before its closing ]; the records before it are kept",
                    path=self.path,
                    line=self.truncated_at,
                    cycle=int(made["cycle"][-1]),
                )
            )
        return GameLog(
            log_version=log_version,
            server_version=self.version if self.version != "unknown" else None,
            left=left,
            right=right,
            frames=frame_columns(
                cycle=made["cycle"],
                ball=made["ball"],
                modes=self.modes,
                teams=self.teams,
                # Converters from text do not know the counter.
                stoppage=made["stime"] if self.has_stime else None,
            ),
            players={column.name: made[column.name] for column in columns.PLAYERS},
            player_types=player_type_columns(self.types),
            server_params=self.server_params,
            player_params=self.player_params,
            complete=self.closed,
            problems=tuple(problems),
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


def _teams(body: Record) -> tuple[tuple[str | None, str | None], list[float]]:
    """Return the names, left and right, and scores and penalties in the order of ``TeamMark.scores``."""
    teams = {team["side"]: team for team in body["teams"]} if "teams" in body else body
    left, right = teams["l"], teams["r"]
    penalties = [float(team.get(key, 0)) for team in (left, right) for key in ("pen_score", "pen_miss")]
    return (_name(left["name"]), _name(right["name"])), [float(left["score"]), float(right["score"]), *penalties]


def _params(body: Record) -> dict[str, float | str]:
    """Return numbers and booleans as float, the rest as text."""
    fields = body.get("params", body)
    return {name: value if isinstance(value, str) else float(value) for name, value in fields.items()}
