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


def test_types_that_the_log_does_not_list_are_told() -> None:
    (pair,) = find_matches([FIXTURES / "v6"])
    game = read_pair(pair).game
    types = {name: values[:1] for name, values in game.player_types.items()}
    players = game.players | {"type": np.full_like(game.players["type"], 3)}
    with pytest.raises(UsageError, match="expected players of the 1 types that the log lists"):
        recovered_commands(game.frames, players, types=types, params=game.server_params)
