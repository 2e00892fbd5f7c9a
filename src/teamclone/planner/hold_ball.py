"""Keeping the ball: a turn while it stays, or a kick to where opponents get it least."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.constants import BALL_DECAY, BALL_SIZE, BALL_SPEED_MAX
from teamclone.planner.players import (
    AREA,
    BALL,
    BALL_RAND,
    BODY,
    FOUL_EXPONENT,
    GAIN,
    GOAL_X,
    KICK_RAND,
    MARGIN,
    ME,
    OPPONENT,
    PLAYER_RAND,
    PUSH,
    SIZE,
    TACKLE_M,
    TACKLE_WIDTH_M,
    TACKLING,
    VX,
    VY,
    Array,
    X,
    Y,
    at_rest,
    beside,
    direction,
    in_their_box,
    kernel,
    kick_rate,
    reach_of,
    tackle_chance,
    turned,
)
from teamclone.rcss import pitch

SAFE = 100.0
"""Score of a place that no opponent is near to."""
ALMOST = 1e-5
NEAR_M = 4.05
"""Opponents further from the ball are not looked at."""
DASHES = 24
"""Directions in which an opponent may dash."""
RINGS, AROUND, AROUND_DEG = (0.4, 0.6, 0.75), 20, 18.0
"""Places where to keep it: parts of the margin, how many around him, on the axes of the pitch."""
FRONT_M = 0.05
INSIDE_M = 0.2
FACE_X, FACED_DEG = GOAL_X - 5.0, 5.0
"""Towards where he turns, and how well he has to face it."""
LONG, LONG_SLACK_M = 1.6, 0.4
"""Balls over so many times what he reaches are not sure to stay within."""
RATE_WORTH = 1000.0
STOP_M, STOP_PART = 0.1, 0.4
"""How far within his reach and off his edge a ball stops; what part of the margin one is to be off that is too fast."""


@kernel
def dash_share(degrees: float) -> float:
    """What part of a dash's power a direction leaves (rcssserver `player.cpp`, dash)."""
    off = abs(degrees)
    return 0.4 + 0.6 * (1.0 - off / 90.0) if off <= 90.0 else 0.4 + 0.3 * (off - 90.0) / 90.0


@kernel
def score(scene: Array, x: float, y: float) -> float:
    """How safe the ball is in a place in the next cycle; SAFE where no opponent comes near."""
    me, ball = scene[ME], scene[BALL]
    total = SAFE
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if math.hypot(player[X] - ball[0], player[Y] - ball[1]) > NEAR_M or player[TACKLING] > 0:
            continue
        at_x, at_y = player[X] + player[VX], player[Y] + player[VY]
        reach = reach_of(player, x, y) if in_their_box(at_x, at_y) else player[AREA]
        away = math.hypot(x - at_x, y - at_y)
        if away < 0.5 * reach:
            total -= 200.0
        elif away < reach + 0.1:
            total -= 150.0
        elif away < TACKLE_M - 0.2:
            total -= 25.0
        ahead, aside = beside(player, (at_x, at_y), x, y)
        total -= 50.0 * max(0.0, reach - abs(aside))
        total -= 50.0 * max(0.0, tackle_chance(ahead, aside, FOUL_EXPONENT))
        for dash in range(DASHES):
            degrees = 360.0 / DASHES * dash - 180.0
            push = player[PUSH] * dash_share(degrees)
            left_x = ahead - push * math.cos(math.radians(degrees))
            left_y = aside - push * math.sin(math.radians(degrees))
            if math.hypot(left_x, left_y) < reach + 0.1:
                total -= 20.0
            elif abs(left_y) < TACKLE_WIDTH_M + 0.1 and 0.0 < left_x < TACKLE_M + 0.1:
                total -= 10.0
    if math.hypot(x - ball[0], y - ball[1]) > LONG * me[AREA]:
        over = math.hypot(x - me[X] - me[VX], y - me[Y] - me[VY]) - me[AREA] + LONG_SLACK_M
        total *= 1.0 - 0.5 * max(0.0, over / LONG_SLACK_M)
    return total


@kernel
def inside(x: float, y: float) -> bool:
    return abs(x) <= GOAL_X - INSIDE_M and abs(y) <= pitch.HALF_WIDTH - INSIDE_M


@kernel
def stays(scene: Array, slack_m: float) -> bool:
    """Whether he can kick the ball in the next cycle, too, if he leaves it as it is."""
    me, ball = scene[ME], scene[BALL]
    away = math.hypot(me[X] + me[VX] - ball[0] - ball[2], me[Y] + me[VY] - ball[1] - ball[3])
    doubt = math.hypot(me[VX], me[VY]) * PLAYER_RAND + math.hypot(ball[2], ball[3]) * BALL_RAND
    return away <= me[AREA] - doubt - slack_m


@kernel
def blur(scene: Array) -> float:
    """By how much a kick at full power misses, as parts of the player's `kick_rand`."""
    me, ball = scene[ME], scene[BALL]
    away = math.hypot(ball[0] - me[X], ball[1] - me[Y])
    aside = abs(turned(direction(ball[0] - me[X], ball[1] - me[Y]) - me[BODY])) / 180.0
    speed = math.hypot(ball[2], ball[3]) / (BALL_SPEED_MAX * BALL_DECAY)
    return 1.0 + 0.25 * (aside + (away - me[SIZE]) / me[MARGIN]) + 0.5 * speed


@kernel
def stop(scene: Array) -> tuple[float, float]:
    """Velocity of a ball that is brought to rest beside him, or as near to it as one kick does."""
    me, ball = scene[ME], scene[BALL]
    x, y = ball[0] - me[X], ball[1] - me[Y]
    away = max(math.hypot(x, y), 1e-9)
    kept = min(max(away, me[SIZE] + STOP_M), me[AREA] - STOP_M) / away
    vx, vy = me[VX] + x * (kept - 1.0), me[VY] + y * (kept - 1.0)
    most = 100.0 * ball[GAIN]
    if math.hypot(vx - ball[2], vy - ball[3]) < most:
        return vx, vy
    back_x, back_y = me[VX] - x - ball[2], me[VY] - y - ball[3]
    off = max(math.hypot(back_x, back_y), 1e-9)
    wanted = off - (me[SIZE] - BALL_SIZE + STOP_PART * me[MARGIN])
    push = min(max(wanted, -most), most) / off
    return ball[2] + push * back_x, ball[3] + push * back_y


@kernel
def hold(scene: Array) -> tuple[bool, float, float]:
    """Whether he turns, and else the velocity that the ball is to have."""
    me, ball, gain = scene[ME], scene[BALL], scene[BALL, GAIN]
    next_x, next_y = me[X] + me[VX], me[Y] + me[VY]
    if inside(ball[0] + ball[2], ball[1] + ball[3]) and stays(scene, 0.15):
        rest_x, rest_y = at_rest(me)
        facing = abs(turned(me[BODY] - direction(FACE_X - rest_x, -rest_y))) < FACED_DEG
        if not facing and score(scene, ball[0] + ball[2], ball[1] + ball[3]) >= SAFE - ALMOST:
            return True, 0.0, 0.0
    body = math.radians(me[BODY])
    x, y = next_x + (me[SIZE] + FRONT_M) * math.cos(body), next_y + (me[SIZE] + FRONT_M) * math.sin(body)
    near = inside(x, y) and math.hypot(x - ball[0] - ball[2], y - ball[1] - ball[3]) <= 100.0 * gain
    if near and score(scene, x, y) >= SAFE - ALMOST:
        return False, x - ball[0], y - ball[1]
    doubt, most = math.hypot(me[VX], me[VY]) * PLAYER_RAND, me[KICK_RAND] * blur(scene)
    best, best_x, best_y = -np.inf, 0.0, 0.0
    for place in range(AROUND):
        degrees = AROUND_DEG * place - 180.0
        for ring in range(len(RINGS)):
            radius = me[SIZE] + me[MARGIN] * RINGS[ring]
            x = next_x + radius * math.cos(math.radians(degrees))
            y = next_y + radius * math.sin(math.radians(degrees))
            if not inside(x, y):
                continue
            power = math.hypot(x - ball[0] - ball[2], y - ball[1] - ball[3]) / gain
            if power >= 100.0:
                continue
            metres = math.hypot(x - ball[0], y - ball[1])
            if ring and 0.95 * (doubt + metres * BALL_RAND + most * power / 100.0) >= me[AREA] - radius - 0.1:
                continue
            rate = kick_rate(me, radius, degrees - me[BODY])
            if metres * BALL_DECAY >= 100.0 * rate:
                continue
            value = score(scene, x, y) + RATE_WORTH * rate
            if value > best:
                best, best_x, best_y = value, x - ball[0], y - ball[1]
    if best == -np.inf:
        best_x, best_y = stop(scene)
    return False, best_x, best_y
