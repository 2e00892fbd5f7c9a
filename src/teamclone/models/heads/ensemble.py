"""Several heads that answer together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, cast

import torch
from torch import Tensor, nn

from teamclone.models.answer import Answer, Prediction
from teamclone.models.heads.mixture import KickAnswer, MixtureHead
from teamclone.models.heads.point import PointHead
from teamclone.models.heads.trunk_output import KickFeatures
from teamclone.models.loss import Balance, Loss
from teamclone.world.state import Target


class EnsembleAnswer(Answer):
    """Answer of several heads: the mean of their probabilities, and the mixture of their parameters' distributions.

    A sample of parameters is that of one member, drawn at random; of point heads it is the value nearest to all.

    Attributes:
        members: answer of each head. merged: the one answer that they give together.
    """

    def __init__(self, members: Sequence[Answer], merge: Callable[[Sequence[Any]], Any], temperature: Tensor) -> None:
        self.members, self._merge, self.temperature = members, merge, temperature
        self.has_density = members[0].has_density

    @cached_property
    def merged(self) -> Any:
        """The one answer that the members give together."""
        merged = self._merge(self.members)
        merged.temperature = self.temperature
        return merged

    @property
    def raw_logits(self) -> Tensor:  # type: ignore[override]
        """(batch, commands) of the mean probabilities, before the temperature."""
        logits: Tensor = self.merged.raw_logits
        return logits

    @property
    def answered_logits(self) -> Tensor:
        """Those of `merged`, see `Answer.answered_logits`."""
        logits: Tensor = self.merged.answered_logits
        return logits

    def point(self) -> Prediction:
        """Return the likeliest answer, that of `merged`."""
        prediction: Prediction = self.merged.point()
        return prediction

    def log_likelihood(self, target: Target) -> Tensor:
        """Return (batch,) log-likelihood of the parameters under `merged`."""
        likelihood: Tensor = self.merged.log_likelihood(target)
        return likelihood

    def draw_parameters(self, kind: Tensor, generator: torch.Generator | None) -> Tensor:
        """Draw (batch, 2) parameters of `merged`, see `Answer.draw_parameters`."""
        parameters: Tensor = self.merged.draw_parameters(kind, generator)
        return parameters


class EnsembleHead(nn.Module):
    """Heads of several trunks, which learn side by side and answer together.

    Attributes:
        temperature: () divisor of the merged logits; that of the members stays 1.
    """

    temperature: Tensor

    def __init__(self, members: Sequence[PointHead | MixtureHead]) -> None:
        super().__init__()
        self.members = nn.ModuleList(members)
        self.register_buffer("temperature", torch.ones(()))

    @property
    def _first(self) -> Any:
        return self.members[0]

    def forward(self, seen: Sequence[Any]) -> EnsembleAnswer:
        """Return the common answer to the outputs of the members' trunks."""
        answers = [member(of) for member, of in zip(self.members, seen, strict=True)]
        return EnsembleAnswer(answers, self._first.merged, self.temperature)

    def kick_answers(self, seen: Sequence[KickFeatures]) -> list[tuple[KickAnswer, KickAnswer]]:
        """Return the answers on kicks and tackles of each member, which must be a `MixtureHead`."""
        return [cast(MixtureHead, member).kick_answers(of) for member, of in zip(self.members, seen, strict=True)]

    def kick_loss(self, kicks: Sequence[Sequence[KickAnswer]], target: Target, *, of: int) -> Tensor:
        """Return the mean of the members' errors, see `MixtureHead.kick_loss`."""
        return torch.stack([self._first.kick_loss(answers, target, of=of) for answers in kicks]).mean()

    def loss(
        self, answer: EnsembleAnswer, target: Target, *, balance: Balance | None = None, whole: Tensor | None = None
    ) -> Loss:
        """Return in training the mean of the members' errors, so that each learns as if alone; else that of ``answer``.

        ``balance`` and ``whole`` are as in `loss.point_loss`.
        """
        if not self.training:
            loss: Loss = self._first.loss(answer.merged, target, balance=balance, whole=whole)
            return loss
        losses = [self._first.loss(member, target, balance=balance, whole=whole) for member in answer.members]
        return Loss(*(torch.stack(part).mean() for part in zip(*losses, strict=True)))
