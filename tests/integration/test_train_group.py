"""Several processes under ``torchrun`` train what one process trains."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors.torch import load_file
from tests.synthetic import make_dataset

from teamclone.dataset.reader import open_dataset
from teamclone.training.config import load_config
from teamclone.training.loop import train
from teamclone.training.run import Run, open_run

# Batches of 61 in a slice of 500: shares of unequal length, and a last batch that is shorter still.
SETTINGS = (
    "model.hidden=[16]",
    "data.batch_size=61",
    "data.batches_per_epoch=9",
    "data.validation_batches=3",
    "train.epochs=2",
    "train.threads=1",
    "train.precision=fp32",
    "model.parameter_loss=masked",  # its mean is over what was issued, which differs between the shares
    "train.device=cpu",
)


# Relative inputs, of which half are mirrored, rare commands drawn more often, probabilities calibrated.
REMEDIES = (
    "model.family=egocentric-point",
    "model.target_points=0",
    "model.blocks=self,role,ball",
    "train.balance=oversample",
    "train.calibrate=true",
    "data.mirror=0.5",
)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_dataset(tmp_path_factory.mktemp("data") / "ds", frames_per_match=50)


LAUNCHER = (sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2")


def torchrun(dataset: Path, out: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return started(("-m", "teamclone", "train", str(dataset), "--out", str(out), *options))


def started(script: tuple[str, ...]) -> subprocess.CompletedProcess[str]:
    return subprocess.run((*LAUNCHER, *script), capture_output=True, text=True, timeout=1000, check=False)


def sets(*more: str) -> list[str]:
    return ["--preset=small", *(f"--set={setting}" for setting in (*SETTINGS, *more))]


def assert_same_but_for_rounding(one: Run, other: Run) -> None:
    for mine, theirs in zip(one.history(), other.history(), strict=True):
        figures = {key: value for key, value in mine.items() if key not in {"seconds", "samples_per_s"}}
        assert {key: theirs[key] for key in figures} == pytest.approx(figures, rel=1e-4)
    weights = load_file(one.checkpoint_path("last"))
    for name, tensor in load_file(other.checkpoint_path("last")).items():
        assert torch.allclose(tensor, weights[name], rtol=1e-3, atol=1e-5), name


def test_two_processes_train_what_one_trains_and_go_on_with_it(dataset: Path, tmp_path: Path) -> None:
    done = torchrun(dataset, tmp_path / "two", *sets(), "--json")
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout)  # of one process only
    assert answer["epochs"] == 2
    two = open_run(tmp_path / "two")
    assert two.environment["processes"] == 2
    one = train(load_config("small", SETTINGS), open_dataset(dataset), tmp_path / "one")
    assert_same_but_for_rounding(two, one)

    longer = "train.epochs=3"
    done = torchrun(dataset, one.path, "--resume", "--set", longer)
    assert done.returncode == 0, done.stderr
    train(load_config("small", [*SETTINGS, longer]), open_dataset(dataset), two.path, resume=True)
    assert len(one.history()) == 3
    assert_same_but_for_rounding(two, one)


def test_two_processes_agree_on_the_remedies(dataset: Path, tmp_path: Path) -> None:
    done = torchrun(dataset, tmp_path / "two", *sets(*REMEDIES))
    assert done.returncode == 0, done.stderr
    one = train(load_config("small", [*SETTINGS, *REMEDIES]), open_dataset(dataset), tmp_path / "one")
    assert "temperature" in one.history()[-1]
    assert_same_but_for_rounding(open_run(tmp_path / "two"), one)


def test_a_mistake_ends_all_processes_and_is_told_once(dataset: Path, tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "thesis.tex").touch()
    done = torchrun(dataset, tmp_path / "run", *sets())
    assert done.returncode != 0
    assert done.stderr.count("teamclone: ") == 1
    assert f"{tmp_path / 'run'}: is not an empty folder; choose another one" in done.stderr
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["thesis.tex"]


THREADS_LEFT = """
from pathlib import Path
import torch
from teamclone.training.group import joined
model = torch.nn.Linear(2, 2)
with joined(torch.device("cpu")) as group:
    torch.optim.Adam(model.parameters())
    group.add_up(torch.ones(2))
names = [path.read_text() for path in Path("/proc/self/task").glob("*/comm")]
assert not any("gloo" in name for name in names), names
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="needs Linux's list of threads")
def test_no_thread_of_the_group_outlives_it(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(THREADS_LEFT)
    done = started((str(tmp_path / "script.py"),))
    assert done.returncode == 0, done.stderr
