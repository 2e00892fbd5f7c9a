"""Temperature scaling: the one number to divide logits by so that probabilities are honest (Guo et al. 2017)."""

from __future__ import annotations

import math
from functools import partial

import torch
from torch import Tensor

from teamclone.rcss.commands import CLONED
from teamclone.training.group import ALONE, Group

COLDEST, HOTTEST = 0.01, 100.0
"""Bounds of the temperature, for a model that is right or wrong about everything."""
STEPS = 30
"""Halvings of the interval between the bounds, which leave a hundred millionth of it."""


class Calibration:
    """Logits and commands of all samples seen so far, of this process's share of them."""

    def __init__(self, device: torch.device, commands: tuple[str, ...] = CLONED) -> None:
        self.logits = [torch.empty(0, len(commands), dtype=torch.float64, device=device)]
        self.kinds = [torch.empty(0, dtype=torch.int64, device=device)]

    def add(self, logits: Tensor, kind: Tensor) -> None:
        """Count one batch: (batch, commands) raw logits and (batch,) index into the commands."""
        self.logits.append(logits.detach().double())
        self.kinds.append(kind)

    def fit(self, group: Group = ALONE) -> tuple[float, float]:
        """Return the temperature with the least cross-entropy over the samples of all processes.

        The cross-entropy is convex in the inverse of it, so the only minimum is where the slope changes its sign.

        Returns:
            temperature; by how much it lowers the mean cross-entropy, in nats.
        """
        logits, kinds = torch.cat(self.logits), torch.cat(self.kinds)
        given = logits.gather(1, kinds[:, None]).squeeze(1)
        low, high = 1 / HOTTEST, 1 / COLDEST
        for _ in range(STEPS):
            inverse = math.sqrt(low * high)
            slope = ((torch.softmax(logits * inverse, 1) * logits).sum(1) - given).sum()
            group.add_up(slope)
            low, high = (low, inverse) if slope > 0 else (inverse, high)
        inverse = group.first(partial(math.sqrt, low * high))
        gains = torch.logsumexp(logits, 1) - given - torch.logsumexp(logits * inverse, 1) + given * inverse
        sums = torch.stack([gains.sum(), torch.ones_like(gains).sum()])
        group.add_up(sums)
        return 1 / inverse, float(sums[0] / sums[1])
