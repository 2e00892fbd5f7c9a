"""What a team does in the seconds after it has won or lost the ball; a part of the section transitions."""

from __future__ import annotations

import numpy as np

from teamclone.events.definitions import EventKind, Outcome
from teamclone.logs.match import Columns
from teamclone.rcss import pitch
from teamclone.rcss.players import N_TEAM
from teamclone.scout.findings import Findings, Table, claim, claims
from teamclone.scout.measures import Look, Looks, Measure, Moment
from teamclone.scout.places import THIRDS, third
from teamclone.scout.seen import Bools, Ints, Seen
from teamclone.scout.windows import followed, foremost, until, who

SHOT_CYCLES = 100
"""Within how many cycles of play a shot follows a turnover or a set play."""
SOON_CYCLES = 50
FORWARD_M = 20.0
IN_THIRD = ("own", "middle", "attacking")

MEASURES = (
    Measure(
        key="turnover_shot",
        name="shot after winning the ball",
        unit="share",
        about=f"of the balls won, those with a shot within {SHOT_CYCLES} cycles of play",
        good=1,
    ),
    Measure(
        key="turnover_forward",
        name="forward after winning the ball",
        unit="share",
        about=f"of the balls won, those {FORWARD_M:g} m nearer to the other end within {SOON_CYCLES} cycles, not lost "
        "before",
        good=1,
    ),
    Measure(
        key="turnover_regained",
        name="won back",
        unit="share",
        about=f"of the balls lost, those won back within {SOON_CYCLES} cycles of play",
        good=1,
    ),
    Measure(
        key="turnover_shot_against",
        name="shot against after losing the ball",
        unit="share",
        about=f"of the balls lost, those with a shot of the opponent within {SHOT_CYCLES} cycles of play",
        good=-1,
    ),
    Measure(
        key="turnover_behind",
        name="field players behind the ball at a loss",
        unit="",
        about="nearer to the own goal line than the ball as it is lost",
    ),
    *(
        Measure(
            key=f"turnover_{what}_{place}",
            name=f"{words}, in the {name}",
            unit="share",
            about=f"{about} in the {name}, within {SHOT_CYCLES} cycles of play",
            good=good,
        )
        for what, words, about, good in (
            ("shot", "shot after winning the ball", "of the balls won", 1),
            ("shot_against", "shot against after losing the ball", "of the balls lost", -1),
        )
        for place, name in zip(IN_THIRD, THIRDS, strict=True)
    ),
)


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    won = seen.pick(EventKind.INTERCEPTION, Outcome.WON)
    lost = seen.pick(EventKind.INTERCEPTION, Outcome.WON, own=False)
    at, gone = won["end_frame"], lost["end_frame"]
    shots, against = seen.pick(EventKind.SHOT)["frame"], seen.pick(EventKind.SHOT, own=False)["frame"]
    shot = followed(shots, at, until(seen, at, SHOT_CYCLES))
    hurt = followed(against, gone, until(seen, gone, SHOT_CYCLES))
    forward = _forward(seen, won)
    regained = followed(at, gone, until(seen, gone, SOON_CYCLES))
    behind = seen.outfield[gone, :N_TEAM, 0] < seen.ball[gone, :1]
    numbers = {
        "turnover_shot": _share(shot),
        "turnover_forward": _share(forward),
        "turnover_regained": _share(regained),
        "turnover_shot_against": _share(hurt),
        "turnover_behind": (float(behind.sum()), float(len(gone))),
    }
    for place, name in enumerate(IN_THIRD):
        numbers[f"turnover_shot_{name}"] = _share(shot[third(won["end_x"]) == place])
        numbers[f"turnover_shot_against_{name}"] = _share(hurt[third(lost["end_x"]) == place])
    return Look(
        numbers=numbers,
        moments={
            "turnover_shot": _moments(seen, won, shot, shots, own=True),
            "turnover_hurt": _moments(seen, lost, hurt, against, own=False),
        },
    )


def _share(these: Bools) -> tuple[float, float]:
    return float(these.sum()), float(len(these))


def _forward(seen: Seen, won: Columns) -> Bools:
    """Return of which balls won (n,) much way is made before they are lost."""
    start = won["end_frame"]
    end = until(seen, start, SOON_CYCLES)
    lost = np.append(np.flatnonzero(seen.has == -1), len(seen.has))
    end = np.minimum(end, lost[np.searchsorted(lost, start)] - 1)
    x = seen.ball[:, 0]
    found: Bools = np.zeros(len(start), np.bool_)
    for row, (first, last) in enumerate(zip(start, end, strict=True)):
        found[row] = last > first and float(x[first : last + 1].max() - x[first]) >= FORWARD_M
    return found


def _moments(seen: Seen, turned: Columns, these: Bools, shots: Ints, *, own: bool) -> list[Moment]:
    """Return turnovers that a shot follows, first those with a goal, far from the goal that is shot at."""
    rows = np.flatnonzero(these)
    frame = turned["end_frame"][rows]
    first = shots[np.searchsorted(shots, frame)]
    goals = seen.pick(EventKind.SHOT, Outcome.GOAL, own=own)["frame"]
    goal = np.isin(first, goals)
    ahead = (1.0 if own else -1.0) * turned["end_x"][rows]
    weight = goal + (0.5 - ahead / pitch.LENGTH)
    return foremost(
        seen,
        frame,
        turned["unum"][rows],
        weight,
        lambda one: (
            f"{'' if own else 'their '}{who(turned['unum'][rows[one]])} wins it"
            f", {'a goal' if goal[one] else 'a shot'} {first[one] - frame[one]} cycles later"
        ),
        own=own,
    )


def tell(looks: Looks) -> Findings:
    """Return what its matches say of this."""
    return Findings(
        claims=claims(
            claim(
                looks,
                f"Of the balls that it wins, {{turnover_shot}} become a shot within {SHOT_CYCLES} cycles, and "
                f"{{turnover_forward}} are {FORWARD_M:g} m nearer to the other end within {SOON_CYCLES}.",
                moments=("turnover_shot",),
            ),
            claim(
                looks,
                f"Of the balls that it loses, it wins {{turnover_regained}} back within {SOON_CYCLES} cycles; "
                f"{{turnover_shot_against}} become a shot against it within {SHOT_CYCLES}. As it loses the ball, "
                "{turnover_behind} of its field players are behind it.",
                moments=("turnover_hurt",),
            ),
        ),
        tables=[_by_third(looks)],
    )


def _by_third(looks: Looks) -> Table:
    rows = []
    for place, name in enumerate(THIRDS):
        cells: list[str | float | int | None] = [name]
        for key in ("turnover_shot", "turnover_shot_against"):
            one = f"{key}_{IN_THIRD[place]}"
            cells += [int(looks.of(one)[1].sum()), looks.figure(one).value]
        rows.append(cells)
    return Table(
        name="turnovers",
        caption=f"Turnovers by place, and shots within {SHOT_CYCLES} cycles of play",
        columns=("where", "balls won", "then a shot (share)", "balls lost", "then a shot against (share)"),
        rows=rows,
        folded=True,
    )
