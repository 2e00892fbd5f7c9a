"""Self passes: a long run after a ball that is kicked far ahead."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.ball import ball_after, path_along
from teamclone.planner.candidates import by_value, cut, nothing
from teamclone.planner.dribble import ARRIVES, COLUMNS, DIRECTION, SPEED, TO_X, TO_Y, meet
from teamclone.planner.motion import dash_metres
from teamclone.planner.players import SELF_PASS, SELF_PASS_AHEAD, bearing, pose_after, short_m
from teamclone.planner.scene import (
    ACTOR,
    BALL,
    BODY,
    DASH_ACCEL,
    GOAL_X,
    LINE_Y,
    OPPONENT,
    ROLL,
    TURN,
    VX,
    VY,
    Array,
    X,
    Y,
    along,
    turned,
)
from teamclone.system.compiling import kernel

STEP_DEG, DIRECTIONS, LEAST_DASHES = 6.0, 60, 5
"""Directions around the body, and dashes at least."""
MOST_X, MOST_DASHES = (-20.0, 0.0, 10.0, 20.0), (6, 7, 13, 15, 20)
"""Dashes at most where the ball's x is less than each, and beyond."""
FORWARD_X, WIDEST_DEG = 41.0, 85.0
"""Behind this x it goes no further round from +x than that."""
INSIDE_M = 2.5, 3.0
"""How far from the goal line and the side lines it ends."""
OWN_GOAL_M = 18.0
STRIDE_DASHES = 10
"""More dashes come in steps of two."""
RESERVE = 350.0
"""Stamina that is left beyond what lets recovery fall."""
IN_THE_WAY_M = 0.8
"""Opponents so far ahead of the ball are thought to be earlier."""
AT_ONCE_M = 0.1
"""Metres beyond its reach within which an opponent has the ball in the next cycle."""


@kernel
def _free(scene: Array, one: Array) -> bool:
    """Return whether no opponent has the ball in the next cycle or at its end."""
    ball, place, cycles = scene[BALL], (one[TO_X], one[TO_Y]), int(one[ARRIVES])
    path = path_along(one[SPEED], one[DIRECTION])
    next_x, next_y = ball_after(scene, path, 1)
    for player in scene[OPPONENT:BALL]:
        lies = bearing(player, pose_after(player, 1), next_x, next_y)
        if min(lies.metres - AT_ONCE_M, math.hypot(lies.ahead - player[DASH_ACCEL], lies.aside)) < lies.reach:
            return False
        before, _ = along(player[X] - ball[X], player[Y] - ball[Y], path.cos, path.sin)
        allowance = SELF_PASS_AHEAD if before > IN_THE_WAY_M else SELF_PASS
        if before >= allowance.behind_m and short_m(player, place, cycles, allowance, 0) <= 0:
            return False
    return True


@kernel
def _self_passes(scene: Array) -> Array:
    """Return (n, COLUMNS) the self passes that one kick begins, whatever opponents do.

    The places where they may end are a grid: a row for each direction, a column for each number of dashes. A row ends
    before the first place that is too near to a line or out of the actor's strength.
    """
    me, ball = scene[ACTOR], scene[BALL]
    most = MOST_DASHES[int(np.searchsorted(np.array(MOST_X), ball[X], side="right"))]
    strong, metres, drift = np.empty(2, np.int64), np.empty((2, most)), np.empty((2, most))
    for waits in (1, 2):
        strong[waits - 1] = dash_metres(scene, waits, RESERVE, True, metres[waits - 1])
        drift[waits - 1] = me[ROLL + waits + 1 : ROLL + waits + 1 + most]
    rows, dashes = np.arange(DIRECTIONS), np.arange(1, most + 1)
    off, turns = turned(STEP_DEG * rows), np.minimum(rows, 1)
    angle = turned(me[BODY] + off).reshape(-1, 1)
    x = me[X] + me[VX] * drift[turns] + metres[turns] * np.cos(np.radians(angle))
    y = me[Y] + me[VY] * drift[turns] + metres[turns] * np.sin(np.radians(angle))

    one_turn, widest = me[TURN + 2] - me[TURN + 1], WIDEST_DEG if ball[X] < FORWARD_X else 180.0
    allowed = (np.abs(off) <= one_turn).reshape(-1, 1) & (np.abs(angle) <= widest)
    allowed = allowed & (dashes <= strong[turns].reshape(-1, 1))
    ends = (x > GOAL_X - INSIDE_M[0]) | ((np.abs(y) > LINE_Y - INSIDE_M[1]) & (y * angle > 0))
    cut(allowed.reshape(-1), ends.reshape(-1), most * np.arange(DIRECTIONS + 1))
    last = allowed.sum(axis=1).reshape(-1, 1)
    allowed &= (dashes >= LEAST_DASHES) & ((dashes < STRIDE_DASHES) | ((last - dashes) % 2 == 0))
    allowed &= np.hypot(x + GOAL_X, y) >= OWN_GOAL_M

    chosen = np.flatnonzero(allowed[:, ::-1])  # of equal values the one with most dashes comes first
    made, count = np.empty((len(chosen), COLUMNS)), 0
    for place in chosen:
        row, column = place // most, most - 1 - place % most
        count += meet(scene, x[row, column], y[row, column], 1 + turns[row] + dashes[column], made[count])
    return made[:count]


@kernel
def best_self_pass(scene: Array) -> Array:
    """Return (COLUMNS,) the safe self pass of the greatest value; VALUE is minus infinity where there is none."""
    made = _self_passes(scene)
    for index in by_value(made):
        if _free(scene, made[index]):
            return made[index]
    return nothing(COLUMNS)
