"""Predictions of whole matches: from a log, a match and a store, in Python and as a command."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import teamclone as tc
from teamclone.cli.app import app
from teamclone.dataset import layout
from teamclone.evaluation import prediction_table
from teamclone.evaluation.predict import predict
from teamclone.store import Store
from teamclone.training.config import load_config
from teamclone.world.view import view_columns
from teamclone.world.world import World

SETTINGS = (
    *(
        "model.hidden=[16]",
        "model.ensemble_size=1",
        "model.blocks=self,role,ball,mode",
        "model.kick_blocks=self,ball,mode",
    ),
    *("model.target_points=2", "model.target_hidden=8", "model.parameter_hidden=16", "model.kick_hidden=8"),
    *("model.kick_attention=0", "train.epochs=1", "data.batch_size=256", "data.batches_per_epoch=4"),
    *("train.threads=1", "train.precision=fp32", "train.device=cpu"),
)


@pytest.fixture(scope="module")
def log(samples_dir: Path) -> Path:
    return min(samples_dir.glob("*.rcg.xz"))


@pytest.fixture(scope="module")
def store(log: Path, samples_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Store:
    made = tc.create_store(tmp_path_factory.mktemp("predict") / "store")
    for path in sorted(samples_dir.glob("*.rcg.xz"))[:4]:
        made.add(tc.read_match(path))
    return made


@pytest.fixture(scope="module")
def dataset(store: Store, tmp_path_factory: pytest.TempPathFactory) -> tc.Dataset:
    folder = tmp_path_factory.mktemp("predict") / "dataset"
    tc.build_dataset(tc.DatasetConfig(teams=("HELIOS_base",)), store=store, out=folder, jobs=1)
    return tc.open_dataset(folder)


@pytest.fixture(scope="module")
def clone(dataset: tc.Dataset, tmp_path_factory: pytest.TempPathFactory) -> tc.LoadedClone:
    run = tc.train(load_config("best", SETTINGS), dataset, tmp_path_factory.mktemp("predict") / "run")
    return tc.load(run.path)


@pytest.fixture(scope="module")
def table(clone: tc.LoadedClone, log: Path) -> pa.Table:
    return clone.predict(log, team="HELIOS_base").to_arrow()


def test_a_loaded_clone_says_what_it_is(clone: tc.LoadedClone) -> None:
    assert repr(clone) == f"LoadedClone({clone.run.path}, egocentric, of HELIOS_base)"


def rounded(*arguments: Any, **settings: Any) -> World:
    """A view with the measured channels in the steps of a dataset."""
    world = view_columns(*arguments, **settings)
    measured = world.players[..., 2 : 2 + len(layout.STEPS)]
    measured[...] = (
        np.rint(measured.astype(np.float64) / np.array(list(layout.STEP.values()))).astype(np.float32) * layout.STEPS
    )
    return world


def test_a_log_gives_what_its_dataset_gives(
    clone: tc.LoadedClone, dataset: tc.Dataset, log: Path, table: pa.Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To rounding, once the log's values are in the steps of the dataset: 0.0001 m per cycle, 0.01 degrees, ..."""
    match_id = table["match_id"][0].as_py()
    (index,) = [place for place, match in enumerate(dataset.matches) if match["match_id"] == match_id]
    every = np.arange(len(dataset))
    rows = every[dataset.match(every).numpy() == index]
    expected = predict(clone.model, dataset, rows)
    frame = dataset.samples["frame"].numpy()[rows]
    cycle, player = dataset.frames["cycle"].numpy()[frame], dataset.samples["player"].numpy()[rows]
    names, kind = np.array(dataset.commands), expected.kind
    # As they are in the log, only probabilities are compared: the likeliest parameter of two modes may be the other.
    monkeypatch.setattr(prediction_table, "view_columns", rounded)
    for found, near in ((table, 1e-3), (clone.predict(log, team="HELIOS_base").to_arrow(), 1e-5)):
        done = found.filter(pc.and_kleene(found["done"].is_valid(), found["executed"]))
        assert done["cycle"].to_pylist() == cycle.tolist()
        assert done["unum"].to_pylist() == (player + 1).tolist()
        assert done["done"].to_pylist() == names[kind].tolist()
        probabilities = np.stack([done[f"p_{name}"].to_numpy() for name in names], 1)
        np.testing.assert_allclose(probabilities, expected.probabilities, atol=near)
        np.testing.assert_array_equal(done["done_dash_power"].to_numpy(), expected.issued[:, 0])
        np.testing.assert_allclose(
            done["log_loss"].to_numpy(), -np.log(probabilities[np.arange(len(kind)), kind]), rtol=1e-5
        )
    np.testing.assert_allclose(done["parameter_log_loss"].to_numpy(), expected.parameter_log_loss, atol=1e-3)
    for column, name in enumerate(("dash_power", "dash_direction", "turn_moment")):
        np.testing.assert_allclose(done[name].to_numpy(), expected.parameters[:, column], atol=1e-2)
    kicked = kind == dataset.commands.index("kick")
    np.testing.assert_allclose(done["kick_power"].to_numpy()[kicked], expected.parameters[kicked, 3], atol=1e-2)


def test_rows_are_players_on_the_field_in_play_on(table: pa.Table) -> None:
    assert set(table["playmode"].to_pylist()) == {"play_on"}
    assert set(table["team"].to_pylist()) == {"HELIOS_base"}
    assert 1 not in table["unum"].to_pylist()
    assert table.num_rows == 17250
    assert table["done"].null_count == 0
    total = sum(table[f"p_{name}"].to_numpy() for name in ("dash", "turn", "kick", "tackle"))
    np.testing.assert_allclose(total, 1, rtol=1e-5)
    kicks = table.filter(pc.equal(table["done"], "kick"))
    assert kicks.num_rows
    assert kicks["kick_power"].null_count == 0
    assert table["kick_power"].null_count > table.num_rows / 2


def test_a_match_and_a_store_give_the_same_table(
    clone: tc.LoadedClone, store: Store, log: Path, table: pa.Table
) -> None:
    match = tc.read_match(log)
    side = "left" if match.left.name == "HELIOS_base" else "right"
    assert clone.predict(match, side=side).to_arrow().equals(table)
    assert clone.predict(match.match_id, store=store, team="HELIOS_base").to_arrow().equals(table)


def test_opponents_goalkeepers_and_chosen_numbers(clone: tc.LoadedClone, log: Path) -> None:
    everybody = clone.predict(log, team="WEBase").to_arrow()
    assert everybody.num_rows == 17250
    assert everybody["done"].null_count == 954  # cycles without a command
    assert everybody["p_dash"].null_count == 0
    table = clone.predict(log, team="WEBase", unums=(1, 7), goalkeepers=True).to_arrow()
    assert set(table["team"].to_pylist()) == {"WEBase"}
    assert set(table["unum"].to_pylist()) == {1, 7}


def test_without_a_command_log_the_game_log_says_what_was_done(
    clone: tc.LoadedClone, log: Path, table: pa.Table, tmp_path: Path
) -> None:
    alone = Path(shutil.copy(log, tmp_path))
    found = clone.predict(alone, team="HELIOS_base").to_arrow()
    np.testing.assert_array_equal(found["p_kick"].to_numpy(), table["p_kick"].to_numpy())
    assert set(table["source"].to_pylist()) == {"logged"}
    assert set(found["source"].to_pylist()) <= {"recovered", None}
    known = found["done"].is_valid()
    assert pc.sum(known).as_py() > 0.99 * found.num_rows
    assert found.filter(known)["done"].to_pylist() == table.filter(known)["done"].to_pylist()
    powers = [one.filter(known)["done_dash_power"].to_numpy(zero_copy_only=False) for one in (found, table)]
    assert np.nanmax(np.abs(powers[0] - powers[1])) < 1.0
    # A kick beside another player's has no numbers that the game log shows.
    kicks = found.filter(pc.equal(found["done"], "kick"))
    assert pc.all(pc.equal(kicks["done_kick_power"].is_null(), kicks["parameter_log_loss"].is_null())).as_py()
    # The same from a store without the command log.
    store = tc.create_store(str(tmp_path / "store"))
    store.add(tc.read_match(alone))
    match_id = found["match_id"][0].as_py()
    assert clone.predict(match_id, store=store, team="HELIOS_base").to_arrow().equals(found)


def test_a_team_that_does_not_play(clone: tc.LoadedClone, log: Path) -> None:
    with pytest.raises(tc.TeamcloneError, match=r"no team 'HELIOS_bass'.*HELIOS_base"):
        clone.predict(log, team="HELIOS_bass")
    with pytest.raises(tc.TeamcloneError, match="name either a team"):
        clone.predict(log)


@pytest.mark.parametrize("suffix", ["parquet", "csv", "jsonl"])
def test_the_command_writes_one_table_of_several_logs(
    clone: tc.LoadedClone, samples_dir: Path, table: pa.Table, tmp_path: Path, suffix: str
) -> None:
    first, second, *_ = sorted(samples_dir.glob("*.rcg.xz"))
    bad, out = tmp_path / "bad.rcg", tmp_path / "made" / f"table.{suffix}"
    bad.write_bytes(b"ULG")
    words = ["predict", clone.run.path, first, bad, second, "--team", "HELIOS_base", "--out", out, "--json"]
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 1
    assert str(bad) in done.stderr
    summary = json.loads(done.stdout)["matches"]
    assert [match["error"] is None for match in summary] == [True, False, True]
    if suffix == "parquet":
        found = pq.read_table(out)
    elif suffix == "csv":
        found = pyarrow.csv.read_csv(out)
    else:
        found = pa.Table.from_pylist([json.loads(line) for line in out.read_text().splitlines()])
    assert found.column_names == table.column_names
    assert found.num_rows == summary[0]["rows"] + summary[2]["rows"]
    np.testing.assert_allclose(found["p_kick"].to_numpy()[: table.num_rows], table["p_kick"].to_numpy(), rtol=1e-5)
    assert list(out.parent.iterdir()) == [out]


def test_no_file_where_no_match_could_be_predicted(clone: tc.LoadedClone, log: Path, tmp_path: Path) -> None:
    out = tmp_path / "table.csv"
    words = ["predict", str(clone.run.path), str(log), "--out", str(out)]
    assert CliRunner().invoke(app, [*words, "--team", "Nobody"]).exit_code == 1
    assert not list(tmp_path.iterdir())
    assert CliRunner().invoke(app, words).exit_code != 0
