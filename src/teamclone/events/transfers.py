"""What a touch and the next one make together, by the definitions of rcg2data: passes, dribbles, interceptions.

rcg2data (github.com/hidehisaakiyama/rcg2data) makes the events of RoboCup2D-data. Its rules, in our words: what counts
is the last cycle in which the ball was kicked or tackled. If one player alone touched it, the next such cycle makes an
event. A catch, a touch while the ball is not in play, and the ball leaving the field forget the last touch; a foul, an
offside, a goal and the end of a half do not, so that a restart after them makes an event, too. Those have the outcome
``restart``.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from teamclone.events.definitions import EventKind, Outcome
from teamclone.events.found import Found, words
from teamclone.events.touches import NOBODY, OUT_OF_PLAY, Bools, Ints, Play, side_of
from teamclone.logs.columns import counter_name
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.playmodes import RESTARTS, SITUATION, Situation

MOVED_M = 1.0
"""Where the log counts no dashes, a player that moved farther than this has dashed: nobody coasts that far."""


def transfers(play: Play) -> Iterator[Found]:
    """Yield passes, dribbles, ball touches, interceptions and multi touches."""
    these = play.moments
    first = np.flatnonzero(these.single[:-1] & (these.count[1:] > 0))
    first = first[~_between(_outs(play), these.frame[first] + 1, these.frame[first + 1] + 1)]
    second = first + 1
    slot, receiver = these.slot[first], these.slot[second]
    side, into = side_of(slot), these.side[second]
    restart, tackled = these.stopped[first], these.tackled[second]
    one, ours = receiver != NOBODY, into == side
    same = receiver == slot
    dashed = _dashed(play, these.frame[first] + 1, these.frame[second] + 1, slot)
    lost = (into != 0) & ~ours
    failed = words((restart, Outcome.RESTART), (tackled | ~one, Outcome.FAILED), default=Outcome.COMPLETED)
    won = words((restart, Outcome.RESTART), default=Outcome.WON)
    for kind, which, outcome in (
        (EventKind.PASS, ours & ~same, failed),
        (EventKind.DRIBBLE, same & dashed, failed),
        (EventKind.BALL_TOUCH, same & ~dashed & tackled, None),
        (EventKind.MULTI_TOUCH, into == 0, None),
    ):
        yield Found.of(
            kind,
            these.frame[first[which]],
            outcome=Outcome.NONE if outcome is None else outcome[which],
            end_frame=these.frame[second[which]],
            slot=slot[which],
            other=np.full(int(which.sum()), NOBODY) if kind is EventKind.MULTI_TOUCH else receiver[which],
            other_side=into[which],
            touched=True,
        )
    yield Found.of(
        EventKind.INTERCEPTION,
        these.frame[first[lost]],
        outcome=won[lost],
        end_frame=these.frame[second[lost]],
        slot=receiver[lost],
        side=into[lost],
        other=slot[lost],
        touched=True,
    )


def out_of_bounds(play: Play) -> Found:
    """Return where the ball left the field, from the last touch on, by the team that does not get it."""
    these, out = play.moments, _outs(play)
    side = -RESTARTS[play.frames["playmode"][out]]
    last, known = _last(play, out)
    slot = np.full(len(out), NOBODY)
    slot[known] = these.only[last[known], (side[known] < 0).astype(np.int64)]
    frame = out.copy()
    frame[known] = these.frame[last[known]]
    return Found.of(EventKind.OUT_OF_BOUNDS, frame, end_frame=out, slot=slot, side=side)


def goals(play: Play) -> tuple[Found, Found]:
    """Return the goals, and the touches of the teams that scored them as shots."""
    these, mode = play.moments, play.frames["playmode"]
    is_goal = SITUATION[mode] == Situation.GOAL
    frame = np.flatnonzero(is_goal[1:] & ~is_goal[:-1]) + 1
    side = -RESTARTS[mode[frame]].astype(np.int64)
    last, known = _last(play, frame)
    slot, by = np.full(len(frame), NOBODY), np.zeros(len(frame), np.int64)
    slot[known], by[known] = these.slot[last[known]], these.side[last[known]]
    ours, theirs = by == side, by == -side
    goal = Found.of(
        EventKind.GOAL,
        frame,
        outcome=words((ours, Outcome.SCORED), (theirs, Outcome.OWN_GOAL), default=Outcome.UNCLEAR),
        slot=np.where(ours, slot, NOBODY),
        side=side,
        other=np.where(ours, NOBODY, slot),
        other_side=np.where(theirs, by, 0),
    )
    shot = Found.of(
        EventKind.SHOT,
        these.frame[last[ours]],
        outcome=Outcome.GOAL,
        end_frame=frame[ours],
        slot=slot[ours],
        side=side[ours],
        touched=True,
    )
    return goal, shot


def _last(play: Play, frames: Ints) -> tuple[Ints, Bools]:
    """Return the last moment before each of these frames (n,), and whether it is still remembered then (n,)."""
    these = play.moments
    last = np.searchsorted(these.frame, frames) - 1
    known = last >= 0
    at = last[known]
    known[known] = these.counts[at] & ~_between(_outs(play), these.frame[at] + 1, frames[known])
    return last, known


def _outs(play: Play) -> Ints:
    """Return the frames with which the ball has left the field, whichever way."""
    what = SITUATION[play.frames["playmode"]]
    return np.flatnonzero((what[1:] != what[:-1]) & np.isin(what[1:], OUT_OF_PLAY)) + 1


def _between(frames: Ints, first: Ints, end: Ints) -> Bools:
    """Return (n,) whether one of the frames, in order, is from ``first`` on and before ``end``."""
    return np.searchsorted(frames, first) < np.searchsorted(frames, end)


def _dashed(play: Play, first: Ints, second: Ints, slot: Ints) -> Bools:
    """Return (n,) whether a player dashed between two frames."""
    count = play.players[counter_name(CommandKind.DASH)]
    away = [play.players[name][second, slot].astype(np.float64) - play.players[name][first, slot] for name in "xy"]
    moved = np.hypot(*away) > MOVED_M
    counted = count[second, slot] >= 0
    found: Bools = np.where(counted, count[second, slot] > count[first, slot], moved)
    return found
