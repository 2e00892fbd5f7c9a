"""What the inputs of the preset ``best`` cost: of all training samples, as training makes them, and of one answer.

    python benchmarks/inputs.py DATASET [--rows N]

Prints seconds of wall and of processor time, beside those of reading the same states, and of the network alone.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.models.clone import Clone
from teamclone.training.batches import CACHE_ROWS, Batches
from teamclone.training.config import load_config
from teamclone.training.group import Group

SINGLE = 2000
"""Answers to one state that are timed."""


def cost(work: Callable[[], object]) -> tuple[float, float]:
    """Return the seconds of wall and of processor time that some work takes."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - cpu


def read_all(data: Dataset, rows: NDArray[np.int64], history: int) -> None:
    """Read the states of all rows, as many at once as training does."""
    for start in range(0, len(rows), CACHE_ROWS):
        data.state(rows[start : start + CACHE_ROWS], history=history)


@torch.inference_mode()
def answer_all(model: Clone, inputs: torch.Tensor) -> None:
    """Answer all inputs, without kicks and tackles."""
    for part in inputs.split(CACHE_ROWS):
        model.answer_inputs(part, kick_rows=torch.empty(0, dtype=torch.int64))


@torch.inference_mode()
def single(model: Clone, data: Dataset, rows: NDArray[np.int64]) -> tuple[float, float]:
    """Return the microseconds of the inputs of one state, and of the network's answer to them, medians."""
    spent = []
    for row in rows:
        state = data.state(np.array([row]), history=model.inputs.history)
        began = time.perf_counter()
        inputs = model.features(state)
        between = time.perf_counter()
        model.answer_inputs(inputs).point()
        spent.append((between - began, time.perf_counter() - between))
    inputs_s, answer_s = np.median(np.array(spent), axis=0).tolist()
    return 1e6 * inputs_s, 1e6 * answer_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--rows", type=int, help="use so many training samples only")
    options = parser.parse_args()
    data, model = open_dataset(options.dataset), Clone(load_config("best").model).eval()
    rows = data.split(Split.TRAIN)[: options.rows]
    model.inputs.project(data.state(rows[:1], history=model.inputs.history))  # compiles
    batches: list[Batches] = []

    def make() -> None:
        batches.append(Batches(data, model, torch.device("cpu"), Group(), cache_bytes=1e12, rows=rows))

    made, read = cost(make), cost(lambda: read_all(data, rows, model.inputs.history))
    inputs = next(iter(batches[0].columns(rows[: min(len(rows), 8192)])))
    network = cost(lambda: answer_all(model, model.inputs.normalise(inputs)))
    scale = len(rows) / len(inputs)
    print(f"inputs of {len(rows):,} samples: {made[0]:.1f} s, {made[1]:.1f} s of processor time")
    print(f"  {made[1] / read[1]:.1f} x reading their states, {made[1] / (scale * network[1]):.2f} x the network")
    torch.set_num_threads(1)
    one, answer = single(model, data, np.random.default_rng(0).choice(rows, SINGLE))
    print(f"one state: inputs {one:.0f} us, {one / answer:.2f} x the network in PyTorch ({answer:.0f} us)")


if __name__ == "__main__":
    main()
