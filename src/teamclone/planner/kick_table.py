"""A kick that takes several: to which place beside him he brings the ball first, to be able to kick it on."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.planner.ball import fastest, fastest_from, kick_limits, kick_rate, most_acceleration
from teamclone.planner.hold_ball import kick_noise
from teamclone.planner.players import after_dash, reach_of, seen_from, tackle_chance
from teamclone.planner.scene import (
    ACTOR,
    AREA,
    BALL,
    BALL_DECAY,
    BALL_RAND,
    BODY,
    DASH_ACCEL,
    FOUL_EXPONENT,
    FROZEN,
    GAIN,
    GOAL_X,
    LINE_Y,
    MARGIN,
    MAX_POWER,
    OPPONENT,
    PLAYER_RAND,
    SERVER,
    TACKLE_DIST,
    TACKLE_EXPONENT,
    TACKLE_WIDTH,
    TOUCH,
    VX,
    VY,
    Array,
    X,
    Y,
    direction,
    gap,
    inertia_point,
    kernel,
    turned,
)
from teamclone.rcss.player_types import DEFAULTS
from teamclone.rcss.server_params import default

RINGS, COUNTS = (0.3, 0.5, 0.7), (12, 15, 20)
"""Places around the body: parts of the margin, and how many on each ring."""
PLACES = sum(COUNTS)
OFF_M, WITHIN_M = 0.1, 0.2
"""How far a place is at least off his edge, and within his reach."""
DIRECTIONS, PATHS = 72, 1024
"""Of kicks, and pairs of places before them that are tried, those first that give the ball most speed."""
LOST, TACKLED, SOON_TACKLED, SOON_LOST, CUT_OFF, MAYBE_CUT_OFF, OUTSIDE, MISSED = (1 << bit for bit in range(8))
"""What may happen to a ball in a place, or kicked on from there."""
PRICES = 0.0, 0.5, 0.3, 0.6, 0.0, 0.25, 0.0, 0.03
"""What each of them takes of a sequence's worth, in their order."""
TOO_SLOW, SLOWER, SHORT = -10.0, 100.0, 0.05
"""Worth of a sequence that is too slow, and less for each metre per cycle; what one kick loses that is slow enough."""
MORE_KICKS, HARD, HARDEST, POWER, SECURED = (0.05, 0.2), (90.0, 0.025), (94.0, 0.075), 0.0005, 0.05
"""What two and three kicks lose; a last kick above a power; each unit of it; by how much less several kicks mind that
the ball may be cut off."""
RISKS = TACKLED | SOON_TACKLED | SOON_LOST | MAYBE_CUT_OFF | MISSED
NEAR_M = 10.0
"""Opponents further from the ball are not looked at."""
ENOUGH = 10
"""Paths of three kicks after which no more are looked for."""
MOST = 2 * (PLACES + PATHS) + 1


def kick_order() -> NDArray[np.int64]:
    """(DIRECTIONS, PATHS, 2) first and second place before a kick in each direction from the body, for a player of the
    default type, the pairs first that give the ball most speed."""
    size, margin = DEFAULTS["player_size"] + default("ball_size"), DEFAULTS["kickable_margin"]
    thin = margin - 0.1  # the smallest that the server gives
    places, rates = [], []
    power_max, accel_max, speed_max = (default(name) for name in ("maxpower", "ball_accel_max", "ball_speed_max"))
    for part, count in zip(RINGS, COUNTS, strict=True):
        radius = min(max(size + OFF_M, size + thin * part), size + margin - WITHIN_M)
        for place in range(count):
            degrees = 360.0 / count * place - 180.0
            angle = math.radians(degrees)
            places.append((radius * math.cos(angle), radius * math.sin(angle)))
            rate = 1 - 0.25 * abs(degrees) / 180.0 - 0.25 * (radius - size) / margin
            rates.append(DEFAULTS["kick_power_rate"] * rate)

    def order(one: tuple[float, float, int, int], other: tuple[float, float, int, int]) -> int:
        # Speeds that differ by less than this count as one, so this is no order that a key would give.
        more = one[1] - other[1] if abs(one[0] - other[0]) < 1e-3 else other[0] - one[0]
        return (more > 0) - (more < 0)

    made = np.empty((DIRECTIONS, PATHS, 2), np.int64)
    for turn in range(DIRECTIONS):
        angle = math.radians(360.0 / DIRECTIONS * turn - 180.0)
        cos, sin = math.cos(angle), math.sin(angle)
        pairs = []
        for first, (from_x, from_y) in enumerate(places):
            for second, (to_x, to_y) in enumerate(places):
                vx, vy = to_x - from_x, to_y - from_y
                speed = fastest.py_func((min(power_max * rates[second], accel_max), speed_max), (cos, sin), (vx, vy))
                power = math.hypot(speed * cos - vx, speed * sin - vy) / rates[second]
                pairs.append((speed, power, first, second))
        pairs.sort(key=functools.cmp_to_key(order))
        made[turn] = [pair[2:] for pair in pairs[:PATHS]]
    return made


class Target(NamedTuple):
    """Where the ball is to go, with what speed, and above which one it will do."""

    x: float
    y: float
    speed: float
    enough: float


class Danger(NamedTuple):
    """When an opponent endangers a ball, and what that is called.

    Attributes:
        touch_m: metres beyond its reach within which an opponent that drifts has the ball.
        chance: of its tackle, from which on it counts; exponent: column of the server that the tackle goes by.
        dash: part of its dash that counts; short_m: metres by which it reaches less after a dash.
        tackle_m: metres by which its tackle after a dash reaches less; behind: whether such a tackle goes back, too.
        taken, tackled, dashed, dash_tackled: what is found.
    """

    touch_m: float
    chance: float
    exponent: int
    dash: float
    short_m: float
    tackle_m: float
    behind: bool
    taken: int
    tackled: int
    dashed: int
    dash_tackled: int


LIES = Danger(0.15, 0.7, FOUL_EXPONENT, 1.0, 0.0, 0.3, False, LOST, TACKLED, SOON_LOST, SOON_TACKLED)
KICKED_ON = Danger(0.1, 0.8, TACKLE_EXPONENT, 0.8, 0.15, 0.5, True, CUT_OFF, *[MAYBE_CUT_OFF] * 3)
TACKLE_PART = 0.7
"""Part of the width of a tackle that counts after a dash."""


@kernel
def _danger(server: Array, player: Array, place: tuple[float, float], cycles: int, of: Danger) -> int:
    """Return what one opponent does to a ball that is in a place after so many cycles."""
    ahead, aside = seen_from(player, place, cycles)
    away = math.hypot(ahead, aside)
    if player[FROZEN] > 0:
        return of.taken if away < player[TOUCH] else 0
    reach, dash_m = reach_of(player, place[0], place[1]), of.dash * player[DASH_ACCEL]
    if away < reach + of.touch_m:
        return of.taken
    found = 0
    if tackle_chance(server, ahead, aside, server[of.exponent]) > of.chance:
        found |= of.tackled
    between = abs(ahead) < dash_m and abs(aside) < reach
    if between or after_dash(ahead, aside, dash_m) < reach - of.short_m:
        found |= of.dashed
    else:
        near = ahead < dash_m + server[TACKLE_DIST] - of.tackle_m and (of.behind or ahead > 0.0)
        found |= of.dash_tackled if near and abs(aside) < TACKLE_PART * server[TACKLE_WIDTH] else 0
    return found


@kernel
def _dangers(scene: Array, place: tuple[float, float], cycles: int, of: Danger) -> int:
    """Return what all opponents near the ball may do to it."""
    found = 0
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if gap(player[X], player[Y], scene[BALL, X], scene[BALL, Y]) <= NEAR_M:
            found |= _danger(scene[SERVER], player, place, cycles, of)
    return found


@kernel
def _kicked_on(place: tuple[float, float], target: Target) -> tuple[float, float]:
    """Return where a ball is one cycle after it is kicked on from a place."""
    metres = gap(target.x, target.y, place[0], place[1])
    way = target.speed / metres
    return place[0] + way * (target.x - place[0]), place[1] + way * (target.y - place[1])


@kernel
def _places(me: Array, radius: Array, rate: Array, place: Array) -> None:
    """Fill the places beside him in the next two cycles (2, PLACES, 2), how far off and what a kick there gives."""
    index = 0
    for ring in range(len(RINGS)):
        off = min(max(me[TOUCH] + OFF_M, me[TOUCH] + me[MARGIN] * RINGS[ring]), me[AREA] - WITHIN_M)
        for turn in range(COUNTS[ring]):
            degrees = 360.0 / COUNTS[ring] * turn - 180.0
            angle = math.radians(degrees + me[BODY])
            radius[index], rate[index] = off, kick_rate(me, off, degrees)
            for cycle in range(2):
                x, y = inertia_point(me, cycle + 1)
                place[cycle, index, 0], place[cycle, index, 1] = x + off * math.cos(angle), y + off * math.sin(angle)
            index += 1


@kernel
def _judged(target: Target, speed: float, power: float, kicks: int, dangers: int) -> float:
    """How good a sequence of kicks is, 1 for the best: PRICES of what may happen, of each kick more, and of its last
    one's power."""
    short = target.speed - speed
    if short > 0 and (kicks > 1 or speed < target.enough):
        value = TOO_SLOW - SLOWER * short
    else:
        value = 1.0 - (SHORT if short > 0 else 0.0)
    for bit in range(len(PRICES)):
        if dangers & (1 << bit):
            value -= PRICES[bit]
    if kicks > 1:
        value -= MORE_KICKS[kicks - 2] + (HARDEST[1] if power > HARDEST[0] else HARD[1] if power > HARD[0] else 0.0)
        value += SECURED if dangers & MAYBE_CUT_OFF else 0.0
    return value - POWER * power


@kernel
def best_sequence(scene: Array, order: NDArray[np.int64], target: Target, most: int) -> tuple[float, float, float]:
    """The speed that at most ``most`` kicks give the ball towards a place, and its velocity after the first.

    Args:
        order: see `kick_order`.
    """
    me, ball, gain, server = scene[ACTOR], scene[BALL], scene[BALL, GAIN], scene[SERVER]
    to_x, to_y, wanted = target.x, target.y, target.speed
    radius, rate, place = np.empty(PLACES), np.empty(PLACES), np.empty((2, PLACES, 2))
    _places(me, radius, rate, place)
    dangers = np.empty((2, PLACES), np.int64)
    for cycle in range(2):
        for index in range(PLACES):
            x, y = place[cycle, index, 0], place[cycle, index, 1]
            found = OUTSIDE if abs(x) > GOAL_X or abs(y) > LINE_Y else 0
            found |= _dangers(scene, (x, y), 1, LIES)
            dangers[cycle, index] = found | _dangers(scene, _kicked_on((x, y), target), cycle + 2, KICKED_ON)
    now = _dangers(scene, (ball[X], ball[Y]), 1, LIES)
    soon = _dangers(scene, _kicked_on((ball[X], ball[Y]), target), 1, KICKED_ON)
    begun = now | (soon & ~CUT_OFF)

    speeds, powers, velocity = np.empty(MOST), np.empty(MOST), np.empty((MOST, 2))
    kicks, threats = np.empty(MOST, np.int64), np.empty(MOST, np.int64)
    count = 0
    most_added = most_acceleration(server, gain)
    if not soon & CUT_OFF:
        metres = math.hypot(to_x - ball[X], to_y - ball[Y])
        cos, sin = (to_x - ball[X]) / metres, (to_y - ball[Y]) / metres
        speed = wanted
        if math.hypot(wanted * cos - ball[VX], wanted * sin - ball[VY]) > most_added:
            speed = fastest_from(scene, cos, sin, gain)
        speeds[0], powers[0] = speed, math.hypot(speed * cos - ball[VX], speed * sin - ball[VY]) / gain
        velocity[0, 0], velocity[0, 1], kicks[0], threats[0] = speed * cos, speed * sin, 1, begun
        count = 1
    own_noise, noise = math.hypot(me[VX], me[VY]) * server[PLAYER_RAND], kick_noise(scene)
    facing = turned(direction(to_x - me[X], to_y - me[Y]) - me[BODY])
    turn = int(np.rint(DIRECTIONS * (facing + 180.0) / 360.0)) % DIRECTIONS
    for careless in range(2):
        if careless and count and speeds[:count].max() > target.enough:
            break
        never = OUTSIDE | LOST | CUT_OFF
        avoided = never if careless else never | RISKS
        for stage in range(2, most + 1):
            done, fastest_so_far = 0, 0.0
            for path in range(PLACES if stage == 2 else PATHS):
                if stage == 3 and done > ENOUGH:
                    break
                first = path if stage == 2 else order[turn, path, 0]
                last = path if stage == 2 else order[turn, path, 1]
                cycle = stage - 2
                if stage == 3 and dangers[0, first] & (avoided & ~CUT_OFF):
                    continue
                if dangers[cycle, last] & avoided:
                    continue
                # To the first place.
                vx, vy = place[0, first, 0] - ball[X], place[0, first, 1] - ball[Y]
                added = math.hypot(vx - ball[VX], vy - ball[VY])
                if added > most_added:
                    continue
                miss = own_noise + math.hypot(vx, vy) * server[BALL_RAND] + noise * added / gain / server[MAX_POWER]
                threat = begun | dangers[cycle, last]
                to_vx, to_vy = vx * server[BALL_DECAY], vy * server[BALL_DECAY]
                if stage == 3:
                    threat |= dangers[0, first] & ~CUT_OFF
                    next_vx = place[1, last, 0] - place[0, first, 0]
                    next_vy = place[1, last, 1] - place[0, first, 1]
                    if math.hypot(next_vx - to_vx, next_vy - to_vy) > most_acceleration(server, 0.9 * rate[first]):
                        continue
                    to_vx, to_vy = next_vx * server[BALL_DECAY], next_vy * server[BALL_DECAY]
                # And from the last one on.
                x, y = place[cycle, last, 0], place[cycle, last, 1]
                metres = math.hypot(to_x - x, to_y - y)
                cos, sin = (to_x - x) / metres, (to_y - y) / metres
                speed = wanted
                where = count
                if math.hypot(wanted * cos - to_vx, wanted * sin - to_vy) > most_acceleration(server, rate[last]):
                    speed = fastest(kick_limits(server, rate[last]), (cos, sin), (to_vx, to_vy))
                    if (done and stage == 3) or speed <= fastest_so_far:
                        continue
                    # Of those that fall short one is kept; it takes the place of what was found last.
                    where = count - 1
                    if (stage == 2 and fastest_so_far == 0.0) or count == 0:
                        where = count
                    fastest_so_far = speed
                else:
                    done += 1
                    if miss > me[AREA] - radius[first] - (0.05 if stage == 2 else 0.1):
                        threat |= MISSED
                speeds[where], powers[where] = speed, math.hypot(speed * cos - to_vx, speed * sin - to_vy) / rate[last]
                velocity[where, 0], velocity[where, 1], kicks[where], threats[where] = vx, vy, stage, threat
                count = max(count, where + 1)
    best, chosen = -np.inf, -1
    for index in range(count):
        value = _judged(target, speeds[index], powers[index], kicks[index], threats[index])
        if value > best:
            best, chosen = value, index
    if chosen < 0:
        return 0.0, 0.0, 0.0
    return speeds[chosen], velocity[chosen, 0], velocity[chosen, 1]
