"""Which differences are more than chance: permutations of whole matches, corrected for the number of comparisons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

PERMUTATIONS = 5000
RATE = 0.1
"""False discovery rate: of the differences that are called more than chance, this share is chance."""
SEED = 0


def swapped(own: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> float:
    """Return how probable a difference of two ratios at least as great is if teams of a match changed places.

    Args:
        own, other: parts and wholes (n_matches,) of two teams in the same matches.
    """
    swap = np.random.default_rng(SEED).random((PERMUTATIONS, len(own[0]))) < 0.5
    sums = [np.where(swap, theirs, ours).sum(1) for ours, theirs in zip((*own, *other), (*other, *own), strict=True)]
    return _p_value(_apart(*(float(values.sum()) for values in (*own, *other))), _apart(*sums))


def permuted(before: tuple[Floats, Floats], since: tuple[Floats, Floats], strata: Sequence[str]) -> float:
    """Return how probable a difference of two ratios at least as great is if matches of two sets changed places.

    Args:
        before, since: parts and wholes of the matches of both sets.
        strata: of each match of the first set, then of the second: only matches of one stratum change places.
    """
    parts, wholes = (np.concatenate(both) for both in zip(before, since, strict=True))
    second = np.arange(len(parts)) >= len(before[0])
    rng = np.random.default_rng(SEED)
    drawn = np.tile(second, (PERMUTATIONS, 1))
    for name in sorted(set(strata)):
        these = np.flatnonzero(np.array(strata) == name)
        drawn[:, these] = rng.permuted(drawn[:, these], axis=1)

    def apart(later: NDArray[np.bool_]) -> Floats:
        found: Floats = _apart(later @ parts, later @ wholes, ~later @ parts, ~later @ wholes)
        return found

    return _p_value(apart(second[None])[0], apart(drawn))


def discoveries(p_values: Sequence[float]) -> Floats:
    """Return p-values corrected for their number (Benjamini and Hochberg 1995), NaN where one is."""
    from scipy.stats import false_discovery_control

    corrected = np.array(p_values, float)
    known = np.isfinite(corrected)
    if known.any():
        corrected[known] = false_discovery_control(corrected[known])
    return corrected


def _apart(part: Any, whole: Any, other_part: Any, other_whole: Any) -> Any:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.divide(part, whole) - np.divide(other_part, other_whole)


def _p_value(found: float, drawn: Floats) -> float:
    """Return the share of draws at least as far from zero, the found one counted, too; NaN where it is not known."""
    known = drawn[np.isfinite(drawn)]
    if not np.isfinite(found) or not len(known):
        return float("nan")
    # Equal sums in another order differ in their last digits.
    return float((1 + (np.abs(known) >= abs(found) * (1 - 1e-9)).sum()) / (1 + len(known)))
