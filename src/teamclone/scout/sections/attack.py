"""With the ball: where they stand, how the ball comes forward, who decides, how they shoot."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from teamclone.events.definitions import EventKind, Outcome
from teamclone.logs.match import Columns
from teamclone.rcss.players import N_TEAM
from teamclone.scout.findings import Findings, Picture, Table, claim, claims
from teamclone.scout.measures import Look, Looks, Measure, Moment
from teamclone.scout.places import (
    GRID,
    LANES,
    THIRDS,
    Bools,
    Floats,
    Ints,
    counted,
    in_their_box,
    lane,
    mean_of,
    third,
    to_goal,
)
from teamclone.scout.sections import attack_figures as figures
from teamclone.scout.sections.identity import KEY as IDENTITY
from teamclone.scout.sections.identity import keepers
from teamclone.scout.seen import Seen
from teamclone.scout.shape import name_of_shape, situations
from teamclone.scout.subject import Subject
from teamclone.scout.windows import foremost

KEY = "attack"
TITLE = "With the ball"

PROGRESS_M = 10.0
"""How much nearer to the goal a progressive pass brings the ball at least."""
PRESSED_M = 5.0
"""How near the nearest opponent is to a pressed player."""
SWITCH_M = 25.0
"""How far across the pitch a switch of play goes at least."""
ASSIST_CYCLES = 50
"""How long before a shot its assist is received at most."""
FRAMES = 100
"""Frames of a match by which situations are found."""
ENTRIES = 60
"""Entries into the penalty area that are kept of a match, at most."""

KICKS = ("pass", "dribble", "shot", "clearance")
"""What a player does with the ball."""
COUNTS = ("touches", "passes", "completed", "progressive", "assists", "dribbles", "shots", "goals")
"""What is counted of each player."""

MEASURES = (
    Measure(
        key="progressive",
        name="progressive passes",
        unit="",
        about=f"completed passes in a match that bring the ball {PROGRESS_M:g} m nearer to the goal",
        good=1,
    ),
    Measure(key="entries", name="entries into the box", unit="", about="passes and dribbles in a match", good=1),
    *(
        Measure(key=f"entries_{one}", name=f"entries from the {one}", unit="share", about="of the entries into the box")
        for one in LANES
    ),
    Measure(key="entries_by_pass", name="entries by a pass", unit="share", about="of the entries into the box"),
    Measure(key="chance_of_shot", name="worth of a shot", unit="", about="expected goals of a shot", good=1),
    Measure(key="shots_in_box", name="shots in the box", unit="share", about="of its shots"),
    Measure(key="scored", name="goals above expected", unit="", about="a match, by shots", good=1),
    Measure(key="through", name="through passes", unit="", about="in a match", good=1),
    Measure(key="through_completed", name="through passes completed", unit="share", about="of them", good=1),
    Measure(key="dribbles", name="dribbles", unit="", about="in a match"),
    Measure(key="dribbles_lost", name="dribbles lost", unit="share", about="of its dribbles", good=-1),
    Measure(
        key="switches", name="switches of play", unit="share", about=f"passes {SWITCH_M:g} m across, of the completed"
    ),
    Measure(
        key="completed_pressed",
        name="passes completed under pressure",
        unit="share",
        about=f"of those with an opponent within {PRESSED_M:g} m of the ball",
        good=1,
    ),
    Measure(key="completed_free", name="passes completed without", unit="share", about="of the others", good=1),
    *(
        Measure(key=f"completed_{at}", name=f"passes completed in the {one}", unit="share", about="of those", good=1)
        for at, one in enumerate(THIRDS)
    ),
    *(
        Measure(key=f"chances_{one}", name=f"chances from the {one}", unit="share", about="of its expected goals")
        for one in LANES
    ),
)


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    passes = seen.pick(EventKind.PASS)
    passes = _some(passes, passes["outcome"] != Outcome.RESTART)
    shots, dribbles = seen.pick(EventKind.SHOT), seen.pick(EventKind.DRIBBLE, Outcome.COMPLETED, Outcome.FAILED)
    lost = seen.pick(EventKind.DRIBBLE, Outcome.LOST)
    completed = _some(passes, passes["outcome"] == Outcome.COMPLETED)
    gain = to_goal(completed["x"], completed["y"]) - to_goal(completed["end_x"], completed["end_y"])
    progressive = _some(completed, gain >= PROGRESS_M)
    moves, entering = _entries(completed, dribbles)
    through = seen.pick(EventKind.THROUGH_PASS)
    scored = shots["outcome"] == Outcome.GOAL
    worth = np.nan_to_num(shots["expected_goals"].astype(float))
    numbers = {
        "progressive": (_n(progressive), seen.length),
        "entries": (float(entering.sum()), seen.length),
        "entries_by_pass": (float(entering[: len(completed["frame"])].sum()), float(entering.sum())),
        "chance_of_shot": (float(worth.sum()), _n(shots)),
        "shots_in_box": (float(in_their_box(shots["x"], shots["y"]).sum()), _n(shots)),
        "scored": (float(scored.sum() - worth.sum()), seen.length),
        "through": (_n(through), seen.length),
        "through_completed": (float((through["outcome"] == Outcome.COMPLETED).sum()), _n(through)),
        "dribbles": (_n(dribbles), seen.length),
        "dribbles_lost": (_n(lost), _n(dribbles) + _n(lost)),
        "switches": (float((np.abs(completed["end_y"] - completed["y"]) >= SWITCH_M).sum()), _n(completed)),
        **_completion(seen, passes),
        **_by_lane("entries", lane(moves["y"][entering]), np.ones(int(entering.sum()))),
        **_by_lane("chances", lane(shots["y"]), worth),
    }
    assists = _assists(completed, shots)
    return Look(
        numbers=numbers,
        arrays={
            "counts": _players(passes, completed, progressive, assists=assists, dribbles=dribbles, shots=shots),
            "network": _network(completed),
            "kicks": np.stack(
                [counted(one["x"], one["y"]) for one in (passes, dribbles, shots, seen.pick(EventKind.CLEARANCE))]
            ),
            "entries": _evenly(np.stack([moves[name] for name in _ENDS], -1)[entering], ENTRIES),
            "shots": np.stack([shots["x"], shots["y"], worth, scored], -1),
            **_standing(seen),
        },
        moments={
            "progressive": _moments(seen, progressive, gain[gain >= PROGRESS_M], "passes to"),
            "through": _moments(
                seen,
                _some(through, done := through["outcome"] == Outcome.COMPLETED),
                through["length"][done],
                "through to",
            ),
            "shots": foremost(
                seen,
                shots["frame"],
                shots["unum"],
                worth,
                lambda at: f"{shots['unum'][at]} {'scores' if scored[at] else 'shoots'}",
            ),
        },
    )


_ENDS = ("x", "y", "end_x", "end_y")


def _n(events: Columns) -> float:
    return float(len(events["frame"]))


def _some(events: Columns, these: Bools | Ints) -> Columns:
    return {name: values[these] for name, values in events.items()}


def _entries(completed: Columns, dribbles: Columns) -> tuple[Columns, Bools]:
    """Return passes and dribbles, and which of them (n,) bring the ball into the opponent's penalty area."""
    moves = {name: np.concatenate([completed[name], dribbles[name]]) for name in _ENDS}
    into = in_their_box(moves["end_x"], moves["end_y"]) & ~in_their_box(moves["x"], moves["y"])
    return moves, into


def _by_lane(name: str, lanes: Ints, weight: Floats) -> dict[str, tuple[float, float]]:
    whole = float(weight.sum())
    return {f"{name}_{one}": (float(weight[lanes == at].sum()), whole) for at, one in enumerate(LANES)}


def _completion(seen: Seen, passes: Columns) -> dict[str, tuple[float, float]]:
    """Return the share of passes completed by pressure and by third of the pitch."""
    done = passes["outcome"] == Outcome.COMPLETED
    frame = passes["frame"]
    apart = np.linalg.norm(seen.places[frame, N_TEAM:] - seen.ball[frame, None], axis=-1)
    pressed = np.nanmin(np.where(np.isfinite(apart), apart, np.inf), axis=1, initial=np.inf) <= PRESSED_M
    place = third(passes["x"])
    parts = {"pressed": pressed, "free": ~pressed, **{str(at): place == at for at in range(len(THIRDS))}}
    return {f"completed_{name}": (float(done[these].sum()), float(these.sum())) for name, these in parts.items()}


def _assists(completed: Columns, shots: Columns) -> Ints:
    """Return the rows of the completed passes whose receiver shoots soon."""
    found = []
    for frame, unum in zip(shots["frame"], shots["unum"], strict=True):
        before = np.flatnonzero((completed["end_frame"] <= frame) & (completed["end_frame"] > frame - ASSIST_CYCLES))
        if len(before) and completed["other_unum"][before[-1]] == unum:
            found.append(before[-1])
    return np.unique(np.array(found, np.int64))


def _players(
    passes: Columns, completed: Columns, progressive: Columns, *, assists: Ints, dribbles: Columns, shots: Columns
) -> Floats:
    """Return (11, len(COUNTS)) what each number did."""

    def by_number(unum: Ints) -> Ints:
        return np.bincount(unum[(unum > 0) & (unum <= N_TEAM)] - 1, minlength=N_TEAM)

    goals = shots["unum"][shots["outcome"] == Outcome.GOAL]
    columns = (
        np.concatenate([passes["unum"], dribbles["unum"], shots["unum"]]),
        passes["unum"],
        completed["unum"],
        progressive["unum"],
        completed["unum"][assists],
        dribbles["unum"],
        shots["unum"],
        goals,
    )
    found: Floats = np.stack([by_number(one.astype(np.int64)) for one in columns], -1)
    return found


def _network(completed: Columns) -> Ints:
    """Return (11, 11) completed passes from number to number."""
    counts = np.zeros((N_TEAM + 1, N_TEAM + 1), np.int64)
    np.add.at(counts, (completed["unum"].clip(max=N_TEAM), completed["other_unum"].clip(max=N_TEAM)), 1)
    return counts[1:, 1:]


def _standing(seen: Seen) -> Mapping[str, Floats]:
    """Return some frames with the ball: places of the team (n, 11, 2) and of the ball (n, 2)."""
    frame = np.flatnonzero(seen.has == 1)
    frame = _evenly(frame, FRAMES)
    return {"places": seen.places[frame, :N_TEAM].astype(np.float32), "ball": seen.ball[frame].astype(np.float32)}


def _evenly(rows: np.ndarray, most: int) -> np.ndarray:
    """Return at most so many rows, evenly spread."""
    found: np.ndarray = rows[np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(np.int64)]
    return found


def _moments(seen: Seen, events: Columns, weight: Floats, words: str) -> list[Moment]:
    return foremost(
        seen,
        events["frame"],
        events["unum"],
        weight,
        lambda at: f"{events['unum'][at]} {words} {events['other_unum'][at]}",
    )


def tell(subject: Subject) -> Findings:
    """Return what its matches say of this."""
    looks = subject.own[KEY]
    if not looks.total("counts").any():
        return Findings(notes=["The team never plays the ball in these matches."])
    return Findings(
        claims=claims(
            claim(
                looks,
                f"It brings the ball {PROGRESS_M:g} m and more nearer to the goal by {{progressive}} passes a match"
                f"{_by(looks, 'progressive')}.",
                moments=["progressive"],
            ),
            claim(
                looks,
                "It comes into the penalty area {entries} times a match, {entries_by_pass} of them by a pass: from the "
                "left {entries_left}, through the centre {entries_centre}, from the right {entries_right}.",
            ),
            claim(
                looks,
                "It plays {through} passes a match behind the last line, of which {through_completed} arrive.",
                moments=["through"],
            ),
            claim(
                looks,
                "A shot of it is worth {chance_of_shot} goals; {shots_in_box} are from inside the penalty area. It "
                f"scores {{scored}} goals a match above what its shots are worth{_by(looks, 'goals')}.",
                moments=["shots"],
            ),
            claim(
                looks,
                "Under pressure {completed_pressed} of its passes are completed, without it {completed_free}; in the "
                "own third {completed_0}, in the middle {completed_1}, in the attacking third {completed_2}.",
            ),
            claim(
                looks,
                "It dribbles {dribbles} times a match and loses {dribbles_lost} of the dribbles; {switches} of its "
                f"passes change the side of play by {SWITCH_M:g} m or more.",
            ),
        ),
        pictures=[
            *_situations(subject),
            Picture(
                name="network",
                draw=lambda: figures.network_and_shots(
                    mean_of(subject.own[IDENTITY].total("with")),
                    looks.total("network"),
                    looks.joined("shots"),
                    matches=len(looks),
                ),
                alt="Pass network and shot map",
                caption="Left, who passes to whom, players at their mean places with the ball. Right, shots: the "
                "larger, the more they are worth; filled are goals.",
            ),
            Picture(
                name="routes",
                draw=lambda: figures.routes_and_kicks(looks.joined("entries"), looks.total("kicks")),
                alt="Ways into the penalty area, and what is done with the ball by zone",
                caption="Left, the ways into the penalty area that are taken most. Right, by zone the kicks there and "
                "what most of them are.",
            ),
        ],
        tables=[_deciders(looks), _kicks(looks)],
    )


def _by(looks: Looks, what: str) -> str:
    """Return who does most of something: ", most by 7 and 9"; empty where nobody does."""
    counts = looks.total("counts")[:, COUNTS.index(what)]
    first, second = np.argsort(-counts, kind="stable")[:2]
    if not counts[first]:
        return ""
    return f", most by {first + 1}" + (f" and {second + 1}" if counts[second] else "")


def _situations(subject: Subject) -> list[Picture]:
    """Return the picture of the situations in which the field players stand alike."""
    looks, field = subject.own[KEY], ~keepers(subject)
    places, ball = looks.joined("places"), looks.joined("ball")
    whole = np.isfinite(places[:, field]).all((1, 2))
    places, ball = places[whole], ball[whole]
    if len(places) < 2 * FRAMES // 10:
        return []
    label, centres = situations(places[:, field])
    drawn = []
    for at, centre in enumerate(centres):
        every = np.full((N_TEAM, 2), np.nan)
        every[field] = centre
        share = float((label == at).mean())
        drawn.append((f"{share:.0%}: {name_of_shape(centre[:, 0])}", every, ball[label == at].mean(0)))
    return [
        Picture(
            name="situations",
            draw=lambda: figures.situations(drawn),
            alt="The situations in which the team has the ball, and where it stands in each",
            caption="Situations with the ball, found by clustering where the field players stand; above each, how "
            "often it is and its lines. The dark dot is where the ball is then, on average.",
        )
    ]


def _deciders(looks: Looks) -> Table:
    counts = looks.total("counts")
    matches = max(len(looks), 1)
    worth = [row for row in range(N_TEAM) if counts[row].any()]
    order = sorted(worth, key=lambda row: -counts[row, 0])
    return Table(
        name="who-decides",
        caption="Who decides: numbers a match",
        columns=("number", *COUNTS[:2], "completed (share)", *COUNTS[3:]),
        rows=[
            (
                row + 1,
                *(float(counts[row, at]) / matches for at in (0, 1)),
                float(counts[row, 2] / counts[row, 1]) if counts[row, 1] else None,
                *(float(counts[row, at]) / matches for at in range(3, len(COUNTS))),
            )
            for row in order
        ],
    )


def _kicks(looks: Looks) -> Table:
    kicks = looks.total("kicks")
    rows = []
    for along in range(GRID[0]):
        for across in range(GRID[1]):
            here = kicks[:, along, across]
            if here.sum():
                rows.append((along + 1, across + 1, int(here.sum()), *(float(one / here.sum()) for one in here)))
    return Table(
        name="kicks-by-zone",
        caption="Kicks by zone",
        columns=("zone along", "zone across", "kicks", *(f"{one} (share)" for one in KICKS)),
        rows=rows,
        folded=True,
    )
