"""95 % intervals by resampling whole matches.

Players and neighbouring cycles of a match depend on each other, so rows are not independent draws; matches nearly are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from teamclone.evaluation.metrics import Counts, Floats, Sums

N_RESAMPLES = 1000
LEVEL = 0.95
FEW_MATCHES = 10
"""With fewer matches a percentile interval is clearly too narrow, and the report warns of it."""


def draw(n_matches: int, *, seed: int, n_resamples: int = N_RESAMPLES) -> Counts:
    """Return how often each match occurs in each resample: (n_resamples, n_matches), every row sums to n_matches.

    Equal seeds give equal resamples, so differences between two models on the same matches are paired.
    """
    generator = np.random.default_rng(seed)
    return generator.multinomial(n_matches, np.full(n_matches, 1.0 / n_matches), size=n_resamples).astype(np.int64)


def resample(sums: Sums, occurrences: Counts) -> Sums:
    """Return the totals of every resample: per-match sums (n_matches, ...) become (n_resamples, ...)."""
    weights = occurrences.astype(np.float64)
    return Sums(*(np.tensordot(weights, values, axes=1) for values in sums))


def interval(values: NDArray[np.floating], *, level: float = LEVEL) -> tuple[Floats, Floats]:
    """Return a percentile interval over the first axis, ignoring NaN; NaN where all are NaN (Efron 1979).

    A figure that is undefined in some resamples (the recall of a command that few matches hold) gets its interval from
    the others.
    """
    low, high = np.full(values.shape[1:], np.nan), np.full(values.shape[1:], np.nan)
    known = np.isfinite(values).any(axis=0)
    tail = 100.0 * (1.0 - level) / 2.0
    if known.any():
        low[known], high[known] = np.nanpercentile(values[:, known], [tail, 100.0 - tail], axis=0)
    return low, high
