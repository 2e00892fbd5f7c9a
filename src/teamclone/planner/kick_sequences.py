"""Kicks towards a place: one, or several that first bring the ball to where the last one is harder.

A sequence is a way through stages: the ball where it is, then up to two places around the player, one for each kick
before the last. All sequences are one table: the speed they give, the power of the last kick, and the perils on their
way. The one that is worth most is chosen.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.planner.ball import aim_error, fastest, kick_limits, kick_noise, kick_rate, kick_to, most_acceleration
from teamclone.planner.motion import beside
from teamclone.planner.players import Bearing, bearing, pose_after, tackle_chance
from teamclone.planner.scene import (
    ACTOR,
    AREA,
    BALL,
    BALL_DECAY,
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
    turned,
)
from teamclone.rcss.player_types import DEFAULTS
from teamclone.rcss.server_params import SERVER_DEFAULTS, SERVER_FIELD
from teamclone.system.compiling import kernel

Ints = NDArray[np.int64]

RING_PARTS, COUNTS = (0.3, 0.5, 0.7), (12, 15, 20)
"""Rings around the player, parts of the margin, and how many places on each, evenly, the first right behind."""
PLACES = sum(COUNTS)
PLACE_PART = np.repeat(RING_PARTS, COUNTS)
PLACE_DEG = np.concatenate([360.0 / count * np.arange(count) - 180.0 for count in COUNTS])
"""(PLACES,) of each place the ring and the degrees from the body."""
OFF_M, WITHIN_M = 0.1, 0.2
"""Metres by which a place is at least beyond touch, and within reach."""
DIRECTIONS, PAIRS = 72, 1024
"""Directions of the last kick of three, and how many pairs of places before it are tried."""
ORDER_FIELDS = tuple(SERVER_FIELD[name] for name in ("ball_size", "maxpower", "ball_accel_max", "ball_speed_max"))
"""Columns of the server that `kick_order` goes by."""
DEFAULT_RULES = tuple(SERVER_DEFAULTS[list(ORDER_FIELDS)].tolist())
"""Their values on a server that nobody has changed."""
THIN_M, ALIKE = 0.1, 1e-3
"""Metres by which the rings of the order have a smaller margin; speeds so near to each other count as one there."""
SECOND_PART = 0.9
"""Part of a place's kick rate that the second of three kicks is planned with."""
ROOM_M = 0.05, 0.1
"""Metres that the error of the first of two and of three kicks leaves within reach; else the ball may be missed."""
ENOUGH = 11
"""Sequences of three kicks with the wanted speed after which no more are tried."""

NEAR_M = 10.0
"""Opponents further from the ball are ignored."""
LOST, TACKLED, SOON_TACKLED, SOON_LOST, CUT_OFF, MAYBE_CUT_OFF, OUTSIDE, MISSED = (1 << bit for bit in range(8))
"""Perils of a ball in a place, of one that is kicked on from there, and of the way to it."""
NEVER = OUTSIDE | LOST | CUT_OFF
RISKS = TACKLED | SOON_TACKLED | SOON_LOST | MAYBE_CUT_OFF
"""Perils that exclude a sequence; and those that do so as long as one without them is fast enough."""
_PRICES = {TACKLED: 0.5, SOON_TACKLED: 0.3, SOON_LOST: 0.6, MAYBE_CUT_OFF: 0.25, MISSED: 0.03}
_LESS = {MAYBE_CUT_OFF: 0.05}
"""What perils take of a sequence's worth, and what of that several kicks are spared."""
PRICE = np.array(
    [[sum(cost for peril, cost in _PRICES.items() if perils & peril) for perils in range(256)],
     [sum(cost - _LESS.get(peril, 0.0) for peril, cost in _PRICES.items() if perils & peril) for perils in range(256)]]
)  # fmt: skip
"""(2, 256) what all perils together take, of one kick and of several."""
KICKS_PRICE = np.array([0.0, 0.05, 0.2])
"""What the number of kicks takes."""
HARD_POWERS, HARD_PRICES = np.array([90.0, 94.0]), np.array([0.0, 0.025, 0.075])
POWER_PRICE = 0.0005
"""What a last kick of several takes that is above so much power; and what any last kick takes per unit of it."""
SHORT_PRICE = 0.05
TOO_SLOW, SLOWER = 11.0, 100.0
"""What a single kick takes that falls short of the wanted speed but will do; and what falling short takes otherwise,
at all and per metre per cycle."""


class Target(NamedTuple):
    """Where the ball is to go, metres, with what speed, and above which one it will do, metres per cycle."""

    x: float
    y: float
    speed: float
    enough: float


class Alarm(NamedTuple):
    """How near an opponent has to be to a ball to count as a peril, and what perils these are.

    Attributes:
        touch_m: metres beyond its reach within which it has the ball without a dash.
        dash: part of its full dash that it has. short_m: metres by which its reach is shorter after that.
        tackle_m: metres by which its tackle is shorter after a dash. tackle_part: part of the tackle's width left then.
        tackle_back_m: metres behind it up to which it tackles after a dash.
        chance: of a tackle without a dash, above which it counts. exponent: column of the server for that chance.
        taken, tackled, dashed, dash_tackled: perils that are found.
    """

    touch_m: float
    dash: float
    short_m: float
    tackle_m: float
    tackle_part: float
    tackle_back_m: float
    chance: float
    exponent: int
    taken: int
    tackled: int
    dashed: int
    dash_tackled: int


LIES = Alarm(0.15, 1.0, 0.0, 0.3, 0.7, 0.0, 0.7, FOUL_EXPONENT, LOST, TACKLED, SOON_LOST, SOON_TACKLED)
ROLLS = Alarm(0.1, 0.8, 0.15, 0.5, 0.7, math.inf, 0.8, TACKLE_EXPONENT, CUT_OFF, *[MAYBE_CUT_OFF] * 3)
"""Of a ball beside the player, and of one that is kicked on."""


class Stages(NamedTuple):
    """Where the ball may be after 0, 1 and 2 kicks; after none there is a single place, the first.

    Attributes:
        place: (3, PLACES, 2) metres. gain: (3, PLACES) metres per cycle that a unit of power gives a ball there.
        lies, rolls: (3, PLACES) perils of the ball there, and one cycle after it is kicked on from there.
        sent: (PLACES, 2) velocity that brings the ball to the places of the first kick, metres per cycle.
        opens: (PLACES,) whether one kick can give it. missed: (PLACES,) metres by which the ball may then be out of
            reach.
    """

    place: Array
    gain: Array
    lies: Ints
    rolls: Ints
    sent: Array
    opens: NDArray[np.bool_]
    missed: Array


def kick_order(server: tuple[float, ...]) -> Ints:
    """Return (DIRECTIONS, PAIRS, 2) pairs of places before a kick in each direction from the body.

    Those come first from which it is fastest, of a player of the default type with a ball that comes straight from one
    place to the other; among those that are alike the ones with less power.

    Args:
        server: the values of ORDER_FIELDS.
    """
    ball_size, power, accel_max, speed_max = server
    touch, margin = DEFAULTS["player_size"] + ball_size, DEFAULTS["kickable_margin"]
    radius = np.clip(touch + (margin - THIN_M) * PLACE_PART, touch + OFF_M, touch + margin - WITHIN_M)
    angle = np.radians(PLACE_DEG)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    rate = formulas.kick_rate(
        radius,
        angle,
        ball_size=ball_size,
        **{name: DEFAULTS[name] for name in ("kick_power_rate", "player_size", "kickable_margin")},
    )
    velocity = (x - x[:, None]).ravel(), (y - y[:, None]).ravel()
    rate = np.tile(rate, PLACES)
    toward = np.radians(360.0 / DIRECTIONS * np.arange(DIRECTIONS) - 180.0)[:, None]
    toward_x, toward_y = np.cos(toward), np.sin(toward)
    speed = formulas.fastest(
        velocity, (toward_x, toward_y), most_added=np.minimum(power * rate, accel_max), ball_speed_max=speed_max
    )
    spent = np.hypot(speed * toward_x - velocity[0], speed * toward_y - velocity[1]) / rate
    pairs = np.lexsort((spent, -np.rint(speed / ALIKE)))[:, :PAIRS]
    return np.stack(np.divmod(pairs, PLACES), axis=-1)


@kernel
def _peril(server: Array, player: Array, ball: Bearing, alarm: Alarm) -> int:
    """Return the perils that one opponent is to a ball."""
    lying = player[FROZEN] > 0
    taken = ball.metres < (player[TOUCH] if lying else ball.reach + alarm.touch_m)
    if taken or lying:
        return alarm.taken * taken
    dash_m, aside = alarm.dash * player[DASH_ACCEL], abs(ball.aside)
    left = max(0.0, abs(ball.ahead) - dash_m)
    runs_over = (left == 0.0) & (aside < ball.reach)
    dashed = runs_over | (math.hypot(left, aside) < ball.reach - alarm.short_m)
    in_length = (-alarm.tackle_back_m < ball.ahead) & (ball.ahead < dash_m + server[TACKLE_DIST] - alarm.tackle_m)
    dash_tackled = in_length & (aside < alarm.tackle_part * server[TACKLE_WIDTH]) & (not dashed)
    tackled = tackle_chance(server, ball.ahead, ball.aside, server[alarm.exponent]) > alarm.chance
    return alarm.dashed * dashed | alarm.dash_tackled * dash_tackled | alarm.tackled * tackled


@kernel
def _perils(scene: Array, place: Array, cycle: int, alarm: Alarm, found: Ints) -> None:
    """Add to ``found`` (n,) the perils of balls that are in places (n, 2) after so many cycles."""
    ball = scene[BALL]
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if gap(player[X], player[Y], ball[X], ball[Y]) <= NEAR_M:
            pose = pose_after(player, cycle)
            for index in range(len(place)):
                lies = bearing(player, pose, place[index, 0], place[index, 1])
                found[index] |= _peril(scene[SERVER], player, lies, alarm)


@kernel
def _kicked_on(place: Array, target: Target) -> Array:
    """Return (n, 2) where balls are one cycle after they are kicked on from places (n, 2)."""
    onward = np.empty_like(place)
    for index in range(len(place)):
        x, y = target.x - place[index, 0], target.y - place[index, 1]
        part = target.speed / math.hypot(x, y)
        onward[index, 0], onward[index, 1] = place[index, 0] + part * x, place[index, 1] + part * y
    return onward


@kernel
def _stages(scene: Array, target: Target) -> Stages:
    """Return where the ball may be before each kick."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    place, gain = np.empty((3, PLACES, 2)), np.empty((3, PLACES))
    lies, rolls = np.zeros((3, PLACES), np.int64), np.zeros((3, PLACES), np.int64)
    sent, opens, missed = np.empty((PLACES, 2)), np.empty(PLACES, np.bool_), np.empty(PLACES)
    place[0, 0, 0], place[0, 0, 1], gain[0, 0] = ball[X], ball[Y], ball[GAIN]
    noise = kick_noise(scene)
    for index in range(PLACES):
        metres = min(max(me[TOUCH] + OFF_M, me[TOUCH] + me[MARGIN] * PLACE_PART[index]), me[AREA] - WITHIN_M)
        for stage in range(1, 3):
            x, y = beside(me, stage, metres, me[BODY] + PLACE_DEG[index])
            place[stage, index, 0], place[stage, index, 1] = x, y
            lies[stage, index] = OUTSIDE if abs(x) > GOAL_X or abs(y) > LINE_Y else 0
            gain[stage, index] = kick_rate(me, metres, PLACE_DEG[index])
        vx, vy, added = kick_to(ball, (place[1, index, 0], place[1, index, 1]))
        sent[index, 0], sent[index, 1] = vx, vy
        opens[index] = added <= most_acceleration(server, ball[GAIN])
        missed[index] = metres + aim_error(scene, noise, math.hypot(vx, vy), added) - me[AREA]
    for stage in range(3):
        places = place[stage, : PLACES if stage else 1]
        _perils(scene, places, 1, LIES, lies[stage])
        _perils(scene, _kicked_on(places, target), stage + 1, ROLLS, rolls[stage])
    return Stages(place, gain, lies, rolls, sent, opens, missed)


@kernel
def _comes(server: Array, stages: Stages, kicks: int, first: int, last: int) -> tuple[bool, float, float]:
    """Return whether the kicks before the last can bring the ball to its place, and its velocity there.

    Args:
        kicks: 2 or 3. first, last: places after the first kick, and before the last; of two kicks they are one.
    """
    decay, vx, vy = server[BALL_DECAY], stages.sent[first, 0], stages.sent[first, 1]
    if kicks == 2:
        return stages.opens[first], decay * vx, decay * vy
    on_x = stages.place[2, last, 0] - stages.place[1, first, 0]
    on_y = stages.place[2, last, 1] - stages.place[1, first, 1]
    added = gap(on_x, on_y, decay * vx, decay * vy)
    turns = added <= most_acceleration(server, SECOND_PART * stages.gain[1, first])
    return stages.opens[first] & turns, decay * on_x, decay * on_y


@kernel
def _last_kick(
    server: Array, place: Array, gain: float, came: tuple[float, float], target: Target
) -> tuple[float, float]:
    """Return the speed towards the target that a kick gives, at most the wanted one, and its power.

    Args:
        place: (2,) of the ball. came: its velocity before.
    """
    x, y = target.x - place[0], target.y - place[1]
    metres = math.hypot(x, y)
    x, y, speed = x / metres, y / metres, target.speed
    limits = kick_limits(server, gain)
    if gap(speed * x, speed * y, came[0], came[1]) > limits[0]:
        speed = fastest(limits, (x, y), came)
    return speed, gap(speed * x, speed * y, came[0], came[1]) / gain


@kernel
def _worth(target: Target, kicks: int, speed: float, power: float, perils: int) -> float:
    """Return what a sequence is worth, at most 1."""
    short, several = max(0.0, target.speed - speed), kicks > 1
    will_do = (short == 0.0) | ((not several) & (speed >= target.enough))
    slow = SHORT_PRICE * (short > 0.0) if will_do else TOO_SLOW + SLOWER * short
    hard = several * HARD_PRICES[np.searchsorted(HARD_POWERS, power)]
    return 1.0 - slow - hard - KICKS_PRICE[kicks - 1] - PRICE[int(several), perils] - POWER_PRICE * power


class Sequences(NamedTuple):
    """All sequences of kicks: the single kick, two kicks by each place, three kicks by each pair of places.

    Attributes:
        kicks: (n,) 1, 2 or 3. first: (n,) place to which the first of several kicks brings the ball.
        speed, power: (n,) of the last kick, metres per cycle and units; a speed of 0 where a kick cannot be given.
        perils: (n,) of the ball on its way, without those of where it is now for several kicks.
    """

    kicks: Ints
    first: Ints
    speed: Array
    power: Array
    perils: Ints


@kernel
def _sequences(scene: Array, stages: Stages, target: Target, pairs: Ints) -> Sequences:
    """Return all sequences.

    Args:
        pairs: (PAIRS, 2) places to which the first and the second of three kicks bring the ball.
    """
    server, ball = scene[SERVER], scene[BALL]
    kicks = np.repeat(np.array([1, 2, 3]), np.array([1, PLACES, len(pairs)]))
    first = np.concatenate((np.zeros(1, np.int64), np.arange(PLACES), pairs[:, 0]))
    last = np.concatenate((np.zeros(1, np.int64), np.arange(PLACES), pairs[:, 1]))
    speed, power, perils = np.zeros(len(kicks)), np.zeros(len(kicks)), np.zeros(len(kicks), np.int64)
    for row in range(len(kicks)):
        stage, place = kicks[row] - 1, last[row]
        perils[row] = stages.lies[stage, place] | stages.rolls[stage, place]
        if stage == 2:
            perils[row] |= stages.lies[1, first[row]] | (stages.rolls[1, first[row]] & ~CUT_OFF)
        possible, vx, vy = True, ball[VX], ball[VY]
        if stage > 0:
            if perils[row] & NEVER:
                continue
            possible, vx, vy = _comes(server, stages, stage + 1, first[row], place)
        if possible:
            gain = stages.gain[stage, place]
            speed[row], power[row] = _last_kick(server, stages.place[stage, place], gain, (vx, vy), target)
    return Sequences(kicks, first, speed, power, perils)


@kernel
def _two_kicks(speed: Array, wanted: float) -> Ints:
    """Return the indices of the sequences of two kicks that count, in order.

    All that have the wanted speed do. Of the others those that are faster than all others before them; from the second
    of these on, each one takes the place of the index before it.
    """
    short = np.flatnonzero((speed > 0.0) & (speed < wanted))
    most = np.zeros(len(short) + 1)
    for place, index in enumerate(short):
        most[place + 1] = max(most[place], speed[index])
    short = short[most[1:] > most[:-1]]
    counts, takes = speed >= wanted, np.zeros(len(speed) + 1, np.bool_)
    counts[short], takes[short[1:]] = True, True
    indices = np.flatnonzero(counts)
    following = np.append(indices, len(speed))[1:]
    return indices[~takes[following]]


@kernel
def _three_kicks(speed: Array, wanted: float) -> tuple[Ints, Ints]:
    """Return the indices of the sequences of three kicks that count, in order.

    Returns:
        The fastest before the first that has the wanted speed, if any; and at most ENOUGH that have it.
    """
    full = np.flatnonzero(speed >= wanted)
    before = speed[: full[0]] if len(full) > 0 else speed
    short = np.flatnonzero(before == before.max())[:1] if before.any() else full[:0]
    return short, full[:ENOUGH]


@kernel
def _counting(rows: Ints, table: Sequences, wanted: float, barred: int) -> Ints:
    """Return rows of the table, and after them those of several kicks that no barred peril excludes and that count.

    A sequence of three kicks that falls short takes the place of the row before it.
    """
    speed = np.where(table.perils & barred, 0.0, table.speed)
    rows = np.concatenate((rows, 1 + _two_kicks(speed[1 : 1 + PLACES], wanted)))
    short, full = _three_kicks(speed[1 + PLACES :], wanted)
    return np.concatenate((rows[: max(0, len(rows) - len(short))], 1 + PLACES + short, 1 + PLACES + full))


@kernel
def cut_off(scene: Array, target: Target) -> bool:
    """Return whether an opponent has the ball in the cycle after it is kicked towards a target."""
    perils = np.zeros(1, np.int64)
    _perils(scene, _kicked_on(scene[BALL, X : Y + 1].copy().reshape(1, 2), target), 1, ROLLS, perils)
    return perils[0] & CUT_OFF > 0


@kernel
def best_sequence(scene: Array, order: Ints, target: Target) -> tuple[float, float, float]:
    """Return the speed that the best of all sequences gives the ball, and its velocity after the first kick.

    All in metres per cycle, all 0 where no sequence is possible. Risks are taken only where nothing else is fast
    enough.

    Args:
        order: see `kick_order`.
    """
    me, ball = scene[ACTOR], scene[BALL]
    facing = turned(direction(target.x - me[X], target.y - me[Y]) - me[BODY])
    pairs = order[int(np.rint(DIRECTIONS * (facing + 180.0) / 360.0)) % DIRECTIONS]
    stages = _stages(scene, target)
    table = _sequences(scene, stages, target, pairs)
    single = np.zeros(0 if table.perils[0] & CUT_OFF else 1, np.int64)
    rows = _counting(single, table, target.speed, NEVER | RISKS)
    if not (table.speed[rows] > target.enough).any():
        rows = _counting(rows, table, target.speed, NEVER)
    begun = table.perils[0] & ~CUT_OFF
    best, most = -1, -np.inf
    for row in rows:
        kicks, speed, perils = table.kicks[row], table.speed[row], table.perils[row]
        if kicks > 1:
            perils |= begun
            if speed >= target.speed and stages.missed[table.first[row]] > -ROOM_M[kicks - 2]:
                perils |= MISSED
        worth = _worth(target, kicks, speed, table.power[row], perils)
        if worth > most:
            best, most = row, worth
    if best < 0:
        return 0.0, 0.0, 0.0
    speed, first = table.speed[best], table.first[best]
    if table.kicks[best] > 1:
        return speed, stages.sent[first, 0], stages.sent[first, 1]
    part = speed / gap(target.x, target.y, ball[X], ball[Y])
    return speed, part * (target.x - ball[X]), part * (target.y - ball[Y])
