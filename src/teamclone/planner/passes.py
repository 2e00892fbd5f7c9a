"""Passes: to where a team mate comes to rest, around it, or far ahead of him; the best that no opponent cuts off."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.constants import BALL_DECAY, BALL_SPEED_MAX
from teamclone.planner.field_evaluator import worth
from teamclone.planner.players import (
    AREA,
    BALL,
    BODY,
    GAIN,
    GOAL_X,
    HARDLY,
    KEEPER,
    NEVER,
    OFFSIDE,
    OPPONENT,
    PENALTY_X,
    PUSH,
    RECEIVES,
    TACKLING,
    TOP,
    VX,
    VY,
    Array,
    X,
    Y,
    at_rest,
    coasted,
    cycles_over,
    dashes,
    direction,
    fastest,
    gap,
    kernel,
    reach_of,
    rolled,
    speed_over,
    steps,
    turned,
    turns,
)
from teamclone.rcss import pitch

DIRECT, LEAD, THROUGH = range(3)
FARTHEST_M = 40.0
"""From the ball to a team mate who is thought of."""
KEEPER_BACK_X = -21.0
"""A keeper who is further back than this gets no pass."""
FINAL_M = BALL_SPEED_MAX / (1.0 - BALL_DECAY)
"""How far a ball rolls at most."""
LEAST_M, MOST_M = (1.085 * 2.2, 3.0, 5.0), (0.8 * FINAL_M, 0.8 * FINAL_M, 0.9 * FINAL_M)
"""Metres of a pass, by kind."""
FEWEST, LATER = (3, 4, 6), (2, 3, 3)
"""Cycles of a pass at least, and by how many more it may be slower."""
SLOWEST, DASHES = (1.0, 1.0, 1.4), (1.8, 1.5, 1.5)
"""Speed of the ball at least; the dashes that the receiver may reach short when it arrives."""
RINGS, RING_M, AROUND = 4, 1.1, 24
"""Places around where he comes to rest: rings, their distance, and how many places on each; on a ring where they would
lie closer than CLOSE_M only every other."""
CLOSE_M = 0.6
AHEAD_DEG, AHEAD = 40.0, 14
"""Directions of a pass ahead of him: to each side of +x, and how many steps between."""
AHEAD_M, AHEAD_STEP_M, AHEAD_COUNT = 6.0, 2.0, 13
FRONT_X = PENALTY_X - 5.0
"""Passes ahead of him need not go further up than this."""
OWN_GOAL_M = 18.0, 16.0
"""How near to the own goal no direct and no leading pass goes back."""
SEVERAL_KICKS = 1.5, 2.5
"""Speeds from which on a ball that one kick does not make so fast takes two and three."""
FOLLOWS_DEG, FAR_X, LONG_CYCLES = 15.0, 30.0, 15
"""Who runs so straight to a place beyond this x, so many cycles away, may meet the ball together with an opponent."""
BOLD_SPEED = 2.0
"""Forward, of a pass behind their line."""
SAFETY_M = 0.15
REACH_M = 0.5, 0.2
"""By how much further opponents are thought to reach, before 25 m and from there on."""
REACH_X = 25.0
TACKLED_CYCLES = 5
"""How long one who tackles is out of play."""
BEHIND_M = -1.0
"""An opponent further behind the ball is not looked at."""
MOST = RINGS * AROUND + (AHEAD + 1) * AHEAD_COUNT + 1
"""Passes to one team mate."""
VALUE, TO_X, TO_Y, CYCLES, SPEED, DIRECTION, KICKS, KIND, RECEIVER = range(9)
"""Columns of a pass."""


@kernel
def _first_to(scene: Array, one: Array, most: int, bold: bool) -> tuple[int, int]:
    """After how many cycles an opponent has the ball of a pass first, if within ``most``, and which.

    Args:
        bold: a pass behind their line, where opponents are not given more than they reach.
    """
    ball, speed = scene[BALL], one[SPEED]
    cos, sin = math.cos(math.radians(one[DIRECTION])), math.sin(math.radians(one[DIRECTION]))
    best, who = NEVER, -1
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        away_x, away_y = player[X] - ball[0], player[Y] - ball[1]
        if away_x * cos + away_y * sin < BEHIND_M:
            continue
        aside = abs(away_y * cos - away_x * sin)
        for cycle in range(max(1, int(aside / player[TOP])), min(most, best - 1) + 1):
            way_m = rolled(speed, cycle)
            x, y = ball[0] + cos * way_m, ball[1] + sin * way_m
            reach = reach_of(player, x, y)
            from_x, from_y = coasted(player, cycle)
            metres = math.hypot(x - from_x, y - from_y)
            there = metres - reach - SAFETY_M < HARDLY
            if not there:
                left = metres - reach
                if not bold:
                    left -= REACH_M[0] if one[TO_X] < REACH_X else REACH_M[1]
                if left > player[TOP] * cycle:
                    continue
                needed = steps(player, (x - from_x, y - from_y), left, reach)
                there = needed + (TACKLED_CYCLES if player[TACKLING] > 0 else 0) <= cycle
            if there:
                best, who = cycle, opponent
                break
    return best, who


@kernel
def _receivable(scene: Array, mate: int, kind: int, x: float, y: float) -> int:
    """Cycles that a team mate takes to a place, as the passer thinks."""
    player, ball = scene[mate], scene[BALL]
    rest_x, rest_y = at_rest(player)
    angle = direction(x - ball[0], y - ball[1])
    metres = math.hypot(x - rest_x, y - rest_y)
    toward = direction(x - rest_x, y - rest_y)
    count = turns(player, toward, metres, player[AREA])
    if kind == LEAD:
        metres *= 1.05
        straight = direction(x - player[X], y - player[Y])
        if abs(turned(straight)) > 90.0 or abs(turned(straight - player[BODY])) > 30.0:
            count += 1
    needed = dashes(player, metres) + (count + 1 if count else 0)
    if kind == LEAD:
        cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        return needed + int(0.3 * abs((player[Y] - ball[1]) * cos - (player[X] - ball[0]) * sin))
    moving = math.hypot(player[VX], player[VY]) > 0.2
    if moving and abs(turned(direction(player[VX], player[VY]) - toward)) < FOLLOWS_DEG:
        return needed
    near_edge = x > GOAL_X - 5.0 or abs(y) > pitch.HALF_WIDTH - 5.0
    return needed + (2 if near_edge and abs(angle) > 30.0 and needed >= 9 else 1)


@kernel
def _offered(scene: Array, kind: int, mate: int, to_xy: tuple[float, float], one: Array) -> bool:
    """Whether there is a pass to a place; fills it, with the speed that is the first to be thought of."""
    player, ball, (x, y) = scene[mate], scene[BALL], to_xy
    metres = math.hypot(x - ball[0], y - ball[1])
    if metres < LEAST_M[kind] or metres > MOST_M[kind]:
        return False
    angle = direction(x - ball[0], y - ball[1])
    first = max(FEWEST[kind], cycles_over(metres, BALL_SPEED_MAX))
    if kind != DIRECT:
        first = max(first, _receivable(scene, mate, kind, x, y))
    quickest = min(BALL_SPEED_MAX * BALL_DECAY ** FEWEST[kind], player[AREA] + player[PUSH] * DASHES[kind])
    slowest = player[TOP] if kind == DIRECT else HARDLY
    for cycles in range(first, first + LATER[kind] + 1):
        speed = speed_over(metres, cycles)
        arriving = speed * BALL_DECAY**cycles
        if speed < SLOWEST[kind] or arriving < slowest:
            return False
        if speed > BALL_SPEED_MAX or arriving > quickest:
            continue
        kicks = 1
        if fastest((x - ball[0]) / metres, (y - ball[1]) / metres, scene[BALL, GAIN], ball[2], ball[3]) < speed:
            kicks += (speed > SEVERAL_KICKS[0]) + (speed > SEVERAL_KICKS[1])
        one[VALUE] = worth(scene, x, y, False)
        one[TO_X], one[TO_Y], one[CYCLES], one[SPEED], one[DIRECTION] = x, y, cycles, speed, angle
        one[KICKS], one[KIND], one[RECEIVER] = kicks, kind, mate
        return True
    return False


@kernel
def _nearest_is(scene: Array, mate: int, x: float, y: float) -> bool:
    """Whether no other of the team mates is nearer to a place."""
    own = nearest = gap(scene[mate, X], scene[mate, Y], x, y)
    for other in range(OPPONENT):
        if scene[other, RECEIVES] > 0:
            nearest = min(nearest, gap(scene[other, X], scene[other, Y], x, y))
    return nearest >= own


@kernel
def _safe(scene: Array, one: Array) -> bool:
    """Whether the receiver has it before any opponent."""
    kind, to_x, cycles = int(one[KIND]), one[TO_X], int(one[CYCLES])
    bold = False
    if kind == THROUGH:
        forward = one[SPEED] * math.cos(math.radians(one[DIRECTION])) > BOLD_SPEED
        bold = forward and (to_x > scene[BALL, OFFSIDE] or to_x > FAR_X)
    else:
        cycles += int(one[KICKS]) - 1
    when, who = _first_to(scene, one, cycles, bold)
    if when > cycles:
        return True
    together = kind == THROUGH and when == cycles and scene[who, KEEPER] == 0
    if together and to_x > FAR_X and cycles >= LONG_CYCLES:
        receiver = scene[int(one[RECEIVER])]
        straight = direction(to_x - receiver[X], one[TO_Y] - receiver[Y])
        return abs(turned(receiver[BODY] - straight)) < FOLLOWS_DEG
    return False


@kernel
def best_pass(scene: Array) -> Array:
    """The safe pass that is worth most; its KICKS are 0 where there is none."""
    ball = scene[BALL]
    found = np.empty((OPPONENT * MOST, 9))
    count = 0
    front_x = min(max(10.0, ball[0] + 10.0), scene[BALL, OFFSIDE] - 10.0, FRONT_X)
    for mate in range(OPPONENT):
        player = scene[mate]
        if player[RECEIVES] == 0:
            continue
        rest_x, rest_y = at_rest(player)
        near_goal = math.hypot(player[X] + GOAL_X, player[Y]) < OWN_GOAL_M[0]
        inside = -GOAL_X + 5.0 <= player[X] <= GOAL_X - 1.5 and abs(player[Y]) <= pitch.HALF_WIDTH - 1.5
        if inside and not (near_goal and player[X] < ball[0] + 1.0):
            count += _offered(scene, DIRECT, mate, (rest_x, rest_y), found[count])
        start = direction(player[X] - ball[0], player[Y] - ball[1])
        for ring in range(1, RINGS + 1):
            radius = RING_M * ring
            stride = 2 if radius * 2.0 * math.pi / AROUND < CLOSE_M else 1
            for place in range(0, AROUND, stride):
                angle = math.radians(start + 360.0 / AROUND * place)
                x, y = rest_x + radius * math.cos(angle), rest_y + radius * math.sin(angle)
                if x > GOAL_X - 3.0 or x < -GOAL_X + 5.0 or abs(y) > pitch.HALF_WIDTH - 3.0:
                    continue
                if x < ball[0] and math.hypot(x + GOAL_X, y) < OWN_GOAL_M[1]:
                    continue
                if not LEAST_M[LEAD] <= math.hypot(x - ball[0], y - ball[1]) <= MOST_M[LEAD]:
                    continue
                if not _nearest_is(scene, mate, x, y):
                    break
                count += _offered(scene, LEAD, mate, (x, y), found[count])
        if player[X] < front_x - AHEAD_M - AHEAD_STEP_M * (AHEAD_COUNT - 1) or player[X] < 1.0:
            continue
        for turn in range(AHEAD + 1):
            angle = math.radians(2.0 * AHEAD_DEG / AHEAD * turn - AHEAD_DEG)
            for place in range(AHEAD_COUNT):
                radius = AHEAD_M + AHEAD_STEP_M * place
                x, y = rest_x + radius * math.cos(angle), rest_y + radius * math.sin(angle)
                if x < front_x:
                    continue
                if x > GOAL_X - 1.5 or abs(y) > pitch.HALF_WIDTH - 1.5:
                    break
                if not LEAST_M[THROUGH] <= math.hypot(x - ball[0], y - ball[1]) <= MOST_M[THROUGH]:
                    continue
                if not _nearest_is(scene, mate, x, y):
                    break
                count += _offered(scene, THROUGH, mate, (x, y), found[count])
    for _ in range(count):
        best = int(np.argmax(found[:count, VALUE]))
        if _safe(scene, found[best]):
            return found[best]
        found[best, VALUE] = -np.inf
    none = np.zeros(9)
    none[VALUE] = -np.inf
    return none
