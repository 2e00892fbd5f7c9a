"""Reader of the logs that players built on librcsc write with ``--offline_logging``: what the server sent them.

A line is a message. Of ``(sense_body ...)``, one a cycle, and ``(see ...)`` is read what tells where players and the
ball are; landmarks are passed over.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import LogError
from teamclone.logs.inflate import read_bytes

_INIT = re.compile(rb"\((?:init|reconnect) ([lr]) (1[01]|[1-9]) ")
_STAMP = re.compile(rb"\((sense_body|see) (\d{1,9}) ")
_OBJECT = re.compile(
    rb'\(\((?:(?P<ball>[bB])|(?P<player>[pP])(?: "(?P<team>[^"]*)"(?: (?P<unum>\d{1,2})(?: goalie)?)?)?)\)'
    rb"(?P<numbers>(?: [-+]?\d{1,9}(?:\.\d{1,9})?(?:[eE][-+]?\d{1,2})?){2,7})"
)
_NEAR = (b"B", b"P")


@dataclass(frozen=True, slots=True, kw_only=True)
class OfflineLog:
    """What one player was sent.

    Attributes:
        side, unum: of the player; side is 1 left, -1 right.
        cycle, stoppage: (n_cycles,) int32, of every sense_body; the second counts those of one cycle from 0, as a game
            log counts its frames.
        received: (n_cycles,) bool, whether a visual message came with it.
        objects: what the visual messages tell.
    """

    side: int
    unum: int
    cycle: NDArray[np.int32]
    stoppage: NDArray[np.int32]
    received: NDArray[np.bool_]
    objects: ShownObjects


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownObjects:
    """Players and balls in visual messages, one value an object, in the order of the log.

    Attributes:
        row: int32, index of its sense_body in `OfflineLog`.
        ball: bool. near: bool, shown by place alone, since outside of the view cone.
        team: int16, index into ``teams``, -1 where it is not told. unum: uint8, 0 where it is not told.
        distance: float32, metres. direction: float32, degrees from the line of sight.
        change: (n, 2) float32, metres and degrees per cycle; NaN where it is not told.
        teams: names of teams.
    """

    row: NDArray[np.int32]
    ball: NDArray[np.bool_]
    near: NDArray[np.bool_]
    team: NDArray[np.int16]
    unum: NDArray[np.uint8]
    distance: NDArray[np.float32]
    direction: NDArray[np.float32]
    change: NDArray[np.float32]
    teams: tuple[str, ...]


def read_offline_log(path: Path) -> OfflineLog:
    """Read a player's log, also compressed as other logs may be; of one that was cut off what is there.

    Raises:
        LogError: it cannot be read, or is no such log.
    """
    content, _ = read_bytes(path)
    me: tuple[int, int] | None = None
    cycles: list[tuple[int, int]] = []
    received: list[bool] = []
    times: Counter[int] = Counter()
    teams: dict[bytes, int] = {}
    rows: list[tuple[int, bool, bool, int, int]] = []
    numbers: list[list[float]] = []
    for line in content.splitlines():
        if me is None and (found := _INIT.match(line)):
            me = (1 if found[1] == b"l" else -1), int(found[2])
        stamp = _STAMP.match(line)
        if stamp is None:
            continue
        cycle = int(stamp[2])
        if stamp[1] == b"sense_body":
            cycles.append((cycle, times[cycle]))
            received.append(False)
            times[cycle] += 1
        elif cycles and cycles[-1][0] == cycle:
            received[-1] = True
            for one in _OBJECT.finditer(line):
                name, told = one["team"], [float(number) for number in one["numbers"].split()]
                team = -1 if name is None else teams.setdefault(name, len(teams))
                near = (one["ball"] or one["player"]) in _NEAR
                rows.append((len(cycles) - 1, one["ball"] is not None, near, team, int(one["unum"] or 0)))
                numbers.append(([*told, np.nan, np.nan] if len(told) < 4 else told)[:4])
    if me is None or not cycles:
        raise LogError("is no log that a player wrote with --offline_logging: it lacks (init or (sense_body", path=path)
    whole = np.array(rows, np.int32).reshape(-1, 5)
    real = np.array(numbers, np.float32).reshape(-1, 4)
    stamps = np.array(cycles, np.int32)
    return OfflineLog(
        side=me[0],
        unum=me[1],
        cycle=stamps[:, 0],
        stoppage=stamps[:, 1],
        received=np.array(received, np.bool_),
        objects=ShownObjects(
            row=whole[:, 0],
            ball=whole[:, 1].astype(np.bool_),
            near=whole[:, 2].astype(np.bool_),
            team=whole[:, 3].astype(np.int16),
            unum=whole[:, 4].astype(np.uint8),
            distance=real[:, 0],
            direction=real[:, 1],
            change=real[:, 2:],
            teams=tuple(name.decode("utf-8", "replace") for name in teams),
        ),
    )
