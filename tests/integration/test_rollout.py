"""Roll-outs as a command: a trained clone, real matches, its files, and its answers to bad input."""

from __future__ import annotations

import json
import lzma
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import teamclone as tc
from command import called
from teamclone.report.page import fresh_rollouts
from teamclone.training.config import load_config

SETTINGS = (
    *("model.hidden=[16]", "model.ensemble_size=1", "model.blocks=self,role,ball", "model.kick_blocks=self,ball"),
    *("model.target_points=2", "model.target_hidden=8", "model.parameter_hidden=16", "model.kick_hidden=8"),
    *("model.kick_attention=0", "train.epochs=1", "data.batch_size=256", "data.batches_per_epoch=20"),
    *("train.threads=1", "train.precision=fp32", "train.device=cpu"),
)
STARTS, SAMPLES, HORIZON = 4, 3, 5
SIZE = ("--starts", STARTS, "--samples", SAMPLES, "--horizon", HORIZON)


@pytest.fixture(scope="module")
def log(samples_dir: Path) -> Path:
    return min(samples_dir.glob("*.rcg.xz"))


@pytest.fixture(scope="module")
def run(samples_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rollout")
    store = tc.create_store(folder / "store")
    for path in sorted(samples_dir.glob("*.rcg.xz"))[:4]:
        store.add(tc.read_match(path))
    tc.build_dataset(tc.DatasetConfig(teams=("HELIOS_base",)), store=store, out=folder / "dataset", jobs=1)
    return tc.train(load_config("best", SETTINGS), tc.open_dataset(folder / "dataset"), folder / "run").path


def rolled_out(*options: object) -> dict[str, Any]:
    answer: dict[str, Any] = json.loads(called("rollout", *options, "--json").stdout)
    return answer


def test_its_files(run: Path, log: Path, tmp_path: Path) -> None:
    document = rolled_out(run, log, *SIZE, "--out", tmp_path, "--trajectories")
    assert json.loads((tmp_path / "rollouts.json").read_text()) == document
    assert document["matches"][0]["starts"] == STARTS
    assert set(document["ahead"]) == {"samples", "likeliest", "stand", "coast", "last"}
    for group in ("players", "ball"):
        [one, *_] = document["ahead"]["samples"][group]
        assert (one["cycles"], one["starts"]) == (1, STARTS)
        assert one["min_fde"] <= one["fde"]
    # Whoever stands is further off than a clone after even a short training.
    after_one = {name: of["players"][0]["fde"] for name, of in document["ahead"].items()}
    assert after_one["likeliest"] < after_one["stand"]
    rows = pq.read_table(tmp_path / "trajectories.parquet")
    assert rows.num_rows == STARTS * (SAMPLES + 5) * (HORIZON + 1) * 23
    truth = rows.filter(np.array(rows["sample"]) == -1)
    match = tc.read_match(log)
    at = truth["frame"].to_numpy() + truth["ahead"].to_numpy()
    slot = truth["unum"].to_numpy().astype(int) - 1 + np.where(truth["side"].to_numpy() < 0, 11, 0)
    players = truth["side"].to_numpy() != 0
    np.testing.assert_array_equal(truth["x"].to_numpy()[players], match.players["x"][at[players], slot[players]])
    assert (tmp_path / "fans.svg").read_text().count("cycles ahead") == STARTS
    fans = json.loads((tmp_path / "fans.json").read_text())["fans"]
    assert {fan["cycle"] for fan in fans} == set(truth["cycle"].to_pylist())
    for fan in fans:
        assert [body["of"] for body in fan["bodies"]] == [*range(2, 12), "ball"]  # its goalkeeper does not move by it
        assert len(fan["others"]) == 12
        for body in fan["bodies"]:
            assert {len(path) for path in (body["truth"], *body["samples"])} == {fan["ahead"] + 1}
            assert all(path[0] == body["truth"][0] for path in body["samples"])


def test_the_report_shows_them(run: Path, log: Path, tmp_path: Path) -> None:
    shutil.copytree(run, tmp_path / "run")
    report = ("report", tmp_path / "run")
    called(*report)
    page = (tmp_path / "run" / "report.html").read_text()
    assert "Not played yet: <code>teamclone rollout" in page
    document = rolled_out(tmp_path / "run", log, *SIZE)
    called(*report)
    page = (tmp_path / "run" / "report.html").read_text()
    assert "Not played yet" not in page
    assert f"From {STARTS} moments of one match the clone plays its team on" in page
    assert f"<td>{document['ahead']['samples']['ball'][0]['fde']:.2f}</td>" in page
    assert page.count(f", {HORIZON} cycles ahead</text>") == STARTS
    # Those of other weights, and what somebody damaged, are not shown. A call that fails leaves them as they are.
    folder = tmp_path / "run" / "rollouts"
    whole = {name: (folder / name).read_text() for name in ("rollouts.json", "fans.json")}
    failed = called("rollout", tmp_path / "run", log, *SIZE, "--from-cycle", 99999, code=1)
    assert "no play_on goes on from cycle 99999" in failed.stderr
    assert {name: (folder / name).read_text() for name in whole} == whole
    opened = tc.load(tmp_path / "run").run
    assert fresh_rollouts(opened, checkpoint="best-loss") is not None
    without_path = json.loads(whole["fans.json"])
    without_path["fans"][0]["bodies"][0]["truth"] = ""
    for name, change in (
        ("fans.json", without_path),
        *(
            ("rollouts.json", change)
            for change in ({"model_id": "0" * 16}, {"ahead": 5}, {"ahead": {}}, {"matches": 3})
        ),
        ("rollouts.json", {"options": None}),
        ("rollouts.json", {"ahead": {"samples": {"players": [{}]}}}),
        *(("fans.json", {"fans": fans}) for fans in (5, [{}], [5])),
    ):
        (folder / name).write_text(json.dumps(json.loads(whole[name]) | change))
        assert fresh_rollouts(opened, checkpoint="best-loss") is None, (name, change)
        (folder / name).write_text(whole[name])


def test_starts_by_cycle(run: Path, log: Path, tmp_path: Path) -> None:
    cycles = ("--from-cycle", 300, "--from-cycle", 301)
    rolled_out(run, log, *SIZE, *cycles, "--out", tmp_path, "--ball", "touched")
    fans = json.loads((tmp_path / "fans.json").read_text())["fans"]
    assert sorted(fan["cycle"] for fan in fans) == [300, 301]


def test_a_ball_as_logged(run: Path, log: Path, tmp_path: Path) -> None:
    document = rolled_out(run, log, *SIZE, "--ball", "logged", "--out", tmp_path)
    assert [row["fde"] for row in document["ahead"]["samples"]["ball"]] == pytest.approx([0.0] * 3, abs=1e-4)
    assert document["ahead"]["samples"]["players"][0]["fde"] > 0
    agreement = [row["agreement"] for row in document["ahead"]["likeliest"]["players"]]
    assert all(0 <= share <= 1 for share in agreement)
    assert document["realism"]["samples"]["speed of the ball"] == pytest.approx(1.0)


@pytest.mark.parametrize("others", ["logged", "last", "clone"])
def test_the_other_team(run: Path, log: Path, tmp_path: Path, others: str) -> None:
    others = f"clone:{run}" if others == "clone" else others
    one, again = (rolled_out(run, log, *SIZE, "--others", others, "--out", tmp_path / name) for name in "ab")
    assert one["ahead"] == again["ahead"]
    other = rolled_out(run, log, *SIZE, "--others", others, "--out", tmp_path / "c", "--seed", 1)
    assert one["ahead"] != other["ahead"]


def test_one_bad_log_stops_nothing(run: Path, log: Path, fixtures_dir: Path, tmp_path: Path) -> None:
    old = next((fixtures_dir / "native-v1").glob("*.rcg.gz"))
    other = next((fixtures_dir / "goalie3").glob("*.rcg.gz"))
    done = called("rollout", run, old, other, log, *SIZE, "--out", tmp_path, code=1)
    assert "players: clone, samples" in done.stdout
    [line] = done.stderr.splitlines()
    assert f"{old}: expected a log that lists the server's parameters" in line
    assert "no team 'HELIOS_base'" in line
    errors = [match["error"] is None for match in json.loads((tmp_path / "rollouts.json").read_text())["matches"]]
    assert sorted(errors) == [False, False, True]


def test_a_folder_of_game_logs_alone(run: Path, log: Path, tmp_path: Path) -> None:
    """The kicks of the other team are then those that the movements show."""
    (tmp_path / "logs").mkdir()
    shutil.copy(log, tmp_path / "logs")
    size = ("--starts", 30, "--samples", 2, "--horizon", 3)
    document = rolled_out(run, tmp_path / "logs", *size, "--out", tmp_path / "out", "--side", "right", "--trajectories")
    assert document["team"] is None
    assert [row["cycles"] for row in document["ahead"]["samples"]["ball"]] == [1, 2, 3]
    rolled_out(run, tmp_path / "logs", *size, "--out", tmp_path / "out", "--side", "right")
    assert not (tmp_path / "out" / "trajectories.parquet").exists()


def test_a_log_without_player_types(run: Path, log: Path, tmp_path: Path) -> None:
    lines = lzma.decompress(log.read_bytes()).splitlines(keepends=True)
    (tmp_path / "bare.rcg").write_bytes(b"".join(line for line in lines if not line.startswith(b"(player_type ")))
    done = called("rollout", run, tmp_path / "bare.rcg", *SIZE, "--out", tmp_path / "out", code=1)
    assert "expected a log that lists player types, got one without" in done.stderr


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--others", "friends"), "--others 'friends' is unknown, choose one of: logged, last, clone:RUN"),
        (("--ball", "round"), "--ball 'round' is unknown, choose one of: free, touched, logged"),
        (("--team", "Red", "--side", "left"), "name either a team or a side"),
        (("--horizon", 0), "Invalid value for '--horizon'"),
    ],
)
def test_wrong_usage(run: Path, log: Path, options: tuple[object, ...], expected: str) -> None:
    assert expected in called("rollout", run, log, *options, code=2).stderr
