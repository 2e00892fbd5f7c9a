"""Passes: to where a team mate comes to rest, around it, or far ahead of it; the best that no opponent cuts off."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from teamclone.planner.ball import NEVER_CYCLES, cycles_over, fastest_from, path_along, speed_over
from teamclone.planner.candidates import VALUE, Mask, by_value, cut, nothing
from teamclone.planner.field_evaluator import evaluate
from teamclone.planner.players import (
    BOLD_PASS,
    HARDLY_M,
    LONG_PASS,
    PASS,
    Allowance,
    dashes,
    first_cycle,
    intercept,
    turns,
)
from teamclone.planner.scene import (
    AREA,
    BALL,
    BALL_DECAY,
    BALL_SPEED_MAX,
    BODY,
    CYCLES,
    DASH_ACCEL,
    GAIN,
    GOAL_X,
    GOALKEEPER,
    LINE_Y,
    OFFSIDE,
    OPPONENT,
    PENALTY_X,
    RECEIVES,
    SERVER,
    TOP,
    VX,
    VY,
    Array,
    X,
    Y,
    along,
    at_rest,
    direction,
    gap,
    turned,
)
from teamclone.system.compiling import kernel

DIRECT, LEADING, THROUGH = range(3)
"""Kinds of a pass."""
FARTHEST_M = 40.0
"""From the ball to a team mate that may get a pass."""
GOALKEEPER_BACK_X = -21.0
"""A goalkeeper further back than this gets no pass."""
LEAST_M, MOST_PART = (2.387, 3.0, 5.0), (0.8, 0.8, 0.9)
"""Metres of a pass at least, by kind, and at most: parts of how far the fastest ball rolls."""
FEWEST, LATER = (3, 4, 6), (2, 3, 3)
"""Cycles of a pass at least, and by how many more it may be slower."""
SLOWEST, CATCH_UP = (1.0, 1.0, 1.4), (1.8, 1.5, 1.5)
"""Speed of the ball at least; the dashes by which it may be ahead of the receiver in the cycle in which it arrives."""
INSIDE_M, BACK_INSIDE_M = (1.5, 3.0, 1.5), 5.0
"""How far a place is from the opponents' goal line and the side lines, by kind, and from the own goal line."""
OWN_GOAL_M, BACK_M = (18.0, 16.0), (1.0, 0.0)
"""No direct and no leading pass goes so near to the own goal, unless it goes further forward than so many metres."""
RING_M, AROUND_DEG = 1.1, (30.0, 30.0, 15.0, 15.0)
"""Places around where the receiver comes to rest: the distance of rings, and the degrees between places on each."""
AHEAD_DEG, AHEAD, AHEAD_M = 40.0, 14, np.arange(6.0, 31.0, 2.0)
"""Places ahead of it: the directions to each side of +x, how many steps between, and the distances."""
FROM_X, UP_M, BEFORE_LINE_M, FRONT_X = 1.0, 10.0, 10.0, PENALTY_X - 5.0
"""Receivers behind this x get no through pass. It goes so far beyond the ball, and the middle line, if that is not
further up than so far before the offside line, or FRONT_X."""
SEVERAL_KICKS = 1.5, 2.5
"""Speeds from which on a ball that one kick does not make so fast takes two and three."""
STRETCHED, LINE_CYCLES = 1.05, 0.3
"""For a leading pass the way is as many times as long, and a metre between the receiver and the path costs cycles."""
LOOKS_X_DEG, LOOKS_DEG = 90.0, 30.0
"""A leading pass that is further round from +x, or from the receiver's body, costs one more turn."""
RUNS, FOLLOWS_DEG = 0.2, 15.0
"""Speed of a receiver that runs, and the degrees within which this is straight to a place."""
NEAR_EDGE_M, STEEP_DEG, LONG_RUN = 5.0, 30.0, 9
"""A steep through pass to near a line is hard to meet after so many cycles."""
FAR_X, LONG_CYCLES = 30.0, 15
"""A receiver that faces a place beyond this x, so many cycles away, may meet the ball together with an opponent."""
BOLD_SPEED, LONG_X = 2.0, 25.0
"""Speed forward of a pass behind the opponents' line; the x from which on a pass is a LONG_PASS."""
TO_X, TO_Y, ARRIVES, SPEED, DIRECTION, KICKS, KIND, RECEIVER, COLUMNS = range(1, 10)
"""Columns of a pass, after VALUE, and how many."""


def offsets(rows: Sequence[tuple[ArrayLike, ArrayLike]]) -> tuple[Array, NDArray[np.int64]]:
    """Return (2, n) metres x and y of places in rows, and (len(rows) + 1,) where each row begins, and the last ends.

    Args:
        rows: metres and degrees of the places of each row, either one number for all.
    """
    polar = [np.broadcast_arrays(metres, np.radians(degrees)) for metres, degrees in rows]
    placed = [metres * np.stack([np.cos(angles), np.sin(angles)]) for metres, angles in polar]
    return np.concatenate(placed, axis=1), np.cumsum([0, *(row.shape[1] for row in placed)])


HERE = np.zeros((2, 1)), np.array([0, 1])
AROUND = offsets([(RING_M * ring, np.arange(0.0, 360.0, step)) for ring, step in enumerate(AROUND_DEG, 1)])
FAN = offsets([(AHEAD_M, 2.0 * AHEAD_DEG / AHEAD * turn - AHEAD_DEG) for turn in range(AHEAD + 1)])
"""Places of each kind of pass, by rows: rings, and rays."""


@kernel
def nearest(scene: Array, mate: int, x: Array, y: Array) -> Mask:
    """Return (n,) whether no other team mate that may get a pass is nearer to each of (n,) places."""
    me, near = scene[mate], np.ones(len(x), np.bool_)
    for other in scene[:OPPONENT]:
        if other[RECEIVES] > 0:  # nearer to me is a half-plane, whose border is as far from both
            over_x, over_y = other[X] - me[X], other[Y] - me[Y]
            border = 0.5 * (over_x * (other[X] + me[X]) + over_y * (other[Y] + me[Y]))
            near &= over_x * x + over_y * y <= border
    return near


@kernel
def _inside(kind: int, x: Array, y: Array) -> Mask:
    """Return (n,) whether places are far enough within the lines."""
    within_x = (x >= BACK_INSIDE_M - GOAL_X) & (x <= GOAL_X - INSIDE_M[kind])
    return within_x & (np.abs(y) <= LINE_Y - INSIDE_M[kind])


@kernel
def _not_back(scene: Array, kind: int, x: Array, y: Array) -> Mask:
    """Return (n,) whether places are before the ball, or away from the own goal."""
    return (x >= scene[BALL, X] + BACK_M[kind]) | (np.hypot(x + GOAL_X, y) >= OWN_GOAL_M[kind])


@kernel
def _in_range(scene: Array, kind: int, x: Array, y: Array) -> Mask:
    """Return (n,) whether passes of a kind go so far."""
    ball, server = scene[BALL], scene[SERVER]
    metres = np.hypot(x - ball[X], y - ball[Y])
    most = MOST_PART[kind] * server[BALL_SPEED_MAX] / (1.0 - server[BALL_DECAY])
    return (metres >= LEAST_M[kind]) & (metres <= most)


@kernel
def _front(ball: Array) -> float:
    """Return the x behind which no through pass goes."""
    return min(max(UP_M, ball[X] + UP_M), ball[OFFSIDE] - BEFORE_LINE_M, FRONT_X)


@kernel
def _add(scene: Array, kind: int, mate: int, made: Array) -> int:
    """Fill VALUE, TO_X, TO_Y, KIND and RECEIVER of the passes of a kind to a team mate; return how many there are.

    Args:
        made: (n, COLUMNS) at least as long as there are places.
    """
    player, ball = scene[mate], scene[BALL]
    (rest_x, rest_y), degrees = at_rest(player), 0.0
    places, begins = HERE
    if kind == LEADING:
        places, begins = AROUND
        degrees = direction(player[X] - ball[X], player[Y] - ball[Y])
    elif kind == THROUGH:
        places, begins = FAN
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x, y = rest_x + cos * places[0] - sin * places[1], rest_y + sin * places[0] + cos * places[1]
    allowed = _in_range(scene, kind, x, y)
    if kind == DIRECT:  # seen from where the receiver is now
        now_x, now_y = player[X : X + 1], player[Y : Y + 1]
        allowed &= _inside(kind, now_x, now_y) & _not_back(scene, kind, now_x, now_y)
    elif kind == LEADING:
        allowed &= _inside(kind, x, y) & _not_back(scene, kind, x, y)
        cut(allowed, allowed & ~nearest(scene, mate, x, y), begins)
    else:
        up, inside = x >= _front(ball), _inside(kind, x, y)
        allowed &= up & inside
        cut(allowed, up & ~inside | allowed & ~nearest(scene, mate, x, y), begins)
    chosen = np.flatnonzero(allowed)
    for count, place in enumerate(chosen):
        made[count, VALUE] = evaluate(scene, x[place], y[place], False)
        made[count, TO_X], made[count, TO_Y] = x[place], y[place]
        made[count, KIND], made[count, RECEIVER] = kind, mate
    return len(chosen)


@kernel
def _passes(scene: Array) -> Array:
    """Return (n, COLUMNS) the passes to all allowed places, not yet `_timed`."""
    made, count = np.empty((OPPONENT * (1 + AROUND[0].shape[1] + FAN[0].shape[1]), COLUMNS)), 0
    reaches_front = max(FROM_X, _front(scene[BALL]) - AHEAD_M[-1])
    for mate in np.flatnonzero(scene[:OPPONENT, RECEIVES]):
        for kind in range(THROUGH + (scene[mate, X] >= reaches_front)):
            count += _add(scene, kind, mate, made[count:])
    return made[:count]


@kernel
def _run(player: Array, place: tuple[float, float], more_turns: int, stretched: float) -> int:
    """Return the cycles of turns, of seeing the ball after them, and of dashes that bring a player to a place."""
    rest_x, rest_y = at_rest(player)
    way_x, way_y = place[0] - rest_x, place[1] - rest_y
    metres, off = math.hypot(way_x, way_y), turned(direction(way_x, way_y) - player[BODY])
    turning = turns(player, off, metres, player[AREA]) + more_turns
    return turning + min(turning, 1) + dashes(player, stretched * metres)


@kernel
def _cycles_of_leading(scene: Array, player: Array, place: tuple[float, float], cos: float, sin: float) -> int:
    """Return the cycles that the receiver of a leading pass needs, by where it goes and its direction."""
    ball, way = scene[BALL], direction(place[0] - player[X], place[1] - player[Y])
    looks = abs(turned(way)) <= LOOKS_X_DEG and abs(turned(way - player[BODY])) <= LOOKS_DEG
    _, aside = along(player[X] - ball[X], player[Y] - ball[Y], cos, sin)
    return _run(player, place, 0 if looks else 1, STRETCHED) + int(LINE_CYCLES * abs(aside))


@kernel
def _cycles_of_through(player: Array, place: tuple[float, float], degrees: float) -> int:
    """Return the cycles that the receiver of a through pass needs, by where it goes and its direction."""
    (x, y), (rest_x, rest_y) = place, at_rest(player)
    run, vx, vy = _run(player, place, 0, 1.0), player[VX], player[VY]
    off = turned(direction(vx, vy) - direction(x - rest_x, y - rest_y))
    aside = math.hypot(vx, vy) <= RUNS or abs(off) >= FOLLOWS_DEG
    near_edge = max(x - GOAL_X, abs(y) - LINE_Y) > -NEAR_EDGE_M
    return run + aside + (aside and near_edge and abs(degrees) > STEEP_DEG and run >= LONG_RUN)


@kernel
def cycles_to_slow(metres: float, speed: float, decay: float) -> int:
    """Return the fewest cycles over which a ball that rolls so far is at last at most so fast."""
    return math.ceil(math.log(speed / (speed + metres * (1.0 - decay))) / math.log(decay))


@kernel
def _timed(scene: Array, one: Array) -> bool:
    """Fill ARRIVES, SPEED, DIRECTION and KICKS of a pass, and return whether ball and receiver can be there together.

    The pass takes the fewest cycles in which the ball gets there, slow enough for the receiver, which is there, too.
    """
    kind, player, ball, server = int(one[KIND]), scene[int(one[RECEIVER])], scene[BALL], scene[SERVER]
    x, y, decay = one[TO_X], one[TO_Y], server[BALL_DECAY]
    metres = gap(x, y, ball[X], ball[Y])
    cos, sin, degrees = (x - ball[X]) / metres, (y - ball[Y]) / metres, direction(x - ball[X], y - ball[Y])
    first = max(FEWEST[kind], cycles_over(metres, server[BALL_SPEED_MAX], decay))
    if kind == LEADING:
        first = max(first, _cycles_of_leading(scene, player, (x, y), cos, sin))
    elif kind == THROUGH:
        first = max(first, _cycles_of_through(player, (x, y), degrees))
    cycles = max(first, cycles_to_slow(metres, player[AREA] + player[DASH_ACCEL] * CATCH_UP[kind], decay))
    speed = speed_over(metres, cycles, decay)
    one[ARRIVES], one[SPEED], one[DIRECTION] = cycles, speed, degrees
    in_one = speed <= fastest_from(scene, cos, sin, ball[GAIN])
    one[KICKS] = 1 if in_one else 1 + np.searchsorted(np.array(SEVERAL_KICKS), speed)
    in_time = cycles <= min(first + LATER[kind], CYCLES)
    return in_time and speed >= SLOWEST[kind] and speed * decay**cycles >= (player[TOP] if kind == DIRECT else HARDLY_M)


@kernel
def _allowance(scene: Array, one: Array) -> Allowance:
    """Return what is allowed for opponents that may cut off a pass."""
    forward = one[SPEED] * math.cos(math.radians(one[DIRECTION]))
    if one[KIND] == THROUGH and forward > BOLD_SPEED and one[TO_X] > min(scene[BALL, OFFSIDE], FAR_X):
        return BOLD_PASS
    return PASS if one[TO_X] < LONG_X else LONG_PASS


@kernel
def _safe(scene: Array, one: Array) -> bool:
    """Return whether the receiver has the ball before any opponent."""
    path, allowance, last = path_along(one[SPEED], one[DIRECTION]), _allowance(scene, one), int(one[ARRIVES])
    field_last = last
    if one[KIND] == THROUGH:
        receiver = scene[int(one[RECEIVER])]
        off = turned(receiver[BODY] - direction(one[TO_X] - receiver[X], one[TO_Y] - receiver[Y]))
        field_last -= one[TO_X] > FAR_X and last >= LONG_CYCLES and abs(off) < FOLLOWS_DEG
    else:  # opponents move while the ball is still prepared
        last = field_last = min(last + int(one[KICKS]) - 1, CYCLES)
    for player in scene[OPPONENT:BALL]:
        cycles = first_cycle(scene, player, path, allowance.behind_m), last if player[GOALKEEPER] > 0 else field_last
        if intercept(scene, player, path, cycles, allowance) < NEVER_CYCLES:
            return False
    return True


@kernel
def _free(scene: Array, one: Array) -> bool:
    """Fill the columns of `_timed`, and return whether the pass can be played and no opponent has it first."""
    return _timed(scene, one) and _safe(scene, one)


@kernel
def best_pass(scene: Array) -> Array:
    """Return (COLUMNS,) the safe pass of the greatest value; its KICKS are 0 where there is none."""
    made = _passes(scene)
    for index in by_value(made):
        if _free(scene, made[index]):
            return made[index]
    return nothing(COLUMNS)
