"""A folder of game logs without command logs, as most public ones are: from the logs to a clone and its figures."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from command import called

SMALL = (
    "--set=model.hidden=[32]",
    "--set=model.parameter_hidden=[32]",
    "--set=model.kick_hidden=[32]",
    "--set=model.target_hidden=[32]",
    "--set=data.batch_size=256",
    "--set=data.batches_per_epoch=20",
    "--set=data.validation_batches=8",
    "--set=model.extra_kicks=8",
    "--set=train.epochs=2",
    "--set=train.schedule=constant",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, samples_dir: Path) -> Path:
    made = tmp_path_factory.mktemp("alone")
    (made / "logs").mkdir()
    for log in sorted(samples_dir.glob("*.rcg.xz"))[:4]:
        shutil.copy(log, made / "logs")
    return made


def test_from_the_logs_to_figures(folder: Path) -> None:
    called("ingest", folder / "logs", "--store", folder / "store")
    assert called("matches", "--store", folder / "store").stdout.count("recovered") == 4
    options = ("dataset", "--store", folder / "store", "--team", "HELIOS_base", "--out")
    said = called(*options, folder / "dataset").stdout
    assert "rows are recovered: they are what game logs imply" in said
    called("train", folder / "dataset", *SMALL, "--out", folder / "run")
    found = json.loads(called("evaluate", folder / "run", "--json").stdout)
    test = found["splits"]["test"]
    assert test["model"]["accuracy"]["value"] > 0.7
    assert "kick_direction" in test["parameters"]
    called("rollout", folder / "run", folder / "logs", "--starts", 2, "--samples", 2, "--horizon", 5)


def test_logged_commands_alone_are_not_there(folder: Path) -> None:
    called("ingest", min((folder / "logs").iterdir()), "--store", folder / "other")
    said = called(
        *("dataset", "--store", folder / "other", "--team", "HELIOS_base", "--source", "logged"),
        *("--out", folder / "none"),
        code=1,
    ).stderr
    assert "no match has logged commands of HELIOS_base" in said
    assert said.count("\n") == 1
