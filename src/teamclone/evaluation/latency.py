"""Response times (Fig. 9 of the paper): single predictions on one thread, real situations."""

from __future__ import annotations

import datetime
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray

from teamclone import __version__
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.engine.clone import CompiledClone
from teamclone.engine.inputs.project import Frames
from teamclone.errors import DatasetError, RunError
from teamclone.models.clone import model_id
from teamclone.models.packing import pack
from teamclone.rcss.players import N_PLAYERS
from teamclone.system.documents import read_document, write_document
from teamclone.system.machine import processor
from teamclone.world.state import State

if TYPE_CHECKING:
    from teamclone.models.clone import Clone
    from teamclone.training.run import Run

FORMAT = 1
"""Format number of bench.json."""
N_PREDICTIONS = 20_000
WARM_UP = 200
N_STATES = 512
"""Number of different situations that the predictions take in turn."""


def measure_run(
    run: Run,
    *,
    dataset: Dataset | Path | str | None = None,
    checkpoint: str = "best-loss",
    n: int = N_PREDICTIONS,
    on_progress: Callable[[int, int], None] | None = None,
) -> tuple[dict[str, Any], Path]:
    """Time the predictions of a run, see `measure_latency`, and write RUN/bench.json.

    Args:
        run: the run.
        dataset: where the situations are from; None for the dataset that the run was trained on.
        checkpoint: which weights.
        n: number of single predictions.
        on_progress: called with predictions done and predictions in all.

    Returns:
        The times and their file.

    Raises:
        DatasetError: the dataset is missing, has no samples, or a match lacks what the model needs.
        RunError: there is no such checkpoint.
    """
    data = dataset if isinstance(dataset, Dataset) else open_dataset(dataset or run.dataset_path)
    bench = measure_latency(run.load_model(checkpoint), data, n=n, on_progress=on_progress)
    path = run.path / "bench.json"
    write_document(path, bench)
    return bench, path


def measure_latency(
    model: Clone,
    dataset: Dataset,
    *,
    n: int = N_PREDICTIONS,
    seed: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Time ``n`` predictions of one state each and of batches of 22, in microseconds, on one CPU thread.

    The time is that of a user's call: raw state in, probabilities and parameters out, with features and normalisation;
    without reading the state. Of PyTorch, and under ``kernels`` of `engine.clone.CompiledClone`.

    Raises:
        DatasetError: the dataset has no samples, or a match lacks what the model needs.
    """
    if not len(dataset):
        raise DatasetError(f"{dataset.path}: no samples to predict; build the dataset from more matches")
    rows = np.random.default_rng(seed).choice(len(dataset), N_STATES + N_PLAYERS)
    dataset.need(model.inputs.channels, rows, history=model.inputs.history)
    starts, history = range(N_STATES), model.inputs.history
    singles = [dataset.state(rows[start : start + 1], history=history) for start in starts]
    teams = [dataset.state(rows[start : start + N_PLAYERS], history=history) for start in starts]
    model = model.cpu().eval()
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        single = _times(model.predict, singles, n, on_progress)
        team = _times(model.predict, teams, max(n // 20, 20), None)
        clone = CompiledClone(pack(model))
        frames = [[_arrays(state) for state in states] for states in (singles, teams)]
        quick = [
            _times(lambda given: clone.answers(*given), given, count, None)
            for given, count in zip(frames, (n, max(n // 20, 20)), strict=True)
        ]
    finally:
        torch.set_num_threads(threads)
    top = float(np.quantile(single, 0.995))
    counts, edges = np.histogram(single[single <= top], bins=80)
    return {
        "format": FORMAT,
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "model_id": model_id(model),
        "versions": {"teamclone": __version__, "torch": torch.__version__, "numpy": np.__version__},
        "machine": {"processor": processor(), "system": platform.platform(terse=True), "threads": 1},
        "single": _summary(single),
        "team": {"states": N_PLAYERS, **_summary(team), "states_per_second": float(N_PLAYERS / np.mean(team) * 1e6)},
        "kernels": {"single": _summary(quick[0]), "team": {"states": N_PLAYERS, **_summary(quick[1])}},
        "histogram": {
            "edges_us": np.round(edges, 3).tolist(),
            "counts": counts.tolist(),
            "slower": int((single > top).sum()),
        },
    }


def _arrays(state: State) -> tuple[Frames, NDArray[np.int64], NDArray[np.int64]]:
    """Return a state as the kernels take it."""
    *frames, frame, actor = (part.numpy() for part in state)
    return Frames(*frames), frame, actor


def _times(
    answer: Callable[[Any], object], states: list[Any], n: int, on_progress: Callable[[int, int], None] | None
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    times = np.empty(n, np.float64)
    with torch.inference_mode():
        for index in range(min(WARM_UP, n)):
            answer(states[index % len(states)])
        for index in range(n):
            state = states[index % len(states)]
            start = time.perf_counter_ns()
            answer(state)
            times[index] = (time.perf_counter_ns() - start) / 1e3
            if on_progress is not None and (index + 1) % 500 == 0:
                on_progress(index + 1, n)
    return times


def _summary(times: np.ndarray[tuple[int], np.dtype[np.float64]]) -> dict[str, float]:
    return {
        "n": len(times),
        "mean_us": float(times.mean()),
        "std_us": float(times.std()),
        "p50_us": float(np.quantile(times, 0.5)),
        "p99_us": float(np.quantile(times, 0.99)),
        "max_us": float(times.max()),
    }


def load_bench(path: Path | str) -> dict[str, Any]:
    """Read bench.json back; raises as `read_document`."""
    shape = {"model_id": str}
    return read_document(
        Path(path), what="a benchmark", number=FORMAT, command="teamclone bench", error=RunError, shape=shape
    )
