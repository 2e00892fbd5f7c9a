"""What happened in a match, as moments that one may jump to: by play modes, state bits and touches of the ball alone.

A touch is a kick, a tackle or a catch that the server carried out. Its frame is the one on which it was decided, so the
ball has its effect in the next.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.logs.match import Columns
from teamclone.rcss import pitch, server_params, state_bits
from teamclone.rcss.players import SLOT_SIDES, SLOT_UNUMS
from teamclone.rcss.playmodes import RESTARTS, SITUATION, PlayMode, Situation

SHOT_SPEED = 0.6
"""A shot leaves the ball with at least this share of its highest speed: slower balls are led, not shot."""
SHOT_MARGIN_M = 1.0
"""How far beside a post a shot may pass."""
SHOT_RANGE_M = 35.0
"""From farther away it is a clearance that happens to point at the goal."""


class EventKind(StrEnum):
    """Kinds of events."""

    GOAL = "goal"
    SHOT = "shot"
    KICK = "kick"
    """A kick that moved the ball."""
    TURNOVER = "turnover"
    """The first touch by the other team, without a stop of play between."""
    TACKLE = "tackle"
    CATCH = "catch"
    SET_PLAY = "set play"
    FOUL = "foul"
    """A foul, an offside, or another fault by which the other team gets the ball."""
    CARD = "card"
    PLAYER = "player"
    """A player comes, goes, or changes its type."""
    PERIOD = "period"
    """The match begins, pauses or ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """A moment of a match.

    Attributes:
        frame: index of the frame. kind: what it is.
        side: of the team, 1 left, -1 right, 0 of none. unum: of the player, 0 where none or not known.
        text: what there is to say beside the kind, without the names of the teams; may be empty.
    """

    frame: int
    kind: EventKind
    side: int = 0
    unum: int = 0
    text: str


@dataclass(frozen=True, slots=True)
class Touch:
    """A touch of the ball: frame, place on the player axis, and whether by a kick, a tackle or a catch."""

    frame: int
    slot: int
    kind: EventKind

    @property
    def side(self) -> int:
        """Side of the player, 1 left or -1 right."""
        return int(SLOT_SIDES[self.slot])

    @property
    def unum(self) -> int:
        """Number of the player."""
        return int(SLOT_UNUMS[self.slot])


def find_events(frames: Columns, players: Columns, params: Mapping[str, float | str]) -> list[Event]:
    """Return the events of a match, in the order of their frames.

    Args:
        frames: ``columns.FRAMES``, (n_frames,). players: ``columns.PLAYERS``, (n_frames, 22).
        params: the server's parameters as the log lists them.
    """
    if not len(frames["cycle"]):
        return []
    found = touches(players["state"])
    events = [
        *_of_modes(frames, found),
        *_of_touches(found),
        *_shots(frames, found, params),
        *_turnovers(frames, found),
        *_failed_tackles(players["state"]),
        *_of_players(players),
    ]
    order = list(EventKind)
    return sorted(events, key=lambda event: (event.frame, order.index(event.kind)))


def touches(state: NDArray[np.uint32]) -> list[Touch]:
    """Return who touched the ball, in the order of frames; ``state`` is (n_frames, 22).

    A bit is set in the frame after its command. That of a tackle stays while the player lies.
    """
    done = []
    for kind, bits, success in (
        (EventKind.KICK, state_bits.KICKS, state_bits.KICK),
        (EventKind.CATCH, state_bits.CATCHES, state_bits.CATCH),
        (EventKind.TACKLE, state_bits.TACKLES, state_bits.TACKLE),
    ):
        frame, slot = np.nonzero(_rises((state & bits) == success, lasting=kind is not EventKind.KICK))
        done += [Touch(int(at), int(who), kind) for at, who in zip(frame, slot, strict=True)]
    return sorted(done, key=lambda touch: touch.frame)


def _rises(there: NDArray[np.bool_], *, lasting: bool = True) -> NDArray[np.bool_]:
    """Return (n_frames - 1, 22) where something is there in the next frame and, of what lasts, not yet in this one."""
    rises: NDArray[np.bool_] = there[1:] & ~there[:-1] if lasting else there[1:]
    return rises


def _of_touches(found: list[Touch]) -> Iterator[Event]:
    words = {EventKind.KICK: "", EventKind.CATCH: "", EventKind.TACKLE: "gets the ball"}
    for touch in found:
        yield Event(frame=touch.frame, kind=touch.kind, side=touch.side, unum=touch.unum, text=words[touch.kind])


def _failed_tackles(state: NDArray[np.uint32]) -> Iterator[Event]:
    for frame, slot in np.argwhere(_rises((state & state_bits.TACKLE_FAULT) != 0)):
        side, unum = int(SLOT_SIDES[slot]), int(SLOT_UNUMS[slot])
        yield Event(frame=int(frame), kind=EventKind.TACKLE, side=side, unum=unum, text="misses the ball")


def _turnovers(frames: Columns, found: list[Touch]) -> Iterator[Event]:
    """Yield where the ball changes the team; a frame in which both teams touch it belongs to neither."""
    sides: dict[int, set[int]] = {}
    for touch in found:
        sides.setdefault(touch.frame, set()).add(touch.side)
    clear = [touch for touch in found if len(sides[touch.frame]) == 1]
    changes = np.flatnonzero(np.diff(frames["playmode"].astype(np.int64)) != 0) + 1
    for before, after in pairwise(clear):
        if before.side == after.side or frames["playmode"][after.frame] != PlayMode.PLAY_ON:
            continue
        # A free ball is kicked before the mode becomes play_on, so a restart itself does not count as a stop.
        stops = changes[(changes > before.frame + 1) & (changes <= after.frame)]
        if not len(stops):
            text = f"wins the ball from {before.unum}"
            yield Event(frame=after.frame, kind=EventKind.TURNOVER, side=after.side, unum=after.unum, text=text)


def _shots(frames: Columns, found: list[Touch], params: Mapping[str, float | str]) -> Iterator[Event]:
    """Yield kicks and tackles after which the ball would roll over the goal line, in or close beside the goal."""
    decay = server_params.number(params, "ball_decay", version=server_params.OLDEST)
    fast = SHOT_SPEED * server_params.number(params, "ball_speed_max", version=server_params.OLDEST)
    mouth = pitch.GOAL_WIDTH / 2
    x, y = frames["ball_x"].astype(np.float64), frames["ball_y"].astype(np.float64)
    for touch in found:
        if touch.kind is EventKind.CATCH or touch.frame + 1 >= len(x):
            continue
        after = touch.frame + 1
        # What the ball covered in the cycle of the kick is its velocity before decay.
        vx, vy = x[after] - x[touch.frame], y[after] - y[touch.frame]
        to_line = touch.side * pitch.HALF_LENGTH - x[after]
        speed = float(np.hypot(vx, vy))
        if speed < fast or vx * touch.side <= 0 or to_line * touch.side <= 0:
            continue
        cycles = to_line / vx
        rolls = formulas.roll(np.inf, decay) * decay
        passes, away = abs(y[after] + cycles * vy), np.hypot(to_line, y[after])
        if cycles <= rolls and passes <= mouth + SHOT_MARGIN_M and away <= SHOT_RANGE_M:
            text = f"from {away:.0f} m, {'on target' if passes <= mouth else 'wide'}"
            yield Event(frame=touch.frame, kind=EventKind.SHOT, side=touch.side, unum=touch.unum, text=text)


_PERIODS = {
    PlayMode.BEFORE_KICK_OFF: "before kick-off",
    PlayMode.TIME_OVER: "time over",
    PlayMode.FIRST_HALF_OVER: "first half over",
    PlayMode.PAUSE: "pause",
    PlayMode.HUMAN_JUDGE: "the human referee stops the match",
}


def _of_modes(frames: Columns, found: list[Touch]) -> Iterator[Event]:
    """Yield what changes of the play mode say."""
    mode = frames["playmode"]
    changes = np.concatenate([[0], np.flatnonzero(mode[1:] != mode[:-1]) + 1])
    for frame in changes:
        now = int(mode[frame])
        if now >= len(PlayMode) or now in (PlayMode.NULL, PlayMode.PLAY_ON):
            continue
        what = PlayMode(now)
        name = what.name.removesuffix("_L").removesuffix("_R").lower().replace("_", " ")
        at = int(frame)
        if what in _PERIODS:
            yield Event(frame=at, kind=EventKind.PERIOD, text=_PERIODS[what])
        elif SITUATION[now] == Situation.GOAL:
            yield _goal(frames, at, int(-RESTARTS[now]), found)
        elif SITUATION[now] == Situation.FAULT:
            yield Event(frame=at, kind=EventKind.FOUL, side=int(-RESTARTS[now]), text=name.removeprefix("foul "))
        else:
            yield Event(frame=at, kind=EventKind.SET_PLAY, side=int(RESTARTS[now]), text=name)


def _goal(frames: Columns, frame: int, side: int, found: list[Touch]) -> Event:
    score = f"{int(frames['left_score'][frame])}:{int(frames['right_score'][frame])}"
    last = next((touch for touch in reversed(found) if touch.frame < frame), None)
    own = last is not None and last.side != side
    ours = next((touch for touch in reversed(found) if touch.frame < frame and touch.side == side), None)
    unum = ours.unum if ours is not None and not own else 0
    text = score + (f", last touched by {last.unum} of the other team" if own and last is not None else "")
    return Event(frame=frame, kind=EventKind.GOAL, side=side, unum=unum, text=text)


def _of_players(players: Columns) -> Iterator[Event]:
    """Yield cards, changes of type, and players that come or go during the match."""
    state, types = players["state"], players["type"]
    there = (state & state_bits.STAND) != 0
    changed = (types[1:] != types[:-1]) & there[1:] & there[:-1]
    for kind, text, rises in (
        (EventKind.CARD, "yellow", _rises((state & state_bits.YELLOW_CARD) != 0)),
        (EventKind.CARD, "red", _rises((state & state_bits.RED_CARD) != 0)),
        (EventKind.PLAYER, "leaves the field", _rises(~there)),
        (EventKind.PLAYER, "comes onto the field", _rises(there)),
        (EventKind.PLAYER, "changes to type {}", changed),
    ):
        for frame, slot in np.argwhere(rises):
            yield Event(
                frame=int(frame) + 1,
                kind=kind,
                side=int(SLOT_SIDES[slot]),
                unum=int(SLOT_UNUMS[slot]),
                text=text.format(int(types[frame + 1, slot])),
            )
