"""The command `similar`, from runs and a store to its page."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import teamclone as tc
from command import called
from compared import TEAM, made_store, samples, variant
from teamclone.dataset.build import DatasetConfig
from teamclone.errors import UsageError
from teamclone.evaluation.metrics import MOST_LOSS
from teamclone.logs import Match

HOSTILE = "<b>$x$"
"""A name of a team, which is anybody's."""
OTHER = "WEBase"
SETTINGS = (
    *("model.blocks=self,role,ball", "model.kick_blocks=self,ball", "model.target_points=2", "model.hidden=[32]"),
    *("model.target_hidden=8", "model.parameter_hidden=16", "model.kick_hidden=8", "model.kick_attention=0"),
    *("data.batch_size=512", "data.batches_per_epoch=60", "data.validation_batches=4", "train.epochs=2"),
    *("train.threads=1", "train.precision=fp32", "train.device=cpu", "train.schedule=constant"),
)


@pytest.fixture(scope="module")
def matches(samples_dir: Path) -> list[Match]:
    """Two of HELIOS_base against WEBase."""
    return samples(samples_dir, OTHER)


@pytest.fixture(scope="module")
def folder(matches: list[Match], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clone of either team, and a store of pieces of their matches, one against a team without a clone."""
    made = tmp_path_factory.mktemp("similar")
    learned = [variant(match, number) for match in matches for number in (0, 2, 4)]
    store = made_store(made / "learned", learned)
    for team in (TEAM, OTHER):
        config = DatasetConfig(teams=(team,), test_matches=(learned[0].match_id,), source="recovered")
        tc.build_dataset(config, store=store, out=made / f"{team} ds", jobs=1)
        tc.train(tc.load_config("best", SETTINGS), tc.open_dataset(made / f"{team} ds"), made / team)
    pieces = [variant(match, number) for match in matches for number in (1, 3)]
    made_store(made / "store", [*pieces, variant(matches[0], 5, opponent=HOSTILE)])
    return made


@pytest.fixture(scope="module")
def document(folder: Path) -> dict[str, Any]:
    done = called("similar", folder / "store", folder / TEAM, folder / OTHER, "--out", folder / "out")
    assert "clone of HELIOS_base" in done.stdout
    found: dict[str, Any] = json.loads((folder / "out" / "similar.json").read_text())
    return found


def test_losses_are_those_of_predictions(folder: Path, document: dict[str, Any]) -> None:
    store = tc.open_store(folder / "store")
    assert [one["team"] for one in document["teams"]] == [TEAM, OTHER, HOSTILE]
    assert [len(one["matches"]) for one in document["teams"]] == [4, 4, 1]
    row = document["teams"][1]
    for name, found in zip((TEAM, OTHER), row["loss"], strict=True):
        clone = tc.load(folder / name)
        tables = [clone.predict(match, team=OTHER, store=store).to_arrow() for match in row["matches"]]
        losses = np.concatenate([table["log_loss"].drop_null().to_numpy() for table in tables])
        assert len(losses) == row["commands"]
        assert found["value"] == pytest.approx(np.minimum(losses, MOST_LOSS).mean(), rel=1e-5)
        assert found["low"] <= found["value"] <= found["high"]


def test_each_team_is_predicted_best_by_its_own_clone(document: dict[str, Any]) -> None:
    for at, row in enumerate(document["teams"][:2]):
        assert int(np.argmin([one["value"] for one in row["loss"]])) == at
    assert document["distances"]["nats"][0][1] > 0.01
    assert document["guesses"][-1]["stretches"] == 8


def test_the_page_stands_alone_and_obeys_no_name(folder: Path, document: dict[str, Any]) -> None:
    page = (folder / "out" / "similar.html").read_text()
    assert "<script" not in page
    assert HOSTILE not in page
    assert "&lt;b&gt;$x$" in page
    assert not re.search(r'(?:href|src)="(?!#|data:)', page)
    for row in document["teams"]:
        assert all(f"{one['value']:.3f}" in page for one in row["loss"])


def test_an_unknown_log_is_of_the_team_that_plays_so(folder: Path, samples_dir: Path, tmp_path: Path) -> None:
    log = tmp_path / "anonymous.rcg.xz"
    shutil.copy(sorted(samples_dir.glob(f"*{OTHER}*.rcg.xz"))[1], log)
    options = ("--team", TEAM, "--most", 1, "--out", tmp_path / "out", "--json")
    found = json.loads(
        called("similar", folder / "store", folder / TEAM, folder / OTHER, "--log", log, *options).stdout
    )
    assert [(one["side"], one["name"], one["most_like"]) for one in found["logs"]] == [
        ("left", OTHER, OTHER),
        ("right", TEAM, TEAM),
    ]
    assert [len(one["matches"]) for one in found["teams"]] == [1]


def test_matches_that_a_clone_learned_from_are_left_out(folder: Path, matches: list[Match]) -> None:
    runs = [folder / TEAM, folder / OTHER]
    found = tc.similar(tc.open_store(folder / "learned"), runs).document
    assert [one["matches"] for one in found["teams"]] == [[variant(matches[0], 0).match_id]] * 2
    assert found["left_out"] == [f"{team}: its clone learned from 5 of 6 matches" for team in (TEAM, OTHER)]
    assert found["teams"][0]["loss"][0]["low"] is None


def test_a_damaged_match_does_not_stop_the_others(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "store", tmp_path / "store")
    store = tc.open_store(tmp_path / "store")
    broken = store.match_ids()[0]
    (tmp_path / "store" / "matches" / broken / "player_states.parquet").write_bytes(b"nothing")
    done = called("similar", tmp_path / "store", folder / TEAM, folder / OTHER, "--out", tmp_path / "out", code=1)
    assert broken in done.stderr
    found = json.loads((tmp_path / "out" / "similar.json").read_text())
    assert sum(len(one["matches"]) for one in found["teams"]) in {7, 8}


def test_what_does_not_fit_together_is_refused(folder: Path, tmp_path: Path) -> None:
    store = tc.open_store(folder / "store")
    both = [folder / TEAM, folder / OTHER]
    for runs, options, text in (
        (both[:1], {}, "expected the runs of at least two teams"),
        ([*both, both[0]], {}, "expected one clone of each team"),
        (both, {"teams": ["WEBas"]}, "no matches of 'WEBas'; did you mean WEBase"),
    ):
        with pytest.raises(UsageError, match=re.escape(text)):
            tc.similar(store, runs, **options)  # type: ignore[arg-type]
    made_store(tmp_path / "empty", [])
    with pytest.raises(UsageError, match="no match is left to predict"):
        tc.similar(tc.open_store(tmp_path / "empty"), both)
