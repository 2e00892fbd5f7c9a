"""Kicks as the server carries them out: what benchmarks and tests compare plans with."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from teamclone.dynamics import formulas
from teamclone.engine.inputs.project import Frames
from teamclone.engine.inputs.project import plans as made_plans
from teamclone.planner.columns import CHOICES, KICK_OF, PLAN, WAYS
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.world.channels import CHANNEL, TYPE_FIELD
from teamclone.world.state import State

EXACT = 0.004
"""Metres per cycle by which the velocity of the ball after a kick may miss what was planned; logs have four digits."""
EXACT_DEG = 1.0
"""Degrees by which a tackle's direction may; HELIOS Base chooses among 40, nine degrees apart."""

Floats = NDArray[np.floating]


def plans(state: State) -> Tensor:
    """Return (batch, len(PLAN)) the plans of the actors."""
    *frames, frame, actor = (part.numpy() for part in state)
    return torch.from_numpy(made_plans(Frames(*frames), frame, actor)).to(torch.float32)


def kicked(state: State, arguments: Tensor) -> Tensor:
    """Return (batch, 2) the ball's velocity after the actors' kicks, metres per cycle, without the server's noise.

    Args:
        arguments: (batch, 2) power and degrees from the body.
    """
    ball, server = state.ball[state.frame], state.server[state.frame]
    me, types = state.players[state.frame, state.actor], state.types[state.frame, state.actor]
    body = formulas.radians(me[:, CHANNEL["body"]])
    away = ball[:, :2] - me[:, [CHANNEL["x"], CHANNEL["y"]]]
    rate = formulas.kick_rate(
        torch.hypot(away[:, 0], away[:, 1]),
        torch.atan2(away[:, 1], away[:, 0]) - body,
        ball_size=server[:, SERVER_FIELD["ball_size"]],
        **{name: types[:, TYPE_FIELD[name]] for name in ("kick_power_rate", "player_size", "kickable_margin")},
    )
    x, y = formulas.kicked(
        (ball[:, 2], ball[:, 3]),
        arguments[:, 0],
        formulas.radians(arguments[:, 1]) + body,
        rate,
        **{name: server[:, SERVER_FIELD[name]] for name in ("ball_accel_max", "ball_speed_max")},
    )
    return torch.stack([x, y], 1)


def as_planned(made: Floats, given: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.int64]]:
    """Compare kicks with plans.

    Args:
        made: (n, len(PLAN)) plans. given: (n, 2) the ball's velocity after the kick, metres per cycle.

    Returns:
        (n, len(WAYS)) whether a kick is as one of the planned ways; (n,) whether it is as the chosen one; (n,) index
        into CHOICES of what was chosen.
    """
    ways = made[:, PLAN.index("shot_vx") :].reshape(-1, len(WAYS), 2)
    there = made[:, PLAN.index("shot_there") :][:, : len(WAYS)] > 0
    exact = (np.hypot(*np.moveaxis(ways - given[:, None], 2, 0)) < EXACT) & there
    choice = made[:, 1 : 1 + len(CHOICES)].argmax(1)
    way = np.array([WAYS.index(KICK_OF[name]) if name in KICK_OF else 0 for name in CHOICES])[choice]
    kicks = np.array([name in KICK_OF for name in CHOICES])[choice]
    return exact, kicks & exact[np.arange(len(made)), way], choice


def tackles_as_planned(made: Floats, degrees: Floats) -> NDArray[np.bool_]:
    """Return (n,) whether tackles go where it is planned, to EXACT_DEG.

    Args:
        made: (n, len(PLAN)) plans. degrees: (n,) from the body.
    """
    there, planned = (made[:, PLAN.index(f"tackle_{name}")] for name in ("there", "degrees"))
    away = (degrees - planned + 180.0) % 360.0 - 180.0
    found: NDArray[np.bool_] = (np.abs(away) < EXACT_DEG) & (there > 0)
    return found
