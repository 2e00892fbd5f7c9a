"""The heads: from the features of a situation to values, or to a distribution, of each parameter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.inputs.layout import GEOMETRY
from teamclone.engine.network.constants import (
    CATCH_DIRECTIONS,
    CATCH_LIMIT_DEG,
    DASH_REACH,
    DEGREE,
    FREE_COMPONENTS,
    FREE_HALF_TURNS,
    INCOMES,
    LEAST_ANGLE,
    LEAST_PLACE,
    LEAST_POWER,
    MOVE_PLACES,
    MOVE_REACH_M,
    TURN_REACH,
    TYPICAL_DASH,
    TYPICAL_PLACE,
    TYPICAL_TURN,
)
from teamclone.engine.network.layers import (
    PI,
    TURN_AROUND,
    Member,
    add_softmax,
    biases_of,
    clamp,
    direction_of,
    layer,
    medoid,
    medoid_place,
    row_of,
    scale_of,
    softmax,
    wrap,
)
from teamclone.engine.network.result import Answer
from teamclone.engine.network.spec import (
    ARGUMENTS_AT,
    CATCH_CLASS,
    CATCH_EDGES,
    CATCH_SHARPNESS,
    DASH,
    INCOME,
    LIMITS,
    MEMBERS,
    MOVE_PLACE,
    N_CATCH,
    N_MOVE,
    PARAMETERS,
    POWER,
    TARGET_POINTS,
    TURN,
    Floats,
    Ints,
)
from teamclone.engine.network.targets import BEARING, DASH_POWER
from teamclone.rcss import pitch
from teamclone.system.compiling import kernel

(_X, _Y, _COS, _SIN, _BALL_X, _BALL_Y, _INCOME, _TO_BALL, _TO_MEET) = (
    GEOMETRY.index(name)
    for name in ("x", "y", "cos", "sin", "ball_x", "ball_y", "income", "turn_to_ball", "turn_to_meet")
)
_MOVES = len(MOVE_PLACES)


@kernel
def _fill_dash(of: Member, found: Floats, geometry: Floats, aims: NDArray[np.float32], made: Answer) -> None:
    spec = of.spec
    targets, members = spec[TARGET_POINTS], spec[MEMBERS]
    n = targets + INCOMES + FREE_COMPONENTS
    raw = np.empty(row_of(spec, spec[DASH])[2], np.float32)
    layer(of, spec[DASH], found, raw)
    incomes, free = biases_of(of, spec[INCOME]), biases_of(of, spec[POWER])
    first = of.number * n
    for index in range(n):
        if index < targets:
            wanted = clamp(float(aims[DASH_POWER, index]), -20.0, 120.0)
        elif index < targets + INCOMES:
            wanted = float(geometry[_INCOME]) * float(incomes[index - targets])
        else:
            wanted = float(free[index - targets - INCOMES])
        made.dash_power.centre[first + index] = wanted + DASH_REACH * float(raw[n + index])
        made.dash_power.scale[first + index] = scale_of(float(raw[2 * n + index]), LEAST_POWER, TYPICAL_DASH)
    softmax(raw[:n], 1.0 / members, made.dash_power.share[first : first + n])
    add_softmax(raw[3 * n :], 1.0 / members, made.dash_direction)


@kernel
def _fill_turn(of: Member, found: Floats, geometry: Floats, aims: NDArray[np.float32], made: Answer) -> None:
    spec = of.spec
    targets = spec[TARGET_POINTS]
    n = targets + 2 + FREE_COMPONENTS
    raw = np.empty(row_of(spec, spec[TURN])[2], np.float32)
    layer(of, spec[TURN], found, raw)
    first = of.number * n
    for index in range(n):
        reach = TURN_REACH
        if index < 2:
            centre = float(geometry[_TO_BALL if index == 0 else _TO_MEET])
        elif index < 2 + targets:
            centre = float(aims[BEARING, index - 2])
        else:  # only the free ones go far from where they begin
            centre = FREE_HALF_TURNS * PI * (2.0 * (index - 2 - targets) / (FREE_COMPONENTS - 1) - 1.0)
            reach = 1.0
        made.turn.centre[first + index] = wrap(centre + reach * float(raw[n + index]))
        made.turn.scale[first + index] = scale_of(float(raw[2 * n + index]), LEAST_ANGLE, TYPICAL_TURN)
    softmax(raw[:n], 1.0 / spec[MEMBERS], made.turn.share[first : first + n])


@kernel
def _fill_catch(of: Member, found: Floats, geometry: Floats, made: Answer) -> None:
    """Fill the direction: a catch has the ball at an edge of the catch area, not in its middle."""
    spec = of.spec
    raw = np.empty(CATCH_DIRECTIONS, np.float32)
    layer(of, spec[CATCH_CLASS], found, raw)
    cos, sin = float(geometry[_COS]), float(geometry[_SIN])
    x, y = float(geometry[_BALL_X]) - float(geometry[_X]), float(geometry[_BALL_Y]) - float(geometry[_Y])
    to_ball, most = math.atan2(y * cos - x * sin, x * cos + y * sin), CATCH_LIMIT_DEG * DEGREE
    edges = biases_of(of, spec[CATCH_EDGES])
    one = clamp(wrap(to_ball + float(edges[0])), -most, most)
    two = clamp(wrap(to_ball + float(edges[1])), -most, most)
    sharpness = math.exp(float(biases_of(of, spec[CATCH_SHARPNESS])[0]))
    for index in range(CATCH_DIRECTIONS):
        angle = index * (2 * PI / CATCH_DIRECTIONS)
        first, second = sharpness * (math.cos(angle - one) - 1), sharpness * (math.cos(angle - two) - 1)
        greater = max(first, second)
        raw[index] += greater + math.log(math.exp(first - greater) + math.exp(second - greater))
    add_softmax(raw, 1.0 / spec[MEMBERS], made.catch)


@kernel
def _fill_move(of: Member, found: Floats, made: Answer) -> None:
    spec = of.spec
    raw = np.empty(5 * _MOVES, np.float32)
    layer(of, spec[MOVE_PLACE], found, raw)
    first = of.number * _MOVES
    for index in range(_MOVES):
        at, place = first + index, MOVE_PLACES[index]
        made.move_x.centre[at] = place[0] + MOVE_REACH_M * float(raw[_MOVES + index])
        made.move_y.centre[at] = place[1] + MOVE_REACH_M * float(raw[2 * _MOVES + index])
        made.move_x.scale[at] = scale_of(float(raw[3 * _MOVES + index]), LEAST_PLACE, TYPICAL_PLACE)
        made.move_y.scale[at] = scale_of(float(raw[4 * _MOVES + index]), LEAST_PLACE, TYPICAL_PLACE)
    softmax(raw[:_MOVES], 1.0 / spec[MEMBERS], made.move_x.share[first : first + _MOVES])


@kernel
def fill_parameters(of: Member, found: Floats, geometry: Floats, aims: NDArray[np.float32], made: Answer) -> None:
    """Fill what a member answers on dashes, turns, catches and moves.

    Args:
        found: features of parameters. geometry: (len(GEOMETRY),). aims: see `targets.fill_targets`.
        made: with directions of zeros before the first member.
    """
    _fill_dash(of, found, geometry, aims, made)
    _fill_turn(of, found, geometry, aims, made)
    if of.spec[N_CATCH] > 0:
        _fill_catch(of, found, geometry, made)
    if of.spec[N_MOVE] > 0:
        _fill_move(of, found, made)


@kernel
def fill_point(made: Answer) -> None:
    """Fill the single best value of each parameter: of each mixture the weighted medoid of its components.

    Args:
        made: all of it but ``parameters``. Parameters of kicks and tackles become 0 where they were not asked for.
    """
    best = made.parameters
    power = made.dash_power
    best[0] = clamp(float(power.centre[_medoid_of_power(power.share, power.centre)]), 0.0, 100.0)
    best[1] = direction_of(made.dash_direction)
    turn = float(made.turn.centre[medoid(made.turn.share, made.turn.centre, TURN_AROUND)])
    best[2] = clamp(turn / DEGREE * float(made.turn_factor[0]), -180.0, 180.0)
    best[3], best[4], best[5] = 0.0, 0.0, 0.0
    if made.asked[0] > 0:
        power = made.kick_power
        best[3] = clamp(float(power.centre[_medoid_of_power(power.share, power.centre)]), 0.0, 100.0)
        best[4] = made.kick_direction.centre[medoid(power.share, made.kick_direction.centre, TURN_AROUND)] / DEGREE
        best[5] = direction_of(made.tackle)
    at = 6
    if len(made.catch) > 0:
        best[at] = direction_of(made.catch)
        at += 1
    if len(made.move_x.share) > 0:
        n = len(made.move_x.share)
        x, y = np.empty(n, np.float32), np.empty(n, np.float32)
        for index in range(n):
            x[index] = clamp(float(made.move_x.centre[index]), -pitch.MAX_X, pitch.MAX_X)
            y[index] = clamp(float(made.move_y.centre[index]), -pitch.MAX_Y, pitch.MAX_Y)
        place = medoid_place(made.move_x.share, x, y)
        best[at], best[at + 1] = x[place], y[place]


@kernel
def _medoid_of_power(share: Floats, centre: Floats) -> int:
    """Return the weighted medoid of powers, each clipped as the server clips it."""
    clipped = np.empty(len(centre), np.float32)
    for index in range(len(centre)):
        clipped[index] = clamp(float(centre[index]), 0.0, 100.0)
    return medoid(share, clipped, 0.0)


@kernel
def fill_values(values: Floats, spec: Ints, projected: NDArray[np.float32], made: Answer) -> None:
    """Fill the parameters of a head that answers with values: of each the one nearest to those of all members.

    Args:
        projected: (MEMBERS, PARAMETERS) in [-1, 1].
    """
    members, count = spec[MEMBERS], spec[PARAMETERS]
    even, of_each = np.full(members, np.float32(1.0 / members)), np.empty(members, np.float32)
    for parameter in range(count):
        for member in range(members):
            of_each[member] = projected[member, parameter] * np.float32(PI)
        around = TURN_AROUND if spec[spec[ARGUMENTS_AT] + 3 * parameter + 2] > 0 else 0.0
        chosen = medoid(even, of_each, around)
        made.parameters[parameter] = projected[chosen, parameter] * values[spec[LIMITS] + parameter]
