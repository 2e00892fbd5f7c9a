"""The frames of a match that is being played, as the columns that its log will have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teamclone.logs.assemble import MAX_SCORE
from teamclone.logs.columns import FRAMES, PLAYERS
from teamclone.logs.match import Columns, empty_columns
from teamclone.protocol.monitor import Show
from teamclone.protocol.monitor_stream import Frame
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.playmodes import CLOCK_STANDS, PlayMode

_ROOM = 1024
"""Frames for which there is room at first."""
_BALL = ("ball_x", "ball_y", "ball_vx", "ball_vy")


@dataclass(slots=True)
class Counts:
    """What became of the datagrams.

    Attributes:
        frames: those that a log has. waiting: those before a kick-off, which it has not.
        lost: cycles that never came. late: that came after a later one. doubled: that came twice.
    """

    frames: int = 0
    waiting: int = 0
    lost: int = 0
    late: int = 0
    doubled: int = 0


class Seen:
    """The frames so far.

    Attributes:
        counts: what became of the datagrams. mode_cycles: of the newest frame, see `view.mode_cycles`.
    """

    def __init__(self) -> None:
        self.counts = Counts()
        self.mode_cycles = 0
        self._frames = empty_columns(FRAMES, _ROOM)
        self._players = empty_columns(PLAYERS, _ROOM, N_PLAYERS)
        self._last: Frame | None = None

    def __len__(self) -> int:
        return self.counts.frames

    def add(self, frame: Frame) -> bool:
        """Take in a cycle; return whether the server's log has it, too, and it is therefore one of the frames.

        A log has no cycle before a kick-off, and one after the end. A cycle that comes late is of no use any more.
        Where the clock stands a server shows the same cycle again and again, also without a change: there alone a frame
        may equal the one before.
        """
        last, show = self._last, frame.show
        if last is not None:
            if show.cycle < last.show.cycle:
                self.counts.late += 1
                return False
            if frame.text == last.text and not CLOCK_STANDS[known_mode(show)]:
                self.counts.doubled += 1
                return False
            self.counts.lost += max(show.cycle - last.show.cycle - 1, 0)
        again = last is not None and last.show.over
        self._last = frame
        if show.playmode == PlayMode.BEFORE_KICK_OFF or again:
            self.counts.waiting += 1
            return False
        self._write(frame)
        return True

    def window(self, first: int, stop: int) -> tuple[Columns, Columns]:
        """Return `columns.FRAMES` and `columns.PLAYERS` of some frames, (n,) and (n, 22), without copying them."""
        part = slice(max(first, 0), stop)
        return (
            {name: column[part] for name, column in self._frames.items()},
            {name: column[part] for name, column in self._players.items()},
        )

    def cycle(self, index: int) -> tuple[int, int]:
        """Return cycle and stoppage of a frame."""
        return int(self._frames["cycle"][index]), int(self._frames["stoppage"][index])

    def _write(self, frame: Frame) -> None:
        index, show = self.counts.frames, frame.show
        if index == len(self._frames["cycle"]):
            self._frames = _joined(self._frames, empty_columns(FRAMES, index))
            self._players = _joined(self._players, empty_columns(PLAYERS, index, N_PLAYERS))
        before = (
            {name: int(self._frames[name][index - 1]) for name in ("cycle", "stoppage", "playmode")} if index else {}
        )
        same = bool(before) and before["cycle"] == show.cycle
        follows = bool(before) and show.cycle - before["cycle"] <= 1
        self.mode_cycles = self.mode_cycles + 1 if follows and before["playmode"] == known_mode(show) else 0
        values = {
            "cycle": show.cycle,
            "stoppage": before["stoppage"] + 1 if same else 0,
            "playmode": known_mode(show),
            "left_score": min(show.scores[0], MAX_SCORE),
            "right_score": min(show.scores[1], MAX_SCORE),
            **dict(zip(_BALL, show.ball, strict=True)),
        }
        for name, value in values.items():
            self._frames[name][index] = value
        for name, column in show.players.items():
            self._players[name][index] = column
        self.counts.frames += 1


def known_mode(show: Show) -> PlayMode:
    """Return the play mode; that of a newer server, which we do not know, is NULL as in logs."""
    return PlayMode(show.playmode) if show.playmode < len(PlayMode) else PlayMode.NULL


def _joined(columns: Columns, more: Columns) -> Columns:
    return {name: np.concatenate([column, more[name]]) for name, column in columns.items()}
