"""Events in the columns of rcg2data's ``.event.csv``, so that numbers compare with RoboCup2D-data."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from teamclone.events.definitions import EventKind, Outcome
from teamclone.logs.match import Columns

TYPES = {
    (EventKind.PASS, Outcome.COMPLETED): "Pass",
    (EventKind.PASS, Outcome.FAILED): "Pass",
    (EventKind.PASS, Outcome.RESTART): "Pass",
    (EventKind.DRIBBLE, Outcome.COMPLETED): "Dribble",
    (EventKind.DRIBBLE, Outcome.FAILED): "Dribble",
    (EventKind.DRIBBLE, Outcome.RESTART): "Dribble",
    (EventKind.INTERCEPTION, Outcome.WON): "Interception",
    (EventKind.INTERCEPTION, Outcome.RESTART): "Interception",
    (EventKind.BALL_TOUCH, Outcome.NONE): "BallTouch",
    (EventKind.MULTI_TOUCH, Outcome.NONE): "MultiTouch",
    (EventKind.OUT_OF_BOUNDS, Outcome.NONE): "OutOfBounds",
    (EventKind.SHOT, Outcome.GOAL): "Shoot",
    (EventKind.GOAL, Outcome.OWN_GOAL): "OwnGoal",
    (EventKind.GOAL, Outcome.UNCLEAR): "OwnGoal",
}
"""rcg2data's name of an event of a kind and outcome; what is not here it does not have."""


def as_rcg2data(events: Columns) -> Columns:
    """Return those events that rcg2data has, under its names: ``Type``, ``Side1``, ``Unum1``, ``Time1`` and so on.

    Side 1 lost, passed or shot the ball, side 2 has it next; sides are ``left``, ``right`` or ``neutral``. Times are
    cycles, places metres. Own goals, which rcg2data begins with the touch, begin and end with the goal here.

    Args:
        events: ``definitions.COLUMNS`` of one match.
    """
    names = np.array(
        [TYPES.get((kind, outcome), "") for kind, outcome in zip(events["kind"], events["outcome"], strict=True)], "U12"
    )
    kept = np.flatnonzero(names != "")
    names = names[kept]
    taken, own = names == "Interception", names == "OwnGoal"
    other = taken | own
    side, unum, other_side, other_unum = (events[name][kept] for name in ("side", "unum", "other_side", "other_unum"))
    return {
        "Type": names,
        "Side1": _words(np.where(other, other_side, side)),
        "Unum1": np.where(other, other_unum, unum),
        "Time1": events["cycle"][kept],
        "X1": events["x"][kept],
        "Y1": events["y"][kept],
        "Side2": _words(np.where(taken, side, np.where(own, 0, other_side))),
        "Unum2": np.where(taken, unum, np.where(own, 0, other_unum)),
        "Time2": events["end_cycle"][kept],
        "X2": events["end_x"][kept],
        "Y2": events["end_y"][kept],
        "Success": ~(
            (events["outcome"][kept] == Outcome.FAILED) | np.isin(names, ("BallTouch", "MultiTouch", "OutOfBounds"))
        ),
    }


def _words(side: NDArray[np.int8]) -> NDArray[np.str_]:
    return np.array(["neutral", "left", "right"])[side]
