"""The data of a replay page: whole numbers, differences in time, byte planes, deflated.

The bytes, after inflating with zlib: the length of the head as a little-endian uint32, the head as JSON, then the
columns that the head lists, one after the other. A column is ``name``, ``rows`` (22 players, or 1), ``bytes`` of a
number, ``order`` of the differences and ``step``. Its numbers stand row by row, each row over all frames:

1. values are divided by ``step`` and rounded; the least number of ``bytes`` means "not known";
2. ``order`` times, each number becomes its difference from the one before in its row, modulo the range of ``bytes``;
3. signs are folded into the lowest bit: 0, -1, 1, -2 become 0, 1, 2, 3;
4. all lowest bytes come first, then all second ones, and so on.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FORMAT = 1
"""Format number of the data; page and data are written together, so it is for other readers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Coding:
    """How a column is written.

    Attributes:
        step: resolution, in the column's unit. bytes: of a number. order: of the differences in time.
    """

    step: float
    bytes: int = 2
    order: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One column of the data: ``values`` are (n_frames,) or (n_frames, 22), NaN where not known."""

    name: str
    coding: Coding
    values: NDArray[Any]


def packed(head: Mapping[str, Any], channels: Iterable[Channel]) -> bytes:
    """Return head and channels as the bytes above, deflated; channels that are nowhere known are left out."""
    listed, parts = [], []
    for channel in channels:
        values = np.atleast_2d(np.asarray(channel.values, np.float64).T)
        if np.isnan(values).all():
            continue
        coding = channel.coding
        listed.append(
            {
                "name": channel.name,
                "rows": len(values),
                "bytes": coding.bytes,
                "order": coding.order,
                "step": coding.step,
            }
        )
        parts.append(_coded(values, coding))
    text = json.dumps({"format": FORMAT, **head, "columns": listed}, allow_nan=False).encode()
    return zlib.compress(b"".join([struct.pack("<I", len(text)), text, *parts]), 9)


def _coded(values: NDArray[np.float64], coding: Coding) -> bytes:
    """Return (rows, n_frames) values as bytes."""
    bits = 8 * coding.bytes
    unknown = -(1 << (bits - 1))
    with np.errstate(invalid="ignore"):
        rounded = np.clip(np.rint(values / coding.step), unknown + 1, -unknown - 1)
    numbers = np.where(np.isnan(values), unknown, rounded).astype(np.int64)
    for _ in range(coding.order):
        numbers = np.diff(numbers, prepend=0, axis=1)
    wrapped = ((numbers - unknown) & ((1 << bits) - 1)) + unknown
    folded = ((wrapped << 1) ^ (wrapped >> 63)).ravel()
    return b"".join(((folded >> (8 * place)) & 0xFF).astype(np.uint8).tobytes() for place in range(coding.bytes))
