"""Tackles: to which of some directions."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.constants import BALL_DECAY, BALL_SPEED_MAX
from teamclone.planner.passes import BEHIND_M
from teamclone.planner.players import (
    AREA,
    BALL,
    BODY,
    FOUL_EXPONENT,
    GOAL_X,
    GOAL_Y,
    HARDLY,
    ME,
    NEVER,
    OPPONENT,
    TACKLING,
    THERE,
    TOP,
    Array,
    X,
    Y,
    bell,
    beside,
    coasted,
    cycles_over,
    dashes,
    direction,
    kernel,
    rolled,
    tackle_chance,
    turned,
    turns_over,
)
from teamclone.rcss import pitch

DIRECTIONS = 40
"""Evenly around the body; the first one is straight back."""
POWER_MAX, BACK_POWER_MAX, POWER_RATE = 100.0, 0.0, 0.027
"""rcssserver `serverparam.cpp`: max_tackle_power, max_back_tackle_power, tackle_power_rate."""
SOON, BEHIND_CYCLES = 50, 10
"""Cycles in which opponents are asked about, and after which one behind the ball is."""
BACK_M = 5.0
"""Who has no farther to go dashes backward, too."""
NEARER_M, TACKLED_CYCLES = 0.5, 5
"""What is taken off an opponent's way, and what is added to his time while he lies."""
SHOT_M = 20.0
"""How near to the goal a tackle may be a shot."""
GOAL_DEG, LINE_M, LATE_CYCLES = 40.0, 0.7 * pitch.HALF_WIDTH, 30.0
"""Widths of the bells by which it is worse to hit the ball towards the own goal, worse towards the middle, and worse to
where opponents soon are."""


@kernel
def _edge_m(x: float, y: float, cos: float, sin: float) -> float:
    """Metres from a place to the edge of the pitch, in a direction."""
    to_x = (math.copysign(GOAL_X, cos) - x) / cos if cos != 0 else math.inf
    to_y = (math.copysign(pitch.HALF_WIDTH, sin) - y) / sin if sin != 0 else math.inf
    return min(to_x, to_y)


@kernel
def _out(x: float, y: float) -> bool:
    return abs(x) > GOAL_X or abs(y) > pitch.HALF_WIDTH


@kernel
def _needed(player: Array, way_xy: tuple[float, float], cycle: int) -> int:
    """Cycles until an opponent has a ball that is so far away after ``cycle`` of them."""
    metres = math.hypot(way_xy[0], way_xy[1])
    if metres - player[AREA] < HARDLY:
        return 0
    dash_m = metres - player[AREA] - NEARER_M if cycle > 1 else metres
    if dash_m > player[TOP] * cycle:
        return NEVER
    left = abs(turned(direction(way_xy[0], way_xy[1]) - player[BODY]))
    if metres < BACK_M and left > 90.0:
        left = 180.0 - left
    count = turns_over(player, left, metres, player[AREA])
    if count:
        count += 1
    return count + dashes(player, dash_m) + TACKLED_CYCLES * int(player[TACKLING] > 0)


@kernel
def _coasting(scene: Array) -> Array:
    """(opponents, SOON, 2) where they are after so many cycles without a dash."""
    made = np.empty((BALL - OPPONENT, SOON, 2))
    for opponent in range(OPPONENT, BALL):
        for cycle in range(SOON):
            made[opponent - OPPONENT, cycle] = coasted(scene[opponent], cycle)
    return made


@kernel
def _opponents_after(scene: Array, coasting: Array, speed: float, cos: float, sin: float) -> int:
    """Cycles until the first opponent has a ball with this speed, NEVER if none has it before it is out."""
    ball = scene[BALL]
    first = SOON
    end_m = speed / (1.0 - BALL_DECAY)
    if _out(ball[0] + end_m * cos, ball[1] + end_m * sin):
        first = min(SOON, cycles_over(_edge_m(ball[0], ball[1], cos, sin), speed))
    soonest = first
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if player[THERE] == 0:
            continue
        away_x, away_y = player[X] - ball[0], player[Y] - ball[1]
        begin = max(1, int(abs(away_y * cos - away_x * sin) / player[TOP]))
        if away_x * cos + away_y * sin < BEHIND_M:
            begin = BEHIND_CYCLES
        for cycle in range(begin, soonest):
            way_m = rolled(speed, cycle)
            x, y = ball[0] + way_m * cos, ball[1] + way_m * sin
            if _out(x, y):
                break
            from_x, from_y = coasting[opponent - OPPONENT, cycle]
            if _needed(player, (x - from_x, y - from_y), cycle) <= cycle:
                soonest = cycle
                break
    return NEVER if soonest == first else soonest


@kernel
def _value(scene: Array, coasting: Array, vx: float, vy: float) -> float:
    """What it is worth that the ball has this velocity: in the goal most, else away from the own one, to the side, and
    late with an opponent."""
    ball = scene[BALL]
    speed = math.hypot(vx, vy)
    cos, sin = (vx / speed, vy / speed) if speed > 0 else (1.0, 0.0)
    end_x = ball[0] + vx / (1.0 - BALL_DECAY)
    fast = bell(speed, 0.5 * BALL_SPEED_MAX)
    if end_x > GOAL_X and math.hypot(ball[0] - GOAL_X, ball[1]) < SHOT_M:
        y = ball[1] + vy / vx * (GOAL_X - ball[0])
        if abs(y) < GOAL_Y:
            return 1e6 * (1.0 - fast) * bell(y, 2.0 * GOAL_Y)
    if end_x < -GOAL_X:
        y = ball[1] + vy / vx * (-GOAL_X - ball[0])
        if abs(y) < GOAL_Y + 1.0:
            return 1e4 * (fast - bell(abs(y) - GOAL_Y, GOAL_Y))
    cycles = _opponents_after(scene, coasting, speed, cos, sin)
    way_m = min(rolled(speed, cycles), _edge_m(ball[0], ball[1], cos, sin))
    off = turned(direction(-GOAL_X - ball[0], -ball[1]) - direction(vx, vy))
    to_line = max(0.0, pitch.HALF_WIDTH - 0.1 - abs(ball[1] + way_m * sin))
    aside = bell(to_line + 0.1, LINE_M) if to_line > 0 else 1.0
    return 1e4 * (1.0 - bell(off, GOAL_DEG)) * aside * (1.0 - bell(cycles, LATE_CYCLES))


@kernel
def can_tackle(me: Array, ball: Array) -> bool:
    """Whether a tackle or a foul of his may succeed."""
    ahead, aside = beside(me, (me[X], me[Y]), ball[0], ball[1])
    return tackle_chance(ahead, aside, FOUL_EXPONENT) > HARDLY


@kernel
def best_tackle(scene: Array) -> float:
    """Degrees from his body."""
    me, ball = scene[ME], scene[BALL]
    off = abs(turned(direction(ball[0] - me[X], ball[1] - me[Y]) - me[BODY]))
    coasting = _coasting(scene)
    best, chosen = -math.inf, 0.0
    for index in range(DIRECTIONS):
        degrees = 360.0 / DIRECTIONS * index - 180.0
        power = BACK_POWER_MAX + (POWER_MAX - BACK_POWER_MAX) * (1.0 - abs(degrees) / 180.0)
        push = power * POWER_RATE * (1.0 - 0.5 * off / 180.0)
        angle = math.radians(me[BODY] + degrees)
        vx, vy = ball[2] + push * math.cos(angle), ball[3] + push * math.sin(angle)
        over = math.hypot(vx, vy) / BALL_SPEED_MAX
        if over > 1.0:
            vx, vy = vx / over, vy / over
        value = _value(scene, coasting, vx, vy)
        if value > best:
            best, chosen = value, degrees
    return chosen
