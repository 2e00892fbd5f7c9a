"""Training errors, and the targets in the form that the paper's compares."""

from __future__ import annotations

from functools import cache
from typing import Literal, NamedTuple

import torch
from torch import Tensor
from torch.nn import functional

from teamclone.rcss.commands import CLONED, parameters_of
from teamclone.world.state import Target

ParameterLoss = Literal["paper", "masked"]


class Balance(NamedTuple):
    """How the cross-entropy makes up for commands of unlike frequency.

    Attributes:
        weight: (commands,) of a command's cross-entropy.
        shift: (commands,) added to the logits before it. With the logarithm of how much more often training sees a
            command than the world does, the logits themselves come out as those of the world: prior correction (King
            and Zeng 2001), logit adjustment (Menon et al. 2021).
    """

    weight: Tensor
    shift: Tensor


class Loss(NamedTuple):
    """The training error and two parts of it, scalars.

    ``total = cross_entropy + weight * parameters`` and, of a `MixtureHead`, the error that teaches the target points.
    """

    total: Tensor
    cross_entropy: Tensor
    parameters: Tensor


@cache
def parameter_layout(device: torch.device, commands: tuple[str, ...] = CLONED) -> tuple[Tensor, Tensor, Tensor]:
    """Limit, argument and kind of the parameters of commands, (parameters,) each, on a device.

    A limit, in power, degrees and metres, projects onto [-1, 1]. They are copied there once: a copy makes a GPU wait.
    """
    items = parameters_of(commands)
    limits = torch.tensor([item.limit for item in items])
    argument = torch.tensor([item.argument for item in items])
    kind = torch.tensor([commands.index(item.kind.name.lower()) for item in items])
    return limits.to(device), argument.to(device), kind.to(device)


def issued(kind: Tensor, commands: tuple[str, ...] = CLONED) -> Tensor:
    """(batch, parameters) bool: which belong to the command; ``kind`` is (batch,), index into ``commands``."""
    return parameter_layout(kind.device, commands)[2] == kind[:, None]


def given(target: Target, commands: tuple[str, ...] = CLONED) -> Tensor:
    """(batch, parameters) bool: those that belong to the command and of which something is known."""
    argument = parameter_layout(target.kind.device, commands)[1]
    return issued(target.kind, commands) & target.known.index_select(1, argument)


def unknown(target: Target, commands: tuple[str, ...] = CLONED) -> Tensor:
    """(batch, parameters) bool: those that belong to the command, but nothing is known of them."""
    return issued(target.kind, commands) & ~given(target, commands)


def projected_parameters(target: Target, commands: tuple[str, ...] = CLONED) -> Tensor:
    """(batch, parameters) in [-1, 1]: those of the command given, zero for those of other commands (Table II)."""
    limits, argument, _ = parameter_layout(target.kind.device, commands)
    values = target.parameters.index_select(1, argument) / limits
    return torch.where(issued(target.kind, commands), values, 0.0)


def command_loss(logits: Tensor, kind: Tensor, *, balance: Balance | None = None, of: int) -> Tensor:
    """Cross-entropy of the command, summed over the samples and divided by ``of``; ``kind`` is (batch,)."""
    if balance is None:
        return functional.cross_entropy(logits, kind, reduction="sum") / of
    return functional.cross_entropy(logits + balance.shift, kind, weight=balance.weight, reduction="sum") / of


def point_loss(
    logits: Tensor,
    projected: Tensor,
    target: Target,
    *,
    commands: tuple[str, ...] = CLONED,
    parameter_loss: ParameterLoss = "paper",
    weight: float = 1.0,
    balance: Balance | None = None,
    whole: Tensor | None = None,
) -> Loss:
    """Cross-entropy plus mean squared error, in the paper unweighted (section II-B).

    Args:
        logits: (batch, commands).
        projected: (batch, parameters) predicted parameters in [-1, 1].
        target: what the players did.
        commands: what may be given.
        parameter_loss: "paper" takes the error over all outputs, whose target is zero where the parameter was not
            issued; "masked" only over the issued ones.
        weight: of the squared error.
        balance: of the commands; None where they count alike.
        whole: (n,) commands of the batch of which these samples are a share: the means are taken over it, so that the
            losses of all shares add up to that of the batch. None where they are the batch.
    """
    whole = target.kind if whole is None else whole
    cross_entropy = command_loss(logits, target.kind, balance=balance, of=len(whole))
    squared = (projected - projected_parameters(target, commands)).square()
    if target.interval is not None:
        squared = torch.where(unknown(target, commands), 0.0, squared)
    if parameter_loss == "masked":
        mse = (squared * issued(target.kind, commands)).sum() / issued(whole, commands).sum()
    else:
        mse = squared.sum() / (len(whole) * squared.shape[1])
    return Loss(cross_entropy + weight * mse, cross_entropy, mse)


def mixture_loss(
    logits: Tensor,
    log_likelihood: Tensor,
    target: Target,
    *,
    to_targets: Tensor | None = None,
    weight: float = 1.0,
    target_weight: float = 0.0,
    balance: Balance | None = None,
    whole: Tensor | None = None,
) -> Loss:
    """Mean negative log-likelihood of the command and, given the command, of its parameters.

    Args:
        logits: (batch, commands). log_likelihood: (batch,) of the parameters.
        to_targets: (batch,) log-likelihood of the turns by the target points alone, 0 of other commands; None without
            target points.
        target_weight: of its mean.
        target, weight, balance, whole: see `point_loss`.
    """
    n = len(target.kind if whole is None else whole)
    cross_entropy = command_loss(logits, target.kind, balance=balance, of=n)
    parameters = -log_likelihood.sum() / n
    total = cross_entropy + weight * parameters
    if to_targets is not None:
        total = total - target_weight * to_targets.sum() / n
    return Loss(total, cross_entropy, parameters)
