"""How near the exported header is to PyTorch, and how long one answer takes.

    python benchmarks/export.py RUN [--states 10000] [--compiler g++]

Prints the largest differences, and microseconds of an answer from the raw state: of the compiled header, of the kernels
in Python, and of PyTorch in the same run, each away from the ball and near it.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from teamclone.engine.clone import CompiledClone
from teamclone.engine.inputs.project import Frames
from teamclone.engine.network.weights import write_weights
from teamclone.export.contract import (
    HEADER,
    WEIGHTS,
    Arrays,
    compared,
    compiled_answers,
    pytorch_answers,
    samples_of,
    state_of,
)
from teamclone.export.header import header
from teamclone.models.clone import Clone
from teamclone.models.packing import pack
from teamclone.training.run import open_run

SINGLE, WARM_UP, REPEATS = 2000, 100, 3


def timed(answer: Callable[[int], object], n: int) -> NDArray[np.float64]:
    """Return (n,) microseconds of answers to states 0, 1, ..."""
    for index in range(WARM_UP):
        answer(index % n)
    times = np.empty(n)
    for index in range(n):
        start = time.perf_counter_ns()
        answer(index)
        times[index] = (time.perf_counter_ns() - start) / 1e3
    return times


def in_python(model: Clone, samples: Arrays, n: int) -> dict[str, NDArray[np.float64]]:
    """Return (n,) microseconds of single answers, by PyTorch and by the kernels."""
    torch.set_num_threads(1)
    states = [state_of({name: values[row : row + 1] for name, values in samples.items()}) for row in range(n)]
    clone = CompiledClone(pack(model))
    frames = [Frames(*(part.numpy() for part in state[:9])) for state in states]
    with torch.inference_mode():
        pytorch = timed(lambda row: model.answer(states[row]).point(), n)
    return {
        "PyTorch": pytorch,
        "kernels in Python": timed(lambda row: clone.answer(frames[row], int(samples["actor"][row])), n),
    }


def line(name: str, times: NDArray[np.float64], near: NDArray[np.bool_], reference: float) -> str:
    """Return the line of one way to answer."""
    parts = []
    for where, some in (("off the ball", times[~near]), ("at the ball", times[near])):
        p50, p999 = np.quantile(some, [0.5, 0.999])
        parts.append(f"{where} {p50:,.0f} / {p999:,.0f} us")
    return f"{name:18} {', '.join(parts)}; off the ball {np.median(times[~near]) / reference:.3f} x PyTorch"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--states", type=int, default=10_000)
    parser.add_argument("--compiler", default="g++")
    options = parser.parse_args()
    run = open_run(options.run)
    model = run.load_model("best-loss").cpu().eval()
    samples = samples_of(run, model, options.states)
    expected = pytorch_answers(model, samples)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / HEADER).write_text(header(), encoding="utf-8")
        write_weights(folder / WEIGHTS, pack(model))
        made, micros = compiled_answers(folder, samples, options.compiler, repeats=REPEATS)
    found = compared(made, expected, micros)
    near = expected["near"] > 0
    print(f"{found.n:,} states: probabilities differ by at most {found.probability:.1e}, numbers by {found.number:.1e}")
    print(f"{found.apart} states have another number, as good as PyTorch's to the last digits")
    n = min(SINGLE, len(near))
    times = in_python(model, samples, n)
    reference = float(np.median(times["PyTorch"][~near[:n]]))
    print("microseconds of an answer, p50 / p99.9:")
    print(line("compiled header", micros, near, reference))
    for name, values in times.items():
        print(line(name, values, near[:n], reference))


if __name__ == "__main__":
    main()
