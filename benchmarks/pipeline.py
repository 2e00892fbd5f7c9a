"""How fast each stage is, as a ratio to a reference measured in the same run.

    python benchmarks/pipeline.py MATCHES [--team NAME]

MATCHES is a folder of logs. Each stage works on all of them; references are what nobody can go below (inflating the
files, the bare training step on data that lies ready).
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import torch

from teamclone.cli.common import print_table
from teamclone.dataset.build import DatasetConfig, build_dataset
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.logs import LogPair, find_matches, read_pair
from teamclone.logs.open import read_bytes
from teamclone.models.network import Clone
from teamclone.store import create_store, ingest
from teamclone.training.config import load_config
from teamclone.training.loop import has_fast_bfloat16, train

BATCH = 4096
STEPS = 40


def seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def inflate(pairs: list[LogPair]) -> None:
    for pair in pairs:
        for path in (pair.rcg, pair.rcl):
            if path is not None:
                read_bytes(path)


def read(pairs: list[LogPair]) -> None:
    for pair in pairs:
        read_pair(pair)


def step_rate(dataset: Dataset, *, bfloat: bool) -> float:
    """Samples a second of forward, loss, backward and Adam on one batch that lies ready."""
    rows = dataset.split(Split.TRAIN)[:BATCH]
    state, target = dataset.state(rows), dataset.target(rows)
    model = Clone(load_config("paper", []).model)
    optimiser = torch.optim.Adam(model.parameters(), lr=1e-3)

    def steps(n: int) -> None:
        for _ in range(n):
            with torch.autocast("cpu", torch.bfloat16, enabled=bfloat):
                output = model.output(state)
            loss = model.head.loss(output, target)
            optimiser.zero_grad(set_to_none=True)
            loss.total.backward()
            optimiser.step()

    steps(5)
    return STEPS * len(rows) / seconds(lambda: steps(STEPS))


def gather_rate(dataset: Dataset) -> float:
    """Samples a second that reach the model as batches."""
    rows = dataset.split(Split.TRAIN)
    rows = rows[torch.randperm(len(rows), generator=torch.Generator().manual_seed(0)).numpy()]
    parts = [rows[start : start + BATCH] for start in range(0, min(len(rows), STEPS * BATCH), BATCH)]

    def gather() -> None:
        for part in parts:
            dataset.state(part)
            dataset.target(part)

    gather()
    return sum(map(len, parts)) / seconds(gather)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("matches", type=Path)
    parser.add_argument("--team")
    options = parser.parse_args()
    pairs = find_matches([options.matches])
    read(pairs[:1])  # compiles the scanner
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        inflating = seconds(lambda: inflate(pairs))
        reading = seconds(lambda: read(pairs))
        n = len(pairs)
        rows.append(("inflate the logs", f"{inflating / n:.3f} s a match", "1.00", ""))
        rows.append(
            ("read to columns, one core", f"{reading / n:.3f} s a match", f"{reading / inflating:.2f}", "inflate")
        )
        store = create_store(Path(folder) / "store")
        ingesting = seconds(lambda: ingest([options.matches], store))
        rows.append(
            ("ingest, all cores", f"{ingesting / n:.3f} s a match", f"{ingesting / inflating:.2f}", "inflate, one core")
        )
        teams: Counter[str] = Counter()
        for match in store.matches().to_pylist():
            teams.update(name for name in (match["left_name"], match["right_name"]) if name)
        team = options.team or teams.most_common(1)[0][0]
        out = Path(folder) / "dataset"
        building = seconds(lambda: build_dataset(DatasetConfig(team=team), store=store, out=out))
        rows.append(("dataset", f"{building / n:.3f} s a match", f"{building / inflating:.2f}", "inflate"))
        dataset = open_dataset(out)
        size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file()) / len(dataset.matches)
        rows.append(("dataset on disk", f"{size / 1e6:.2f} MB a match", "", ""))
        bfloat = has_fast_bfloat16(torch.device("cpu"))
        bare = step_rate(dataset, bfloat=bfloat)
        gathering = gather_rate(dataset)
        run = train(
            load_config("paper", ["train.epochs=3", f"data.batches_per_epoch={STEPS}"]), dataset, Path(folder) / "run"
        )
        whole = run.history()[-1]["samples_per_s"]
        precision = "bf16" if bfloat else "fp32"
        rows.append((f"training step, {precision}", f"{bare:,.0f} samples/s", "1.00", ""))
        if bfloat:
            single = step_rate(dataset, bfloat=False)
            rows.append(("training step, fp32", f"{single:,.0f} samples/s", f"{single / bare:.2f}", "step, bf16"))
        rows.append(("batches", f"{gathering:,.0f} samples/s", f"{gathering / bare:.2f}", f"step, {precision}"))
        rows.append(("training, end to end", f"{whole:,.0f} samples/s", f"{whole / bare:.2f}", f"step, {precision}"))
    print_table(
        ("work", "figure", "ratio", "to"),
        rows,
        title=f"{n} matches, {torch.get_num_threads()} threads, torch {torch.__version__}",
        numeric=(1, 2),
    )


if __name__ == "__main__":
    main()
