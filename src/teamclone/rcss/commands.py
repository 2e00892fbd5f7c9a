"""Commands that clients send, and those that a clone predicts.

Ids are stable: they are written into stores and datasets.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cache

import numpy as np
from numpy.typing import NDArray

from teamclone.rcss import pitch


class CommandKind(IntEnum):
    """Every message a player, coach or trainer may send; ``.name.lower()`` is the word in the log."""

    ILLEGAL = 0
    """Text that the server's parser does not know."""
    DASH = 1
    TURN = 2
    KICK = 3
    TACKLE = 4
    CATCH = 5
    MOVE = 6
    TURN_NECK = 7
    CHANGE_VIEW = 8
    CHANGE_FOCUS = 9
    SAY = 10
    POINTTO = 11
    ATTENTIONTO = 12
    DONE = 13
    INIT = 14
    RECONNECT = 15
    BYE = 16
    SENSE_BODY = 17
    SCORE = 18
    EAR = 19
    CLANG = 20
    COMPRESSION = 21
    SYNCH_SEE = 22
    GAUSSIAN_SEE = 23
    LONG_KICK = 24
    EYE = 25
    CHANGE_PLAYER_TYPE = 26
    TEAM_GRAPHIC = 27
    TEAM_NAMES = 28
    START = 29
    CHANGE_MODE = 30
    RECOVER = 31
    CHECK_BALL = 32
    LOOK = 33


BODY_KINDS = (
    CommandKind.DASH,
    CommandKind.TURN,
    CommandKind.KICK,
    CommandKind.TACKLE,
    CommandKind.CATCH,
    CommandKind.MOVE,
)
"""Commands of which the server takes one per player and cycle, the first (rcssserver `player.cpp`)."""

CLONED_KINDS = (CommandKind.DASH, CommandKind.TURN, CommandKind.KICK, CommandKind.TACKLE)
"""The commands a model predicts by default, in the order of its output classes (Table II of the paper)."""

CLONED = tuple(kind.name.lower() for kind in CLONED_KINDS)
"""CLONED_KINDS as words."""

REPERTOIRE = (*CLONED, "catch", "move", "none")
"""All that a dataset may have and a model predict, in this order; ``none`` is a cycle without a body command.

Every dataset and every model has the first four, so that places of these and of their parameters are the same in all.
"""


def not_of_repertoire(commands: tuple[str, ...]) -> str | None:
    """Return an error text about commands that no dataset or model can have; None where they can be used."""
    further = REPERTOIRE[len(CLONED) :]
    if commands == (*CLONED, *(name for name in further if name in commands)):
        return None
    return f"{', '.join(CLONED)} and then, in this order, some of {', '.join(further)}; got {', '.join(commands)}"


def kind_places(commands: tuple[str, ...]) -> NDArray[np.int64]:
    """Return (256,) the place of each CommandKind among some of REPERTOIRE, that of ``none`` for 0; -1 for others."""
    place = np.full(256, -1, np.int64)
    for index, name in enumerate(commands):
        place[0 if name == "none" else CommandKind[name.upper()]] = index
    return place


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One parameter of a cloned command: its command, its place in the command, its unit and range."""

    name: str
    kind: CommandKind
    argument: int
    unit: str
    limit: float
    """The server clips to ±limit; dividing by it projects onto [-1, 1]."""
    angle: bool
    """True where ±limit are the same direction."""

    @property
    def sided(self) -> bool:
        """True if it changes its sign where left and right are exchanged."""
        return self.angle or self.name == "move_y"


PARAMETERS = (
    Parameter(name="dash_power", kind=CommandKind.DASH, argument=0, unit="power", limit=100.0, angle=False),
    Parameter(name="dash_direction", kind=CommandKind.DASH, argument=1, unit="deg", limit=180.0, angle=True),
    Parameter(name="turn_moment", kind=CommandKind.TURN, argument=0, unit="deg", limit=180.0, angle=True),
    Parameter(name="kick_power", kind=CommandKind.KICK, argument=0, unit="power", limit=100.0, angle=False),
    Parameter(name="kick_direction", kind=CommandKind.KICK, argument=1, unit="deg", limit=180.0, angle=True),
    Parameter(name="tackle_direction", kind=CommandKind.TACKLE, argument=0, unit="deg", limit=180.0, angle=True),
)
"""The regression outputs in the order of Table II of the paper."""

_FURTHER = (
    Parameter(name="catch_direction", kind=CommandKind.CATCH, argument=0, unit="deg", limit=180.0, angle=True),
    Parameter(name="move_x", kind=CommandKind.MOVE, argument=0, unit="m", limit=pitch.MAX_X, angle=False),
    Parameter(name="move_y", kind=CommandKind.MOVE, argument=1, unit="m", limit=pitch.MAX_Y, angle=False),
)


@cache
def parameters_of(commands: tuple[str, ...]) -> tuple[Parameter, ...]:
    """Return the parameters of some of REPERTOIRE, PARAMETERS first.

    Those of a move are a place in the frame of the mover's team. The server turns the place of a right team's move
    (rcssserver `player.cpp`), so it stays as it was sent.
    """
    return (*PARAMETERS, *(item for item in _FURTHER if item.kind.name.lower() in commands))
