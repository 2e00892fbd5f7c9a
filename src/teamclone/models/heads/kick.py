"""Kicks: the velocity that the ball is to have, from which physics gives power and direction.

A kick adds to the velocity that the ball already has, seen from a body that may face anywhere. The purpose of a kick is
simpler: the ball goes to a team mate, into the goal, or so far ahead that the player reaches it again in a few dashes.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from teamclone.dynamics.formulas import covered, roll
from teamclone.engine.network.constants import (
    AHEAD_M,
    BALL_COMPONENTS,
    DRIBBLES,
    IMPOSSIBLE,
    LEAD_M,
    LEAST_ANGLE,
    LEAST_GAIN,
    LEAST_POWER,
    MOST_KICK,
    N_COMPONENTS,
    TARGETS,
    TOUCH_M,
    TYPICAL_KICK_ANGLE,
    TYPICAL_KICK_POWER,
    USUAL_ERROR,
)
from teamclone.models import distributions as mixture
from teamclone.models.distributions import Mixture, scale_of
from teamclone.models.heads.candidates import Candidates
from teamclone.models.inputs.geometry import Inputs, geometry_of, mates_of
from teamclone.planner.columns import WAYS
from teamclone.rcss import pitch


def kick_for(wanted: Tensor, geometry: Tensor) -> tuple[Tensor, Tensor]:
    """Return power and direction of the kicks that give the ball a velocity.

    Power is at most MOST_KICK; directions are radians from the body.

    Args:
        wanted: (batch, components, 2) metres per cycle on the pitch.
    """
    vx, vy, cos, sin, gain = geometry_of(geometry, "ball_vx", "ball_vy", "cos", "sin", "kick_gain")
    x, y = wanted[..., 0] - vx, wanted[..., 1] - vy
    power = torch.sqrt(x.square() + y.square() + 1e-6) / gain.clamp(min=LEAST_GAIN)
    return power.clamp(max=MOST_KICK), torch.atan2(y * cos - x * sin, x * cos + y * sin)


class Planned(nn.Module):
    """Components of power and direction of a kick, one for each way that a plan knows (`planner.plan`).

    Attributes:
        error: (WAYS,) logarithm of the errors of the ball's velocity after planned kicks, in USUAL_ERROR.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.share = nn.Linear(width, len(WAYS))
        self.error = nn.Parameter(torch.zeros(len(WAYS)))

    def forward(self, hidden: Tensor, inputs: Inputs) -> tuple[Mixture, Mixture]:
        """Return mixtures of power and direction, see `Kicks.forward`."""
        share = self.share(hidden).float()
        with torch.autocast(hidden.device.type, enabled=False):
            ways, geometry = inputs.ways, inputs.geometry
            logits = torch.where(ways[..., 0] > 0, share, IMPOSSIBLE)
            power, angle = kick_for(ways[..., 1:], geometry)
            gain = geometry_of(geometry, "kick_gain")[0].clamp(min=LEAST_GAIN)
            error = USUAL_ERROR * self.error.exp()
            return (
                Mixture(logits, power, LEAST_POWER + error / gain),
                Mixture(logits, angle, LEAST_ANGLE + error / (gain * power)),
            )


def _sized(logits: Tensor, wanted: Tensor, scales: Tensor, geometry: Tensor) -> tuple[Mixture, Mixture]:
    """Return mixtures of power and direction of the kicks that give the ball velocities.

    Args:
        logits: (batch, components). wanted: (batch, components, 2), see `kick_for`. scales: (batch, components, 2)
            unbounded, of power and of angle.
    """
    with torch.autocast(logits.device.type, enabled=False):
        power, angle = kick_for(wanted, geometry)
        return (
            Mixture(logits, power, scale_of(scales[..., 0], least=LEAST_POWER, typical=TYPICAL_KICK_POWER)),
            Mixture(logits, angle, scale_of(scales[..., 1], least=LEAST_ANGLE, typical=TYPICAL_KICK_ANGLE)),
        )


class KickMixture(nn.Module):
    """Mixtures of power and direction of a kick; both share the weights of their components.

    There are N_COMPONENTS, with ``planned`` those of `Planned`, and with ``candidates`` those of `Candidates`.

    Args:
        width: of the features of kicks.
        target_width: of the embedding of each of `players.TARGETS`, the team mates and the goal; 0 for none.
        planned: add those of `Planned`, from the ways of the inputs.
        candidates: width of the layers that score candidates, 0 for none; dropout: of these layers.
    """

    goal: Tensor
    cycles: Tensor

    def __init__(
        self,
        width: int,
        target_width: int = 0,
        *,
        planned: bool = False,
        candidates: int = 0,
        dropout: float = 0.0,
    ) -> None:
        super().__init__()
        self.layer = nn.Linear(width, 6 * N_COMPONENTS)
        self.target = nn.Linear(target_width, 6) if target_width else None
        self.planned = Planned(width) if planned else None
        self.candidates = Candidates(width, target_width, candidates, dropout) if candidates else None
        self.register_buffer("goal", torch.tensor([pitch.HALF_LENGTH, 0.0]), persistent=False)
        self.register_buffer("cycles", torch.tensor(DRIBBLES, dtype=torch.float32), persistent=False)

    def forward(self, hidden: Tensor, inputs: Inputs, targets: Tensor | None = None) -> tuple[Mixture, Mixture]:
        """Return mixtures of power and direction (radians from the body).

        Args:
            hidden: (batch, width). inputs: of (batch) situations.
            targets: (batch, TARGETS, target width), None for nothing.
        """
        parts = [self._free(hidden, inputs.geometry, targets)]
        if self.planned is not None:
            parts.append(self.planned(hidden, inputs))
        if self.candidates is not None:
            logits, wanted, scales = self.candidates(hidden, inputs, targets)
            parts.append(_sized(logits, wanted, scales, inputs.geometry))
        if len(parts) == 1:
            return parts[0]
        power, angle = (mixture.concatenate(part) for part in zip(*parts, strict=True))
        return power, angle

    def _free(self, hidden: Tensor, geometry: Tensor, targets: Tensor | None) -> tuple[Mixture, Mixture]:
        """Return the components whose targets the network chooses."""
        raw = self.layer(hidden).float().view(-1, 6, N_COMPONENTS)
        if self.target is not None and targets is not None:
            # The components begin with the team mates and the goal.
            raw = raw + functional.pad(self.target(targets).float().transpose(1, 2), (0, N_COMPONENTS - TARGETS))
        with torch.autocast(hidden.device.type, enabled=False):
            logits, ahead, aside, speed, power_scale, angle_scale = raw.unbind(1)
            aimed = N_COMPONENTS - len(DRIBBLES)
            wanted = torch.cat(
                [
                    self._aimed(ahead[:, :aimed], aside[:, :aimed], speed[:, :aimed], geometry),
                    self._dribbled(ahead[:, aimed:], aside[:, aimed:], geometry),
                ],
                1,
            )
            return _sized(logits, wanted, torch.stack([power_scale, angle_scale], 2), geometry)

    def _aimed(self, ahead: Tensor, aside: Tensor, speed: Tensor, geometry: Tensor) -> Tensor:
        """Return (batch, components, 2) velocities towards a place near a team mate, the goal or the ball."""
        mates = mates_of(geometry)
        ball = torch.cat(geometry_of(geometry, "ball_x", "ball_y"), 1)[:, None]
        base = torch.cat([mates, self.goal.expand_as(ball), ball.expand(-1, BALL_COMPONENTS, -1)], 1)
        way = base + LEAD_M * torch.stack([ahead, aside], -1) - ball
        direction = way / torch.sqrt(way.square().sum(-1, keepdim=True) + 1e-6)
        return direction * (geometry_of(geometry, "ball_speed_max")[0] * torch.sigmoid(speed))[..., None]

    def _dribbled(self, ahead: Tensor, aside: Tensor, geometry: Tensor) -> Tensor:
        """Return (batch, components, 2) velocities of dribbles.

        Each brings the ball in front of the actor after a kick and dashes straight on.
        """
        decay, forward, sideways, gain = geometry_of(geometry, "decay", "forward", "aside", "dash_gain")
        coasted = roll(self.cycles, decay)
        run = forward * coasted + covered(self.cycles - 1, 100.0 * gain, decay)
        along, across = run + AHEAD_M + TOUCH_M * ahead, sideways * coasted + TOUCH_M * aside
        x, y, cos, sin, ball_x, ball_y = geometry_of(geometry, "x", "y", "cos", "sin", "ball_x", "ball_y")
        way = torch.stack([x + along * cos - across * sin - ball_x, y + along * sin + across * cos - ball_y], -1)
        rolled: Tensor = roll(self.cycles, geometry_of(geometry, "ball_decay")[0])
        return way / rolled[..., None]
