"""``Candidates``: values that a parameter may have had, command by command, with how likely each made the outcome."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

CONFIDENCE = 0.9
"""The share of intervals that contain the truth."""

OF_TWO_ROUNDINGS = 1.0 - (1.0 - CONFIDENCE) ** 0.5
"""Within this share of a step lies the sum of two rounding errors, each uniform on half a step to both sides."""

_ROUNDS = 40
"""Steps of expectation and maximisation in which habits are learned."""
_LEARNED_FROM = 5000
"""Commands a group that habits are learned from: more change nothing."""
_RARE = 1e-3
"""A value that makes up a smaller share of a group's commands is no habit."""
_FLOOR = 1e-2
"""The share that all values have together that are no habit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidates:
    """Candidates of n commands, those of each command in a row. Each command has one at least.

    Attributes:
        start: (n + 1,) int64, where the candidates of each command begin.
        number: (m,) int64, a candidate's number among all values that the parameter can have.
        likelihood: (m,) float64, of what was seen if this were the value; 0 where it is impossible.
    """

    start: NDArray[np.int64]
    number: NDArray[np.int64]
    likelihood: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.start) - 1

    @property
    def count(self) -> NDArray[np.int64]:
        """(n,) how many candidates each command has."""
        return np.diff(self.start)

    def of(self, commands: NDArray[np.int64]) -> Self:
        """Return the candidates of some commands, in their order."""
        count = self.count[commands]
        start = starts(count)
        keep = np.arange(start[-1]) + np.repeat(self.start[commands] - start[:-1], count)
        return type(self)(start=start, number=self.number[keep], likelihood=self.likelihood[keep])

    def shares(self, weights: NDArray[Any] | float = 1.0) -> NDArray[np.float64]:
        """Return (m,) likelihoods times weights as shares of the sum of their command; 0 where all are 0."""
        if not len(self):
            return np.zeros(0)
        weighted = self.likelihood * weights
        total = np.add.reduceat(weighted, self.start[:-1])
        total[total == 0] = 1.0
        shares: NDArray[np.float64] = weighted / np.repeat(total, self.count)
        return shares

    def interval(
        self, shares: NDArray[np.float64], *, middle: float = CONFIDENCE
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return (n,) the ends of the middle share of candidates, as places in a row of all candidates.

        A candidate's share lies evenly on its place and half a step to both sides.
        """
        upto = np.cumsum(shares)
        first = np.concatenate([[0.0], upto])[self.start]
        ends = []
        for part in (0.5 - middle / 2, 0.5 + middle / 2):
            wanted = first[:-1] + part * np.diff(first)
            place = np.clip(np.searchsorted(upto, wanted), self.start[:-1], self.start[1:] - 1)
            share = np.where(shares[place] > 0, shares[place], 1.0)
            within: NDArray[np.float64] = np.clip((wanted - upto[place]) / share + 0.5, -0.5, 0.5)
            ends.append(within + place)
        return ends[0], ends[1]

    def likeliest(self, shares: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return (n,) the place of the candidate with the greatest share of each command."""
        if not len(self):
            return np.zeros(0, np.int64)
        most = np.maximum.reduceat(shares, self.start[:-1])
        places = np.flatnonzero(shares >= np.repeat(most, self.count))
        return places[np.searchsorted(places, self.start[:-1])]


def starts(count: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (n + 1,) where each of n rows of so many candidates begins."""
    return np.concatenate([[0], np.cumsum(count)]).astype(np.int64)


def habits(candidates: Candidates, group: NDArray[np.int64], *, n_groups: int, n_values: int) -> NDArray[np.float64]:
    """Return (n_groups, n_values) how often commands of a group have each value: those that all outcomes make likely.

    Args:
        group: (n,) of each command: its team.
    """
    prior = np.full((n_groups, n_values), 1.0 / n_values)
    for one in range(n_groups):
        commands = np.flatnonzero(group == one)
        if not len(commands):
            continue
        some = candidates.of(commands[:: -(-len(commands) // _LEARNED_FROM)])
        for _ in range(_ROUNDS):
            expected = np.bincount(some.number, some.shares(prior[one][some.number]), minlength=n_values)
            expected = np.clip(expected / max(expected.sum(), 1.0) - _RARE, 0.0, None)
            prior[one] = (1 - _FLOOR) * expected / max(expected.sum(), 1e-9) + _FLOOR / n_values
    return prior
