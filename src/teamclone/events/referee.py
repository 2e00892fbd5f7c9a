"""What play modes and state bits say: set plays, fouls, offsides, cards, periods, and who comes and goes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from teamclone.events.definitions import EventKind
from teamclone.events.found import Found
from teamclone.events.own import OFFSIDES
from teamclone.events.touches import NOBODY, Ints, Play, TouchKind, rises, side_of
from teamclone.rcss import state_bits
from teamclone.rcss.players import SLOT_SIDES
from teamclone.rcss.playmodes import RESTARTS, SITUATION, PlayMode, Situation

_PERIODS = {
    PlayMode.BEFORE_KICK_OFF: "before kick-off",
    PlayMode.TIME_OVER: "time over",
    PlayMode.FIRST_HALF_OVER: "first half over",
    PlayMode.PAUSE: "pause",
    PlayMode.HUMAN_JUDGE: "the human referee stops the match",
}
_SHOWN_BY = {
    PlayMode.BACK_PASS_L: state_bits.BACK_PASS,
    PlayMode.BACK_PASS_R: state_bits.BACK_PASS,
    PlayMode.FREE_KICK_FAULT_L: state_bits.FREE_KICK_FAULT,
    PlayMode.FREE_KICK_FAULT_R: state_bits.FREE_KICK_FAULT,
    PlayMode.CATCH_FAULT_L: state_bits.CATCH_FAULT,
    PlayMode.CATCH_FAULT_R: state_bits.CATCH_FAULT,
}
"""The state bit of the player that did it."""
_NAMES = np.array([mode.name.removesuffix("_L").removesuffix("_R").lower().replace("_", " ") for mode in PlayMode])
_WORDS = np.array([_PERIODS.get(mode, _NAMES[mode].removeprefix("foul ")) for mode in PlayMode])
"""What there is to say of a play mode."""


def by_mode(play: Play) -> Iterator[Found]:
    """Yield set plays, fouls, offsides and periods."""
    mode = play.frames["playmode"]
    changes = np.concatenate([[0], np.flatnonzero(mode[1:] != mode[:-1]) + 1])
    ends = np.append(changes[1:], len(mode) - 1)
    known = ~np.isin(mode[changes], (PlayMode.NULL, PlayMode.PLAY_ON)) & (mode[changes] < len(PlayMode))
    frame, end = changes[known], ends[known]
    now = mode[frame]
    period, goal = np.isin(now, list(_PERIODS)), SITUATION[now] == Situation.GOAL
    offside, fault = np.isin(now, OFFSIDES), SITUATION[now] == Situation.FAULT
    set_play = ~period & ~goal & ~fault
    yield Found.of(EventKind.PERIOD, frame[period], outcome=_WORDS[now[period]])
    yield Found.of(EventKind.OFFSIDE, frame[offside], side=-RESTARTS[now[offside]])
    foul = fault & ~offside
    slot, other = _who(play, frame[foul])
    yield Found.of(
        EventKind.FOUL,
        frame[foul],
        outcome=_WORDS[now[foul]],
        slot=slot,
        side=-RESTARTS[now[foul]],
        other=other,
    )
    yield Found.of(
        EventKind.SET_PLAY,
        frame[set_play],
        outcome=_WORDS[now[set_play]],
        end_frame=end[set_play],
        slot=_taker(play, frame[set_play], end[set_play], RESTARTS[now[set_play]]),
        side=RESTARTS[now[set_play]],
    )


def _taker(play: Play, frame: Ints, end: Ints, side: Ints) -> Ints:
    """Return (n,) the player of the team whose set play it is that takes it; NOBODY where it cannot be told."""
    these = play.moments
    taker = np.full(len(frame), NOBODY)
    if not len(these.frame):
        return taker
    first = np.searchsorted(these.frame, frame)
    at = np.minimum(first, len(these.frame) - 1)
    taken = (first < len(these.frame)) & (these.frame[at] < end)
    ours = these.slot[at] != NOBODY
    slot = np.where(taken & ours, these.slot[at], NOBODY)
    return np.where(side_of(slot) == side, slot, NOBODY)


def _who(play: Play, frames: Ints) -> tuple[Ints, Ints]:
    """Return who committed fouls and who was charged, (n,) places on the player axis; NOBODY where it is not known."""
    state, mode, found = play.players["state"], play.frames["playmode"], play.touches
    guilty, charged = (np.full(len(frames), NOBODY) for _ in range(2))
    for index, frame in enumerate(frames):
        ours = -RESTARTS[mode[frame]] == SLOT_SIDES
        shown = _SHOWN_BY.get(PlayMode(int(mode[frame])))
        if shown is not None:
            did = np.flatnonzero(((state[frame] & shown) != 0) & ours)
        else:
            tackles = (found.frame == frame - 1) & (found.kind == TouchKind.TACKLE)
            did = found.slot[tackles][ours[found.slot[tackles]]]
        fresh = ((state[frame] & state_bits.FOUL_CHARGED) != 0) & ((state[frame - 1] & state_bits.FOUL_CHARGED) == 0)
        victims = np.flatnonzero(fresh & ~ours)
        guilty[index] = did[0] if len(did) == 1 else NOBODY
        charged[index] = victims[0] if len(victims) == 1 else NOBODY
    return guilty, charged


def of_players(play: Play) -> Iterator[Found]:
    """Yield cards, changes of type, and players that come or go during the match."""
    state, types = play.players["state"], play.players["type"]
    there = (state & state_bits.STAND) != 0
    changed = (types[1:] != types[:-1]) & there[1:] & there[:-1]
    for kind, word, found in (
        (EventKind.CARD, "yellow", rises((state & state_bits.YELLOW_CARD) != 0)),
        (EventKind.CARD, "red", rises((state & state_bits.RED_CARD) != 0)),
        (EventKind.PLAYER, "leaves the field", rises(~there)),
        (EventKind.PLAYER, "comes onto the field", rises(there)),
        (EventKind.PLAYER, "changes to type ", changed),
    ):
        frame, slot = np.nonzero(found)
        what = np.full(len(frame), word)
        if found is changed:
            what = np.char.add(what, types[frame + 1, slot].astype(str))
        yield Found.of(kind, frame + 1, outcome=what, slot=slot)
