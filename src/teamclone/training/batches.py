"""The batches of a dataset for one model."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from teamclone.dataset.layout import CATEGORICAL_INDEX
from teamclone.dataset.reader import Dataset
from teamclone.models.clone import Clone
from teamclone.models.inputs.paper import PaperFeatures
from teamclone.training.gather import Gather
from teamclone.training.group import Group
from teamclone.world.channels import FLAG_ON_FIELD
from teamclone.world.mirror import mirror_places, mirror_target
from teamclone.world.state import Target

CARD_SHARE = 0.8
"""Of the free memory of a GPU, what the arrays of a dataset may take."""

MAKE_ROWS = 8192
"""Samples whose inputs are made at once; bounds memory."""
CACHE_ROWS = 1024
"""Samples at once on a processor, for inputs that are kept: the data of one step is still in its cache for the next."""
MEAN_ROWS = 2**17
"""Training samples that mean positions are taken over, evenly spread."""


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


class Batches:
    """Makes batches for a model.

    The paper's inputs are gathered by a compiled pass, one batch ahead. Others, which cost more to make than a training
    step, are made once for all samples and kept in memory, where they fit; else a thread makes them one batch ahead.
    So are the paper's where samples are mirrored, which the compiled pass does not know; a mirror image has the inputs
    of its sample with other signs, some in other columns. On a GPU the arrays of the dataset lie on the card if they
    fit there, and so do inputs that are kept; the paper's are made there.

    Args:
        cache_bytes: memory that inputs made once may take.
        rows: all samples that batches will be asked for.
        mirrored: samples by which players' counterparts are found, if batches will be asked for mirrored samples.
        on_progress: called with how many of them are made, and how many there are.
    """

    def __init__(
        self,
        dataset: Dataset,
        model: Clone,
        device: torch.device,
        group: Group,
        *,
        cache_bytes: float = 0.0,
        rows: NDArray[np.int64] | None = None,
        mirrored: NDArray[np.int64] | None = None,
        on_progress: Callable[[int, int], None] = lambda done, total: None,
    ) -> None:
        self.device, self.group, self.features, self.inputs = device, group, model.features, model.inputs
        self.on_card = device.type == "cuda" and dataset.nbytes < CARD_SHARE * torch.cuda.mem_get_info(device)[0]
        # Which columns change their place in the mirror, and with which.
        self.moved = self.order = torch.empty(0, dtype=torch.int64, device=device)
        if mirrored is not None:
            order = self.inputs.counterparts(counterparts(dataset, mirrored))
            self.moved = torch.nonzero(order != torch.arange(len(order))).squeeze(1).to(device)
            self.order = order.to(device)[self.moved]
        self.dataset = dataset.to(device) if self.on_card else dataset
        self.plain = type(model.features) is PaperFeatures
        # Kernels make the other inputs on the processor.
        self.source = self.dataset if self.plain else dataset
        self.quick = not self.on_card and self.plain and mirrored is None
        self._gather: Gather | None = None
        self._cache: _Cache | None = None
        if self.on_card:
            cache_bytes = min(cache_bytes, CARD_SHARE * torch.cuda.mem_get_info(device)[0])
        if not self.quick and rows is not None and 4 * len(self.inputs.names) * len(rows) <= cache_bytes:
            self._cache = self._filled(rows, on_progress)
        self.ahead = not self.on_card and (device.type != "cpu" or self._cache is None)

    def _filled(self, rows: NDArray[np.int64], on_progress: Callable[[int, int], None]) -> _Cache:
        where = self.device if self.on_card else torch.device("cpu")
        cache = _Cache(rows, n=len(self.dataset), columns=len(self.inputs.names), where=where)
        at_once = MAKE_ROWS if self.on_card and self.plain else CACHE_ROWS
        starts = range(0, len(rows), at_once)
        # Two threads even where one is asked for: one waits for memory while the other computes.
        with ThreadPoolExecutor(max(2, torch.get_num_threads())) as pool:
            parts = pool.map(self._made, [rows[start : start + at_once] for start in starts])
            for start, made in zip(starts, parts, strict=True):
                cache.columns[start : start + len(made)] = made
                on_progress(start + len(made), len(rows))
        return cache

    @torch.no_grad()
    def _made(self, rows: NDArray[np.int64] | Tensor) -> Tensor:
        """(rows, columns) inputs before normalisation, on the device."""
        rows = torch.as_tensor(rows).to(self.source.player_types.device)
        state = self.source.state(rows, history=self.inputs.history)
        return self.inputs.project(state.to(self.device) if self.plain else state).to(self.device)

    def _columns(self, rows: NDArray[np.int64] | Tensor) -> Tensor:
        """Return (rows, columns) inputs before normalisation, from the cache if it is on, on the device."""
        return self._made(rows) if self._cache is None else self._cache(rows).to(self.device)

    def columns(self, rows: NDArray[np.int64]) -> Iterator[Tensor]:
        """Inputs of samples before normalisation, in chunks, in the memory of the processor."""
        for start in range(0, len(rows), MAKE_ROWS):
            yield self._columns(rows[start : start + MAKE_ROWS]).cpu()

    def batches(
        self, rows: NDArray[np.int64], batch_size: int, *, mirrored: NDArray[np.bool_] | None = None
    ) -> Iterator[Batch]:
        """The samples in the order of ``rows``, cut into batches; the last may be shorter. The model is fitted.

        Args:
            mirrored: (len(rows),) which of them to mirror; None for none.
        """
        parts = [slice(start, start + batch_size) for start in range(0, len(rows), batch_size)]

        def mirrored_in(part: slice) -> NDArray[np.bool_] | None:
            return None if mirrored is None else mirrored[part]

        if not self.ahead:
            there = torch.from_numpy(rows).to(self.device)
            yield from (self._batch(there[part], mirrored_in(part)) for part in parts)
            return
        if self.quick and self._gather is None:
            self._gather = Gather(self.dataset, cast(PaperFeatures, self.features))
        with ThreadPoolExecutor(1) as pool:
            made = [pool.submit(self._batch, rows[part], mirrored_in(part)) for part in parts[:1]]
            for part in [*parts[1:], None]:
                inputs, target, whole = made.pop().result()
                if part is not None:
                    made = [pool.submit(self._batch, rows[part], mirrored_in(part))]
                yield Batch(inputs.to(self.device), target.to(self.device), whole.to(self.device))

    @torch.no_grad()
    def _batch(self, rows: NDArray[np.int64] | Tensor, mirrored: NDArray[np.bool_] | None = None) -> Batch:
        mine = slice(self.group.rank, None, self.group.size)
        share = rows[mine]
        target = self.dataset.target(share)
        whole = target.kind if self.group.size == 1 else self.dataset.target(rows).kind
        if self._gather is not None:
            return Batch(self._gather(np.asarray(share)), target, whole)
        if mirrored is None:
            return Batch(self.inputs.normalise(self._columns(share)), target, whole)
        turned = torch.from_numpy(mirrored[mine])[:, None]
        target = _where(turned, mirror_target(target, self.dataset.commands), target)
        turned = turned.to(self.device)
        columns = self._columns(share) * torch.where(turned, self.inputs.signs, 1.0)
        columns[:, self.moved] = torch.where(turned, columns[:, self.order], columns[:, self.moved])
        return Batch(self.inputs.normalise(columns), target, whole)


def _where(mask: Tensor, one: Target, other: Target) -> Target:
    """Return the commands of ``one`` where ``mask`` (batch, 1) is true, else those of ``other``; kinds are the same."""
    mask = mask.to(one.parameters.device)
    interval = other.interval
    if one.interval is not None and interval is not None:
        interval = torch.where(mask[..., None], one.interval, interval)
    return Target(other.kind, torch.where(mask, one.parameters, other.parameters), interval)


class _Cache:
    """Inputs of some of ``n`` samples before normalisation, (len(rows), columns), in the memory ``where``."""

    def __init__(self, rows: NDArray[np.int64], *, n: int, columns: int, where: torch.device) -> None:
        self.columns = torch.empty(len(rows), columns, device=where)
        self.place = torch.full((n,), -1, dtype=torch.int64, device=where)
        self.place[torch.from_numpy(rows).to(where)] = torch.arange(len(rows), device=where)

    def __call__(self, rows: NDArray[np.int64] | Tensor) -> Tensor:
        return self.columns[self.place[torch.as_tensor(rows, device=self.place.device)]]


def counterparts(dataset: Dataset, rows: NDArray[np.int64]) -> Tensor:
    """`mirror_places` of the players' mean positions in the frames of these samples."""
    frames = dataset.samples["frame"].numpy()[rows[:: max(1, len(rows) // MEAN_ROWS)]]
    position = dataset.frames["position"].numpy()[frames].astype(np.float64)
    there = (dataset.frames["categorical"].numpy()[frames, :, CATEGORICAL_INDEX["flags"]] & FLAG_ON_FIELD) != 0
    count = there.sum(0)[:, None]
    total = np.where(there[..., None], position, 0.0).sum(0)
    return mirror_places(np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0))
