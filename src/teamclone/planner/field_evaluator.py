"""What it is worth to have the ball somewhere: how far up, how near to the goal, and whether one can shoot."""

from __future__ import annotations

import math

from teamclone.planner.players import (
    AREA,
    BALL,
    GOAL_X,
    GOAL_Y,
    KEEPER,
    OPPONENT,
    Array,
    X,
    Y,
    at_rest,
    direction,
    kernel,
    turned,
)

NEAR_GOAL_M = 40.0
CAN_SHOOT, SHOOTS_HIMSELF = 1e6, 5e5
SHOOT_FROM_M, BLOCKING_M = 17.0, 20.0
POST_M = 0.5
"""How far within the posts shots go."""
KEEPER_M = 1.2
"""Of what a keeper covers, to each side."""
SHOT_DEG, OWN_SHOT_DEG = 15.0, 20.0
"""How wide a gap a shot needs."""
LEAST_STEP_DEG, SHOTS = 2.0, 10


@kernel
def can_shoot(scene: Array, x: float, y: float, himself: bool) -> bool:
    """Whether there is a gap between opponents, seen from here."""
    if math.hypot(GOAL_X - x, y) > SHOOT_FROM_M:
        return False
    low, high = direction(GOAL_X - x, POST_M - GOAL_Y - y), direction(GOAL_X - x, GOAL_Y - POST_M - y)
    width = abs(turned(high - low))
    step = max(LEAST_STEP_DEG, width / SHOTS)
    needed = OWN_SHOT_DEG if himself else SHOT_DEG
    for shot in range(int((width + 0.001) / step) + 1):
        free = 180.0
        for opponent in range(OPPONENT, BALL):
            player = scene[opponent]
            if math.hypot(player[X] - x, player[Y] - y) > BLOCKING_M:
                continue
            there_x, there_y = at_rest(player)
            away = math.hypot(there_x - x, there_y - y)
            cover = KEEPER_M if player[KEEPER] > 0 else player[AREA]
            hidden = math.degrees(math.asin(min(cover / max(away, 1e-9), 1.0)))
            if not himself:
                hidden *= 0.5
            free = min(free, abs(turned(direction(there_x - x, there_y - y) - low - shot * step)) - hidden)
        if free >= needed:
            return True
    return False


@kernel
def worth(scene: Array, x: float, y: float, himself: bool) -> float:
    """In metres, mostly."""
    value = x + max(0.0, NEAR_GOAL_M - math.hypot(GOAL_X - x, y))
    if can_shoot(scene, x, y, himself):
        value += CAN_SHOOT + (SHOOTS_HIMSELF if himself else 0.0)
    return value
