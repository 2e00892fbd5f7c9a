"""Dribbles: a few dashes after a kick that has the ball just ahead of the player at their end."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.ball import most_acceleration, speed_over
from teamclone.planner.candidates import VALUE, by_value, nothing
from teamclone.planner.field_evaluator import evaluate
from teamclone.planner.motion import dash_metres
from teamclone.planner.players import DRIBBLE, HARDLY_M, short_m
from teamclone.planner.scene import (
    ACTOR,
    AWAY,
    BALL,
    BALL_DECAY,
    BALL_SPEED_MAX,
    BODY,
    GAIN,
    GOAL_X,
    LINE_Y,
    MARGIN,
    OPPONENT,
    SERVER,
    TOUCH,
    TURN,
    VX,
    VY,
    Array,
    X,
    Y,
    along,
    direction,
    gap,
    inertia_point,
    turned,
)
from teamclone.system.compiling import kernel

DIRECTIONS, DASHES, AHEAD = 16, (2, 4), 0.2
"""Directions of a dribble around the body, its dashes, and the part of the margin by which the ball is then ahead."""
FACED_DEG, MOST_TURNS = 10.0, 2
OWN_GOAL_X, OWN_GOAL_Y, BACK_X, WIDEST_DEG = -36.0, 20.0, 16.0, (45.0, 100.0)
"""Near the own goal, and behind an x, dribbles go no further round from +x than this."""
RESERVE = 300.0
"""Stamina that is left beyond what lets recovery fall."""
SEEN_M = 20.0
"""Opponents further from the actor do not hinder a dribble."""
OFF_M = 0.1
"""By how much a ball has to pass the player at least."""
INSIDE_M = 1.0
SPEED, DIRECTION, TO_X, TO_Y, ARRIVES, COLUMNS = range(1, 7)
"""Columns of a way to kick the ball and run after it, and how many with VALUE: the speed of the ball and its direction,
where it is met and after how many cycles."""


@kernel
def meet(scene: Array, x: float, y: float, cycles: int, made: Array) -> bool:
    """Fill the kick that has the ball in a place after so many cycles; return whether one kick does, past the actor.

    Args:
        made: (COLUMNS,).
    """
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    metres = gap(x, y, ball[X], ball[Y])
    if metres < HARDLY_M:
        return False
    speed = speed_over(metres, cycles, server[BALL_DECAY])
    vx, vy = speed * (x - ball[X]) / metres, speed * (y - ball[Y]) / metres
    passed = gap(ball[X] + vx, ball[Y] + vy, me[X] + me[VX], me[Y] + me[VY]) >= me[TOUCH] + OFF_M
    kicked = gap(vx, vy, ball[VX], ball[VY]) <= most_acceleration(server, ball[GAIN])
    if not (passed and kicked and speed <= server[BALL_SPEED_MAX]):
        return False
    made[VALUE], made[SPEED], made[DIRECTION] = evaluate(scene, x, y, True), speed, direction(vx, vy)
    made[TO_X], made[TO_Y], made[ARRIVES] = x, y, cycles
    return True


@kernel
def _free(scene: Array, one: Array) -> bool:
    """Return whether no opponent has the ball at the end of a dribble."""
    ball, place, cycles = scene[BALL], (one[TO_X], one[TO_Y]), int(one[ARRIVES])
    metres = gap(place[0], place[1], ball[X], ball[Y])
    cos, sin = (place[0] - ball[X]) / metres, (place[1] - ball[Y]) / metres
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        ahead, _ = along(player[X] - ball[X], player[Y] - ball[Y], cos, sin)
        seen = player[AWAY] <= SEEN_M and ahead >= DRIBBLE.behind_m
        if seen and short_m(player, place, cycles, DRIBBLE, 0) <= 0:
            return False
    return True


@kernel
def _allowed(me: Array, angle: float) -> bool:
    """Return whether a dribble may go in this direction from where the player is."""
    near_goal = me[X] < OWN_GOAL_X and abs(me[Y]) < OWN_GOAL_Y
    widest = WIDEST_DEG[0] if near_goal else WIDEST_DEG[1] if me[X] < BACK_X else 180.0
    return abs(angle) <= widest


@kernel
def _dribbles(scene: Array) -> Array:
    """Return (n, COLUMNS) the dribbles that one kick begins, whatever opponents do."""
    me = scene[ACTOR]
    first, last = TURN + 1, TURN + 1 + MOST_TURNS  # turns follow the kick: the player is slower by a cycle
    turnable = me[first : last + 1] - me[first]
    run_m = np.empty((MOST_TURNS + 1, DASHES[1]))
    for turns in range(MOST_TURNS + 1):
        dash_metres(scene, 1 + turns, RESERVE, False, run_m[turns])
    run_m += me[TOUCH] + AHEAD * me[MARGIN]
    made, count = np.empty((DIRECTIONS * DASHES[1], COLUMNS)), 0
    for index in range(DIRECTIONS):
        off = turned(360.0 / DIRECTIONS * index)
        turns = int(np.searchsorted(turnable, abs(off) - FACED_DEG))
        if turns > MOST_TURNS or not _allowed(me, turned(me[BODY] + off)):
            continue
        left = max(0.0, abs(off) - turnable[turns])
        angle = math.radians(me[BODY] + off - math.copysign(left, off))
        for dashes in range(DASHES[0], DASHES[1] + 1):
            cycles, metres = 1 + turns + dashes, run_m[turns, dashes - 1]
            drift_x, drift_y = inertia_point(me, cycles)
            x, y = drift_x + metres * math.cos(angle), drift_y + metres * math.sin(angle)
            inside = abs(x) <= GOAL_X - INSIDE_M and abs(y) <= LINE_Y - INSIDE_M
            if inside and meet(scene, x, y, cycles, made[count]):
                count += 1
    return made[:count]


@kernel
def best_dribble(scene: Array) -> Array:
    """Return (COLUMNS,) the free dribble of the greatest value; VALUE is minus infinity where there is none."""
    made = _dribbles(scene)
    for index in by_value(made):
        if _free(scene, made[index]):
            return made[index]
    return nothing(COLUMNS)
