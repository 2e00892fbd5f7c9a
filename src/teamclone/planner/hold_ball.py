"""Keeping the ball: a turn while it stays in reach, or a kick to where opponents get it least."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from teamclone.planner.ball import kick_rate
from teamclone.planner.players import reach_of, seen_from, tackle_chance
from teamclone.planner.scene import (
    ACTOR,
    AREA,
    BALL,
    BALL_DECAY,
    BALL_RAND,
    BALL_SIZE,
    BALL_SPEED_MAX,
    BODY,
    DASH_ACCEL,
    FOUL_EXPONENT,
    FROZEN,
    GAIN,
    GOAL_X,
    KICK_RAND,
    LINE_Y,
    MARGIN,
    MAX_POWER,
    OPPONENT,
    PLAYER_RAND,
    SERVER,
    TACKLE_DIST,
    TACKLE_WIDTH,
    TOUCH,
    VX,
    VY,
    Array,
    X,
    Y,
    at_rest,
    direction,
    gap,
    inertia_point,
    kernel,
    turned,
)
from teamclone.rcss.server_params import SERVER_FIELD

SAFE = 100.0
"""Safety of a place that no opponent is near to."""
ALMOST = 1e-5
NEAR_M = 4.05
"""Opponents further from the ball are not looked at."""
DASHES = 24
"""Directions in which an opponent may dash."""
RINGS, AROUND, AROUND_DEG = (0.4, 0.6, 0.75), 20, 18.0
"""Places where to keep the ball: parts of the margin, and how many around the player, on the axes of the pitch."""
FRONT_M, INSIDE_M = 0.05, 0.2
FACE_X, FACED_DEG = GOAL_X - 5.0, 5.0
"""Towards where the player turns, and how well it has to face it."""
LONG, LONG_SLACK_M = 1.6, 0.4
"""Balls that go over so many times the kickable area are not sure to stay within."""
RATE_VALUE = 1000.0
STOP_M, STOP_PART = 0.1, 0.4
"""How far within reach and off the edge a ball stops; what part of the margin one is to be off that is too fast."""
_SIDE, _BACK = SERVER_FIELD["side_dash_rate"], SERVER_FIELD["back_dash_rate"]


class Costs(NamedTuple):
    """What a place loses to one opponent: it covers the ball, touches it, nearly tackles it; per metre of the strip
    ahead of it, and per probability of its tackle; for each dash after which it has the ball, or may tackle it."""

    covers: float = 200.0
    touches: float = 150.0
    near: float = 25.0
    strip: float = 50.0
    tackle: float = 50.0
    dash: float = 20.0
    dash_tackle: float = 10.0


COSTS = Costs()
SLACK_M, TACKLE_SLACK_M = 0.1, 0.2


@kernel
def dash_rate(server: Array, degrees: float) -> float:
    """Return what part of a dash's power its direction leaves; `dynamics.formulas.dash_rate`."""
    side, back = server[_SIDE], server[_BACK]
    quarter = abs(degrees) / 90.0
    if quarter <= 1.0:
        return 1.0 + (side - 1.0) * quarter
    return side + (back - side) * (quarter - 1.0)


@kernel
def _dashes(server: Array) -> Array:
    """Return (DASHES, 2) how far ahead and aside the directions of a dash lead, parts of one straight ahead."""
    made = np.empty((DASHES, 2))
    for index in range(DASHES):
        degrees = 360.0 / DASHES * index - 180.0
        rate, angle = dash_rate(server, degrees), math.radians(degrees)
        made[index, 0], made[index, 1] = rate * math.cos(angle), rate * math.sin(angle)
    return made


@kernel
def _cost(server: Array, player: Array, place: tuple[float, float], dashes: Array) -> float:
    """Return what an opponent takes of the safety of a ball that is in a place in the next cycle."""
    ahead, aside = seen_from(player, place, 1)
    reach, away = reach_of(player, place[0], place[1]), math.hypot(ahead, aside)
    cost = COSTS.strip * max(0.0, reach - abs(aside))
    cost += COSTS.tackle * max(0.0, tackle_chance(server, ahead, aside, server[FOUL_EXPONENT]))
    if away < 0.5 * reach:
        cost += COSTS.covers
    elif away < reach + SLACK_M:
        cost += COSTS.touches
    elif away < server[TACKLE_DIST] - TACKLE_SLACK_M:
        cost += COSTS.near
    length, width, touch = server[TACKLE_DIST] + SLACK_M, server[TACKLE_WIDTH] + SLACK_M, reach + SLACK_M
    if away > player[DASH_ACCEL] + max(touch, math.hypot(length, width)):
        return cost
    for index in range(DASHES):
        x = ahead - player[DASH_ACCEL] * dashes[index, 0]
        y = aside - player[DASH_ACCEL] * dashes[index, 1]
        if x * x + y * y < touch * touch:
            cost += COSTS.dash
        elif 0.0 < x < length and abs(y) < width:
            cost += COSTS.dash_tackle
    return cost


@kernel
def safety(scene: Array, x: float, y: float, dashes: Array) -> float:
    """Return how safe the ball is in a place in the next cycle; SAFE where no opponent comes near.

    Args:
        dashes: see `_dashes`.
    """
    me, ball = scene[ACTOR], scene[BALL]
    cost = 0.0
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if player[FROZEN] == 0 and gap(player[X], player[Y], ball[X], ball[Y]) <= NEAR_M:
            cost += _cost(scene[SERVER], player, (x, y), dashes)
    if gap(x, y, ball[X], ball[Y]) <= LONG * me[AREA]:
        return SAFE - cost
    next_x, next_y = inertia_point(me, 1)
    slack = me[AREA] - gap(x, y, next_x, next_y)
    return (SAFE - cost) * (1.0 - 0.5 * max(0.0, 1.0 - slack / LONG_SLACK_M))


@kernel
def inside(x: float, y: float) -> bool:
    """Return whether a place is clearly on the pitch."""
    return abs(x) <= GOAL_X - INSIDE_M and abs(y) <= LINE_Y - INSIDE_M


@kernel
def stays(scene: Array, slack_m: float) -> bool:
    """Return whether the actor can kick the ball in the next cycle, too, without a kick."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    away = gap(me[X] + me[VX], me[Y] + me[VY], ball[X] + ball[VX], ball[Y] + ball[VY])
    noise = math.hypot(me[VX], me[VY]) * server[PLAYER_RAND] + math.hypot(ball[VX], ball[VY]) * server[BALL_RAND]
    return away <= me[AREA] - noise - slack_m


@kernel
def kick_noise(scene: Array) -> float:
    """Return the speed by which a kick of the actor at full power misses (rcssserver `player.cpp`, kick)."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    away = gap(ball[X], ball[Y], me[X], me[Y])
    aside = abs(turned(direction(ball[X] - me[X], ball[Y] - me[Y]) - me[BODY])) / 180.0
    speed = math.hypot(ball[VX], ball[VY]) / (server[BALL_SPEED_MAX] * server[BALL_DECAY])
    return me[KICK_RAND] * (1.0 + 0.25 * (aside + (away - me[TOUCH]) / me[MARGIN]) + 0.5 * speed)


@kernel
def stop(scene: Array) -> tuple[float, float]:
    """Return the velocity of a ball that is brought to rest beside the actor, or as near to it as one kick does."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    x, y = ball[X] - me[X], ball[Y] - me[Y]
    away = max(math.hypot(x, y), 1e-9)
    kept = min(max(away, me[TOUCH] + STOP_M), me[AREA] - STOP_M) / away
    vx, vy = me[VX] + x * (kept - 1.0), me[VY] + y * (kept - 1.0)
    most = server[MAX_POWER] * ball[GAIN]
    if gap(vx, vy, ball[VX], ball[VY]) < most:
        return vx, vy
    back_x, back_y = me[VX] - x - ball[VX], me[VY] - y - ball[VY]
    off = max(math.hypot(back_x, back_y), 1e-9)
    wanted = off - (me[TOUCH] - server[BALL_SIZE] + STOP_PART * me[MARGIN])
    added = min(max(wanted, -most), most) / off
    return ball[VX] + added * back_x, ball[VY] + added * back_y


@kernel
def _best_place(scene: Array, dashes: Array) -> tuple[float, float]:
    """Return the velocity that brings the ball to the best place beside the actor; `stop` where there is none."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    next_x, next_y = inertia_point(me, 1)
    own_noise, noise = math.hypot(me[VX], me[VY]) * server[PLAYER_RAND], kick_noise(scene)
    best, best_x, best_y = -np.inf, 0.0, 0.0
    for index in range(AROUND):
        degrees = AROUND_DEG * index - 180.0
        cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        for ring in range(len(RINGS)):
            radius = me[TOUCH] + me[MARGIN] * RINGS[ring]
            x, y = next_x + radius * cos, next_y + radius * sin
            part = gap(x, y, ball[X] + ball[VX], ball[Y] + ball[VY]) / ball[GAIN] / server[MAX_POWER]
            if not inside(x, y) or part >= 1.0:
                continue
            metres = gap(x, y, ball[X], ball[Y])
            miss = own_noise + metres * server[BALL_RAND] + noise * part
            if ring and 0.95 * miss >= me[AREA] - radius - 0.1:
                continue
            rate = kick_rate(me, radius, degrees - me[BODY])
            if metres * server[BALL_DECAY] >= server[MAX_POWER] * rate:
                continue
            value = safety(scene, x, y, dashes) + RATE_VALUE * rate
            if value > best:
                best, best_x, best_y = value, x - ball[X], y - ball[Y]
    return stop(scene) if best == -np.inf else (best_x, best_y)


@kernel
def hold_ball(scene: Array) -> tuple[bool, float, float]:
    """Return whether the actor turns, and else the velocity that its kick gives the ball."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    dashes = _dashes(server)
    left_x, left_y = inertia_point(ball, 1)
    if inside(left_x, left_y) and stays(scene, 0.15):
        rest_x, rest_y = at_rest(me)
        facing = abs(turned(me[BODY] - direction(FACE_X - rest_x, -rest_y))) < FACED_DEG
        if not facing and safety(scene, left_x, left_y, dashes) >= SAFE - ALMOST:
            return True, 0.0, 0.0
    next_x, next_y = inertia_point(me, 1)
    body, off = math.radians(me[BODY]), me[TOUCH] + FRONT_M
    x, y = next_x + off * math.cos(body), next_y + off * math.sin(body)
    near = inside(x, y) and gap(x, y, left_x, left_y) <= server[MAX_POWER] * ball[GAIN]
    if near and safety(scene, x, y, dashes) >= SAFE - ALMOST:
        return False, x - ball[X], y - ball[Y]
    vx, vy = _best_place(scene, dashes)
    return False, vx, vy
