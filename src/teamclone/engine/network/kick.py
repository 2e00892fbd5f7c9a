"""Kicks and tackles: the velocity that the ball is to have, from which physics gives power and direction."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from teamclone.engine.inputs.layout import GEOMETRY, MATES, OTHER, OTHERS
from teamclone.engine.network.candidates import beside_actor, fill_candidates, run_m
from teamclone.engine.network.constants import (
    AHEAD_M,
    BALL_COMPONENTS,
    CANDIDATE_COLUMNS,
    CANDIDATE_REACH,
    DRIBBLES,
    IMPOSSIBLE,
    LEAD_M,
    LEAST_ANGLE,
    LEAST_GAIN,
    LEAST_POWER,
    MOST_KICK,
    N_CANDIDATES,
    N_COMPONENTS,
    PASSES,
    PASSES_TO_EACH,
    SHOT_YS,
    TARGETS,
    TOUCH_M,
    TYPICAL_KICK_ANGLE,
    TYPICAL_KICK_POWER,
    USUAL_ERROR,
)
from teamclone.engine.network.layers import Member, add_softmax, biases_of, layer, scale_of, sigmoid, softmax, stack
from teamclone.engine.network.players import PLACES, encode
from teamclone.engine.network.result import Answer
from teamclone.engine.network.spec import (
    ATTENTION,
    CANDIDATE,
    CANDIDATE_BETWEEN,
    CANDIDATE_SCORE,
    CANDIDATE_SITUATION,
    CANDIDATE_TARGET,
    CANDIDATES,
    GEOMETRY_AT,
    KICK,
    KICK_DEPTH,
    KICK_STACK,
    KICK_TARGET,
    KICKED,
    KICKED_AT,
    MEMBERS,
    N_KICK,
    OTHERS_AT,
    PLANNED,
    SIGNS,
    TACKLE_AT,
    TACKLE_CLASS,
    TACKLE_TRUST,
    WAY_ERROR,
    WAY_SHARE,
    WAYS_AT,
    Floats,
)
from teamclone.planner.columns import WAYS
from teamclone.planner.scene import roll
from teamclone.planner.tackle import DIRECTIONS as TACKLE_DIRECTIONS
from teamclone.rcss import pitch
from teamclone.system.compiling import kernel

(_COS, _SIN, _BALL_X, _BALL_Y, _BALL_VX, _BALL_VY, _GAIN, _BALL_DECAY, _SPEED_MAX, _MATE) = (
    GEOMETRY.index(name) for name in (
        "cos", "sin", "ball_x", "ball_y", "ball_vx", "ball_vy", "kick_gain", "ball_decay", "ball_speed_max",
        "mate_0_x"))  # fmt: skip
_AIMED = TARGETS + BALL_COMPONENTS
"""Components that aim at a place; the others are dribbles."""
_GOAL_X = pitch.HALF_LENGTH
_WAYS = len(WAYS)


@kernel
def kick_for(vx: float, vy: float, geometry: Floats) -> tuple[float, float]:
    """Return power and direction, radians from the body, of the kick that gives the ball a velocity."""
    cos, sin = float(geometry[_COS]), float(geometry[_SIN])
    x, y = vx - float(geometry[_BALL_VX]), vy - float(geometry[_BALL_VY])
    power = math.sqrt(x * x + y * y + 1e-6) / max(float(geometry[_GAIN]), LEAST_GAIN)
    return min(power, MOST_KICK), math.atan2(y * cos - x * sin, x * cos + y * sin)


@kernel
def _aimed(index: int, ahead: float, aside: float, speed: float, geometry: Floats) -> tuple[float, float]:
    """Return the velocity towards a place near a team mate, the goal or the ball."""
    ball_x, ball_y = float(geometry[_BALL_X]), float(geometry[_BALL_Y])
    x, y = ball_x, ball_y
    if index < MATES:
        x, y = float(geometry[_MATE + 2 * index]), float(geometry[_MATE + 2 * index + 1])
    elif index == MATES:
        x, y = _GOAL_X, 0.0
    x, y = x + LEAD_M * ahead - ball_x, y + LEAD_M * aside - ball_y
    factor = float(geometry[_SPEED_MAX]) * sigmoid(speed) / math.sqrt(x * x + y * y + 1e-6)
    return x * factor, y * factor


@kernel
def _dribbled(cycles: int, ahead: float, aside: float, geometry: Floats) -> tuple[float, float]:
    """Return the velocity of a dribble: after a kick and dashes straight on the ball is in front of the actor."""
    ahead, aside = run_m(cycles, geometry) + AHEAD_M + TOUCH_M * ahead, TOUCH_M * aside
    x, y = beside_actor(ahead, aside, cycles, geometry)
    rolled = roll(cycles, float(geometry[_BALL_DECAY]))
    return (x - float(geometry[_BALL_X])) / rolled, (y - float(geometry[_BALL_Y])) / rolled


class Side(NamedTuple):
    """A situation, or its mirror image, and where its components go.

    Attributes:
        geometry: (len(GEOMETRY),). logits: (components,) to be filled. first: place of its first component in the
            answer. mirror: -1 for the mirror image, else 1.
    """

    geometry: Floats
    logits: Floats
    first: int
    mirror: float


@kernel
def _fill_free(raw: Floats, side: Side, made: Answer) -> None:
    """Fill the components whose targets the network chooses.

    Args:
        raw: (6 * N_COMPONENTS,) logits, metres ahead and aside, speed, scales of power and direction.
    """
    geometry = side.geometry
    for index in range(N_COMPONENTS):
        ahead, aside = float(raw[N_COMPONENTS + index]), float(raw[2 * N_COMPONENTS + index])
        side.logits[index] = raw[index]
        if index < _AIMED:
            vx, vy = _aimed(index, ahead, aside, float(raw[3 * N_COMPONENTS + index]), geometry)
        else:
            vx, vy = _dribbled(DRIBBLES[index - _AIMED], ahead, aside, geometry)
        power, angle = kick_for(vx, vy, geometry)
        at = side.first + index
        made.kick_power.centre[at], made.kick_direction.centre[at] = power, angle * side.mirror
        power_scale, angle_scale = float(raw[4 * N_COMPONENTS + index]), float(raw[5 * N_COMPONENTS + index])
        made.kick_power.scale[at] = scale_of(power_scale, LEAST_POWER, TYPICAL_KICK_POWER)
        made.kick_direction.scale[at] = scale_of(angle_scale, LEAST_ANGLE, TYPICAL_KICK_ANGLE)


@kernel
def _fill_planned(share: Floats, error: Floats, ways: Floats, side: Side, made: Answer) -> None:
    """Fill the components of planned kicks, one for each way.

    Args:
        share: (len(WAYS),) logits. error: (len(WAYS),) logarithm of the errors of the ball's velocity, in USUAL_ERROR.
        ways: (3 * len(WAYS),) of each whether it is there, and the velocity of the ball.
    """
    geometry = side.geometry
    gain = max(float(geometry[_GAIN]), LEAST_GAIN)
    for way in range(_WAYS):
        at = side.first + N_COMPONENTS + way
        power, angle = kick_for(float(ways[3 * way + 1]), float(ways[3 * way + 2]), geometry)
        miss = USUAL_ERROR * math.exp(float(error[way]))
        side.logits[N_COMPONENTS + way] = share[way] if ways[3 * way] > 0 else IMPOSSIBLE
        made.kick_power.centre[at], made.kick_direction.centre[at] = power, angle * side.mirror
        made.kick_power.scale[at] = LEAST_POWER + miss / gain
        made.kick_direction.scale[at] = LEAST_ANGLE + miss / (gain * power)


@kernel
def _fill_candidates(of: Member, others: Floats, seen: tuple[Floats, Floats], side: Side, made: Answer) -> None:
    """Fill the components of candidates.

    Args:
        others: (OTHERS * len(OTHER),). seen: features of kicks, and the embedding of each place, if there are any.
    """
    spec, geometry = of.spec, side.geometry
    hidden, each = seen
    width = spec[CANDIDATES]
    wanted = np.empty(3 * N_CANDIDATES, np.float32)
    columns = np.empty((N_CANDIDATES, CANDIDATE_COLUMNS), np.float32)
    fill_candidates(geometry, others, wanted, columns)
    everywhere, one, two = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    score = np.empty(5, np.float32)
    of_target = np.zeros((TARGETS, width), np.float32)
    layer(of, spec[CANDIDATE_SITUATION], hidden, everywhere)
    if spec[ATTENTION] > 0:
        for target in range(TARGETS):
            layer(of, spec[CANDIDATE_TARGET], each[target if target < MATES else OTHERS], of_target[target])
    first = N_COMPONENTS + _WAYS * spec[PLANNED]
    for index in range(N_CANDIDATES):
        at = side.first + first + index
        layer(of, spec[CANDIDATE], columns[index], one)
        target = index // PASSES_TO_EACH if index < PASSES else MATES
        known = index < PASSES + len(SHOT_YS)
        for unit in range(width):
            value = one[unit] + everywhere[unit]
            if known:
                value += of_target[target, unit]
            one[unit] = max(value, np.float32(0.0))
        layer(of, spec[CANDIDATE_BETWEEN], one, two)
        layer(of, spec[CANDIDATE_SCORE], two, score)
        vx, vy = float(wanted[3 * index + 1]), float(wanted[3 * index + 2])
        speed = math.sqrt(vx * vx + vy * vy + 1e-6)
        along, across = CANDIDATE_REACH * float(score[1]) / speed, CANDIDATE_REACH * float(score[2]) / speed
        power, angle = kick_for(vx + along * vx - across * vy, vy + along * vy + across * vx, geometry)
        side.logits[first + index] = score[0] if wanted[3 * index] > 0 else IMPOSSIBLE
        made.kick_power.centre[at], made.kick_direction.centre[at] = power, angle * side.mirror
        made.kick_power.scale[at] = scale_of(float(score[3]), LEAST_POWER, TYPICAL_KICK_POWER)
        made.kick_direction.scale[at] = scale_of(float(score[4]), LEAST_ANGLE, TYPICAL_KICK_ANGLE)


@kernel
def class_of(degrees: float, count: int) -> int:
    """Return the nearest of ``count`` directions, the first of them straight ahead; 0 for what is no number."""
    return round(degrees * (count / 360.0)) % count if abs(degrees) < 1e9 else 0


@kernel
def _fill_side(of: Member, x: Floats, mirror: float, made: Answer) -> None:
    """Fill one answer on kicks and tackles: from the situation, or from its mirror image mirrored back.

    Args:
        x: (INPUTS,) normalised, mirrored already. mirror: -1 for the mirror image, else 1.
    """
    spec = of.spec
    width, at_geometry = spec[ATTENTION], spec[GEOMETRY_AT]
    geometry = x[at_geometry : at_geometry + len(GEOMETRY)]
    kicked = np.empty(spec[KICKED], np.float32)
    for index in range(spec[KICKED]):
        kicked[index] = x[spec[spec[KICKED_AT] + index]]
    found = stack(of, spec[KICK_STACK], spec[KICK_DEPTH], kicked)
    hidden, each = np.empty(len(found) + width, np.float32), np.empty((PLACES, width), np.float32)
    hidden[: len(found)] = found
    if width > 0:
        at = spec[OTHERS_AT]
        encode(of, x[at : at + OTHERS * len(OTHER)], geometry, found, each)
        together = hidden[len(found) :]
        together[:] = 0
        for place in range(PLACES):
            for index in range(width):
                together[index] += each[place, index]
        for index in range(width):
            together[index] /= np.float32(PLACES)

    raw = np.empty(6 * N_COMPONENTS, np.float32)
    layer(of, spec[KICK], hidden, raw)
    if width > 0:
        aim = np.empty(6, np.float32)
        for target in range(TARGETS):
            layer(of, spec[KICK_TARGET], each[target if target < MATES else OTHERS], aim)
            for index in range(6):
                raw[index * N_COMPONENTS + target] += aim[index]
    components = spec[N_KICK] // (2 * spec[MEMBERS])
    first = (2 * of.number + (mirror < 0)) * components
    logits, tackle = np.empty(components, np.float32), np.empty(TACKLE_DIRECTIONS, np.float32)
    side = Side(geometry, logits, first, mirror)
    _fill_free(raw, side, made)
    layer(of, spec[TACKLE_CLASS], hidden, tackle)
    if spec[PLANNED] > 0:
        share, trust = np.empty(_WAYS, np.float32), np.empty(1, np.float32)
        layer(of, spec[WAY_SHARE], hidden, share)
        at = spec[WAYS_AT]
        error = biases_of(of, spec[WAY_ERROR])
        _fill_planned(share, error, x[at : at + 3 * _WAYS], side, made)
        layer(of, spec[TACKLE_TRUST], hidden, trust)
        at = spec[TACKLE_AT]
        tackle[class_of(float(x[at + 1]), TACKLE_DIRECTIONS)] += x[at] * trust[0]
    if spec[CANDIDATES] > 0:
        at = spec[OTHERS_AT]
        _fill_candidates(of, x[at : at + OTHERS * len(OTHER)], (hidden, each), side, made)
    part = 0.5 / spec[MEMBERS]
    softmax(logits, part, made.kick_power.share[first : first + components])
    if mirror < 0:  # class k lies at k steps, its mirror at -k
        for index in range(1, TACKLE_DIRECTIONS // 2):
            other = TACKLE_DIRECTIONS - index
            tackle[index], tackle[other] = tackle[other], tackle[index]
    add_softmax(tackle, part, made.tackle)


@kernel
def fill_kicks(of: Member, x: Floats, made: Answer) -> None:
    """Fill what a member answers on kicks and tackles.

    Args:
        x: (INPUTS,) normalised. made: with a tackle of zeros before the first member.
    """
    signs = of.values[of.spec[SIGNS] :]
    mirrored = np.empty(len(x), np.float32)
    for index in range(len(x)):
        mirrored[index] = x[index] * signs[index]
    _fill_side(of, x, 1.0, made)
    _fill_side(of, mirrored, -1.0, made)
