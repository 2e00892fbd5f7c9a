"""`teamclone search` as its users run it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from multiprocessing import active_children
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.synthetic import make_dataset

from teamclone.cli import main
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import RunError
from teamclone.search.run import search
from teamclone.search.strategies import Study
from teamclone.search.trials import Mode, Search, SearchConfig, Status, open_search
from teamclone.training.config import load_config, override
from teamclone.training.loop import train
from teamclone.training.run import open_run

COMMAND = (sys.executable, "-c", "from teamclone.cli import main; main()", "search")
TINY = (
    "model.hidden=[16]",
    "data.batch_size=64",
    "data.batches_per_epoch=3",
    "data.validation_batches=4",
    "train.threads=1",
    "train.precision=fp32",
    "train.epochs=3",
)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return open_dataset(make_dataset(tmp_path_factory.mktemp("data") / "ds", frames_per_match=50))


def settings(mode: Mode, *overrides: str, **options: Any) -> SearchConfig:
    return SearchConfig(mode=mode, base=load_config("paper", [*TINY, *overrides]), **options)


def test_trials_are_normal_runs_and_a_search_goes_on(dataset: Dataset, tmp_path: Path) -> None:
    config = settings(Mode.BEAM, smallest=8, largest=16, beam=1, iterations=0)
    first = search(config, dataset, tmp_path / "s", jobs=2)
    assert [trial.status for trial in first.trials] == [Status.FINISHED] * 2
    for trial in first.trials:
        run = open_run(tmp_path / "s" / "trials" / trial.name)
        assert list(run.config.model.hidden) == trial.settings["model.hidden"]
        whole = train(run.config, dataset, tmp_path / trial.name)
        history = whole.history()
        assert trial.curve == [row["validation_accuracy"] for row in history]
        best = max(history, key=lambda row: row["validation_accuracy"])
        assert trial.figures["epoch"] == best["epoch"]
        assert trial.figures["cross_entropy"] == best["validation_cross_entropy"]
        assert trial.figures["weights"] == sum(weight.numel() for weight in whole.load_model().parameters())

    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "s" / "trials").rglob("metrics.jsonl")}
    again = search(replace(config, iterations=1), dataset, tmp_path / "s")
    assert again.trials[:2] == first.trials
    assert len(again.trials) > 2
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert open_search(tmp_path / "s") == again


def test_another_search_into_the_same_folder_is_refused(dataset: Dataset, tmp_path: Path) -> None:
    config = settings(Mode.BEAM, "train.epochs=1", start=((8,),), smallest=8, iterations=0)
    search(config, dataset, tmp_path / "s")
    other = open_dataset(make_dataset(tmp_path / "other", frames_per_match=20, seed=1))
    for changed, of, text in (
        (config, other, "give the same dataset or begin a new search"),
        (settings(Mode.OPTIMISERS), dataset, "mode: beam became optimisers"),
        (replace(config, beam=2), dataset, "beam: 3 became 2"),
        (replace(config, base=load_config("small")), dataset, "data.batch_size: 64 became 1024"),
    ):
        with pytest.raises(RunError, match=text):
            search(changed, of, tmp_path / "s")
    with pytest.raises(RunError, match="is no search and not an empty folder"):
        search(config, dataset, other.path)


def test_a_trial_that_fails_is_noted_and_tried_again(dataset: Dataset, tmp_path: Path) -> None:
    config = settings(Mode.BEAM, "train.epochs=10", smallest=8, largest=16, start=((8,), (16,), (8, 8)), iterations=0)
    taken = tmp_path / "s" / "trials" / "16" / "letter"

    def hinder(at: Search) -> None:
        """Have one trial find its folder taken, and kill the process of another."""
        if not taken.exists():
            taken.parent.mkdir(parents=True)
            taken.touch()
        if at.trials[0].status is Status.RUNNING and at.trials[0].curve:
            for child in active_children():
                child.kill()

    failed = {trial.name: trial for trial in search(config, dataset, tmp_path / "s", on_progress=hinder).trials}
    assert [trial.status for trial in failed.values()] == [Status.FAILED, Status.FAILED, Status.FINISHED]
    assert "its process ended with exit code -9" in str(failed["8"].error)
    assert "is not an empty folder" in str(failed["16"].error)

    taken.unlink()
    again = search(config, dataset, tmp_path / "s")
    assert {trial.status for trial in again.trials} == {Status.FINISHED}
    assert {trial.error for trial in again.trials} == {None}
    assert again.trials[2] == failed["8-8"]
    whole = train(open_run(tmp_path / "s" / "trials" / "8").config, dataset, tmp_path / "whole")
    assert again.trials[0].curve == [row["validation_accuracy"] for row in whole.history()]


def test_a_study_prunes_and_goes_on_as_if_never_stopped(dataset: Dataset, tmp_path: Path) -> None:
    config = settings(Mode.STUDY, "train.epochs=4", trials=9)
    part = search(replace(config, trials=7), dataset, tmp_path / "s")
    assert len(part.trials) == 7
    whole = search(config, dataset, tmp_path / "s").trials
    assert whole[:7] == part.trials
    assert [Study(config).propose(whole[:n])[0].settings for n in range(9)] == [trial.settings for trial in whole]
    pruned = [trial for trial in whole if trial.status is Status.PRUNED]
    assert pruned
    for trial in pruned:
        assert len(open_run(tmp_path / "s" / "trials" / trial.name).history()) == len(trial.curve) == 3
        assert Study(config).prunes(trial, whole[: whole.index(trial) + 1])


def test_a_trial_has_no_more_minutes_when_it_is_resumed(dataset: Dataset, tmp_path: Path) -> None:
    config = settings(Mode.BEAM, "train.epochs=100", smallest=8, start=((8,),), iterations=0)
    config = replace(config, base=override(config.base, ["train.max_minutes=1e-6"]))
    first = search(config, dataset, tmp_path / "s")
    assert len(first.trials[0].curve) == 1
    first.trials[0].status = Status.RUNNING  # as a kill before its end was written
    first.save()
    again = search(config, dataset, tmp_path / "s")
    assert len(open_run(tmp_path / "s" / "trials" / "8").history()) == 1
    assert again.trials[0].status is Status.FINISHED
    assert again.trials[0].figures == first.trials[0].figures


def wait_for_epochs(out: Path, epochs: int) -> None:
    deadline = time.monotonic() + 300
    while sum(path.read_bytes().count(b"\n") for path in out.glob("trials/*/metrics.jsonl")) < epochs:
        assert time.monotonic() < deadline, "the search does not get on"
        time.sleep(0.005)


@pytest.mark.parametrize("killed_by", [signal.SIGKILL, signal.SIGINT])
def test_a_killed_search_goes_on(dataset: Dataset, tmp_path: Path, killed_by: signal.Signals) -> None:
    config = settings(Mode.BEAM, "train.epochs=15", smallest=8, largest=16, iterations=0)
    options = ["--mode=beam", "--smallest=8", "--largest=16", "--iterations=0"]
    options += [f"--set={text}" for text in (*TINY[1:], "train.epochs=15")]
    process = subprocess.Popen(
        [*COMMAND, str(dataset.path), "--out", str(tmp_path / "s"), *options],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    wait_for_epochs(tmp_path / "s", 5)
    # A terminal's Ctrl-C comes to every process of the command; a kill to one.
    (os.killpg if killed_by == signal.SIGINT else os.kill)(process.pid, killed_by)
    _, errors = process.communicate(timeout=300)
    if killed_by == signal.SIGINT:
        assert process.returncode == 130
        assert "finished trials and epochs are kept in" in errors.splitlines()[-1]
        assert "Traceback" not in errors
        assert {trial.status for trial in open_search(tmp_path / "s").trials} <= {Status.WAITING, Status.FINISHED}
    base = override(config.base, ["model.hidden=[512,256,128]"])
    config = replace(config, base=base, held=tuple(sorted(text.partition("=")[0] for text in TINY[1:])))
    again = search(config, dataset, tmp_path / "s")
    for trial in again.trials:
        assert trial.status is Status.FINISHED
        whole = train(open_run(tmp_path / "s" / "trials" / trial.name).config, dataset, tmp_path / trial.name)
        assert trial.curve == [row["validation_accuracy"] for row in whole.history()]


Answer = tuple[int, str, str]


@pytest.fixture
def teamclone(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Answer]:
    """Runs the command in this process, which saves seconds of imports; gives exit code, stdout and stderr."""

    def run(*arguments: object) -> Answer:
        monkeypatch.setattr(sys, "argv", ["teamclone", "search", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        output = capsys.readouterr()
        return int(end.value.code or 0), output.out, output.err

    return run


@pytest.mark.parametrize(
    ("mode", "options", "trials"),
    [
        ("beam", ["--smallest=8", "--largest=8", "--iterations=1"], 2),
        ("study", ["--trials=2", "--objective=cross-entropy"], 2),
        ("optimisers", [], 9),
    ],
)
def test_reports_and_draws(
    *,
    dataset: Dataset,
    tmp_path: Path,
    teamclone: Callable[..., Answer],
    mode: str,
    options: list[str],
    trials: int,
) -> None:
    out = tmp_path / "s"
    tiny = [f"--set={text}" for text in (*TINY[1:], "train.epochs=1")]
    code, text, err = teamclone(dataset.path, "--out", out, "--mode", mode, *options, *tiny)
    assert code == 0
    assert len(err.splitlines()) == trials
    assert all(": finished after 1 epochs: accuracy " in line for line in err.splitlines())
    found = open_search(out)
    lines = text.splitlines()
    for place, trial in enumerate(found.ranked(), 1):
        line = next(line for line in lines if line.split()[:2] == [str(place), trial.name])
        for figure in ("accuracy", "cross_entropy", "loss"):
            assert f"{trial.figures[figure]:.4f}" in line
    drawn = (out / "search.svg").read_text()
    assert "<svg" in drawn
    for word in {
        "beam": ("validation accuracy, %", "weights", "the last beam"),
        "study": ("validation cross-entropy, nats", "best so far"),
        "optimisers": ("rmsprop", "adagrad", "learning rate"),
    }[mode]:
        assert word in drawn
    assert (out / "search.png").read_bytes().startswith(b"\x89PNG")

    code, text, err = teamclone(dataset.path, "--out", out, "--mode", mode, *options, *tiny, "--json")
    assert (code, err) == (0, "")
    answer = json.loads(text)
    assert [trial["name"] for trial in answer["trials"]] == [trial.name for trial in found.ranked()]
    assert answer["mode"] == mode
    assert all(open_run(trial["run"]).history() for trial in answer["trials"])


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["--mode", "beams"], 2, "--mode 'beams' is unknown, choose one of: beam, study, optimisers"),
        (["--mode", "beam", "--objective", "recall"], 2, "choose one of: accuracy, cross-entropy"),
        (["--mode", "beam", "--trials", 3], 2, "--mode beam has no --trials; leave it out"),
        (["--mode", "study", "--beam", 3, "--start", "64"], 2, "--mode study has no --beam, --start; leave it out"),
        (["--mode", "beam", "--start", "64,x"], 2, "--start: expected widths like 256,128, got '64,x'"),
        (["--mode", "beam", "--largest", 100], 2, "largest: expected a power of two, got 100"),
        (["--mode", "beam", "--set", "model.hidden=[64]"], 2, "the beam search chooses model.hidden"),
        (["--mode", "optimisers", "--set", "train.optimiser=adam"], 2, "chooses train.optimiser"),
        (["--mode", "study", "--set", "train.epoch=3"], 2, "did you mean train.epochs"),
        (["--mode", "study", "--preset", "papers"], 2, "no preset 'papers'; did you mean paper?"),
    ],
)
def test_mistakes_are_one_line(
    *,
    dataset: Dataset,
    tmp_path: Path,
    teamclone: Callable[..., Answer],
    arguments: list[object],
    code: int,
    text: str,
) -> None:
    got, out, err = teamclone(dataset.path, "--out", tmp_path / "s", *arguments)
    assert (got, out) == (code, "")
    assert len(err.splitlines()) == 1
    assert text in err
    assert list(tmp_path.iterdir()) == []


def test_a_search_of_which_nothing_came_fails(tmp_path: Path, teamclone: Callable[..., Answer]) -> None:
    whole = open_dataset(make_dataset(tmp_path / "ds", frames_per_match=5))
    path = make_dataset(tmp_path / "train", frames_per_match=5, **{"samples/split": np.full(len(whole), Split.TRAIN)})
    code, out, err = teamclone(path, "--out", tmp_path / "s", "--mode", "beam", "--smallest=8", "--largest=8")
    assert code == 1
    assert [line.split()[:3] for line in out.splitlines()[2:3]] == [["1", "8", "failed"]]
    assert "every trial failed, the first with: " in err.splitlines()[-1]
    assert "no validation samples" in err.splitlines()[-1]
    assert not (tmp_path / "s" / "search.svg").exists()
