"""`teamclone train` as its users run it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from teamclone.training.config import preset_names, preset_text
from teamclone.training.run import open_run
from tests.synthetic import make_dataset

COMMAND = (sys.executable, "-c", "from teamclone.cli import main; main()", "train")
TINY = [
    f"--set={text}"
    for text in (
        "model.hidden=[16]",
        "data.batch_size=64",
        "data.batches_per_epoch=3",
        "train.threads=1",
        "train.precision=fp32",
    )
]


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_dataset(tmp_path_factory.mktemp("data") / "ds", frames_per_match=50)


def teamclone(*arguments: object) -> subprocess.CompletedProcess[str]:
    words = [str(argument) for argument in arguments]
    return subprocess.run([*COMMAND, *words], capture_output=True, text=True, check=False, timeout=120)


def start(*arguments: object) -> subprocess.Popen[str]:
    words = [str(argument) for argument in arguments]
    return subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_epochs(run: Path, epochs: int) -> None:
    metrics = run / "metrics.jsonl"
    deadline = time.monotonic() + 100
    while not (metrics.is_file() and metrics.read_bytes().count(b"\n") >= epochs):
        assert time.monotonic() < deadline, "training does not get on"
        time.sleep(0.005)


def test_trains_reports_and_resumes(dataset: Path, tmp_path: Path) -> None:
    result = teamclone(dataset, "--out", tmp_path / "run", *TINY, "--set", "train.epochs=2")
    assert result.returncode == 0, result.stderr
    assert "epoch 2/2: loss " in result.stderr
    assert "samples/s" in result.stderr
    for word in ("best-loss", "best-accuracy", "best-parameters", "validation_loss", "2 epochs"):
        assert word in result.stdout
    result = teamclone(dataset, "--out", tmp_path / "run", "--resume", "--set", "train.epochs=3", "--json")
    assert result.returncode == 0, result.stderr
    answer = json.loads(result.stdout)
    assert answer["epochs"] == 3
    assert answer["last"]["epoch"] == 3
    assert answer["best"]["best-loss"]["figure"] == "validation_loss"
    assert open_run(tmp_path / "run").config.train.epochs == 3


@pytest.mark.parametrize("killed_by", [signal.SIGKILL, signal.SIGINT])
def test_a_killed_run_goes_on_from_its_last_epoch(dataset: Path, tmp_path: Path, killed_by: signal.Signals) -> None:
    process = start(dataset, "--out", tmp_path / "run", *TINY, "--set", "train.epochs=100000")
    wait_for_epochs(tmp_path / "run", 5)
    os.kill(process.pid, killed_by)
    _, errors = process.communicate(timeout=60)
    if killed_by == signal.SIGINT:
        assert process.returncode == 130
        assert f"finished epochs are kept; go on with `teamclone train {dataset} --out" in errors.splitlines()[-1]
        assert "Traceback" not in errors
    seen = len(open_run(tmp_path / "run").history())
    epochs = f"train.epochs={seen + 2}"
    result = teamclone(dataset, "--out", tmp_path / "run", "--resume", "--set", epochs)
    assert result.returncode == 0, result.stderr
    assert teamclone(dataset, "--out", tmp_path / "whole", *TINY, "--set", epochs).returncode == 0
    resumed, whole = open_run(tmp_path / "run"), open_run(tmp_path / "whole")
    for name in (*whole.checkpoints(), "resume"):
        assert resumed.checkpoint_path(name).read_bytes() == whole.checkpoint_path(name).read_bytes(), name
    assert [record["validation_loss"] for record in resumed.history()] == [
        record["validation_loss"] for record in whole.history()
    ]


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["nowhere", "--out", "run"], 1, "nowhere: no such folder; make one with `teamclone dataset`"),
        (["nowhere", "--out", "run", "--set", "train.epoch=3"], 2, "did you mean train.epochs"),
        (["nowhere", "--out", "run", "--preset", "papers"], 2, "no preset 'papers'; did you mean paper?"),
        (["nowhere", "--out", "run", "--resume"], 1, "run: no such folder"),
        (["--show-preset", "pap"], 2, "did you mean paper?"),
    ],
)
def test_mistakes_are_one_line(tmp_path: Path, arguments: list[str], code: int, text: str) -> None:
    result = subprocess.run(
        [*COMMAND, *arguments], capture_output=True, text=True, check=False, timeout=60, cwd=tmp_path
    )
    assert result.returncode == code
    assert len(result.stderr.splitlines()) == 1
    assert text in result.stderr
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_shows_presets() -> None:
    for name in preset_names():
        assert teamclone("--show-preset", name).stdout == preset_text(name)
