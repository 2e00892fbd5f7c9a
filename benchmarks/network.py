"""How long the compiled network of a run takes for an answer, and how far its answers are from PyTorch's.

    python benchmarks/network.py RUN DATASET [--states 10000]

Times are those of one thread, the network alone: from inputs before normalisation to a distribution of every parameter
and the single best one. "in a loop" is inside of a kernel, "one by one" a call from Python each. Each is the least of
many short runs, beside that of PyTorch for one situation. Differences are the greatest over the states.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from teamclone.dataset.reader import open_dataset
from teamclone.engine.network.network import Network
from teamclone.models.clone import Clone
from teamclone.models.heads.mixture import with_ball
from teamclone.models.packing import pack
from teamclone.rcss.commands import parameters_of
from teamclone.training.run import open_run

SHORT = 8
"""Situations of a short run: it is over before another process takes the core."""
REPEATS = 200


def microseconds(of: Callable[[], object]) -> float:
    """Least time of a situation in runs of SHORT."""
    of()
    best = math.inf
    for _ in range(REPEATS):
        start = time.perf_counter()
        of()
        best = min(best, time.perf_counter() - start)
    return 1e6 * best / SHORT


def times(model: Clone, network: Network, packed: Tensor, *, ball: bool) -> str:
    """The row of a table."""
    rows, flags = packed[:SHORT].numpy(), np.full(SHORT, ball)
    kicks = torch.arange(1 if ball else 0)

    def one_by_one() -> None:
        for row in rows:
            network.answer(row, with_ball=ball)

    def by_pytorch() -> None:
        for row in packed[:SHORT]:
            model.answer_inputs(model.inputs.normalise(row[None]), kick_rows=kicks).point()

    loop = microseconds(lambda: network.answers(rows, with_ball=flags))
    single = microseconds(one_by_one)
    theirs = microseconds(by_pytorch)
    return f"{loop:8.1f} us in a loop, {single:8.1f} us one by one, PyTorch {theirs:8.0f} us"


def differences(model: Clone, network: Network, packed: Tensor) -> tuple[float, float, NDArray[np.float64]]:
    """Greatest difference of probabilities and of logits, and (n, parameters) of parameters in their unit."""
    out = [network.view(row) for row in network.answers(packed.numpy())]
    answer = model.answer_inputs(model.inputs.normalise(packed))
    point = answer.point()
    probabilities = np.abs(np.stack([one.probabilities for one in out]) - answer.probabilities.numpy())
    logits = np.abs(np.stack([one.logits for one in out]) - point.logits.numpy())
    away = np.abs(np.stack([one.parameters for one in out]).astype(np.float64) - point.parameters.numpy())
    angle = [item.angle for item in parameters_of(network.commands)]
    away[:, angle] = np.minimum(away[:, angle], 360.0 - away[:, angle])
    return float(probabilities.max()), float(logits.max()), away


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--states", type=int, default=10_000)
    options = parser.parse_args()
    torch.set_num_threads(1)
    model, data = open_run(options.run).load_model().eval(), open_dataset(options.dataset)
    rows = np.linspace(0, len(data.samples["kind"]) - 1, options.states).astype(np.int64)
    start = time.process_time()
    network = Network(pack(model))
    network.answers(np.zeros((0, len(model.inputs.names)), np.float32))
    print(f"packed and compiled in {time.process_time() - start:.1f} s of processor time")
    with torch.inference_mode():
        packed = torch.cat(
            [model.inputs.project(data.state(part)) for part in np.array_split(rows, 1 + len(rows) // 500)]
        )
        kicks = with_ball(data.target(rows))
        for name, of, ball in (("off the ball", packed, False), ("with the ball", packed[kicks], True)):
            if len(of) >= SHORT:
                print(f"{name:14}{times(model, network, of, ball=ball)}")
        parts = [differences(model, network, part) for part in torch.split(packed, 500)]
    away = np.concatenate([part[2] for part in parts])
    print(f"{len(away):,} states: probabilities differ by {max(part[0] for part in parts):.1e} at most, logits by")
    print(f"{max(part[1] for part in parts):.1e}; parameters by at most, and by more than 0.01 in so many:")
    for index, item in enumerate(parameters_of(network.commands)):
        print(f"  {item.name:18}{away[:, index].max():10.1e} {item.unit:6}{int((away[:, index] > 0.01).sum()):6}")


if __name__ == "__main__":
    main()
