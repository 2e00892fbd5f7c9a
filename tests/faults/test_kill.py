"""Commands killed at random moments (SIGKILL) and run again: the result is that of a run nobody killed.

Each test kills a few times by default; ``pytest tests/faults --kills 50`` takes its time (`make faults`).
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from command import TEAMCLONE, called, teamclone

FIXTURES = ("v6", "json", "native-v4", "native-v5", "oddname", "realtime")
MATCH = ("--team", "HELIOS_base", "--split", "rows")
SHORT = (
    "--preset",
    "small",
    "--set",
    "train.epochs=6",
    "--set",
    "data.batches_per_epoch=8",
    "--set",
    "model.hidden=[32]",
)
TIMES = ("samples_per_s", "seconds")


def killed_once(args: tuple[object, ...], *, within: float, chance: random.Random) -> bool:
    """Starts a command and kills it and its children somewhere in ``within`` seconds; whether it was still running."""
    process = subprocess.Popen(
        [TEAMCLONE, *map(str, args)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    time.sleep(chance.uniform(0, within))
    alive = process.poll() is None
    if alive:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return alive


def timed(work: Callable[[], object]) -> float:
    start = time.monotonic()
    work()
    return time.monotonic() - start


def digest(folder: Path, pattern: str) -> dict[str, str]:
    """A hash of every file below a folder, by its name."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob(pattern))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory, fixtures_dir: Path) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    for name in FIXTURES:
        shutil.copytree(fixtures_dir / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, logs: Path) -> Path:
    folder = tmp_path_factory.mktemp("store") / "store"
    called("ingest", logs, "--store", folder, "--jobs", 1)
    return folder


@pytest.fixture(scope="module")
def dataset(store: Path) -> Path:
    folder = store.with_name("dataset")
    called("dataset", "--store", store, *MATCH, "--out", folder, "--jobs", 1)
    return folder


def status_rows(store: Path) -> list[Any]:
    rows = [json.loads(path.read_text()) for path in sorted((store / "files").glob("*.json"))]
    return sorted((row["path"], row["outcome"], row["rows"], row["match_id"]) for row in rows)


def test_ingest(store: Path, logs: Path, tmp_path: Path, kills: int) -> None:
    chance = random.Random(1)
    usual = timed(lambda: teamclone("ingest", logs, "--store", tmp_path / "usual"))
    hits = 0
    for attempt in range(kills):
        folder = tmp_path / str(attempt)
        command = ("ingest", logs, "--store", folder)
        hits += killed_once(command, within=usual, chance=chance)
        called(*command, "--jobs", 1)
        assert digest(folder / "matches", "*.parquet") == digest(store / "matches", "*.parquet")
        assert status_rows(folder) == status_rows(store)
        counted = called("sql", "select count(*) n from matches", "--store", folder, "--json").stdout
        assert json.loads(counted) == [{"n": len(FIXTURES)}]
        shutil.rmtree(folder)
    assert hits >= max(1, kills // 3), "the kills came too late to say anything"


def test_dataset(store: Path, dataset: Path, tmp_path: Path, kills: int) -> None:
    chance = random.Random(3)
    usual = timed(lambda: teamclone("dataset", "--store", store, *MATCH, "--out", tmp_path / "usual"))
    hits = 0
    for attempt in range(kills):
        folder = tmp_path / str(attempt)
        command = ("dataset", "--store", store, *MATCH, "--out", folder)
        hits += killed_once(command, within=usual, chance=chance)
        if folder.exists():
            assert digest(folder, "*.npy") == digest(dataset, "*.npy"), "a dataset is whole or it is not there"
        called(*command, "--replace", "--jobs", 1)
        assert digest(folder, "*.npy") == digest(dataset, "*.npy")
        assert (
            json.loads((folder / "dataset.json").read_text())["id"]
            == (json.loads((dataset / "dataset.json").read_text())["id"])
        )
        shutil.rmtree(folder)
    assert hits >= max(1, kills // 3)


def figures(run: Path) -> list[dict[str, Any]]:
    """metrics.jsonl without what a clock says."""
    records = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    return [{name: value for name, value in record.items() if name not in TIMES} for record in records]


def test_train(dataset: Path, tmp_path: Path, kills: int) -> None:
    chance = random.Random(3)
    whole = tmp_path / "whole"
    usual = timed(lambda: teamclone("train", dataset, "--out", whole, *SHORT))
    hits = 0
    for attempt in range(kills):
        run = tmp_path / str(attempt)
        hits += killed_once(("train", dataset, "--out", run, *SHORT), within=usual, chance=chance)
        before = len(figures(run)) if (run / "metrics.jsonl").exists() else 0
        begun = (run / "config.toml").exists()
        called("train", dataset, "--out", run, *(("--resume",) if begun else SHORT))
        assert figures(run) == figures(whole)
        assert before <= len(figures(whole))
        assert digest(run / "checkpoints", "*") == digest(whole / "checkpoints", "*")
        shutil.rmtree(run)
    assert hits >= max(1, kills // 3)
