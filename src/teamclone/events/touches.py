"""Touches of the ball, and the course of play between them.

A touch is a kick, a tackle or a catch that the server carried out. Its frame is the one on which it was decided, so the
ball has its effect in the next.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from teamclone.logs.match import Columns
from teamclone.rcss import server_params, state_bits
from teamclone.rcss.players import N_PLAYERS, SLOT_SIDES, SLOT_UNUMS
from teamclone.rcss.playmodes import SITUATION, PlayMode, Situation

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

NOBODY = -1
"""In place of a place on the player axis."""
OUT_OF_PLAY = (Situation.KICK_IN, Situation.CORNER_KICK, Situation.GOAL_KICK)
"""What a play mode says where the ball left the field."""


class TouchKind(IntEnum):
    """How the ball was touched."""

    KICK = 0
    TACKLE = 1
    CATCH = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Touches:
    """Touches of the ball in the order of frames.

    Attributes:
        frame, slot: (n_touches,) when, and by whom as a place on the player axis. kind: (n_touches,) TouchKind.
    """

    frame: Ints
    slot: Ints
    kind: Ints


@dataclass(frozen=True, slots=True, kw_only=True)
class Moments:
    """The frames on which the ball is touched, each once. ``next`` of a moment is the one after it.

    Attributes:
        frame: (n_moments,) index of the frame.
        count: (n_moments,) kicks and tackles on it.
        slot: (n_moments,) the player of the only kick or tackle; NOBODY where there is none or several.
        only: (n_moments, 2) so too of the left and of the right team's kicks and tackles alone.
        side: (n_moments,) of the team whose kicks and tackles they are; 0 where there is none or both teams'.
        tackled: (n_moments,) the only kick or tackle is a tackle.
        catcher: (n_moments,) who caught the ball; NOBODY where nobody did.
        counts: (n_moments,) the ball is in play with it: the mode of the next frame is play_on or goal_kick, or a new
            one. Other touches change nothing and begin nothing.
        stop: (n_moments,) the first frame after it with which play stops; the number of frames where it never does.
        stopped: (n_moments,) play stops before the next moment.
    """

    frame: Ints
    count: Ints
    slot: Ints
    only: Ints
    side: Ints
    tackled: Bools
    catcher: Ints
    counts: Bools
    stop: Ints
    stopped: Bools

    @property
    def single(self) -> Bools:
        """(n_moments,) one player alone kicks or tackles, with the ball in play: what most events begin with."""
        found: Bools = (self.slot != NOBODY) & self.counts
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Play:
    """A match as what finds events needs it.

    Attributes:
        frames, players: the columns of the match. touches, moments: of the ball in it.
        ball: (n_frames, 2) its place, m. step: (n_frames, 2) its way to the next frame, m; 0 in the last.
        decay: of the ball. speed_max: of the ball, m/cycle.
    """

    frames: Columns
    players: Columns
    touches: Touches
    moments: Moments
    ball: NDArray[np.float64]
    step: NDArray[np.float64]
    decay: float
    speed_max: float

    @classmethod
    def of(cls, frames: Columns, players: Columns, params: Mapping[str, float | str]) -> Play:
        """Prepare a match that has frames; see `find.find_events` for the arguments."""
        ball = np.stack([frames["ball_x"], frames["ball_y"]], -1).astype(np.float64)
        found = touches(players["state"])
        return cls(
            frames=frames,
            players=players,
            touches=found,
            moments=moments(found, frames["playmode"]),
            ball=ball,
            step=np.diff(ball, axis=0, append=ball[-1:]),
            decay=server_params.number(params, "ball_decay", version=server_params.OLDEST),
            speed_max=server_params.number(params, "ball_speed_max", version=server_params.OLDEST),
        )


def rises(there: Bools, *, lasting: bool = True) -> Bools:
    """Return (n_frames - 1, 22) where something is there in the next frame and, of what lasts, not yet in this one."""
    found: Bools = there[1:]
    return found & ~there[:-1] if lasting else found


def touches(state: NDArray[np.uint32]) -> Touches:
    """Return who touched the ball; ``state`` is (n_frames, 22).

    A bit is set in the frame after its command. That of a tackle stays while the player lies.
    """
    parts = []
    for kind, bits, success in (
        (TouchKind.KICK, state_bits.KICKS, state_bits.KICK),
        (TouchKind.TACKLE, state_bits.TACKLES, state_bits.TACKLE),
        (TouchKind.CATCH, state_bits.CATCHES, state_bits.CATCH),
    ):
        frame, slot = np.nonzero(rises((state & bits) == success, lasting=kind is not TouchKind.KICK))
        parts.append(np.stack([frame, slot, np.full(len(frame), kind)]))
    joined = np.concatenate(parts, axis=1)
    frame, slot, how = joined[:, np.argsort(joined[0], kind="stable")]
    return Touches(frame=frame, slot=slot, kind=how)


def stops(mode: NDArray[np.uint8]) -> Ints:
    """Return the frames with which play stops: the play mode becomes another one that is not play_on."""
    return np.flatnonzero((mode[1:] != mode[:-1]) & (mode[1:] != PlayMode.PLAY_ON)) + 1


def moments(found: Touches, mode: NDArray[np.uint8]) -> Moments:
    """Return the frames on which the ball is touched; ``mode`` is (n_frames,)."""
    frame, of = np.unique(found.frame, return_inverse=True)
    caught = found.kind == TouchKind.CATCH

    def counted(which: Bools) -> Ints:
        return np.bincount(of[which], minlength=len(frame))

    def alone(which: Bools) -> Ints:
        slot = np.full(len(frame), NOBODY)
        slot[of[which]] = found.slot[which]
        return np.where(counted(which) == 1, slot, NOBODY)

    left, right = (~caught & (SLOT_SIDES[found.slot] == side) for side in (1, -1))
    after = mode[frame + 1]
    in_play = (after == PlayMode.PLAY_ON) | (SITUATION[after] == Situation.GOAL_KICK) | (after != mode[frame])
    ends = np.append(stops(mode), len(mode))
    stop = ends[np.searchsorted(ends, frame + 1)]
    following = np.append(frame[1:], len(mode) - 1)
    return Moments(
        frame=frame,
        count=counted(~caught),
        slot=alone(~caught),
        only=np.stack([alone(left), alone(right)], -1),
        side=(counted(left) > 0).astype(np.int64) - (counted(right) > 0),
        tackled=(counted(~caught) == 1) & (counted(found.kind == TouchKind.TACKLE) > 0),
        catcher=alone(caught),
        counts=in_play,
        stop=stop,
        stopped=stop <= following,
    )


def owners(play: Play) -> tuple[NDArray[np.int8], Ints]:
    """Return whose the ball is in each frame of play_on.

    Returns:
        The side (n_frames,), 0 where nobody has touched it since play began or it is not play_on; and the index of the
        moment that made it so (n_frames,).
    """
    these = play.moments
    mode = play.frames["playmode"]
    clear = np.flatnonzero((these.side != 0) & these.counts)
    frame = np.arange(len(mode))
    last = np.searchsorted(these.frame[clear], frame, side="right") - 1
    if not len(clear):
        return np.zeros(len(mode), np.int8), np.zeros(len(mode), np.int64)
    moment = clear[np.maximum(last, 0)]
    owned = (last >= 0) & (these.stop[moment] > frame) & (mode == PlayMode.PLAY_ON)
    return np.where(owned, these.side[moment], 0).astype(np.int8), moment


def side_of(slot: Ints) -> NDArray[np.int8]:
    """Return the sides of places on the player axis, 0 of NOBODY."""
    return np.where(slot == NOBODY, 0, SLOT_SIDES[slot % N_PLAYERS]).astype(np.int8)


def unum_of(slot: Ints) -> NDArray[np.uint8]:
    """Return the numbers of places on the player axis, 0 of NOBODY."""
    return np.where(slot == NOBODY, 0, SLOT_UNUMS[slot % N_PLAYERS]).astype(np.uint8)
