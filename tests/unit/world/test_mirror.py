from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.synthetic import make_dataset

from teamclone.dataset.reader import open_dataset
from teamclone.engine.inputs.layout import BLOCKS, GEOMETRY
from teamclone.models.inputs.egocentric import EgocentricFeatures
from teamclone.models.inputs.paper import PaperFeatures
from teamclone.rcss.commands import CLONED, REPERTOIRE
from teamclone.world.channels import CHANNEL
from teamclone.world.mirror import mirror_places, mirror_state, mirror_target
from teamclone.world.state import State, Target

# 4-3-3: goalkeeper, centre backs 2 3, full backs 4 5, and so on; numbers of a side need not be neighbours.
FORMATION = np.array(
    [(-50, 0), (-36, -6), (-35, 6), (-33, -18), (-33, 19), (-20, 0), (-12, -11), (-12, 12), (10, -20), (9, 21), (14, 0)]
)
PLACES = mirror_places(np.concatenate([FORMATION, -FORMATION]))


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> State:
    dataset = open_dataset(make_dataset(tmp_path_factory.mktemp("data") / "ds", frames_per_match=20))
    return dataset.state(np.arange(len(dataset)), history=3)


def test_the_left_full_back_becomes_the_right_one() -> None:
    assert (PLACES[:11] + 1).tolist() == [1, 3, 2, 5, 4, 6, 8, 7, 10, 9, 11]
    assert PLACES[11:].tolist() == list(range(11, 22)), "opponents keep their places"


def test_who_never_played_is_his_own_counterpart() -> None:
    mean = np.concatenate([FORMATION, -FORMATION]).astype(float)
    mean[[3, 10]] = np.nan
    places = mirror_places(mean)
    assert [places[3], places[10]] == [3, 10]
    assert (places[places] == torch.arange(22)).all()


@settings(max_examples=50)
@given(seed=st.integers(0, 2**31))
def test_counterparts_go_in_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # On a coarse grid, where matchings are equally good.
    places = mirror_places(rng.integers(-2, 3, (22, 2)).astype(float))
    assert (places[places] == torch.arange(22)).all()


def test_mirroring_twice_is_nothing(state: State) -> None:
    twice = mirror_state(mirror_state(state, PLACES), PLACES)
    for one, other in zip(state, twice, strict=True):
        assert torch.equal(one, other)
    parameters = torch.tensor([[50.0, -90.0], [45.0, 0.0], [100.0, 180.0], [-18.0, 0.0]])
    target = Target(torch.arange(4), parameters, torch.linspace(-1.0, 2.0, 16).view(4, 2, 2))
    for one, other in zip(target, mirror_target(mirror_target(target)), strict=True):
        assert torch.equal(one, other)


def test_intervals_change_sides_with_their_parameters() -> None:
    interval = torch.tensor([[[-1.0, 2.0], [-3.0, 4.0]], [[-5.0, 6.0], [-torch.inf, torch.inf]]])
    target = mirror_target(Target(torch.tensor([0, 1]), torch.tensor([[50.0, 10.0], [20.0, 0.0]]), interval))
    assert target.interval is not None
    assert target.interval.tolist() == [[[-1, 2], [-4, 3]], [[-6, 5], [-torch.inf, torch.inf]]]
    assert target.known.tolist() == [[True, True], [True, False]]


def test_a_mirrored_state_by_hand(state: State) -> None:
    mirrored = mirror_state(state, PLACES)
    assert torch.equal(mirrored.ball, state.ball * torch.tensor([1, -1, 1, -1]))
    for name, sign in {"x": 1, "y": -1, "vx": 1, "vy": -1, "body": -1, "neck": -1, "stamina": 1, "type": 1}.items():
        channel = CHANNEL[name]
        assert torch.equal(mirrored.players[:, 4, channel], sign * state.players[:, 3, channel]), name
        assert torch.equal(mirrored.past_players[:, 1, 4, channel], sign * state.past_players[:, 1, 3, channel]), name
    assert torch.equal(mirrored.types[:, 4], state.types[:, 3])
    assert torch.equal(mirrored.actor[state.actor == 3], torch.full_like(mirrored.actor[state.actor == 3], 4))
    assert torch.equal(mirrored.past_ball[..., 3], -state.past_ball[..., 3])


def test_a_mirrored_command_by_hand() -> None:
    target = Target(torch.arange(4), torch.tensor([[50.0, -90.0], [45.0, 0.0], [100.0, 179.0], [-18.0, 0.0]]))
    mirrored = mirror_target(target)
    assert torch.equal(mirrored.kind, target.kind)
    assert mirrored.parameters.tolist() == [[50, 90], [-45, 0], [100, -179], [18, 0]]


def test_a_mirrored_catch_and_move_by_hand() -> None:
    parameters = torch.tensor([[30.0, 0.0], [-20.0, 7.0], [0.0, 0.0], [-18.0, 0.0]])
    mirrored = mirror_target(Target(torch.tensor([4, 5, 6, 1]), parameters), REPERTOIRE)
    assert mirrored.parameters.tolist() == [[-30, 0], [-20, -7], [0, 0], [18, 0]]
    without_catch = mirror_target(Target(torch.tensor([4]), parameters[1:2]), (*CLONED, "move"))
    assert without_catch.parameters.tolist() == [[-20, -7]]


def test_the_papers_inputs_of_a_mirrored_state(state: State) -> None:
    features = PaperFeatures(own_type=True)
    columns, mirrored = (
        dict(zip(features.names, features.project(of).unbind(1), strict=True))
        for of in (state, mirror_state(state, PLACES))
    )
    for name, column in columns.items():
        who, _, what = name.rpartition("_") if not name.startswith("actor") else ("actor", "_", name[6:])
        who, what = (name.rsplit("_", 1)) if who == "ball" else (who, what)
        if who.startswith("team"):
            who = f"team_{PLACES[int(who[5:]) - 1] + 1}"
        sign = -1 if what in {"y", "vy", "body"} else 1
        assert torch.equal(mirrored[f"{who}_{what}"], sign * column), name


@pytest.mark.parametrize(
    "features", [PaperFeatures(own_type=True, all_types=("movement",)), EgocentricFeatures(BLOCKS)]
)
def test_inputs_of_a_mirrored_state_are_those_of_the_state(
    state: State, features: PaperFeatures | EgocentricFeatures
) -> None:
    """With other signs and in other columns. Of ties, see below, and of plans an odd sample may differ."""
    plain, mirrored = (features.project(of) for of in (state, mirror_state(state, PLACES)))
    differ = (plain * features.signs)[:, features.counterparts(PLACES)] != mirrored
    share = differ.any(1).double().mean()
    assert share == 0 if isinstance(features, PaperFeatures) else share < 0.02


def test_relative_inputs_of_a_mirrored_state(state: State) -> None:
    """Each column is the same or its opposite; role, which knows the number, the counterpart's."""
    features = EgocentricFeatures(BLOCKS)
    columns, mirrored = (features.project(of).double() for of in (state, mirror_state(state, PLACES)))
    names = [name.rpartition("_")[0] for name in features.names]
    role = [i for i, name in enumerate(names) if name == "role"]
    assert torch.equal(mirrored[:, role], columns[:, [role[PLACES[i]] for i in range(11)]])
    odd = []
    for i, name in enumerate(features.names):
        if i in role:
            continue
        # Of two opponents that are equally near, or a limit just reached, rounding decides: the odd sample may differ.
        same, opposite = (
            float(((mirrored[:, i] - sign * columns[:, i]).abs() < 1e-3).double().mean()) for sign in (1, -1)
        )
        assert max(same, opposite) > 0.98, (name, same, opposite)
        if opposite > same:
            odd.append(name)
    geometry = {name for name in odd if name in GEOMETRY}
    assert geometry >= {"y", "coast_y", "sin", "aside", "ball_y", "ball_vy", "turn_to_ball", "turn_to_meet", "mate_0_y"}
    assert not geometry & {"x", "coast_x", "cos", "forward", "ball_x", "ball_vx", "line_x", "kick_gain", "mate_0_x"}
    # The ball ahead of the player and aside of him, its distance, cosine and sine.
    assert [f"ball_{i}" in odd for i in range(5)] == [False, True, False, False, True]
