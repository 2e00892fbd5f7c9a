"""A kick that takes several: to which place beside him he brings the ball first, to be able to kick it on."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.planner.constants import BALL_DECAY, BALL_SIZE
from teamclone.planner.hold_ball import blur
from teamclone.planner.players import (
    AREA,
    BALL,
    BALL_PUSH_MAX,
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
    TACKLE_EXPONENT,
    TACKLE_M,
    TACKLE_WIDTH_M,
    TACKLING,
    VX,
    VY,
    Array,
    X,
    Y,
    beside,
    coasted,
    direction,
    fastest,
    gap,
    in_their_box,
    kernel,
    kick_rate,
    reach_of,
    tackle_chance,
    turned,
)
from teamclone.rcss import pitch
from teamclone.rcss.player_types import DEFAULTS

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
SURE = 0.7, 0.8
"""Chances from which on a tackle counts: of a ball that lies, and of one that is kicked on."""
ENOUGH = 10
"""Paths of three kicks after which no more are looked for."""
MOST = 2 * (PLACES + PATHS) + 1


def paths() -> NDArray[np.int64]:
    """(DIRECTIONS, PATHS, 2) first and second place before a kick in each direction from the body, for a player of the
    default type, the pairs first that give the ball most speed."""
    size, margin = DEFAULTS["player_size"] + BALL_SIZE, DEFAULTS["kickable_margin"]
    thin = margin - 0.1  # the smallest that the server gives
    places, rates = [], []
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
                speed = fastest.py_func(cos, sin, rates[second], vx, vy)
                power = math.hypot(speed * cos - vx, speed * sin - vy) / rates[second]
                pairs.append((speed, power, first, second))
        pairs.sort(key=functools.cmp_to_key(order))
        made[turn] = [pair[2:] for pair in pairs[:PATHS]]
    return made


class Wish(NamedTuple):
    """Where the ball is to go, with what speed, and above which one it will do."""

    x: float
    y: float
    speed: float
    enough: float


@kernel
def _after_a_dash(ahead: float, aside: float, push: float, reach: float) -> bool:
    """Whether he can kick it after a dash ahead or back."""
    return math.hypot(ahead + push, aside) < reach or math.hypot(ahead - push, aside) < reach


@kernel
def _dangers(scene: Array, x: float, y: float) -> int:
    """Of a ball that lies in a place."""
    found = 0
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if gap(player[X], player[Y], scene[BALL, 0], scene[BALL, 1]) > NEAR_M:
            continue
        at_x, at_y = player[X] + player[VX], player[Y] + player[VY]
        away = math.hypot(x - at_x, y - at_y)
        if player[TACKLING] > 0:
            if away < player[SIZE]:
                return found | LOST
            continue
        reach = reach_of(player, x, y) if in_their_box(player[X], player[Y]) else player[AREA]
        if away < reach + 0.15:
            return found | LOST
        ahead, aside = beside(player, (at_x, at_y), x, y)
        if tackle_chance(ahead, aside, FOUL_EXPONENT) > SURE[0]:
            found |= TACKLED
        push = player[PUSH]
        if abs(aside) < reach and (abs(ahead) < push or _after_a_dash(ahead, aside, push, reach)):
            found |= SOON_LOST
        elif abs(aside) < 0.7 * TACKLE_WIDTH_M and 0.0 < ahead < push + TACKLE_M - 0.3:
            found |= SOON_TACKLED
    return found


@kernel
def _dangers_after(scene: Array, x: float, y: float, wish: Wish, cycles: int) -> int:
    """Of a ball that is kicked on from a place, in so many cycles."""
    found = 0
    metres = gap(wish.x, wish.y, x, y)
    x, y = x + wish.speed * (wish.x - x) / metres, y + wish.speed * (wish.y - y) / metres
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if gap(player[X], player[Y], scene[BALL, 0], scene[BALL, 1]) > NEAR_M:
            continue
        at_x, at_y = coasted(player, cycles)
        away = math.hypot(x - at_x, y - at_y)
        if player[TACKLING] > 0:
            if away < player[SIZE]:
                found |= CUT_OFF
            continue
        reach = reach_of(player, x, y) if in_their_box(at_x, at_y) else player[AREA]
        if away < reach + 0.1:
            found |= CUT_OFF
            continue
        ahead, aside = beside(player, (at_x, at_y), x, y)
        push = 0.8 * player[PUSH]
        near = abs(aside) < reach and (abs(ahead) < push or _after_a_dash(ahead, aside, push, reach - 0.15))
        tackles = abs(aside) < 0.7 * TACKLE_WIDTH_M and ahead - push < TACKLE_M - 0.5
        if near or tackles or tackle_chance(ahead, aside, TACKLE_EXPONENT) > SURE[1]:
            found |= MAYBE_CUT_OFF
    return found


@kernel
def _places(me: Array, radius: Array, rate: Array, place: Array) -> None:
    """Fill the places beside him in the next two cycles (2, PLACES, 2), how far off and what a kick there gives."""
    index = 0
    for ring in range(len(RINGS)):
        off = min(max(me[SIZE] + OFF_M, me[SIZE] + me[MARGIN] * RINGS[ring]), me[AREA] - WITHIN_M)
        for turn in range(COUNTS[ring]):
            degrees = 360.0 / COUNTS[ring] * turn - 180.0
            angle = math.radians(degrees + me[BODY])
            radius[index], rate[index] = off, kick_rate(me, off, degrees)
            for cycle in range(2):
                x, y = coasted(me, cycle + 1)
                place[cycle, index, 0], place[cycle, index, 1] = x + off * math.cos(angle), y + off * math.sin(angle)
            index += 1


@kernel
def _judged(wish: Wish, speed: float, power: float, kicks: int, dangers: int) -> float:
    """How good a sequence of kicks is, 1 for the best: PRICES of what may happen, of each kick more, and of its last
    one's power."""
    short = wish.speed - speed
    if short > 0 and (kicks > 1 or speed < wish.enough):
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
def several_kicks(scene: Array, order: NDArray[np.int64], wish: Wish, most: int) -> tuple[float, float, float]:
    """The speed that at most ``most`` kicks give the ball towards a place, and its velocity after the first.

    Args:
        order: as of `paths`.
    """
    me, ball, gain = scene[ME], scene[BALL], scene[BALL, GAIN]
    to_x, to_y, wanted = wish.x, wish.y, wish.speed
    radius, rate, place = np.empty(PLACES), np.empty(PLACES), np.empty((2, PLACES, 2))
    _places(me, radius, rate, place)
    dangers = np.empty((2, PLACES), np.int64)
    for cycle in range(2):
        for index in range(PLACES):
            x, y = place[cycle, index, 0], place[cycle, index, 1]
            found = _dangers(scene, x, y)
            if abs(x) > GOAL_X or abs(y) > pitch.HALF_WIDTH:
                found |= OUTSIDE
            dangers[cycle, index] = found | _dangers_after(scene, x, y, wish, cycle + 2)
    now = _dangers(scene, ball[0], ball[1])
    soon = _dangers_after(scene, ball[0], ball[1], wish, 1)
    begun = now | (soon & ~CUT_OFF)

    speeds, powers, velocity = np.empty(MOST), np.empty(MOST), np.empty((MOST, 2))
    kicks, threats = np.empty(MOST, np.int64), np.empty(MOST, np.int64)
    count = 0
    most_push = min(100.0 * gain, BALL_PUSH_MAX)
    if not soon & CUT_OFF:
        metres = math.hypot(to_x - ball[0], to_y - ball[1])
        cos, sin = (to_x - ball[0]) / metres, (to_y - ball[1]) / metres
        speed = wanted
        if math.hypot(wanted * cos - ball[2], wanted * sin - ball[3]) > most_push:
            speed = fastest(cos, sin, gain, ball[2], ball[3])
        speeds[0], powers[0] = speed, math.hypot(speed * cos - ball[2], speed * sin - ball[3]) / gain
        velocity[0, 0], velocity[0, 1], kicks[0], threats[0] = speed * cos, speed * sin, 1, begun
        count = 1
    doubt, blurred = math.hypot(me[VX], me[VY]) * PLAYER_RAND, me[KICK_RAND] * blur(scene)
    facing = turned(direction(to_x - me[X], to_y - me[Y]) - me[BODY])
    turn = int(np.rint(DIRECTIONS * (facing + 180.0) / 360.0)) % DIRECTIONS
    for careless in range(2):
        if careless and count and speeds[:count].max() > wish.enough:
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
                vx, vy = place[0, first, 0] - ball[0], place[0, first, 1] - ball[1]
                push = math.hypot(vx - ball[2], vy - ball[3])
                if push > most_push:
                    continue
                miss = doubt + math.hypot(vx, vy) * BALL_RAND + blurred * push / gain / 100.0
                threat = begun | dangers[cycle, last]
                to_vx, to_vy = vx * BALL_DECAY, vy * BALL_DECAY
                if stage == 3:
                    threat |= dangers[0, first] & ~CUT_OFF
                    next_vx = place[1, last, 0] - place[0, first, 0]
                    next_vy = place[1, last, 1] - place[0, first, 1]
                    if math.hypot(next_vx - to_vx, next_vy - to_vy) > min(90.0 * rate[first], BALL_PUSH_MAX):
                        continue
                    to_vx, to_vy = next_vx * BALL_DECAY, next_vy * BALL_DECAY
                # And from the last one on.
                x, y = place[cycle, last, 0], place[cycle, last, 1]
                metres = math.hypot(to_x - x, to_y - y)
                cos, sin = (to_x - x) / metres, (to_y - y) / metres
                speed = wanted
                where = count
                if math.hypot(wanted * cos - to_vx, wanted * sin - to_vy) > min(100.0 * rate[last], BALL_PUSH_MAX):
                    speed = fastest(cos, sin, rate[last], to_vx, to_vy)
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
        value = _judged(wish, speeds[index], powers[index], kicks[index], threats[index])
        if value > best:
            best, chosen = value, index
    if chosen < 0:
        return 0.0, 0.0, 0.0
    return speeds[chosen], velocity[chosen, 0], velocity[chosen, 1]
