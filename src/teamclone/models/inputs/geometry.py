"""Plain quantities beside the inputs of a network, for layers that turn places and motions into commands.

Features end in these columns as they are, neither normalised nor limited. Layers read them by name.
"""

from __future__ import annotations

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


def others_of(geometry: Tensor) -> Tensor:
    """Return (batch, OTHERS, len(OTHER)) of features that have them."""
    return geometry[:, len(GEOMETRY) : len(GEOMETRY) + OTHERS * len(OTHER)].reshape(-1, OTHERS, len(OTHER))


def ways_of(geometry: Tensor) -> Tensor:
    """Return (batch, len(WAYS), 3) of features with the block ``plan``: is there one, and the ball's velocity."""
    return geometry[:, -len(WAY) :].reshape(-1, len(WAYS), 3)


def tackle_of(geometry: Tensor) -> Tensor:
    """Return (batch, 2) TACKLE of features with the block ``plan``."""
    return geometry[:, -len(WAY) - len(TACKLE) : -len(WAY)]
