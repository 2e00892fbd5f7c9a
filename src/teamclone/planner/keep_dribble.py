"""Dribbles and self passes that are under way: by how much the ball's motion differs from that of one begun before."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner import dribble, self_pass
from teamclone.planner.motion import dash_metres
from teamclone.planner.scene import (
    ACTOR,
    BALL,
    BODY,
    MARGIN,
    TOUCH,
    VX,
    VY,
    Array,
    gap,
    inertia_point,
    most_turn,
    turned,
)
from teamclone.system.compiling import kernel

FAR_OFF_M = 1.0
"""The most that is given."""


@kernel
def _run_metres(scene: Array, passed: bool) -> Array:
    """Return (2, most dashes) how far ahead of its drift dashes have the actor's ball, without a turn and after one."""
    most = self_pass.MOST_DASHES[-1] if passed else dribble.DASHES[1]
    metres = np.empty((2, most))
    for turns in range(2):
        dash_metres(scene, turns, self_pass.RESERVE if passed else dribble.RESERVE, True, metres[turns])
    return metres if passed else metres + scene[ACTOR, TOUCH] + dribble.AHEAD * scene[ACTOR, MARGIN]


@kernel
def _residual(scene: Array, off: float, turns: int, metres: Array) -> tuple[float, int]:
    """Return the least distance between the rolling ball and where a dribble or a self pass has it, and its dashes.

    Args:
        off: direction of the dashes from the body. turns: before them. metres: see `_run_metres`.
    """
    me, ball = scene[ACTOR], scene[BALL]
    angle = math.radians(me[BODY] + off)
    cos, sin = math.cos(angle), math.sin(angle)
    best, dashes = FAR_OFF_M, 0
    for count in range(1, metres.shape[1] + 1):
        (x, y), (ball_x, ball_y) = inertia_point(me, turns + count), inertia_point(ball, turns + count)
        away = gap(ball_x, ball_y, x + metres[turns, count - 1] * cos, y + metres[turns, count - 1] * sin)
        if away < best:
            best, dashes = away, count
    return best, dashes


@kernel
def underway(scene: Array) -> Array:
    """Return (6,) metres by which the ball misses, at most FAR_OFF_M, and after how many dashes.

    First of a dribble straight on, then of a self pass straight on, then of the nearer of both after one turn.
    """
    me = scene[ACTOR]
    found = np.zeros(6)
    dribbled, passed_on = _run_metres(scene, False), _run_metres(scene, True)
    found[0], found[1] = _residual(scene, 0.0, 0, dribbled)
    found[2], found[3] = _residual(scene, 0.0, 0, passed_on)
    found[4] = FAR_OFF_M
    one_turn = most_turn(me, math.hypot(me[VX], me[VY]))
    for passed in (False, True):
        count = self_pass.DIRECTIONS if passed else dribble.DIRECTIONS
        for index in range(1, count):
            off = turned(360.0 / count * index)
            if abs(off) > one_turn:
                continue
            away, dashes = _residual(scene, off, 1, passed_on if passed else dribbled)
            if away < found[4] and (dashes >= self_pass.LEAST_DASHES or not passed):
                found[4], found[5] = away, dashes
    return found
