"""What the simulator's physics says of the next cycles: where the ball rolls, how soon each player can have it.

All of it is vectorised over a batch of situations and differentiable by none: these are inputs, not parts that learn.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor

from teamclone.models.inputs.paper import BALL_DECAY
from teamclone.world.channels import CHANNEL, FLAG_ON_FIELD, TYPE_FIELD

BALL_SIZE = 0.085
"""rcssserver `serverparam.cpp`: ball_size."""
STEPS = 40
"""Cycles that reaching the ball is looked at; whoever needs longer gets this and the rest of his way at full speed."""
NEVER = 100.0
"""Cycles to the ball of a player who is not on the field; nobody is given more."""
MATE_RESERVE_M = 0.2
"""By how much agents of the league see a team mate's reach of the ball short, so as not to wait for one another."""
TURN_MARGIN_DEG = 15.0
"""Who faces his goal better than this dashes without a turn."""
NEAR_M = 10.0
"""Nearer goals may lie behind a player, who then runs backwards instead of turning."""


class Reach(NamedTuple):
    """How soon players can have the ball.

    Attributes:
        steps: (batch, 22) cycles, 0 for who can kick it now, NEVER for who is not on the field.
        ball: (batch, STEPS + 1, 2) where the ball is after 0, 1, ... cycles if nobody touches it.
    """

    steps: Tensor
    ball: Tensor


def radians(degrees: Tensor) -> Tensor:
    return degrees * (math.pi / 180.0)


def kickable_area(types: Tensor) -> Tensor:
    """(...) metres between the centres of player and ball up to which he can kick it; ``types`` (..., fields)."""
    return types[..., TYPE_FIELD["player_size"]] + BALL_SIZE + types[..., TYPE_FIELD["kickable_margin"]]


def kick_rate(ball: Tensor, body: Tensor, types: Tensor) -> Tensor:
    """(...) metres per cycle that a unit of kick power gives the ball (rcssserver `player.cpp`, kick).

    Args:
        ball: (..., 2) from the player's centre to the ball's, global axes. body: (...) radians. types: (..., fields).
    """
    distance = torch.hypot(ball[..., 0], ball[..., 1])
    angle = torch.atan2(ball[..., 1], ball[..., 0]) - body
    away = torch.atan2(torch.sin(angle), torch.cos(angle)).abs() / math.pi
    gap = distance - types[..., TYPE_FIELD["player_size"]] - BALL_SIZE
    margin = types[..., TYPE_FIELD["kickable_margin"]]
    return types[..., TYPE_FIELD["kick_power_rate"]] * (1.0 - 0.25 * away - 0.25 * (gap / margin).clamp(-0.2, 1.0))


def kicked(ball: Tensor, player: Tensor, types: Tensor, arguments: Tensor) -> Tensor:
    """(batch, 2) velocity of the ball after a kick, metres per cycle on the pitch, without the noise of the server.

    Args:
        ball: (batch, 4). player: (batch, channels) who kicks. types: (batch, fields) his. arguments: (batch, 2) power
            and degrees from his body.
    """
    body = radians(player[:, CHANNEL["body"]])
    place = player[:, [CHANNEL["x"], CHANNEL["y"]]]
    direction = radians(arguments[:, 1]) + body
    added = kick_rate(ball[:, :2] - place, body, types) * arguments[:, 0]
    return ball[:, 2:] + added[:, None] * torch.stack([torch.cos(direction), torch.sin(direction)], 1)


def tackle_failure(forward: Tensor, aside: Tensor) -> Tensor:
    """Probability that a tackle fails, 1 and more where it cannot succeed (rcssserver `player.cpp`, tackle).

    Args:
        forward, aside: metres to the ball along the body direction and across it.
    """
    near = torch.where(forward > 0, (forward.abs() / 2.0).pow(6), torch.full_like(forward, 2.0))
    return near + (aside.abs() / 1.25).pow(6)


def reach_ball(ball: Tensor, players: Tensor, types: Tensor, *, held: Tensor, actor: Tensor) -> Reach:
    """When each player can have the ball, who turns towards it and dashes with full power.

    The simple model that agents of the league use of each other: coast, as many turns as the angle needs, then
    dashes. The actor may also dash sideways, which he knows to do when the ball is close.

    Args:
        ball: (batch, 4). players, types: as in `State`. actor: (batch,).
        held: (batch,) bool, the ball is under an opponent's control and is taken to stay.
    """
    count = torch.arange(STEPS + 1, dtype=ball.dtype, device=ball.device)
    rolled = (1.0 - BALL_DECAY**count) / (1.0 - BALL_DECAY)
    velocity = torch.where(held[:, None], 0.0, ball[:, 2:])
    path = ball[:, None, :2] + velocity[:, None] * rolled[:, None]

    position = players[..., [CHANNEL["x"], CHANNEL["y"]]]
    motion = players[..., [CHANNEL["vx"], CHANNEL["vy"]]]
    decay = types[..., TYPE_FIELD["player_decay"], None]
    area = kickable_area(types)
    mate = (torch.arange(22, device=ball.device) < 11) & (torch.arange(22, device=ball.device) != actor[:, None])
    area = (area - torch.where(mate, MATE_RESERVE_M, 0.0))[..., None]

    coasted = (1.0 - decay**count) / (1.0 - decay)
    away_x = path[:, None, :, 0] - position[..., 0, None] - motion[..., 0, None] * coasted
    away_y = path[:, None, :, 1] - position[..., 1, None] - motion[..., 1, None] * coasted
    distance = torch.sqrt(away_x.square() + away_y.square() + 1e-9)

    body = radians(players[..., CHANNEL["body"], None])
    cosine = (away_x * torch.cos(body) + away_y * torch.sin(body)) / distance
    angle = torch.acos(cosine.clamp(-1.0, 1.0))
    back = (distance < NEAR_M) & (angle > math.pi / 2)
    angle = torch.where(back, math.pi - angle, angle)
    margin = torch.asin((area / distance).clamp(max=1.0)).clamp(min=math.radians(TURN_MARGIN_DEG))
    speed = torch.hypot(motion[..., 0], motion[..., 1])[..., None]
    inertia = types[..., TYPE_FIELD["inertia_moment"], None]
    first_turn = math.pi / (1.0 + inertia * speed)
    two_turns = first_turn + math.pi / (1.0 + inertia * speed * decay)
    need = angle - margin
    turns = (need > 0).to(ball.dtype) + (need > first_turn) + (need > two_turns)

    power = 100.0 * types[..., TYPE_FIELD["dash_power_rate"], None]
    full = power * types[..., TYPE_FIELD["effort_max"], None]

    can = (distance <= area) | (covered((count - turns).clamp(min=0.0), full, decay) >= distance - area)
    steps = torch.where(can.any(-1), can.to(ball.dtype).argmax(-1).to(ball.dtype), STEPS)
    rest = (distance[..., -1] - area[..., 0] - covered(count[-1:], full, decay)[..., 0]).clamp(min=0.0)
    top_speed = (full / (1.0 - decay))[..., 0]
    steps = torch.where(can.any(-1), steps, STEPS + rest / top_speed)

    own = actor[:, None, None].expand(-1, 1, STEPS + 1)
    sideways = torch.acos(cosine.gather(1, own)[:, 0].clamp(-1.0, 1.0)) * (180.0 / math.pi)
    sideways_rate = dash_rate(sideways)
    single = actor[:, None, None]
    own_decay, own_full = decay.gather(1, single)[:, 0], full.gather(1, single)[:, 0]
    slides = (
        covered(count, own_full * sideways_rate, own_decay)
        >= distance.gather(1, own)[:, 0] - area.gather(1, single)[:, 0]
    )
    by_sliding = torch.where(slides.any(-1), slides.to(ball.dtype).argmax(-1).to(ball.dtype), NEVER)
    own_steps = torch.minimum(steps.gather(1, actor[:, None])[:, 0], by_sliding)
    steps = steps.scatter(1, actor[:, None], own_steps[:, None])
    on_field = (players[..., CHANNEL["flags"]].long() & FLAG_ON_FIELD) != 0
    return Reach(steps=torch.where(on_field, steps.clamp(max=NEVER), NEVER), ball=path)


def covered(cycles: Tensor, acceleration: Tensor, decay: Tensor) -> Tensor:
    """Metres from rest in so many dashes, which add ``acceleration`` to a velocity that then decays."""
    return acceleration / (1.0 - decay) * (cycles - decay * (1.0 - decay**cycles) / (1.0 - decay))


def dash_rate(direction_deg: Tensor) -> Tensor:
    """What part of a dash's power a direction leaves (rcssserver `player.cpp`, dash); ``direction_deg`` in 0..180."""
    ahead = 0.4 + 0.6 * (1.0 - direction_deg / 90.0)
    behind = 0.7 - 0.3 * (1.0 - (direction_deg - 90.0) / 90.0)
    return torch.where(direction_deg <= 90.0, ahead, behind).clamp(0.0, 1.0)


def ball_after(reach: Reach, steps: Tensor) -> Tensor:
    """(batch, 2) where the ball is after ``steps`` (batch,) cycles, at most STEPS."""
    place = steps.round().clamp(0, STEPS).long()
    return reach.ball.gather(1, place[:, None, None].expand(-1, 1, 2))[:, 0]
