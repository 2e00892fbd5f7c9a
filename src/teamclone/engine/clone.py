"""A clone without PyTorch: from frames to answers, by compiled kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.inputs.paper import project_paper
from teamclone.engine.inputs.project import Frames, project
from teamclone.engine.network.network import Network
from teamclone.engine.network.result import Answer
from teamclone.engine.network.spec import EGOCENTRIC, INPUTS
from teamclone.engine.network.weights import Weights


class CompiledClone:
    """A clone that answers without PyTorch. It has room for one answer: use it from one thread.

    Attributes:
        network: what answers to inputs; ``network.sample`` and ``network.likeliest`` are of the last answer.
    """

    def __init__(self, weights: Weights) -> None:
        self.network = Network(weights)
        self._inputs, self._columns = weights.inputs, int(weights.spec[INPUTS])

    @property
    def commands(self) -> tuple[str, ...]:
        """The command set, in the order of the answers."""
        return self.network.commands

    def inputs(
        self, frames: Frames, frame: NDArray[np.int64], actor: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Return (n, inputs) of samples before normalisation, and (n,) whose kicks and tackles are to be answered.

        Arguments are those of `inputs.project.project`.
        """
        family, *rest = self._inputs.tolist()
        if family == EGOCENTRIC:
            return project(frames, frame, actor, rest, self._columns)
        return project_paper(frames, frame, actor, rest, self._columns), np.ones(len(frame), np.bool_)

    def answers(
        self, frames: Frames, frame: NDArray[np.int64], actor: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Return (n, N_OUT) answers, whose parts ``network.view`` names, and (n,) who is near the ball."""
        packed, near = self.inputs(frames, frame, actor)
        return self.network.answers(packed, with_ball=near), near

    def answer(self, frames: Frames, actor: int, *, frame: int = 0) -> Answer:
        """Return the answer to one situation; each call fills its arrays anew."""
        packed, near = self.inputs(frames, np.array([frame]), np.array([actor]))
        made: Any = self.network.answer(packed[0], with_ball=bool(near[0]))
        return made
