"""Parts of the pitch, in the frame of reference of a team that attacks +x."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.rcss import pitch

Floats = NDArray[np.floating[Any]]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

THIRDS = ("own third", "middle third", "attacking third")
LANES = ("left", "centre", "right")
"""Across the pitch, as a player sees it that looks towards the opponent's goal: -y is left."""
GRID = (6, 4)
"""Zones along and across the pitch of maps."""


def third(x: Floats) -> Ints:
    """Return the third of the pitch (n,), an index of THIRDS."""
    edges = np.array([-1, 1]) * pitch.LENGTH / 6
    found: Ints = np.searchsorted(edges, x).astype(np.int64)
    return found


def lane(y: Floats) -> Ints:
    """Return the lane (n,), an index of LANES; the central one is as wide as the penalty area."""
    edges = np.array([-1, 1]) * pitch.PENALTY_AREA_WIDTH / 2
    found: Ints = np.searchsorted(edges, y).astype(np.int64)
    return found


def in_lane(name: str) -> str:
    """Return one of LANES in a sentence."""
    return "in the centre" if name == "centre" else f"on the {name}"


def in_their_box(x: Floats, y: Floats) -> Bools:
    """Return whether places (n,) are in the opponent's penalty area."""
    found: Bools = (x > pitch.HALF_LENGTH - pitch.PENALTY_AREA_LENGTH) & (np.abs(y) < pitch.PENALTY_AREA_WIDTH / 2)
    return found


def to_goal(x: Floats, y: Floats) -> Floats:
    """Return the distance (n,) to the middle of the opponent's goal, m."""
    found: Floats = np.hypot(pitch.HALF_LENGTH - x, y)
    return found


def summed(places: Floats) -> Floats:
    """Return (m, 3) sums of the places of m players in n frames (n, m, 2), and in how many they are known."""
    there: Bools = np.all(np.isfinite(places), axis=-1)
    found: Floats = np.concatenate([np.where(there[..., None], places, 0).sum(0), there.sum(0)[:, None]], axis=1)
    return found


def mean_of(sums: Floats) -> Floats:
    """Return the mean places (m, 2) of `summed` ones; NaN where none is known."""
    with np.errstate(invalid="ignore"):
        found: Floats = sums[:, :2] / sums[:, 2:]
    return found


def counted(x: Floats, y: Floats, weight: Floats | None = None) -> Floats:
    """Return how many places (n,), or which sum of weights (n,), lie in each zone of GRID; beyond it, the edge's."""
    there = np.isfinite(x) & np.isfinite(y)
    along, across = (
        np.clip(((value[there] / size + 0.5) * n).astype(np.int64), 0, n - 1)
        for value, size, n in zip((x, y), (pitch.LENGTH, pitch.WIDTH), GRID, strict=True)
    )
    weights = None if weight is None else weight[there]
    counts = np.bincount(along * GRID[1] + across, weights=weights, minlength=GRID[0] * GRID[1])
    found: Floats = counts.reshape(GRID).astype(np.float64)
    return found
