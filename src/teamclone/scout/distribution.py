"""To whom the first pass of a restart goes, and where the goalkeeper's balls go."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from teamclone.events.definitions import EventKind, Outcome
from teamclone.rcss import pitch
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.playmodes import RESTARTS, SITUATION, Situation
from teamclone.scout.places import third
from teamclone.scout.seen import Ints, Seen

LONG_M = 25.0
"""A longer ball of the goalkeeper is a long one."""
NOBODY = N_TEAM
"""Stands for the receiver of a pass that is lost."""

_BY_SIDE = {0: " on the left", 2: " on the right"}
_BY_THIRD = {0: " in the own third", 1: " in the middle third", 2: " in the attacking third"}
RESTART_KINDS: tuple[tuple[Situation, str, Mapping[int, str]], ...] = (
    (Situation.KICK_OFF, "kick-off", {0: ""}),
    (Situation.KICK_IN, "kick-in", _BY_SIDE),
    (Situation.FREE_KICK, "free kick", _BY_THIRD),
    (Situation.INDIRECT_FREE_KICK, "indirect free kick", _BY_THIRD),
    (Situation.CORNER_KICK, "corner", _BY_SIDE),
    (Situation.GOAL_KICK, "goal kick", {0: ""}),
)
"""Kinds of restarts, their names, and those of their parts, which are places on the pitch."""
N_PARTS = 3


def restarts(seen: Seen) -> tuple[Ints, Ints]:
    """Return the first passes of restarts, and when there was one.

    Returns:
        (kinds, N_PARTS, 11, 12) how often, by kind, part, taker and receiver; (kinds, N_PARTS, 11, 12, 2) cycle and
        stoppage of one of them, -1 of none.
    """
    counts = np.zeros((len(RESTART_KINDS), N_PARTS, N_TEAM, N_TEAM + 1), np.int64)
    when = np.full((*counts.shape, 2), -1, np.int64)
    passes = seen.pick(EventKind.PASS)
    mode, x, y = passes["playmode"], passes["x"], passes["y"]
    unum, other = passes["unum"].astype(np.int64), passes["other_unum"].astype(np.int64)
    ours = (RESTARTS[mode] == seen.world.side) & (unum > 0) & (passes["outcome"] != str(Outcome.RESTART))
    receiver = np.where(passes["other_own"] & (other > 0), other - 1, NOBODY)
    for at, (kind, _, parts) in enumerate(RESTART_KINDS):
        part = np.where(y > 0, 2, 0) if parts is _BY_SIDE else third(x) if parts is _BY_THIRD else np.zeros(len(x), int)
        these = ours & (SITUATION[mode] == kind)
        index = (np.full(int(these.sum()), at), part[these], unum[these] - 1, receiver[these])
        np.add.at(counts, index, 1)
        when[index] = np.stack([passes["cycle"][these], passes["stoppage"][these]], -1)
    return counts, when


def keeper(seen: Seen) -> Mapping[str, tuple[float, float]]:
    """Return part and whole of where the balls go that the goalkeeper passes or clears.

    Left and right are what ends beside the width of the goal area.
    """
    played = [seen.pick(kind) for kind in (EventKind.PASS, EventKind.CLEARANCE)]
    balls = {name: np.concatenate([one[name] for one in played]) for name in played[0]}
    unum = balls["unum"].astype(np.int64)
    theirs = (unum > 0) & seen.goalies[balls["frame"], unum - 1] & (balls["outcome"] != str(Outcome.RESTART))
    whole = float(theirs.sum())
    lost = ~np.isin(balls["outcome"], [str(one) for one in (Outcome.COMPLETED, Outcome.FAILED)])
    aside = balls["end_y"] / (pitch.GOAL_AREA_WIDTH / 2)
    return {
        "long": (float((theirs & (balls["length"] >= LONG_M)).sum()), whole),
        "lost": (float((theirs & lost).sum()), whole),
        "left": (float((theirs & (aside < -1)).sum()), whole),
        "right": (float((theirs & (aside > 1)).sum()), whole),
    }
