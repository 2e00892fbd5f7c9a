"""What a team sees of a match: the log's own values, from its side."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from teamclone.dataset.build import DatasetConfig, build_dataset
from teamclone.dataset.reader import open_dataset
from teamclone.logs import Match, read_match
from teamclone.logs.align import executed_kind
from teamclone.rcss.playmodes import OTHER_SIDE
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.store import create_store, ingest
from teamclone.world.channels import CHANNEL, FLAG_GOALIE, FLAG_ON_FIELD, MEASURED
from teamclone.world.state import State
from teamclone.world.view import view, view_columns


@pytest.fixture(scope="module")
def match(samples_dir: Path) -> Match:
    return read_match(sorted(samples_dir.glob("*HELIOS_base_8-vs-WEBase_0.rcg.xz"))[0])


def test_the_left_team_sees_the_log_as_it_is(match: Match) -> None:
    world = view(match, side=1)
    assert len(world) == len(match.frames["cycle"])
    for name in ("x", "y", *(channel.name for channel in MEASURED)):
        np.testing.assert_array_equal(world.channel(name), match.players[name])
    np.testing.assert_array_equal(world.ball[:, 0], match.frames["ball_x"])
    np.testing.assert_array_equal(world.mode, match.frames["playmode"])
    assert world.score[-1].tolist() == [match.left.score, match.right.score]
    executed = executed_kind(match.frames, match.players)
    np.testing.assert_array_equal(world.channel("last_command")[1:], executed[:-1])
    flags = world.channel("flags")[10].astype(int)
    assert ((flags & FLAG_ON_FIELD) != 0).all()
    assert ((flags & FLAG_GOALIE) != 0).sum() == 2


def test_the_right_team_sees_it_turned_and_itself_first(match: Match) -> None:
    left, right = view(match, side=1), view(match, side=-1)
    turn = np.roll(np.arange(22), 11)
    for name, sign in (("x", -1), ("y", -1), ("vx", -1), ("vy", -1), ("neck", 1), ("stamina", 1), ("type", 1)):
        np.testing.assert_array_equal(right.channel(name), sign * left.channel(name)[:, turn])
    away = right.channel("body") - left.channel("body")[:, turn]
    np.testing.assert_allclose(np.abs(away), 180, atol=1e-3)
    np.testing.assert_array_equal(right.ball, -left.ball)
    np.testing.assert_array_equal(right.mode, OTHER_SIDE[left.mode])
    np.testing.assert_array_equal(right.score, left.score[:, ::-1])
    np.testing.assert_array_equal(right.mode_cycles, left.mode_cycles)


def test_how_long_a_mode_lasts_is_counted_over_all_frames(match: Match) -> None:
    world = view(match, side=1)
    count = 0
    for frame in range(1, len(world)):
        begins = world.mode[frame] != world.mode[frame - 1] or world.cycle[frame] > world.cycle[frame - 1] + 1
        count = 0 if begins else count + 1
        assert world.mode_cycles[frame] == count


def test_the_past_ends_where_the_clock_stood(match: Match) -> None:
    world = view(match, side=1)
    frames = np.arange(len(world))
    before, known = world.past(frames, 3)
    assert not known[0].any()
    assert known.mean() > 0.5
    assert (
        world.cycle[before[known]]
        == np.repeat(world.cycle[:, None], 3, 1)[known] - np.tile([1, 2, 3], (len(world), 1))[known]
    ).all()
    assert (before[~known] == np.repeat(frames[:, None], 3, 1)[~known]).all()


def test_server_parameters_are_those_of_the_match(match: Match) -> None:
    params = {**match.game.server_params, "ball_decay": 0.9}
    world = view_columns(match.frames, match.players, types=match.game.player_types, params=params, side=1)
    assert world.server[SERVER_FIELD["ball_decay"]] == 0.9
    assert world.server[SERVER_FIELD["ball_size"]] == 0.085
    state = State.of(world, np.array([5]), np.array([2]))
    assert state.server[0, SERVER_FIELD["ball_decay"]] == pytest.approx(0.9)


def test_a_state_shares_the_frames_of_its_samples(match: Match) -> None:
    world = view(match, side=1)
    frame, actor = np.array([7, 7, 3, 7]), np.array([1, 2, 1, 10])
    state = State.of(world, frame, actor, history=2)
    assert len(state.ball) == 2
    each = state.each()
    np.testing.assert_array_equal(each.ball.numpy(), world.ball[frame])
    np.testing.assert_array_equal(each.players.numpy(), world.players[frame])
    assert each.actor.tolist() == actor.tolist()
    assert each.past_ball.shape == (4, 2, 4)
    some = state.select(torch.tensor([3, 2])).each()
    np.testing.assert_array_equal(some.players.numpy(), world.players[[7, 3]])


def test_an_unknown_type_is_an_error(match: Match) -> None:
    world = view(match, side=1)
    world.players[4, 3, CHANNEL["type"]] = 99
    with pytest.raises(IndexError):
        State.of(world, np.array([4]), np.array([0]))


def test_a_dataset_holds_what_the_team_sees_to_its_resolution(match: Match, samples_dir: Path, tmp_path: Path) -> None:
    store = create_store(tmp_path / "store")
    ingest([samples_dir], store)
    build_dataset(DatasetConfig(teams=("WEBase",)), store=store, out=tmp_path / "dataset")
    dataset = open_dataset(tmp_path / "dataset")
    index = next(i for i, entry in enumerate(dataset.matches) if entry["match_id"] == match.match_id)
    rows = np.flatnonzero(dataset.match(np.arange(len(dataset))).numpy() == index)[::50]
    stored = dataset.state(rows, history=1).each()
    cycles = dataset.frames["cycle"].numpy()[dataset.samples["frame"].numpy()[rows]]
    world = view(match, side=-1)
    frame = np.searchsorted(world.cycle, cycles)  # in play_on the clock runs
    seen = State.of(world, frame, stored.actor.numpy(), history=1).each()
    for name in ("ball", "types", "mode", "mode_cycles", "actor"):
        assert torch.equal(getattr(stored, name), getattr(seen, name)), name
    assert torch.equal(stored.server, seen.server)
    step = {"vx": 1e-4, "vy": 1e-4, "body": 0.01, "neck": 0.01, "view_width": 0.01, "capacity": 4.0, "stamina": 0.25}
    for name, column in CHANNEL.items():
        away = (stored.players[..., column] - seen.players[..., column]).abs()
        assert float(away.max()) <= 0.51 * step.get(name, 1e-4), name
