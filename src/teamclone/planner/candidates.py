"""Ways to play the ball as rows of a table: the first in the order of their values that is free is the best.

Each kind has a loop of its own over them, since Numba caches no function that is given another one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from teamclone.planner.scene import Array
from teamclone.system.compiling import kernel

VALUE = 0
"""Column of what a candidate is worth."""

Mask = NDArray[np.bool_]


@kernel
def cut(allowed: Mask, ends: Mask, begins: NDArray[np.int64]) -> None:
    """Allow no place of a row from the first on that ends the row.

    Args:
        allowed, ends: (n,) of places in rows. begins: (rows + 1,) where each row begins, and the last ends.
    """
    for row in range(len(begins) - 1):
        ending = np.flatnonzero(ends[begins[row] : begins[row + 1]])
        if len(ending):
            allowed[begins[row] + ending[0] : begins[row + 1]] = False


@kernel
def by_value(made: Array) -> NDArray[np.int64]:
    """Return (len(made),) the rows from the greatest value on; of equal ones the first comes first."""
    return np.argsort(-made[:, VALUE], kind="mergesort")


@kernel
def nothing(columns: int) -> Array:
    """Return (columns,) what is found where no candidate is free: its value is minus infinity."""
    none = np.zeros(columns)
    none[VALUE] = -np.inf
    return none
