"""A model's answer to a batch of situations, in one form for every head."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import torch
from torch import Tensor

from teamclone.models.distributions import draw_component
from teamclone.world.state import Target


class Prediction(NamedTuple):
    """The single best answer to each situation.

    Attributes:
        logits: (batch, commands) calibrated.
        parameters: (batch, parameters) in power, degrees and metres, each for the case that its command is given.
    """

    logits: Tensor
    parameters: Tensor


class Answer(ABC):
    """A distribution of commands and, given the command, of its parameters, for each situation of a batch.

    Attributes:
        raw_logits: (batch, commands) as they are trained, before the temperature.
        temperature: () divisor of the logits; see `training.calibration`.
        has_density: whether the density of parameters was learned. False where its scale is a fixed convention.
    """

    has_density: bool = True

    def __init__(self, raw_logits: Tensor, temperature: Tensor) -> None:
        self.raw_logits = raw_logits
        self.temperature = temperature

    @property
    def logits(self) -> Tensor:
        """(batch, commands) logits, calibrated by the temperature."""
        return self.raw_logits / self.temperature

    @property
    def answered_logits(self) -> Tensor:
        """(batch, commands) `logits`, of kicks and tackles -inf where the answer leaves them out."""
        return self.logits

    @property
    def probabilities(self) -> Tensor:
        """(batch, commands) probabilities, calibrated by the temperature."""
        return self.logits.softmax(1)

    @abstractmethod
    def point(self) -> Prediction:
        """Return the single best answer. Kick and tackle are 0 where they were not asked for."""

    @abstractmethod
    def log_likelihood(self, target: Target) -> Tensor:
        """Return (batch,) the log-likelihood of the parameters given the command, per unit of power, degree and metre.

        That of the command itself is `command_log_likelihood`; the two add up to that of both.
        """

    @abstractmethod
    def draw_parameters(self, kind: Tensor, generator: torch.Generator | None) -> Tensor:
        """Return (batch, 2) parameters drawn from the distributions of the commands ``kind`` (batch,)."""

    def command_log_likelihood(self, kind: Tensor) -> Tensor:
        """Return (batch,) the calibrated log-probability of the commands ``kind`` (batch,)."""
        return torch.log_softmax(self.logits, 1).gather(1, kind[:, None]).squeeze(1)

    def sample(self, generator: torch.Generator | None = None) -> Target:
        """Draw a command for each situation, then its parameters, clipped as the server clips them.

        In situations whose kicks and tackles the answer leaves out none is drawn.

        Args:
            generator: source of the random numbers, on the device of the answer; None takes PyTorch's own.
        """
        kind = draw(self.answered_logits, generator)
        return Target(kind, self.draw_parameters(kind, generator))


def draw(logits: Tensor, generator: torch.Generator | None) -> Tensor:
    """Return (batch,) classes drawn with the probabilities of ``logits`` (batch, classes)."""
    return draw_component(logits, generator).squeeze(1)
