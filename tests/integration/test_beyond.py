"""Goalkeepers, set plays and idle cycles, from real matches to the report."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.synthetic import make_dataset
from typer.testing import CliRunner

from teamclone.cli.app import app
from teamclone.dataset.build import DatasetConfig, build_dataset
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import DatasetError, UsageError
from teamclone.evaluation.evaluate import evaluate
from teamclone.logs import read_match
from teamclone.rcss.commands import CLONED, REPERTOIRE
from teamclone.report.page import make_report
from teamclone.search.run import search
from teamclone.search.trials import Mode, SearchConfig
from teamclone.store import create_store
from teamclone.training.adapt import adaptation
from teamclone.training.config import Config, load_config
from teamclone.training.loop import train
from teamclone.training.run import Run

ALL = f"model.commands={','.join(REPERTOIRE)}"
SMALL = (
    "model.hidden=[16]",
    "data.batch_size=128",
    "data.batches_per_epoch=4",
    "data.validation_batches=4",
    "train.epochs=2",
    "train.threads=1",
    "train.precision=fp32",
    "train.device=cpu",
)
MIXTURE = (
    *(
        "model.blocks=self,role,ball,mode",
        "model.kick_blocks=self,ball,mode",
        "model.target_points=2",
        "model.target_hidden=8",
    ),
    *("model.parameter_hidden=16", "model.kick_hidden=8", "data.mirror=0.5", "train.balance=oversample"),
)


def settings(*more: str) -> Config:
    return load_config("best", [*SMALL, *MIXTURE, ALL, *more])


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory, samples_dir: Path) -> Dataset:
    folder = tmp_path_factory.mktemp("beyond")
    store = create_store(folder / "store")
    for log in sorted(samples_dir.glob("*.rcg.xz"))[:4]:
        store.add(read_match(log))
    config = DatasetConfig(teams=("HELIOS_base",), goalkeepers=True, set_plays=True, idle=True)
    build_dataset(config, store=store, out=folder / "ds", jobs=1)
    return open_dataset(folder / "ds")


@pytest.fixture(scope="module")
def run(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Run:
    return train(settings(), dataset, tmp_path_factory.mktemp("trained") / "run")


def test_a_run_of_all_commands_resumes_bit_for_bit(dataset: Dataset, run: Run, tmp_path: Path) -> None:
    assert run.history()[-1]["validation_loss"] < run.history()[0]["validation_loss"]
    assert "validation_recall_move" in run.history()[-1]
    begun = train(settings("train.epochs=1", "train.schedule=constant"), dataset, tmp_path / "run")
    resumed = train(settings("train.schedule=constant"), dataset, begun.path, resume=True)
    whole = train(settings("train.schedule=constant"), dataset, tmp_path / "whole")
    for name in ("last", "resume"):
        assert resumed.checkpoint_path(name).read_bytes() == whole.checkpoint_path(name).read_bytes()


def test_evaluation_and_report_know_all_commands(dataset: Dataset, run: Run) -> None:
    document = json.loads(json.dumps(evaluate(run)))
    for section in document["splits"].values():
        assert tuple(section["commands"]) == REPERTOIRE
        assert [len(row) for row in section["confusion"]] == [7] * 7
        assert list(section["parameters"])[6:] == ["catch_direction", "move_x", "move_y"]
        assert section["parameters"]["move_x"]["unit"] == "m"
        assert section["commands"]["none"]["parameter_log_loss"]["value"] is None
        assert sum(row["rows"] for row in section["situations"].values()) <= section["rows"]
        play_on = section["situations"]["play_on"]
        assert 0 < play_on["rows"] < section["rows"]
    assert tuple(document["data"]["commands_by_split"]["train"]) == REPERTOIRE
    rows = dataset.split(Split.TEST)
    play_on_rows = int((dataset.mode(rows) == 3).sum())
    assert document["splits"]["test"]["situations"]["play_on"]["rows"] == play_on_rows
    text = make_report(run, quick_predictions=20).read_text()
    for words in ("</span>catch direction", "</span>move x", "own restart", "--goalkeepers", "--set-plays", "--idle"):
        assert words in text, words
    assert "var(--none)" in text
    printed = CliRunner().invoke(app, ["evaluate", str(run.path)])
    assert printed.exit_code == 0, printed.output
    assert "move x" in printed.output
    assert "their restart" in printed.output


def test_a_dataset_of_play_on_has_nothing_of_it(tmp_path: Path) -> None:
    made = open_dataset(make_dataset(tmp_path / "ds", frames_per_match=20))
    config = load_config("small", [*SMALL, "train.epochs=1"])
    trained = train(config, made, tmp_path / "run")
    document = evaluate(trained)
    assert all("situations" not in section for section in document["splits"].values())
    assert tuple(document["data"]["commands_by_split"]["train"]) == CLONED
    text = make_report(trained, quick_predictions=20).read_text()
    assert "own restart" not in text
    assert "var(--none)" not in text


@pytest.mark.parametrize(
    ("preset", "learning"),
    [
        ("small", ("data.batch_size=64", "train.epochs=10", "train.learning_rate=0.005")),
        ("best", ("data.batch_size=128", "train.epochs=3", "train.learning_rate=0.01")),
    ],
    ids=["small", "best"],
)
def test_further_commands_are_learned_from_made_matches(tmp_path: Path, preset: str, learning: tuple[str, ...]) -> None:
    made = open_dataset(make_dataset(tmp_path / "ds", frames_per_match=200, commands=REPERTOIRE))
    more = (*learning, "data.batches_per_epoch=99", "data.validation_batches=0", "train.schedule=constant")
    config = load_config(
        preset, [*SMALL, *(MIXTURE[:-2] if preset == "best" else ()), *more, ALL, "model.hidden=[64, 32]"]
    )
    record = train(config, made, tmp_path / "run").history()[-1]
    assert min(record[f"validation_recall_{name}"] for name in REPERTOIRE[4:]) > 0.25
    assert record["validation_accuracy"] > 0.6


def test_other_commands_than_the_datasets_are_refused(dataset: Dataset, run: Run, tmp_path: Path) -> None:
    with pytest.raises(
        UsageError, match=r"has the commands dash, .*, none, the model is for dash, turn, kick, tackle; add"
    ):
        train(load_config("small", SMALL), dataset, tmp_path / "run")
    wrong = CliRunner().invoke(app, ["train", str(dataset.path), "--out", str(tmp_path / "run")])
    assert isinstance(wrong.exception, UsageError)
    assert f"add --set {ALL}" in str(wrong.exception)
    assert not (tmp_path / "run").exists()
    plain = open_dataset(make_dataset(tmp_path / "plain", frames_per_match=10))
    with pytest.raises(
        DatasetError, match=r"the model answers with dash, .*, none; make the dataset with the options of"
    ):
        evaluate(run, dataset=plain)
    with pytest.raises(UsageError, match=r"add --set model\.commands=dash,turn,kick,tackle,catch,move,none"):
        search(SearchConfig(mode=Mode.BEAM, base=load_config("small", SMALL)), dataset, tmp_path / "search")
    config, base = adaptation(run)
    with pytest.raises(UsageError, match="make the dataset with the options of that of the base"):
        train(config, plain, tmp_path / "adapted", base=base)


def test_samples_of_all_commands(dataset: Dataset) -> None:
    kinds = dataset.samples["kind"].numpy()
    for name in ("move", "none"):
        assert (kinds == REPERTOIRE.index(name)).sum() > 20, name
    assert len(np.unique(dataset.state(np.arange(len(dataset))).mode)) > 5
