"""Heads: from what a network has made of a situation to an answer, its training error and its single best guess."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn

from teamclone.models import mixture
from teamclone.models.aims import geometry_of
from teamclone.models.loss import LIMITS, Balance, Loss, ParameterLoss, mixture_loss, point_loss
from teamclone.models.mixture import DEGREE, LEAST_ANGLE, LEAST_POWER, Mixture, wrap
from teamclone.models.relative import GEOMETRY, MATES
from teamclone.models.state import Target
from teamclone.rcss import pitch
from teamclone.rcss.commands import CLONED_KINDS, PARAMETERS

INCOMES = 6
"""Components of dash power that are a learned multiple of what the player recovers in a cycle."""
FREE = 4
"""Components of dash power and turn moment that hang on nothing."""
DASH_DIRECTIONS = 24
"""Classes of dash direction, 15 degrees apart."""
TACKLE_DIRECTIONS = 40
"""Classes of tackle direction, 9 degrees apart."""
KICK_PLACES = 8
"""Places beside the team mates that the ball is kicked towards."""
LEAD_M = 12.0
"""How far from a team mate a pass may go."""


class Prediction(NamedTuple):
    """One answer per situation: ``logits`` (batch, 4) over CLONED_KINDS, ``parameters`` (batch, 6) PARAMETERS in
    power and degrees, each as it would be if its command were given."""

    logits: Tensor
    parameters: Tensor


class Situation(NamedTuple):
    """What a network has made of a state.

    Attributes:
        hidden: (batch, width) what the command is decided on.
        kick: (batch, kick width) what a kick is decided on.
        geometry: (batch, len(GEOMETRY)).
        bearing, power: (batch, aims) as of `aims.Aims`.
    """

    hidden: Tensor
    kick: Tensor
    geometry: Tensor
    bearing: Tensor
    power: Tensor


class PointHead(nn.Module):
    """The paper's two heads: a softmax over four commands, six parameters bounded by tanh.

    Attributes:
        temperature: () what the logits are divided by in an answer, not in training; see `training.calibration`.
    """

    limits: Tensor
    temperature: Tensor

    def __init__(self, width: int) -> None:
        super().__init__()
        self.command = nn.Linear(width, len(CLONED_KINDS))
        self.parameter = nn.Linear(width, len(PARAMETERS))
        self.register_buffer("limits", LIMITS.clone(), persistent=False)
        self.register_buffer("temperature", torch.ones(()))

    def forward(self, seen: Tensor | Situation) -> tuple[Tensor, Tensor]:
        """Logits (batch, 4) and parameters in [-1, 1], (batch, 6)."""
        hidden = seen.hidden if isinstance(seen, Situation) else seen
        # Out of autocast's bfloat16: a degree is 1/180, finer than its steps near 1.
        return self.command(hidden).float(), torch.tanh(self.parameter(hidden).float())

    @staticmethod
    def merged(outputs: Sequence[tuple[Tensor, Tensor]]) -> tuple[Tensor, Tensor]:
        """The answers of several heads as one: mean probabilities, of each parameter the one nearest to all."""
        logits, projected = zip(*outputs, strict=True)
        values = torch.stack(projected, 2) * math.pi
        even = torch.zeros_like(values[:, 0])
        chosen = [mixture.middle(even, values[:, i], angle=of.angle) for i, of in enumerate(PARAMETERS)]
        return mean_logits(logits), torch.stack(chosen, 1) / math.pi

    @staticmethod
    def logits(output: tuple[Tensor, Tensor]) -> Tensor:
        """(batch, 4) as they are trained, before the temperature."""
        return output[0]

    def point(self, output: tuple[Tensor, Tensor]) -> Prediction:
        """The single best answer, in power and degrees."""
        logits, projected = output
        return Prediction(logits / self.temperature, projected * self.limits)

    def loss(
        self,
        output: tuple[Tensor, Tensor],
        target: Target,
        *,
        parameter_loss: ParameterLoss = "paper",
        weight: float = 1.0,
        balance: Balance | None = None,
        whole: Tensor | None = None,
    ) -> Loss:
        logits, projected = output
        return point_loss(
            logits, projected, target, parameter_loss=parameter_loss, weight=weight, balance=balance, whole=whole
        )


class Distribution(NamedTuple):
    """What a `MixtureHead` answers, all for the command that they belong to.

    Attributes:
        logits: (batch, 4) over CLONED_KINDS.
        dash_power: power. dash_direction: (batch, DASH_DIRECTIONS) logits. turn: radians before the loss by motion.
        turn_factor: (batch,) turn moment for one degree.
        kick_power, kick_direction: power and radians; both have the shares of the same components.
        tackle_direction: (batch, TACKLE_DIRECTIONS) logits.
    """

    logits: Tensor
    dash_power: Mixture
    dash_direction: Tensor
    turn: Mixture
    turn_factor: Tensor
    kick_power: Mixture
    kick_direction: Mixture
    tackle_direction: Tensor


class MixtureHead(nn.Module):
    """Command probabilities, and for each command a distribution of its parameters.

    Components hang on what a player may want: to face the ball, where he meets it or where he makes for; to come to
    rest there; to spend a multiple of what he recovers; to kick the ball towards a team mate or a place. The network
    gives their shares, small corrections and scales.

    Args:
        width: of what the command is decided on. kick_width: of what a kick is. aims: places of `aims.Aims`.

    Attributes:
        temperature: as of `PointHead`; of the commands only.
    """

    goal: Tensor
    temperature: Tensor

    def __init__(self, width: int, kick_width: int, aims: int) -> None:
        super().__init__()
        self.n_dash, self.n_turn, self.n_kick = aims + INCOMES + FREE, aims + 2 + FREE, MATES + KICK_PLACES
        self.command = nn.Linear(width, len(CLONED_KINDS))
        self.dash = nn.Linear(width, 3 * self.n_dash + DASH_DIRECTIONS)
        self.turn = nn.Linear(width, 3 * self.n_turn)
        self.kick = nn.Linear(kick_width, 6 * self.n_kick)
        self.tackle = nn.Linear(kick_width, TACKLE_DIRECTIONS)
        self.incomes = nn.Parameter(torch.linspace(0.25, 2.0, INCOMES))
        self.powers = nn.Parameter(torch.linspace(0.0, 100.0, FREE))
        self.register_buffer("goal", torch.tensor([pitch.HALF_LENGTH, 0.0]), persistent=False)
        self.register_buffer("temperature", torch.ones(()))

    def forward(self, situation: Situation) -> Distribution:
        hidden, kick = situation.hidden, situation.kick
        command, dash, turn = (layer(hidden).float() for layer in (self.command, self.dash, self.turn))
        kick_raw, tackle = self.kick(kick).float(), self.tackle(kick).float()
        with torch.autocast(hidden.device.type, enabled=False):
            kick_power, kick_direction = self._kick(kick_raw, situation.geometry)
            factor = geometry_of(situation.geometry, "turn_factor")[0][:, 0]
            return Distribution(
                logits=command,
                dash_power=self._dash(dash[:, : 3 * self.n_dash], situation),
                dash_direction=dash[:, 3 * self.n_dash :],
                turn=self._turn(turn, situation),
                turn_factor=factor,
                kick_power=kick_power,
                kick_direction=kick_direction,
                tackle_direction=tackle,
            )

    def _dash(self, raw: Tensor, situation: Situation) -> Mixture:
        logits, shift, scale = raw.chunk(3, 1)
        income = geometry_of(situation.geometry, "income")[0]
        wanted = [situation.power.clamp(-20, 120), income * self.incomes, self.powers.expand(len(raw), -1)]
        return Mixture(
            logits, torch.cat(wanted, 1) + 5 * shift, mixture.scale_of(scale, least=LEAST_POWER, typical=3.0)
        )

    def _turn(self, raw: Tensor, situation: Situation) -> Mixture:
        logits, shift, scale = raw.chunk(3, 1)
        to_ball, to_meet = geometry_of(situation.geometry, "turn_to_ball", "turn_to_meet")
        free = torch.linspace(-0.75, 0.75, FREE, device=raw.device).expand(len(raw), -1) * torch.pi
        centre = torch.cat([to_ball, to_meet, situation.bearing, free], 1)
        # Only the free ones go far from where they begin.
        reach = torch.cat([torch.full_like(centre[:, :-FREE], 0.05), torch.ones_like(free)], 1)
        return Mixture(
            logits, wrap(centre + reach * shift), mixture.scale_of(scale, least=LEAST_ANGLE, typical=2 * DEGREE)
        )

    def _kick(self, raw: Tensor, geometry: Tensor) -> tuple[Mixture, Mixture]:
        """Components are velocities that the ball is to have, towards a place; then the kick that adds what lacks."""
        logits, ahead, aside, speed, power_scale, angle_scale = raw.view(len(raw), 6, self.n_kick).unbind(1)
        mates = geometry[:, len(GEOMETRY) - 2 * MATES :].view(-1, MATES, 2)
        x, y, cos, sin, rate = geometry_of(geometry, "ball_x", "ball_y", "cos", "sin", "kick_gain")
        offset = LEAD_M * torch.stack([ahead, aside], -1)
        ball = torch.cat([x, y], 1)[:, None]
        base = torch.cat([mates, self.goal.expand(len(raw), 1, 2), ball.expand(-1, KICK_PLACES - 1, 2)], 1)
        way = base + offset - ball
        direction = way / torch.sqrt(way.square().sum(-1, keepdim=True) + 1e-6)
        wanted = direction * (3.0 * torch.sigmoid(speed))[..., None]
        gain_x, gain_y = (
            wanted[..., 0] - geometry_of(geometry, "ball_vx")[0],
            wanted[..., 1] - geometry_of(geometry, "ball_vy")[0],
        )
        power = torch.sqrt(gain_x.square() + gain_y.square() + 1e-6) / rate.clamp(min=5e-3)
        angle = torch.atan2(gain_y * cos - gain_x * sin, gain_x * cos + gain_y * sin)
        return (
            Mixture(logits, power.clamp(max=150.0), mixture.scale_of(power_scale, least=LEAST_POWER, typical=5.0)),
            Mixture(logits, angle, mixture.scale_of(angle_scale, least=LEAST_ANGLE, typical=6 * DEGREE)),
        )

    @staticmethod
    def merged(outputs: Sequence[Distribution]) -> Distribution:
        """The answers of several heads as one: mean probabilities, and mixtures of all their components."""
        first = outputs[0]
        return Distribution(
            logits=mean_logits([output.logits for output in outputs]),
            dash_power=mixture.merged([output.dash_power for output in outputs]),
            dash_direction=mean_logits([output.dash_direction for output in outputs]),
            turn=mixture.merged([output.turn for output in outputs]),
            turn_factor=first.turn_factor,
            kick_power=mixture.merged([output.kick_power for output in outputs]),
            kick_direction=mixture.merged([output.kick_direction for output in outputs]),
            tackle_direction=mean_logits([output.tackle_direction for output in outputs]),
        )

    @staticmethod
    def logits(output: Distribution) -> Tensor:
        """(batch, 4) as they are trained, before the temperature."""
        return output.logits

    def point(self, output: Distribution) -> Prediction:
        """The single best answer, in power and degrees: of each mixture the component nearest to its median."""
        turn = mixture.middle(output.turn.logits, output.turn.centre, angle=True) / DEGREE * output.turn_factor
        parameters = [
            mixture.middle(output.dash_power.logits, output.dash_power.centre.clamp(0, 100), angle=False),
            direction_of(output.dash_direction),
            turn.clamp(-180.0, 180.0),
            mixture.middle(output.kick_power.logits, output.kick_power.centre.clamp(0, 100), angle=False),
            mixture.middle(output.kick_direction.logits, output.kick_direction.centre, angle=True) / DEGREE,
            direction_of(output.tackle_direction),
        ]
        return Prediction(output.logits / self.temperature, torch.stack(parameters, 1))

    def loss(
        self,
        output: Distribution,
        target: Target,
        *,
        parameter_loss: ParameterLoss = "paper",
        weight: float = 1.0,
        balance: Balance | None = None,
        whole: Tensor | None = None,
    ) -> Loss:
        """Negative log-likelihood of command and parameters together; ``parameter_loss`` does not apply."""
        return mixture_loss(
            output.logits,
            self.log_likelihood(output, target),
            target,
            weight=weight,
            balance=balance,
            whole=whole,
        )

    @staticmethod
    def log_likelihood(output: Distribution, target: Target) -> Tensor:
        """(batch,) log-likelihood of the parameters of the command given, per unit of power and degree."""
        first, second = target.parameters[:, 0], target.parameters[:, 1]
        kick = mixture.power_terms(output.kick_power, first) + mixture.angle_terms(output.kick_direction, second)
        by_kind = [
            mixture.log_likelihood(output.dash_power.logits, mixture.power_terms(output.dash_power, first))
            + log_class(output.dash_direction, second),
            mixture.log_likelihood(
                output.turn.logits, mixture.angle_terms(output.turn, first, factor=output.turn_factor)
            ),
            mixture.log_likelihood(output.kick_power.logits, kick),
            log_class(output.tackle_direction, first),
        ]
        return torch.stack(by_kind, 1).gather(1, target.kind[:, None]).squeeze(1)


class EnsembleHead(nn.Module):
    """Heads of several trunks, which learn side by side and answer together.

    What it answers to a situation is the list of its members' answers; `merged` makes one of them.

    Attributes:
        temperature: as of `PointHead`, of the merged logits; the members keep 1.
    """

    temperature: Tensor

    def __init__(self, members: Sequence[PointHead | MixtureHead]) -> None:
        super().__init__()
        self.members = nn.ModuleList(members)
        self.register_buffer("temperature", torch.ones(()))

    @property
    def _first(self) -> Any:
        return self.members[0]

    def forward(self, seen: Sequence[Any]) -> list[Any]:
        return [member(of) for member, of in zip(self.members, seen, strict=True)]

    def merged(self, outputs: Sequence[Any]) -> Any:
        return self._first.merged(outputs)

    def logits(self, outputs: Sequence[Any]) -> Tensor:
        """(batch, 4) of the mean probabilities, before the temperature."""
        logits: Tensor = self._first.logits(self.merged(outputs))
        return logits

    def point(self, outputs: Sequence[Any]) -> Prediction:
        prediction: Prediction = self._first.point(self.merged(outputs))
        return prediction._replace(logits=prediction.logits / self.temperature)

    def log_likelihood(self, outputs: Sequence[Any], target: Target) -> Tensor:
        """As of `MixtureHead`, which its members have to be."""
        likelihood: Tensor = self._first.log_likelihood(self.merged(outputs), target)
        return likelihood

    def loss(self, outputs: Sequence[Any], target: Target, **settings: Any) -> Loss:
        """In training the mean of the members' errors, so that each learns as if alone; else that of their answer."""
        if not self.training:
            loss: Loss = self._first.loss(self.merged(outputs), target, **settings)
            return loss
        losses = [self._first.loss(output, target, **settings) for output in outputs]
        return Loss(*(torch.stack(part).mean() for part in zip(*losses, strict=True)))


def mean_logits(logits: Sequence[Tensor]) -> Tensor:
    """(batch, classes) logarithms of the mean probabilities."""
    return torch.stack([torch.log_softmax(of, 1) for of in logits]).logsumexp(0) - math.log(len(logits))


def class_of(degrees: Tensor, count: int) -> Tensor:
    """(batch,) which of ``count`` directions, the first of them straight ahead, is the nearest."""
    return torch.round(degrees * (count / 360.0)).long() % count


def log_class(logits: Tensor, degrees: Tensor) -> Tensor:
    """(batch,) log-likelihood of a direction, taken as even within its class."""
    count = logits.shape[1]
    chosen = torch.log_softmax(logits, 1).gather(1, class_of(degrees, count)[:, None]).squeeze(1)
    return chosen - torch.log(torch.tensor(360.0 / count))


def direction_of(logits: Tensor) -> Tensor:
    """(batch,) degrees of the most probable direction."""
    count = logits.shape[1]
    degrees = logits.argmax(1).to(logits.dtype) * (360.0 / count)
    return torch.where(degrees > 180.0, degrees - 360.0, degrees)
