"""The goalkeeper of a team: where it stands, what it saves and where it is beaten; a part of transitions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teamclone.events.definitions import EventKind, Outcome
from teamclone.logs.match import Columns
from teamclone.rcss import pitch
from teamclone.rcss.players import N_TEAM
from teamclone.scout import figures
from teamclone.scout.findings import Claim, Findings, Picture, Table, claim, claims
from teamclone.scout.measures import Look, Looks, Measure, Moment
from teamclone.scout.places import LANES, in_their_box
from teamclone.scout.sections import set_plays
from teamclone.scout.seen import Bools, Floats, Seen
from teamclone.scout.windows import foremost, who

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

FAR_M = 52.5
"""Farther from the own goal the ball counts as far away."""
NEAR_M = 25.0
STEP_M = 10.0
BINS = 10
"""Of the distance of the ball from the own goal, STEP_M each; the last one is open."""
LEAST_OUT = 0.005
"""Share of the play outside its penalty area that is worth a word."""
MOUTH_BINS = 7
"""Across the goal, for the picture."""

MEASURES = (
    Measure(
        key="keeper_far", name="goalkeeper off its line, ball far away", unit="m", about=f"ball over {FAR_M:g} m off"
    ),
    Measure(key="keeper_near", name="goalkeeper off its line, ball near", unit="m", about=f"ball within {NEAR_M:g} m"),
    Measure(
        key="keeper_out",
        name="goalkeeper outside its penalty area",
        unit="share",
        about="of the cycles of play",
    ),
    Measure(key="keeper_catches", name="balls caught", unit="", about="by the goalkeeper in a match"),
    Measure(
        key="keeper_caught_at",
        name="where it catches",
        unit="m",
        about="distance of the balls that it catches from its goal line",
    ),
    Measure(
        key="keeper_saved",
        name="shots saved",
        unit="share",
        about="of the shots that it saved or that went in",
        good=1,
    ),
    *(
        Measure(
            key=f"keeper_saved_{lane}",
            name=f"shots saved, {lane} of the goal",
            unit="share",
            about=f"of the shots at the {lane} third of the goal, as the goalkeeper sees it, that it saved or that "
            "went in",
            good=1,
        )
        for lane in LANES
    ),
    *(
        Measure(
            key=f"keeper_goals_{lane}",
            name=f"goals against, {lane} of the goal",
            unit="share",
            about=f"of the goals against, those in the {lane} third, as the goalkeeper sees it",
        )
        for lane in LANES
    ),
    Measure(
        key="keeper_per_expected",
        name="goals against per expected one",
        unit="",
        about="goals by shots over the expected goals of the shots against; above 1 the goalkeeper is worse than most",
        good=-1,
    ),
)


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    place = _keeper(seen)
    known = seen.play_on & np.isfinite(place).all(1)
    off = place[:, 0] + pitch.HALF_LENGTH
    away = np.hypot(seen.ball[:, 0] + pitch.HALF_LENGTH, seen.ball[:, 1])
    inside = in_their_box(-place[:, 0], place[:, 1])
    shots, catches = seen.pick(EventKind.SHOT, own=False), seen.pick(EventKind.CATCH)
    goal, saved = (_is(shots, outcome) for outcome in (Outcome.GOAL, Outcome.SAVED))
    y = _crossing(seen, shots)
    third = np.searchsorted(np.array([-1, 1]) * pitch.GOAL_WIDTH / 6, y)
    at_goal = np.isfinite(y)
    numbers = {
        "keeper_far": _mean(off, known & (away > FAR_M)),
        "keeper_near": _mean(off, known & (away <= NEAR_M)),
        "keeper_out": (float((known & ~inside).sum()), float(known.sum())),
        "keeper_catches": (float(len(catches["x"])), seen.length),
        "keeper_caught_at": (float((catches["x"] + pitch.HALF_LENGTH).sum()), float(len(catches["x"]))),
        "keeper_saved": (float(saved.sum()), float((saved | goal).sum())),
        "keeper_per_expected": (float(goal.sum()), float(np.nansum(shots["expected_goals"]))),
    }
    for index, lane in enumerate(LANES):
        these = at_goal & (third == index)
        numbers[f"keeper_saved_{lane}"] = (float((saved & these).sum()), float(((saved | goal) & these).sum()))
        numbers[f"keeper_goals_{lane}"] = (float((goal & these).sum()), float((goal & at_goal).sum()))
    bins = np.minimum(away[known] / STEP_M, BINS - 1).astype(np.int64)
    return Look(
        numbers=numbers,
        arrays={
            "keeper_off": np.bincount(bins, weights=off[known], minlength=BINS),
            "keeper_cycles": np.bincount(bins, minlength=BINS).astype(np.float64),
            "keeper_bare": np.array([_bare(seen)], np.int64),
            "keeper_goals": _across(y[goal & at_goal]),
            "keeper_saves": _across(y[saved & at_goal]),
            "keeper_caught": np.stack([catches["x"], catches["y"]], 1).astype(np.float32),
        },
        moments={
            "keeper_goals": _moments(seen, shots, goal, "scores"),
            "keeper_saves": _moments(seen, shots, saved, "is denied"),
        },
    )


def _keeper(seen: Seen) -> Floats:
    """Return the place of the goalkeeper (n_frames, 2); NaN without one on the field."""
    goalies = seen.goalies[:, :N_TEAM]
    frame = np.arange(len(goalies))
    there = np.any(goalies, axis=1, keepdims=True)
    found: Floats = np.where(there, seen.places[frame, goalies.argmax(1)], np.nan)
    return found


def _bare(seen: Seen) -> bool:
    """Return whether the one that keeps the goal may not catch."""
    keeps = seen.goalies[:, :N_TEAM]
    return bool(keeps.any()) and not (keeps & seen.gloves[:, :N_TEAM]).any()


def _mean(values: Floats, these: Bools) -> tuple[float, float]:
    return float(values[these].sum()), float(these.sum())


def _is(shots: Columns, outcome: Outcome) -> Bools:
    found: Bools = shots["outcome"] == outcome
    return found


def _crossing(seen: Seen, shots: Columns) -> Floats:
    """Return where shots of the opponent cross the goal line, y (n,) m; NaN beside the goal.

    Of a goal by the last two frames of its ball, of others by the cycle of the shot.
    """
    last = len(seen.ball) - 1
    goal = _is(shots, Outcome.GOAL)
    before = np.where(goal, shots["end_frame"] - 1, shots["frame"])
    first, then = (seen.ball[np.clip(frame, 0, last)].astype(np.float64) for frame in (before, before + 1))
    way = then - first
    with np.errstate(invalid="ignore", divide="ignore"):
        y = np.where(way[:, 0] < 0, first[:, 1] - (first[:, 0] + pitch.HALF_LENGTH) / way[:, 0] * way[:, 1], np.nan)
        found: Floats = np.where(np.abs(y) <= pitch.GOAL_WIDTH / 2 + 0.5, y, np.nan)
    return found


def _across(y: Floats) -> Floats:
    """Return how many places y (n,) lie in each part of the goal."""
    part = np.clip((y / pitch.GOAL_WIDTH + 0.5) * MOUTH_BINS, 0, MOUTH_BINS - 1).astype(np.int64)
    found: Floats = np.bincount(part, minlength=MOUTH_BINS).astype(np.float64)
    return found


def _moments(seen: Seen, shots: Columns, these: Bools, text: str) -> list[Moment]:
    """Return shots, those first that were least likely to go in; saves those that were likeliest."""
    rows = np.flatnonzero(these)
    expected = np.nan_to_num(shots["expected_goals"][rows])
    weight = expected if text != "scores" else 1.0 - expected
    return foremost(
        seen,
        shots["frame"][rows],
        shots["unum"][rows],
        weight,
        lambda one: f"their {who(int(shots['unum'][rows[one]]))} {text}",
        own=False,
    )


def tell(looks: Looks, other: Looks) -> Findings:
    """Return what its matches say of this; ``other`` is of its opponents."""
    if not looks.total("keeper_cycles").sum():
        return Findings(notes=["These logs do not say who keeps the goal, so there is nothing about the goalkeeper."])
    goals, saves = looks.total("keeper_goals"), looks.total("keeper_saves")
    comes_out = looks.figure("keeper_out").value or 0.0
    return Findings(
        claims=claims(
            claim(
                looks,
                "Its goalkeeper stands {keeper_far} off its line while the ball is in the other half, and "
                f"{{keeper_near}} while it is within {NEAR_M:g} m"
                + ("; it is outside its penalty area in {keeper_out} of the play." if comes_out > LEAST_OUT else "."),
            ),
            claim(
                looks,
                "It saves {keeper_saved} of the shots that it reaches or that go in; for each goal that shots like "
                "these give, it lets in {keeper_per_expected}.",
                moments=("keeper_saves",),
            ),
            claim(
                looks,
                "It catches {keeper_catches} balls a match, {keeper_caught_at} from its goal line; "
                f"{set_plays.KEPT_CYCLES} cycles after its kick the team still has {{set_catch_kept}} of them.",
            ),
            _weak_third(looks),
        ),
        pictures=[
            Picture(
                name="keeper",
                draw=lambda: _draw(looks, other, goals, saves),
                alt="Distance of the goalkeeper from its line by the distance of the ball, shots across the goal, and "
                "where it catches",
                caption="How far the goalkeeper stands off its line, with 95 % intervals over matches; goals against "
                "it and saves by where the shot crosses the line or would, as the goalkeeper sees it; the balls that "
                "it catches.",
            )
        ],
        tables=[_table(looks)],
        notes=_notes(looks, float(goals.sum() + saves.sum())),
    )


def _weak_third(looks: Looks) -> Claim | None:
    """Return into which third of the goal most goals go, if that is beyond doubt more than a third of them."""
    for lane in LANES:
        low = looks.figure(f"keeper_goals_{lane}").low
        if low is not None and low > 1 / len(LANES):
            where = "the middle" if lane == "centre" else f"its {lane}"
            return claim(
                looks,
                f"Of the goals against it, {{keeper_goals_{lane}}} go into {where} third of the goal.",
                moments=("keeper_goals",),
            )
    return None


def _notes(looks: Looks, shots: float) -> list[str]:
    bare = int(looks.total("keeper_bare")[0])
    notes = []
    if not shots:
        notes.append("There is no shot at its goal in these matches.")
    if bare:
        notes.append(
            f"In {bare} of {len(looks)} matches another number kept its goal than the server's goalkeeper, so that it "
            "may not catch."
        )
    return notes


def _draw(looks: Looks, other: Looks, goals: Floats, saves: Floats) -> Drawing:
    x = (np.arange(BINS) + 0.5) * STEP_M
    return figures.keeper(
        x,
        [
            (name, *figures.by_bin(these.each("keeper_off"), these.each("keeper_cycles")))
            for name, these in (("the team", looks), ("its opponents", other))
        ],
        goals,
        saves,
        caught=looks.joined("keeper_caught"),
    )


def _table(looks: Looks) -> Table:
    return Table(
        name="goalkeeper",
        caption="Shots at its goal by third, as the goalkeeper sees it",
        columns=("third", "goals", "saved or goals", "saved (share)"),
        rows=[
            (
                lane,
                int(looks.of(f"keeper_goals_{lane}")[0].sum()),
                int(looks.of(f"keeper_saved_{lane}")[1].sum()),
                looks.figure(f"keeper_saved_{lane}").value,
            )
            for lane in LANES
        ],
        folded=True,
    )
