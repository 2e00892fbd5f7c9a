"""Self-attention over the other players, as seen by the actor with the ball, in no order.

A team mate is a place to pass to, an opponent may cut the pass off; their order has no meaning. So all share the same
weights, with the goal as one more place to kick to, and attend to each other (Vaswani et al. 2017, "Attention is all
you need"; one layer, normalised before as in Xiong et al. 2020).
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from teamclone.dynamics.formulas import cycles_over
from teamclone.engine.inputs.layout import MATES, OTHER, OTHERS
from teamclone.engine.network.constants import (
    ATTENTION_HEADS,
    NEVER_CYCLES,
    PASS_SPEED,
    PLAYER_COLUMNS,
    RUN_SPEED,
)
from teamclone.models.inputs.geometry import Inputs, geometry_of
from teamclone.rcss import pitch

_THERE = OTHER.index("there")


class PlayerEncoder(nn.Module):
    """Self-attention over the 21 other players and the goal.

    Args:
        width: of the embedding of each; a multiple of ATTENTION_HEADS.
        seen: width of the features of the whole situation.
    """

    goal: Tensor

    def __init__(self, width: int, seen: int) -> None:
        super().__init__()
        self.other = nn.Sequential(nn.Linear(PLAYER_COLUMNS, width), nn.ReLU(), nn.Linear(width, width))
        self.situation = nn.Linear(seen, width)
        self.before, self.between, self.after = (nn.LayerNorm(width) for _ in range(3))
        self.ask = nn.Linear(width, 3 * width)
        self.heard = nn.Linear(width, width)
        self.think = nn.Sequential(nn.Linear(width, 2 * width), nn.ReLU(), nn.Linear(2 * width, width))
        self.register_buffer("goal", torch.tensor([pitch.HALF_LENGTH, 0.0]), persistent=False)

    def forward(self, situation: Tensor, inputs: Inputs) -> tuple[Tensor, Tensor]:
        """Return the mean embedding, and the embedding of each pass target.

        Args:
            situation: (batch, seen). inputs: with others.

        Returns:
            (batch, width) and (batch, TARGETS, width).
        """
        with torch.autocast(situation.device.type, enabled=False):
            columns = self.columns(inputs)
        each = self.other(columns) + self.situation(situation)[:, None]
        n, count, width = each.shape
        asked = self.ask(self.before(each)).view(n, count, 3, ATTENTION_HEADS, width // ATTENTION_HEADS)
        query, key, value = asked.permute(2, 0, 3, 1, 4)
        # By hand: on a processor PyTorch's own attention takes ten times as long for so few.
        weight = torch.softmax(query @ key.transpose(2, 3) * query.shape[3] ** -0.5, 3)
        heard = weight.to(value.dtype) @ value
        each = each + self.heard(heard.transpose(1, 2).reshape(n, count, width))
        each = self.after(each + self.think(self.between(each)))
        return each.mean(1), torch.cat([each[:, :MATES], each[:, OTHERS:]], 1)

    def columns(self, inputs: Inputs) -> Tensor:
        """Return (batch, OTHERS + 1, PLAYER_COLUMNS): the others, then the goal, as seen from the ball."""
        others, geometry = inputs.others, inputs.geometry
        ball = torch.cat(geometry_of(geometry, "ball_x", "ball_y"), 1)
        decay = geometry_of(geometry, "ball_decay")[0][..., None]
        goal = torch.zeros_like(others[:, :1])
        goal[..., :2], goal[..., _THERE] = self.goal, 1.0
        every = torch.cat([others, goal], 1)
        there = every[..., _THERE, None]
        way = (every[..., :2] - ball[:, None]) * there
        distance = torch.sqrt(way.square().sum(-1, keepdim=True) + 0.01)
        kind = torch.zeros(OTHERS + 1, 2, device=geometry.device)
        kind[MATES:OTHERS, 0] = kind[OTHERS:, 1] = 1.0
        return torch.cat(
            [
                way / 20,
                torch.log(distance),
                way / distance,
                every[..., 2:],
                kind.expand(every.shape[0], -1, -1),
                _lane(way, distance[..., 0], others[:, MATES:], ball, decay),
            ],
            -1,
        )


def _lane(way: Tensor, distance: Tensor, opponents: Tensor, ball: Tensor, decay: Tensor) -> Tensor:
    """Return (batch, places, 4) how free a straight kick to each place is.

    Radians between it and the nearest opponent before the place; cycles that the ball is there before the first of
    them, if all run at RUN_SPEED to where it passes them, in tens; metres from the place to the nearest opponent, in
    tens; metres to the place, in twenties.

    Args:
        way: (batch, places, 2) from the ball. distance: its length. opponents: (batch, 11, len(OTHER)).
        decay: (batch, 1, 1) of the ball.
    """
    forward = (way / distance[..., None])[:, :, None]
    from_ball = (opponents[..., :2] - ball[:, None])[:, None]
    there = opponents[:, None, :, _THERE] > 0
    along = (forward * from_ball).sum(-1)
    across = (forward[..., 0] * from_ball[..., 1] - forward[..., 1] * from_ball[..., 0]).abs()
    before = there & (along > 0) & (along < distance[..., None] + 1)
    angle = torch.where(before, torch.atan2(across, along.clamp(min=0.1)), math.pi).amin(-1)
    rolled = cycles_over(along.clamp(min=0), PASS_SPEED, decay, least=0.02)
    run = (across - 1.0).clamp(min=0) / RUN_SPEED + 1
    ahead = torch.where(before, run - rolled, NEVER_CYCLES).amin(-1).clamp(-NEVER_CYCLES, NEVER_CYCLES)
    gap = (way[:, :, None] - from_ball).norm(dim=-1)
    nearest = torch.where(there, gap, NEVER_CYCLES).amin(-1).clamp(max=NEVER_CYCLES)
    return torch.stack([angle, ahead / 10, nearest / 10, distance / 20], -1)
