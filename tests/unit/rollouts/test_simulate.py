"""Worlds of a roll-out: what a model sees of them, and where they go if all do as in the log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from teamclone.dynamics.bodies import BALL
from teamclone.dynamics.logged import Logged
from teamclone.dynamics.rules import Rules
from teamclone.dynamics.step import step
from teamclone.logs import Match, find_matches, read_pair
from teamclone.models.clone import Clone
from teamclone.models.config import EgocentricConfig
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rollouts.policies import AsLogged, Cloned, GoingOn
from teamclone.rollouts.simulate import simulate
from teamclone.rollouts.worlds import Worlds, slots_of
from teamclone.world.channels import PLAYER_CHANNELS
from teamclone.world.state import State
from teamclone.world.view import view

NOISELESS = Path(__file__).parents[2] / "data" / "physics"
EVERYBODY = np.ones(N_PLAYERS, np.bool_)


@pytest.fixture(scope="module")
def match() -> Match:
    return next(read_pair(pair) for pair in find_matches([NOISELESS]) if pair.path.name == "helios.rcg.xz")


@pytest.fixture(scope="module")
def logged(match: Match) -> Logged:
    return Logged.of(match)


@pytest.fixture(scope="module")
def rules(match: Match) -> Rules:
    return Rules.of(match.game.server_params, match.game.player_types)


def worlds_of(match: Match, logged: Logged, rules: Rules, frames: np.ndarray) -> Worlds:
    return Worlds.of(logged, view(match, side=1), rules, frames)


@pytest.mark.parametrize("side", [1, -1])
def test_a_scene_looks_as_the_frames_that_it_begins_with(match: Match, logged: Logged, rules: Rules, side: int) -> None:
    frames, actor = np.array([3, 40, 41]), np.array([5, 1, 9])
    expected = State.of(view(match, side=side), frames, actor).each()
    found = worlds_of(match, logged, rules, frames).state(np.arange(3), actor, side=side).each()
    for name, one, other in zip(State._fields, found, expected, strict=True):
        if name == "frame":
            continue
        torch.testing.assert_close(one.nan_to_num(7.0), other.nan_to_num(7.0), rtol=0, atol=2e-5, msg=name)


def test_a_cycle_later_it_looks_as_the_next_frame(match: Match, logged: Logged, rules: Rules) -> None:
    """Without noise, with the commands of the log; but for what no clone does, such as widening the view."""
    play = logged.frames["playmode"] == 3
    frames = np.flatnonzero(play[:-1] & play[1:])[:60]
    worlds = worlds_of(match, logged, rules, frames)
    commands = logged.commands.select(frames)
    bodies = step(worlds.bodies, commands, rules, succeeded=logged.succeeded[frames])
    later = worlds.after(bodies, commands, commands.kind)
    world = view(match, side=1)
    tolerance = {"stamina": 0.02, "capacity": 1.1, "body": 0.05}
    for index, name in enumerate(PLAYER_CHANNELS):
        if name in ("view_width", "neck"):
            continue
        np.testing.assert_allclose(
            later.players[..., index],
            world.players[frames + 1][..., index],
            atol=tolerance.get(name, 4e-4),
            err_msg=name,
        )


def test_who_does_as_in_the_log_is_where_the_log_has_them(match: Match, logged: Logged, rules: Rules) -> None:
    """And without noise so is the ball, which nothing but the step moves."""
    play = logged.frames["playmode"] == 3
    runs = [frame for frame in range(len(play) - 20) if play[frame : frame + 21].all()]
    frames = np.array(runs[::20])
    assert len(frames) >= 4
    went = simulate(
        worlds_of(match, logged, rules, frames), frames, [AsLogged(logged, EVERYBODY)], horizon=20, rng=None
    )
    at = frames[:, None] + np.arange(21)
    np.testing.assert_allclose(went.x[..., :BALL], logged.bodies.x[at][..., :BALL], atol=1e-5)
    off = np.hypot(went.x - logged.bodies.x[at], went.y - logged.bodies.y[at])[..., BALL]
    assert np.median(off[:, -1]) < 0.05


def test_who_goes_on_keeps_the_velocity(match: Match, logged: Logged, rules: Rules) -> None:
    frames = np.array([10])
    worlds = worlds_of(match, logged, rules, frames)
    went = simulate(worlds, frames, [GoingOn.of(worlds, EVERYBODY)], horizon=3, rng=None)
    steps = np.diff(went.x[0, :, :BALL], axis=0)
    free = ~(np.abs(steps - steps[0]) > 1e-5).any(axis=0)
    assert free.sum() > 15
    decay = rules.types["player_decay"][logged.bodies.type[10]]
    np.testing.assert_allclose(steps[0][free], (logged.bodies.vx[10, :BALL] / decay)[free], atol=1e-4)


@pytest.fixture(scope="module")
def clone() -> Clone:
    torch.manual_seed(0)
    config = EgocentricConfig(
        blocks=("self", "role", "ball"),
        kick_blocks=("ball", "mates"),
        hidden=(16,),
        target_points=2,
        target_hidden=(16,),
        parameter_hidden=(16,),
        kick_hidden=(16,),
        kick_attention=0,
    )
    return Clone(config).eval()


@pytest.mark.parametrize("side", [1, -1])
def test_a_clone_moves_its_field_players_and_nobody_else(
    match: Match, logged: Logged, rules: Rules, clone: Clone, side: int
) -> None:
    frames = np.array([10, 30])
    others = np.ones(N_PLAYERS, np.bool_)
    others[slots_of(side)] = False
    others |= logged.bodies.goalie[0]

    def run(seed: int, *, point: bool) -> np.ndarray:
        policies = [Cloned(clone, side, point, torch.Generator().manual_seed(seed)), AsLogged(logged, others)]
        rng = None if point else np.random.default_rng(seed)
        went = simulate(worlds_of(match, logged, rules, frames), frames, policies, horizon=8, rng=rng)
        return np.stack([went.x, went.y], axis=-1)

    one, again, other = run(1, point=False), run(1, point=False), run(2, point=False)
    np.testing.assert_array_equal(one, again)
    own = ~others
    assert own.sum() == N_TEAM - 1
    assert (np.abs(one - other)[:, -1, :BALL][:, own] > 1e-3).any(axis=-1).mean() > 0.9
    np.testing.assert_array_equal(one[:, :, :BALL][:, :, others], other[:, :, :BALL][:, :, others])
    np.testing.assert_array_equal(run(1, point=True), run(2, point=True))
    # No player is faster than the server allows, noise included.
    assert np.hypot(*np.moveaxis(np.diff(one[:, :, :BALL][:, :, own], axis=1), -1, 0)).max() < 1.05 * 1.1 + 0.6
