"""Whose commands are these? The team whose clone predicts them best."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.similarity.watched import Watched

WINDOWS = {"500 cycles": 500, "half a match": None, "a match": None}
"""How much of a match is looked at; the second are its halves by frames."""
_PARTS = {"half a match": 2, "a match": 1}


def guesses(watched: Sequence[Watched], clones: Sequence[str]) -> list[dict[str, Any]]:
    """Say whose each stretch of a match is, as if its teams were unknown.

    Args:
        watched: matches of teams that have a clone among ``clones``; others are left out.

    Returns:
        For each of WINDOWS the number of stretches, the ``right`` ones, and for each team how often it was taken for
        each clone's.
    """
    found = []
    for window in WINDOWS:
        taken = np.zeros((len(clones), len(clones)), np.int64)
        for one in watched:
            if one.team in clones:
                for loss in stretches(one, window):
                    taken[clones.index(one.team), int(loss.argmin())] += 1
        found.append(
            {"window": window, "stretches": int(taken.sum()), "right": int(np.trace(taken)), "taken": taken.tolist()}
        )
    return found


def stretches(one: Watched, window: str) -> Iterator[NDArray[np.float64]]:
    """Yield (clones,) the summed log loss of each stretch; what is left of a match after the last whole one is not."""
    frames = one.loss.shape[1]
    size = WINDOWS[window] or frames // _PARTS[window]
    for begin in range(0, frames - size + 1, max(size, 1)):
        if size:
            yield one.loss[:, begin : begin + size].sum(1)
