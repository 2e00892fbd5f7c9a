"""``compare``: a clone in the original's place beside the original, opponent by opponent."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from teamclone import __version__
from teamclone.comparison import distance
from teamclone.comparison.distance import Distances, Pairing
from teamclone.comparison.profile import NUMBERS, POSITIONS, SPEED_BIN, SPEEDS, STATISTICS, Floats, Profile, profile
from teamclone.errors import StoreError, UsageError, choose
from teamclone.evaluation import bootstrap
from teamclone.store.of_team import TeamMatch, matches_of
from teamclone.store.postgres.location import masked
from teamclone.store.store import Store
from teamclone.system.documents import write_document

FORMAT = 1
"""Format number of compare.json."""
DRAWS = 200
"""Random halves that a distance is the mean over."""
HISTOGRAM_RESAMPLES = 200
HISTOGRAM_DRAWS = 10
"""Of the intervals of histograms, which cost more and differ less from draw to draw than single numbers."""
LEAST = (4, 2)
"""How many matches of the original and of the clone, against one opponent or all, give a distance."""
ALL = "all"
"""Work that is done for all opponents together."""

Progress = Callable[[str, int, int], None]
"""Called with the work, the steps done and their number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """What `compare` found.

    Attributes:
        document: as in ``compare.json``.
        failed: an error for each match that could not be read.
    """

    document: dict[str, Any] = field(repr=False)
    failed: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sample:
    """The matches of a team in a store: those that count, why others do not, and those that could not be read."""

    profiles: list[Profile]
    left_out: list[dict[str, str]]
    failed: list[str]


def compare(
    original: Store,
    clone: Store,
    *,
    team: str,
    clone_team: str | None = None,
    opponents: Collection[str] = (),
    seed: int = 0,
    on_progress: Progress | None = None,
) -> Comparison:
    """Compare a clone with the team in whose place it plays, by their matches against the same opponents.

    A match that cannot be read does not stop the others. Matches of opponents that only one store has, matches whose
    game log was not closed and matches of a team against itself are left out and named.

    Args:
        original: matches of the team. clone: matches of the clone.
        team: name of the team. clone_team: name under which the clone plays; None for the same.
        opponents: their names; empty for all that both stores have.
        seed: of random halves and resamples.
        on_progress: called with the name of the work, the steps done and their number.

    Raises:
        UsageError: a team does not play in its store, no opponent is in both, a match is in both, or there are too few
            matches for a distance.
        StoreError: a store cannot be read at all.
    """
    telling = on_progress or (lambda work, done, total: None)
    names = (team, clone_team or team)
    matches = [matches_of(store, name) for store, name in zip((original, clone), names, strict=True)]
    common = _common(matches, (original, clone), names, opponents)
    twice = {one.match_id for one in matches[0]} & {one.match_id for one in matches[1]}
    if names[0] == names[1] and twice:
        raise UsageError(f"match {min(twice)} is in both stores; expected matches of the original in one of them alone")
    samples = [
        _sample(store, these, common=common, whose=work, telling=telling)
        for store, these, work in zip((original, clone), matches, ("original", "clone"), strict=True)
    ]
    groups = _groups(samples, common)
    failed = [text for sample in samples for text in sample.failed]
    if not any(group.pairing.half >= LEAST[1] for group in groups):
        counts = ", ".join(f"{name}: {len(a)} and {len(b)}" for name, a, b in _counted(samples, common))
        text = f"expected at least {LEAST[0]} matches of the original and {LEAST[1]} of the clone, got {counts}"
        raise UsageError("; ".join([text, *failed]))
    document = {
        "kind": "teamclone comparison",
        "format": FORMAT,
        "teamclone": __version__,
        "team": names[0],
        "clone_team": names[1],
        "stores": {"original": masked(original.location), "clone": masked(clone.location)},
        "options": {"seed": seed, "draws": DRAWS, "resamples": bootstrap.N_RESAMPLES, "level": bootstrap.LEVEL},
        "statistics": [asdict(one) for one in STATISTICS],
        "groups": [group.measured(seed, telling) for group in groups],
        "matches": [
            {"whose": whose, "match_id": one.match_id, "opponent": one.opponent, **_named(one.numbers)}
            for whose, sample in zip(("original", "clone"), samples, strict=True)
            for one in sample.profiles
        ],
        "left_out": [one for sample in samples for one in sample.left_out],
        "failed": failed,
    }
    return Comparison(document=document, failed=tuple(failed))


def write_comparison(comparison: Comparison, out: Path) -> None:
    """Write ``compare.json`` and ``compare.html`` into a folder."""
    from teamclone.comparison.page import render
    from teamclone.system.files import write_atomic

    out.mkdir(parents=True, exist_ok=True)
    write_document(out / "compare.json", comparison.document)
    write_atomic(out / "compare.html", render(comparison.document).encode())


# Which matches


def _reason(match: TeamMatch) -> str | None:
    """Return why a match is left out, None if it is not."""
    return match.uncontested or (None if match.row["complete"] else "its game log was not closed by the server")


def _common(
    matches: Sequence[list[TeamMatch]], stores: Sequence[Store], names: Sequence[str], wanted: Collection[str]
) -> list[str]:
    """Return the opponents that both teams have played, of those that are wanted.

    Raises:
        UsageError: there is none, or one that is wanted is not among them.
    """
    there = [{str(one.opponent) for one in these if one.error is None and _reason(one) is None} for these in matches]
    common = sorted(there[0] & there[1])
    if not common:
        told = "; ".join(
            f"{masked(store.location)}: {name} has played {', '.join(sorted(who)) or 'nobody'}"
            for store, name, who in zip(stores, names, there, strict=True)
        )
        raise UsageError(f"expected whole matches against the same opponent in both stores; {told}")
    for name in wanted:
        if name not in common:
            raise UsageError(f"no opponent {name!r} is in both stores; {choose(name, common)}")
    return [name for name in common if not wanted or name in wanted]


def _sample(
    store: Store, matches: list[TeamMatch], *, common: Collection[str], whose: str, telling: Progress
) -> _Sample:
    made = _Sample(profiles=[], left_out=[], failed=[])
    for done, match in enumerate(matches):
        telling(f"read {whose}", done, len(matches))
        if match.error is not None:
            made.failed.append(match.error)
            continue
        if why := _reason(match) or (None if match.opponent in common else "its opponent is not compared"):
            made.left_out.append(
                {"whose": whose, "match_id": match.match_id, "opponent": match.opponent or "", "reason": why}
            )
            continue
        try:
            made.profiles.append(profile(store, match.row, side=match.side))
        except StoreError as error:
            made.failed.append(str(error))
    telling(f"read {whose}", len(matches), len(matches))
    return made


def _counted(samples: Sequence[_Sample], common: Sequence[str]) -> list[tuple[str, list[Profile], list[Profile]]]:
    """Return the matches of both teams by opponent."""
    return [
        (name, *([one for one in sample.profiles if one.opponent == name] for sample in samples))  # type: ignore[misc]
        for name in common
    ]


# What they say


@dataclass(frozen=True, slots=True, kw_only=True)
class _Group:
    """Matches that are compared: against one opponent, or ``opponent`` None against all."""

    opponent: str | None
    original: list[Profile]
    clone: list[Profile]
    pairing: Pairing

    @classmethod
    def of(cls, opponent: str | None, original: list[Profile], clone: list[Profile]) -> _Group:
        names = [[one.opponent for one in these] for these in (original, clone)]
        return cls(opponent=opponent, original=original, clone=clone, pairing=Pairing.of(*names))

    def measured(self, seed: int, telling: Progress) -> dict[str, Any]:
        """Return the group as in the document."""
        work = f"compare {self.opponent or ALL}"
        numbers = [np.stack([one.numbers for one in these]) for these in (self.original, self.clone)]
        means = self._means(numbers, seed)
        found: list[dict[str, Any]] = [
            {"statistic": one.name, **{whose: _figure(*(each[at] for each in of)) for whose, of in means.items()}}
            for at, one in enumerate(NUMBERS)
        ] + [{"statistic": one.name, "original": None, "clone": None} for one in (POSITIONS, SPEEDS)]
        made: dict[str, Any] = {
            "opponent": self.opponent,
            "opponents": dict(Counter(one.opponent for one in self.original)),
            "matches": {"original": len(self.original), "clone": len(self.clone)},
            "half": self.pairing.half if self.pairing.half >= LEAST[1] else None,
            "statistics": found,
        }
        if made["half"] is None:
            return made
        every, few = (bootstrap.N_RESAMPLES, DRAWS), (HISTOGRAM_RESAMPLES, HISTOGRAM_DRAWS)
        places = [_cumulated([one.positions for one in these]) for these in (self.original, self.clone)]
        speeds = [_cumulated([one.speeds for one in these]) for these in (self.original, self.clone)]
        parts = []
        for done, (measure, values, scale, (resamples, draws_each)) in enumerate(
            (
                (distance.of_means, numbers, 1.0, every),
                (distance.of_places, places, 1.0, few),
                (distance.of_histograms, speeds, SPEED_BIN, few),
            )
        ):
            telling(work, done, 3)
            measured = distance.measured(
                measure, self.pairing, *values, seed=seed, draws=DRAWS, resamples=resamples, draws_each=draws_each
            )
            parts.append(_distance_rows(measured, scale))
        for row, more in zip(found, (one for part in parts for one in part), strict=True):
            row.update(more)
        made["positions"] = self._where(places, seed)
        made["speeds"] = self._speeds()
        telling(work, 3, 3)
        return made

    def _means(self, numbers: Sequence[Floats], seed: int) -> dict[str, tuple[Floats, ...]]:
        strata, weights = (self.pairing.original, self.pairing.clone), self.pairing.weights()
        return {
            whose: distance.mean_interval(values, of, weight, seed=seed, resamples=bootstrap.N_RESAMPLES)
            for whose, values, of, weight in zip(("original", "clone"), numbers, strata, weights, strict=True)
        }

    def _where(self, places: Sequence[Floats], seed: int) -> dict[str, Any]:
        """Return the distances of positions by zone of the ball and by player, m; the mean over draws."""
        rng = np.random.default_rng(seed)
        half, rest, others = self.pairing.draw(DRAWS, rng=rng)
        own = distance.cells(places[0], half, places[0], rest)
        clone = distance.cells(places[0], half, places[1], others)
        return {
            name: {
                whose: _known(np.mean(distance.averaged(*each, axes=axes), axis=0))
                for whose, each in (("own", own), ("distance", clone))
            }
            for name, axes in (("zones", (1, 2)), ("players", (2, 3)))
        }

    def _speeds(self) -> dict[str, Any]:
        """Return the share of each bin of ways."""
        shares = {}
        for whose, these in (("original", self.original), ("clone", self.clone)):
            counts = np.sum([one.speeds for one in these], axis=0)
            shares[whose] = _known(counts / max(counts.sum(), 1))
        return {"bin": SPEED_BIN, **shares}


def _groups(samples: Sequence[_Sample], common: Sequence[str]) -> list[_Group]:
    """Return a group of all opponents, if there are several that have a distance, and one for each."""
    each = [_Group.of(*one) for one in _counted(samples, common) if one[1] and one[2]]
    paired = [group for group in each if group.pairing.half]
    if len(paired) < 2:
        return each
    whole = _Group.of(
        None, [one for group in paired for one in group.original], [one for group in paired for one in group.clone]
    )
    return [whole, *each]


def _cumulated(counts: Sequence[Any]) -> Floats:
    return distance.cumulated(np.stack(counts))


def _named(numbers: Floats) -> dict[str, float | None]:
    return dict(zip((one.name for one in NUMBERS), _known(numbers), strict=True))


def _known(values: Floats) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


def _figure(value: float, low: float, high: float) -> dict[str, float | None]:
    return dict(zip(("value", "low", "high"), _known(np.array([value, low, high])), strict=True))


def _distance_rows(found: Distances, scale: float) -> list[dict[str, Any]]:
    """Return own distance, distance and units of each statistic; an infinite number is None."""
    return [
        {"own": own, "distance": apart, "units": _figure(units, low, high)}
        for own, apart, units, low, high in zip(
            _known(found.own * scale), _known(found.clone * scale), found.units, found.low, found.high, strict=True
        )
    ]
