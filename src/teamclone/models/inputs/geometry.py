"""Plain quantities beside the inputs of a network, for layers that turn places and motions into commands.

Features end in these columns as they are, neither normalised nor limited. Layers read them by name, see `Inputs`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from teamclone.planner.plan import WAYS
from teamclone.rcss.players import N_TEAM

MATES = N_TEAM - 1
"""Team mates of the actor."""

GEOMETRY = (
    "x", "y", "coast_x", "coast_y", "cos", "sin", "forward", "aside", "turn_factor", "decay", "dash_gain", "income",
    "line_x", "near_m", "ball_x", "ball_y", "ball_vx", "ball_vy", "kick_gain", "turn_to_ball", "turn_to_meet",
    "kick_area", "kick_margin", "ball_decay", "ball_speed_max",
    *(f"mate_{mate}_{axis}" for mate in range(MATES) for axis in "xy"),
)  # fmt: skip
"""Columns that turn a place on the pitch or a wanted motion into a command; metres, metres per cycle, radians:

x, y: the actor. coast_x, coast_y: where it comes to rest without a dash. cos, sin: of its body direction.
forward, aside: its velocity along and across the body. turn_factor: turn moment for one degree. decay: of its velocity.
dash_gain: speed that one unit of dash power gives. income: stamina that one cycle gives back.
line_x: the offside line, or where a team mate meets the ball if that is further. near_m: see NEAR_SHARE.
ball_x, ball_y, ball_vx, ball_vy: the ball. kick_gain: speed that one unit of kick power gives it.
turn_to_ball, turn_to_meet: angles to face the ball in the next cycle, and from the inertia point to where it is met.
kick_area: see `kickable_area`; kick_margin: the part of it beyond the edges of player and ball.
ball_decay, ball_speed_max: of the match's server.
mate_0_x, ...: the team mates, the nearest first; where one is missing, the actor.
"""
_PLACE = {name: index for index, name in enumerate(GEOMETRY)}

OTHERS = MATES + N_TEAM
"""The other players: the team mates, then the opponents, of each side the nearest first."""
OTHER = ("x", "y", "vx", "vy", "cos", "sin", "there", "keeper")
"""Columns of each: position, metres, velocity, metres per cycle, body direction, whether there is such a player,
whether it is the goalkeeper. All 0 where there is none.
"""


WAY = tuple(f"{name}_{what}" for name in WAYS for what in ("there", "vx", "vy"))
"""Of each way to kick that a plan knows: whether there is one, and the velocity of the ball, metres per cycle."""
TACKLE = ("tackle_there", "tackle_degrees")
"""Whether the actor can tackle the ball, and the planned direction, degrees from the body."""
SIDED = frozenset((*(f"{name}_vy" for name in WAYS), "tackle_degrees"))


def geometry_of(geometry: Tensor, *names: str) -> list[Tensor]:
    """Return columns of GEOMETRY, (batch, 1) each."""
    return [geometry[:, _PLACE[name], None] for name in names]


def mates_of(geometry: Tensor) -> Tensor:
    """Return (batch, MATES, 2) the positions of the team mates."""
    first = _PLACE["mate_0_x"]
    return geometry[:, first : first + 2 * MATES].reshape(-1, MATES, 2)


class Inputs(NamedTuple):
    """The parts of egocentric inputs.

    Attributes:
        columns: (batch, columns) of the blocks, normalised.
        geometry: (batch, len(GEOMETRY)).
        others: (batch, OTHERS, len(OTHER)).
        tackle: (batch, len(TACKLE)).
        ways: (batch, len(WAYS), 3): of each way whether there is one, and the velocity of the ball, metres per cycle.
            The last three are empty where the inputs leave them out.
    """

    columns: Tensor
    geometry: Tensor
    others: Tensor
    tackle: Tensor
    ways: Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class InputLayout:
    """The order of `Inputs` in the one tensor in which they are made, cached and mirrored.

    Attributes:
        columns: number of columns of the blocks. others, plan: whether these parts are there.
    """

    columns: int
    others: bool
    plan: bool

    @property
    def tail(self) -> tuple[str, ...]:
        """Names of what follows the columns of the blocks."""
        return (
            *GEOMETRY,
            *(f"other_{i}_{name}" for i in range(OTHERS * self.others) for name in OTHER),
            *((TACKLE + WAY) * self.plan),
        )

    def unpack(self, packed: Tensor) -> Inputs:
        """Return the parts of (batch, columns + len(tail)) inputs, as views."""
        widths = [
            *(self.columns, len(GEOMETRY), OTHERS * len(OTHER) * self.others),
            *(len(TACKLE) * self.plan, len(WAY) * self.plan),
        ]
        columns, geometry, others, tackle, ways = torch.split(packed, widths, 1)
        n = packed.shape[0]
        return Inputs(
            columns,
            geometry,
            others.reshape(n, OTHERS * self.others, len(OTHER)),
            tackle,
            ways.reshape(n, len(WAYS) * self.plan, 3),
        )
