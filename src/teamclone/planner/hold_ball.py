"""Keeping the ball: a turn while it stays in reach, or a kick to where opponents get it least.

All that may be done with the ball is one table of candidates: the place that the ball has in the next cycle, and what
the candidate is worth. The one that is worth most is chosen.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from teamclone.planner.ball import aim_error, kick_noise, kick_rate, kick_to, limited, most_acceleration
from teamclone.planner.motion import beside, dash_rate
from teamclone.planner.players import Bearing, bearing, pose_after, tackle_chance
from teamclone.planner.scene import (
    ACTOR,
    AREA,
    BALL,
    BALL_DECAY,
    BALL_SIZE,
    BODY,
    DASH_ACCEL,
    FOUL_EXPONENT,
    FROZEN,
    GAIN,
    GOAL_X,
    LINE_Y,
    MARGIN,
    OPPONENT,
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
    turned,
)
from teamclone.system.compiling import kernel

RING_PARTS, AROUND = (0.4, 0.6, 0.75), 20
"""Rings around the player, parts of the margin, and how many places on each, evenly, the first towards -x."""
_AROUND_DEG = np.repeat(360.0 / AROUND * np.arange(AROUND) - 180.0, len(RING_PARTS))
_PARTS = np.tile(RING_PARTS, AROUND)
_IS_INNER = np.isin(_PARTS, RING_PARTS[0])
N_AROUND = AROUND * len(RING_PARTS)
ROLL_ON, AHEAD, STOP, CANDIDATES = N_AROUND, N_AROUND + 1, N_AROUND + 2, N_AROUND + 3
"""Rows of the candidates after the places around: no kick, a kick to just ahead of the body, a stop; their number."""
WORTH_ROLL_ON, WORTH_AHEAD, WORTH_STOP = 2e6, 1e6, -1e6
"""Before all places around, if no opponent comes near: a turn, then the place ahead. The stop is the last resort."""
WORTH_RATE = 1000.0
"""Worth of a place for each metre per cycle that a unit of power gives a ball there; else its safety."""
AHEAD_M, INSIDE_M, STAYS_M, ROOM_M = 0.05, 0.2, 0.15, 0.1
"""Metres: of the place ahead beyond touch; off the lines; to spare within reach without a kick, and after one."""
ERROR_PART = 0.95
"""Part of the error of a kick that a place leaves room for; the inner ring has room enough."""
FACE_X, FACED_DEG = GOAL_X - 5.0, 5.0
"""Where the player turns to, and to how many degrees it faces it."""
STOP_M, STOP_PART = 0.1, 0.4
"""A stopped ball lies so far off the edges of the margin; one too fast for that is aimed at this part of the margin."""

SAFE, ALMOST = 100.0, 1e-5
"""Safety of a place that no opponent comes near, and how little less counts as that, too."""
NEAR_M = 4.05
"""Opponents further from the ball are ignored."""
LONG, LONG_ROOM_M, LONG_LEFT = 1.6, 0.4, 0.5
"""A ball that goes over more than so many times the kickable area needs so much room within reach; part of the safety
that is left to one without any."""
DASHES = 24
"""Directions in which an opponent may dash, evenly."""
TOUCH_M, TACKLE_M = 0.1, 0.2
"""Metres by which an opponent is thought to reach further; and by which it has to be nearer to be close."""


class Costs(NamedTuple):
    """What a place loses to one opponent.

    Attributes:
        close: within the length of its tackle; touched: more, within its reach; covered: more, within half of that.
        strip: per metre of its reach that overlaps the strip straight ahead of it and behind it.
        tackle: per probability of its tackle.
        dash: for each direction of a dash after which it has the ball; dash_tackle: after which it may tackle it.
    """

    close: float = 25.0
    touched: float = 125.0
    covered: float = 50.0
    strip: float = 50.0
    tackle: float = 50.0
    dash: float = 20.0
    dash_tackle: float = 10.0


COSTS = Costs()


@kernel
def _full_dashes(server: Array) -> Array:
    """Return (DASHES, 2) how far ahead and aside full dashes lead, parts of one straight ahead."""
    ways = np.empty((DASHES, 2))
    for index in range(DASHES):
        degrees = 360.0 / DASHES * index - 180.0
        part, angle = dash_rate(server, degrees), math.radians(degrees)
        ways[index, 0], ways[index, 1] = part * math.cos(angle), part * math.sin(angle)
    return ways


@kernel
def _dash_cost(server: Array, accel: float, ball: Bearing, ways: Array) -> float:
    """Return what a place loses to the dashes of an opponent.

    Args:
        accel: metres of its full dash. ways: see `_full_dashes`.
    """
    touch, length, width = ball.reach + TOUCH_M, server[TACKLE_DIST] + TOUCH_M, server[TACKLE_WIDTH] + TOUCH_M
    touches, tackles = 0, 0
    if ball.metres <= accel + max(touch, math.hypot(length, width)):  # else all are too short
        for index in range(DASHES):
            ahead, aside = ball.ahead - accel * ways[index, 0], ball.aside - accel * ways[index, 1]
            touched = ahead * ahead + aside * aside < touch * touch
            tackled = (ahead > 0.0) & (ahead < length) & (abs(aside) < width)
            touches += touched
            tackles += tackled & (not touched)
    return COSTS.dash * touches + COSTS.dash_tackle * tackles


@kernel
def _near_cost(server: Array, ball: Bearing) -> float:
    """Return what a place loses to an opponent that need not dash to it."""
    close = COSTS.close * (ball.metres < max(server[TACKLE_DIST] - TACKLE_M, ball.reach + TOUCH_M))
    touched = COSTS.touched * (ball.metres < ball.reach + TOUCH_M)
    covered = COSTS.covered * (ball.metres < 0.5 * ball.reach)
    strip = COSTS.strip * max(0.0, ball.reach - abs(ball.aside))
    chance = max(0.0, tackle_chance(server, ball.ahead, ball.aside, server[FOUL_EXPONENT]))
    return close + touched + covered + strip + COSTS.tackle * chance


@kernel
def safeties(scene: Array, place: Array, asked: Array) -> Array:
    """Return (n,) how safe the ball is in places in the next cycle; SAFE where no opponent comes near.

    Args:
        place: (n, 2) metres. asked: (n,) which of them; the others get SAFE.
    """
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    safety = np.full(len(place), SAFE)
    ways = _full_dashes(server)
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if player[FROZEN] > 0 or gap(player[X], player[Y], ball[X], ball[Y]) > NEAR_M:
            continue
        pose = pose_after(player, 1)
        for index in range(len(place)):
            if asked[index]:
                lies = bearing(player, pose, place[index, 0], place[index, 1])
                safety[index] -= _near_cost(server, lies) + _dash_cost(server, player[DASH_ACCEL], lies, ways)
    next_x, next_y = inertia_point(me, 1)
    for index in range(len(place)):
        x, y = place[index, 0], place[index, 1]
        room = (me[AREA] - gap(x, y, next_x, next_y)) / LONG_ROOM_M
        is_long = gap(x, y, ball[X], ball[Y]) > LONG * me[AREA]
        safety[index] *= 1.0 - is_long * (1.0 - LONG_LEFT) * max(0.0, 1.0 - room)
    return safety


@kernel
def inside(x: float, y: float) -> bool:
    """Return whether a place is clearly on the pitch."""
    return abs(x) <= GOAL_X - INSIDE_M and abs(y) <= LINE_Y - INSIDE_M


@kernel
def stays(scene: Array, slack_m: float) -> bool:
    """Return whether the actor can surely kick the ball in the next cycle, too, without a kick in this one.

    Args:
        slack_m: metres to spare.
    """
    me, ball = scene[ACTOR], scene[BALL]
    away = gap(me[X] + me[VX], me[Y] + me[VY], ball[X] + ball[VX], ball[Y] + ball[VY])
    return away + aim_error(scene, 0.0, math.hypot(ball[VX], ball[VY]), 0.0) <= me[AREA] - slack_m


@kernel
def _stopped(scene: Array) -> tuple[float, float]:
    """Return where the ball is in the next cycle if it is stopped as well as one kick does.

    It is to keep its place beside the actor, or, where it is too fast for that, to come onto a ring.
    """
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    most = most_acceleration(server, ball[GAIN])
    x, y = ball[X] - me[X], ball[Y] - me[Y]
    kept_m = min(max(math.hypot(x, y), me[TOUCH] + STOP_M), me[AREA] - STOP_M)
    vx, vy, added = kick_to(ball, beside(me, 1, kept_m, direction(x, y)))
    if added > most:
        ring_m = me[TOUCH] - server[BALL_SIZE] + STOP_PART * me[MARGIN]
        rolls = direction(x + ball[VX] - me[VX], y + ball[VY] - me[VY])
        vx, vy, _ = kick_to(ball, beside(me, 1, ring_m, rolls))
    change_x, change_y = limited(vx - ball[VX], vy - ball[VY], most)
    return ball[X] + ball[VX] + change_x, ball[Y] + ball[VY] + change_y


@kernel
def _around(scene: Array, place: Array, worth: Array) -> None:
    """Fill the places around the actor and what a kick from there is worth, -inf where the ball cannot be kept.

    One kick has to bring the ball there, surely within reach, and the next one has to be able to stop it.
    """
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    noise = kick_noise(scene)
    for index in range(N_AROUND):
        metres = me[TOUCH] + me[MARGIN] * _PARTS[index]
        x, y = beside(me, 1, metres, _AROUND_DEG[index])
        vx, vy, added = kick_to(ball, (x, y))
        covers = math.hypot(vx, vy)
        rate = kick_rate(me, metres, _AROUND_DEG[index] - me[BODY])
        surely = _IS_INNER[index] | (metres + ERROR_PART * aim_error(scene, noise, covers, added) < me[AREA] - ROOM_M)
        comes = added < most_acceleration(server, ball[GAIN])
        stops = covers * server[BALL_DECAY] < most_acceleration(server, rate)
        place[index, 0], place[index, 1] = x, y
        worth[index] = WORTH_RATE * rate if surely & comes & stops & inside(x, y) else -np.inf


@kernel
def hold_ball(scene: Array) -> tuple[bool, float, float]:
    """Return whether the actor turns, and else the velocity that its kick gives the ball, metres per cycle."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    place, worth = np.empty((CANDIDATES, 2)), np.full(CANDIDATES, -np.inf)
    _around(scene, place, worth)
    place[ROLL_ON], place[AHEAD] = inertia_point(ball, 1), beside(me, 1, me[TOUCH] + AHEAD_M, me[BODY])
    place[STOP] = _stopped(scene)
    rest_x, rest_y = at_rest(me)
    faces = abs(turned(me[BODY] - direction(FACE_X - rest_x, -rest_y))) < FACED_DEG
    if inside(place[ROLL_ON, 0], place[ROLL_ON, 1]) and stays(scene, STAYS_M) and not faces:
        worth[ROLL_ON] = WORTH_ROLL_ON
    _, _, added = kick_to(ball, (place[AHEAD, 0], place[AHEAD, 1]))
    if inside(place[AHEAD, 0], place[AHEAD, 1]) and added <= most_acceleration(server, ball[GAIN]):
        worth[AHEAD] = WORTH_AHEAD
    safety = safeties(scene, place, worth > -np.inf)
    for index in (ROLL_ON, AHEAD):
        worth[index] = worth[index] if safety[index] >= SAFE - ALMOST else -np.inf
    worth[:N_AROUND] += safety[:N_AROUND]
    worth[STOP] = WORTH_STOP
    chosen = np.argmax(worth)
    if chosen == ROLL_ON:
        return True, 0.0, 0.0
    return False, place[chosen, 0] - ball[X], place[chosen, 1] - ball[Y]
