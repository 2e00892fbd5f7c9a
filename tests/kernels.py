"""Compiles all kernels, as far as they are not on disk: the two large ones side by side, before tests need them.

Without it the workers of a clean clone compile the same kernels at the same time, each for itself.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from planned import plans_of
from situations import situations

FIXTURES = Path(__file__).resolve().parent / "data" / "fixtures"


def compile_inputs() -> None:
    from teamclone.models.clone import Clone
    from teamclone.models.config import EgocentricConfig
    from teamclone.planner.scene import COLUMNS, ROWS

    inputs, state = Clone(EgocentricConfig()).inputs, situations(3)
    inputs.project(situations(3, history=inputs.history))
    plans_of(np.zeros((3, ROWS, COLUMNS)), state.actor.numpy(), state.each().server.numpy())


def compile_network_and_readers() -> None:
    from teamclone.engine.network.draw import UNIFORMS
    from teamclone.engine.network.network import Network
    from teamclone.logs import read_match
    from teamclone.models.clone import Clone
    from teamclone.models.config import PaperConfig
    from teamclone.models.heads.candidates import candidates_of
    from teamclone.models.inputs.geometry import InputLayout
    from teamclone.models.packing import pack

    model = Clone(PaperConfig(hidden=(4,)))
    network = Network(pack(model))
    answers = network.answers(model.inputs.project(situations(3)).numpy())
    network.samples(answers, np.zeros((3, UNIFORMS)))
    layout = InputLayout(columns=0, others=True, plan=False)
    candidates_of(layout.unpack(torch.zeros(1, len(layout.tail))))
    for path in (FIXTURES / "v6").glob("*.rcg.gz"):
        read_match(path)


def main() -> None:
    tasks: tuple[Callable[[], None], ...] = (compile_inputs, compile_network_and_readers)
    workers = [multiprocessing.get_context("spawn").Process(target=task) for task in tasks]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    if any(worker.exitcode for worker in workers):
        raise SystemExit("a kernel does not compile, see above")


if __name__ == "__main__":
    main()
