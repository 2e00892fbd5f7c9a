"""Kernels that use all that can be translated, for comparison with Numba."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from teamclone.system.compiling import kernel

WEIGHTS = np.array([[0.1, -2.5, 1e-3], [7.0, 1 / 3, -0.0]])
STEPS, NAMES = (2, 3, 5), ("a", "b", "c", "d")
NOTHING = -math.inf


class Point(NamedTuple):
    """A place and whether it counts."""

    x: float
    y: float = 0.25
    counts: bool = True


class Half(NamedTuple):
    """Arrays and a number."""

    values: np.ndarray
    rest: np.ndarray
    share: float


HERE = Point(1.5, -2.0)


@kernel
def of_floats(a, i, f, floats, ints):
    """Operators and functions of two floats."""
    for row in range(len(a) * len(a)):
        x, y = a[row // len(a)], a[row % len(a)]
        floats[row, 0], floats[row, 1], floats[row, 2], floats[row, 3] = x + y, x - y, x * y, x / y
        floats[row, 4], floats[row, 5], floats[row, 6], floats[row, 7] = x // y, x % y, x**y, x**2
        floats[row, 8], floats[row, 9], floats[row, 10] = min(x, y), max(x, y), max(x, y, 1.0)
        floats[row, 11], floats[row, 12], floats[row, 13] = abs(x), -x, +x
        floats[row, 14], floats[row, 15] = math.hypot(x, y), math.atan2(x, y)
        floats[row, 16], floats[row, 17] = math.sin(x), math.cos(x)
        floats[row, 18], floats[row, 19], floats[row, 20] = math.exp(x), math.log(x), math.sqrt(x)
        floats[row, 21], floats[row, 22] = math.degrees(x), math.radians(x)
        floats[row, 23], floats[row, 24] = math.asin(x), math.acos(x)
        floats[row, 25], floats[row, 26] = math.copysign(x, y), np.rint(x)
        floats[row, 27], floats[row, 28] = np.minimum(x, y), np.maximum(x, y)
        floats[row, 29], floats[row, 30] = math.tanh(x), math.expm1(x)
        floats[row, 31], floats[row, 32] = math.log1p(x), np.floor(x)
        floats[row, 33], floats[row, 34] = x if x > y else y, x if not x else -1.0
        floats[row, 35], floats[row, 36] = (x * x + 1.0) ** -3, math.tan(x)
        ints[row, 0], ints[row, 1], ints[row, 2] = int(x), round(x), math.ceil(x)
        ints[row, 3], ints[row, 4] = math.floor(x), x < y
        ints[row, 5], ints[row, 6], ints[row, 7] = x <= y, x == y, x != y
        ints[row, 8], ints[row, 9] = 0.0 < x < y, -1.0 <= x <= 1.0
        ints[row, 10], ints[row, 11] = math.isnan(x), math.isinf(x)
        ints[row, 12], ints[row, 13] = np.isfinite(x), bool(x)
        ints[row, 14], ints[row, 15] = x > 0.0 or y > 0.0, x > 0.0 and not y > 0.0


@kernel
def of_ints(a, i, f, floats, ints):
    """Operators of two integers, which wrap around, and of truths."""
    for row in range(len(i) * len(i)):
        x, y = i[row // len(i)], i[row % len(i)]
        less, same = x < y, x == y
        ints[row, 0], ints[row, 1], ints[row, 2] = x + y, x - y, x * y
        ints[row, 3], ints[row, 4] = x // y, x % y
        ints[row, 5], ints[row, 6], ints[row, 7] = x & y, x | y, x ^ y
        ints[row, 8], ints[row, 9], ints[row, 10] = ~x, -x, abs(x)
        ints[row, 11], ints[row, 12] = x << (y & 31), x >> (y & 31)
        ints[row, 13], ints[row, 14], ints[row, 15] = min(x, y), max(x, y, 3), x**2
        ints[row, 16], ints[row, 17] = less & same, less | (not same)
        ints[row, 18], ints[row, 19] = less + same, x + less
        ints[row, 20], ints[row, 21] = less * y, -less
        ints[row, 22], ints[row, 23] = less ^ same, STEPS[x % 3] + len(NAMES)
        floats[row, 0], floats[row, 1], floats[row, 2] = x / y, x * 0.5, less * 0.25 + y
        floats[row, 3], floats[row, 4] = a[1] ** (y % 50 - 20), math.sqrt(x * 1.0)
        floats[row, 5], floats[row, 6] = max(x, 2.5), float(x)
        floats[row, 7] = 2.5 if less else y
        count = 0
        count += less
        count += x > 3
        count |= 4 * same
        ints[row, 24] = count


@kernel
def of_singles(a, i, f, floats, ints):
    """Floats of 32 bits, alone and with others."""
    total, zero = np.float32(0.0), np.float32(0.0)
    for row in range(len(f) * len(f)):
        x, y = f[row // len(f)], f[row % len(f)]
        floats[row, 0], floats[row, 1], floats[row, 2], floats[row, 3] = x + y, x * y, x / y, x % y
        floats[row, 4], floats[row, 5] = x * 0.1, x + i[row % len(i)]
        floats[row, 6], floats[row, 7] = math.exp(x), math.tanh(y)
        floats[row, 8], floats[row, 9] = max(x, zero), np.float32(a[row % len(a)])
        floats[row, 10], floats[row, 11] = x**2, math.degrees(x)
        total += x if y > zero else np.float32(1.0)
        floats[row, 12] = total
    layer = f[:6].reshape(2, 3)
    out = np.zeros(3, np.float32)
    for row in range(2):
        for column in range(3):
            out[column] += f[row] * layer[row, column]
    floats[0, 13 : 13 + 3] = out
    floats[1, 13] = (out * out).sum()
    floats[2, 13 : 13 + len(f)] = np.exp(f - f.max())


@kernel
def of_elements(a, i, f, floats, ints):
    """Operations on whole arrays, with broadcasting."""
    x, n = a[:6], 6
    column = x.reshape(-1, 1)
    floats[:n, :n] = column * x + 0.5
    floats[n : 2 * n, :n] = np.hypot(column, x) - column / x
    floats[2 * n : 3 * n, :n] = (column + 180.0) % 360.0 - 180.0 * x
    floats[3 * n : 4 * n, :n] = np.where(column < x, column, np.minimum(x, 2.0))
    floats[4 * n, :n] = -x
    floats[4 * n, n : 2 * n] = x**2 + np.abs(x)
    floats[4 * n + 1, :n] = np.cos(np.radians(x)) * a[3] + i[:n]
    floats[4 * n + 2, :3] = WEIGHTS[1] * (1.0 + WEIGHTS[0])
    floats[4 * n + 2, 3:6] = WEIGHTS.T[:, 1]
    mask = (x > 0.0) & (i[:n] < 3) | ~np.isfinite(x)
    ints[0, :n] = mask
    ints[1, :n] = i[:n] * 3 + mask
    ints[2, :n] = (i[:n] - mask) % 4 // 2
    ints[3, :n] = np.arange(n)[::-1]
    ints[4, :n] = x.astype(np.int64) if a[1] > 0 else i[:n]
    changed = x.copy()
    changed += 1.5
    changed[1:4] *= column[1:4, 0]
    changed[mask] = -7.0
    changed[np.array([5, 0])] = 2.0
    floats[4 * n + 3, :n] = changed
    floats[4 * n + 4] = -2.0
    floats[4 * n + 4, :2] = 1.0, x[1]
    floats[4 * n + 5, :n], ints[5, :n] = x[np.newaxis, :][0], i[:n]


@kernel
def of_arrays(a, i, f, floats, ints):
    """Functions that make arrays, or look into them; with the same results in NumPy, but in long sums."""
    n = len(a)
    order = np.argsort(-a, kind="mergesort")
    ints[0, :n] = order
    ints[1, : len(i)] = i.argsort(kind="mergesort")
    ordered = a[a.argsort(kind="mergesort")]
    floats[0, :n] = ordered
    for place in range(n):
        ints[2, place] = np.searchsorted(ordered, a[place])
        ints[3, place] = np.searchsorted(ordered, a[place], side="right")
    ints[4, :n] = np.searchsorted(ordered, ordered, side="right")
    found = np.flatnonzero(a)
    ints[5, : len(found)] = found
    ints[6, 0], ints[6, 1] = a.any(), a.all()
    ints[6, 2:8] = np.argmax(a), a.argmin(), i.max(), i.min(), i.sum(), (a > 0).sum()
    ints[7, :4] = np.argmax(i), np.flatnonzero(a > 1e400).size, a.shape[0], WEIGHTS.ndim
    finite = a[np.isfinite(a)]
    floats[1, :5] = finite.max(), finite.min(), finite[3:9].sum(), np.max(a), np.sum(finite[:5])
    floats[2, : len(finite)] = np.cumsum(finite)
    ints[8, : len(i)] = np.cumsum(i)
    floats[3, :11] = np.linspace(a[1], 7.0, 11)
    ints[9, :5] = np.arange(5, -5, -2)
    joined = np.concatenate((finite[:2], np.zeros(1), finite[1:3]))
    floats[4, : len(joined)] = joined
    floats[5, : len(joined) + 1] = np.append(joined, 2.5)
    floats[6, :6] = np.repeat(np.array([1.5, 2.5, 3.5]), np.array([1, 2, 3]))
    floats[7, :6] = np.repeat(finite[:3], 2)
    table = np.full((3, 4), 0.5)
    table[1] = finite[:4]
    table[:, 2] = -1.0
    ints[10, :3] = (table > 0).sum(axis=1)
    ints[11, :4] = (table > 0).sum(axis=0)
    floats[8, :4] = table.sum(axis=0)
    floats[9, :8] = table[np.array([1, -1])].ravel()
    floats[10, :8] = table[np.array([True, False, True])].flatten()
    floats[11, :12] = table.T.copy().reshape(-1)
    floats[12, :3] = np.array([0.5, i[1], 2])
    floats[13, : len(STEPS)] = np.array(STEPS)
    floats[14, :3], ints[12, :3] = np.empty_like(table[0, :3]) * 0.0 == 5.0, np.ones(3, np.int64)


@kernel
def of_slices(a, i, f, floats, ints):
    """Slices with all kinds of bounds, and negative indices."""
    row = 0
    table = np.arange(12).reshape(3, 4)
    for start in range(-5, 6, 2):
        for stop in range(-5, 7, 2):
            part, back, deep = table[0, start:stop], table[1, start:stop:-1], table[start:stop, ::2]
            ints[row, : len(part)] = part
            ints[row, 5 : 5 + len(back)] = back
            ints[row, 10], ints[row, 11] = deep.sum(), len(deep)
            ints[row, 12 : 12 + len(table[:, start:])] = table[:, start:].sum(axis=1)
            row += 1
    ints[row, :4] = table[-1, -2], table[2][-1], table[::-1][0, 1], table[:, ::-1][0, 0]


@kernel
def halves(values, share) -> Half:
    """Return the first part of an array, a changed copy of the rest, and a number."""
    middle = int(len(values) * share)
    return Half(values[:middle], values[middle:] * 2.0, share)


@kernel
def fill(values, start) -> int:
    """Count upwards, and return how many there are."""
    for place in range(len(values)):
        values[place] = start + place
    return len(values)


@kernel
def first_above(values, least):
    """Return the first value above another one and its place; -1 for none."""
    for place, value in enumerate(values):
        if value > least:
            return value, place
    return NOTHING, -1


@kernel
def of_control(a, i, f, floats, ints):
    """Loops, branches, variables that outlive them, tuples and calls."""
    last, seen, kept = -1, 0, 0.0
    for value in a:
        if math.isnan(value):
            continue
        if value > 50.0:
            kept = value
            break
        seen += 1
        if seen == 2:
            flag = 3
        elif seen > 2:
            flag = 4
        else:
            flag = 5
        last = flag
    ints[0, :3], floats[0, 0] = (last, seen, len(a)), kept
    rounds = 0
    while rounds < 7 and last > 0:
        rounds += 2
        if rounds == 6:
            last = -last
    ints[1, 0], ints[1, 1] = rounds, last
    x, y = a[1], a[2]
    x, y = y, x
    floats[1, 0], floats[1, 1] = x, y
    place = 3
    place, ints[2, place] = 1, place
    ints[2, 0] = place
    for index in range(3, -4, -3):
        ints[3, index + 3] = index
    ints[3, 12] = index
    for number, (one, two) in ((0, (1.0, 2.0)), (1, (3.0, 4.0))):
        floats[2, number] = one - two
    for step in STEPS:
        ints[4, step] = step * step
    for left, right in zip(a[1:4], i[2:9]):  # noqa: B905  # Numba knows no strict
        floats[3, right % 5] = left
    (value, at), none = first_above(a, 1.0), first_above(a, math.inf)
    floats[4, 0], floats[4, 1], ints[5, 0], ints[5, 1] = value, none[0], at, none[1]
    parts = halves(a[:6], 0.5)
    floats[5, :3], floats[5, 3:6], floats[5, 6] = parts.values, parts.rest, parts.share
    parts.values[0] = a[5]
    floats[5, 7] = a[0]
    point = Point(a[1], 0.25, False)
    other = HERE if point.counts else Point(2.0, 3.0, True)
    floats[6, :4] = point.x, point.y, other.x, HERE.y
    ints[6, 0], ints[6, 1] = fill(floats[7, 2:6], 4), other.counts
    _, ignored = first_above(a, 0.0)
    total = most = 0.0
    floats[8, 2] = a[:11].sum()
    for row in WEIGHTS:
        for cell in row:
            total += cell
            most = max(most, cell)
    floats[8, 0], floats[8, 1], ints[7, 0] = total, most, ignored


KERNELS = (of_floats, of_ints, of_singles, of_elements, of_arrays, of_slices, of_control)
