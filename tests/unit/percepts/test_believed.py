"""A match as its players believe it: worlds, datasets and predictions see the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import torch

from teamclone.dataset.build import DatasetConfig, build_dataset
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import DatasetError, UsageError
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.evaluation.prediction_table import predict_match
from teamclone.export.contract import samples_of
from teamclone.logs import Match, read_match
from teamclone.models.clone import Clone
from teamclone.models.config import EgocentricConfig
from teamclone.percepts.believed import Believed, perceive
from teamclone.percepts.sight import BALL
from teamclone.rcss.reference_frame import rotate_angle, rotate_point
from teamclone.store import create_store
from teamclone.training.config import Config
from teamclone.training.run import Run
from teamclone.training.setup import check_fits
from teamclone.world.channels import CHANNEL
from teamclone.world.view import view

TEAM = "HELIOS_base"
BLOCKS = ("self", "ball", "reach", "view", "age")
OTHER_FRAME = 150


@pytest.fixture(scope="module")
def match(fixtures_dir: Path) -> Match:
    return read_match(next((fixtures_dir / "v6").glob("*.rcg.gz")))


@pytest.fixture(scope="module")
def datasets(match: Match, tmp_path_factory: pytest.TempPathFactory) -> dict[bool, Dataset]:
    folder = tmp_path_factory.mktemp("believed")
    store = create_store(folder / "store")
    store.add(match)
    made = {}
    for percepts in (False, True):
        config = DatasetConfig(teams=(TEAM,), percepts=percepts)
        build_dataset(config, store=store, out=folder / str(percepts), jobs=1)
        made[percepts] = open_dataset(folder / str(percepts))
    return made


def side_of(match: Match) -> int:
    return 1 if match.left.name == TEAM else -1


def believed(match: Match, side: int) -> Believed:
    game = match.game
    _, memory = perceive(game.frames, game.players, types=game.player_types, params=game.server_params)
    return Believed(world=view(match, side=side), memory=memory)


@pytest.mark.parametrize("side", [1, -1])
def test_each_frame_is_what_its_actor_believes(match: Match, side: int) -> None:
    made = believed(match, side)
    frame, actor = np.array([OTHER_FRAME, OTHER_FRAME, OTHER_FRAME + 1]), np.array([6, 9, 6])
    world, memory = made.select(frame, actor), made.memory
    assert len(world) == 3
    for row in range(3):
        me = actor[row] + (0 if side > 0 else 11)
        place, velocity = memory.place[frame[row], me], memory.velocity[frame[row], me]
        if side < 0:
            place, velocity = (np.roll(rotate_point(values)[:BALL], 11, axis=0) for values in (place, velocity))
            ball = rotate_point(memory.place[frame[row], me, BALL])
        else:
            place, velocity, ball = place[:BALL], velocity[:BALL], memory.place[frame[row], me, BALL]
        others = np.arange(BALL) != actor[row]
        assert world.ball[row, :2] == pytest.approx(ball)
        assert world.channel("x")[row][others] == pytest.approx(place[others, 0])
        assert world.channel("vy")[row][others] == pytest.approx(velocity[others, 1])
        assert world.channel("age")[row, actor[row]] == memory.age[frame[row], me, BALL]
    # Of itself and of all that nobody sees a player has what the log has.
    truth = made.world.players[frame, actor]
    mine = world.players[np.arange(3), actor]
    assert np.delete(mine, CHANNEL["age"], axis=1) == pytest.approx(
        np.delete(truth, CHANNEL["age"], axis=1), nan_ok=True
    )
    assert (world.channel("stamina") == made.world.channel("stamina")[frame]).all()
    assert (made.world.channel("age") == 0).all()


def test_body_directions_are_those_last_seen(match: Match) -> None:
    left, right = believed(match, 1), believed(match, -1)
    one, other = (
        left.select(np.array([OTHER_FRAME]), np.array([4])),
        right.select(np.array([OTHER_FRAME]), np.array([4])),
    )
    memory = left.memory
    assert one.channel("body")[0, 15] == memory.body[OTHER_FRAME, 4, 15]
    assert other.channel("body")[0, 3] == pytest.approx(rotate_angle(memory.body[OTHER_FRAME, 15, 14]))


def test_a_dataset_has_the_same_commands_and_a_frame_for_each(match: Match, datasets: dict[bool, Dataset]) -> None:
    plain, seen = datasets[False], datasets[True]
    assert not plain.percepts
    assert seen.percepts
    for name in ("player", "kind", "parameters", "executed", "split"):
        assert (seen.samples[name].numpy() == plain.samples[name].numpy()).all()
    assert seen.samples["frame"].tolist() == list(range(len(seen)))
    state = seen.state(np.arange(len(seen)))
    cycle = plain.frames["cycle"][plain.samples["frame"].long()].numpy()
    frame = np.flatnonzero(match.frames["stoppage"] == 0)[
        np.searchsorted(match.frames["cycle"][match.frames["stoppage"] == 0], cycle)
    ]
    world = believed(match, side_of(match)).select(frame, state.actor.numpy())
    assert state.ball.numpy() == pytest.approx(world.ball, abs=1e-6)
    assert state.players[..., CHANNEL["age"]].numpy() == pytest.approx(world.channel("age"))
    assert state.players[..., CHANNEL["x"]].numpy() == pytest.approx(world.channel("x"), abs=1e-6)
    assert state.players[..., CHANNEL["vx"]].numpy() == pytest.approx(world.channel("vx"), abs=6e-5)
    assert 0 < float(state.players[..., CHANNEL["age"]].mean()) < 60


def test_a_prediction_sees_what_training_saw(match: Match, datasets: dict[bool, Dataset]) -> None:
    torch.manual_seed(1)
    model = Clone(small(BLOCKS)).eval()
    seen = datasets[True]
    state = seen.state(np.arange(len(seen)))
    model.inputs.fit([model.inputs.project(state)])
    expected, _ = model.predict(state)
    table = predict_match(model, MatchColumns.of(match), side=side_of(match)).to_arrow()
    by_row: dict[tuple[int, int], Any] = {
        (row["cycle"], row["unum"]): [row[f"p_{name}"] for name in model.config.commands] for row in table.to_pylist()
    }
    cycle, unum = seen.frames["cycle"].tolist(), (state.actor + 1).tolist()
    got = torch.tensor([by_row[key] for key in zip(cycle, unum, strict=True)])
    # A dataset has velocities in steps, by which one of a thousand players is at the ball a cycle later.
    off = (got - expected.detach()).abs().amax(1)
    assert float(off.quantile(0.99)) < 1e-3


def small(blocks: tuple[str, ...]) -> EgocentricConfig:
    sizes: dict[str, Any] = dict.fromkeys(("hidden", "parameter_hidden", "kick_hidden", "target_hidden"), (8,))
    return replace(EgocentricConfig(), blocks=blocks, kick_blocks=("ball",), **sizes)


def test_a_model_and_a_dataset_that_do_not_go_together_are_told(datasets: dict[bool, Dataset]) -> None:
    rows = np.arange(10)
    with pytest.raises(DatasetError, match="make the dataset with --percepts"):
        datasets[False].need(Clone(small(BLOCKS)).inputs.channels, rows)
    datasets[True].need(Clone(small(BLOCKS)).inputs.channels, rows)
    with pytest.raises(UsageError, match="--preset tournament"):
        check_fits(replace(Config(), model=small(("self",))), datasets[True])
    check_fits(replace(Config(), model=small(BLOCKS)), datasets[True])
    with pytest.raises(DatasetError, match="leave the block past out"):
        datasets[True].need(("x",), rows, history=3)
    late = np.arange(len(datasets[True]) - 10, len(datasets[True]))
    assert not datasets[True].state(late, history=3).past_known.any()
    assert datasets[False].state(late, history=3).past_known.any()


def test_a_match_whose_log_does_not_show_where_players_look_is_left_out(match: Match, tmp_path: Path) -> None:
    players = {**match.game.players, "neck": np.full_like(match.game.players["neck"], np.nan)}
    blind = replace(match, match_id="b" * 16, game=replace(match.game, players=players))
    store = create_store(tmp_path / "store")
    for one in (match, blind):
        store.add(one)
    report = build_dataset(DatasetConfig(teams=(TEAM,), percepts=True), store=store, out=tmp_path / "ds", jobs=1)
    left_out = {row["match_id"]: row["left_out"] for row in report["matches"]}
    assert left_out == {match.match_id: None, "b" * 16: "the log does not show neck: logs of version 3 and later do"}


def test_a_contract_of_an_export_has_states_as_players_believe_them(datasets: dict[bool, Dataset]) -> None:
    run = cast(Run, SimpleNamespace(dataset_path=datasets[True].path))
    samples = samples_of(run, Clone(small(BLOCKS)), 20)
    assert samples["players"][..., CHANNEL["age"]].max() > 0
    assert not samples["past_known"].any()


def test_who_needs_beliefs_is_not_asked_where_there_are_none() -> None:
    with pytest.raises(UsageError, match="which a roll-out cannot give it yet"):
        Clone(small(BLOCKS)).need_log_view("a roll-out")
    Clone(small(("self",))).need_log_view("a roll-out")
