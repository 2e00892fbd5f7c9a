"""What a network gets right, counted over batches: the figures of `metrics.jsonl`."""

from __future__ import annotations

import torch
from torch import Tensor

from teamclone.models.loss import LIMITS, Loss, issued, projected_parameters
from teamclone.models.network import Prediction
from teamclone.models.state import Target
from teamclone.rcss.commands import CLONED_KINDS

_N = len(CLONED_KINDS)


class Scores:
    """Sums over all samples seen so far. They stay on the device: no batch waits for a number."""

    def __init__(self, device: torch.device) -> None:
        self.sums = torch.zeros(6, dtype=torch.float64, device=device)
        self.confusion = torch.zeros(_N * _N, dtype=torch.int64, device=device)

    @torch.no_grad()
    def add(self, loss: Loss, prediction: Prediction, target: Target) -> None:
        """Count one batch."""
        mask = issued(target.kind)
        error = (prediction.parameters / LIMITS.to(mask.device) - projected_parameters(target)).abs()
        parts = (
            loss.cross_entropy * len(mask),
            loss.parameter_mse * len(mask),
            error.mean(1).sum(),
            (error * mask).sum(),
            mask.sum(),
            torch.tensor(len(mask), device=mask.device),
        )
        self.sums += torch.stack([part.detach().double() for part in parts])
        cells = target.kind * _N + prediction.logits.argmax(1)
        self.confusion += torch.bincount(cells, minlength=_N * _N)

    def table(self) -> dict[str, float]:
        """The figures; those of commands that never occurred are missing.

        ``loss``, ``cross_entropy``, ``parameter_mse``: means per sample, of the training error and its parts.
        ``accuracy``, ``recall_<command>``.
        ``parameter_mae``: the paper's, over all six outputs in [-1, 1] with zeros for those not issued.
        ``issued_mae``: the same over issued parameters only.
        """
        cross_entropy, mse, mae, issued_error, n_issued, n = self.sums.tolist()
        confusion = self.confusion.reshape(_N, _N).cpu()
        values = {
            "loss": (cross_entropy + mse) / n,
            "cross_entropy": cross_entropy / n,
            "parameter_mse": mse / n,
            "accuracy": int(confusion.trace()) / n,
            "parameter_mae": mae / n,
            "issued_mae": issued_error / n_issued,
        }
        return values | _recalls(confusion)


def _recalls(confusion: Tensor) -> dict[str, float]:
    """``recall_<command>`` from counts (true, predicted)."""
    return {
        f"recall_{kind.name.lower()}": int(row[index]) / int(row.sum())
        for index, (kind, row) in enumerate(zip(CLONED_KINDS, confusion, strict=True))
        if row.sum()
    }
