"""What a network is made of, as integers: one array for every family, so that kernels are compiled once for all runs.

The array begins with the fields below. ``_AT`` fields are places of lists in the array itself; fields of values, MEAN
to TEMPERATURE, are places among the weights; those from OUT_LOGITS on are places in an answer. ROWS_AT is a table of
the parts that have weights, ROW_FIELDS numbers each: WEIGHTS is the place of the first weight of the first member, from
which those of the others are MEMBER_VALUES apart. A layer has (INS, OUTS) weights, those of one input next to each
other, then OUTS biases; where INS is 0 there are only the latter. A part that a network lacks has no OUTS.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.inputs.layout import GEOMETRY, OTHER, OTHERS, PARTS, TACKLE
from teamclone.engine.network.constants import (
    ACTIVATIONS,
    CANDIDATE_COLUMNS,
    CATCH_DIRECTIONS,
    DASH_DIRECTIONS,
    FREE_COMPONENTS,
    INCOMES,
    MOVE_PLACES,
    N_CANDIDATES,
    N_COMPONENTS,
    PLAYER_COLUMNS,
    TARGET_COLUMNS,
)
from teamclone.planner.columns import WAYS
from teamclone.planner.tackle import DIRECTIONS as TACKLE_DIRECTIONS
from teamclone.rcss.commands import REPERTOIRE, parameters_of
from teamclone.system.compiling import kernel

Ints = NDArray[np.int64]
Floats = NDArray[np.float32]

(INPUTS, COLUMNS, COMMANDS, PARAMETERS, MEMBERS, MIXTURE, CATCH, MOVE, TARGET_POINTS, ATTENTION, PLANNED,
 GEOMETRY_AT, OTHERS_AT, TACKLE_AT, WAYS_AT, SEEN_AT, SEEN, KICKED_AT, KICKED, PLACED_AT, PLACED, ARGUMENTS_AT, ROWS_AT,
 N_ROWS, TARGET_STACK, TARGET_DEPTH, COMMAND_STACK, COMMAND_DEPTH, PARAMETER_STACK, PARAMETER_DEPTH, KICK_STACK,
 KICK_DEPTH, WIDEST, MEAN, STD, SIGNS, LIMITS, CLIP, TEMPERATURE, MEMBER_VALUES, N_VALUES, OUT_LOGITS,
 OUT_PROBABILITIES, OUT_PARAMETERS, OUT_ASKED, OUT_TURN_FACTOR, OUT_DASH, N_DASH, OUT_DASH_DIRECTION, OUT_TURN, N_TURN,
 OUT_KICK, N_KICK, OUT_TACKLE, OUT_CATCH, N_CATCH, OUT_MOVE, N_MOVE, N_OUT, CANDIDATES,
 N_SHAPE) = range(61)  # fmt: skip
"""Fields. INPUTS: how many, of which COLUMNS are normalised. MIXTURE: 1 for a head that answers with distributions, 0
for one that answers with values. CATCH, MOVE: places of these commands, -1 without. ATTENTION: width of the embedding
of other players, 0 without. PLANNED: whether kicks have components from plans. CANDIDATES: width of
the layers that score candidates of kicks, 0 without. GEOMETRY_AT, OTHERS_AT, TACKLE_AT,
WAYS_AT: where these inputs begin. SEEN_AT, KICKED_AT, PLACED_AT: lists of SEEN, KICKED and PLACED columns, those that
decide on the command, on a kick, on target points. ARGUMENTS_AT: for each parameter its command, its place in it, and
whether it is an angle. STACK: place of the row of the first of DEPTH hidden layers. WIDEST: the most inputs or outputs
of any layer. N_DASH, N_TURN, N_KICK, N_CATCH, N_MOVE: components, or directions, of all members together."""

EGOCENTRIC, PAPER = 0, 1
"""The first of ``Weights.inputs``: which inputs the network has."""
WEIGHTS, INS, OUTS, ACTIVATION, ROW_FIELDS = range(5)
"""Numbers of a row."""
NO_ACTIVATION = -1
RELU, GELU, SILU, TANH = range(len(ACTIVATIONS))

ROW_NAMES = range(N_SHAPE, N_SHAPE + 32)
(PLACES, COMMAND, PARAMETER, DASH, TURN, INCOME, POWER, CATCH_CLASS, CATCH_EDGES, CATCH_SHARPNESS, MOVE_PLACE,
 OTHER_IN, OTHER_OUT, SITUATION, BEFORE, BETWEEN, AFTER, ASK, HEARD, THINK_IN, THINK_OUT, KICK, KICK_TARGET, WAY_SHARE,
 WAY_ERROR, TACKLE_CLASS, TACKLE_TRUST, CANDIDATE, CANDIDATE_SITUATION, CANDIDATE_TARGET, CANDIDATE_BETWEEN,
 CANDIDATE_SCORE) = ROW_NAMES  # fmt: skip
N_NAMED = len(ROW_NAMES)
N_FIELDS = N_SHAPE + N_NAMED
"""Fields with the places of rows that all networks have; the hidden layers come after these in the table. BEFORE,
BETWEEN and AFTER are layer norms: scales, then shifts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """What a network is made of, from which `spec_of` follows.

    Attributes:
        inputs: of one answer. columns: how many of them are normalised; the first of what follows them is GEOMETRY.
        commands: the command set. members: networks that answer together. mixture: see MIXTURE.
        activation: of the hidden layers, one of ACTIVATIONS. hidden, parameter_hidden, kick_hidden, target_hidden:
            their widths.
        seen, kicked, placed: the columns that decide on the command, on a kick, on target points.
        target_points: their number. attention: width. planned: see PLANNED.
        candidates: see CANDIDATES.
        others, ways: whether the inputs end in other players, and in plans.
    """

    inputs: int
    columns: int
    commands: tuple[str, ...]
    members: int
    mixture: bool
    activation: str
    hidden: tuple[int, ...]
    seen: tuple[int, ...]
    placed: tuple[int, ...] = ()
    target_points: int = 0
    target_hidden: tuple[int, ...] = ()
    parameter_hidden: tuple[int, ...] = ()
    kicked: tuple[int, ...] = ()
    kick_hidden: tuple[int, ...] = ()
    attention: int = 0
    planned: bool = False
    candidates: int = 0
    others: bool = False
    ways: bool = False

    @property
    def stacks(self) -> tuple[tuple[int, ...], ...]:
        """Widths from the inputs on of the hidden layers of target points, the command, its parameters, and kicks."""
        seen = len(self.seen) + TARGET_COLUMNS * self.target_points
        return (
            (len(self.placed), *self.target_hidden) if self.target_points else (),
            (seen, *self.hidden),
            (seen + self.hidden[-1], *self.parameter_hidden) if self.mixture else (),
            (len(self.kicked), *self.kick_hidden) if self.mixture else (),
        )


def rows_of(shape: Shape) -> list[tuple[int, int, int]]:
    """Return (INS, OUTS, ACTIVATION) of each row, in the order of ROW_NAMES, then of the hidden layers."""
    plain, relu = NO_ACTIVATION, RELU
    rows = dict.fromkeys(ROW_NAMES, (0, 0, plain))
    if shape.target_points:
        rows[PLACES] = (shape.stacks[0][-1], 2 * shape.target_points, plain)
    rows[COMMAND] = (shape.hidden[-1], len(shape.commands), plain)
    if not shape.mixture:
        rows[PARAMETER] = (shape.hidden[-1], len(parameters_of(shape.commands)), plain)
    else:
        found, at_ball, width = shape.parameter_hidden[-1], shape.kick_hidden[-1], shape.attention
        rows[DASH] = (found, 3 * (shape.target_points + INCOMES + FREE_COMPONENTS) + DASH_DIRECTIONS, plain)
        rows[TURN] = (found, 3 * (shape.target_points + 2 + FREE_COMPONENTS), plain)
        rows[INCOME], rows[POWER] = (0, INCOMES, plain), (0, FREE_COMPONENTS, plain)
        if "catch" in shape.commands:
            rows[CATCH_CLASS] = (found, CATCH_DIRECTIONS, plain)
            rows[CATCH_EDGES], rows[CATCH_SHARPNESS] = (0, 2, plain), (0, 1, plain)
        if "move" in shape.commands:
            rows[MOVE_PLACE] = (found, 5 * len(MOVE_PLACES), plain)
        if width:
            rows[OTHER_IN], rows[OTHER_OUT] = (PLAYER_COLUMNS, width, relu), (width, width, plain)
            rows[SITUATION], rows[ASK] = (at_ball, width, plain), (width, 3 * width, plain)
            rows[BEFORE] = rows[BETWEEN] = rows[AFTER] = (1, width, plain)
            rows[HEARD] = (width, width, plain)
            rows[THINK_IN], rows[THINK_OUT] = (width, 2 * width, relu), (2 * width, width, plain)
            rows[KICK_TARGET] = (width, 6, plain)
        rows[KICK], rows[TACKLE_CLASS] = (
            (at_ball + width, outs, plain) for outs in (6 * N_COMPONENTS, TACKLE_DIRECTIONS)
        )
        if shape.planned:
            rows[WAY_SHARE], rows[TACKLE_TRUST] = ((at_ball + width, outs, plain) for outs in (len(WAYS), 1))
            rows[WAY_ERROR] = (0, len(WAYS), plain)
        if scored := shape.candidates:
            rows[CANDIDATE] = (CANDIDATE_COLUMNS, scored, plain)
            rows[CANDIDATE_SITUATION] = (at_ball + width, scored, plain)
            if width:
                rows[CANDIDATE_TARGET] = (width, scored, plain)
            rows[CANDIDATE_BETWEEN], rows[CANDIDATE_SCORE] = (scored, scored, relu), (scored, 5, plain)
    activation = ACTIVATIONS.index(shape.activation)
    return [*rows.values()] + [(ins, outs, activation) for stack in shape.stacks for ins, outs in pairwise(stack)]


def size_of(row: Sequence[int]) -> int:
    """Return the number of values of a row (INS, OUTS, ...)."""
    ins, outs = row[:2]
    return (ins + 1) * outs


def spec_of(shape: Shape) -> Ints:
    """Return the integers that describe a network."""
    commands, members = shape.commands, shape.members
    rows, parameters = rows_of(shape), parameters_of(commands)
    depths = [max(0, len(stack) - 1) for stack in shape.stacks]
    fields = np.full(N_FIELDS, -1, np.int64)
    fields[[INPUTS, COLUMNS, COMMANDS, PARAMETERS]] = shape.inputs, shape.columns, len(commands), len(parameters)
    fields[[MEMBERS, MIXTURE, TARGET_POINTS, ATTENTION]] = members, shape.mixture, shape.target_points, shape.attention
    fields[[PLANNED, CANDIDATES]] = shape.planned, shape.candidates
    for field, name in ((CATCH, "catch"), (MOVE, "move")):
        fields[field] = commands.index(name) if name in commands else -1
    tail = shape.columns + len(GEOMETRY)
    fields[GEOMETRY_AT] = shape.columns
    fields[OTHERS_AT] = tail if shape.others else -1
    tail += len(OTHER) * OTHERS * shape.others
    fields[[TACKLE_AT, WAYS_AT]] = (tail, tail + len(TACKLE)) if shape.ways else (-1, -1)

    arguments = [
        number
        for item in parameters
        for number in (commands.index(item.kind.name.lower()), item.argument, int(item.angle))
    ]
    fields[[SEEN, KICKED, PLACED, N_ROWS]] = len(shape.seen), len(shape.kicked), len(shape.placed), len(rows)
    fields[WIDEST] = max(
        shape.inputs, *(width for row in rows for width in row[:2]), *(sum(s[:1]) for s in shape.stacks)
    )
    lists = [shape.seen, shape.kicked, shape.placed, arguments, [0] * (ROW_FIELDS * len(rows))]
    starts = list(accumulate((len(numbers) for numbers in lists), initial=N_FIELDS))
    fields[[SEEN_AT, KICKED_AT, PLACED_AT, ARGUMENTS_AT, ROWS_AT]] = starts[:-1]
    fields[N_SHAPE:] = starts[-2] + ROW_FIELDS * np.arange(len(ROW_NAMES))
    firsts = np.array(list(accumulate(depths, initial=len(ROW_NAMES)))[:-1])
    fields[[TARGET_STACK, COMMAND_STACK, PARAMETER_STACK, KICK_STACK]] = starts[-2] + ROW_FIELDS * firsts
    fields[[TARGET_DEPTH, COMMAND_DEPTH, PARAMETER_DEPTH, KICK_DEPTH]] = depths

    shared = (shape.columns, shape.columns, shape.inputs, len(parameters), 1, 1)
    values = list(accumulate(shared, initial=0))
    fields[[MEAN, STD, SIGNS, LIMITS, CLIP, TEMPERATURE]] = values[:-1]
    places = list(accumulate((size_of(row) for row in rows), initial=values[-1]))
    fields[MEMBER_VALUES] = places[-1] - values[-1]
    fields[N_VALUES] = values[-1] + members * fields[MEMBER_VALUES]
    lists[-1] = [number for place, row in zip(places, rows, strict=False) for number in (place, *row)]
    _place_answer(fields, shape)
    return np.concatenate([fields, *(np.asarray(numbers, np.int64) for numbers in lists)])


def _place_answer(fields: Ints, shape: Shape) -> None:
    """Fill where the parts of an answer stand."""
    n, mixture = shape.members, shape.mixture
    dash, turn = (n * (shape.target_points + more + FREE_COMPONENTS) * mixture for more in (INCOMES, 2))
    kick = 2 * n * (N_COMPONENTS + len(WAYS) * shape.planned + N_CANDIDATES * (shape.candidates > 0)) * mixture
    catch = CATCH_DIRECTIONS * ("catch" in shape.commands) * mixture
    move = n * len(MOVE_PLACES) * ("move" in shape.commands) * mixture
    fields[[N_DASH, N_TURN, N_KICK, N_CATCH, N_MOVE]] = dash, turn, kick, catch, move
    widths = {
        OUT_LOGITS: len(shape.commands),
        OUT_PROBABILITIES: len(shape.commands),
        OUT_PARAMETERS: len(parameters_of(shape.commands)),
        OUT_ASKED: 1,
        OUT_TURN_FACTOR: 1,
        OUT_DASH: 3 * dash,
        OUT_DASH_DIRECTION: DASH_DIRECTIONS * mixture,
        OUT_TURN: 3 * turn,
        OUT_KICK: 5 * kick,
        OUT_TACKLE: TACKLE_DIRECTIONS * mixture,
        OUT_CATCH: catch,
        OUT_MOVE: 5 * move,
    }
    at = 0
    for field, width in widths.items():
        fields[field] = at
        at += width
    fields[N_OUT] = at


def commands_of(spec: Ints) -> tuple[str, ...]:
    """Return the command set of a network."""
    further = {int(spec[CATCH]): "catch", int(spec[MOVE]): "move"}
    return tuple(REPERTOIRE[place] if place < 4 else further.get(place, "none") for place in range(int(spec[COMMANDS])))


N_PARTS = len(PARTS)
FAULTS = (
    "",
    "{fields} integers describe the network, {expected} at least are expected",
    "its table of layers is not where it should be",
    "it holds {values:,} weights, its description has {described:,}",
    "a layer lies outside of its weights",
    "its inputs are none that this version makes",
)
"""What `fault` means."""


@kernel
def fault(spec: Ints, inputs: Ints, n_values: int) -> int:
    """Return what is wrong with the description of a network, an index into FAULTS; 0 for nothing.

    Args:
        inputs: see `weights.Weights`. n_values: the number of weights that there are.
    """
    if len(spec) < N_FIELDS:
        return 1
    at, rows = spec[ROWS_AT], spec[N_ROWS]
    if at < N_FIELDS or rows < N_NAMED or at + rows * ROW_FIELDS != len(spec):
        return 2
    if n_values != spec[N_VALUES]:
        return 3
    for row in range(rows):
        first = at + row * ROW_FIELDS
        begin, ins, outs = spec[first + WEIGHTS], spec[first + INS], spec[first + OUTS]
        if min(begin, ins, outs) < 0 or max(begin, ins, outs) > n_values:
            return 4
        if begin + (ins + 1) * outs + (spec[MEMBERS] - 1) * spec[MEMBER_VALUES] > n_values:
            return 4
    return 0 if len(inputs) > 0 and (inputs[0] != EGOCENTRIC or len(inputs) == 1 + N_PARTS) else 5


def faults(spec: Ints, inputs: Ints, n_values: int) -> str | None:
    """Return what is wrong with the description of a network in words; None for nothing."""
    found: int = fault.py_func(spec, inputs, n_values)
    described = spec[N_VALUES] if len(spec) > N_VALUES else 0
    text = FAULTS[found].format(fields=len(spec), expected=N_FIELDS, values=n_values, described=described)
    return text or None
