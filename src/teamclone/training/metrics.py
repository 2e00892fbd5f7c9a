"""Running figures of a network, counted over batches, for `metrics.jsonl`."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from teamclone.models.answer import Prediction
from teamclone.models.loss import Loss, given, parameter_layout, projected_parameters, unknown
from teamclone.rcss.commands import CLONED
from teamclone.training.group import ALONE, Group
from teamclone.world.state import Target


class RunningMetrics:
    """Sums over all samples seen so far. They stay on the device: no batch waits for a number."""

    def __init__(self, device: torch.device, commands: tuple[str, ...] = CLONED) -> None:
        self.commands = commands
        self.sums = torch.zeros(6, dtype=torch.float64, device=device)
        self.confusion = torch.zeros(len(commands) ** 2, dtype=torch.int64, device=device)

    @torch.no_grad()
    def add(self, loss: Loss, prediction: Prediction, target: Target, *, batch: int | None = None) -> None:
        """Count one batch, or a process's share of a ``batch`` of so many samples."""
        mask = given(target, self.commands)
        limits = parameter_layout(mask.device, self.commands)[0]
        error = (prediction.parameters / limits - projected_parameters(target, self.commands)).abs()
        if target.interval is not None:
            error = torch.where(unknown(target, self.commands), 0.0, error)
        n = len(mask) if batch is None else batch
        parts = (
            loss.total * n,
            loss.cross_entropy * n,
            loss.parameters * n,
            error.sum() / error.shape[1],
            (error * mask).sum(),
            mask.sum(),
        )
        self.sums += torch.stack([part.detach().double() for part in parts])
        cells = target.kind * len(self.commands) + prediction.logits.argmax(1)
        # Not bincount, for which a GPU has to tell the host how much there is to count.
        self.confusion.index_add_(0, cells, torch.ones_like(cells))

    def table(self, group: Group = ALONE) -> dict[str, float]:
        """Return the figures over all processes; those of commands that never occurred are missing.

        ``loss``, ``cross_entropy``, ``parameter_loss``: means per sample, of the training error and its parts.
        ``accuracy``, ``recall_<command>``.
        ``parameter_mae``: the paper's, over all outputs, by default six, in [-1, 1] with zeros for those not issued.
        ``issued_mae``: the same over issued parameters only.
        """
        group.add_up(self.sums, self.confusion)
        total, cross_entropy, of_parameters, mae, issued_error, n_issued = self.sums.tolist()
        confusion = self.confusion.reshape(len(self.commands), -1).cpu()
        n = int(confusion.sum())
        values = {
            "loss": total / n,
            "cross_entropy": cross_entropy / n,
            "parameter_loss": of_parameters / n,
            "accuracy": int(confusion.trace()) / n,
            "parameter_mae": mae / n,
            "issued_mae": issued_error / n_issued,
        }
        return values | _recalls(confusion, self.commands)


def _recalls(confusion: Tensor, commands: Sequence[str]) -> dict[str, float]:
    """Return ``recall_<command>`` from counts (true, predicted)."""
    return {
        f"recall_{name}": int(row[index]) / int(row.sum())
        for index, (name, row) in enumerate(zip(commands, confusion, strict=True))
        if row.sum()
    }
