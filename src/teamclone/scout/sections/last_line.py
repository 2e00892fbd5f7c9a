"""How high the last line of a team stands, and what is behind and between it; a part of the section defence."""

from __future__ import annotations

import numpy as np

from teamclone.events.definitions import EventKind, Outcome
from teamclone.logs.match import Columns
from teamclone.rcss import pitch
from teamclone.rcss.players import N_TEAM
from teamclone.scout import figures
from teamclone.scout.findings import Findings, Picture, Table, claim, claims
from teamclone.scout.measures import Look, Looks, Measure, Moment
from teamclone.scout.places import LANES, in_lane, lane, third
from teamclone.scout.seen import Bools, Floats, Seen
from teamclone.scout.windows import followed, foremost, until, who

IN_LINE = 4
"""So many hindmost field players are the last line."""
BINS = 10
"""Of the ball's place along the pitch."""
SHOT_CYCLES = 50
"""Within how many cycles a shot follows a through pass or a tackle that fails."""
FOLLOW_M = 10.0
MOST_WAYS = 15

MEASURES = (
    Measure(
        key="defence_line",
        name="height of the last line",
        unit="m",
        about="of the hindmost field player above its own goal line, while the opponent has the ball",
    ),
    *(
        Measure(
            key=f"defence_line_{place}",
            name=f"height of the last line, ball in the {name}",
            unit="m",
            about="of the hindmost field player above its own goal line, while the opponent has the ball there",
        )
        for place, name in (("low", "own third"), ("middle", "middle third"), ("high", "attacking third"))
    ),
    Measure(
        key="defence_follow",
        name="how the line follows the ball",
        unit="m",
        about=f"that it moves with {FOLLOW_M:g} m of the ball along the pitch, by least squares",
    ),
    Measure(
        key="defence_behind",
        name="room behind the last line",
        unit="m",
        about="from the hindmost field player to the goalkeeper, while the opponent has the ball",
    ),
    Measure(
        key="defence_gap",
        name="widest gap in the last line",
        unit="m",
        about=f"between neighbours of the {IN_LINE} hindmost field players, ball not in the attacking third",
        good=-1,
    ),
    *(
        Measure(
            key=f"defence_gap_{place}",
            name=f"gap {in_lane(place)} of the last line",
            unit="m",
            about=f"between neighbours of the {IN_LINE} hindmost field players, ball not in the attacking third",
            good=-1,
        )
        for place in LANES
    ),
    Measure(
        key="defence_through",
        name="through passes against",
        unit="",
        about="completed in a match",
        good=-1,
    ),
    Measure(
        key="defence_through_completed",
        name="through passes against that arrive",
        unit="share",
        about="of those tried",
        good=-1,
    ),
    *(
        Measure(
            key=f"defence_through_{place}",
            name=f"through passes against, {place}",
            unit="",
            about="completed in a match, by where they end",
            good=-1,
        )
        for place in LANES
    ),
)


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    without = seen.has == -1
    ball = seen.ball[without].astype(np.float64)
    place = seen.outfield[without, :N_TEAM].astype(np.float64)
    known = np.isfinite(place).all(-1).sum(1) >= IN_LINE
    ball, place = ball[known], place[known]
    place = np.where(np.isfinite(place), place, np.inf)
    order = np.argsort(place[..., 0], axis=1)[:, :IN_LINE]
    line = np.take_along_axis(place, order[..., None], axis=1)
    height = line[:, 0, 0] + pitch.HALF_LENGTH if len(line) else np.zeros(0)
    room = height - (_goalie_x(seen, without)[known] + pitch.HALF_LENGTH)
    near = third(ball[:, 0]) < 2
    gaps = np.diff(np.sort(line[near, :, 1], axis=1), axis=1)
    apart = ball[:, 0] - ball[:, 0].mean() if len(ball) else ball[:, 0]
    numbers = {
        "defence_line": _mean(height),
        "defence_follow": (FOLLOW_M * float((apart * height).sum()), float((apart**2).sum())),
        "defence_behind": _mean(room[np.isfinite(room)]),
        "defence_gap": _mean(gaps.max(1, initial=0.0)),
    }
    for index, name in enumerate(("low", "middle", "high")):
        numbers[f"defence_line_{name}"] = _mean(height[third(ball[:, 0]) == index])
    for index, name in enumerate(LANES):
        numbers[f"defence_gap_{name}"] = _mean(gaps[:, index])
    bins = np.clip((ball[:, 0] / pitch.LENGTH + 0.5) * BINS, 0, BINS - 1).astype(np.int64)
    behind = np.isfinite(room)
    through = _through(seen)
    return Look(
        numbers={**numbers, **through.numbers},
        arrays={
            "line_height": np.bincount(bins, weights=height, minlength=BINS),
            "line_cycles": np.bincount(bins, minlength=BINS).astype(np.float64),
            "line_room": np.bincount(bins[behind], weights=room[behind], minlength=BINS),
            "line_room_cycles": np.bincount(bins[behind], minlength=BINS).astype(np.float64),
            **through.arrays,
        },
        moments=through.moments,
    )


def _mean(values: Floats) -> tuple[float, float]:
    return float(values.sum()), float(len(values))


def _goalie_x(seen: Seen, these: Bools) -> Floats:
    """Return x (n,) of the goalkeeper in some frames, NaN without one."""
    x, keeps = seen.places[these, :N_TEAM, 0].astype(np.float64), seen.goalies[these, :N_TEAM]
    found: Floats = np.where(keeps.any(1), x[np.arange(len(x)), keeps.argmax(1)], np.nan)
    return found


def _through(seen: Seen) -> Look:
    """Return the through passes of the opponents."""
    passes = seen.pick(EventKind.THROUGH_PASS, own=False)
    there = passes["outcome"] == Outcome.COMPLETED
    lanes = lane(passes["end_y"])
    tried, length = float(len(there)), seen.length
    numbers = {
        "defence_through": (float(there.sum()), length),
        "defence_through_completed": (float(there.sum()), tried),
    }
    for index, name in enumerate(LANES):
        numbers[f"defence_through_{name}"] = (float((there & (lanes == index)).sum()), length)
    ways = np.stack([passes[name] for name in ("x", "y", "end_x", "end_y")], -1)
    tries = [np.bincount(lanes[these], minlength=3) for these in (there | True, there)]
    return Look(
        numbers=numbers,
        arrays={"through_ways": ways[there][:MOST_WAYS].astype(np.float32), "through_lanes": np.stack(tries)},
        moments={"through": _moments(seen, passes, there)},
    )


def _moments(seen: Seen, passes: Columns, there: Bools) -> list[Moment]:
    """Return through passes that arrive, those with a shot soon first."""
    rows = np.flatnonzero(there)
    start = passes["end_frame"][rows]
    end = until(seen, start, SHOT_CYCLES)
    shot, goal = (
        followed(seen.pick(EventKind.SHOT, *outcome, own=False)["frame"], start, end)
        for outcome in ((), (Outcome.GOAL,))
    )
    weight = goal + 0.5 * shot
    return foremost(
        seen,
        passes["frame"][rows],
        passes["unum"][rows],
        weight,
        lambda one: (
            f"their {who(int(passes['unum'][rows[one]]))} plays {who(int(passes['other_unum'][rows[one]]))} through"
            + (", then a goal" if goal[one] else ", then a shot" if shot[one] else "")
        ),
        own=False,
    )


def tell(looks: Looks, other: Looks) -> Findings:
    """Return what its matches say of this; ``other`` is of its opponents."""
    by_lane = looks.total("through_lanes")[1]
    most = LANES[int(by_lane.argmax())]
    wide = max(LANES, key=lambda one: looks.figure(f"defence_gap_{one}").value or 0.0)
    return Findings(
        claims=claims(
            claim(
                looks,
                "Its last line stands {defence_line_low} from its goal line with the ball in its own third, "
                "{defence_line_middle} with the ball in the middle, {defence_line_high} with the ball in the attacking "
                f"third. For {FOLLOW_M:g} m of the ball it moves {{defence_follow}}.",
            ),
            claim(
                looks,
                "Between its last line and its goalkeeper lie {defence_behind}. The widest gap between neighbours of "
                f"the line is {{defence_gap}}; the one {in_lane(wide)} is on average {{defence_gap_{wide}}}.",
            ),
            claim(
                looks,
                "{defence_through} through passes a match arrive behind its last line, {defence_through_completed} of "
                f"those tried; most of them end {in_lane(most)}, {{defence_through_{most}}} a match.",
                moments=("through",),
            )
            if by_lane.sum()
            else None,
        ),
        pictures=[
            Picture(
                name="last-line",
                draw=lambda: figures.curves(_panels(looks, other)),
                alt="Height of the last line and room behind it by the place of the ball",
                caption="While the other team has the ball: how far the hindmost field player stands from the goal "
                "line, and how far in front of the goalkeeper. Bands are 95 % intervals over matches.",
            )
        ]
        if looks.total("line_cycles").sum()
        else [],
        tables=[_table(looks)],
    )


def _panels(looks: Looks, other: Looks) -> list[figures.CurvePanel]:
    x = (np.arange(BINS) + 0.5) * pitch.LENGTH / BINS
    return [
        (
            title,
            "ball from the defended goal line, m",
            "m",
            x,
            [
                (name, *figures.by_bin(these.each(part), these.each(whole)))
                for name, these in (("the team", looks), ("its opponents", other))
            ],
        )
        for title, part, whole in (
            ("Height of the last line", "line_height", "line_cycles"),
            ("Room behind it", "line_room", "line_room_cycles"),
        )
    ]


def _table(looks: Looks) -> Table:
    tried, there = looks.total("through_lanes")
    return Table(
        name="through-passes",
        caption="Through passes against it and gaps in its last line",
        columns=("lane", "tried", "arrive", "arrive (share)", "gap (m)"),
        rows=[
            (
                name,
                int(tried[index]),
                int(there[index]),
                float(there[index] / tried[index]) if tried[index] else None,
                looks.figure(f"defence_gap_{name}").value,
            )
            for index, name in enumerate(LANES)
        ],
        folded=True,
    )
