"""Self passes: a long run after a ball that is kicked far ahead."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from teamclone.planner.ball import ball_after, path_along
from teamclone.planner.candidates import by_value, nothing
from teamclone.planner.dribble import ARRIVES, COLUMNS, DIRECTION, SPEED, TO_X, TO_Y, meet
from teamclone.planner.motion import dash_metres
from teamclone.planner.players import SELF_PASS, SELF_PASS_AHEAD, bearing, lateness, pose_after
from teamclone.planner.scene import (
    ACTOR,
    BALL,
    BODY,
    DASH_ACCEL,
    GOAL_X,
    LINE_Y,
    OPPONENT,
    TURN,
    Array,
    X,
    Y,
    along,
    gap,
    inertia_point,
    kernel,
    turned,
)

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
        if before >= allowance.behind_m and lateness(scene, player, place, cycles, allowance) <= 0:
            return False
    return True


@kernel
def _counts(most: int) -> NDArray[np.int64]:
    """Return the numbers of dashes that are tried where there may be so many, the greatest first."""
    counts = np.arange(most, LEAST_DASHES - 1, -1)
    return counts[(counts < STRIDE_DASHES) | ((most - counts) % 2 == 0)]


@kernel
def _self_passes(scene: Array) -> Array:
    """Return (n, COLUMNS) the self passes that one kick begins, whatever opponents do."""
    me, ball = scene[ACTOR], scene[BALL]
    zone = int(np.searchsorted(np.array(MOST_X), ball[X], side="right"))
    metres = np.empty((2, MOST_DASHES[zone]))
    strong = [dash_metres(scene, 1 + turns, RESERVE, True, metres[turns]) for turns in range(2)]
    one_turn, widest = me[TURN + 1] - me[TURN], WIDEST_DEG if ball[X] < FORWARD_X else 180.0
    made, count = np.empty((DIRECTIONS * MOST_DASHES[zone], COLUMNS)), 0
    for index in range(DIRECTIONS):
        off, turns = turned(STEP_DEG * index), min(index, 1)
        angle = turned(me[BODY] + off)
        if abs(off) > one_turn or abs(angle) > widest:
            continue
        cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        places, inside = np.empty((strong[turns], 2)), strong[turns]
        for dashes in range(1, strong[turns] + 1):
            drift_x, drift_y = inertia_point(me, 1 + turns + dashes)
            x, y = drift_x + metres[turns, dashes - 1] * cos, drift_y + metres[turns, dashes - 1] * sin
            places[dashes - 1] = x, y
            if x > GOAL_X - INSIDE_M[0] or (abs(y) > LINE_Y - INSIDE_M[1] and y * angle > 0):
                inside = min(inside, dashes - 1)
        for dashes in _counts(inside):
            x, y = places[dashes - 1]
            away = gap(x, y, -GOAL_X, 0.0) >= OWN_GOAL_M
            if away and meet(scene, x, y, 1 + turns + dashes, made[count]):
                count += 1
    return made[:count]


@kernel
def best_self_pass(scene: Array) -> Array:
    """Return (COLUMNS,) the safe self pass of the greatest value; VALUE is minus infinity where there is none."""
    made = _self_passes(scene)
    for index in by_value(made):
        if _free(scene, made[index]):
            return made[index]
    return nothing(COLUMNS)
