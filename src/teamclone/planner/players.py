"""The player model: whether a player can be somewhere in time, and what it reaches in its next cycle."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.planner.ball import NEVER_CYCLES, Path, ball_after
from teamclone.planner.scene import (
    AREA,
    AWAY,
    BALL,
    BODY,
    CATCH,
    CYCLES,
    DECAY,
    GOALKEEPER,
    LAG,
    PAUSE,
    ROLL,
    TACKLE_DIST,
    TACKLE_WIDTH,
    TOP,
    TURN,
    TURNS,
    Array,
    X,
    Y,
    along,
    direction,
    in_their_area,
    inertia_point,
    turned,
)
from teamclone.system.compiling import kernel

HARDLY_M = 0.001
"""Metres that count as nothing."""
FACED_DEG = 15.0
"""A player dashes without a turn to what is at most so far off its body."""


class Allowance(NamedTuple):
    """What is allowed for an opponent that may be at the ball first, by how the ball is played.

    Attributes:
        touch_m: metres beyond its reach within which an opponent that only drifts has the ball.
        reach: part of its reach that shortens its dashes; reach_from: the first cycle in which it does.
        ahead_m: metres that shorten them, too; unsure: more of them per metre between the opponent and the actor.
        turn_m: metres by which the reach is wider where it decides on a turn.
        back_m: metres within which it dashes backwards instead of turning.
        behind_m: how far it may be behind the ball and still come, seen along the path of the ball.
        early: cycles that it is thought to be earlier; early_x, earlier_x: one more before each of these x.
        bound: 1 where it must not be so early that it would run faster than it can, else 0.
    """

    touch_m: float = 0.0
    reach: float = 1.0
    reach_from: float = 1.0
    ahead_m: float = 0.0
    unsure: float = 0.0
    turn_m: float = 0.0
    back_m: float = 0.0
    behind_m: float = -1.0
    early: float = 0.0
    early_x: float = -math.inf
    earlier_x: float = -math.inf
    bound: float = 0.0


PASS = Allowance(touch_m=0.15, ahead_m=0.5)
LONG_PASS = Allowance(touch_m=0.15, ahead_m=0.2)
BOLD_PASS = Allowance(touch_m=0.15)
DRIBBLE = Allowance(reach=0.5, ahead_m=0.2, behind_m=-4.0, early_x=30.0, earlier_x=0.0)
SELF_PASS = Allowance(ahead_m=0.2, unsure=0.01, behind_m=-4.0, bound=1.0)
SELF_PASS_AHEAD = Allowance(ahead_m=0.2, unsure=0.01, behind_m=-4.0, early=1.0, early_x=27.0, bound=1.0)
SHOT = Allowance(reach=0.8, reach_from=2.0, early=-1.0)
SHOT_GOALKEEPER = Allowance(touch_m=0.15, reach=0.9, reach_from=2.0, unsure=0.02, turn_m=0.1)
TACKLE = Allowance(reach_from=2.0, ahead_m=0.5, back_m=5.0)


@kernel
def reach_of(player: Array, x: float, y: float) -> float:
    """Return how far from its centre a player has a ball in a place: a goalkeeper catches it in its penalty area."""
    return player[CATCH] if player[GOALKEEPER] > 0 and in_their_area(x, y) else player[AREA]


@kernel
def turns(player: Array, off: float, metres: float, within_m: float) -> int:
    """Return the turns until a player faces what is ``off`` degrees aside and so far away, to ``within_m`` of it.

    At most TURNS.
    """
    if metres <= within_m:
        return 0
    over = abs(off) - max(FACED_DEG, math.degrees(math.asin(within_m / metres)))
    return int(np.searchsorted(player[TURN : TURN + TURNS], over))


@kernel
def covered(player: Array, count: int) -> float:
    """Return the metres from rest in so many dashes at full power; `dynamics.formulas.covered`.

    A player at its top speed covers TOP in each. From rest it loses what a body rolls whose speed is TOP * DECAY. Minus
    infinity for less than no dash.
    """
    if count < 0:
        return -math.inf
    return player[TOP] * (count - player[DECAY] * player[ROLL + min(count, CYCLES)])


@kernel
def dashes(player: Array, metres: float) -> int:
    """Return the dashes at full power from rest that cover so much, the inverse of `covered`.

    A player at its top speed needs s = metres / TOP cycles. From rest n = s + LAG * (1 - DECAY ** n), to which Newton's
    steps lead from above.
    """
    if metres <= HARDLY_M:
        return 0
    at_speed = (metres - HARDLY_M) / player[TOP]
    lag, decay = player[LAG], player[DECAY]
    most = count = at_speed + lag
    if at_speed < 8.0:
        rate = math.log(decay)
        for _ in range(3):
            left = lag * decay**count
            count -= (count - most + left) / (1.0 + rate * left)
    return math.ceil(min(count, NEVER_CYCLES))


@kernel
def short_m(player: Array, place: tuple[float, float], cycle: int, allowance: Allowance, later: int) -> float:
    """Return the metres by which a player misses a ball that is in a place after ``cycle`` cycles; 0 or less: has it.

    The player has the ball within the larger of two radii around where it drifts to: `stand`, in which it need not
    dash, and `run`, up to which its dashes carry the reach in the cycles that turns and a tackle under way leave.

    Args:
        later: cycles by which the player may be late and still has it.
    """
    drift_x, drift_y = inertia_point(player, cycle)
    x, y = place[0] - drift_x, place[1] - drift_y
    metres, reach = math.hypot(x, y), reach_of(player, place[0], place[1])
    off = abs(turned(direction(x, y) - player[BODY]))
    backwards = metres < allowance.back_m and off > 90.0
    turning = turns(player, 180.0 - off if backwards else off, metres, reach + allowance.turn_m)
    turning += min(turning, 1)  # after turns it sees the ball a cycle late
    early = allowance.early + (place[0] < allowance.early_x) + (place[0] < allowance.earlier_x)
    count = cycle + later + int(early - player[PAUSE]) - turning
    stretched = allowance.reach * reach + allowance.ahead_m if cycle >= allowance.reach_from else 0.0
    stand = reach + allowance.touch_m
    run = stretched + allowance.unsure * player[AWAY] + covered(player, count)
    if allowance.bound * (metres - reach) > player[TOP] * cycle:
        run = -math.inf
    return metres - max(stand, run) - HARDLY_M


@kernel
def first_cycle(scene: Array, player: Array, path: Path, behind_m: float) -> int:
    """Return the first cycle in which a player may be on the path of the ball; NEVER_CYCLES for one behind it."""
    ahead, aside = along(player[X] - scene[BALL, X], player[Y] - scene[BALL, Y], path.cos, path.sin)
    return NEVER_CYCLES if ahead < behind_m else max(1, int(abs(aside) / player[TOP]))


@kernel
def first_cycles(scene: Array, rows: NDArray[np.int64], path: Path, behind_m: float) -> NDArray[np.int64]:
    """Return (len(rows),) `first_cycle` of the players in these rows of the scene."""
    first = np.empty(len(rows), np.int64)
    for place, row in enumerate(rows):
        first[place] = first_cycle(scene, scene[row], path, behind_m)
    return first


@kernel
def intercept(scene: Array, player: Array, path: Path, cycles: tuple[int, int], allowance: Allowance) -> int:
    """Return the cycle in which a player first has a ball on its path, from the first to the last of ``cycles``.

    NEVER_CYCLES if in none of them.
    """
    for cycle in range(cycles[0], cycles[1] + 1):
        if short_m(player, ball_after(scene, path, cycle), cycle, allowance, 0) <= 0:
            return cycle
    return NEVER_CYCLES


class Pose(NamedTuple):
    """Where a player stands, metres on the pitch, and the cosine and sine of its body."""

    x: float
    y: float
    cos: float
    sin: float


@kernel
def pose_after(player: Array, cycle: int) -> Pose:
    """Return the pose of a player after so many cycles in which it does nothing."""
    x, y = inertia_point(player, cycle)
    body = math.radians(player[BODY])
    return Pose(x, y, math.cos(body), math.sin(body))


class Bearing(NamedTuple):
    """How a ball lies to a player: metres ahead of it and aside, between their centres, and to which it has a ball."""

    ahead: float
    aside: float
    metres: float
    reach: float


@kernel
def bearing(player: Array, pose: Pose, x: float, y: float) -> Bearing:
    """Return how a ball in a place lies to a player in a pose."""
    way_x, way_y = x - pose.x, y - pose.y
    ahead, aside = along(way_x, way_y, pose.cos, pose.sin)
    return Bearing(ahead, aside, math.hypot(way_x, way_y), reach_of(player, x, y))


@kernel
def tackle_chance(server: Array, ahead: float, aside: float, exponent: float) -> float:
    """Return the probability of a tackle, at most 0 where it cannot succeed; 1 - `dynamics.formulas.tackle_failure`."""
    if ahead <= 0:
        return 0.0
    return 1.0 - ((ahead / server[TACKLE_DIST]) ** exponent + (abs(aside) / server[TACKLE_WIDTH]) ** exponent)
