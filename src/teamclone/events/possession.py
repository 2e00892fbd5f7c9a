"""Who has the ball, and who presses who has it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from teamclone.events.definitions import PRESS_CYCLES, PRESS_M, PRESS_RUN_M, EventKind, Outcome
from teamclone.events.found import Found, words
from teamclone.events.own import OFFSIDES
from teamclone.events.touches import OUT_OF_PLAY, Bools, Ints, Play, owners
from teamclone.rcss import state_bits
from teamclone.rcss.players import SLOT_SIDES
from teamclone.rcss.playmodes import SITUATION, Situation


def possession(play: Play) -> Iterator[Found]:
    """Yield the spells in which a team has the ball, and the players that press."""
    side, moment = owners(play)
    yield _spells(play, side.astype(np.int64), moment)
    yield _presses(play, side.astype(np.int64), moment)


def _spells(play: Play, side: Ints, moment: Ints) -> Found:
    these, mode = play.moments, play.frames["playmode"]
    start, end = _runs(np.concatenate([[True], side[1:] != side[:-1]]))
    held = side[start] != 0
    start, end = start[held], end[held]
    own = side[start]
    n_frames = len(side)
    over = end == n_frames
    then = np.minimum(end, n_frames - 1)
    what = SITUATION[mode[then]]
    caught = these.frame[these.count == 0]
    outcome = words(
        (over, Outcome.END),
        (side[then] == -own, Outcome.LOST),
        (np.isin(then - 1, caught), Outcome.CAUGHT),
        (np.isin(what, OUT_OF_PLAY), Outcome.OUT),
        (what == Situation.GOAL, Outcome.GOAL),
        (np.isin(mode[then], OFFSIDES), Outcome.OFFSIDE),
        (what == Situation.FAULT, Outcome.FOUL),
        default=Outcome.STOPPED,
    )
    return Found.of(
        EventKind.POSSESSION,
        start,
        outcome=outcome,
        end_frame=then,
        slot=these.slot[moment[start]] if len(these.frame) else start,
        side=own,
        other=these.slot[moment[end - 1]] if len(these.frame) else start,
        other_side=own,
    )


def _presses(play: Play, side: Ints, moment: Ints) -> Found:
    frames, these = len(side), play.moments
    place = np.stack([play.players["x"], play.players["y"]], -1).astype(np.float64)
    to_ball = play.ball[:, None] - place
    distance = np.hypot(to_ball[..., 0], to_ball[..., 1])
    there = (play.players["state"] & state_bits.STAND) != 0
    near = there & (side[:, None] == -SLOT_SIDES) & (distance <= PRESS_M)
    towards = np.einsum("ijk,ijk->ij", np.diff(place, axis=0, append=place[-1:]), to_ball)
    ran = np.where(near & (distance > 0), np.maximum(towards / np.where(distance > 0, distance, 1), 0), 0)
    ran = np.concatenate([np.zeros((1, len(SLOT_SIDES))), np.cumsum(ran, axis=0)])
    # Player after player, with a frame between them in which nobody presses.
    flat = np.concatenate([near, np.zeros((1, near.shape[1]), np.bool_)]).T.ravel()
    start, end = _runs(np.concatenate([[True], flat[1:] != flat[:-1]]))
    pressing = flat[start]
    slot, start = np.divmod(start[pressing], frames + 1)
    end = end[pressing] - slot * (frames + 1)
    kept = (end - start >= PRESS_CYCLES) & (ran[end, slot] - ran[start, slot] >= PRESS_RUN_M)
    slot, start, end = slot[kept], start[kept], end[kept]
    then = np.minimum(end, frames - 1)
    return Found.of(
        EventKind.PRESS,
        start,
        outcome=words((side[then] == SLOT_SIDES[slot], Outcome.WON), default=Outcome.LOST),
        end_frame=then,
        slot=slot,
        other=these.slot[moment[start]] if len(these.frame) else slot,
    )


def _runs(begins: Bools) -> tuple[Ints, Ints]:
    """Return the first and the end (exclusive) of each run; ``begins`` (n,) says with which elements one begins."""
    start = np.flatnonzero(begins)
    return start, np.append(start[1:], len(begins))
