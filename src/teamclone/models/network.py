"""``Clone``: from the raw state to a command, features and normalisation inside."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple, cast

import torch
from torch import Tensor, nn

from teamclone.models.config import ModelConfig
from teamclone.models.features import FEATURES, Features
from teamclone.models.loss import LIMITS, Loss, ParameterLoss, clone_loss
from teamclone.models.state import State, Target
from teamclone.rcss.commands import CLONED_KINDS, PARAMETERS

_ACTIVATIONS: dict[str, type[nn.Module]] = {"relu": nn.ReLU, "gelu": nn.GELU, "silu": nn.SiLU, "tanh": nn.Tanh}


class Prediction(NamedTuple):
    """One answer per situation: ``logits`` (batch, 4) over CLONED_KINDS, ``parameters`` (batch, 6) PARAMETERS in
    power and degrees, each as it would be if its command were given."""

    logits: Tensor
    parameters: Tensor


class PointHead(nn.Module):
    """The paper's two heads: a softmax over four commands, six parameters bounded by tanh."""

    limits: Tensor

    def __init__(self, width: int) -> None:
        super().__init__()
        self.command = nn.Linear(width, len(CLONED_KINDS))
        self.parameter = nn.Linear(width, len(PARAMETERS))
        self.register_buffer("limits", LIMITS.clone(), persistent=False)

    def forward(self, hidden: Tensor) -> tuple[Tensor, Tensor]:
        """Logits (batch, 4) and parameters in [-1, 1], (batch, 6)."""
        # Out of autocast's bfloat16: a degree is 1/180, finer than its steps near 1.
        return self.command(hidden).float(), torch.tanh(self.parameter(hidden).float())

    def point(self, output: tuple[Tensor, Tensor]) -> Prediction:
        """The single best answer, in power and degrees."""
        logits, projected = output
        return Prediction(logits, projected * self.limits)

    def loss(
        self,
        output: tuple[Tensor, Tensor],
        target: Target,
        *,
        parameter_loss: ParameterLoss = "paper",
        whole: Tensor | None = None,
    ) -> Loss:
        logits, projected = output
        return clone_loss(logits, projected, target, parameter_loss=parameter_loss, whole=whole)


class Clone(nn.Module):
    """A network that plays like a team: which command a player gives in a situation, and with which parameters."""

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.config = config
        self.features = FEATURES[config.features](own_type=config.own_type, all_types=config.all_types)
        widths = (len(self.features.names), *config.hidden)
        layers: list[nn.Module] = []
        for width_in, width_out in pairwise(widths):
            layers += [nn.Linear(width_in, width_out), _ACTIVATIONS[config.activation]()]
        self.trunk = nn.Sequential(*layers)
        self.head = PointHead(widths[-1])
        for module in self.modules():
            if isinstance(module, nn.Linear):
                # Keras' default, with which the paper trained.
                nn.init.xavier_uniform_(module.weight)
                nn.init.zeros_(module.bias)

    @property
    def inputs(self) -> Features:
        return cast(Features, self.features)

    def output(self, state: State) -> tuple[Tensor, Tensor]:
        """What the head answers, for ``head.loss`` and ``head.point``."""
        return self.answer(self.features(state))

    def answer(self, inputs: Tensor) -> tuple[Tensor, Tensor]:
        """The same from what the features make of a state, (batch, columns)."""
        answer: tuple[Tensor, Tensor] = self.head(self.trunk(inputs))
        return answer

    def forward(self, state: State) -> Prediction:
        return self.head.point(self.output(state))

    @torch.no_grad()
    def predict(self, state: State) -> tuple[Tensor, Tensor]:
        """Probabilities (batch, 4) over CLONED_KINDS and parameters (batch, 6) in power and degrees."""
        prediction: Prediction = self(state)
        return prediction.logits.softmax(1), prediction.parameters


def parameter_count(model: nn.Module) -> int:
    """Number of trained weights."""
    return sum(weights.numel() for weights in model.parameters())
