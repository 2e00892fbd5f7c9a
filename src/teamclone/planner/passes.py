"""Passes: to where a team mate comes to rest, around it, or far ahead of it; the best that no opponent cuts off."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.ball import NEVER_CYCLES, Path, cycles_over, fastest_from, speed_over
from teamclone.planner.field_evaluator import evaluate
from teamclone.planner.players import (
    BOLD_PASS,
    HARDLY_M,
    LONG_PASS,
    PASS,
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
    kernel,
    turned,
)

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
RINGS, RING_M, AROUND, CLOSE_M = 4, 1.1, 24, 0.6
"""Places around where the receiver comes to rest: rings, their distance, places on each; only every other on a ring
where they would lie closer than CLOSE_M."""
AHEAD_DEG, AHEAD = 40.0, 14
"""Directions of a through pass: to each side of +x, and how many steps between."""
AHEAD_M, AHEAD_STEP_M, AHEAD_COUNT = 6.0, 2.0, 13
FRONT_X = PENALTY_X - 5.0
"""Through passes need not go further up than this."""
OWN_GOAL_M = 18.0, 16.0
"""How near to the own goal no direct and no leading pass goes back."""
SEVERAL_KICKS = 1.5, 2.5
"""Speeds from which on a ball that one kick does not make so fast takes two and three."""
FOLLOWS_DEG, FAR_X, LONG_CYCLES = 15.0, 30.0, 15
"""A receiver that runs so straight to a place beyond this x, so many cycles away, may meet the ball together with an
opponent."""
BOLD_SPEED, LONG_X = 2.0, 25.0
"""Speed forward of a pass behind the opponents' line; the x from which on a pass is a LONG_PASS."""
PLACES = RINGS * AROUND + (AHEAD + 1) * AHEAD_COUNT + 1
"""Passes to one team mate at most."""
VALUE, TO_X, TO_Y, ARRIVES, SPEED, DIRECTION, KICKS, KIND, RECEIVER, COLUMNS = range(10)
"""Columns of a pass, and how many."""


@kernel
def _cycles_of_receiver(scene: Array, mate: int, kind: int, x: float, y: float) -> int:
    """Return the cycles that a team mate takes to a place."""
    player, ball = scene[mate], scene[BALL]
    rest_x, rest_y = at_rest(player)
    metres, toward = gap(x, y, rest_x, rest_y), direction(x - rest_x, y - rest_y)
    count = turns(player, turned(toward - player[BODY]), metres, player[AREA])
    if kind == LEADING:
        straight = direction(x - player[X], y - player[Y])
        backwards = abs(turned(straight)) > 90.0 or abs(turned(straight - player[BODY])) > 30.0
        angle = math.radians(direction(x - ball[X], y - ball[Y]))
        _, aside = along(player[X] - ball[X], player[Y] - ball[Y], math.cos(angle), math.sin(angle))
        count += backwards
        return count + (count > 0) + dashes(player, 1.05 * metres) + int(0.3 * abs(aside))
    count += (count > 0) + dashes(player, metres)
    runs = math.hypot(player[VX], player[VY]) > 0.2
    if runs and abs(turned(direction(player[VX], player[VY]) - toward)) < FOLLOWS_DEG:
        return count
    near_edge = x > GOAL_X - 5.0 or abs(y) > LINE_Y - 5.0
    narrow = near_edge and abs(direction(x - ball[X], y - ball[Y])) > 30.0 and count >= 9
    return count + (2 if narrow else 1)


@kernel
def _in_range(scene: Array, kind: int, metres: float) -> bool:
    """Return whether a pass of a kind goes so far."""
    server = scene[SERVER]
    return LEAST_M[kind] <= metres <= MOST_PART[kind] * server[BALL_SPEED_MAX] / (1.0 - server[BALL_DECAY])


@kernel
def _offer(scene: Array, kind: int, mate: int, place: tuple[float, float], made: Array) -> bool:
    """Fill the pass to a place that takes the fewest cycles, and return whether there is one."""
    player, ball, server, (x, y) = scene[mate], scene[BALL], scene[SERVER], place
    metres, decay, most = gap(x, y, ball[X], ball[Y]), server[BALL_DECAY], server[BALL_SPEED_MAX]
    if not _in_range(scene, kind, metres):
        return False
    first = max(FEWEST[kind], cycles_over(metres, most, decay))
    if kind != DIRECT:
        first = max(first, _cycles_of_receiver(scene, mate, kind, x, y))
    quickest = min(most * decay ** FEWEST[kind], player[AREA] + player[DASH_ACCEL] * CATCH_UP[kind])
    slowest = player[TOP] if kind == DIRECT else HARDLY_M
    for cycles in range(first, min(first + LATER[kind], CYCLES) + 1):
        speed = speed_over(metres, cycles, decay)
        arriving = speed * decay**cycles
        if speed < SLOWEST[kind] or arriving < slowest:
            return False
        if speed > most or arriving > quickest:
            continue
        kicks = 1
        if fastest_from(scene, (x - ball[X]) / metres, (y - ball[Y]) / metres, ball[GAIN]) < speed:
            kicks += (speed > SEVERAL_KICKS[0]) + (speed > SEVERAL_KICKS[1])
        made[VALUE] = evaluate(scene, x, y, False)
        made[TO_X], made[TO_Y], made[ARRIVES], made[SPEED] = x, y, cycles, speed
        made[DIRECTION] = direction(x - ball[X], y - ball[Y])
        made[KICKS], made[KIND], made[RECEIVER] = kicks, kind, mate
        return True
    return False


@kernel
def _nearest_is(scene: Array, mate: int, x: float, y: float) -> bool:
    """Return whether no other team mate that may get a pass is nearer to a place."""
    own = gap(scene[mate, X], scene[mate, Y], x, y)
    for other in range(OPPONENT):
        if scene[other, RECEIVES] > 0 and gap(scene[other, X], scene[other, Y], x, y) < own:
            return False
    return True


@kernel
def _safe(scene: Array, one: Array) -> bool:
    """Return whether the receiver has the ball before any opponent."""
    angle = math.radians(one[DIRECTION])
    path = Path(one[SPEED], math.cos(angle), math.sin(angle))
    through, arrives, to_x = one[KIND] == THROUGH, int(one[ARRIVES]), one[TO_X]
    last = min(arrives + (0 if through else int(one[KICKS]) - 1), CYCLES)
    allowance = PASS if to_x < LONG_X else LONG_PASS
    if through and path.speed * path.cos > BOLD_SPEED and (to_x > scene[BALL, OFFSIDE] or to_x > FAR_X):
        allowance = BOLD_PASS
    receiver = scene[int(one[RECEIVER])]
    straight = direction(to_x - receiver[X], one[TO_Y] - receiver[Y])
    meets = through and to_x > FAR_X and arrives >= LONG_CYCLES
    meets &= abs(turned(receiver[BODY] - straight)) < FOLLOWS_DEG
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        late = meets and player[GOALKEEPER] == 0
        first = first_cycle(scene, player, path, allowance.behind_m)
        if intercept(scene, player, path, (first, last - late), allowance) < NEVER_CYCLES:
            return False
    return True


@kernel
def _offer_around(scene: Array, mate: int, found: Array, count: int) -> int:
    """Add the leading passes to a team mate, and return how many passes there are then."""
    player, ball = scene[mate], scene[BALL]
    rest_x, rest_y = at_rest(player)
    start = direction(player[X] - ball[X], player[Y] - ball[Y])
    for ring in range(1, RINGS + 1):
        radius = RING_M * ring
        stride = 2 if radius * 2.0 * math.pi / AROUND < CLOSE_M else 1
        for place in range(0, AROUND, stride):
            angle = math.radians(start + 360.0 / AROUND * place)
            x, y = rest_x + radius * math.cos(angle), rest_y + radius * math.sin(angle)
            if x > GOAL_X - 3.0 or x < -GOAL_X + 5.0 or abs(y) > LINE_Y - 3.0:
                continue
            if x < ball[X] and gap(x, y, -GOAL_X, 0.0) < OWN_GOAL_M[1]:
                continue
            if not _in_range(scene, LEADING, gap(x, y, ball[X], ball[Y])):
                continue
            if not _nearest_is(scene, mate, x, y):
                break
            count += _offer(scene, LEADING, mate, (x, y), found[count])
    return count


@kernel
def _offer_ahead(scene: Array, mate: int, found: Array, count: int) -> int:
    """Add the through passes to a team mate, and return how many passes there are then."""
    player, ball = scene[mate], scene[BALL]
    rest_x, rest_y = at_rest(player)
    front_x = min(max(10.0, ball[X] + 10.0), ball[OFFSIDE] - 10.0, FRONT_X)
    if player[X] < front_x - AHEAD_M - AHEAD_STEP_M * (AHEAD_COUNT - 1) or player[X] < 1.0:
        return count
    for turn in range(AHEAD + 1):
        angle = math.radians(2.0 * AHEAD_DEG / AHEAD * turn - AHEAD_DEG)
        for place in range(AHEAD_COUNT):
            radius = AHEAD_M + AHEAD_STEP_M * place
            x, y = rest_x + radius * math.cos(angle), rest_y + radius * math.sin(angle)
            if x < front_x:
                continue
            if x > GOAL_X - 1.5 or abs(y) > LINE_Y - 1.5:
                break
            if not _in_range(scene, THROUGH, gap(x, y, ball[X], ball[Y])):
                continue
            if not _nearest_is(scene, mate, x, y):
                break
            count += _offer(scene, THROUGH, mate, (x, y), found[count])
    return count


@kernel
def best_pass(scene: Array) -> Array:
    """Return (COLUMNS,) the safe pass of the greatest value; its KICKS are 0 where there is none."""
    ball = scene[BALL]
    found = np.empty((OPPONENT * PLACES, COLUMNS))
    count = 0
    for mate in range(OPPONENT):
        player = scene[mate]
        if player[RECEIVES] == 0:
            continue
        back = player[X] < ball[X] + 1.0 and gap(player[X], player[Y], -GOAL_X, 0.0) < OWN_GOAL_M[0]
        inside = -GOAL_X + 5.0 <= player[X] <= GOAL_X - 1.5 and abs(player[Y]) <= LINE_Y - 1.5
        if inside and not back:
            count += _offer(scene, DIRECT, mate, at_rest(player), found[count])
        count = _offer_around(scene, mate, found, count)
        count = _offer_ahead(scene, mate, found, count)
    for _ in range(count):
        best = int(np.argmax(found[:count, VALUE]))
        if _safe(scene, found[best]):
            return found[best]
        found[best, VALUE] = -np.inf
    none = np.zeros(COLUMNS)
    none[VALUE] = -np.inf
    return none
