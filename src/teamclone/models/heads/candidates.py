"""Candidates of a kick as components of its mixture: what physics says of each, scored by a small network."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from teamclone import planner
from teamclone.engine import network
from teamclone.engine.inputs import layout
from teamclone.engine.network.candidates import fill_candidates
from teamclone.engine.network.constants import (
    CANDIDATE_COLUMNS,
    CANDIDATE_REACH,
    IMPOSSIBLE,
    N_CANDIDATES,
    PASSES_TO_EACH,
    SHOT_YS,
)
from teamclone.models.inputs.geometry import Inputs
from teamclone.rcss import pitch
from teamclone.system import compiling
from teamclone.system.compiling import cached_kernel, tell_when_compiled, version_of


def _compiled() -> Any:
    """Return a kernel that fills the candidates of many situations."""
    version = version_of(network, layout, planner, pitch, compiling)

    @cached_kernel(nogil=True, error_model="numpy")
    def fill_all(
        geometry: NDArray[np.float32],
        others: NDArray[np.float32],
        wanted: NDArray[np.float32],
        columns: NDArray[np.float32],
    ) -> int:
        for index in range(len(geometry)):
            fill_candidates(geometry[index], others[index], wanted[index], columns[index])
        return version

    return fill_all


_fill_all = _compiled()
tell_when_compiled({_fill_all: "compiling the candidates of kicks, once (some seconds)"})


class Candidates(nn.Module):
    """Scores of candidates, see `engine.network.candidates`: their shares, and small corrections.

    Args:
        width: of the features of kicks. target_width: of the embedding of each pass target, 0 for none.
        hidden: width of the two layers that score a candidate.
    """

    def __init__(self, width: int, target_width: int, hidden: int, dropout: float) -> None:
        super().__init__()
        self.candidate = nn.Linear(CANDIDATE_COLUMNS, hidden)
        self.situation = nn.Linear(width, hidden)
        self.target = nn.Linear(target_width, hidden) if target_width else None
        self.between = nn.Linear(hidden, hidden)
        self.score = nn.Linear(hidden, 5)
        self.dropout = nn.Dropout(dropout)

    def forward(self, hidden: Tensor, inputs: Inputs, targets: Tensor | None) -> tuple[Tensor, Tensor, Tensor]:
        """Return logits, velocities of the ball and unbounded scales of the candidates.

        Args:
            hidden: (batch, width). inputs: with others. targets: (batch, TARGETS, target width), None for nothing.

        Returns:
            (batch, N_CANDIDATES), (batch, N_CANDIDATES, 2) metres per cycle, and (batch, N_CANDIDATES, 2) of power and
            angle.
        """
        wanted, columns = candidates_of(inputs)
        each = self.candidate(columns) + self.situation(hidden)[:, None]
        if self.target is not None and targets is not None:
            known = self.target(targets)
            known = torch.cat(
                [
                    known[:, :-1].repeat_interleave(PASSES_TO_EACH, 1),
                    known[:, -1:].expand(-1, len(SHOT_YS), -1),
                ],
                1,
            )
            each = each + functional.pad(known, (0, 0, 0, N_CANDIDATES - known.shape[1]))
        each = torch.relu(self.between(self.dropout(torch.relu(each))))
        logits, along, across, *scales = self.score(each).float().unbind(2)
        with torch.autocast(hidden.device.type, enabled=False):
            there, velocity = wanted[..., 0], wanted[..., 1:]
            forward = velocity / torch.sqrt(velocity.square().sum(2, keepdim=True) + 1e-6)
            sideways = torch.stack([-forward[..., 1], forward[..., 0]], 2)
            velocity = velocity + CANDIDATE_REACH * (along[..., None] * forward + across[..., None] * sideways)
            return torch.where(there > 0, logits, IMPOSSIBLE), velocity, torch.stack(scales, 2)


def candidates_of(inputs: Inputs) -> tuple[Tensor, Tensor]:
    """Return the candidates of kicks and what is known of them, made on the processor; see `fill_candidates`.

    Returns:
        (batch, N_CANDIDATES, 3) and (batch, N_CANDIDATES, CANDIDATE_COLUMNS).
    """
    make = _operation if torch.compiler.is_exporting() else _made
    wanted, columns = make(inputs.geometry, inputs.others)
    return wanted, columns


def _made(geometry: Tensor, others: Tensor) -> tuple[Tensor, Tensor]:
    n = len(geometry)
    wanted = np.empty((n, 3 * N_CANDIDATES), np.float32)
    columns = np.empty((n, N_CANDIDATES, CANDIDATE_COLUMNS), np.float32)
    if n:
        given = (
            np.ascontiguousarray(part.detach().float().cpu().reshape(n, -1).numpy()) for part in (geometry, others)
        )
        _fill_all(*given, wanted, columns)
    made = torch.from_numpy(wanted).view(n, N_CANDIDATES, 3), torch.from_numpy(columns)
    return made[0].to(geometry.device), made[1].to(geometry.device)


@torch.library.custom_op("teamclone::candidates", mutates_args=())
def _operation(geometry: Tensor, others: Tensor) -> tuple[Tensor, Tensor]:
    """The candidates as an operation of PyTorch, so that an exported model can contain them; see `_made`."""
    return _made(geometry, others)


@_operation.register_fake
def _(geometry: Tensor, others: Tensor) -> tuple[Tensor, Tensor]:
    n = geometry.shape[0]
    return geometry.new_empty(n, N_CANDIDATES, 3), geometry.new_empty(n, N_CANDIDATES, CANDIDATE_COLUMNS)
