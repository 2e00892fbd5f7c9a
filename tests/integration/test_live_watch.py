"""`teamclone live watch` beside a server that shows a bundled match: its score is that of `evaluate` to the digit."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import teamclone as tc
from command import TEAMCLONE, called
from showing import Showing, parameters_of, shows_of
from teamclone.dataset.clean import as_stored
from teamclone.evaluation.evaluate import evaluate
from teamclone.logs import read_match
from teamclone.training.config import load_config
from teamclone.training.run import open_run
from teamclone.world.view import view

SETTINGS = (
    *("model.hidden=[16]", "model.ensemble_size=1", "model.blocks=self,role,last,ball,past,mode"),
    *("model.kick_blocks=self,ball", "model.target_points=2", "model.target_hidden=8", "model.parameter_hidden=16"),
    *("model.kick_hidden=8", "model.kick_attention=0", "train.epochs=1", "data.batch_size=256"),
    *("data.batches_per_epoch=20", "data.validation_batches=5"),
    *("train.threads=1", "train.precision=fp32", "train.device=cpu"),
)
SHOWN = 700
"""Cycles of the match that are shown: a goal, free kicks and kick-ins are among them."""


@pytest.fixture(scope="module")
def log(samples_dir: Path) -> Path:
    return next(samples_dir.glob("*-HELIOS_base_8-vs-WEBase_0.rcg.xz"))


@pytest.fixture(scope="module")
def run(samples_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("watch")
    store = tc.create_store(folder / "store")
    for path in sorted(samples_dir.glob("*.rcg.xz"))[:4]:
        store.add(tc.read_match(path))
    tc.build_dataset(tc.DatasetConfig(teams=("HELIOS_base",)), store=store, out=folder / "dataset", jobs=1)
    return tc.train(load_config("best", SETTINGS), tc.open_dataset(folder / "dataset"), folder / "run").path


def watched(run: Path, server: Showing, *options: object, code: int = 0) -> list[dict[str, Any]]:
    """The events of a watch."""
    words = ("--port", server.port, "--wait", 60, "--silence", 10, "--json")
    done = called("live", "watch", run, *words, *options, code=code)
    return [json.loads(line) for line in done.stdout.splitlines()]


def of_kind(events: list[dict[str, Any]], kind: str) -> list[dict[str, Any]]:
    return [event for event in events if event["event"] == kind]


def test_the_score_is_that_of_evaluate(run: Path, log: Path, tmp_path: Path) -> None:
    shows = list(shows_of(log))[:SHOWN]
    shows.append(shows[-1].replace(b"(pm 3)", b"(pm 2)"))
    with Showing(parameters_of(log), shows) as server:
        events = watched(run, server, "--save", tmp_path / "seen.rcg")
    assert server.requests[0] == b"(dispinit version 5)\0"
    end = events[-1]
    assert (end["event"], end["ended"]) == ("end", "time_over")
    assert end["datagrams"] == {
        "frames": SHOWN - 3 + 1, "waiting": 3, "lost": 0, "late": 0, "doubled": 0, "dropped": 0,
    }  # fmt: skip
    store = tc.create_store(tmp_path / "store")
    store.add(read_match(tmp_path / "seen.rcg"))
    tc.build_dataset(tc.DatasetConfig(teams=("HELIOS_base",)), store=store, out=tmp_path / "dataset", jobs=1)
    [split] = evaluate(open_run(run), dataset=tmp_path / "dataset")["splits"].values()
    assert end["rows"] == split["rows"] > 2000
    scores = {"model": split["model"], **split["baselines"]}
    assert end["scores"].keys() == scores.keys()
    for name, of in end["scores"].items():
        assert of["accuracy"] == scores[name]["accuracy"]["value"], name
        for figure in ("cross_entropy", "brier"):
            assert of[figure] == pytest.approx(scores[name][figure]["value"], rel=1e-5), (name, figure)
    for name, parameter in end["parameters"].items():
        assert parameter["rows"] == split["parameters"][name]["rows"]
        if parameter["rows"]:
            assert parameter["mean"] == pytest.approx(split["parameters"][name]["mean"]["value"], rel=1e-3), name

    # Each command was predicted before it was known, and each recovered one is that of the whole log.
    known = {(event["cycle"], event["stoppage"]): event["players"] for event in of_kind(events, "done")}
    predicted = {(event["cycle"], event["stoppage"]): event["players"] for event in of_kind(events, "prediction")}
    assert sum(map(len, known.values())) == end["rows"]
    for place, players in known.items():
        expected = {player["unum"]: player for player in predicted[place]}
        for player in players:
            probability = expected[player["unum"]]["probabilities"][player["command"]]
            assert player["log_loss"] == pytest.approx(-np.log(probability), abs=1e-5)
            for number in player["parameters"].values():
                assert number["low"] <= number["value"] <= number["high"]
    losses = sorted((player["log_loss"] for players in known.values() for player in players), reverse=True)
    assert [moment["log_loss"] for moment in end["moments"]] == pytest.approx(losses[:10])
    assert end["latency"]["n"] == len(predicted)
    assert 0 < end["latency"]["p50_ms"] <= end["latency"]["p99_ms"] <= end["latency"]["max_ms"]


def test_a_frame_is_what_a_dataset_keeps_of_it(run: Path, log: Path) -> None:
    """The clone reads live what it was fitted to."""
    data = tc.open_dataset(open_run(run).dataset_path)
    match = read_match(log)
    index = next(place for place, entry in enumerate(data.matches) if entry["match_id"] == match.match_id)
    rows = np.flatnonzero(data.match(np.arange(len(data))).numpy() == index)[::97]
    state = data.state(rows)
    world = view(match, side=1 if data.matches[index]["side"] == "left" else -1)
    place = {cycle: at for at, cycle in enumerate(world.cycle.tolist())}
    kept = np.unique(data.samples["frame"].numpy()[rows])
    frames = [place[cycle] for cycle in data.frames["cycle"].numpy()[kept].tolist()]
    np.testing.assert_array_equal(as_stored(world.players[frames]), state.players.numpy())


def test_it_waits_for_its_team_and_says_who_plays(run: Path, log: Path) -> None:
    with Showing(parameters_of(log), list(shows_of(log))[:20]) as server:
        done = called("live", "watch", run, "--port", server.port, "--team", "HELIOS", "--wait", 60, code=1)
    assert "HELIOS does not play; did you mean HELIOS_base?" in done.stderr
    with Showing(parameters_of(log), list(shows_of(log))[:60]) as server:
        done = called("live", "watch", run, "--port", server.port, "--side", "right", "--silence", 1, "--wait", 60)
    assert "no cycle came any more at cycle" in done.stdout
    assert "57 frames, 0 lost" in done.stdout


def test_no_server_and_wrong_words_are_errors(run: Path) -> None:
    with Showing([], []) as server:
        done = called("live", "watch", run, "--port", server.port, "--wait", 0.5, code=1)
    assert f"127.0.0.1 port {server.port}: no server showed a match within 0.5 s" in done.stderr
    done = called("live", "watch", run, "--side", "up", code=2)
    assert "expected the side left or right, got 'up'" in done.stderr
    done = called("live", "watch", run, "--side", "left", "--team", "HELIOS_base", code=2)
    assert "name a team or a side, not both" in done.stderr


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_whoever_stops_it_gets_its_score_and_its_log(run: Path, log: Path, tmp_path: Path, by: signal.Signals) -> None:
    saved = tmp_path / "seen.rcg"
    with Showing(parameters_of(log), shows_of(log), pause_s=0.05) as server:
        words = ("live", "watch", run, "--port", server.port, "--save", saved, "--json")
        with subprocess.Popen([TEAMCLONE, *map(str, words)], stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            while '"done"' not in process.stdout.readline():
                assert process.poll() is None
            time.sleep(1.5)
            process.send_signal(by)
            rest = process.stdout.read().splitlines()
    if by is signal.SIGKILL:
        assert len(read_match(tmp_path / ".seen.rcg.part").frames["cycle"]) > 1
        return
    assert process.returncode == 0
    end = json.loads(rest[-1])
    assert (end["event"], end["ended"]) == ("end", "interrupted")
    assert len(read_match(saved).frames["cycle"]) == end["datagrams"]["frames"]
