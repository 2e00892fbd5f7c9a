"""A network's answer to inputs, by one kernel for all families."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.inputs.layout import GEOMETRY
from teamclone.engine.network.constants import TARGET_COLUMNS
from teamclone.engine.network.heads import fill_parameters, fill_point, fill_values
from teamclone.engine.network.kick import fill_kicks
from teamclone.engine.network.layers import Member, layer, softmax, stack
from teamclone.engine.network.result import view
from teamclone.engine.network.spec import (
    CLIP,
    COLUMNS,
    COMMAND,
    COMMAND_DEPTH,
    COMMAND_STACK,
    COMMANDS,
    GEOMETRY_AT,
    INPUTS,
    MEAN,
    MEMBER_VALUES,
    MEMBERS,
    MIXTURE,
    PARAMETER,
    PARAMETER_DEPTH,
    PARAMETER_STACK,
    PARAMETERS,
    PLACED,
    PLACED_AT,
    PLACES,
    SEEN,
    SEEN_AT,
    STD,
    TARGET_DEPTH,
    TARGET_POINTS,
    TARGET_STACK,
    TEMPERATURE,
    WIDEST,
    Floats,
    Ints,
)
from teamclone.engine.network.targets import fill_targets
from teamclone.system.compiling import kernel

_TURN_FACTOR = GEOMETRY.index("turn_factor")


@kernel
def normalise(values: Floats, spec: Ints, packed: Floats, x: Floats) -> None:
    """Fill ``x`` with inputs of which the columns of the blocks are normalised and limited."""
    columns, limit = spec[COLUMNS], values[spec[CLIP]]
    mean, std = values[spec[MEAN] : spec[MEAN] + columns], values[spec[STD] : spec[STD] + columns]
    for index in range(columns):
        x[index] = min(max((packed[index] - mean[index]) / std[index], -limit), limit)
    for index in range(columns, spec[INPUTS]):
        x[index] = packed[index]


@kernel
def _fill_probabilities(values: Floats, spec: Ints, logits: NDArray[np.float32], out: Floats, shares: Floats) -> None:
    """Fill the calibrated logits and the probabilities.

    Args:
        logits: (MEMBERS, COMMANDS) of each member. out, shares: (COMMANDS,).
    """
    members, temperature = spec[MEMBERS], float(values[spec[TEMPERATURE]])
    for command in range(len(out)):
        out[command] = logits[0, command]
    if members > 1:  # the logarithm of the mean probability
        total = np.zeros(members)
        for member in range(members):
            most = -np.inf
            for command in range(len(out)):
                most = max(most, float(logits[member, command]))
            for command in range(len(out)):
                total[member] += math.exp(float(logits[member, command]) - most)
            total[member] = most + math.log(total[member])
        for command in range(len(out)):
            most, mean = -np.inf, 0.0
            for member in range(members):
                most = max(most, float(logits[member, command]) - total[member])
            for member in range(members):
                mean += math.exp(float(logits[member, command]) - total[member] - most)
            out[command] = most + math.log(mean / members)
    for command in range(len(out)):
        out[command] = float(out[command]) / temperature
    softmax(out, 1.0, shares)


@kernel
def answer(values: Floats, spec: Ints, packed: Floats, with_ball: bool, out: Floats) -> None:
    """Fill the answer to one situation; `result.view` names its parts.

    Args:
        values: (N_VALUES,) weights. spec: see `spec`. packed: (INPUTS,) before normalisation.
        with_ball: fill the parameters of kicks and tackles; else they are 0, which saves most of the time. A head that
            answers with values always fills them.
        out: (N_OUT,).
    """
    out[:] = 0
    made = view(spec, out)
    x, live = np.empty(spec[INPUTS], np.float32), np.empty(spec[WIDEST], np.int64)
    hidden = np.empty((2, spec[WIDEST]), np.float32)
    normalise(values, spec, packed, x)
    mixture, members, targets = spec[MIXTURE] > 0, spec[MEMBERS], spec[TARGET_POINTS]
    geometry = x[spec[GEOMETRY_AT] :]
    columns, width = spec[SEEN], spec[SEEN] + TARGET_COLUMNS * targets
    seen, placed = np.empty(spec[WIDEST], np.float32), np.empty(spec[PLACED], np.float32)
    logits = np.empty((members, spec[COMMANDS]), np.float32)
    projected = np.empty((members, spec[PARAMETERS]), np.float32)
    aims, places = np.empty((2, targets), np.float32), np.empty(2 * targets, np.float32)
    for index in range(columns):
        seen[index] = x[spec[spec[SEEN_AT] + index]]
    for index in range(spec[PLACED]):
        placed[index] = x[spec[spec[PLACED_AT] + index]]
    asked = with_ball or not mixture
    made.asked[0] = 1.0 if asked else 0.0
    if mixture:
        made.turn_factor[0] = geometry[_TURN_FACTOR]
    for number in range(members):
        member = Member(values, spec, number, number * spec[MEMBER_VALUES], live, hidden)
        if targets > 0:
            found = stack(member, spec[TARGET_STACK], spec[TARGET_DEPTH], placed)
            layer(member, spec[PLACES], found, places)
            fill_targets(places, geometry, seen[columns:width], aims)
        found = stack(member, spec[COMMAND_STACK], spec[COMMAND_DEPTH], seen[:width])
        layer(member, spec[COMMAND], found, logits[number])
        if mixture:
            more = width + len(found)
            seen[width:more] = found
            found = stack(member, spec[PARAMETER_STACK], spec[PARAMETER_DEPTH], seen[:more])
            fill_parameters(member, found, geometry, aims, made)
            if asked:
                fill_kicks(member, x, made)
        else:
            layer(member, spec[PARAMETER], found, projected[number])
            for index in range(spec[PARAMETERS]):
                projected[number, index] = math.tanh(float(projected[number, index]))
    _fill_probabilities(values, spec, logits, made.logits, made.probabilities)
    if mixture:
        fill_point(made)
    else:
        fill_values(values, spec, projected, made)
