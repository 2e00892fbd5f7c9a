"""Dribbles: a few dashes after a kick that has the ball just ahead of the player at their end."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.ball import most_acceleration, speed_over
from teamclone.planner.field_evaluator import evaluate
from teamclone.planner.motion import S_X, S_Y, dash, drift, motion_of, spare
from teamclone.planner.players import DRIBBLE, HARDLY_M, arrival
from teamclone.planner.scene import (
    ACTOR,
    AWAY,
    BALL,
    BALL_DECAY,
    BALL_SPEED_MAX,
    BODY,
    DECAY,
    GAIN,
    GOAL_X,
    LINE_Y,
    MARGIN,
    OPPONENT,
    SERVER,
    TOUCH,
    VX,
    VY,
    Array,
    X,
    Y,
    along,
    direction,
    gap,
    inertia_point,
    kernel,
    most_turn,
    turned,
)

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
VALUE, SPEED, DIRECTION = range(3)
"""Columns of what is found: its value, the speed of the ball and its direction."""


@kernel
def nothing() -> Array:
    """Return (3,) what is found where there is nothing."""
    return np.array([-np.inf, 0.0, 0.0])


@kernel
def passes_actor(scene: Array, x: float, y: float) -> bool:
    """Return whether a ball that is in this place in the next cycle has not hit the actor."""
    next_x, next_y = inertia_point(scene[ACTOR], 1)
    return gap(x, y, next_x, next_y) >= scene[ACTOR, TOUCH] + OFF_M


@kernel
def _hindered(scene: Array, place: tuple[float, float], cycles: int) -> bool:
    """Return whether an opponent has the ball at the end of a dribble."""
    ball = scene[BALL]
    metres = gap(place[0], place[1], ball[X], ball[Y])
    cos, sin = (place[0] - ball[X]) / metres, (place[1] - ball[Y]) / metres
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        ahead, _ = along(player[X] - ball[X], player[Y] - ball[Y], cos, sin)
        seen = player[AWAY] <= SEEN_M and ahead >= DRIBBLE.behind_m
        if seen and arrival(scene, player, place, cycles, DRIBBLE) <= cycles:
            return True
    return False


@kernel
def _turns_to(me: Array, off: float) -> tuple[int, float]:
    """Return the turns after which the player nearly faces what is ``off`` degrees aside, and the degrees left then."""
    left, count = abs(off), 0
    speed = math.hypot(me[VX], me[VY])
    while left > FACED_DEG and count <= MOST_TURNS:
        speed *= me[DECAY]
        left = max(0.0, left - most_turn(me, speed))
        count += 1
    return count, math.copysign(left, off)


@kernel
def _allowed(me: Array, angle: float) -> bool:
    """Return whether a dribble may go in this direction from where the player is."""
    near_goal = me[X] < OWN_GOAL_X and abs(me[Y]) < OWN_GOAL_Y
    widest = WIDEST_DEG[0] if near_goal else WIDEST_DEG[1] if me[X] < BACK_X else 180.0
    return abs(angle) <= widest


@kernel
def best_dribble(scene: Array) -> Array:
    """Return (3,) the free dribble of the greatest value; VALUE is minus infinity where there is none."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    best = nothing()
    ahead = me[TOUCH] + AHEAD * me[MARGIN]
    for index in range(DIRECTIONS):
        off = turned(360.0 / DIRECTIONS * index)
        if not _allowed(me, turned(me[BODY] + off)):
            continue
        turns, left = _turns_to(me, off)
        if turns > MOST_TURNS:
            continue
        angle = math.radians(me[BODY] + off - left)
        heading = math.cos(angle), math.sin(angle)
        motion = motion_of(me)
        for _ in range(1 + turns):
            drift(server, me, motion)
        for count in range(1, DASHES[1] + 1):
            dash(server, me, motion, spare(server, me, motion, RESERVE, False), heading)
            x, y = motion[S_X] + ahead * heading[0], motion[S_Y] + ahead * heading[1]
            if count < DASHES[0] or abs(x) > GOAL_X - INSIDE_M or abs(y) > LINE_Y - INSIDE_M:
                continue
            cycles, metres = 1 + turns + count, gap(x, y, ball[X], ball[Y])
            if metres < HARDLY_M:
                continue
            speed = speed_over(metres, cycles, server[BALL_DECAY])
            vx, vy = speed * (x - ball[X]) / metres, speed * (y - ball[Y]) / metres
            if speed > server[BALL_SPEED_MAX] or gap(vx, vy, ball[VX], ball[VY]) > most_acceleration(
                server, ball[GAIN]
            ):
                continue
            value = evaluate(scene, x, y, True)
            if value <= best[VALUE] or not passes_actor(scene, ball[X] + vx, ball[Y] + vy):
                continue
            if not _hindered(scene, (x, y), cycles):
                best[VALUE], best[SPEED], best[DIRECTION] = value, speed, direction(vx, vy)
    return best
