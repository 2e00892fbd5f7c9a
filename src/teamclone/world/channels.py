"""The channels of a `World`: a player's values in a cycle, each with its unit, and the bits of ``flags``."""

from __future__ import annotations

from dataclasses import dataclass

from teamclone.rcss.player_types import FIELDS


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One channel of ``World.players``."""

    name: str
    unit: str
    about: str


POSITION = (
    Channel(name="x", unit="m", about="position towards the opponent's goal"),
    Channel(name="y", unit="m", about="position to the team's right"),
)
MEASURED = (
    Channel(name="vx", unit="m/cycle", about="velocity after decay"),
    Channel(name="vy", unit="m/cycle", about="velocity after decay"),
    Channel(name="body", unit="deg", about="body direction, 0 = towards the opponent's goal"),
    Channel(name="neck", unit="deg", about="neck direction relative to the body"),
    Channel(name="view_width", unit="deg", about="opening of the view cone"),
    Channel(name="stamina", unit="stamina", about="stamina"),
    Channel(name="effort", unit="", about="dash efficiency"),
    Channel(name="recovery", unit="", about="stamina recovery rate"),
    Channel(name="capacity", unit="stamina", about="stamina left to recover"),
)
"""Measured channels of a player beside the position; NaN where the log lacks them."""
CATEGORICAL = (
    Channel(name="type", unit="", about="heterogeneous player type"),
    Channel(name="flags", unit="", about="bit mask of FLAG_*"),
    Channel(
        name="last_command",
        unit="",
        about="command kind id that the server executed between the previous frame and this one; 0 none",
    ),
    Channel(
        name="age",
        unit="cycle",
        about="where the frame is what one player believes: cycles since that player saw this one, and at its own "
        "place since it saw the ball; 0 where the frame is as the log has it",
    ),
)
"""Counts and codes of a player; NaN where the log lacks them."""

FLAG_ON_FIELD = 1
FLAG_GOALIE = 2
FLAG_TACKLING = 4
"""Frozen after a tackle."""
FLAG_CHARGED = 8
"""Frozen after being fouled."""
FLAG_COLLIDED = 16
"""Touched the ball, a player or a post in the last cycle."""
FLAG_YELLOW = 32

PLAYER_CHANNELS = tuple(channel.name for channel in (*POSITION, *MEASURED, *CATEGORICAL))
"""The last axis of ``World.players``: position, then MEASURED, then CATEGORICAL."""
CHANNEL = {name: index for index, name in enumerate(PLAYER_CHANNELS)}
"""Index of a channel in ``World.players``."""
TYPE_FIELD = {name: index for index, name in enumerate(FIELDS)}
"""Index of a parameter in ``World.types``."""
