"""What it is worth to have the ball somewhere: how far up, how near to the goal, and whether there is a shot."""

from __future__ import annotations

import math

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
    kernel,
    turned,
)

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
def can_shoot(scene: Array, x: float, y: float, actor: bool) -> bool:
    """Return whether there is a gap between opponents for a shot from here, of the actor or of a team mate."""
    if gap(GOAL_X, 0.0, x, y) > SHOOT_FROM_M:
        return False
    low, high = direction(GOAL_X - x, POST_M - GOAL_Y - y), direction(GOAL_X - x, GOAL_Y - POST_M - y)
    width = abs(turned(high - low))
    step = max(LEAST_STEP_DEG, width / SHOTS)
    needed = ACTOR_SHOT_DEG if actor else SHOT_DEG
    for shot in range(int((width + 0.001) / step) + 1):
        free = 180.0
        for opponent in range(OPPONENT, BALL):
            player = scene[opponent]
            if gap(player[X], player[Y], x, y) > BLOCKING_M:
                continue
            rest_x, rest_y = at_rest(player)
            away = gap(rest_x, rest_y, x, y)
            cover = GOALKEEPER_M if player[GOALKEEPER] > 0 else player[AREA]
            hidden = math.degrees(math.asin(min(cover / max(away, 1e-9), 1.0)))
            if not actor:
                hidden *= 0.5
            free = min(free, abs(turned(direction(rest_x - x, rest_y - y) - low - shot * step)) - hidden)
        if free >= needed:
            return True
    return False


@kernel
def evaluate(scene: Array, x: float, y: float, actor: bool) -> float:
    """Return the value of a ball in a place, of the actor or of a team mate; in metres, mostly."""
    value = x + max(0.0, NEAR_GOAL_M - gap(GOAL_X, 0.0, x, y))
    if can_shoot(scene, x, y, actor):
        value += CAN_SHOOT + (ACTOR_SHOOTS if actor else 0.0)
    return value
