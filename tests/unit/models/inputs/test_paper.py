from __future__ import annotations

import pytest
import torch

from teamclone.models.inputs.paper import Normalisation, PaperFeatures
from teamclone.rcss.player_types import DEFAULTS, FIELDS
from teamclone.world.channels import CHANNEL, TYPE_FIELD
from teamclone.world.state import State


def states(batch: int = 1) -> State:
    """Everything at zero, all players of the default type, player 0 acts."""
    types = torch.tensor(list(DEFAULTS.values())).expand(batch, 22, len(FIELDS)).clone()
    return State.now(
        ball=torch.zeros(batch, 4),
        players=torch.zeros(batch, 22, len(CHANNEL)),
        types=types,
        actor=torch.zeros(batch, dtype=torch.int64),
    )


def column(features: PaperFeatures, state: State, name: str) -> float:
    return float(features.project(state)[0, features.names.index(name)])


def test_the_inputs_are_those_of_table_one() -> None:
    names = PaperFeatures().names
    assert len(names) == len(set(names)) == 119
    rows = {"ball": ("x", "y", "vx", "vy"), "actor": ("x", "y", "body", "vx", "vy")}
    table = {f"{thing}_{feature}" for thing, features in rows.items() for feature in features}
    table |= {
        f"{side}_{number}_{feature}"
        for side in ("team", "opponent")
        for number in range(1, 12)
        for feature in ("x", "y", "body", "vx", "vy")
    }
    assert set(names) == table


@pytest.mark.parametrize(
    ("own_type", "all_types", "count"),
    [
        (True, (), 127),
        (False, ("movement",), 119 + 3 * 22),
        (False, ("kick",), 119 + 2 * 22),
        (False, ("stamina",), 119 + 3 * 22),
        (True, ("movement", "kick", "stamina"), 127 + 8 * 22),
    ],
)
def test_player_types_add_inputs(own_type: bool, all_types: tuple[str, ...], count: int) -> None:
    features = PaperFeatures(own_type=own_type, all_types=all_types)
    assert len(features.names) == len(set(features.names)) == count
    assert features(states(3)).shape == (3, count)


def test_positions_are_divided_by_what_the_server_clips_players_to() -> None:
    features, state = PaperFeatures(), states()
    state.ball[0, :2] = torch.tensor([57.5, -39.0])
    state.players[0, 12, CHANNEL["x"]] = -28.75
    state.players[0, 12, CHANNEL["y"]] = 39.0
    assert column(features, state, "ball_x") == pytest.approx(1)
    assert column(features, state, "ball_y") == pytest.approx(-1)
    assert column(features, state, "opponent_2_x") == pytest.approx(-0.5)
    assert column(features, state, "opponent_2_y") == pytest.approx(1)


def test_velocities_are_divided_by_their_true_maximum_after_decay() -> None:
    features, state = PaperFeatures(), states()
    state.ball[0, 2:] = torch.tensor([3.0 * 0.94, -1.41])
    state.types[0, 4, TYPE_FIELD["player_decay"]] = 0.5
    state.players[0, 3, CHANNEL["vx"]] = 1.05 * 0.4
    state.players[0, 4, CHANNEL["vx"]] = 1.05 * 0.5
    state.players[0, 4, CHANNEL["vy"]] = -0.13125
    assert column(features, state, "ball_vx") == pytest.approx(1)
    assert column(features, state, "ball_vy") == pytest.approx(-0.5)
    assert column(features, state, "team_4_vx") == pytest.approx(1)
    assert column(features, state, "team_5_vx") == pytest.approx(1)
    assert column(features, state, "team_5_vy") == pytest.approx(-0.25)


def test_nothing_is_clipped() -> None:
    features, state = PaperFeatures(), states()
    state.ball[0, 0] = 115.0
    assert column(features, state, "ball_x") == pytest.approx(2)


def test_the_actor_is_repeated_as_the_players_say_him() -> None:
    features, state = PaperFeatures(own_type=True), states(2)
    state.actor[:] = torch.tensor([6, 9])
    for index, name in enumerate(("x", "y", "body", "vx", "vy")):
        state.players[..., CHANNEL[name]] = torch.arange(22) + 100.0 * index
    state.types[..., TYPE_FIELD["kick_rand"]] = torch.arange(22) / 100
    projected = features.project(state)
    for name in ("x", "y", "body", "vx", "vy"):
        for row, number in ((0, 7), (1, 10)):
            actor, player = (features.names.index(f"{who}_{name}") for who in ("actor", f"team_{number}"))
            assert projected[row, actor] == projected[row, player]
    assert projected[:, features.names.index("actor_kick_rand")].tolist() == pytest.approx([-0.4, -0.1])


def test_each_value_moves_its_own_columns_only() -> None:
    """No column mixes players, sides or channels."""
    features = PaperFeatures(own_type=True, all_types=("movement", "kick", "stamina"))
    state = states()
    state.actor[0] = 2
    state = state._replace(players=torch.rand(1, 22, len(CHANNEL)), ball=torch.rand(1, 4))
    before = features.project(state)[0]
    for player, who in ((2, "team_3"), (10, "team_11"), (11, "opponent_1"), (21, "opponent_11")):
        for name in ("x", "y", "body", "vx", "vy"):
            changed = state._replace(players=state.players.clone())
            changed.players[0, player, CHANNEL[name]] += 1
            moved = {features.names[i] for i in (features.project(changed)[0] != before).nonzero()[:, 0]}
            assert moved == {f"{who}_{name}"} | ({f"actor_{name}"} if player == 2 else set())
        changed = state._replace(types=state.types.clone())
        changed.types[0, player, TYPE_FIELD["effort_max"]] -= 0.05
        moved = {features.names[i] for i in (features.project(changed)[0] != before).nonzero()[:, 0]}
        assert moved == {f"{who}_effort_max"} | ({"actor_effort_max"} if player == 2 else set())


def test_type_parameters_are_projected_by_what_the_server_draws() -> None:
    features, state = PaperFeatures(own_type=True), states()
    for name, value in (("dash_power_rate", 0.0048), ("extra_stamina", 100.0), ("inertia_moment", 5.0)):
        state.types[0, 0, TYPE_FIELD[name]] = value
    assert column(features, state, "actor_dash_power_rate") == pytest.approx(-1, abs=1e-5)
    assert column(features, state, "actor_extra_stamina") == pytest.approx(1)
    assert column(features, state, "actor_inertia_moment") == pytest.approx(0, abs=1e-6)


def test_normalisation_is_fitted_over_all_chunks() -> None:
    torch.manual_seed(0)
    values = torch.randn(1000, 3) * torch.tensor([2.0, 0.1, 0.0]) + torch.tensor([5.0, -1.0, 7.0])
    normalisation = Normalisation(3)
    normalisation.fit(values.split(300))
    assert normalisation.mean.tolist() == pytest.approx(values.mean(0).tolist())
    assert normalisation.std[:2].tolist() == pytest.approx(values.std(0, correction=0)[:2].tolist(), rel=1e-4)
    result = normalisation(values)
    assert result.mean(0).tolist() == pytest.approx([0, 0, 0], abs=1e-5)
    # The constant column is shifted, not blown up.
    assert result[:, 2].abs().max() < 1e-5
    assert normalisation.std[2] == 1
