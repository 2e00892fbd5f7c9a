"""When a team presses, and what makes it press; a part of the section defence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teamclone.events.definitions import PRESS_M, EventKind, Outcome
from teamclone.logs.match import Columns
from teamclone.rcss import pitch
from teamclone.rcss.players import N_TEAM
from teamclone.scout.findings import Claim, Findings, Table, claim, claims
from teamclone.scout.measures import Look, Looks, Measure, Moment, ratio, resampled
from teamclone.scout.places import LANES, THIRDS, counted, lane, third
from teamclone.scout.seen import Bools, Floats, Ints, Seen
from teamclone.scout.windows import followed, foremost, who
from teamclone.world.channels import CHANNEL

CYCLES = 100
"""In how many cycles of the opponents' possession presses and balls won are counted."""
STARTS_CYCLES = 10
"""Within how many cycles after the opponents get the ball a press begins that answers it."""
BACK_M = 2.0
SIDE_M = 6.0
"""How near to a side line the ball is there."""
LONG_M = 15.0
FACING_DEG = 60.0

TRIGGERS = (
    "after a pass backwards",
    "with the ball at a side line",
    f"after a pass over {LONG_M:g} m",
    "on a receiver that faces its own goal",
    "just after losing the ball",
)
IN_THIRD = ("low", "middle", "high")

MEASURES = (
    Measure(
        key="defence_press",
        name="presses",
        unit="",
        about=f"in {CYCLES} cycles in which the opponent has the ball",
    ),
    Measure(key="defence_press_won", name="presses that win the ball", unit="share", about="of its presses", good=1),
    *(
        Measure(
            key=f"defence_press_{place}",
            name=f"presses in the {name}",
            unit="",
            about=f"in {CYCLES} cycles in which the opponent has the ball there",
        )
        for place, name in (*zip(IN_THIRD, THIRDS, strict=True), *((one, f"{one} of the pitch") for one in LANES))
    ),
    Measure(
        key="defence_pressure",
        name="distance of the nearest from the ball",
        unit="m",
        about="field players, while the opponent has the ball",
    ),
    Measure(
        key="defence_two",
        name="two at the ball",
        unit="share",
        about=f"of the cycles in which the opponent has it, those with two or more field players within {PRESS_M:g} m",
    ),
)


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    without = seen.has == -1
    ball = seen.ball[without]
    presses = seen.pick(EventKind.PRESS)
    where, held = third(presses["x"]), third(ball[:, 0])
    side, ran = lane(presses["y"]), lane(ball[:, 1])
    won = presses["outcome"] == Outcome.WON
    away = _distances(seen, without)
    known = np.isfinite(away).any(1)
    away = np.where(np.isfinite(away), away, np.inf)[known]
    numbers = {
        "defence_press": (CYCLES * float(len(where)), float(len(ball))),
        "defence_press_won": (float(won.sum()), float(len(won))),
        "defence_pressure": (float(away.min(1, initial=np.inf).sum()) if len(away) else 0.0, float(len(away))),
        "defence_two": (float(((away <= PRESS_M).sum(1) >= 2).sum()), float(len(away))),
    }
    for index, place in enumerate(IN_THIRD):
        numbers[f"defence_press_{place}"] = (CYCLES * float((where == index).sum()), float((held == index).sum()))
    for index, place in enumerate(LANES):
        numbers[f"defence_press_{place}"] = (CYCLES * float((side == index).sum()), float((ran == index).sum()))
    return Look(
        numbers=numbers,
        arrays={
            "press_places": counted(presses["x"], presses["y"]),
            "press_held": counted(ball[:, 0], ball[:, 1]),
            "press_triggers": _triggers(seen, presses["frame"]),
            "press_by": np.bincount(presses["unum"], minlength=N_TEAM + 1),
            "press_by_won": np.bincount(presses["unum"][won], minlength=N_TEAM + 1),
        },
        moments={"press_won": _moments(seen, presses, won)},
    )


def _distances(seen: Seen, these: Bools) -> Floats:
    """Return the distances (n, 11) of the field players from the ball in some frames; NaN of others."""
    apart = seen.outfield[these, :N_TEAM] - seen.ball[these, None]
    found: Floats = np.hypot(apart[..., 0], apart[..., 1])
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Gains:
    """When opponents get the ball, arrays (n,): by a completed pass or by winning it.

    Attributes:
        frame: index. x, y: of the ball, m. back: how far it came backwards for them, m, of a pass. length: of a pass,
            m. facing: how far from straight to their own goal the receiver looks, deg. won: not by a pass.
    """

    frame: Ints
    x: Floats
    y: Floats
    back: Floats
    length: Floats
    facing: Floats
    won: Bools


def gains(seen: Seen) -> Gains:
    """Return when the opponents get the ball."""
    passes = seen.pick(EventKind.PASS, Outcome.COMPLETED, own=False)
    won = seen.pick(EventKind.INTERCEPTION, Outcome.WON, own=False)
    n = len(won["frame"])
    frame = np.concatenate([passes["end_frame"], won["end_frame"]])
    unum = np.concatenate([passes["other_unum"], won["unum"]]).astype(np.int64)
    body = seen.world.players[frame, N_TEAM + np.maximum(unum, 1) - 1, CHANNEL["body"]]
    return Gains(
        frame=frame,
        x=np.concatenate([passes["end_x"], won["end_x"]]),
        y=np.concatenate([passes["end_y"], won["end_y"]]),
        # They attack -x.
        back=np.concatenate([passes["end_x"] - passes["x"], np.zeros(n)]),
        length=np.concatenate([passes["length"], np.zeros(n)]),
        facing=np.where(unum > 0, np.abs(body), np.nan),
        won=np.concatenate([np.zeros(len(passes["frame"]), np.bool_), np.ones(n, np.bool_)]),
    )


def _triggers(seen: Seen, starts: Ints) -> Floats:
    """Return (n_triggers, 4) presses begun and gains of the opponents with each trigger, and both without it."""
    found = gains(seen)
    order = np.sort(starts)
    pressed = followed(order, found.frame, found.frame + STARTS_CYCLES)
    with np.errstate(invalid="ignore"):
        facing = found.facing <= FACING_DEG
    held = (
        found.back >= BACK_M,
        np.abs(found.y) >= pitch.HALF_WIDTH - SIDE_M,
        found.length >= LONG_M,
        facing & ~found.won,
        found.won,
    )
    return np.array(
        [[(pressed & one).sum(), one.sum(), (pressed & ~one).sum(), (~one).sum()] for one in held], np.float64
    )


def _moments(seen: Seen, presses: Columns, won: Bools) -> list[Moment]:
    """Return presses that win the ball, nearest to the opponents' goal first."""
    rows = np.flatnonzero(won)
    return foremost(
        seen,
        presses["frame"][rows],
        presses["unum"][rows],
        presses["end_x"][rows].astype(np.float64) + pitch.HALF_LENGTH,
        lambda one: f"{who(int(presses['unum'][rows[one]]))} presses and wins it",
    )


def tell(looks: Looks) -> Findings:
    """Return what its matches say of this."""
    return Findings(
        claims=claims(
            claim(
                looks,
                f"In {CYCLES} cycles of the opponent's possession it presses {{defence_press_high}} times in its "
                "attacking third, {defence_press_middle} in the middle and {defence_press_low} in its own; "
                "{defence_press_won} of the presses win the ball.",
                moments=("press_won",),
            ),
            _trigger(looks),
        ),
        tables=[_triggers_table(looks), _by_number(looks)],
    )


def _difference(looks: Looks, index: int) -> tuple[float, float, float]:
    """Return how much more often a press begins with a trigger than without, and the ends of the interval."""
    counts = looks.each("press_triggers")[:, index]
    there = (counts[:, 1] > 0) & (counts[:, 3] > 0)
    if there.sum() < 2:
        return np.nan, np.nan, np.nan
    counts = counts[there]
    sums = counts.sum(0)
    apart = resampled(counts[:, 0], counts[:, 1]) - resampled(counts[:, 2], counts[:, 3])
    low, high = np.nanpercentile(apart, [2.5, 97.5])
    return float(sums[0] / sums[1] - sums[2] / sums[3]), float(low), float(high)


def _trigger(looks: Looks) -> Claim | None:
    """Return the trigger with which presses begin much more often than without, if one is beyond doubt."""
    apart = {index: _difference(looks, index) for index in range(len(TRIGGERS))}
    sure = {index: one[0] for index, one in apart.items() if one[1] > 0}
    if not sure:
        return None
    index = max(sure, key=lambda one: sure[one])
    counts = looks.each("press_triggers")[:, index]
    return claim(
        looks,
        f"It presses most readily {TRIGGERS[index]}: within {STARTS_CYCLES} cycles in {{with}} of the cases, in "
        "{without} of the others.",
        shares={"with": ratio(counts[:, 0], counts[:, 1]), "without": ratio(counts[:, 2], counts[:, 3])},
    )


def _triggers_table(looks: Looks) -> Table:
    rows = []
    for index, name in enumerate(TRIGGERS):
        counts = looks.each("press_triggers")[:, index]
        rows.append(
            (
                name,
                int(counts[:, 1].sum()),
                ratio(counts[:, 0], counts[:, 1]).value,
                ratio(counts[:, 2], counts[:, 3]).value,
            )
        )
    return Table(
        name="press-triggers",
        caption=f"What makes it press within {STARTS_CYCLES} cycles after the opponent gets the ball",
        columns=("when", "cases", "a press begins (share)", "otherwise (share)"),
        rows=rows,
        folded=True,
    )


def _by_number(looks: Looks) -> Table:
    made, won = looks.total("press_by"), looks.total("press_by_won")
    return Table(
        name="press-by-number",
        caption="Who presses",
        columns=("number", "presses", "ball won (share)"),
        rows=[
            (str(unum), int(made[unum]), float(won[unum] / made[unum]))
            for unum in np.argsort(-made[1:], kind="stable") + 1
            if made[unum]
        ],
        folded=True,
    )
