"""The columns of the inputs: blocks, each of which can be left out, then plain quantities. Free of Numba.

The columns of the blocks are normalised by the network. What follows them stays as it is, for layers that turn places
and motions into commands.
"""

from __future__ import annotations

from teamclone.planner.columns import CHOICES, UNDERWAY, VALUED, WAYS
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.player_types import GROUPS
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.playmodes import Situation

BLOCKS = (
    "self", "role", "type", "last", "view", "ball", "reach", "lines", "plan", "mates", "opponents", "rivals", "past",
    "mode", "age",
)  # fmt: skip
"""Blocks that a network may have, in the order of their columns; ``core`` comes before them in all networks."""
MATES = N_TEAM - 1
"""Team mates of the actor."""
NEAREST_OPPONENTS = 6
RIVALS = 3
"""Opponents in the blocks ``opponents`` and ``rivals``."""
PAST_FRAMES = 3
AGED_MATES = 4
"""Team mates, the nearest, in the block ``age``; opponents are NEAREST_OPPONENTS."""
TYPE_PARAMETERS = tuple(name for group in GROUPS.values() for name in group)
"""Parameters of the actor's type in the block ``type``."""
SIDED_SITUATION = Situation.KICK_OFF
"""The first Situation that is one of the two teams', as all after it are."""
MODES = SIDED_SITUATION + 2 * (len(Situation) - SIDED_SITUATION)
"""Meanings of a play mode: a Situation without a side, or one and the side that restarts, own first."""
PLAYER = 11
"""Columns of one player in ``mates``, ``opponents`` and ``rivals``, see `blocks.player_columns`."""
COMMANDS = CommandKind.MOVE + 1
"""Last commands that are told apart: none, and the kinds up to MOVE."""

WIDTH = {
    "core": 23,
    "self": 14,
    "role": N_TEAM,
    "type": len(TYPE_PARAMETERS),
    "last": COMMANDS + 2,
    "view": 3,
    "ball": 19,
    "reach": 29,
    "lines": 7,
    "plan": 1 + len(CHOICES) + len(WAYS) + 2 * len(VALUED) + 2 + len(UNDERWAY) + len(UNDERWAY) // 2,
    "mates": PLAYER * MATES,
    "opponents": PLAYER * NEAREST_OPPONENTS,
    "rivals": PLAYER * RIVALS,
    "past": PAST_FRAMES * (11 + COMMANDS + 2 + 1),
    "mode": MODES + 3,
    "age": 1 + AGED_MATES + NEAREST_OPPONENTS + 2,
}
"""Columns of each block, in their order."""

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
line_x: the offside line, or where a team mate meets the ball if that is further. near_m: see `blocks.NEAR_SHARE`.
ball_x, ball_y, ball_vx, ball_vy: the ball. kick_gain: speed that one unit of kick power gives it.
turn_to_ball, turn_to_meet: angles to face the ball in the next cycle, and from the inertia point to where it is met.
kick_area: see `formulas.kickable_area`; kick_margin: the part of it beyond the edges of player and ball.
ball_decay, ball_speed_max: of the match's server.
mate_0_x, ...: the team mates, the nearest first; where one is missing, the actor.
"""

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
"""Those of WAY and TACKLE that change their sign where left and right are exchanged."""

PARTS = (*WIDTH, "geometry", "others", "ways")
"""All that kernels fill, in the order of their places."""


def places(blocks: tuple[str, ...], *, others: bool) -> tuple[tuple[int, ...], int]:
    """Return where each of PARTS begins, -1 where it is left out, and the number of all columns.

    Args:
        blocks: some of BLOCKS. others: have OTHER of all OTHERS.
    """
    width = {
        **{name: columns for name, columns in WIDTH.items() if name == "core" or name in blocks},
        "geometry": len(GEOMETRY),
        **({"others": OTHERS * len(OTHER)} if others else {}),
        **({"ways": len(TACKLE) + len(WAY)} if "plan" in blocks else {}),
    }
    begins, at = {}, 0
    for name, columns in width.items():
        begins[name] = at
        at += columns
    return tuple(begins.get(name, -1) for name in PARTS), at
