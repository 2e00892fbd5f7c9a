"""Layers and small functions that all networks share."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.network.constants import MEDOID_COMPONENTS
from teamclone.engine.network.spec import (
    ACTIVATION,
    GELU,
    INS,
    NO_ACTIVATION,
    OUTS,
    RELU,
    ROW_FIELDS,
    SILU,
    TANH,
    WEIGHTS,
    Floats,
    Ints,
)
from teamclone.system.compiling import kernel

PI = math.pi
TURN_AROUND = 2 * math.pi
LEAST_VARIANCE = 1e-5
"""Added to the variance in a layer norm."""


class Member(NamedTuple):
    """One of the networks that answer together, and room for what it computes.

    Attributes:
        values, spec: of all of them, see `spec`. number: which it is. base: where its values begin, relative to those
            of the first.
        live: (WIDEST,), hidden: (2, WIDEST) are room.
    """

    values: Floats
    spec: Ints
    number: int
    base: int
    live: Ints
    hidden: NDArray[np.float32]


@kernel
def row_of(spec: Ints, row: int) -> tuple[int, int, int]:
    """Return the place of a row's first value in the first member, and its numbers of inputs and outputs.

    Args:
        row: where it begins in ``spec``.
    """
    return spec[row + WEIGHTS], spec[row + INS], spec[row + OUTS]


@kernel
def biases_of(of: Member, row: int) -> Floats:
    """Return the biases of a layer, or all values of a row without inputs."""
    at, ins, outs = row_of(of.spec, row)
    first = of.base + at + ins * outs
    return of.values[first : first + outs]


@kernel
def activate(kind: int, y: Floats) -> None:
    """Apply an activation in place."""
    if kind == RELU:
        nothing = np.float32(0.0)
        for j in range(len(y)):
            y[j] = nothing if y[j] < nothing else y[j]  # what is no number stays
    elif kind == GELU:
        for j in range(len(y)):
            value = float(y[j])
            y[j] = 0.5 * value * (1.0 + math.erf(value * math.sqrt(0.5)))
    elif kind == SILU:
        for j in range(len(y)):
            value = float(y[j])
            y[j] = value / (1.0 + math.exp(-value))
    elif kind == TANH:
        for j in range(len(y)):
            y[j] = math.tanh(float(y[j]))


@kernel
def layer(of: Member, row: int, x: Floats, y: Floats) -> None:
    """Fill ``y`` with the outputs of a layer. Weights of inputs that are zero are not read.

    Args:
        row: where the layer begins in ``spec``. x: (INS,). y: (OUTS,) or longer.
    """
    at, ins, outs = row_of(of.spec, row)
    first = of.base + at
    weights, live, out = of.values[first : first + (ins + 1) * outs], of.live, y[:outs]
    bias = weights[ins * outs :]
    for j in range(outs):
        out[j] = bias[j]
    count = 0
    for i in range(ins):
        live[count] = i
        count += x[i] != 0
    last = count - count % 4
    for k in range(0, last, 4):
        i0, i1, i2, i3 = live[k], live[k + 1], live[k + 2], live[k + 3]
        x0, x1, x2, x3 = x[i0], x[i1], x[i2], x[i3]
        w0 = weights[i0 * outs : i0 * outs + outs]
        w1 = weights[i1 * outs : i1 * outs + outs]
        w2 = weights[i2 * outs : i2 * outs + outs]
        w3 = weights[i3 * outs : i3 * outs + outs]
        for j in range(outs):
            out[j] += x0 * w0[j] + x1 * w1[j] + x2 * w2[j] + x3 * w3[j]
    for k in range(last, count):
        i0 = live[k]
        x0 = x[i0]
        w0 = weights[i0 * outs : i0 * outs + outs]
        for j in range(outs):
            out[j] += x0 * w0[j]
    kind = of.spec[row + ACTIVATION]
    if kind != NO_ACTIVATION:
        activate(kind, out)


@kernel
def stack(of: Member, first: int, depth: int, x: Floats) -> Floats:
    """Return the outputs of hidden layers, in the room of the member.

    Args:
        first: where the first of them begins in ``spec``. depth: their number.
    """
    given, row = x, first
    for index in range(depth):
        made = of.hidden[index % 2, : of.spec[row + OUTS]]
        layer(of, row, given, made)
        given = made
        row += ROW_FIELDS
    return given


@kernel
def layer_norm(of: Member, row: int, x: Floats, y: Floats) -> None:
    """Fill ``y`` with ``x`` of mean 0 and deviation 1, then scaled and shifted. They may be one array."""
    at, _, width = row_of(of.spec, row)
    first = of.base + at
    scale, shift = of.values[first : first + width], of.values[first + width : first + 2 * width]
    # Four sums side by side, since each addition waits for the one before; the width is a multiple of 4.
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for j in range(0, width, 4):
        a, b, c, d = a + x[j], b + x[j + 1], c + x[j + 2], d + x[j + 3]
    mean = np.float32((a + b + c + d) / width)
    for j in range(width):
        y[j] = x[j] - mean
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for j in range(0, width, 4):
        a, b, c, d = a + y[j] * y[j], b + y[j + 1] * y[j + 1], c + y[j + 2] * y[j + 2], d + y[j + 3] * y[j + 3]
    factor = np.float32(1.0 / math.sqrt((a + b + c + d) / width + LEAST_VARIANCE))
    for j in range(width):
        y[j] = y[j] * factor * scale[j] + shift[j]


@kernel
def softmax(logits: Floats, part: float, shares: Floats) -> None:
    """Fill ``shares`` with the probabilities of logits times ``part``."""
    most = logits[0]
    for index in range(len(logits)):
        most = max(most, logits[index])
    total = 0.0
    for index in range(len(logits)):
        shares[index] = math.exp(logits[index] - most)
        total += shares[index]
    factor = np.float32(part / total)
    for index in range(len(logits)):
        shares[index] *= factor


@kernel
def add_softmax(logits: Floats, part: float, shares: Floats) -> None:
    """Add the probabilities of logits times ``part`` to ``shares``."""
    most = logits[0]
    for index in range(len(logits)):
        most = max(most, logits[index])
    total = 0.0
    for index in range(len(logits)):
        total += math.exp(logits[index] - most)
    factor = part / total
    for index in range(len(logits)):
        shares[index] += factor * math.exp(logits[index] - most)


@kernel
def wrap(angle: float) -> float:
    """Return an angle in [-pi, pi)."""
    return (angle + PI) % TURN_AROUND - PI


@kernel
def clamp(value: float, low: float, high: float) -> float:
    """Return a value limited to ``low``..``high``; one that is not a number stays."""
    if value < low:
        return low
    if value > high:
        return high
    return value


@kernel
def sigmoid(value: float) -> float:
    """Return the logistic function."""
    return 1.0 / (1.0 + math.exp(-value))


@kernel
def scale_of(raw: float, least: float, typical: float) -> float:
    """Return a scale from an unbounded output: about ``typical`` for 0, at most some twenty times as much."""
    away = 3.0 - raw
    bent = away if away > 20.0 else math.log1p(math.exp(away))
    return least + typical * math.exp(3.0 - bent)


@kernel
def greatest(values: Floats) -> int:
    """Return the index of the greatest value, the first of equal ones; 0 where none is a number."""
    best = 0
    for index in range(len(values)):
        if values[index] > values[best] or math.isnan(values[best]):
            best = index
    return best


@kernel
def direction_of(shares: Floats) -> float:
    """Return degrees of the most probable of directions, the first of which is straight ahead."""
    degrees = greatest(shares) * (360.0 / len(shares))
    return degrees - 360.0 if degrees > 180.0 else degrees


@kernel
def main_components(shares: Floats) -> Ints:
    """Return the components with the greatest shares, at most MEDOID_COMPONENTS, sorted if some are left out."""
    count = min(len(shares), MEDOID_COMPONENTS)
    chosen = np.arange(len(shares))
    if count < len(shares):
        for place in range(count):
            best = place
            for index in range(place + 1, len(shares)):
                if shares[chosen[index]] > shares[chosen[best]]:
                    best = index
            chosen[place], chosen[best] = chosen[best], chosen[place]
    return chosen[:count]


@kernel
def medoid(shares: Floats, centre: Floats, around: float) -> int:
    """Return the component with the least expected distance to all: the median among them.

    Args:
        around: the centres lie on a circle of so many units, less than a turn apart; 0 for a line. Distances are in
            single precision as in training; of centres that are equally near to all the first is taken.
    """
    chosen = main_components(shares)
    count = len(chosen)
    x, cost = np.empty(count, np.float32), np.zeros(count, np.float32)
    for index in range(count):
        x[index] = centre[chosen[index]]
    half, whole, nothing = np.float32(around / 2), np.float32(around), np.float32(0.0)
    for index in range(count):
        share, at = shares[chosen[index]], x[index]
        if share == 0:
            continue
        if around > 0:
            for other in range(count):
                away = abs(at - x[other]) + half
                away -= whole if away >= whole else nothing
                cost[other] += share * abs(away - half)
        else:
            for other in range(count):
                cost[other] += share * abs(at - x[other])
    best = 0
    for index in range(count):
        if cost[index] < cost[best]:
            best = index
    return chosen[best]


@kernel
def medoid_place(shares: Floats, x: Floats, y: Floats) -> int:
    """Return the component whose place has the least expected distance to all, see `medoid`."""
    best, least = 0, np.inf
    for index in range(len(shares)):
        cost = 0.0
        for other in range(len(shares)):
            cost += shares[other] * math.hypot(float(x[index]) - float(x[other]), float(y[index]) - float(y[other]))
        if cost < least:
            best, least = index, cost
    return best
