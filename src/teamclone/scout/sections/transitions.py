"""Turnovers, set plays and the goalkeeper."""

from __future__ import annotations

from teamclone.scout.findings import Findings
from teamclone.scout.measures import Look
from teamclone.scout.sections import keeper, set_plays, turnovers
from teamclone.scout.seen import Seen
from teamclone.scout.subject import Subject
from teamclone.scout.windows import as_one

KEY = "transitions"
TITLE = "Turnovers, set plays, goalkeeper"
MEASURES = (*turnovers.MEASURES, *set_plays.MEASURES, *keeper.MEASURES)


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    return as_one(turnovers.look(seen), set_plays.look(seen), keeper.look(seen))


def tell(subject: Subject) -> Findings:
    """Return what its matches say of this."""
    own, other = subject.own[KEY], subject.other[KEY]
    parts = (turnovers.tell(own), set_plays.tell(own, other), keeper.tell(own, other))
    return Findings(
        claims=[one for part in parts for one in part.claims],
        pictures=[one for part in parts for one in part.pictures],
        tables=[one for part in parts for one in part.tables],
        notes=[one for part in parts for one in part.notes],
    )
