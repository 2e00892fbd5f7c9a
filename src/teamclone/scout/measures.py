"""Numbers of a team over matches, each with its interval over them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.evaluation import bootstrap

Floats = NDArray[np.floating[Any]]
SEED = 0
"""Of resamples: equal matches give equal intervals."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """What a number means: a sum over matches divided by another.

    Attributes:
        key: name for programs. name: for readers.
        unit: empty of a count in a match, ``share`` of a number from 0 to 1.
        about: what is divided by what.
        good: 1 where more is better for the team, -1 where less is, 0 where it is a matter of style.
    """

    key: str
    name: str
    unit: str
    about: str
    good: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """A moment of a match that shows what is said.

    Attributes:
        cycle, stoppage: of the frame. unum: of a player to look at, 0 for none. own: it is the team's.
        text: what happens, without the cycle. weight: which moments are shown first.
    """

    match_id: str
    cycle: int
    stoppage: int = 0
    unum: int = 0
    own: bool = True
    text: str = ""
    weight: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What a section keeps of one match.

    Attributes:
        numbers: part and whole of measures by key.
        arrays: whatever else it needs, of a size that does not grow with the length of matches.
        moments: by key, those that count most first.
    """

    numbers: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    moments: Mapping[str, Sequence[Moment]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A number with its 95 % interval over matches, None where there is none, and the matches it rests on."""

    value: float | None
    low: float | None
    high: float | None
    matches: int

    def to_json(self) -> dict[str, float | int | None]:
        """Return it by name."""
        return {"value": self.value, "low": self.low, "high": self.high, "matches": self.matches}


class Looks:
    """What a section kept of all matches, in their order.

    Attributes:
        measures: by key. shown: ids of the matches whose moments are shown; None for all.
    """

    def __init__(self, looks: Sequence[Look], measures: Sequence[Measure]) -> None:
        self.looks = list(looks)
        self.shown: frozenset[str] | None = None
        self.measures = {one.key: one for one in measures}

    def __len__(self) -> int:
        return len(self.looks)

    def of(self, key: str) -> tuple[Floats, Floats]:
        """Return parts and wholes (n_matches,) of a measure, 0 where a match has none.

        Raises:
            KeyError: there is no such measure.
        """
        unit = self.measures[key]
        pairs = np.array([look.numbers.get(unit.key, (0.0, 0.0)) for look in self.looks], float).reshape(-1, 2)
        pairs[~np.isfinite(pairs).all(1)] = 0.0
        return pairs[:, 0], pairs[:, 1]

    def figure(self, key: str) -> Figure:
        """Return a measure over all matches, its interval by resampling whole matches."""
        return ratio(*self.of(key))

    def total(self, name: str) -> Floats:
        """Return the sum of an array over matches."""
        found: Floats = np.sum([look.arrays[name] for look in self.looks], axis=0)
        return found

    def each(self, name: str) -> Floats:
        """Return an array (n_matches, ...) of all matches."""
        return np.stack([look.arrays[name] for look in self.looks])

    def joined(self, name: str) -> Floats:
        """Return an array of all matches one behind the other."""
        return np.concatenate([look.arrays[name] for look in self.looks])

    def moments(self, *keys: str, most: int = 3) -> tuple[Moment, ...]:
        """Return the moments that count most, from as many matches as possible."""
        found = [
            moment
            for look in self.looks
            for key in keys
            for moment in look.moments.get(key, ())
            if self.shown is None or moment.match_id in self.shown
        ]
        found.sort(key=lambda moment: -moment.weight)
        rank: dict[str, int] = {}
        ranked = []
        for moment in found:
            rank[moment.match_id] = rank.get(moment.match_id, 0) + 1
            ranked.append((rank[moment.match_id], moment))
        ranked.sort(key=lambda one: one[0])
        return tuple(moment for _, moment in ranked[:most])


def ratio(parts: Floats, wholes: Floats) -> Figure:
    """Return the sum of parts (n_matches,) over that of wholes; without an interval if one match alone has a whole."""
    there = wholes > 0
    n = int(there.sum())
    if not n:
        return Figure(value=None, low=None, high=None, matches=0)
    value = float(parts.sum() / wholes.sum())
    if n < 2:
        return Figure(value=value, low=None, high=None, matches=n)
    low, high = bootstrap.interval(resampled(parts[there], wholes[there]))
    return Figure(value=value, low=float(low), high=float(high), matches=n)


def resampled(parts: Floats, wholes: Floats) -> Floats:
    """Return (n_resamples,) the ratio in resamples of whole matches; NaN where no whole is among them."""
    drawn = bootstrap.draw(len(parts), seed=SEED)
    whole = drawn @ wholes
    with np.errstate(invalid="ignore", divide="ignore"):
        found: Floats = np.where(whole > 0, drawn @ parts / whole, np.nan)
    return found


def wilson(share: float, n: int) -> tuple[float, float]:
    """Return the 95 % interval of a share of n draws (Wilson 1927)."""
    z = 1.96
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * float(np.sqrt(share * (1 - share) / n + z * z / (4 * n * n)))
    return middle - half, middle + half
