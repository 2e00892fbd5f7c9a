"""A made match for events: everybody on the field, the ball at rest in the middle, until a test says otherwise."""

from __future__ import annotations

import numpy as np

from teamclone.events.find import find_events
from teamclone.logs.columns import FRAMES, PLAYERS
from teamclone.logs.match import Columns, empty_columns
from teamclone.rcss import state_bits
from teamclone.rcss.playmodes import PlayMode

LEFT_1, LEFT_2, LEFT_7, LEFT_9 = 0, 1, 6, 8
RIGHT_1, RIGHT_2, RIGHT_4, RIGHT_9 = 11, 12, 14, 19
PARAMS = {"ball_decay": 0.94, "ball_speed_max": 3.0}

Row = tuple[str, str, int, int, int, int, int, int]
"""Kind, outcome, frame, end frame, side, number, side and number of the other."""


class MadeMatch:
    """Frames from cycle 100 on, in play_on; players 1 keep the goals, all stand where the ball does not come."""

    def __init__(self, frames: int = 20) -> None:
        self.frames, self.players = empty_columns(FRAMES, frames), empty_columns(PLAYERS, frames, 22)
        self.frames["cycle"][:] = np.arange(100, 100 + frames)
        self.frames["playmode"][:] = PlayMode.PLAY_ON
        self.frames["ball_x"][:] = self.frames["ball_y"][:] = 0
        self.players["state"][:] = state_bits.STAND
        self.players["state"][:, [0, 11]] |= state_bits.GOALIE
        self.players["x"][:] = np.where(np.arange(22) < 11, -50.0, 50.0)
        self.players["y"][:] = 30.0
        self.players["count_dash"][:] = 0

    def kick(self, frame: int, slot: int) -> None:
        """A kick on a frame: its bit is in the next."""
        self.players["state"][frame + 1, slot] |= state_bits.KICK

    def tackle(self, frame: int, slot: int, *, missed: bool = False) -> None:
        """A tackle on a frame, after which the player lies for ten."""
        bit = state_bits.TACKLE_FAULT if missed else state_bits.TACKLE
        self.players["state"][frame + 1 : frame + 11, slot] |= bit

    def catch(self, frame: int, slot: int) -> None:
        """A catch on a frame."""
        self.players["state"][frame + 1, slot] |= state_bits.CATCH

    def dash(self, frame: int, slot: int) -> None:
        """A dash on a frame."""
        self.players["count_dash"][frame + 1 :, slot] += 1

    def mode(self, frame: int, mode: PlayMode, end: int | None = None) -> None:
        """A play mode from a frame on, up to another or to the end."""
        self.frames["playmode"][frame:end] = mode

    def ball(self, frame: int, x: float, y: float) -> None:
        """The ball is there from a frame on."""
        self.frames["ball_x"][frame:], self.frames["ball_y"][frame:] = x, y

    def stand(self, slot: int, x: float, y: float, frame: int = 0) -> None:
        """A player stands there from a frame on."""
        self.players["x"][frame:, slot], self.players["y"][frame:, slot] = x, y

    def turn(self) -> None:
        """Both teams change ends and places."""
        for columns, names in ((self.frames, ("ball_x", "ball_y")), (self.players, ("x", "y"))):
            for name in names:
                columns[name] *= -1
        for name, values in self.players.items():
            self.players[name] = np.roll(values, len(values[0]) // 2, axis=1)

    def events(self) -> Columns:
        """All events."""
        return find_events(self.frames, self.players, PARAMS)

    def rows(self, *kinds: str) -> list[Row]:
        """Events of these kinds."""
        return [row for row in rows(self.events()) if row[0] in kinds]


def rows(events: Columns) -> list[Row]:
    """Events as tuples, in their order."""
    names = ("kind", "outcome", "frame", "end_frame", "side", "unum", "other_side", "other_unum")
    return list(zip(*(events[name].tolist() for name in names), strict=True))
