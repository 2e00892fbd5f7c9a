"""Without the ball: the last line, pressing, marking, tackles, and where the ball is won."""

from __future__ import annotations

import numpy as np

from teamclone.events.definitions import EventKind, Outcome
from teamclone.rcss.players import N_TEAM
from teamclone.scout import figures
from teamclone.scout.findings import Claim, Findings, Picture, Table, claim, claims
from teamclone.scout.measures import Look, Looks, Measure, Moment
from teamclone.scout.places import GRID, LANES, counted, in_lane, lane, third
from teamclone.scout.sections import last_line, pressing
from teamclone.scout.seen import Bools, Floats, Seen
from teamclone.scout.subject import Subject
from teamclone.scout.windows import as_one, followed, foremost, until, who

KEY = "defence"
TITLE = "Without the ball"

FREE_M = 5.0
"""An opponent without a field player this near is free."""
LEAST_CYCLES = 50
"""Zones in which fewer were seen stay empty."""
MOST_WAYS = 60
"""Through passes that are drawn."""
TACKLES = (Outcome.WON, Outcome.LOST, Outcome.MISSED)

MEASURES = (
    *last_line.MEASURES,
    *pressing.MEASURES,
    Measure(
        key="defence_marking",
        name="distance from opponents in its half",
        unit="m",
        about="from each to the nearest field player, while they have the ball",
        good=-1,
    ),
    Measure(
        key="defence_free",
        name="opponents free in its half",
        unit="share",
        about=f"of their field players there while they have the ball, those over {FREE_M:g} m from a field player",
        good=-1,
    ),
    Measure(
        key="defence_free_deep",
        name="opponents free in its third",
        unit="share",
        about=f"of their field players there while they have the ball, those over {FREE_M:g} m from a field player",
        good=-1,
    ),
    *(
        Measure(
            key=f"defence_free_{place}",
            name=f"opponents free in its half, {in_lane(place)}",
            unit="share",
            about=f"of their field players there while they have the ball, those over {FREE_M:g} m from a field player",
            good=-1,
        )
        for place in LANES
    ),
    Measure(key="defence_tackles", name="tackles", unit="", about="in a match, of any outcome"),
    Measure(
        key="defence_tackles_won",
        name="tackles won",
        unit="share",
        about="of its tackles, those after which it has the ball",
        good=1,
    ),
    Measure(
        key="defence_tackles_missed",
        name="tackles missed",
        unit="share",
        about="of its tackles, those that do not get the ball, so that the player lies",
        good=-1,
    ),
    Measure(
        key="defence_won",
        name="balls won",
        unit="",
        about=f"in {pressing.CYCLES} cycles in which the opponent has the ball",
        good=1,
    ),
)


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    return as_one(last_line.look(seen), pressing.look(seen), _marking(seen), _duels(seen))


def _marking(seen: Seen) -> Look:
    """Return how near field players are to the opponents' in the own half, while these have the ball."""
    place = seen.outfield[seen.has == -1]
    own, other = place[:, :N_TEAM], place[:, N_TEAM:]
    apart = np.full(other.shape[:2], np.inf, np.float32)
    for unum in range(N_TEAM):
        way = other - own[:, unum, None]
        apart = np.fmin(apart, np.hypot(way[..., 0], way[..., 1]))
    x, y = other[..., 0], other[..., 1]
    with np.errstate(invalid="ignore"):
        here = (x < 0) & np.isfinite(apart)
    x, y, apart = x[here], y[here], apart[here]
    free = apart > FREE_M
    numbers = {
        "defence_marking": (float(apart.sum(dtype=np.float64)), float(len(apart))),
        "defence_free": (float(free.sum()), float(len(free))),
        "defence_free_deep": (float(free[third(x) == 0].sum()), float((third(x) == 0).sum())),
    }
    for index, name in enumerate(LANES):
        these = lane(y) == index
        numbers[f"defence_free_{name}"] = (float(free[these].sum()), float(these.sum()))
    return Look(numbers=numbers, arrays={"mark_free": counted(x[free], y[free]), "mark_all": counted(x, y)})


def _duels(seen: Seen) -> Look:
    """Return tackles and balls won."""
    tackles = seen.pick(EventKind.TACKLE)
    won = seen.pick(EventKind.INTERCEPTION, Outcome.WON)
    outcome = {one: tackles["outcome"] == one for one in TACKLES}
    n = float(len(tackles["frame"]))
    held = float((seen.has == -1).sum())
    by_number = np.stack([np.bincount(tackles["unum"][these], minlength=N_TEAM + 1) for these in outcome.values()])
    return Look(
        numbers={
            "defence_tackles": (n, seen.length),
            "defence_tackles_won": (float(outcome[Outcome.WON].sum()), n),
            "defence_tackles_missed": (float(outcome[Outcome.MISSED].sum()), n),
            "defence_won": (pressing.CYCLES * float(len(won["frame"])), held),
        },
        arrays={
            "tackles_by": by_number.T,
            "won_places": counted(won["end_x"], won["end_y"]),
            "duel_length": np.array([seen.length]),
        },
        moments={"tackles": _moments(seen, ~outcome[Outcome.WON])},
    )


def _moments(seen: Seen, failed: Bools) -> list[Moment]:
    """Return tackles that fail and are followed by a shot, those with a goal first."""
    tackles = seen.pick(EventKind.TACKLE)
    end = until(seen, tackles["frame"], last_line.SHOT_CYCLES)
    shot, goal = (
        followed(seen.pick(EventKind.SHOT, *outcome, own=False)["frame"], tackles["frame"], end)
        for outcome in ((), (Outcome.GOAL,))
    )
    rows = np.flatnonzero(failed & shot)
    return foremost(
        seen,
        tackles["frame"][rows],
        tackles["unum"][rows],
        goal[rows].astype(np.float64),
        lambda one: (
            f"{who(int(tackles['unum'][rows[one]]))} tackles in vain, then a {'goal' if goal[rows[one]] else 'shot'}"
        ),
    )


def tell(subject: Subject) -> Findings:
    """Return what its matches say of this."""
    looks, other = subject.own[KEY], subject.other[KEY]
    if not any(looks.total("press_held").ravel()):
        return Findings(notes=["Its opponents never have the ball in these matches, so there is nothing to see here."])
    line, press = last_line.tell(looks, other), pressing.tell(looks)
    return Findings(
        claims=[*line.claims, *press.claims, *claims(_free(looks), _tackles(looks))],
        pictures=[
            *line.pictures,
            Picture(
                name="without-the-ball",
                draw=lambda: figures.zones(_panels(looks), _ways(looks)),
                alt="Presses, free opponents, balls won and through passes against it on the pitch",
                caption="By zone; the team attacks to the right. Presses are counted while the opponent has the ball "
                f"there, free are opponents over {FREE_M:g} m from its field players.",
            ),
        ],
        tables=[*line.tables, *press.tables, _by_number(looks)],
    )


def _free(looks: Looks) -> Claim | None:
    shares = {one: looks.figure(f"defence_free_{one}").value for one in LANES}
    known = {one: share for one, share in shares.items() if share is not None}
    if not known:
        return None
    most = max(known, key=lambda one: known[one])
    return claim(
        looks,
        f"In its half {{defence_free}} of the opponents are free, over {FREE_M:g} m from its next field player, in its "
        f"own third {{defence_free_deep}}. Most room is {in_lane(most)}: there {{defence_free_{most}}} are free.",
    )


def _tackles(looks: Looks) -> Claim | None:
    by_number = looks.total("tackles_by").sum(1)[1:]
    if not by_number.sum():
        return None
    return claim(
        looks,
        f"It tackles {{defence_tackles}} times a match, most often number {int(by_number.argmax()) + 1}; "
        "{defence_tackles_won} of the tackles win the ball, {defence_tackles_missed} miss it.",
        moments=("tackles",),
    )


def _panels(looks: Looks) -> list[figures.ZonePanel]:
    held, length = looks.total("press_held"), float(looks.total("duel_length")[0])
    everyone = looks.total("mark_all")
    with np.errstate(invalid="ignore", divide="ignore"):
        press = np.where(held >= LEAST_CYCLES, pressing.CYCLES * looks.total("press_places") / held, np.nan)
        free = np.where(everyone >= LEAST_CYCLES, looks.total("mark_free") / everyone, np.nan)
        won = looks.total("won_places") / length if length else np.full(GRID, np.nan)
    return [
        (f"Presses in {pressing.CYCLES} cycles", press, _words(press, "")),
        ("Free opponents", free, _words(free, "share")),
        ("Balls won in a match", won, _words(won, "")),
    ]


def _ways(looks: Looks) -> figures.WaysPanel:
    ways = looks.joined("through_ways")
    # As many of each match.
    ways = ways[np.linspace(0, len(ways) - 1, min(len(ways), MOST_WAYS)).astype(np.int64)]
    return "Through passes against it", ways[:, :2], ways[:, 2:]


def _words(values: Floats, unit: str) -> list[list[str]]:
    def word(value: float) -> str:
        if not np.isfinite(value):
            return ""
        return f"{value:.0%}" if unit == "share" else f"{value:.1f}"

    return [[word(float(value)) for value in row] for row in values]


def _by_number(looks: Looks) -> Table:
    by_number = looks.total("tackles_by")
    matches = max(float(looks.total("duel_length")[0]), 1e-9)
    return Table(
        name="tackles",
        caption="Who tackles",
        columns=("number", "a match", "won (share)", "missed (share)"),
        rows=[
            (
                str(unum),
                float(by_number[unum].sum() / matches),
                *(
                    float(by_number[unum, TACKLES.index(one)] / by_number[unum].sum())
                    for one in (TACKLES[0], TACKLES[2])
                ),
            )
            for unum in np.argsort(-by_number[1:].sum(1), kind="stable") + 1
            if by_number[unum].sum()
        ],
        folded=True,
    )
