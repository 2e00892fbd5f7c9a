"""The batches of a dataset for one model."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, cast

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

MAKE_ROWS = 8192
"""Samples whose inputs are made at once; bounds memory."""


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
    """Makes batches for a model.

    The paper's inputs are gathered by a compiled pass, one batch ahead. Others, which cost more to make than a training
    step, are made once for all samples and kept in memory, where they fit; else a thread makes them one batch ahead. On
    a GPU the arrays of the dataset lie on the card if they fit there, and all that is done with them is done there.

    Args:
        keep_bytes: how much memory kept inputs may take.
        rows: all samples that batches will be asked for.
        on_progress: told how many of them are made, and how many there are.
    """

    def __init__(
        self,
        dataset: Dataset,
        model: Clone,
        device: torch.device,
        group: Group,
        *,
        keep_bytes: float = 0.0,
        rows: NDArray[np.int64] | None = None,
        on_progress: Callable[[int, int], None] = lambda done, total: None,
    ) -> None:
        self.device, self.group, self.features, self.inputs = device, group, model.features, model.inputs
        self.on_card = device.type == "cuda" and dataset.nbytes < CARD_SHARE * torch.cuda.mem_get_info(device)[0]
        self.dataset = dataset.to(device) if self.on_card else dataset
        self.quick = not self.on_card and type(model.features) is PaperFeatures
        self._gather: Gather | None = None
        self.kept: Tensor | None = None
        columns = 4 * len(self.inputs.names)
        if rows is not None and not self.quick and len(rows) * columns <= keep_bytes:
            self.place = torch.full((len(dataset),), -1, dtype=torch.int64)
            self.place[torch.from_numpy(rows)] = torch.arange(len(rows))
            self.kept = torch.empty(len(rows), len(self.inputs.names))
            starts = range(0, len(rows), MAKE_ROWS)
            # Two threads even where one is asked for: one waits for memory while the other computes.
            with ThreadPoolExecutor(max(2, torch.get_num_threads())) as pool:
                made = pool.map(lambda start: self._made(rows[start : start + MAKE_ROWS]), starts)
                for start, part in zip(starts, made, strict=True):
                    self.kept[start : start + len(part)] = part
                    on_progress(start + len(part), len(rows))

    @torch.no_grad()
    def _made(self, rows: NDArray[np.int64] | Tensor) -> Tensor:
        """(rows, columns) inputs before normalisation."""
        if self.on_card:
            rows = torch.as_tensor(rows, device=self.device)
        return self.inputs.project(self.dataset.state(rows, history=self.inputs.history))

    def columns(self, rows: NDArray[np.int64]) -> Iterator[Tensor]:
        """Inputs of samples before normalisation, in chunks, in the memory of the processor."""
        for start in range(0, len(rows), MAKE_ROWS):
            part = rows[start : start + MAKE_ROWS]
            yield self.kept[self.place[torch.from_numpy(part)]] if self.kept is not None else self._made(part).cpu()

    def batches(self, rows: NDArray[np.int64], batch_size: int) -> Iterator[Batch]:
        """The samples in the order of ``rows``, cut into batches; the last may be shorter. The model is fitted."""
        starts = range(0, len(rows), batch_size)
        if self.on_card or self.kept is not None:
            there = torch.from_numpy(rows).to(self.device if self.on_card else "cpu")
            yield from (self._batch(there[start : start + batch_size]) for start in starts)
            return
        if self.quick and self._gather is None:
            self._gather = Gather(self.dataset, cast(PaperFeatures, self.features))
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
        if self._gather is not None:
            inputs = self._gather(np.asarray(share))
        else:
            columns = self.kept[self.place[torch.as_tensor(share)]] if self.kept is not None else self._made(share)
            inputs = self.inputs.normalise(columns)
        target = self.dataset.target(share)
        return Batch(inputs, target, target.kind if self.group.size == 1 else self.dataset.target(rows).kind)
