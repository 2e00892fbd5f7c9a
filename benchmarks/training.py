"""How fast training is, beside the bare step in PyTorch on the same machine and in the same run.

    python benchmarks/training.py DS [--threads N] [--batches 240]

DS is a dataset. Rates are the best of several short stretches, because other work on the machine can only make one
slower; "CPU" is the processor time of all threads, waiting in a spin included, which other work does not change much.

The paper's own pipeline (rows of CSV text into Keras) is not measured here: it needs TensorFlow and 290 GB of text.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import torch

from teamclone.cli.common import print_table
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.models.clone import Clone
from teamclone.training.batches import Batches
from teamclone.training.config import load_config
from teamclone.training.group import ALONE
from teamclone.training.loop import train
from teamclone.training.setup import has_fast_bfloat16

BATCH = 4096
STRETCH = 3
"""Batches timed together."""
PAPER_TRAINED = 400 * 300 * BATCH
PAPER_VALIDATED = 400 * 200 * BATCH
CPU = torch.device("cpu")

Marks = list[tuple[float, float]]
"""Wall and processor seconds after each batch."""


def now() -> tuple[float, float]:
    return time.perf_counter(), time.process_time()


def best(marks: Marks) -> tuple[float, float]:
    """Samples a second and processor microseconds a sample, each of its best stretch."""
    stretches = [
        (after[0] - before[0], after[1] - before[1]) for before, after in zip(marks, marks[STRETCH:], strict=False)
    ]
    return STRETCH * BATCH / min(wall for wall, _ in stretches), min(
        cpu for _, cpu in stretches
    ) / STRETCH / BATCH * 1e6


def repeat(work: Callable[[], object], times: int) -> Marks:
    for _ in range(3):
        work()
    marks = [now()]
    for _ in range(times):
        work()
        marks.append(now())
    return marks


def consume(batches: Iterator[object]) -> Marks:
    return [now() for _ in batches]


def fitted(dataset: Dataset, rows: np.ndarray) -> Clone:
    model = Clone(load_config("paper").model)
    model.inputs.fit([model.inputs.project(dataset.state(rows[:BATCH]))])
    return model


def bare_step(dataset: Dataset, rows: np.ndarray, *, bfloat: bool) -> Callable[[], None]:
    """Forward, loss, backward and Adam as PyTorch has them, on inputs that lie ready."""
    model = fitted(dataset, rows)
    inputs, target = model.features(dataset.state(rows[:BATCH])), dataset.target(rows[:BATCH])
    optimiser = torch.optim.Adam(model.parameters(), lr=1e-3, eps=1e-7)

    def step() -> None:
        with torch.autocast("cpu", torch.bfloat16, enabled=bfloat):
            output = model.answer_inputs(inputs)
        loss = model.loss(output, target)
        optimiser.zero_grad(set_to_none=True)
        loss.total.backward()
        optimiser.step()

    return step


def products(dtype: torch.dtype) -> Callable[[], None]:
    """The matrix products of a step and nothing else: forward, for the weights, and for all inputs but the first."""
    widths = (119, 512, 256, 128, 10)
    layers = [
        (torch.randn(BATCH, a, dtype=dtype), torch.randn(b, a, dtype=dtype), torch.randn(BATCH, b, dtype=dtype))
        for a, b in pairwise(widths)
    ]

    def work() -> None:
        for index, (inputs, weights, gradient) in enumerate(layers):
            torch.mm(inputs, weights.t())
            torch.mm(gradient.t(), inputs)
            if index:
                torch.mm(gradient, weights)

    return work


def end_to_end(
    dataset: Dataset, *, precision: str, batches: int, threads: int, device: str = "cpu"
) -> tuple[Marks, float, float]:
    """A training by the command's own function: the marks of its batches, samples a second of its best epoch, and
    seconds of validation a sample."""
    marks: Marks = []
    config = load_config(
        "paper",
        [
            f"train.precision={precision}",
            f"train.threads={threads}",
            f"train.device={device}",
            "train.epochs=3",
            f"data.batches_per_epoch={batches // 3}",
            "data.validation_batches=40",
        ],
    )
    with tempfile.TemporaryDirectory() as folder:
        run = train(config, dataset, Path(folder) / "run", on_progress=lambda at: marks.append(now()))
        history = run.history()
    validating = min(record["seconds"] - record["samples"] / record["samples_per_s"] for record in history)
    return marks, max(record["samples_per_s"] for record in history), validating / (40 * BATCH)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--threads", type=int, default=torch.get_num_threads())
    parser.add_argument("--batches", type=int, default=240, help="batches of each measurement")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    dataset = open_dataset(options.dataset)
    rows = np.random.default_rng(0).permutation(dataset.split(Split.TRAIN))
    many = np.resize(rows, options.batches * BATCH)
    table: list[tuple[str, str, str, str, str]] = []

    def add(work: str, marks: Marks, *, reference: float = 0, name: str = "") -> float:
        rate, processor = best(marks)
        ratio = f"{rate / reference:.2f} x {name}" if reference else ""
        table.append((work, f"{rate:,.0f}", f"{processor:.2f}", ratio, f"{PAPER_TRAINED / rate / 60:.1f}"))
        print(f"{work}: {rate:,.0f} samples/s", flush=True)
        return rate

    model = fitted(dataset, rows)
    starts = range(0, len(many), BATCH)
    states = (model.features(dataset.state(many[start : start + BATCH])).detach() for start in starts)
    plain = add("raw states, then inputs from them", consume(states))
    feed = Batches(dataset, model, CPU, ALONE)
    add("feeding batches (gather alone)", consume(feed.batches(many, BATCH)), reference=plain, name="states")
    for precision, dtype in (("fp32", torch.float32), ("bf16", torch.bfloat16)):
        if precision == "bf16" and not has_fast_bfloat16(CPU):
            continue
        add(f"matrix products alone, {precision}", repeat(products(dtype), options.batches // 3))
        step = bare_step(dataset, rows, bfloat=precision == "bf16")
        bare = add(f"bare step, {precision}", repeat(step, options.batches // 3))
        marks, _, validating = end_to_end(
            dataset, precision=precision, batches=options.batches, threads=options.threads
        )
        rate = add(f"training end to end, {precision}", marks, reference=bare, name="bare step")
        minutes = (PAPER_TRAINED / rate + PAPER_VALIDATED * validating) / 60
        table.append((f"the same with the paper's validation, {precision}", "", "", "", f"{minutes:.1f}"))
    if torch.cuda.is_available():
        # The card works behind the host's back, so only whole epochs tell its rate.
        _, rate, validating = end_to_end(
            dataset, precision="bf16", batches=3 * options.batches, threads=options.threads, device="cuda"
        )
        minutes = (PAPER_TRAINED / rate + PAPER_VALIDATED * validating) / 60
        table.append((f"on {torch.cuda.get_device_name()}, bf16", f"{rate:,.0f}", "", "", f"{minutes:.1f}"))
    print_table(
        ("work", "samples/s", "CPU us a sample", "ratio", "min for 491.5 M"),
        table,
        title=f"{options.threads} threads, torch {torch.__version__}, {len(rows):,} training samples",
        numeric=(1, 2, 4),
    )


if __name__ == "__main__":
    main()
