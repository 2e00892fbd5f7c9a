"""Changed since: what differs between two sets of matches beyond chance."""

from __future__ import annotations

from teamclone.scout.findings import Claim, Findings, Table, capital, number
from teamclone.scout.significance import RATE, discoveries, permuted
from teamclone.scout.subject import Subject

KEY = "changes"
TITLE = "Changed since"

LEAST_MATCHES = 2
"""Of each set."""
MOST = 8


def changes(before: Subject, since: Subject) -> Findings:
    """Return which measures of a team differ between its earlier and its later matches.

    Matches change places only with those against the same opponent, if both sets have any; else with all.
    """
    counts = f"{len(before.played)} matches before and {len(since.played)} since"
    if min(len(before.played), len(since.played)) < LEAST_MATCHES:
        return Findings(notes=[f"{counts}: too few to tell a change from chance; {LEAST_MATCHES} of each are needed."])
    names = [one.opponent for subject in (before, since) for one in subject.played]
    common = set(names[: len(before.played)]) & set(names[len(before.played) :])
    strata = [name if name in common else "" for name in names]
    rows = []
    for section, looks in since.own.items():
        earlier = before.own[section]
        for measure in looks.measures.values():
            pair = earlier.of(measure.key), looks.of(measure.key)
            if pair[0][1].any() and pair[1][1].any():
                rows.append((section, measure, permuted(*pair, strata)))
    corrected = discoveries([p for *_, p in rows])
    found = sorted(
        ((float(q), section, measure) for q, (section, measure, _) in zip(corrected, rows, strict=True)),
        key=lambda one: one[0],
    )
    changed = [one for one in found if one[0] <= RATE]
    notes = [f"{counts}. {len(rows)} measures are compared; at most {RATE:.0%} of what is called changed is chance."]
    if not common:
        notes.append("The two sets have no opponent in common, so a change may be the opponents'.")
    if not changed:
        notes.append("Nothing has changed beyond chance.")
    return Findings(
        claims=[
            Claim(
                template=f"{capital(measure.name)}: {{before}} before, {{since}} since ({measure.about}).",
                figures={
                    "before": before.own[section].figure(measure.key),
                    "since": since.own[section].figure(measure.key),
                },
                units=dict.fromkeys(("before", "since"), measure.unit),
                moments=since.own[section].moments(measure.key),
            )
            for _, section, measure in changed[:MOST]
        ],
        tables=[
            Table(
                name="changes",
                caption=f"All {len(rows)} measures before and since",
                columns=("measure", "before", "since", "p, corrected"),
                rows=[
                    (
                        f"{measure.name}: {measure.about}",
                        number(before.own[section].figure(measure.key), measure.unit)[0],
                        number(since.own[section].figure(measure.key), measure.unit)[0],
                        f"{q:.3f}",
                    )
                    for q, section, measure in found
                ],
                folded=True,
            )
        ],
        notes=notes,
    )
