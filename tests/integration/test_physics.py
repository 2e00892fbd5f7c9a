"""A match played now on the real server without noise is what the step of a cycle makes of it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from command import teamclone
from physics import outside, told, transitions
from playing import write_schedule
from teamclone.logs import find_matches, read_pair

REAL = shutil.which("rcssserver")
WITHOUT_NOISE = (
    "player_rand = 0.0, ball_rand = 0.0, kick_rand = 0.0, nr_extra_halfs = 0, penalty_shoot_outs = false, "
    "'player::kick_rand_delta_factor' = 0.0"
)


@pytest.mark.rcssserver
@pytest.mark.skipif(REAL is None, reason="there is no rcssserver on the PATH")
def test_a_match_without_noise(tmp_path: Path) -> None:
    schedule = write_schedule(tmp_path, [("Red", "Blue")], server=str(REAL), half_time=20)
    schedule.write_text(schedule.read_text().replace("half_time = 20,", f"half_time = 20, {WITHOUT_NOISE},"))
    teamclone("play", schedule, "--out", tmp_path / "out", "--json")
    [pair] = find_matches([tmp_path / "out" / "matches"])
    moves = transitions(read_pair(pair))
    assert len(moves.cycle) > 100
    assert told(moves, outside(moves)) == []
    done = teamclone("validate", "--physics", tmp_path / "out" / "matches")
    assert f"physics of {len(moves.cycle)} cycles" in done.stdout
