"""A model's answers for many states, in chunks, for evaluation and prediction."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from teamclone.models.heads.mixture import with_ball
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
    """

    probabilities: NDArray[np.float32]
    parameters: NDArray[np.float32]
    parameter_log_loss: NDArray[np.float32]


def answers(
    model: Clone,
    n: int,
    inputs_of: Callable[[slice], State | Tensor],
    *,
    target_of: Callable[[slice], Target] | None = None,
    kicks_of: Callable[[slice], Tensor] | None = None,
    batch: int = BATCH,
) -> Iterator[tuple[slice, Answers]]:
    """Run a model over samples; it is put into evaluation mode.

    Args:
        n: number of samples.
        inputs_of: gives the state of some of them, or their projected inputs.
        target_of: gives the true commands; None where they are not known.
        kicks_of: gives which of the samples to answer on kicks and tackles, (k,) indices into the slice; None asks for
            those in which one was given.
        batch: samples per pass.
    """
    model.eval()
    device = next(model.parameters()).device
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
        yield (
            part,
            Answers(
                probabilities=point.logits.float().softmax(1).cpu().numpy(),
                parameters=point.parameters.float().cpu().numpy(),
                parameter_log_loss=log_loss,
            ),
        )
