"""Plans with the ball as an operation of PyTorch, so that an exported model can contain them."""

from __future__ import annotations

import torch
from torch import Tensor

from teamclone.models.inputs.reach import kickable_area
from teamclone.planner.plan import PLAN, plan
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.world.channels import CHANNEL
from teamclone.world.state import State

SLACK_M = 0.01
"""Metres by which a ball may be farther away than any tackle or kick reaches and is looked at still."""


def _near(ball: Tensor, players: Tensor, types: Tensor, server: Tensor, actor: Tensor) -> Tensor:
    """Return the indices of the actors that may reach the ball with a kick or a tackle."""
    each = torch.arange(len(actor), device=ball.device)
    place = players[each, actor][:, [CHANNEL["x"], CHANNEL["y"]]]
    dist, width = (server[:, SERVER_FIELD[name]] for name in ("tackle_dist", "tackle_width"))
    reach = torch.maximum(torch.hypot(dist, width), kickable_area(types, server)[each, actor])
    return torch.nonzero((ball[:, :2] - place).norm(dim=1) < reach + SLACK_M).squeeze(1)


@torch.library.custom_op("teamclone::plan", mutates_args=())
def _plans(ball: Tensor, players: Tensor, types: Tensor, server: Tensor, actor: Tensor) -> Tensor:
    """Plan for each sample; see `planner.plan.plan`."""
    parts = (ball, players, types, server, actor)
    near = _near(*parts)
    made = plan(*(part.index_select(0, near).cpu().numpy() for part in parts))
    return ball.new_zeros(len(actor), len(PLAN)).index_copy(0, near, torch.from_numpy(made).to(ball))


@_plans.register_fake
def _(ball: Tensor, players: Tensor, types: Tensor, server: Tensor, actor: Tensor) -> Tensor:
    return ball.new_empty(ball.shape[0], len(PLAN))


def plans(state: State) -> Tensor:
    """Return (batch, len(PLAN)) plans of the actors, on the device of the state and of its type."""
    each = state.each()
    made: Tensor = _plans(each.ball, each.players, each.types, each.server, each.actor)
    return made
