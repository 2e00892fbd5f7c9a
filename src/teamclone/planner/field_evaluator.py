"""What it is worth to have the ball somewhere: how far up, how near to the goal, and whether there is a shot."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.scene import (
    AREA,
    BALL,
    GOAL_X,
    GOAL_Y,
    GOALKEEPER,
    OPPONENT,
    Array,
    X,
    Y,
    at_rest,
    direction,
    gap,
    turned,
)
from teamclone.system.compiling import kernel

NEAR_GOAL_M = 40.0
CAN_SHOOT, ACTOR_SHOOTS = 1e6, 5e5
SHOOT_FROM_M, BLOCKING_M = 17.0, 20.0
POST_M = 0.5
"""How far within the posts shots go."""
GOALKEEPER_M = 1.2
"""What a goalkeeper covers, to each side."""
SHOT_DEG, ACTOR_SHOT_DEG = 15.0, 20.0
"""How wide a gap a shot needs."""
LEAST_STEP_DEG, SHOTS = 2.0, 10


@kernel
def _hidden(scene: Array, x: float, y: float, actor: bool) -> tuple[Array, Array]:
    """Return (n,) the middles of what opponents hide of the view from a place, and half its widths, degrees."""
    middles, halves, count = np.empty(BALL - OPPONENT), np.empty(BALL - OPPONENT), 0
    for player in scene[OPPONENT:BALL]:
        if gap(player[X], player[Y], x, y) <= BLOCKING_M:
            rest_x, rest_y = at_rest(player)
            cover = GOALKEEPER_M if player[GOALKEEPER] > 0 else player[AREA]
            half = math.degrees(math.asin(min(1.0, cover / max(1e-9, gap(rest_x, rest_y, x, y)))))
            middles[count], halves[count] = direction(rest_x - x, rest_y - y), half if actor else 0.5 * half
            count += 1
    return middles[:count], halves[:count]


@kernel
def can_shoot(scene: Array, x: float, y: float, actor: bool) -> bool:
    """Return whether there is a gap between opponents for a shot from here, of the actor or of a team mate.

    Opponents close intervals of the goal mouth, each as much wider to both sides as a shot needs. Shots are steps
    apart: of what is left open between two intervals, only a part with a step in it counts.
    """
    if gap(GOAL_X, 0.0, x, y) > SHOOT_FROM_M:
        return False
    right, left = direction(GOAL_X - x, POST_M - GOAL_Y - y), direction(GOAL_X - x, GOAL_Y - POST_M - y)
    width = abs(turned(left - right))
    step = max(LEAST_STEP_DEG, width / SHOTS)
    middles, halves = _hidden(scene, x, y, actor)
    halves += ACTOR_SHOT_DEG if actor else SHOT_DEG
    from_right = 0.5 * width + (middles - right - 0.5 * width + 180.0) % 360.0 - 180.0
    begins, ends = from_right - halves, from_right + halves
    free = 0.0
    for index in np.argsort(begins, kind="mergesort"):
        if begins[index] >= free:
            break
        if ends[index] > free:
            free = step * math.ceil(ends[index] / step)
    return free <= width + 0.001


@kernel
def evaluate(scene: Array, x: float, y: float, actor: bool) -> float:
    """Return the value of a ball in a place, of the actor or of a team mate; in metres, mostly."""
    value = x + max(0.0, NEAR_GOAL_M - gap(GOAL_X, 0.0, x, y))
    if can_shoot(scene, x, y, actor):
        value += CAN_SHOOT + (ACTOR_SHOOTS if actor else 0.0)
    return value
