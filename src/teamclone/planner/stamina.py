"""A player's stamina over the next cycles (rcssserver `player.cpp`, updateStamina)."""

from __future__ import annotations

import numpy as np

from teamclone.planner.players import (
    CAPACITY,
    DASH_RATE,
    EFFORT,
    EFFORT_MAX,
    EFFORT_MIN,
    EXTRA,
    INCOME,
    PLAYER_PUSH_MAX,
    RECOVERY,
    STAMINA,
    Array,
    kernel,
)

MOST, LOW, HIGH = 8000.0, 2400.0, 4800.0
"""rcssserver `serverparam.cpp`: stamina_max, and where recovery and effort fall, and effort rises."""
RECOVERY_DEC, RECOVERY_MIN, EFFORT_DEC, EFFORT_INC = 0.002, 0.5, 0.005, 0.01
LEFT, FORCE, RECOVERS, RESERVE = range(4)
"""Columns of what changes: stamina, effort, recovery, capacity."""


@kernel
def tired(me: Array) -> Array:
    """(4,) how he is now."""
    return np.array([me[STAMINA], me[EFFORT], me[RECOVERY], me[CAPACITY]])


@kernel
def rest(me: Array, state: Array) -> None:
    """A cycle without a dash, or what follows on one."""
    if state[LEFT] <= LOW:
        state[RECOVERS] = max(state[RECOVERS] - RECOVERY_DEC, RECOVERY_MIN)
        state[FORCE] = max(state[FORCE] - EFFORT_DEC, me[EFFORT_MIN])
    elif state[LEFT] >= HIGH:
        state[FORCE] = min(state[FORCE] + EFFORT_INC, me[EFFORT_MAX])
    income = min(me[INCOME] * state[RECOVERS], MOST - state[LEFT])
    state[LEFT] += min(income, state[RESERVE])
    state[RESERVE] = max(0.0, state[RESERVE] - income)


@kernel
def push_of(me: Array, state: Array, power: float) -> float:
    """Speed that a dash with this power adds; he is as tired as after it."""
    push: float = min(power * me[DASH_RATE] * state[FORCE], PLAYER_PUSH_MAX)
    state[LEFT] = max(0.0, state[LEFT] - power)
    rest(me, state)
    return push


@kernel
def spare(me: Array, state: Array, reserve: float) -> float:
    """Power that he can spend and keep ``reserve`` beyond what lets recovery fall, if he has not spent all."""
    kept = -me[EXTRA] if state[RESERVE] <= 0 else LOW + reserve
    return max(0.0, state[LEFT] - kept)
