"""Adapting a clone to another team, on made datasets of two teams that act by other rules."""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Callable
from contextlib import chdir
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file
from tests.synthetic import make_dataset

from teamclone.cli import main
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import DatasetError, RunError, UsageError
from teamclone.evaluation import metrics
from teamclone.evaluation.evaluate import evaluate
from teamclone.evaluation.predict import predict
from teamclone.models.clone import model_id
from teamclone.report.page import commands
from teamclone.training.adapt import SETTINGS, adaptation
from teamclone.training.config import load_config, override, to_table
from teamclone.training.loop import Progress, train
from teamclone.training.run import Run, create_run, open_run

SHORT = ("data.batch_size=64", "data.batches_per_epoch=3", "data.validation_batches=2", "train.epochs=3")
QUIET = ("train.threads=1", "train.precision=fp32", "train.device=cpu")
TIMES = ("seconds", "samples_per_s")


def other_team(folder: Path, *, frames_per_match: int, **changes: Any) -> Dataset:
    """Another team in like situations: kicks beyond x = 10 already, turns only far back."""
    plain = open_dataset(make_dataset(folder.with_name(f"{folder.name}-plain"), frames_per_match=frames_per_match))
    frame, player = plain.samples["frame"].long(), plain.samples["player"].long()
    x, y = plain.frames["position"][frame, player].numpy().T
    kind = np.select([x > 10, np.abs(y) > 28, x < -25], [2, 3, 1], 0)
    return open_dataset(make_dataset(folder, frames_per_match=frames_per_match, **{"samples/kind": kind, **changes}))


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A clone that has learned the usual rules, not quite well."""
    folder = tmp_path_factory.mktemp("base")
    dataset = open_dataset(make_dataset(folder / "ds", frames_per_match=600))
    config = load_config("small", ["data.batch_size=128", "train.epochs=5", "train.max_minutes=9", *QUIET])
    return train(config, dataset, folder / "run")


@pytest.fixture(scope="module")
def team(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return other_team(tmp_path_factory.mktemp("team") / "ds", frames_per_match=50)


def adapt(base: Run, dataset: Dataset, folder: Path, *overrides: str, **options: Any) -> Run:
    config, start = adaptation(base, [*SHORT, *overrides])
    return train(config, dataset, folder, base=start, **options)


def stop_at(epoch: int, batch: int) -> Callable[[Progress], None]:
    def report(at: Progress) -> None:
        if (at.epoch, at.batch) == (epoch, batch) and at.record is None:
            raise KeyboardInterrupt

    return report


def figures(run: Run) -> list[dict[str, Any]]:
    return [{key: value for key, value in record.items() if key not in TIMES} for record in run.history()]


def weights(run: Run) -> dict[str, bytes]:
    return {name: run.checkpoint_path(name).read_bytes() for name in (*run.checkpoints(), "resume")}


def cross_entropy(run: Run, checkpoint: str, dataset: Dataset) -> float:
    outcome = predict(run.load_model(checkpoint), dataset, dataset.split(Split.VALIDATION))
    return float(metrics.scores(metrics.measure(outcome)[1].total()).cross_entropy)


def test_it_knows_the_team_better_than_its_base_and_than_a_fresh_network(base: Run, tmp_path: Path) -> None:
    dataset = other_team(tmp_path / "ds", frames_per_match=60)
    config, start = adaptation(base, ["data.batch_size=64"])
    adapted = cross_entropy(train(config, dataset, tmp_path / "run", base=start), "best-loss", dataset)
    fresh = cross_entropy(train(config, dataset, tmp_path / "fresh"), "best-loss", dataset)
    assert adapted < 0.8 * cross_entropy(base, "best-loss", dataset)
    assert adapted < 0.9 * fresh


def test_the_settings_are_the_bases_but_for_those_of_adapting(base: Run) -> None:
    config, _ = adaptation(base, ["train.epochs=3", "data.batch_size=32"])
    assert config.model == base.config.model
    own = {"epochs": 3, "learning_rate": 5e-4, "schedule": "cosine", "max_minutes": 0.0}
    assert to_table(config)["train"] == to_table(base.config)["train"] | own
    own = {"batch_size": 32, "batches_per_epoch": 300}
    assert to_table(config)["data"] == to_table(base.config)["data"] | own


def test_it_begins_with_weights_and_normalisation_of_the_base(base: Run, team: Dataset, tmp_path: Path) -> None:
    run = adapt(base, team, tmp_path / "run")
    begun, best = (load_file(path) for path in (run.checkpoint_path("base"), base.checkpoint_path("best-loss")))
    assert all(torch.equal(begun[name], best[name]) for name in begun | best)
    assert torch.equal(
        run.load_model("last").features.normalisation.mean, base.load_model("best-loss").features.normalisation.mean
    )
    assert not torch.equal(load_file(run.checkpoint_path("last"))["trunk.0.weight"], best["trunk.0.weight"])
    assert run.environment["base"] == {
        "path": str(base.path),
        "checkpoint": "best-loss",
        "model_id": model_id(base.load_model("best-loss")),
        "team": "Made",
        "trained_on": [f"{int(Split.TRAIN):016x}"],
    }


@pytest.mark.parametrize(("epoch", "batch"), [(1, 1), (1, 3), (3, 2)])
def test_resumed_is_as_never_interrupted(base: Run, team: Dataset, tmp_path: Path, epoch: int, batch: int) -> None:
    """Without the base, which may be gone by then."""
    gone = open_run(shutil.copytree(base.path, tmp_path / "base"))
    whole = adapt(gone, team, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        adapt(gone, team, tmp_path / "run", on_progress=stop_at(epoch, batch))
    shutil.rmtree(gone.path)
    stopped = open_run(tmp_path / "run")
    assert len(stopped.history()) == epoch - 1
    resumed = train(stopped.config, team, tmp_path / "run", resume=True)
    assert figures(resumed) == figures(whole)
    assert weights(resumed) == weights(whole)


def test_relative_inputs_and_mixtures_are_adapted_too(team: Dataset, tmp_path: Path) -> None:
    small = (
        *("model.hidden=[16]", "model.target_hidden=[8]", "model.parameter_hidden=[8]", "model.kick_hidden=[8]"),
        *("model.extra_kicks=128", "train.epochs=1"),
    )
    first = train(load_config("best", [*SHORT, *QUIET, *small]), team, tmp_path / "base")
    run = adapt(first, team, tmp_path / "run", "train.epochs=1")
    assert weights(run)["base"] != weights(run)["last"]
    begun, best = (load_file(path) for path in (run.checkpoint_path("base"), first.checkpoint_path("best-loss")))
    assert all(torch.equal(begun[name], best[name]) for name in begun | best)
    # As many kicks to a sample as in the base, whose batches of 64 had 128.
    for changes, kicks in (((), 2048), (("data.batch_size=3",), 6), (("data.batch_size=3", "model.extra_kicks=5"), 5)):
        assert adaptation(first, changes)[0].model.extra_kicks == kicks


def test_the_temperature_of_the_base_is_not_kept(team: Dataset, tmp_path: Path) -> None:
    warm = train(load_config("small", [*SHORT, *QUIET, "train.calibrate=true"]), team, tmp_path / "warm")
    assert warm.load_model().head.temperature != 1
    assert adapt(warm, team, tmp_path / "off", "train.calibrate=false").load_model().head.temperature == 1
    run = adapt(warm, team, tmp_path / "on")
    assert run.load_model("last").head.temperature == pytest.approx(run.history()[-1]["temperature"])


def test_matches_that_a_base_learned_from_are_named(base: Run, tmp_path: Path) -> None:
    """Match 0 trained the base and tests the new team; the base of the base counts as well."""
    splits = np.roll(list(Split), 1)
    n = 20 * 10
    dataset = other_team(tmp_path / "ds", frames_per_match=20, **{"samples/split": np.repeat(splits, n)})
    run = adapt(base, dataset, tmp_path / "run")
    assert evaluate(run)["dataset"]["trained_on_before"] == ["0" * 16]
    assert run.environment["base"]["trained_on"] == ["0" * 16]
    again = adapt(run, dataset, tmp_path / "again")
    assert again.environment["base"]["trained_on"] == ["0" * 16, f"{1:016x}"]
    assert evaluate(again)["dataset"]["trained_on_before"] == ["0" * 16]
    shutil.rmtree(dataset.path)
    assert adaptation(run)[1].origin["trained_on"] is None


def test_the_report_tells_the_command(base: Run, team: Dataset, tmp_path: Path) -> None:
    run = adapt(base, team, tmp_path / "run")
    lines = commands(evaluate(run), trained_on=run.dataset_path)
    assert f"teamclone adapt {base.path} {team.path} --out {run.path}  # with the settings below" in lines


def test_what_cannot_be_adapted_is_told(base: Run, team: Dataset, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"model\.hidden, model\.family cannot be changed.*network of its base"):
        adaptation(base, ["train.epochs=2", "model.hidden=[16]", "model.family=egocentric"])
    with pytest.raises(UsageError, match=r"no setting 'train\.epoch'.*train\.epochs"):
        adaptation(base, ["train.epoch=2"])
    begun = create_run(tmp_path / "begun", base.config, team, device="cpu", precision="fp32")
    with pytest.raises(RunError, match=r"begun: no checkpoint 'best-loss'.*no epoch was finished"):
        adaptation(begun)
    damaged = open_run(shutil.copytree(base.path, tmp_path / "damaged"))
    damaged.checkpoint_path("best-loss").write_bytes(b"not weights")
    with pytest.raises(RunError, match=r"best-loss\.safetensors: not a checkpoint"):
        adaptation(damaged)
    with pytest.raises(RunError, match="already holds a run"):
        adapt(base, team, base.path)


@pytest.mark.parametrize("split", [Split.TRAIN, Split.VALIDATION])
def test_a_dataset_that_lacks_a_split_makes_no_run(base: Run, tmp_path: Path, split: Split) -> None:
    splits = np.repeat([Split.TEST if each is split else each for each in Split], 10 * 10)
    dataset = open_dataset(make_dataset(tmp_path / "ds", frames_per_match=10, **{"samples/split": splits}))
    with pytest.raises(DatasetError, match=f"no {'training' if split is Split.TRAIN else 'validation'} samples"):
        adapt(base, dataset, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_the_lost_beginning_of_an_interrupted_run_is_told(base: Run, team: Dataset, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        adapt(base, team, tmp_path / "run", on_progress=stop_at(1, 1))
    run = open_run(tmp_path / "run")
    run.checkpoint_path("base").unlink()
    with pytest.raises(RunError, match=r"base\.safetensors: no such checkpoint"):
        train(run.config, team, run.path, resume=True)


def test_the_command(
    base: Run,
    team: Dataset,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def teamclone(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["teamclone", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        output = capsys.readouterr()
        return int(end.value.code or 0), output.out, output.err

    run = tmp_path / "run"
    settings = [f"--set={text}" for text in SHORT]
    code, out, _ = teamclone("adapt", base.path, team.path, "--out", run, *settings, "--json")
    assert code == 0
    assert json.loads(out)["epochs"] == 3
    assert open_run(run).environment["base"]["path"] == str(base.path)
    code, out, _ = teamclone("train", team.path, "--out", run, "--resume", "--json")
    assert (code, json.loads(out)["epochs"]) == (0, 3)
    assert teamclone("evaluate", run, "--checkpoint", "base")[0] == 0
    code, _, error = teamclone("adapt", base.path, team.path, "--out", run, "--set", "model.hidden=[8]")
    assert code == 2
    assert "model.hidden cannot be changed" in error
    assert teamclone("adapt", tmp_path / "none", team.path, "--out", run)[0] == 1


def test_the_example_of_the_page_runs(
    base: Run, team: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (Path(__file__).parents[2] / "docs" / "reference" / "commands" / "adapt.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    shutil.copytree(base.path, tmp_path / "BASE")
    shutil.copytree(team.path, tmp_path / "DS")
    with chdir(tmp_path):
        exec(compile(code, "docs/reference/commands/adapt.md", "exec"), {})
    assert 0 <= float(capsys.readouterr().out) <= 1
    listed = dict(re.findall(r"^\| `((?:data|train)\.\w+)` \| `([^`]+)` \|", page, re.MULTILINE))
    assert listed.keys() == {text.partition("=")[0] for text in SETTINGS}
    config, _ = adaptation(base)
    assert override(config, [f"{key}={value}" for key, value in listed.items()]) == config
