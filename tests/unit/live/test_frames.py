"""What players are told, put together again: against the logs of the same matches."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from datagrams import full_state, sense
from teamclone.live.frames import LiveWorld
from teamclone.logs import read_match
from teamclone.logs.match import Match
from teamclone.protocol import agent
from teamclone.protocol.parameters import Parameters
from teamclone.rcss import state_bits
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.players import N_TEAM
from teamclone.world.channels import CHANNEL, FLAG_COLLIDED, MEASURED
from teamclone.world.view import view

FRAMES = 700
EXACT = [CHANNEL[channel.name] for channel in MEASURED if channel.name != "view_width"] + [CHANNEL["type"]]


@pytest.fixture(scope="module")
def match(samples_dir: Path) -> Match:
    return read_match(next(samples_dir.glob("*YuShan2024_3-vs*.rcg.xz")))


def letters(match: Match) -> dict[str, np.ndarray]:
    """Who is frozen or kicked, as full states have it: the bits of a log stay one frame longer."""
    state = match.game.players["state"]

    def less(bits: int) -> np.ndarray:
        lies = (state & bits) != 0
        return lies & np.roll(lies, -1, axis=0)

    return {
        "t": less(state_bits.TACKLES),
        "f": less(state_bits.FOUL_CHARGED),
        "k": (state & state_bits.KICKS) != 0,
    }


@pytest.mark.parametrize("side", [1, -1])
def test_the_world_is_that_of_the_log(match: Match, side: int) -> None:
    game, was = match.game, letters(match)
    types = {
        number: {name: float(game.player_types[name][number]) for name in FIELDS}
        for number in range(len(game.player_types["player_decay"]))
    }
    parameters = Parameters(server=dict(game.server_params), types=types)
    live = LiveWorld(side=side, parameters=parameters, history=3)
    expected, own = view(match, side=side), 0 if side > 0 else N_TEAM
    # A goal sets those on their feet that have just tackled: their bit lasts one frame.
    lies = (game.players["state"] & state_bits.TACKLES) != 0
    cut_short = lies & ~np.roll(lies, -1, axis=0) & ~np.roll(lies, 1, axis=0)
    for frame in range(FRAMES):
        state = agent.full_state_of(full_state(match, frame, side=side, was=was))
        assert state is not None
        senses = {unum: agent.sense_of(sense(match, frame, own + unum - 1)) for unum in range(1, N_TEAM + 1)}
        world = live.add(state, {unum: felt for unum, felt in senses.items() if felt is not None})
        now = expected.players[frame]
        got = world.players[-1]
        np.testing.assert_allclose(got[:, :2], now[:, :2], atol=1e-4)
        np.testing.assert_allclose(got[:, EXACT], now[:, EXACT], rtol=1e-5, atol=2e-4)
        np.testing.assert_array_equal(world.ball[-1], expected.ball[frame])
        assert (world.cycle[-1], world.mode[-1]) == (expected.cycle[frame], expected.mode[frame])
        assert world.score[-1].tolist() == expected.score[frame].tolist()
        if frame:
            assert world.mode_cycles[-1] == expected.mode_cycles[frame]
            kind, logged = (values[:, CHANNEL["last_command"]] for values in (got, now))
            np.testing.assert_array_equal(kind[:N_TEAM], logged[:N_TEAM])
            np.testing.assert_array_equal(kind[N_TEAM:] == CommandKind.KICK, logged[N_TEAM:] == CommandKind.KICK)
            flags, there = (values[:, CHANNEL["flags"]].astype(int) for values in (got, now))
            there[N_TEAM:] &= ~FLAG_COLLIDED  # which nobody is told of others
            known = ~np.roll(cut_short[frame], -N_TEAM if side < 0 else 0)
            np.testing.assert_array_equal(flags[known], there[known])
    assert len(world) == 5
