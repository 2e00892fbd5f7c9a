"""How well one who knows the other matches foresees what is done in a match, and where it is always the same."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.scout.measures import Figure, ratio, wilson

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]

LEAST = 20
"""A habit is seen at least so often."""
SURE = 0.8
"""And the lower end of the interval of its share is at least this,"""
NEARLY_ALWAYS = 0.95
"""or its share itself is at least this."""


def foreseen(each: Floats) -> tuple[Floats, Floats]:
    """Return (n_matches,) how many decisions of a match are foreseen, and how many there are; see `hits`."""
    axes = tuple(range(1, each.ndim - 1))
    return hits(each).sum(axes), each.sum((*axes, -1)).astype(np.float64)


def hits(each: Floats) -> Floats:
    """Return (n_matches, ...) how many decisions of a match are what the other matches have most often in their cell.

    Args:
        each: (n_matches, ..., answers) how often each answer was given in a cell.
    """
    others = each.sum(0) - each
    usual = others.argmax(-1)
    found = np.take_along_axis(each, usual[..., None], -1)[..., 0]
    seen: Floats = np.where(others.sum(-1) > 0, found, 0).astype(np.float64)
    return seen


def entropy(counts: Floats) -> Floats:
    """Return the entropy (...) of counts (..., answers), bits, corrected for few of them (Miller 1955); NaN of none."""
    n = counts.sum(-1, keepdims=True, dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = counts / n
        bits = -np.where(counts > 0, share * np.log2(share), 0.0).sum(-1)
        found: Floats = bits + ((counts > 0).sum(-1) - 1) / (2 * np.log(2) * n[..., 0])
    return np.where(n[..., 0] > 0, found, np.nan)


def mean_entropy(counts: Floats) -> float | None:
    """Return the mean entropy of cells (..., answers) in bits, by how many decisions each holds; None of none."""
    n = counts.sum(-1, dtype=np.float64)
    return float(np.nansum(entropy(counts) * n) / n.sum()) if n.sum() else None


def share(parts: Floats, wholes: Floats) -> Figure:
    """Return a share of decisions over matches (n_matches,), its interval the wider of two.

    Resampled matches show no spread of what is always the same, and Wilson's interval (1927) none between matches.
    """
    one = ratio(parts, wholes)
    if one.value is None or one.low is None or one.high is None:
        return one
    low, high = wilson(one.value, int(wholes.sum()))
    return replace(one, low=min(low, one.low), high=max(high, one.high))


@dataclass(frozen=True, slots=True, kw_only=True)
class Habit:
    """A cell in which nearly always the same is done.

    Attributes:
        cell: its index, the last one None where it does not matter. answer: what is done.
        parts, wholes: (n_matches,) how often this was done, and how often anything.
    """

    cell: tuple[int | None, ...]
    answer: int
    parts: Floats
    wholes: Floats

    @property
    def share(self) -> float:
        """How much of all that is done there it is."""
        return float(self.parts.sum() / self.wholes.sum())

    @property
    def least(self) -> float:
        """The lower end of the interval of its share."""
        return wilson(self.share, int(self.wholes.sum()))[0]


def habits(each: Floats, *, sure: float = SURE, names: Sequence[int] | None = None) -> list[Habit]:
    """Return the habits, those seen most often first.

    A habit that holds whatever the last index of the cell is one habit, not two.

    Args:
        each: (n_matches, ..., 2, answers) how often each answer was given in a cell. sure: see SURE.
        names: (answers,) how a habit calls them; None for their index.
    """
    found: list[Habit] = []
    for cell in np.ndindex(each.shape[1:-2]):
        here = each[(slice(None), *cell)]
        both = list(_habits(here.sum(1), (*cell, None), sure, names))
        found += both or [one for last in range(2) for one in _habits(here[:, last], (*cell, last), sure, names)]
    return sorted(found, key=lambda one: -float(one.parts.sum()))


def _habits(counts: Floats, cell: tuple[int | None, ...], sure: float, names: Sequence[int] | None) -> Iterator[Habit]:
    """Yield the habit of a cell (n_matches, answers), if there is one."""
    if counts.sum() < LEAST:
        return
    answer = int(counts.sum(0).argmax())
    one = Habit(
        cell=cell,
        answer=answer if names is None else names[answer],
        parts=counts[:, answer].astype(np.float64),
        wholes=counts.sum(1).astype(np.float64),
    )
    if one.least >= sure or one.share >= NEARLY_ALWAYS:
        yield one
