"""`teamclone train` as its users run it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import chdir
from pathlib import Path

import pytest
from tests.synthetic import make_dataset

from teamclone.cli import main
from teamclone.dataset.reader import open_dataset
from teamclone.training.config import override, preset_names, preset_text
from teamclone.training.loop import train
from teamclone.training.run import open_run

COMMAND = (sys.executable, "-c", "from teamclone.cli import main; main()", "train")
TINY = [
    "--preset=small",
    *(
        f"--set={text}"
        for text in (
            "model.hidden=[16]",
            "data.batch_size=64",
            "data.batches_per_epoch=3",
            "train.threads=1",
            "train.precision=fp32",
        )
    ),
]


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_dataset(tmp_path_factory.mktemp("data") / "ds", frames_per_match=50)


Answer = tuple[int, str, str]


@pytest.fixture
def teamclone(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Answer]:
    """Runs the command in this process, which saves seconds of imports; gives exit code, stdout and stderr."""

    def run(*arguments: object) -> Answer:
        monkeypatch.setattr(sys, "argv", ["teamclone", "train", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        output = capsys.readouterr()
        return int(end.value.code or 0), output.out, output.err

    return run


def start(*arguments: object) -> subprocess.Popen[str]:
    words = [str(argument) for argument in arguments]
    return subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_epochs(run: Path, epochs: int) -> None:
    metrics = run / "metrics.jsonl"
    deadline = time.monotonic() + 300
    while not (metrics.is_file() and metrics.read_bytes().count(b"\n") >= epochs):
        assert time.monotonic() < deadline, "training does not get on"
        time.sleep(0.005)


def test_trains_reports_and_resumes(dataset: Path, tmp_path: Path, teamclone: Callable[..., Answer]) -> None:
    code, out, err = teamclone(dataset, "--out", tmp_path / "run", *TINY, "--set", "train.epochs=2")
    assert code == 0
    assert "epoch 2/2: loss " in err
    assert "samples/s" in err
    for word in ("best-loss", "best-accuracy", "best-parameters", "validation_loss", "2 epochs"):
        assert word in out
    code, out, err = teamclone(dataset, "--out", tmp_path / "run", "--resume", "--set", "train.epochs=3", "--json")
    assert code == 0
    answer = json.loads(out)
    assert answer["epochs"] == 3
    assert answer["last"]["epoch"] == 3
    assert answer["best"]["best-loss"]["figure"] == "validation_loss"
    assert open_run(tmp_path / "run").config.train.epochs == 3
    # A setting of the paper's inputs, which the default preset does not have, says again what the run was made with.
    code, _, err = teamclone(
        *(dataset, "--out", tmp_path / "run", "--resume"),
        *("--set", "train.epochs=4", "--set", "model.own_type=false", "--set", "model.parameter_loss=masked"),
    )
    assert code == 1
    assert "cannot resume with other settings (model.parameter_loss: paper became masked)" in err


@pytest.mark.parametrize("killed_by", [signal.SIGKILL, signal.SIGINT])
def test_a_killed_run_goes_on_from_its_last_epoch(dataset: Path, tmp_path: Path, killed_by: signal.Signals) -> None:
    process = start(dataset, "--out", tmp_path / "run", *TINY, "--set", "train.epochs=100000")
    wait_for_epochs(tmp_path / "run", 5)
    os.kill(process.pid, killed_by)
    _, errors = process.communicate(timeout=300)
    if killed_by == signal.SIGINT:
        assert process.returncode == 130
        assert f"finished epochs are kept; go on with `teamclone train {dataset} --out" in errors.splitlines()[-1]
        assert "Traceback" not in errors
    killed = open_run(tmp_path / "run")
    config = override(killed.config, [f"train.epochs={len(killed.history()) + 2}"])
    resumed = train(config, open_dataset(dataset), killed.path, resume=True)
    whole = train(config, open_dataset(dataset), tmp_path / "whole")
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
def test_mistakes_are_one_line(
    tmp_path: Path, teamclone: Callable[..., Answer], arguments: list[str], code: int, text: str
) -> None:
    with chdir(tmp_path):
        got, out, err = teamclone(*arguments)
    assert got == code
    assert len(err.splitlines()) == 1
    assert text in err
    assert out == ""
    assert list(tmp_path.iterdir()) == []


def test_a_wrong_setting_is_told_without_loading_pytorch() -> None:
    program = (
        "import sys; from teamclone.training.config import load_config; load_config('paper', ['train.epochs=3']); "
        "sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_shows_presets(teamclone: Callable[..., Answer]) -> None:
    for name in preset_names():
        assert teamclone("--show-preset", name)[:2] == (0, preset_text(name))
