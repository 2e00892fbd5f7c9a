"""A player's next cycles: where dashes and turns bring it, and its stamina (rcssserver `player.cpp`, updateStamina)."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.scene import (
    ACTOR,
    CAPACITY,
    DASH_RATE,
    DECAY,
    EFFORT,
    EFFORT_MAX,
    EFFORT_MIN,
    EXTRA,
    MAX_DASH,
    RECOVERY,
    SERVER,
    STAMINA,
    STAMINA_INC,
    Array,
    inertia_point,
)
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.system.compiling import kernel

S_STAMINA, S_EFFORT, S_RECOVERY, S_CAPACITY = range(4)
"""What dashes use up, a part of the columns of a player."""
(_MOST, _TOTAL, _RECOVER_THR, _RECOVER_DEC, _RECOVER_MIN, _EFFORT_DEC_THR, _EFFORT_DEC, _EFFORT_INC_THR, _EFFORT_INC,
 _ACCEL_MAX, _SIDE_RATE, _BACK_RATE) = (SERVER_FIELD[name] for name in (
    "stamina_max", "stamina_capacity", "recover_dec_thr", "recover_dec", "recover_min", "effort_dec_thr", "effort_dec",
    "effort_inc_thr", "effort_inc", "player_accel_max", "side_dash_rate", "back_dash_rate"))  # fmt: skip


@kernel
def stamina_of(me: Array) -> Array:
    """Return (4,) a player's stamina, effort, recovery and capacity now."""
    return np.array([me[STAMINA], me[EFFORT], me[RECOVERY], me[CAPACITY]])


@kernel
def recover(server: Array, me: Array, left: Array) -> None:
    """Change stamina, effort, recovery and capacity as the end of a cycle does; `dynamics.formulas.rested`."""
    stamina, most = left[S_STAMINA], server[_MOST]
    if stamina <= server[_RECOVER_THR] * most:
        left[S_RECOVERY] = max(left[S_RECOVERY] - server[_RECOVER_DEC], server[_RECOVER_MIN])
    if stamina <= server[_EFFORT_DEC_THR] * most:
        left[S_EFFORT] = max(left[S_EFFORT] - server[_EFFORT_DEC], me[EFFORT_MIN])
    if stamina >= server[_EFFORT_INC_THR] * most:
        left[S_EFFORT] = min(left[S_EFFORT] + server[_EFFORT_INC], me[EFFORT_MAX])
    recovered = min(me[STAMINA_INC] * left[S_RECOVERY], most - stamina)
    if server[_TOTAL] >= 0:
        recovered = min(recovered, left[S_CAPACITY])
    left[S_STAMINA] += recovered
    left[S_CAPACITY] = max(0.0, left[S_CAPACITY] - recovered)


@kernel
def spare(server: Array, me: Array, left: Array, reserve: float, last: bool) -> float:
    """Return the power of a dash that leaves ``reserve`` beyond what lets recovery fall.

    Args:
        last: whether a player without capacity, who has nothing to save for, spends all.
    """
    spends_all = last and left[S_CAPACITY] <= 0
    kept = -me[EXTRA] if spends_all else server[_RECOVER_THR] * server[_MOST] + reserve
    return min(max(0.0, left[S_STAMINA] - kept), server[MAX_DASH])


@kernel
def dash_rate(server: Array, degrees: float) -> float:
    """Return what part of a dash's power its direction leaves; `dynamics.formulas.dash_rate`.

    Args:
        degrees: off the body, -180 to 180.
    """
    quarters, side = abs(degrees) / 90.0, server[_SIDE_RATE]
    to_side, to_back = min(quarters, 1.0), max(quarters - 1.0, 0.0)
    return 1.0 + (side - 1.0) * to_side + (server[_BACK_RATE] - side) * to_back


@kernel
def beside(player: Array, cycle: int, metres: float, degrees: float) -> tuple[float, float]:
    """Return the place so far from where a player drifts to, in a direction on the pitch."""
    x, y = inertia_point(player, cycle)
    angle = math.radians(degrees)
    return x + metres * math.cos(angle), y + metres * math.sin(angle)


@kernel
def dash_metres(scene: Array, waits: int, reserve: float, last: bool, metres: Array) -> int:
    """Fill how far 1, 2, ... dashes straight ahead bring the actor beyond where it drifts to.

    Dashes add to the drift, and their powers depend on stamina alone: all directions share these metres.

    Args:
        waits: cycles before the first dash. reserve, last: see `spare`. metres: (most dashes,).

    Returns:
        How many dashes there are until the first one without power.
    """
    server, me = scene[SERVER], scene[ACTOR]
    left, covered, speed, strong = stamina_of(me), 0.0, 0.0, len(metres)
    for _ in range(waits):
        recover(server, me, left)
    for count in range(len(metres)):
        power = spare(server, me, left, reserve, last)
        if power <= 0:
            strong = min(strong, count)
        speed += min(power * me[DASH_RATE] * left[S_EFFORT], server[_ACCEL_MAX])
        covered += speed
        metres[count] = covered
        speed *= me[DECAY]
        left[S_STAMINA] = max(0.0, left[S_STAMINA] - power)
        recover(server, me, left)
    return strong
