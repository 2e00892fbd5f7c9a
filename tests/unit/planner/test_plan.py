"""Plans with the ball: single ones played out by the server's rules, and those of agents in real matches."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import torch
from benchmarks.kicks import as_planned, kicked, plans, tackles_as_planned
from tests.situations import put, resting, situations

from teamclone.dataset.build import DatasetConfig, build_dataset
from teamclone.dataset.reader import open_dataset
from teamclone.planner.columns import CHOICES, MOST_VALUE_M, PLAN, VALUED
from teamclone.planner.kick_sequences import ORDER_FIELDS, PLACE_DEG, PLACES, kick_order
from teamclone.rcss.commands import CLONED_KINDS, CommandKind
from teamclone.rcss.server_params import SERVER_DEFAULTS, SERVER_FIELD
from teamclone.store import create_store
from teamclone.store.ingest import ingest
from teamclone.world.channels import CHANNEL, FLAG_GOALIE, FLAG_ON_FIELD, FLAG_TACKLING, TYPE_FIELD
from teamclone.world.mirror import mirror_state
from teamclone.world.state import State

AREA, EDGES, MARGIN = 1.085, 0.385, 0.7
"""Of the default type, with whom all made situations are."""


def scene(
    *, x: float = 0.0, y: float = 0.0, body: float = 0.0, ball: tuple[float, ...] = (0.6, 0.0, 0.0, 0.0)
) -> State:
    """Return a state with player 0 alone on the pitch; the ball has a place seen from the player, and a velocity."""
    state = resting()
    put(state, 0, x=x, y=y, body=body)
    state.ball[0] = torch.tensor(ball) + torch.tensor([x, y, 0.0, 0.0])
    return state


def planned(state: State) -> dict[str, float]:
    return dict(zip(PLAN, plans(state)[0].tolist(), strict=True))


def choice(state: State) -> str:
    made = planned(state)
    chosen = [name for name in CHOICES if made[f"choose_{name}"]]
    assert len(chosen) == 1
    return chosen[0]


def velocity(state: State, way: str) -> tuple[float, float]:
    made = planned(state)
    assert made[f"{way}_there"]
    return made[f"{way}_vx"], made[f"{way}_vy"]


def rolled(state: State, way: str, cycles: int) -> tuple[float, float]:
    """Where the ball is so many cycles after a kick."""
    metres = (1 - 0.94**cycles) / (1 - 0.94)
    vx, vy = velocity(state, way)
    return float(state.ball[0, 0]) + vx * metres, float(state.ball[0, 1]) + vy * metres


def dashed(count: int) -> float:
    """Metres of dashes at full power from rest."""
    speed = covered = 0.0
    for _ in range(count):
        speed += 0.6
        covered += speed
        speed *= 0.4
    return covered


def test_a_player_that_cannot_kick_plans_nothing() -> None:
    state = situations(300, seed=5)
    made = plans(state)
    me = state.players[torch.arange(300), state.actor]
    away = (me[:, :2] - state.ball[:, :2]).norm(dim=1)
    able = made[:, 0] > 0
    assert 20 < int(able.sum()) < 150
    assert (away[able] <= AREA + 0.1).all()
    there, degrees = PLAN.index("tackle_there"), PLAN.index("tackle_degrees")
    tackles = made[:, there] > 0
    assert 10 < int(tackles.sum()) < 150
    assert (tackles & ~able).any()
    assert (away[tackles] < math.hypot(2.0, 1.25)).all()
    assert (made[~tackles, degrees] == 0).all()
    others = [index for index in range(len(PLAN)) if index not in (there, degrees)]
    assert (made[~able][:, others] == 0).all()
    assert (made[able][:, 1 : 1 + len(CHOICES)].sum(1) == 1).all()
    assert torch.isfinite(made).all()
    # One at a time they are the same.
    one = state.select(able).select(slice(1))
    assert torch.equal(plans(one), made[able][:1])
    assert plans(state.select(slice(0))).shape == (0, len(PLAN))


@pytest.mark.parametrize("name", ["vx", "stamina", "effort"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_nothing_is_planned_on_what_no_log_should_hold(name: str, value: float) -> None:
    state = scene()
    put(state, 0, **{name: value})
    assert (plans(state) == 0).all()


@pytest.mark.parametrize(
    ("of_type", "name", "value"),
    [
        (True, "dash_power_rate", 1e9),
        (True, "player_decay", 1.0),
        (True, "kickable_margin", 0.0),
        (True, "inertia_moment", 1e30),
        (False, "effort", 1e9),
        (False, "x", 1e30),
    ],
)
def test_plans_on_whatever_a_log_may_hold_come_to_an_end(of_type: bool, name: str, value: float) -> None:
    state = scene()
    part, place = (state.types, TYPE_FIELD[name]) if of_type else (state.players, CHANNEL[name])
    part[..., place] = value
    state.ball[:, :2] = state.players[:, 0, [CHANNEL["x"], CHANNEL["y"]]]
    assert torch.isfinite(plans(state)).all()


def test_the_ball_may_lie_in_the_middle_of_a_player() -> None:
    state = scene(ball=(0.0, 0.0, 0.0, 0.0))
    put(state, 1, x=0.0, y=0.0)
    put(state, 11, x=0.0, y=0.0)
    made = plans(state)
    assert made[0, 0] == 1
    assert torch.isfinite(made).all()


def test_a_player_alone_passes_to_itself() -> None:
    """20 dashes after the kick far enough up, to where the player then is; in the own half only seven."""
    state = scene(x=21.0)
    assert choice(state) == "self_pass"
    assert rolled(state, "self_pass", 21) == pytest.approx((21.0 + dashed(20), 0.0), abs=1e-3)
    # The ball starts half a metre ahead of the player, which has to pass it.
    back = scene(x=-10.5)
    assert rolled(back, "self_pass", 8) == pytest.approx((-10.5 + dashed(7), 0.0), abs=1e-3)
    assert planned(back)["dribble_value"] < 0 < planned(back)["self_pass_value"]


def test_a_tired_player_runs_less() -> None:
    """2750 are kept; a player with nothing left runs on what is extra, at half power, but does not dribble."""
    state = scene(x=-10.5)
    put(state, 0, stamina=2600.0)
    assert not planned(state)["self_pass_there"]
    put(state, 0, stamina=0.0, capacity=0.0)
    assert planned(state)["self_pass_there"]
    ahead = EDGES + 0.2 * MARGIN
    assert rolled(state, "dribble", 3) == pytest.approx((-10.5 + ahead, 0.0), abs=1e-3)


def test_a_dribble_has_the_ball_just_ahead() -> None:
    """Alone four dashes straight on are worth most; with an opponent at their end it is two or three."""
    state = scene()
    put(state, 0, stamina=3300.0)
    ahead = EDGES + 0.2 * MARGIN
    made = planned(state)
    assert made["dribble_vy"] == pytest.approx(0.0, abs=1e-6)
    assert rolled(state, "dribble", 5) == pytest.approx((dashed(4) + ahead, 0.0), abs=1e-3)
    put(state, 11, x=dashed(4) + ahead, y=0.0, body=180.0)
    ends = [rolled(state, "dribble", 1 + count)[0] - dashed(count) - ahead for count in (2, 3)]
    straight = abs(planned(state)["dribble_vy"]) < 1e-6
    assert not straight or min(map(abs, ends)) < 1e-3


def test_a_pass_meets_a_team_mate_before_opponents() -> None:
    """Where the team mate can be by then; an opponent in its way cuts it off, and another pass is played."""
    state = scene(x=-12.0)
    put(state, 1, x=-6.0, y=3.0)  # in the own half: no pass far ahead
    put(state, 11, x=40.0, y=0.0, flags=FLAG_GOALIE)
    put(state, 12, x=38.0, y=20.0, body=180.0)
    made = planned(state)
    assert made["pass_kicks"] == 1
    to_x, to_y = rolled(state, "pass", int(made["pass_cycles"]))
    assert dashed(int(made["pass_cycles"])) > math.hypot(to_x + 6.0, to_y - 3.0)
    assert to_x > -6.0
    put(state, 13, x=(to_x - 11.4) / 2, y=to_y / 2, body=180.0)
    other = planned(state)
    assert (other["pass_vx"], other["pass_vy"]) != (made["pass_vx"], made["pass_vy"])
    assert other["pass_value"] < made["pass_value"]


@pytest.mark.parametrize("decay", [0.9, 0.96])
def test_a_pass_arrives_by_the_ball_decay_of_the_match(decay: float) -> None:
    """The pass of the defaults would not come to where it is planned, that of the match does."""
    state = scene(x=-12.0)
    put(state, 1, x=-6.0, y=3.0)
    put(state, 11, x=40.0, y=0.0, flags=FLAG_GOALIE)
    put(state, 12, x=38.0, y=20.0, body=180.0)
    usual = velocity(state, "pass")
    state = state._replace(server=state.server.clone())
    state.server[:, SERVER_FIELD["ball_decay"]] = decay
    made = planned(state)
    assert (made["pass_vx"], made["pass_vy"]) != usual
    x, y, vx, vy = (*state.ball[0, :2].tolist(), made["pass_vx"], made["pass_vy"])
    for _ in range(int(made["pass_cycles"])):
        x, y, vx, vy = x + vx, y + vy, vx * decay, vy * decay
    # One of the places where the team mate can be by then: it stands, and others are on rings around it.
    away = math.hypot(x + 6.0, y - 3.0)
    assert away % 1.1 == pytest.approx(0.0, abs=1e-3) or away % 1.1 == pytest.approx(1.1, abs=1e-3)
    assert away < dashed(int(made["pass_cycles"]))


def test_no_pass_to_a_player_that_is_offside_or_tackling() -> None:
    state = scene(x=0.0)
    put(state, 1, x=20.0, y=5.0)
    put(state, 11, x=45.0, y=0.0, flags=FLAG_GOALIE)
    put(state, 12, x=10.0, y=20.0)
    assert not planned(state)["pass_there"]
    put(state, 12, x=25.0, y=20.0)
    assert planned(state)["pass_there"]
    state.players[:, 1, CHANNEL["flags"]] = FLAG_ON_FIELD | FLAG_TACKLING
    assert not planned(state)["pass_there"]


def test_a_free_goal_is_shot_at() -> None:
    state = scene(x=42.0, y=1.0)
    assert choice(state) == "shot"
    vx, vy = velocity(state, "shot")
    assert abs(1.0 + (52.5 - 42.6) * vy / vx) < 7.01 - 0.6
    far = scene(x=20.0)
    assert not planned(far)["shot_there"]


def test_a_challenged_player_clears() -> None:
    """Towards the goal; from the side of the goal line before it."""
    state = scene(x=-10.0)
    put(state, 11, x=-8.6, y=0.0, body=180.0)
    assert choice(state) == "clear"
    vx, vy = velocity(state, "clear")
    assert math.hypot(vx, vy) == pytest.approx(100 * 0.027 * (1 - 0.25 * (0.6 - EDGES) / MARGIN), abs=1e-3)
    assert vy == pytest.approx(0.0, abs=1e-6)
    side = scene(x=40.0, y=15.0)
    put(side, 11, x=41.4, y=15.0)
    vx, vy = velocity(side, "clear")
    assert vy / vx == pytest.approx(-15.0 / (45.0 - 40.6), abs=1e-3)
    # An opponent that tackles is no challenge.
    state.players[:, 11, CHANNEL["flags"]] = FLAG_ON_FIELD | FLAG_TACKLING
    assert choice(state) != "clear"


def test_a_player_that_faces_back_turns_if_nobody_is_near() -> None:
    state = scene(body=180.0, ball=(-0.5, 0.0, 0.0, 0.0))
    assert choice(state) == "turn"
    put(state, 11, x=-3.0, y=1.0)
    assert choice(state) != "turn"


def test_a_nearer_team_mate_has_it() -> None:
    state = scene()
    put(state, 1, x=1.0, y=0.0)
    assert choice(state) == "leave"
    put(state, 1, x=1.5, y=0.0)
    assert choice(state) != "leave"


def test_a_ball_that_is_held_stays_in_reach() -> None:
    """A surrounded player brings it to where it is least in reach of the opponents."""
    state = scene(x=-30.0, y=10.0, ball=(0.2, 0.35, 0.0, 0.0))
    for opponent, degrees in enumerate(range(0, 360, 45), 11):
        angle = math.radians(degrees)
        put(state, opponent, x=-30 + 1.65 * math.cos(angle), y=10 + 1.65 * math.sin(angle), body=float(degrees + 180))
    made = planned(state)
    assert made["hold_there"]
    assert choice(state) == "hold"
    x, y = rolled(state, "hold", 1)
    off = math.hypot(x + 30, y - 10)
    assert any(off == pytest.approx(EDGES + part * MARGIN, abs=1e-3) for part in (0.4, 0.6, 0.75))


def test_what_is_too_much_for_one_kick_is_prepared() -> None:
    """A hard pass of a ball behind the player: the first kick brings it to one of the places beside the player."""
    state = scene(x=10.0, ball=(-0.9, 0.2, 0.0, 0.0))
    put(state, 1, x=30.0, y=8.0)
    for opponent, (x, y) in enumerate(((40.0, 0.0), (36.0, 20.0)), 11):
        put(state, opponent, x=x, y=y, body=180.0)
    made = planned(state)
    assert made["pass_kicks"] > 1
    x, y = rolled(state, "pass", 1)
    off = math.hypot(x - 10.0, y)
    assert any(off == pytest.approx(EDGES + part * MARGIN, abs=1e-3) for part in (0.3, 0.5, 0.7))


def test_kick_order() -> None:
    """Straight ahead those come first that go from far behind the player to far ahead, straight back the others."""
    order = kick_order(tuple(SERVER_DEFAULTS[[*ORDER_FIELDS]]))
    assert order.shape == (72, 1024, 2)
    assert (order.min(), order.max()) == (0, PLACES - 1)
    for direction, sign in ((36, 1.0), (0, -1.0)):
        way = np.cos(np.radians(PLACE_DEG[order[direction]]))  # how far ahead both places are
        gained = sign * (way[:, 1] - way[:, 0])
        assert gained[:50].mean() > 1.5 > gained.mean() > gained[-50:].mean()


def test_a_mirrored_plan_is_the_plan_mirrored() -> None:
    """Mostly: agents go round the places beside a team mate one way, and stop at the first that is another's."""
    state = situations(900, seed=11)
    made, turned = plans(state), plans(mirror_state(state, torch.arange(22)))
    sided = torch.tensor([-1.0 if name.endswith(("_vy", "_degrees")) else 1.0 for name in PLAN])
    degrees = PLAN.index("tackle_degrees")
    around = (made[:, degrees] + turned[:, degrees] + 180) % 360 - 180
    assert (around == 0).float().mean() > 0.95
    made[:, degrees] = turned[:, degrees] = 0
    able = made[:, 0] > 0
    assert torch.equal(able, turned[:, 0] > 0)
    alike = torch.isclose(made[able] * sided, turned[able], atol=1e-3).all(1)
    assert alike.float().mean() > 0.6


def tackled(state: State) -> tuple[float, float]:
    """Velocity of the ball after the planned tackle, which succeeds (rcssserver `player.cpp`, tackle)."""
    made = planned(state)
    assert made["tackle_there"]
    body = float(state.players[0, 0, CHANNEL["body"]])
    x, y, vx, vy = (state.ball[0] - torch.cat([state.players[0, 0, :2], torch.zeros(2)])).tolist()
    off = abs((math.degrees(math.atan2(y, x)) - body + 180) % 360 - 180) / 180
    push = 2.7 * (1 - abs(made["tackle_degrees"]) / 180) * (1 - 0.5 * off)
    angle = math.radians(body + made["tackle_degrees"])
    return vx + push * math.cos(angle), vy + push * math.sin(angle)


@pytest.mark.parametrize("body", [-30.0, 0.0, 45.0])
def test_a_tackle_before_the_goal_is_a_shot(body: float) -> None:
    at = math.radians(body)
    state = scene(x=40.0, y=3.0, body=body, ball=(1.5 * math.cos(at), 1.5 * math.sin(at), 0.2, 0.3))
    vx, vy = tackled(state)
    x, y = state.ball[0, :2].tolist()
    assert vx / (1 - 0.94) > 52.5 - x
    assert abs(y + vy / vx * (52.5 - x)) < 7.01


def test_a_tackle_goes_where_no_opponent_is() -> None:
    """Else towards the nearer side line; with the own goal behind the player never into it."""
    state = scene(y=10.0, ball=(1.5, 0.0, 0.0, 0.0))
    vx, vy = tackled(state)
    assert vy > 0.9 * abs(vx)
    for place in range(11, 22):
        put(state, place, x=0.5 * (place - 16), y=24.0, body=-90.0)
    assert tackled(state)[1] < 0.5 * vy
    back = scene(x=-45.0, body=180.0, ball=(-1.5, 0.0, 0.0, 0.0))
    x, y = back.ball[0, :2].tolist()
    vx, vy = tackled(back)
    assert vx >= 0 or abs(y + vy / vx * (-52.5 - x)) > 8.01


def test_a_player_that_lies_is_late() -> None:
    state = scene(y=10.0, ball=(1.5, 0.0, 0.0, 0.0))
    for place in range(11, 22):
        put(state, place, x=0.5 * (place - 16), y=24.0, body=-90.0)
    before = planned(state)["tackle_degrees"]
    for place in range(11, 22):
        put(state, place, flags=FLAG_ON_FIELD | FLAG_TACKLING)
    assert planned(state)["tackle_degrees"] != before


@pytest.mark.parametrize("ball", [(-0.5, 1.2), (2.01, 0.0), (1.0, 1.26), (1.99, 1.0)])
def test_no_tackle_at_a_ball_behind_or_out_of_reach(ball: tuple[float, float]) -> None:
    assert planned(scene(ball=(*ball, 0.0, 0.0)))["tackle_there"] == 0


def test_values_show_the_best() -> None:
    state = situations(300, seed=7)
    made = plans(state)
    able = made[made[:, 0] > 0]
    values = able[:, [PLAN.index(f"{name}_value") for name in VALUED]]
    # At most one is worth more than all others.
    assert ((values > 0).sum(1) <= 1).all()
    assert values.abs().max() <= MOST_VALUE_M
    for way in ("dribble", "self_pass"):
        there, value = able[:, PLAN.index(f"{way}_there")] > 0, able[:, PLAN.index(f"{way}_value")]
        assert (value[~there] == -20).all()
        assert (value[there] > -20).any()


def test_agents_of_real_matches_do_as_planned(samples_dir: Path, tmp_path: Path) -> None:
    """HELIOS_base is HELIOS Base as it is; the log has four digits of each velocity."""
    store = create_store(tmp_path / "store")
    ingest([samples_dir], store)
    build_dataset(DatasetConfig(teams=("HELIOS_base",)), store=store, out=tmp_path / "dataset")
    data = open_dataset(tmp_path / "dataset")
    target = data.target(range(len(data)))
    rows = torch.nonzero(target.kind == CLONED_KINDS.index(CommandKind.KICK))[:, 0]
    assert len(rows) > 100
    state = data.state(rows.numpy())
    made = plans(state)
    given = kicked(state, target.parameters[rows])
    exact, chosen, _ = as_planned(made.numpy(), given.numpy())
    assert chosen.mean() > 0.9
    assert exact.any(1).mean() > 0.93
    rows = torch.nonzero(target.kind == CLONED_KINDS.index(CommandKind.TACKLE))[:, 0]
    assert len(rows) > 10
    made = plans(data.state(rows.numpy()))
    assert tackles_as_planned(made.numpy(), target.parameters[rows, 0].numpy()).mean() > 0.8
