"""`teamclone percepts`, as a user calls it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

import teamclone as tc
from command import called
from looking import DATA
from teamclone.errors import LogError
from teamclone.percepts.memory import MAX_AGE
from teamclone.percepts.sight import BALL
from teamclone.rcss.playmodes import PlayMode

LOG = next(DATA.glob("*.rcg.xz"))


def test_tells_how_old_and_how_far_off_beliefs_are() -> None:
    (match,) = json.loads(called("percepts", LOG, "--json").stdout)["matches"]
    left, right = match["teams"]
    in_play = int((tc.read_match(LOG).frames["playmode"] == PlayMode.PLAY_ON).sum())
    assert (left["team"], right["team"]) == ("helios_L", "helios_R")
    for team in (left, right):
        assert team["cycles"] == 10 * in_play
        assert 0.4 < team["messages"] < 0.9
        for known in (team["ball"], team["others"]):
            assert sum(row["share"] for row in known) == pytest.approx(1)
            assert known[0]["error_m"] < known[2]["error_m"]
        assert team["ball"][0]["share"] > team["others"][0]["share"]
    words = called("percepts", LOG, "--team", "helios_R").stdout
    assert "helios_R" in words
    assert "16 or more, or never" in words
    assert "players of helios_L" not in words


def test_compares_with_what_players_wrote_down() -> None:
    made = json.loads(called("percepts", LOG, "--offline-logs", DATA, "--json").stdout)["matches"][0]
    assert len(made["agreement"]) == 4
    for each in made["agreement"].values():
        assert each["shares"]["cycles"] == 1
        assert each["shares"]["shown"] > 0.998
    last = called("percepts", LOG, "--offline-logs", DATA).stdout.splitlines()[-1]
    assert last.split()[0] == "all"
    assert last.split()[2] == "100.000%"


def test_writes_all_of_it_as_a_table(tmp_path: Path) -> None:
    out = tmp_path / "percepts.parquet"
    called("percepts", LOG, "--team", "helios_L", "--out", out)
    table = pq.read_table(out)
    percepts = tc.match_percepts(LOG)
    n_frames = len(percepts.match.frames["cycle"])
    assert table.num_rows == n_frames * 11 * 22
    assert set(table["side"].to_pylist()) == {1}
    of_ball = table.filter(pc.and_(pc.equal(table["object_side"], 0), pc.equal(table["unum"], 7)))
    assert of_ball["age"].to_numpy().tolist() == percepts.memory.age[:, 6, BALL].tolist()
    assert of_ball["x"].to_numpy() == pytest.approx(percepts.memory.place[:, 6, BALL, 0])
    hidden = np.array(of_ball["what"].to_pylist()) == "hidden"
    assert np.isnan(of_ball["distance"].to_numpy(zero_copy_only=False)[hidden]).all()
    assert of_ball["age"].to_numpy().max() <= MAX_AGE


def test_a_broken_log_does_not_stop_the_others(tmp_path: Path) -> None:
    shutil.copy(LOG, tmp_path)
    (tmp_path / "broken.rcg").write_bytes(b"nothing")
    done = called("percepts", tmp_path, "--json", code=1)
    assert [one["error"] is None for one in json.loads(done.stdout)["matches"]] == [True, False]
    assert "broken.rcg" in done.stderr
    (tmp_path / "odd-3.ocl").write_bytes(b"nothing")
    shutil.copy(DATA / "helios_L-7.ocl.xz", tmp_path)
    (tmp_path / "broken.rcg").unlink()
    done = called("percepts", tmp_path, "--offline-logs", tmp_path, "--json", code=1)
    assert len(json.loads(done.stdout)["matches"][0]["agreement"]) == 1
    assert "odd-3.ocl" in done.stderr


def test_what_cannot_be_asked_is_told(tmp_path: Path, fixtures_dir: Path) -> None:
    assert "helios_L" in called("percepts", LOG, "--team", "helios_1", code=2).stderr
    assert "no file TEAM-NUMBER.ocl" in called("percepts", LOG, "--offline-logs", tmp_path, code=2).stderr
    two = [LOG, next((fixtures_dir / "v6").glob("*.rcg.gz"))]
    assert "of one match, got 2" in called("percepts", *two, "--offline-logs", DATA, code=2).stderr
    with pytest.raises(LogError, match="does not show neck: logs of version 3"):
        tc.match_percepts(next((fixtures_dir / "native-v2").glob("*.rcg*")))
