"""The head of the paper: a softmax over the commands and one value of each parameter."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor, nn

from teamclone.models import distributions as mixture
from teamclone.models.answer import Answer, Prediction
from teamclone.models.heads.trunk_output import TrunkOutput
from teamclone.models.loss import (
    Balance,
    Loss,
    ParameterLoss,
    given,
    issued,
    parameter_layout,
    point_loss,
    projected_parameters,
)
from teamclone.rcss.commands import CLONED, parameters_of
from teamclone.world.state import Target

POINT_SCALE = 0.1
"""Standard deviation of a parameter around its predicted value, as a part of the parameter's limit. A squared error is
the likelihood of a normal distribution of fixed width; which width, the error does not say, so this is a convention."""


class PointAnswer(Answer):
    """Answer of a `PointHead`; each parameter is one value, in [-1, 1].

    A sample has the predicted parameters. The density is normal, of width `POINT_SCALE`, not learned.

    Attributes:
        projected: (batch, parameters) in [-1, 1].
        limits: (parameters,) in power, degrees and metres.
        commands: the command set.
    """

    has_density = False

    def __init__(
        self, raw_logits: Tensor, temperature: Tensor, *, projected: Tensor, limits: Tensor, commands: tuple[str, ...]
    ) -> None:
        super().__init__(raw_logits, temperature)
        self.projected, self.limits, self.commands = projected, limits, commands

    def point(self) -> Prediction:
        """Return the logits and the predicted parameters."""
        return Prediction(self.logits, self.projected * self.limits)

    def log_likelihood(self, target: Target) -> Tensor:
        """Return (batch,) log-density, in nats, of the parameters of the command given, see `POINT_SCALE`."""
        away = self.projected - projected_parameters(target, self.commands)
        angle = torch.tensor([of.angle for of in parameters_of(self.commands)], device=away.device)
        away = torch.where(angle, torch.remainder(away + 1, 2) - 1, away)
        scale = POINT_SCALE * self.limits
        each = -(away / POINT_SCALE).square() / 2 - torch.log(scale) - math.log(2 * math.pi) / 2
        return torch.where(given(target, self.commands), each, 0.0).sum(1)

    def draw_parameters(self, kind: Tensor, generator: torch.Generator | None) -> Tensor:
        """Return (batch, 2) predicted parameters of these commands; nothing is drawn."""
        _, argument, _ = parameter_layout(kind.device, self.commands)
        values = torch.where(issued(kind, self.commands), self.point().parameters, 0.0)
        return values.new_zeros(len(kind), 2).index_add(1, argument, values)


class PointHead(nn.Module):
    """The paper's two heads: a softmax over the commands, by default four, their parameters, then six, bounded by tanh.

    Args:
        width: of the features. commands: the command set. parameter_loss, parameter_weight: see `point_loss`.

    Attributes:
        temperature: () what the logits are divided by in an answer, not in training; see `training.calibration`.
    """

    limits: Tensor
    temperature: Tensor

    def __init__(
        self,
        width: int,
        commands: tuple[str, ...] = CLONED,
        *,
        parameter_loss: ParameterLoss = "paper",
        parameter_weight: float = 1.0,
    ) -> None:
        super().__init__()
        self.commands, self.parameter_loss, self.parameter_weight = commands, parameter_loss, parameter_weight
        self.command = nn.Linear(width, len(commands))
        self.parameter = nn.Linear(width, len(parameters_of(commands)))
        self.register_buffer("limits", parameter_layout(torch.device("cpu"), commands)[0].clone(), persistent=False)
        self.register_buffer("temperature", torch.ones(()))

    def forward(self, seen: Tensor | TrunkOutput) -> PointAnswer:
        """Return the answer to ``seen``: (batch, width) features, or the output of an egocentric trunk."""
        hidden = seen.hidden if isinstance(seen, TrunkOutput) else seen
        # Out of autocast's bfloat16: a degree is 1/180, finer than its steps near 1.
        return self._answer(self.command(hidden).float(), torch.tanh(self.parameter(hidden).float()))

    def merged(self, answers: Sequence[PointAnswer]) -> PointAnswer:
        """Return one answer: mean probabilities, and of each parameter the value nearest to all."""
        values = torch.stack([answer.projected for answer in answers], 2) * math.pi
        even = torch.zeros_like(values[:, 0])
        chosen = [
            mixture.weighted_medoid(even, values[:, i], angle=of.angle)
            for i, of in enumerate(parameters_of(self.commands))
        ]
        logits = mixture.mean_logits([answer.raw_logits for answer in answers])
        return self._answer(logits, torch.stack(chosen, 1) / math.pi)

    def _answer(self, logits: Tensor, projected: Tensor) -> PointAnswer:
        return PointAnswer(logits, self.temperature, projected=projected, limits=self.limits, commands=self.commands)

    def loss(
        self,
        answer: PointAnswer,
        target: Target,
        *,
        balance: Balance | None = None,
        whole: Tensor | None = None,
    ) -> Loss:
        """Return the error of the paper, see `point_loss`."""
        return point_loss(
            answer.raw_logits,
            answer.projected,
            target,
            commands=self.commands,
            parameter_loss=self.parameter_loss,
            weight=self.parameter_weight,
            balance=balance,
            whole=whole,
        )
