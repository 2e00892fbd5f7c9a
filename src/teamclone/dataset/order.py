"""The order in which training sees the samples: a pure function of seed and epoch, so that a run resumes exactly."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


def epoch_order(n: int, *, seed: int, epoch: int, slice_rows: int) -> NDArray[np.int64]:
    """The rows of one epoch, (rows,), each in 0..n-1 and at most once.

    The paper's slices: all rows are shuffled once and cut into slices; each epoch takes the next slice, round robin,
    and shuffles it again. The slices are as many as ``slice_rows`` asks for at least and of equal length (± 1), so
    that none is a small rest.

    Args:
        n: number of rows.
        seed: of both shuffles.
        epoch: from 0.
        slice_rows: the longest that a slice may be.
    """
    shuffled = _shuffled(n, seed)
    slices = max(1, -(-n // slice_rows))
    index = epoch % slices
    part = shuffled[index * n // slices : (index + 1) * n // slices]
    return np.random.default_rng((seed, 1, epoch)).permutation(part).astype(np.int64)


@lru_cache(maxsize=1)
def _shuffled(n: int, seed: int) -> NDArray[np.integer]:
    """The shuffle that all epochs share; kept, because 58 million rows take seconds."""
    rows: NDArray[np.integer] = np.arange(n, dtype=np.int32 if n <= np.iinfo(np.int32).max else np.int64)
    np.random.default_rng((seed, 0)).shuffle(rows)
    rows.setflags(write=False)
    return rows
