"""Dribbles and self passes that are under way: by how much the ball's motion differs from that of one begun before."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner import dribble, self_pass
from teamclone.planner.motion import S_X, S_Y, dash, drift, motion_of, spare
from teamclone.planner.scene import (
    ACTOR,
    BALL,
    BODY,
    MARGIN,
    SERVER,
    TOUCH,
    VX,
    VY,
    Array,
    gap,
    inertia_point,
    kernel,
    most_turn,
    turned,
)

FAR_OFF_M = 1.0
"""The most that is given."""


@kernel
def _residual(scene: Array, off: float, turns: int, passed: bool) -> tuple[float, int]:
    """Return the least distance between the rolling ball and where a dribble or a self pass has it, and its dashes.

    Args:
        off: direction of the dashes from the body. turns: before them. passed: a self pass.
    """
    me, server = scene[ACTOR], scene[SERVER]
    most = self_pass.MOST_DASHES[-1] if passed else dribble.DASHES[1]
    reserve = self_pass.RESERVE if passed else dribble.RESERVE
    ahead = 0.0 if passed else me[TOUCH] + dribble.AHEAD * me[MARGIN]
    angle = math.radians(me[BODY] + off)
    heading = math.cos(angle), math.sin(angle)
    motion = motion_of(me)
    for _ in range(turns):
        drift(server, me, motion)
    best, dashes = FAR_OFF_M, 0
    for count in range(1, most + 1):
        dash(server, me, motion, spare(server, me, motion, reserve, True), heading)
        ball_x, ball_y = inertia_point(scene[BALL], turns + count)
        away = gap(ball_x, ball_y, motion[S_X] + ahead * heading[0], motion[S_Y] + ahead * heading[1])
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
    found[0], found[1] = _residual(scene, 0.0, 0, False)
    found[2], found[3] = _residual(scene, 0.0, 0, True)
    found[4] = FAR_OFF_M
    one_turn = most_turn(me, math.hypot(me[VX], me[VY]))
    for passed in (False, True):
        count = self_pass.DIRECTIONS if passed else dribble.DIRECTIONS
        for index in range(1, count):
            off = turned(360.0 / count * index)
            if abs(off) > one_turn:
                continue
            away, dashes = _residual(scene, off, 1, passed)
            if away < found[4] and (dashes >= self_pass.LEAST_DASHES or not passed):
                found[4], found[5] = away, dashes
    return found
