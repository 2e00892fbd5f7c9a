"""The other players, in no order, and what a straight kick to each of them meets."""

from __future__ import annotations

import math

import pytest
import torch
from tests.situations import situations

from teamclone.engine.inputs.layout import MATES, OTHER, OTHERS
from teamclone.engine.network.constants import PLAYER_COLUMNS, RUN_SPEED, TARGETS
from teamclone.models.inputs.egocentric import EgocentricFeatures
from teamclone.models.inputs.geometry import Inputs
from teamclone.models.layers.players import PlayerEncoder
from teamclone.world.channels import CHANNEL, FLAG_ON_FIELD
from teamclone.world.state import State


def inputs_of(state: State) -> Inputs:
    features = EgocentricFeatures(("ball",), others=True)
    return features.layout.unpack(features.project(state))


def placed(ball: tuple[float, float], mates: list[tuple[float, float]], opponents: list[tuple[float, float]]) -> Inputs:
    """The inputs of one situation in which only these are on the field beside the actor, who has the ball."""
    state = situations(1)
    players, actor = torch.zeros_like(state.players), 10
    for slot, (x, y) in [*enumerate(mates), (actor, ball), *enumerate(opponents, 11)]:
        players[0, slot, CHANNEL["x"]], players[0, slot, CHANNEL["y"]] = x, y
        players[0, slot, CHANNEL["flags"]] = FLAG_ON_FIELD
    return inputs_of(
        State.now(
            ball=torch.tensor([[*ball, 0.0, 0.0]]), players=players, types=state.types, actor=torch.tensor([actor])
        )
    )


def test_the_others_are_the_players_of_the_state() -> None:
    state = situations(20)
    others = inputs_of(state).others
    assert others.shape == (20, OTHERS, len(OTHER))
    for row, (actor, players) in enumerate(zip(state.actor.tolist(), state.players, strict=True)):
        distance = (players[:, :2] - players[actor, :2]).norm(dim=1)
        for first, slots in ((0, [slot for slot in range(11) if slot != actor]), (MATES, list(range(11, 22)))):
            for place, slot in enumerate(sorted(slots, key=distance.tolist().__getitem__), first):
                found = dict(zip(OTHER, others[row, place].tolist(), strict=True))
                body = math.radians(players[slot, CHANNEL["body"]].item())
                expected = {name: players[slot, CHANNEL[name]].item() for name in ("x", "y", "vx", "vy")}
                expected |= {"cos": math.cos(body), "sin": math.sin(body), "there": 1.0, "keeper": 0.0}
                assert found == pytest.approx(expected, abs=1e-5)


def test_who_is_not_there_is_all_zeros() -> None:
    others = placed((0, 0), [(10, 0)], [(20, 0), (30, 0)]).others[0]
    there = others[:, OTHER.index("there")]
    assert there.tolist() == [1.0] + [0.0] * 9 + [1.0, 1.0] + [0.0] * 9
    assert others[there == 0].abs().max() == 0


def encoder(width: int = 8) -> PlayerEncoder:
    torch.manual_seed(0)
    return PlayerEncoder(width, 3)


def test_the_order_of_the_others_means_nothing() -> None:
    inputs, situation = inputs_of(situations(30)), torch.rand(30, 3)
    mates, opponents = torch.randperm(MATES), torch.randperm(OTHERS - MATES)
    order = torch.cat([mates, MATES + opponents])
    turned = inputs._replace(others=inputs.others[:, order])
    model = encoder()
    (together, targets), (other_together, other_targets) = (model(situation, of) for of in (inputs, turned))
    torch.testing.assert_close(other_together, together)
    torch.testing.assert_close(other_targets[:, :MATES], targets[:, mates])
    torch.testing.assert_close(other_targets[:, MATES:], targets[:, MATES:])
    assert targets.shape == (30, TARGETS, 8)


def test_each_hangs_on_all_others_and_on_the_situation() -> None:
    inputs = inputs_of(situations(5))
    others = inputs.others.clone().requires_grad_()
    situation = torch.rand(5, 3, requires_grad=True)
    _, targets = encoder()(situation, inputs._replace(others=others))
    # Of what is normalised the plain sum hangs on nothing.
    some = (targets * torch.arange(8.0)).sum(2)
    for target in range(TARGETS):
        of_others, of_situation = torch.autograd.grad(some[:, target].sum(), (others, situation), retain_graph=True)
        assert (of_others.abs().amax((0, 2)) > 1e-4).all()
        assert (of_situation.abs().amax(0) > 1e-4).all()


def test_no_situation_at_all_is_answered() -> None:
    together, targets = encoder()(torch.zeros(0, 3), inputs_of(situations(2).select(slice(0, 0))))
    assert together.shape == (0, 8)
    assert targets.shape == (0, TARGETS, 8)


def lane(mate: tuple[float, float], *opponents: tuple[float, float]) -> list[float]:
    """Of the kick from (10, 5) to a team mate: radians, cycles, metres to the nearest opponent, metres."""
    columns = encoder().columns(placed((10, 5), [mate], list(opponents)))
    assert columns.shape == (1, OTHERS + 1, PLAYER_COLUMNS)
    angle, ahead, nearest, distance = columns[0, 0, -4:].tolist()
    return [angle, 10 * ahead, 10 * nearest, 20 * distance]


def test_a_lane_without_opponents_is_free() -> None:
    assert lane((30, 5)) == pytest.approx([math.pi, 20, 20, 20], rel=1e-3)


def test_the_opponent_nearest_to_a_lane_counts() -> None:
    # After 10 m a ball that begins with 2.7 m a cycle has rolled for ln(1 - 10 * 0.06 / 2.7) / ln(0.94) cycles.
    rolled = math.log(1 - 10 * 0.06 / 2.7) / math.log(0.94)
    run = (4 - 1) / RUN_SPEED + 1
    expected = [math.atan2(4, 10), run - rolled, math.hypot(10, 4), 20]
    assert lane((30, 5), (20, 9)) == pytest.approx(expected, rel=1e-3)
    # One behind the kicker, one far behind the team mate and one further aside change nothing but who is near.
    assert lane((30, 5), (20, 9), (0, 5), (45, 5), (20, -2)) == pytest.approx(expected, rel=1e-3)
    assert lane((10, 25), (6, 15)) == pytest.approx(expected, rel=1e-3)


def test_the_goal_is_among_them() -> None:
    columns = encoder().columns(placed((10, 5), [(30, 5)], []))[0]
    assert columns[OTHERS, :2].tolist() == pytest.approx([42.5 / 20, -5 / 20])
    assert columns[:, OTHER.index("there") + 3].tolist() == [1.0] + [0.0] * 20 + [1.0]
    assert columns[:, -6:-4].tolist() == [[0, 0]] * MATES + [[1, 0]] * (OTHERS - MATES) + [[0, 1]]
