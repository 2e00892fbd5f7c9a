"""Kicks as the server carries them out: what benchmarks and tests compare plans with."""

from __future__ import annotations

import torch
from torch import Tensor

from teamclone.dynamics import formulas
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.world.channels import CHANNEL, TYPE_FIELD
from teamclone.world.state import State


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
