"""Recovered commands in the form of a command log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from teamclone.dynamics.inverse.columns import recovered_commands
from teamclone.errors import UsageError
from teamclone.logs import columns, find_matches, read_pair
from teamclone.logs.align import first_body_commands, slot_of
from teamclone.rcss.commands import CommandKind

FIXTURES = Path(__file__).parents[3] / "data" / "fixtures"


def test_they_are_as_a_command_log_has_them() -> None:
    (pair,) = find_matches([FIXTURES / "v6"])
    match = read_pair(pair)
    game, log = match.game, match.commands
    found, gaps = recovered_commands(game.frames, game.players, types=game.player_types, params=game.server_params)
    assert gaps == ()
    assert {name: values.dtype.name for name, values in found.items()} == {
        column.name: column.dtype for column in (*columns.COMMANDS, *columns.INTERVALS)
    }
    for name in ("cycle", "stoppage"):
        np.testing.assert_array_equal(found[name], game.frames[name][found["frame"]])
    np.testing.assert_array_equal(found["line"], np.arange(1, len(found["line"]) + 1))
    sent, made = (first_body_commands(one, game.frames["playmode"]) for one in (log, found))
    places = [
        {
            (frame, slot): kind
            for frame, slot, kind in zip(
                one["frame"][rows], slot_of(one["side"][rows], one["unum"][rows]), one["kind"][rows], strict=True
            )
        }
        for one, rows in ((log, sent), (found, made))
    ]
    assert len(places[1]) > 0.9 * len(places[0])
    assert all(places[0][where] == kind for where, kind in places[1].items())


def test_a_turn_of_the_neck_comes_second() -> None:
    (pair,) = find_matches([FIXTURES / "v6"])
    game = read_pair(pair).game
    found, _ = recovered_commands(game.frames, game.players, types=game.player_types, params=game.server_params)
    keys = [tuple(row) for row in np.stack([found[name] for name in ("frame", "side", "unum", "order")], 1)]
    assert len(set(keys)) == len(keys)
    neck = found["kind"] == CommandKind.TURN_NECK
    assert set(found["order"][neck]) == {0, 1}
    assert (found["order"][~neck] == 0).all()


def test_what_is_not_known_is_no_number() -> None:
    (pair,) = find_matches([FIXTURES / "native-v2"])
    game = read_pair(pair).game
    found, gaps = recovered_commands(game.frames, game.players, types=game.player_types, params=game.server_params)
    assert any("does not count" in gap or "velocities" in gap for gap in gaps)
    for index in (0, 1):
        unknown = np.isnan(found[f"arg{index}"])
        for end in ("low", "high"):
            np.testing.assert_array_equal(np.isnan(found[f"{end}{index}"]), unknown)


def test_nothing_is_recovered_from_across_a_pause() -> None:
    """A half may end while the clock stands: what is done in the pause is counted in the next frame."""
    (pair,) = find_matches([FIXTURES / "v6"])
    match = read_pair(pair)
    game = match.game
    end = 100
    minutes = {"half_time": game.frames["cycle"][end] * 0.1, "extra_half_time": 0.0, "simulator_step": 100.0}
    arguments = (game.frames, game.players)
    whole, _ = recovered_commands(*arguments, types=game.player_types, params=game.server_params)
    cut, _ = recovered_commands(*arguments, types=game.player_types, params=game.server_params | minutes)
    assert (whole["frame"] == end).any()
    assert not (cut["frame"] == end).any()
    assert set(whole["frame"]) - {end} >= set(cut["frame"]) >= {end - 1, end + 1}


def test_a_log_in_which_nothing_follows_says_so() -> None:
    (pair,) = find_matches([FIXTURES / "v6"])
    game = read_pair(pair).game
    frames, players = ({name: values[::3] for name, values in part.items()} for part in (game.frames, game.players))
    found, gaps = recovered_commands(frames, players, types=game.player_types, params=game.server_params)
    assert len(found["frame"]) == 0
    assert gaps == ("any command: no counter rises from one cycle to the next",)
    none = {name: values[:0] for name, values in game.frames.items()}
    nobody = {name: values[:0] for name, values in game.players.items()}
    assert recovered_commands(none, nobody, types=game.player_types, params=game.server_params)[1] == ()


@pytest.mark.parametrize(("name", "value"), [("dash_angle_step", 1e-6), ("player_rand", 5.0), ("ball_rand", 1.0)])
def test_rules_that_no_match_has_are_refused(name: str, value: float) -> None:
    (pair,) = find_matches([FIXTURES / "v6"])
    game = read_pair(pair).game
    params = game.server_params | {name: value}
    with pytest.raises(UsageError, match=f"expected (a )?{name}"):
        recovered_commands(game.frames, game.players, types=game.player_types, params=params)


def test_types_that_the_log_does_not_list_are_told() -> None:
    (pair,) = find_matches([FIXTURES / "v6"])
    game = read_pair(pair).game
    types = {name: values[:1] for name, values in game.player_types.items()}
    players = game.players | {"type": np.full_like(game.players["type"], 3)}
    with pytest.raises(UsageError, match="expected players of the 1 types that the log lists"):
        recovered_commands(game.frames, players, types=types, params=game.server_params)
