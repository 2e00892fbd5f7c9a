"""Self passes: a long run after a ball that is kicked far ahead."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.ball import Path, ball_after, fastest_from, speed_over
from teamclone.planner.dribble import DIRECTION, SPEED, VALUE, nothing, passes_actor
from teamclone.planner.field_evaluator import evaluate
from teamclone.planner.motion import S_X, S_Y, dash, drift, motion_of, spare
from teamclone.planner.players import (
    SELF_PASS,
    SELF_PASS_AHEAD,
    arrival,
    reach_of,
    seen_from,
)
from teamclone.planner.scene import (
    ACTOR,
    BALL,
    BALL_DECAY,
    BODY,
    DASH_ACCEL,
    DECAY,
    GAIN,
    GOAL_X,
    LINE_Y,
    OPPONENT,
    SERVER,
    VX,
    VY,
    Array,
    X,
    Y,
    along,
    direction,
    gap,
    kernel,
    most_turn,
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
def _overtaken(scene: Array, place: tuple[float, float], path: Path, cycles: int) -> bool:
    """Return whether an opponent has the ball in the next cycle or at its end."""
    ball = scene[BALL]
    next_ball = ball_after(scene, path, 1)
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        ahead, aside = seen_from(player, next_ball, 1)
        reach = reach_of(player, next_ball[0], next_ball[1])
        if math.hypot(ahead, aside) < reach + AT_ONCE_M:
            return True
        if math.hypot(ahead - player[DASH_ACCEL], aside) < reach:
            return True
        before, _ = along(player[X] - ball[X], player[Y] - ball[Y], path.cos, path.sin)
        allowance = SELF_PASS_AHEAD if before > IN_THE_WAY_M else SELF_PASS
        if before >= allowance.behind_m and arrival(scene, player, place, cycles, allowance) <= cycles:
            return True
    return False


@kernel
def _run(scene: Array, angle: float, turns: int, places: Array) -> int:
    """Fill where the player is after each dash in a direction, and return how many there are.

    Args:
        angle: of the dashes on the pitch, degrees. turns: before them, 0 or 1. places: (most dashes, 2).
    """
    me, server = scene[ACTOR], scene[SERVER]
    heading = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    motion = motion_of(me)
    for _ in range(1 + turns):
        drift(server, me, motion)
    for count in range(len(places)):
        power = spare(server, me, motion, RESERVE, True)
        if power <= 0:
            return count
        dash(server, me, motion, power, heading)
        x, y = motion[S_X], motion[S_Y]
        if x > GOAL_X - INSIDE_M[0] or (abs(y) > LINE_Y - INSIDE_M[1] and y * angle > 0):
            return count
        places[count, 0], places[count, 1] = x, y
    return len(places)


@kernel
def best_self_pass(scene: Array) -> Array:
    """Return (3,) the safe self pass of the greatest value; VALUE is minus infinity where there is none."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    best = nothing()
    most = MOST_DASHES[0]
    for part in range(len(MOST_X)):
        if ball[X] >= MOST_X[part]:
            most = MOST_DASHES[part + 1]
    one_turn = most_turn(me, math.hypot(me[VX], me[VY]) * me[DECAY])
    places = np.empty((most, 2))
    for index in range(DIRECTIONS):
        off = turned(STEP_DEG * index)
        angle = turned(me[BODY] + off)
        if abs(off) > one_turn or (ball[X] < FORWARD_X and abs(angle) > WIDEST_DEG):
            continue
        turns = 1 if index else 0
        count = _run(scene, angle, turns, places)
        while count >= LEAST_DASHES:
            x, y = places[count - 1, 0], places[count - 1, 1]
            cycles = 1 + turns + count
            count -= 1 if count <= STRIDE_DASHES else 2
            value = evaluate(scene, x, y, True)
            if value <= best[VALUE] or gap(x, y, -GOAL_X, 0.0) < OWN_GOAL_M:
                continue
            metres = gap(x, y, ball[X], ball[Y])
            path = Path(speed_over(metres, cycles, server[BALL_DECAY]), (x - ball[X]) / metres, (y - ball[Y]) / metres)
            if fastest_from(scene, path.cos, path.sin, ball[GAIN]) < path.speed:
                continue
            next_x, next_y = ball_after(scene, path, 1)
            if passes_actor(scene, next_x, next_y) and not _overtaken(scene, (x, y), path, cycles):
                best[VALUE], best[SPEED], best[DIRECTION] = value, path.speed, direction(path.cos, path.sin)
    return best
