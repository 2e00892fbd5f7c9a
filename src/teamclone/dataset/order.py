"""The order in which training sees the samples: a pure function of seed and epoch, so that a run resumes exactly."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


def epoch_order(
    n: int,
    *,
    seed: int,
    epoch: int,
    slice_rows: int,
    draws: NDArray[np.floating] | None = None,
    repeat: bool = False,
) -> NDArray[np.int64]:
    """Return the rows of one epoch, (rows,), each in 0..n-1 and, without ``draws`` and ``repeat``, at most once.

    The paper's slices: all rows are shuffled once and cut into slices; each epoch takes the next slice, round robin,
    and shuffles it again. The slices are of equal length (± 1), so that none is a small rest, and as near to
    ``slice_rows`` as that allows. With ``draws`` each round over the slices begins with drawing its rows anew.

    Args:
        n: number of rows.
        seed: of both shuffles.
        epoch: from 0.
        slice_rows: how long a slice should be.
        draws: (n,) how often each row is to come in a round, on average over the rounds; in one round it comes that
            often rounded down or up. Their sum, rounded, is the number of rows of a round.
        repeat: with fewer rows than ``slice_rows`` an epoch makes round(sqrt(slice_rows / rows)) rounds, a compromise
            between one pass over the rows and as many steps as ``slice_rows`` would take.
    """
    rows = _shuffled(n, seed)
    total = n if draws is None else max(1, round(float(draws.sum(dtype=np.float64))))
    slices = max(1, round(total / slice_rows))
    rounds = max(1, round((slice_rows / total) ** 0.5)) if repeat else 1
    turn, index = divmod(epoch, slices)
    random = np.random.default_rng((seed, 1, epoch))
    parts = []
    for number in range(turn * rounds, (turn + 1) * rounds):
        drawn = rows
        if draws is not None:
            drawn = _drawn(rows, draws[rows], total, offset=np.random.default_rng((seed, 3, number)).random())
        parts.append(random.permutation(drawn[index * total // slices : (index + 1) * total // slices]))
    return np.concatenate(parts).astype(np.int64)


def epoch_mirrored(n: int, *, seed: int, epoch: int, share: float) -> NDArray[np.bool_]:
    """Return (n,) whether each sample of an epoch's order is mirrored: each with probability ``share``."""
    return np.random.default_rng((seed, 4, epoch)).random(n) < share


def _drawn(rows: NDArray[np.integer], draws: NDArray[np.floating], total: int, *, offset: float) -> NDArray[np.integer]:
    """Return ``total`` of the rows by systematic resampling (Kitagawa 1996).

    Row i appears ``draws[i] * total / draws.sum()`` times on average, rounded down or up. ``offset`` is in [0, 1).
    """
    ends = np.cumsum(draws, dtype=np.float64)
    ends *= total / ends[-1]
    ends[-1] = total
    return np.repeat(rows, np.diff(np.floor(ends + offset), prepend=np.floor(offset)).astype(np.int64))


@lru_cache(maxsize=1)
def _shuffled(n: int, seed: int) -> NDArray[np.integer]:
    """Return the shuffle that all epochs share; kept, because 58 million rows take seconds."""
    rows: NDArray[np.integer] = np.arange(n, dtype=np.int32 if n <= np.iinfo(np.int32).max else np.int64)
    np.random.default_rng((seed, 0)).shuffle(rows)
    rows.setflags(write=False)
    return rows
