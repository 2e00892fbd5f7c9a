"""How far roll-outs are from what happened, by cycles ahead."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

HORIZONS = (1, 2, 5, 10, 20, 30, 50, 75, 100)
"""Cycles ahead that are shown, those up to the horizon of a roll-out, and the horizon itself."""
INTERVAL = 0.9
"""Share of the samples that an interval of a coordinate holds, between quantiles of both ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ahead:
    """Errors of some bodies so many cycles ahead, in metres, over all starts whose stretch of play reaches as far.

    Attributes:
        cycles: ahead. starts: how many.
        fde: final displacement error: distance of a sample's end from the true one, the mean over samples and bodies.
        ade: the same along the way, the mean over its cycles (average displacement error).
        mean_fde: distance of the samples' mean from the truth.
        min_fde, min_ade: of the best sample of each start, its bodies together: one sample for all of them.
        coverage: share of true coordinates within the `INTERVAL` of the samples. crps: continuous ranked probability
            score of a coordinate, metres. Both NaN with a single sample.
    """

    cycles: int
    starts: int
    fde: float
    ade: float
    mean_fde: float
    min_fde: float
    min_ade: float
    coverage: float
    crps: float


def measure(
    sampled: NDArray[np.floating], truth: NDArray[np.floating], there: NDArray[np.bool_], reach: NDArray[np.int64]
) -> list[Ahead]:
    """Return the errors of some bodies by cycles ahead.

    Args:
        sampled: (starts, samples, horizon + 1, bodies, 2) metres. truth: (starts, horizon + 1, bodies, 2).
        there: (starts, bodies) which bodies count. reach: (starts,) cycles that the stretch of play goes on.
    """
    horizon = truth.shape[1] - 1
    found = []
    for ahead in sorted({*(cycles for cycles in HORIZONS if cycles <= horizon), horizon}):
        rows = (reach >= ahead) & there.any(axis=1)
        if rows.any():
            found.append(_ahead(sampled[rows], truth[rows], there[rows], ahead))
    return found


def _ahead(sampled: NDArray[np.floating], truth: NDArray[np.floating], there: NDArray[np.bool_], ahead: int) -> Ahead:
    off = sampled[:, :, 1 : ahead + 1].astype(np.float64) - truth[:, None, 1 : ahead + 1]
    distance = np.linalg.norm(off, axis=-1)
    # Means over the bodies of a start, (starts, samples, ahead): each start has the same weight.
    weight = there / there.sum(axis=1, keepdims=True)
    of_start = np.einsum("skhb,sb->skh", distance, weight)
    mean = np.linalg.norm(off[:, :, -1].mean(axis=1), axis=-1)
    last, true = sampled[:, :, ahead].astype(np.float64), truth[:, ahead].astype(np.float64)
    coverage = crps = float("nan")
    if last.shape[1] > 1:
        low, high = np.quantile(last, [(1 - INTERVAL) / 2, (1 + INTERVAL) / 2], axis=1)
        coverage = float(((true >= low) & (true <= high))[there].mean())
        crps = float(_crps(last, true)[there].mean())
    return Ahead(
        cycles=ahead,
        starts=len(truth),
        fde=float(of_start[..., -1].mean()),
        ade=float(of_start.mean()),
        mean_fde=float((mean * weight).sum(axis=1).mean()),
        min_fde=float(of_start[..., -1].min(axis=1).mean()),
        min_ade=float(of_start.mean(axis=-1).min(axis=1).mean()),
        coverage=coverage,
        crps=crps,
    )


def _crps(samples: NDArray[np.float64], truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (starts, bodies, 2) E|X - y| - E|X - X'| / 2 over (starts, samples, bodies, 2), by sorted samples."""
    n = samples.shape[1]
    ordered = np.sort(samples, axis=1)
    # The mean distance of two different samples: each counts by how many are below and above it.
    rank = (2 * np.arange(n) - n + 1)[None, :, None, None]
    between = 2 * (rank * ordered).sum(axis=1) / (n * (n - 1))
    crps: NDArray[np.float64] = np.abs(samples - truth[:, None]).mean(axis=1) - between / 2
    return crps
