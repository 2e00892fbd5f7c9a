"""The batches of a dataset for one model."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from teamclone.dataset.reader import Dataset
from teamclone.models.features import PaperFeatures
from teamclone.models.network import Clone
from teamclone.models.state import Target
from teamclone.training.gather import Gather
from teamclone.training.group import Group

CARD_SHARE = 0.8
"""Of the free memory of a GPU, what the arrays of a dataset may take."""


class Batch(NamedTuple):
    """This process's share of a batch.

    Attributes:
        inputs: (share, columns) float32, the model's features, normalised.
        target: what the players did in these samples.
        whole: (batch,) int64, the commands of the whole batch, of which other processes have the other shares.
    """

    inputs: Tensor
    target: Target
    whole: Tensor


class Feed:
    """Makes batches for a model whose normalisation is fitted.

    On a processor a thread gathers the next batch while one is used. On a GPU the arrays of the dataset lie on the card
    if they fit there, and all that is done with them is done there.
    """

    def __init__(self, dataset: Dataset, model: Clone, device: torch.device, group: Group) -> None:
        self.device, self.group, self.features = device, group, model.features
        self.on_card = device.type == "cuda" and dataset.nbytes < CARD_SHARE * torch.cuda.mem_get_info(device)[0]
        self.dataset = dataset.to(device) if self.on_card else dataset
        quick = not self.on_card and type(model.features) is PaperFeatures
        self.gather = Gather(dataset, model.features) if quick else None

    def batches(self, rows: NDArray[np.int64], batch_size: int) -> Iterator[Batch]:
        """The samples in the order of ``rows``, cut into batches; the last may be shorter."""
        starts = range(0, len(rows), batch_size)
        if self.on_card:
            there = torch.from_numpy(rows).to(self.device)
            yield from (self._batch(there[start : start + batch_size]) for start in starts)
            return
        with ThreadPoolExecutor(1) as pool:
            ahead = pool.submit(self._batch, rows[:batch_size])
            for start in starts:
                inputs, target, whole = ahead.result()
                ahead = pool.submit(self._batch, rows[start + batch_size : start + 2 * batch_size])
                target = Target(*(tensor.to(self.device) for tensor in target))
                yield Batch(inputs.to(self.device), target, whole.to(self.device))

    @torch.no_grad()
    def _batch(self, rows: NDArray[np.int64] | Tensor) -> Batch:
        share = rows[self.group.rank :: self.group.size]
        inputs = self.gather(np.asarray(share)) if self.gather else self.features(self.dataset.state(share))
        target = self.dataset.target(share)
        return Batch(inputs, target, target.kind if self.group.size == 1 else self.dataset.target(rows).kind)
