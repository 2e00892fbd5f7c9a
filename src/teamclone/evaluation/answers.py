"""A model's answers for many states, in chunks, for evaluation and prediction."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from teamclone.models.answer import Answer
from teamclone.models.heads.mixture import with_ball
from teamclone.rcss.commands import parameters_of
from teamclone.world.state import State, Target

if TYPE_CHECKING:
    from teamclone.models.clone import Clone

BATCH = 8192
"""Samples whose answers are computed at once; bounds memory."""


class Answers(NamedTuple):
    """Answers for some samples.

    Attributes:
        probabilities: (n, commands) float32.
        parameters: (n, parameters) float32, likeliest `parameters_of` the commands, in power, degrees and metres. Those
            of kicks and tackles are 0 where they were not asked for.
        parameter_log_loss: (n,) float32, -ln of the likelihood of the target's parameters, nats; NaN without a target,
            from a head without a density, and for commands without parameters.
        spread: (n, parameters) float32, half of the draws of the likeliest command's parameters lie within this of the
            likeliest; NaN for the other commands, from a head without a density, and where nothing was drawn.
    """

    probabilities: NDArray[np.float32]
    parameters: NDArray[np.float32]
    parameter_log_loss: NDArray[np.float32]
    spread: NDArray[np.float32]


def answers(
    model: Clone,
    n: int,
    inputs_of: Callable[[slice], State | Tensor],
    *,
    target_of: Callable[[slice], Target] | None = None,
    kicks_of: Callable[[slice], Tensor] | None = None,
    draws: int = 0,
    batch: int = BATCH,
) -> Iterator[tuple[slice, Answers]]:
    """Run a model over samples; it is put into evaluation mode.

    Args:
        n: number of samples.
        inputs_of: gives the state of some of them, or their projected inputs.
        target_of: gives the true commands; None where they are not known.
        kicks_of: gives which of the samples to answer on kicks and tackles, (k,) indices into the slice; None asks for
            those in which one was given.
        draws: of the likeliest command's parameters, for their spread.
        batch: samples per pass.
    """
    model.eval()
    device = next(model.parameters()).device
    generator = torch.Generator(device).manual_seed(0)
    for start in range(0, n, batch):
        part = slice(start, min(n, start + batch))
        with torch.inference_mode():
            target = None if target_of is None else target_of(part).to(device)
            kicks = None if target is None else with_ball(target)
            if kicks_of is not None:
                kicks = kicks_of(part).to(device)
            given = inputs_of(part).to(device)
            if isinstance(given, State):
                answer = model.answer(given, kick_rows=kicks)
            else:
                answer = model.answer_inputs(model.inputs.normalise(given), kick_rows=kicks)
            point = answer.point()
            log_loss = np.full(part.stop - part.start, np.nan, np.float32)
            if target is not None and answer.has_density:
                log_loss[:] = -answer.log_likelihood(target).float().cpu().numpy()
            spread = _spread(answer, point.parameters.float(), model.config.commands, draws=draws, generator=generator)
        yield (
            part,
            Answers(
                probabilities=point.logits.float().softmax(1).cpu().numpy(),
                parameters=point.parameters.float().cpu().numpy(),
                parameter_log_loss=log_loss,
                spread=spread,
            ),
        )


def _spread(
    answer: Answer, likeliest: Tensor, commands: tuple[str, ...], *, draws: int, generator: torch.Generator
) -> NDArray[np.float32]:
    """Return `Answers.spread`; ``likeliest`` are (n, parameters)."""
    spread = np.full(likeliest.shape, np.nan, np.float32)
    if not draws or not answer.has_density:
        return spread
    kind = answer.logits.argmax(1)
    drawn = torch.stack([answer.draw_parameters(kind, generator).float() for _ in range(draws)])
    for column, parameter in enumerate(parameters_of(commands)):
        of_kind = kind == commands.index(parameter.kind.name.lower())
        away = drawn[:, of_kind, parameter.argument] - likeliest[of_kind, column]
        if parameter.angle:
            away = torch.remainder(away + 180.0, 360.0) - 180.0
        spread[of_kind.cpu().numpy(), column] = away.abs().median(0).values.cpu().numpy()
    return spread
