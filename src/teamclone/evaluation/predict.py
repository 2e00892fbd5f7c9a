"""``predict``: a model's answers for samples of a dataset, beside the true commands."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray

from teamclone.dataset.reader import Dataset
from teamclone.evaluation.answers import BATCH, answers
from teamclone.evaluation.predictions import Predictions, issued_parameters
from teamclone.rcss.commands import parameters_of
from teamclone.world.state import State

if TYPE_CHECKING:
    from teamclone.models.clone import Clone


def predict(
    model: Clone,
    dataset: Dataset,
    rows: NDArray[np.int64],
    *,
    inputs: torch.Tensor | None = None,
    batch: int = BATCH,
    on_batch: Callable[[int], None] | None = None,
) -> Predictions:
    """Predict the commands of some samples of a dataset.

    Parameters of kicks and tackles are those of the samples in which one was given; no figure needs the others.

    Args:
        model: a clone; it is put into evaluation mode.
        dataset: where the samples lie.
        rows: (n,) indices of samples.
        inputs: (n, columns) projected inputs of these samples, where a caller has them; None computes them.
        batch: samples per pass.
        on_batch: called with the number of samples just done.

    Raises:
        DatasetError: a match lacks what the model needs.
    """
    dataset.need(model.inputs.channels, rows, history=model.inputs.history)

    def inputs_of(part: slice) -> State | torch.Tensor:
        return dataset.state(rows[part], history=model.inputs.history) if inputs is None else inputs[part]

    n, n_parameters = len(rows), len(parameters_of(dataset.commands))
    probabilities = np.empty((n, len(dataset.commands)), np.float32)
    parameters = np.empty((n, n_parameters), np.float32)
    log_loss = np.empty(n, np.float32)
    for part, answer in answers(model, n, inputs_of, target_of=lambda part: dataset.target(rows[part]), batch=batch):
        probabilities[part], parameters[part], log_loss[part], _ = answer
        if on_batch is not None:
            on_batch(part.stop - part.start)
    kind, issued, last = truth(dataset, rows)
    log_loss[np.isnan(issued).all(1)] = np.nan
    frame, actor = dataset.samples["frame"].numpy()[rows], dataset.samples["player"].numpy()[rows]
    return Predictions(
        probabilities=probabilities,
        parameters=parameters,
        parameter_log_loss=log_loss,
        kind=kind,
        issued=issued,
        last=last,
        match=dataset.match(rows).numpy(),
        position=dataset.frames["position"].numpy()[frame, actor],
        mode=dataset.mode(rows).numpy(),
        commands=dataset.commands,
    )


def truth(
    dataset: Dataset, rows: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.int64]]:
    """Return kind (n,), issued (n, parameters) and last (n,), see `Predictions`, of samples ``rows`` (n,)."""
    target = dataset.target(rows)
    kind, arguments, known = target.kind.numpy(), target.parameters.numpy(), target.known.numpy()
    issued = issued_parameters(kind, arguments, known, dataset.commands)
    return kind, issued, dataset.last_kind(rows).numpy()
