"""How far a clone's matches are from the original's, in units of how far these are from each other.

The unit of a statistic is the mean distance between two halves of the original's matches, over random splits. The
clone's distance is the mean between such a half and equally many of its own matches. Matches of a clone that plays just
as the original does are matches like the others, so that their quotient is then about 1, however many there are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.comparison.profile import Floats
from teamclone.evaluation import bootstrap

Measure = Callable[[Floats, Floats, Floats, Floats], Floats]
"""Matches (n, ...), which of them (draws, n) 0 or 1, the same of other matches; distances (draws, n_statistics)."""
Strata = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pairing:
    """Matches of two teams against the same opponents, drawn from opponent by opponent.

    Attributes:
        original, clone: (n,) and (m,) the opponent of each match, from 0.
        sizes: (n_opponents,) how many matches of each a half has: what the original has twice and the clone once.
    """

    original: Strata
    clone: Strata
    sizes: NDArray[np.int64]

    @classmethod
    def of(cls, original: Sequence[str], clone: Sequence[str]) -> Pairing:
        """Pair matches by the names of their opponents, which are the same ones."""
        names, first = np.unique(np.asarray(original, object).astype("U"), return_inverse=True)
        second = np.searchsorted(names, np.asarray(clone, object).astype("U"))
        counts = [np.bincount(each, minlength=len(names)) for each in (first, second)]
        return cls(original=first, clone=second, sizes=np.minimum(counts[0] // 2, counts[1]))

    @property
    def half(self) -> int:
        """Matches of a half."""
        return int(self.sizes.sum())

    def weights(self) -> tuple[Floats, Floats]:
        """Return the weight of each match in means, such that both have the opponents of a half in equal parts."""
        shares = self.sizes / self.half if self.half else np.full(len(self.sizes), 1.0 / len(self.sizes))
        first, second = (
            (shares / np.bincount(each, minlength=len(shares)))[each] for each in (self.original, self.clone)
        )
        return first, second

    def draw(self, n: int, *, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
        """Draw ``n`` times two halves of the original, (n, N) 0 or 1, and as many matches of the clone, (n, M)."""
        return (*_parts(self.original, self.sizes, n, 2, rng), *_parts(self.clone, self.sizes, n, 1, rng))

    def resample(self, *, rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Draw whole matches with replacement, as many against each opponent as there are."""
        return _resample(self.original, rng), _resample(self.clone, rng)


def _parts(strata: Strata, sizes: NDArray[np.int64], n: int, parts: int, rng: np.random.Generator) -> Floats:
    made = np.zeros((parts, n, len(strata)))
    for stratum, size in enumerate(sizes):
        these = np.flatnonzero(strata == stratum)
        rank = rng.random((n, len(these))).argsort(axis=1).argsort(axis=1)
        for part in range(parts):
            made[part][:, these] = (rank >= part * size) & (rank < (part + 1) * size)
    return made


def _resample(strata: Strata, rng: np.random.Generator) -> NDArray[np.int64]:
    drawn = np.empty(len(strata), np.int64)
    for stratum in np.unique(strata):
        these = np.flatnonzero(strata == stratum)
        drawn[these] = rng.choice(these, len(these))
    return drawn


# Measures


def means(values: Floats, weights: Floats) -> Floats:
    """Return weighted means (draws, n_statistics) of numbers (n, n_statistics), of those that are known."""
    known = np.isfinite(values)
    with np.errstate(invalid="ignore", divide="ignore"):
        found: Floats = (weights @ np.where(known, values, 0.0)) / (weights @ known)
    return found


def of_means(one: Floats, of_one: Floats, other: Floats, of_other: Floats) -> Floats:
    """Measure the distance of two means."""
    return np.abs(means(one, of_one) - means(other, of_other))


def cumulated(counts: NDArray[np.integer]) -> Floats:
    """Return histograms (..., bins) as counts up to the end of each bin, which sums over matches keep.

    In single precision, which has every whole number up to 16 million and is twice as fast.
    """
    return counts.cumsum(axis=-1).astype(np.float32)


def _apart(one: Floats, other: Floats) -> Floats:
    """Return the Wasserstein distance, in bins, of cumulated histograms (..., bins); NaN where one is empty."""
    with np.errstate(invalid="ignore", divide="ignore"):
        apart = one / one[..., -1:]
        apart -= other / other[..., -1:]
    found: Floats = np.abs(apart, out=apart).sum(axis=-1)
    return found


def of_histograms(one: Floats, of_one: Floats, other: Floats, of_other: Floats) -> Floats:
    """Measure the Wasserstein distance, in bins, of one histogram: values (n, bins), `cumulated`."""
    return _apart(of_one @ one, of_other @ other)[:, None]


def cells(one: Floats, of_one: Floats, other: Floats, of_other: Floats) -> tuple[Floats, Floats]:
    """Return distances and weights (draws, 11, 2, 9) of places by player, axis and zone, `cumulated`.

    The distance is in bins, the weight the share of the player's time with the ball there that both have.
    """
    first, second = (
        np.tensordot(which.astype(values.dtype), values, axes=1) for which, values in ((of_one, one), (of_other, other))
    )
    totals = [each[..., -1] for each in (first, second)]
    with np.errstate(invalid="ignore", divide="ignore"):
        weight = np.minimum(*(total / total.sum(axis=(1, 2, 3), keepdims=True) for total in totals))
    return np.where(weight > 0, _apart(first, second), 0.0), weight


def of_places(one: Floats, of_one: Floats, other: Floats, of_other: Floats) -> Floats:
    """Measure the mean Wasserstein distance of places, in bins; values (n, 11, 2, 9, bins), `cumulated`."""
    return averaged(*cells(one, of_one, other, of_other), axes=(1, 2, 3))[:, None]


def averaged(distance: Floats, weight: Floats, *, axes: tuple[int, ...]) -> Floats:
    """Return the weighted mean of `cells` over some of their axes; NaN where there is no weight."""
    with np.errstate(invalid="ignore", divide="ignore"):
        found: Floats = (distance * weight).sum(axis=axes) / weight.sum(axis=axes)
    return found


# Distances in units


@dataclass(frozen=True, slots=True, kw_only=True)
class Distances:
    """Distances of some statistics, (n_statistics,) each.

    Attributes:
        own: between two halves of the original. clone: between such a half and the clone.
        low, high: 95 % interval of ``units``; infinite where the own distance may be 0, NaN where there is none.
    """

    own: Floats
    clone: Floats
    low: Floats
    high: Floats

    @property
    def units(self) -> Floats:
        """How many own distances the clone is away; infinite or NaN where the own distance is 0."""
        with np.errstate(invalid="ignore", divide="ignore"):
            found: Floats = self.clone / self.own
        return found


def measured(
    measure: Measure,
    pairing: Pairing,
    original: Floats,
    clone: Floats,
    *,
    seed: int,
    draws: int,
    resamples: int,
    draws_each: int,
) -> Distances:
    """Measure a clone's distance and the original's own.

    Args:
        original, clone: (N, ...) and (M, ...) values of matches.
        seed: of the draws. draws: how many. resamples: of the interval, each with ``draws_each`` draws.
    """
    rng = np.random.default_rng(seed)

    def once(first: Floats, second: Floats, n: int) -> tuple[Floats, Floats]:
        half, rest, others = pairing.draw(n, rng=rng)
        return _mean(measure(first, half, first, rest)), _mean(measure(first, half, second, others))

    own, apart = once(original, clone, draws)
    again = []
    for _ in range(resamples):
        first, second = pairing.resample(rng=rng)
        again.append(once(original[first], clone[second], draws_each))
    owns, aparts = (np.array(each) for each in zip(*again, strict=True))
    # An angle orders quotients, those by 0 included, and has none that is infinite.
    angle = np.where((owns == 0) & (aparts == 0), np.nan, np.arctan2(aparts, owns))
    low, high = (np.tan(bound) for bound in bootstrap.interval(angle))
    return Distances(own=own, clone=apart, low=_bounded(low), high=_bounded(high))


def mean_interval(values: Floats, strata: Strata, weights: Floats, *, seed: int, resamples: int) -> tuple[Floats, ...]:
    """Return the weighted mean of matches (n, n_statistics) with its 95 % interval, three arrays (n_statistics,)."""
    rng = np.random.default_rng(seed)
    occurs = np.array([np.bincount(_resample(strata, rng), minlength=len(strata)) for _ in range(resamples)])
    return (means(values, weights[None])[0], *bootstrap.interval(means(values, occurs * weights)))


def _mean(values: Floats) -> Floats:
    """Return the mean over the first axis of what is known there, NaN where nothing is."""
    found: Floats = means(values, np.ones((1, len(values))))[0]
    return found


_UNBOUNDED = 1e9


def _bounded(values: Floats) -> Floats:
    return np.where(np.abs(values) > _UNBOUNDED, np.inf, values)
