"""Where to hurt them, what to protect: what they do worse and better than their opponents in the same matches."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from teamclone.scout.findings import Claim, Findings, Table, number
from teamclone.scout.measures import Figure, Measure
from teamclone.scout.places import LANES
from teamclone.scout.significance import RATE, discoveries, swapped
from teamclone.scout.subject import Subject

KEY = "advice"
TITLE = "Where to hurt them, what to protect"

MOST = 5
"""Claims of each kind."""
MOST_OF_SECTION = 2
"""Of them of one section: five measures of one thing say one thing."""
LEAST_MATCHES = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
    """A measure of the team held against that of its opponents in the same matches.

    Attributes:
        better: by how much the team is better, in standard deviations over matches of both; negative where worse.
        p: corrected for the number of measures. always: it is better in each match, or worse in each.
    """

    section: str
    measure: Measure
    own: Figure
    other: Figure
    better: float
    p: float
    always: bool


def held(subject: Subject) -> list[Held]:
    """Return all measures of which more or less is better, those with the greatest difference first."""
    found: list[Held] = []
    values: list[float] = []
    for section, looks in subject.own.items():
        others = subject.other[section]
        for measure in looks.measures.values():
            own, other = looks.of(measure.key), others.of(measure.key)
            there = (own[1] > 0) & (other[1] > 0)
            if not measure.good or there.sum() < LEAST_MATCHES:
                continue
            own, other = ((one[0][there], one[1][there]) for one in (own, other))
            each = measure.good * (own[0] / own[1] - other[0] / other[1])
            spread = float(np.sqrt((np.var(own[0] / own[1]) + np.var(other[0] / other[1])) / 2))
            apart = measure.good * float(own[0].sum() / own[1].sum() - other[0].sum() / other[1].sum())
            values.append(swapped(own, other))
            found.append(
                Held(
                    section=section,
                    measure=measure,
                    own=looks.figure(measure.key),
                    other=others.figure(measure.key),
                    better=apart / spread if spread else float(np.sign(apart)) * np.inf if apart else 0.0,
                    p=np.nan,
                    always=bool((each > 0).all() or (each < 0).all()),
                )
            )
    corrected = discoveries(values)
    return sorted(
        (replace(one, p=float(p)) for one, p in zip(found, corrected, strict=True)), key=lambda one: -abs(one.better)
    )


def advise(subject: Subject, *, us: Subject | None = None) -> Findings:
    """Return where the team is worse than its opponents, where it is better, and from which lane it is hurt.

    Differences stand here if they are more than chance by permutation, with at most RATE of them false; with too few
    matches for that, if they are the same way in every match, and are then called hints.

    Args:
        us: a team whose own numbers are shown beside.
    """
    every = held(subject)
    if not every:
        return Findings(notes=["One match alone cannot tell a habit from chance: nothing is said here."])
    shown = [one for one in every if one.p <= RATE]
    notes = [
        f"Of {len(every)} measures of which more or less is better, these differ most from the opponents' in the same "
        f"matches. They are more than chance by permutation of the teams, with at most {RATE:.0%} of them false "
        "(Benjamini and Hochberg)."
    ]
    if not shown:
        shown = [one for one in every if one.always]
        notes = [
            f"{len(subject.played)} matches are too few to tell chance from habit in {len(every)} measures. These are "
            "hints: they are so in every match."
            if shown
            else f"In none of {len(every)} measures is the team worse or better than its opponents beyond chance."
        ]
    weak, strong = (_few(one for one in shown if one.better * sign > 0) for sign in (-1, 1))
    return Findings(
        claims=[
            *(_claim("Hurt", subject, one, us) for one in weak),
            *_lanes(subject),
            *(_claim("Protect", subject, one, us) for one in strong),
        ],
        tables=[_table(every)],
        notes=notes,
    )


def _few(found: Iterator[Held]) -> list[Held]:
    """Return the first, not too many of one section."""
    of_section: dict[str, int] = {}
    kept = []
    for one in found:
        of_section[one.section] = of_section.get(one.section, 0) + 1
        if of_section[one.section] <= MOST_OF_SECTION:
            kept.append(one)
    return kept[:MOST]


def _claim(kind: str, subject: Subject, one: Held, us: Subject | None) -> Claim:
    figures = {"own": one.own, "other": one.other}
    template = f"{kind}: {one.measure.name}, {{own}} against {{other}} of its opponents ({one.measure.about})"
    if us is not None:
        figures["us"] = us.own[one.section].figure(one.measure.key)
        template += ". You: {us}"
    return Claim(
        template=f"{template}.",
        figures=figures,
        units=dict.fromkeys(figures, one.measure.unit),
        moments=subject.own[one.section].moments(one.measure.key),
    )


def _lanes(subject: Subject) -> list[Claim]:
    """Return from which lane opponents get their chances, if from one side more than from the other beyond chance."""
    looks = subject.other["attack"]
    left, right = (looks.of(f"chances_{side}") for side in ("left", "right"))
    if not left[1].any() or swapped(left, right) > RATE / 2:
        return []
    keys = [f"chances_{one}" for one in LANES]
    return [
        Claim(
            template="Hurt: its opponents get {chances_left} of their expected goals from their left, {chances_centre} "
            "from the centre, {chances_right} from their right.",
            figures={key: looks.figure(key) for key in keys},
            units=dict.fromkeys(keys, "share"),
            moments=looks.moments("shots"),
        )
    ]


def _table(every: Sequence[Held]) -> Table:
    def value(figure: Figure, unit: str) -> str:
        return "".join(number(figure, unit)[0])

    return Table(
        name="held-against-opponents",
        caption=f"All {len(every)} measures held against the opponents'",
        columns=("measure", "team", "opponents", "better by, in standard deviations", "p, corrected"),
        rows=[
            (
                f"{one.measure.name}: {one.measure.about}",
                value(one.own, one.measure.unit),
                value(one.other, one.measure.unit),
                f"{one.better:+.1f}",
                f"{one.p:.3f}",
            )
            for one in every
        ],
        folded=True,
    )
