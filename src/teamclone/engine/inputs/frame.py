"""A frame: what all players of a cycle share, computed once. Metres, metres per cycle, degrees."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.inputs.reach import REACH_CYCLES
from teamclone.planner.scene import (
    BALL,
    BODY,
    COLUMNS,
    OPPONENT,
    PRESENT,
    ROWS,
    Array,
    X,
    Y,
    fill_scene,
    gap,
)
from teamclone.rcss.players import N_PLAYERS
from teamclone.system.compiling import kernel
from teamclone.world.channels import CHANNEL

COS, SIN, TO_BALL, NECK, VIEW_WIDTH, FLAGS, LAST, AGE, MORE = range(9)
"""Columns of ``Frame.more``: of the body direction; metres between player and ball; channels that a scene lacks."""
DEFENDERS, LAST_LINE = 0, 1
"""Of ``Frame.lines``, x: the second last opponent; the second last of the team or the ball, at most the middle."""
FAR_M = 100.0
"""Farther than anything on the pitch; the place of players off the field."""

_NECK, _VIEW, _FLAGS, _LAST, _AGE = (CHANNEL[name] for name in ("neck", "view_width", "flags", "last_command", "age"))


class Frame(NamedTuple):
    """One frame; the arrays are filled anew for each.

    Attributes:
        scene: (ROWS, COLUMNS), see `planner.scene`. more: (22, MORE). lines: (2,) DEFENDERS and LAST_LINE.
        path: (2, REACH_CYCLES + 1, 2) of the ball: free, and held by an opponent.
        steps: (2, 22) cycles to the ball in either case, see `reach.times`; known: (2,) whether they are computed.
    """

    scene: Array
    more: Array
    lines: Array
    path: Array
    steps: Array
    known: NDArray[np.bool_]


@kernel
def new_frame() -> Frame:
    """Return a frame with room for all."""
    return Frame(
        np.zeros((ROWS, COLUMNS)),
        np.zeros((N_PLAYERS, MORE)),
        np.zeros(2),
        np.zeros((2, REACH_CYCLES + 1, 2)),
        np.zeros((2, N_PLAYERS)),
        np.zeros(2, np.bool_),
    )


@kernel
def whole(value: float) -> int:
    """Return a code or a bit mask of a log as an integer, 0 where it is unknown."""
    return int(value) if abs(value) < 1e9 else 0


@kernel
def _second(scene: Array, first: int, last: int, sign: float) -> float:
    """Return the second greatest x times ``sign`` of the players in these rows; -FAR_M where there are fewer."""
    most, second = -FAR_M, -FAR_M
    for row in range(first, last):
        if scene[row, PRESENT] > 0:
            x = sign * scene[row, X]
            most, second = max(most, x), max(second, min(most, x))
    return second


@kernel
def fill_frame(frame: Frame, ball: Array, players: Array, types: Array, server: Array) -> None:
    """Fill a frame.

    Args:
        ball: (4,). players: (22, channels). types: (22, fields). server: (fields,); see `world.state.State`.
    """
    scene, more = frame.scene, frame.more
    fill_scene(ball, players, types, server, scene)
    for row in range(BALL):
        body = math.radians(scene[row, BODY])
        more[row, COS], more[row, SIN] = math.cos(body), math.sin(body)
        more[row, TO_BALL] = gap(scene[row, X], scene[row, Y], scene[BALL, X], scene[BALL, Y])
        more[row, NECK], more[row, VIEW_WIDTH] = players[row, _NECK], players[row, _VIEW]
        more[row, FLAGS], more[row, LAST] = whole(players[row, _FLAGS]), whole(players[row, _LAST])
        more[row, AGE] = whole(players[row, _AGE])
    frame.lines[DEFENDERS] = _second(scene, OPPONENT, BALL, 1.0)
    frame.lines[LAST_LINE] = min(-max(_second(scene, 0, OPPONENT, -1.0), 0.0), scene[BALL, X])
    frame.known[:] = False
