"""``Bodies`` and ``Commands``: ball and players of many cycles at once, and what the players do in them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.rules import Rules
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS

BALL = N_PLAYERS
"""Place of the ball among the bodies, after the players."""
N_BODIES = N_PLAYERS + 1


@dataclass(frozen=True, slots=True, kw_only=True)
class _Batch:
    """Arrays of one length: the cycles of a batch."""

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))

    def select(self, cycles: NDArray[Any] | slice) -> Self:
        """Return some of the cycles: indices, a mask or a slice."""
        return replace(self, **{item.name: getattr(self, item.name)[cycles] for item in fields(self)})


@dataclass(frozen=True, slots=True, kw_only=True)
class Bodies(_Batch):
    """Ball and players of n cycles, independent of each other, as a log has them at the end of a cycle.

    Metres, metres per cycle and degrees. Players stand as in the tables of a match, left 1..11 then right 1..11; the
    ball comes after them. Values of players off the field mean nothing.

    Attributes:
        x, y, vx, vy: (n, 23) float64, velocities after decay.
        body, neck: (n, 22) float64.
        stamina, effort, recovery, capacity: (n, 22) float64.
        type: (n, 22) int64.
        on_field, goalie: (n, 22) bool.
        frozen: (n, 22) int64, cycles for which the player can give no body command, after a tackle or foul.
        banned: (n, 22) int64, cycles for which the goalkeeper can not catch.
        touched: (n, 23) bool, collided in the last cycle with a body or a post.
        mode: (n,) uint8, the PlayMode.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    vx: NDArray[np.float64]
    vy: NDArray[np.float64]
    body: NDArray[np.float64]
    neck: NDArray[np.float64]
    stamina: NDArray[np.float64]
    effort: NDArray[np.float64]
    recovery: NDArray[np.float64]
    capacity: NDArray[np.float64]
    type: NDArray[np.int64]
    on_field: NDArray[np.bool_]
    goalie: NDArray[np.bool_]
    frozen: NDArray[np.int64]
    banned: NDArray[np.int64]
    touched: NDArray[np.bool_]
    mode: NDArray[np.uint8]


@dataclass(frozen=True, slots=True, kw_only=True)
class Commands(_Batch):
    """What the players do in n cycles: those commands that the server executes.

    Attributes:
        kind: (n, 22) uint8, the CommandKind of the body command, 0 none. A dash is in ``legs`` alone.
        numbers: (n, 22, 2) float64, the command's numbers as sent: moment of a turn, power and direction of a kick,
            direction of a tackle or catch, place of a move (for the right team as sent, too); degrees and metres.
        legs: (n, 22, 2, 2) float64, power and direction of the left and of the right leg, NaN where none dashes.
            A plain dash is both legs alike. Since version 19 legs dash beside a kick, and while frozen.
        foul: (n, 22) bool, the tackle means a foul.
        turn_neck: (n, 22) float64 degrees, 0 none.
    """

    kind: NDArray[np.uint8]
    numbers: NDArray[np.float64]
    legs: NDArray[np.float64]
    foul: NDArray[np.bool_]
    turn_neck: NDArray[np.float64]

    @classmethod
    def of(cls, kind: NDArray[Any], numbers: NDArray[Any], *, turn_neck: NDArray[Any] | None = None) -> Commands:
        """Return commands with plain dashes.

        Args:
            kind: (n, 22) CommandKind ids, 0 none. numbers: (n, 22, 2) in the order of the command's syntax.
            turn_neck: (n, 22) degrees; None for none.
        """
        dash = kind == CommandKind.DASH
        return cls(
            kind=kind.astype(np.uint8),
            numbers=np.asarray(numbers, np.float64),
            legs=np.repeat(np.where(dash[..., None], numbers, np.nan)[..., None, :], 2, axis=-2).astype(np.float64),
            foul=np.zeros(kind.shape, np.bool_),
            turn_neck=np.zeros(kind.shape) if turn_neck is None else np.asarray(turn_neck, np.float64),
        )


def of_types(bodies: Bodies, rules: Rules, name: str) -> NDArray[np.float64]:
    """Return (n, 22) a parameter of each player's type.

    Raises:
        IndexError: a player has a type that the rules do not list.
    """
    values: NDArray[np.float64] = rules.types[name][bodies.type]
    return values


def decays(bodies: Bodies, rules: Rules) -> NDArray[np.float64]:
    """Return (n, 23) the share of its velocity that each body keeps at the end of a cycle."""
    decay = np.full(bodies.x.shape, rules.server["ball_decay"])
    decay[:, :BALL] = of_types(bodies, rules, "player_decay")
    return decay


def radii(bodies: Bodies, rules: Rules) -> NDArray[np.float64]:
    """Return (n, 23) radii of bodies in metres; -inf of players off the field, who meet nobody."""
    radius = np.full(bodies.x.shape, rules.server["ball_size"])
    radius[:, :BALL] = np.where(bodies.on_field, of_types(bodies, rules, "player_size"), -np.inf)
    return radius
