"""What players believe: what they saw, moved on; against the truth of a real match."""

from __future__ import annotations

import numpy as np
import pytest

from looking import DATA, situation
from teamclone.logs import read_match
from teamclone.logs.match import Columns
from teamclone.percepts.memory import MAX_AGE, Memory, remember
from teamclone.percepts.sight import BALL, SEEN, sight
from teamclone.rcss.players import N_PLAYERS

DECAY = 0.4


def believed(frames: Columns, players: Columns) -> Memory:
    decay = np.full((len(frames["ball_x"]), N_PLAYERS), DECAY)
    return remember(frames, players, sight(frames, players, {}), decay=decay, params={})


def rolling(n: int) -> tuple[Columns, Columns]:
    """Return frames in which the ball rolls from 10 m ahead of player 0, which looks at it in the first only."""
    frames, players = situation(n)
    speed = 1.0 * 0.94 ** np.arange(n)
    frames["ball_vx"] = speed.astype(np.float32)
    frames["ball_x"] = (10.0 + np.concatenate([[0.0], np.cumsum(speed)[:-1]])).astype(np.float32)
    players["neck"][1:, 0] = 90.0
    return frames, players


def test_what_is_no_longer_seen_moves_on_by_the_rules_of_the_server() -> None:
    frames, players = rolling(6)
    memory = believed(frames, players)
    assert memory.age[:, 0, BALL].tolist() == [0, 1, 2, 3, 4, 5]
    # 10 m and 1 m a cycle are on the grids of what is told, so the player loses nothing but what happens later.
    assert memory.place[:, 0, BALL, 0] == pytest.approx(frames["ball_x"], abs=1e-5)
    assert memory.velocity[:, 0, BALL, 0] == pytest.approx(frames["ball_vx"], abs=1e-6)


def test_a_kick_that_nobody_saw_is_not_known() -> None:
    frames, players = rolling(6)
    frames["ball_y"][3:] = 20.0
    memory = believed(frames, players)
    assert memory.place[:, 0, BALL, 1] == pytest.approx(np.zeros(6), abs=1e-6)


def test_what_was_never_seen_has_the_greatest_age() -> None:
    frames, players = situation(3)
    frames["ball_x"][:] = -40.0
    assert (believed(frames, players).age[:, 0, BALL] == MAX_AGE).all()


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e38])
@pytest.mark.parametrize("name", ["ball_x", "ball_vx"])
def test_an_impossible_number_is_not_believed(name: str, value: float) -> None:
    """Else it would be believed for as long as the ball is not seen."""
    frames, players = rolling(6)
    whole = believed(frames, players)
    players["neck"][2, 0] = 0.0
    frames[name][2] = value
    broken = believed(frames, players)
    assert (broken.age[:, 0, BALL] == whole.age[:, 0, BALL]).all()
    assert broken.place[:, 0, BALL] == pytest.approx(whole.place[:, 0, BALL])
    frames[name][0] = value
    assert np.isfinite(believed(frames, players).place).all()


def test_a_player_knows_itself() -> None:
    frames, players = situation(3, vx=0.3)
    players["x"][:, 0] = [0.0, 0.3, 0.6]
    memory = believed(frames, players)
    assert memory.place[:, 0, 0, 0] == pytest.approx([0.0, 0.3, 0.6])
    assert (memory.age[:, range(N_PLAYERS), range(N_PLAYERS)] == 0).all()


def test_players_stop_where_they_are_not_seen() -> None:
    """Nobody knows whether they dash on: their speed decays."""
    frames, players = situation(4)
    players["x"][:, 1], players["y"][:, 1], players["vx"][0, 1] = 10.0, 0.0, 0.4
    players["neck"][1:, 0] = 90.0
    memory = believed(frames, players)
    moved = np.array([0.0, 1.0, 1.0 + DECAY, 1.0 + DECAY + DECAY**2]) * memory.velocity[0, 0, 1, 0]
    assert memory.velocity[0, 0, 1, 0] == pytest.approx(0.4, abs=0.1)
    assert memory.place[:, 0, 1, 0] - memory.place[0, 0, 1, 0] == pytest.approx(moved, abs=1e-5)


def test_of_a_ball_that_is_near_but_not_in_sight_the_velocity_follows_from_its_places() -> None:
    frames, players = situation(3, neck=90.0)
    frames["ball_x"][:] = [1.0, 1.5, 1.97]
    memory = believed(frames, players)
    assert (memory.age[:, 0, BALL] == 0).all()
    assert memory.velocity[1, 0, BALL, 0] == pytest.approx(0.5 * 0.94, abs=0.15)


def test_in_a_real_match_beliefs_are_near_the_truth_and_get_worse_with_age() -> None:
    match = read_match(next(DATA.glob("*.rcg.xz")))
    frames, players = match.game.frames, match.game.players
    seen = sight(frames, players, match.game.server_params)
    decay = match.game.player_types["player_decay"][players["type"]]
    memory = remember(frames, players, seen, decay=decay, params=match.game.server_params)
    truth = np.stack([np.column_stack([players[axis], frames[f"ball_{axis}"]]) for axis in "xy"], axis=-1)
    error = np.linalg.norm(memory.place - truth[:, None], axis=-1)
    now, once = memory.age == 0, (memory.age > 3) & (memory.age < 15)
    now[:, range(N_PLAYERS), range(N_PLAYERS)] = False
    assert np.median(error[now]) < 0.6
    assert 2 * np.median(error[now]) < np.median(error[once]) < 4
    # Who is in sight is off by half a step of the grid of distances and of the direction at most.
    clear = seen.what == SEEN
    assert (error[clear] <= 0.06 * seen.distance[clear] + 0.11).all()
