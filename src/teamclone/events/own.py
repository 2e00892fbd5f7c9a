"""Events by definitions of our own: shots, clearances, lost passes and dribbles, through and self passes, tackles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.events.definitions import (
    CLEARANCE_M,
    CONTROL_M,
    SELF_PASS_M,
    SHOT_MARGIN_M,
    SHOT_RANGE_M,
    SHOT_SPEED,
    EventKind,
    Outcome,
)
from teamclone.events.found import Found, Words, words
from teamclone.events.touches import NOBODY, OUT_OF_PLAY, Bools, Ints, Play, TouchKind, rises, side_of
from teamclone.rcss import pitch, state_bits
from teamclone.rcss.players import TEAM_SLOTS
from teamclone.rcss.playmodes import RESTARTS, SITUATION, PlayMode, Situation

OFFSIDES = (PlayMode.OFFSIDE_L, PlayMode.OFFSIDE_R)
LOSSES = (Outcome.INTERCEPTED, Outcome.CAUGHT, Outcome.OUT, Outcome.OFFSIDE)
"""What becomes of a touch whose ball the team loses."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Endings:
    """What became of the touches of one player alone, and by whom.

    Attributes:
        moment: (n,) indices of the moments. slot, side: (n,) their player and its team.
        frame, end_frame: (n,) when. outcome: (n,) COMPLETED where the team has the next touch, NONE where both teams
            touch the ball together, GOAL of either team, INTERCEPTED, CAUGHT, OUT, OFFSIDE, STOPPED or END.
        other: (n,) the player that has the next touch; NOBODY of a stop or several. other_side: (n,) its team.
    """

    moment: Ints
    slot: Ints
    side: NDArray[np.int8]
    frame: Ints
    end_frame: Ints
    outcome: Words
    other: Ints
    other_side: NDArray[np.int8]

    def as_found(self, kind: EventKind, these: Bools, outcome: Words | None = None) -> Found:
        """Return some of them as events, with these outcomes (of those alone) or their own."""
        return Found.of(
            kind,
            self.frame[these],
            outcome=self.outcome[these] if outcome is None else outcome,
            end_frame=self.end_frame[these],
            slot=self.slot[these],
            other=self.other[these],
            other_side=self.other_side[these],
            touched=True,
        )


def endings(play: Play) -> Endings:
    """Return what became of every touch of one player alone."""
    these, mode = play.moments, play.frames["playmode"]
    moment = np.flatnonzero(these.single)
    n_frames, last = len(mode), len(these.frame) - 1
    slot, stop = these.slot[moment], these.stop[moment]
    side = side_of(slot)
    stopped = these.stopped[moment] & (stop < n_frames)
    over = ~stopped & (moment == last)
    following = np.minimum(moment + 1, last)
    touched = ~stopped & ~over
    caught = touched & (these.count[following] == 0)
    other = np.where(caught, these.catcher[following], these.slot[following])
    other = np.where(touched, other, NOBODY)
    into = np.where(touched, np.where(caught, side_of(other), these.side[following]), 0)
    what = mode[np.minimum(stop, n_frames - 1)]
    offside = stopped & np.isin(what, OFFSIDES) & (RESTARTS[what] == -side)
    outcome = words(
        (over, Outcome.END),
        (offside, Outcome.OFFSIDE),
        (stopped & np.isin(SITUATION[what], OUT_OF_PLAY), Outcome.OUT),
        (stopped & (SITUATION[what] == Situation.GOAL), Outcome.GOAL),
        (stopped, Outcome.STOPPED),
        (into == side, Outcome.COMPLETED),
        (caught & (into == -side), Outcome.CAUGHT),
        (into == -side, Outcome.INTERCEPTED),
    )
    end = np.where(stopped, stop, np.where(over, n_frames - 1, these.frame[following]))
    return Endings(
        moment=moment,
        slot=slot,
        side=side,
        frame=these.frame[moment],
        end_frame=end,
        outcome=outcome,
        other=other,
        other_side=into.astype(np.int8),
    )


def touches_of_one(play: Play, scored: Found) -> Iterator[Found]:
    """Yield shots, clearances, and passes and dribbles that were lost.

    Args:
        play: the match. scored: the touches that scored, which are shots already.
    """
    ends = endings(play)
    shot, aimed = _shots(play, ends, scored)
    saver = np.where(ends.other == NOBODY, 0, ends.other)
    goalie = (play.players["state"][ends.end_frame, saver] & state_bits.GOALIE) != 0
    saved = (ends.other != NOBODY) & goalie & (ends.other_side == -ends.side)
    reached = np.isin(ends.outcome, (Outcome.COMPLETED, Outcome.INTERCEPTED, Outcome.CAUGHT, Outcome.NONE))
    results = words(
        (~aimed | (ends.outcome == Outcome.OUT), Outcome.WIDE),
        (saved, Outcome.SAVED),
        (reached, Outcome.BLOCKED),
        default=Outcome.STOPPED,
    )
    yield ends.as_found(EventKind.SHOT, shot, results[shot])

    step, ball = play.step[ends.frame], play.ball
    lost = np.isin(ends.outcome, LOSSES) & ~shot & ~np.isin(ends.frame, scored.frame)
    cleared = (
        lost
        & (ends.outcome != Outcome.OFFSIDE)
        & (ball[ends.frame, 0] * ends.side < -pitch.LENGTH / 6)
        & (np.hypot(*step.T) >= SHOT_SPEED * play.speed_max)
        & (step[:, 0] * ends.side >= 0)
        & (_apart(ball[ends.frame], ball[ends.end_frame]) >= CLEARANCE_M)
    )
    yield ends.as_found(EventKind.CLEARANCE, cleared)
    place = np.stack([play.players[name][ends.end_frame, ends.slot] for name in "xy"], -1).astype(np.float64)
    away = _apart(place, ball[ends.end_frame]) > CONTROL_M
    yield ends.as_found(EventKind.PASS, lost & ~cleared & away)
    taken = lost & ~cleared & ~away & np.isin(ends.outcome, (Outcome.INTERCEPTED, Outcome.CAUGHT))
    yield ends.as_found(EventKind.DRIBBLE, taken, np.full(int(taken.sum()), str(Outcome.LOST)))


def _shots(play: Play, ends: Endings, scored: Found) -> tuple[Bools, Bools]:
    """Return (n,) which touches are shots that did not score, and which of them would pass between the posts."""
    after = play.ball[ends.frame + 1]
    # What the ball covered in the cycle of the touch is its velocity before decay.
    vx, vy = play.step[ends.frame].T
    to_line = ends.side * pitch.HALF_LENGTH - after[:, 0]
    mouth = pitch.GOAL_WIDTH / 2
    forward = (vx * ends.side > 0) & (to_line * ends.side > 0)
    cycles = np.where(forward, to_line / np.where(forward, vx, 1), np.inf)
    passes = np.abs(after[:, 1] + np.where(forward, cycles, 0) * vy)
    again = (ends.outcome == Outcome.COMPLETED) & (ends.other == ends.slot)
    shot = (
        forward
        & ~again
        & ~np.isin(ends.frame, scored.frame)
        & (np.hypot(vx, vy) >= SHOT_SPEED * play.speed_max)
        # As far as `formulas.roll` takes it in the end, multiplied by what is 0 of a ball that never slows down.
        & (np.where(forward, cycles, 0) * (1 - play.decay) <= play.decay)
        & (passes <= mouth + SHOT_MARGIN_M)
        & (np.hypot(to_line, after[:, 1]) <= SHOT_RANGE_M)
    )
    return shot, passes <= mouth


def through_passes(play: Play, passes: Found) -> Found:
    """Return those passes in play that went behind the second last opponent."""
    x = play.players["x"].astype(np.float64)
    there = (play.players["state"] & state_bits.STAND) != 0
    line = np.zeros(len(passes.frame))
    for side, opponents in ((1, TEAM_SLOTS[1]), (-1, TEAM_SLOTS[0])):
        these = np.flatnonzero(passes.side == side)
        frame = passes.frame[these]
        ahead = np.where(there[frame, opponents], x[frame, opponents] * side, -np.inf)
        # In the own half nobody is offside, so nothing is behind them there.
        line[these] = np.maximum(np.sort(ahead, axis=1)[:, -2], 0.0)
    start, end = (play.ball[frame, 0] * passes.side for frame in (passes.frame, passes.end_frame))
    behind = (start < line) & (end > line) & (passes.outcome != Outcome.RESTART)
    return passes.where(behind, EventKind.THROUGH_PASS)


def self_passes(play: Play, dribbles: Found) -> Found:
    """Return the long ones of dribbles."""
    far = _apart(play.ball[dribbles.frame], play.ball[dribbles.end_frame]) >= SELF_PASS_M
    return dribbles.where(far & np.isin(dribbles.outcome, (Outcome.COMPLETED, Outcome.FAILED)), EventKind.SELF_PASS)


def duels(play: Play) -> Iterator[Found]:
    """Yield kicks, catches and tackles."""
    found, these, mode = play.touches, play.moments, play.frames["playmode"]
    kicks = found.kind == TouchKind.KICK
    yield Found.of(EventKind.KICK, found.frame[kicks], slot=found.slot[kicks], touched=True)

    catches = found.kind == TouchKind.CATCH
    frame = found.frame[catches]
    before = np.searchsorted(these.frame, frame) - 1
    fresh = before >= 0
    fresh[fresh] = ~these.stopped[before[fresh]]
    other = np.full(len(frame), NOBODY)
    other[fresh] = these.slot[before[fresh]]
    yield Found.of(EventKind.CATCH, frame, slot=found.slot[catches], other=other)

    tackles = found.kind == TouchKind.TACKLE
    slot, frame = found.slot[tackles], found.frame[tackles]
    moment = np.searchsorted(these.frame, frame)
    last = len(these.frame) - 1
    following, stop = np.minimum(moment + 1, last), these.stop[moment]
    stopped = these.stopped[moment] & (stop < len(mode))
    what = mode[np.minimum(stop, len(mode) - 1)]
    # Goals are named after their team, whose opponents restart.
    gets = np.where(SITUATION[what] == Situation.GOAL, -RESTARTS[what], RESTARTS[what])
    next_side = np.where(these.count[following] > 0, these.side[following], side_of(these.catcher[following]))
    whose = np.where(stopped, gets, np.where(moment == last, 0, next_side))
    other = np.where(stopped | (moment == last), NOBODY, these.slot[following])
    end = np.where(stopped, stop, np.where(moment == last, len(mode) - 1, these.frame[following]))
    yield Found.of(
        EventKind.TACKLE,
        frame,
        outcome=words((whose == side_of(slot), Outcome.WON), default=Outcome.LOST),
        end_frame=end,
        slot=slot,
        other=other,
        touched=True,
    )
    missed, who = np.nonzero(rises((play.players["state"] & state_bits.TACKLE_FAULT) != 0))
    yield Found.of(EventKind.TACKLE, missed, outcome=Outcome.MISSED, slot=who)


def _apart(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distances of points (n, 2), m."""
    distance: NDArray[np.float64] = np.hypot(*(second - first).T)
    return distance
