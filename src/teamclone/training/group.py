"""Several processes that train one model together: each has a share of every batch, started by ``torchrun``."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

import torch
from torch import Tensor, distributed, nn

from teamclone.errors import TeamcloneError

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """This process among those that train together; by default it is alone.

    Losses of shares add up to the loss of the batch, see `loss.point_loss`, and so do their gradients. Hence sums, not
    the means of DistributedDataParallel, which are right only for shares of equal length.

    Attributes:
        rank: from 0; 0 is the one that writes.
        size: how many there are.
    """

    rank: int = 0
    size: int = 1

    def first(self, work: Callable[[], T]) -> T:
        """Return the result of ``work``, which only rank 0 does; the others wait. An error is raised in all of them."""
        if self.size == 1:
            return work()
        answer: list[T | TeamcloneError | None] = [None]
        if self.rank == 0:
            try:
                answer = [work()]
            except TeamcloneError as error:
                answer = [error]
        distributed.broadcast_object_list(answer)
        if isinstance(answer[0], TeamcloneError):
            raise answer[0]
        return answer[0]  # type: ignore[return-value]

    def add_up(self, *tensors: Tensor) -> None:
        """Replace each tensor by its sum over all processes."""
        if self.size > 1:
            for tensor in tensors:
                distributed.all_reduce(tensor)

    def add_up_gradients(self, model: nn.Module) -> None:
        """Replace the gradients of a model by their sums over all processes, in one message."""
        if self.size > 1:
            gradients = [weights.grad for weights in model.parameters() if weights.grad is not None]
            flat = torch.cat([gradient.reshape(-1) for gradient in gradients])
            distributed.all_reduce(flat)
            for gradient, part in zip(gradients, torch.split(flat, [part.numel() for part in gradients]), strict=True):
                gradient.copy_(part.view_as(gradient))

    def share_weights(self, model: nn.Module) -> None:
        """Give every process the weights and normalisation of rank 0."""
        if self.size > 1:
            for tensor in model.state_dict().values():
                distributed.broadcast(tensor, 0)


ALONE = Group()


def is_first() -> bool:
    """Return whether this process is the one that writes and prints."""
    return not distributed.is_torchelastic_launched() or os.environ["RANK"] == "0"


def local_rank() -> int:
    """Return the rank of this process among those on its machine, which is the number of its GPU."""
    return int(os.environ["LOCAL_RANK"]) if distributed.is_torchelastic_launched() else 0


@contextmanager
def joined(device: torch.device) -> Iterator[Group]:
    """Open the group of processes that ``torchrun`` started with this one; without it, of this one alone."""
    if not distributed.is_torchelastic_launched() or os.environ["WORLD_SIZE"] == "1":
        yield ALONE
        return
    # Optimisers import this. Imported while a group exists it keeps the group's threads to the end of the interpreter,
    # where they abort the process now and then.
    import torch._dynamo  # noqa: F401

    distributed.init_process_group("nccl" if device.type == "cuda" else "gloo")
    try:
        yield Group(rank=distributed.get_rank(), size=distributed.get_world_size())
    finally:
        distributed.destroy_process_group()
