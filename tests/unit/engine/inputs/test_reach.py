from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.situations import put, resting, situations
from torch import Tensor

from teamclone.dynamics import formulas
from teamclone.engine.inputs.look import _place_after
from teamclone.engine.inputs.reach import NEVER_CYCLES, REACH_CYCLES, Reach, reach_ball
from teamclone.rcss.player_types import DEFAULTS, RANGES
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.world.channels import CHANNEL, FLAG_ON_FIELD, TYPE_FIELD
from teamclone.world.state import State

MATE, OPPONENT = 5, 15
TYPE = torch.tensor(list(DEFAULTS.values()), dtype=torch.float64)
AREA = 0.3 + 0.085 + 0.7


def of_type(**values: float) -> Tensor:
    types = TYPE.clone()
    for name, value in values.items():
        types[TYPE_FIELD[name]] = value
    return types


def reach_of(state: State, *, held: bool = False) -> Reach:
    each = state.each()
    parts = (part.numpy().astype(np.float64) for part in (each.ball, each.players, each.types, each.server))
    return reach_ball(*parts, actor=each.actor.numpy(), held=np.full(len(each.actor), held))


def one_at(
    player: int, x: float, *, types: Tensor = TYPE, ball: tuple[float, ...] = (0, 0, 0, 0), **values: float
) -> float:
    """Cycles of a player of that type on the field at (x, 0) or where ``values`` say."""
    state = resting(dtype=torch.float64)
    state.ball[0] = torch.tensor(ball, dtype=torch.float64)
    state.types[:] = types
    put(state, 0, x=-50.0)
    put(state, player, **{"x": x, **values})
    return float(reach_of(state).steps[0, player])


def test_the_ball_rolls_as_the_server_moves_it() -> None:
    state = resting(2, dtype=torch.float64)
    state.ball[0] = torch.tensor([3.0, -4.0, 2.0, -1.0])
    x, y, vx, vy = state.ball[0].tolist()
    path = reach_of(state).ball
    assert path.shape == (2, REACH_CYCLES + 1, 2)
    for place in path[0].tolist():
        assert place == pytest.approx([x, y])
        # Logged velocity is after decay: the next move is it, then it decays.
        x, y, vx, vy = x + vx, y + vy, vx * 0.94, vy * 0.94
    assert (path[1] == 0).all()


def test_a_held_ball_stays() -> None:
    state = resting(dtype=torch.float64)
    state.ball[0] = torch.tensor([3.0, -4.0, 2.0, -1.0])
    assert (reach_of(state, held=True).ball == (3.0, -4.0)).all()


def test_the_ball_after_some_cycles() -> None:
    path = reach_of(situations(1)).ball[0]
    for cycles, cycle in ((0.0, 0), (7.4, 7), (40.0, 40), (99.0, 40), (math.nan, 40)):
        assert _place_after(path, cycles) == tuple(path[cycle])


def dashes(distance: float, types: Tensor, *, area: float) -> int:
    """Full dashes from rest until the ball is within the area, as the server adds them up."""
    power = 100 * float(types[TYPE_FIELD["dash_power_rate"]] * types[TYPE_FIELD["effort_max"]])
    decay = float(types[TYPE_FIELD["player_decay"]])
    moved, speed, cycles = 0.0, 0.0, 0
    while distance - moved > area:
        speed += power
        moved += speed
        speed *= decay
        cycles += 1
    return cycles


@given(
    distance=st.floats(0, 20),
    player=st.sampled_from([0, MATE, OPPONENT]),
    dash_power_rate=st.floats(*RANGES["dash_power_rate"]),
    player_decay=st.floats(*RANGES["player_decay"]),
    effort_max=st.floats(*RANGES["effort_max"]),
    margin=st.floats(*RANGES["kickable_margin"]),
)
@settings(max_examples=60)
def test_cycles_to_a_resting_ball_straight_ahead(distance: float, player: int, margin: float, **motion: float) -> None:
    types = of_type(kickable_margin=margin, **motion)
    area = 0.3 + 0.085 + margin - (0.2 if player == MATE else 0)
    expected = {dashes(distance, types, area=area + slack) for slack in (-1e-4, 1e-4)}
    assert one_at(player, -distance, types=types) in expected


def test_cycles_by_hand() -> None:
    # 0.6 m, then 0.6 + 0.4 * 0.6, then 0.936: 1.5, 2.1 and 2.4 m beyond the area need three, three and four dashes.
    assert one_at(OPPONENT, -AREA - 1.5) == 3
    assert one_at(OPPONENT, -AREA - 0.59) == 1
    assert one_at(OPPONENT, -AREA - 0.61) == 2
    assert one_at(OPPONENT, -AREA - 1.43) == 2
    assert one_at(OPPONENT, -AREA - 2.37) == 3
    assert one_at(OPPONENT, -AREA + 0.01) == 0
    # A team mate's reach is taken 0.2 m short.
    assert one_at(MATE, -AREA + 0.01) == 1


def test_a_needed_turn_costs_a_cycle() -> None:
    straight = one_at(OPPONENT, -20)
    assert one_at(OPPONENT, -20, body=14.9) == straight
    assert one_at(OPPONENT, -20, body=-15.1) == straight + 1
    assert one_at(OPPONENT, -20, body=179.0) == straight + 1
    # Near the ball he runs backwards.
    assert one_at(OPPONENT, -9, body=179.0) == one_at(OPPONENT, -9)


def test_who_runs_fast_turns_little() -> None:
    """Half a metre per cycle and an inertia of 7 leave 180 / 4.5 = 40 degrees of a turn, then 180 / 2.4 = 75."""
    types = of_type(inertia_moment=7.0, player_decay=0.4)
    still = one_at(OPPONENT, -30, types=types)
    cycles = {
        body: one_at(OPPONENT, -30 - 0.5 / 0.6, types=types, body=body, vx=0.5) for body in (10.0, 50.0, 60.0, 140.0)
    }
    assert cycles == {10.0: still, 50.0: still + 1, 60.0: still + 2, 140.0: still + 3}


def test_the_actor_dashes_sideways() -> None:
    # Across 0.4 of the power is left: 0.24 m in a dash, 0.58 in two; others turn, then dash 0.6 m.
    assert one_at(0, -AREA - 0.23, body=90.0) == 1
    assert one_at(0, -AREA - 0.25, body=90.0) == 2
    assert one_at(OPPONENT, -AREA - 0.23, body=90.0) == 2


def test_a_ball_that_comes_is_waited_for() -> None:
    # It rolls 1, .94, .8836, ...: 2.8236 m in three cycles; the player 3.5 m away stands with his back to it.
    assert one_at(OPPONENT, AREA + 2.8, ball=(0, 0, 1, 0), body=90.0) <= 3
    assert one_at(OPPONENT, -9 - AREA, ball=(0, 0, 1, 0)) > one_at(OPPONENT, -9 - AREA)


def test_far_players_run_on_at_full_speed() -> None:
    # 39.333 m in 40 dashes (1 m each less 2/3), then 1 m a cycle.
    assert one_at(OPPONENT, -AREA - 39.3) == 40
    assert one_at(OPPONENT, -AREA - 45) == pytest.approx(40 + 45 - (40 - 2 / 3), abs=1e-6)
    # Nobody is given more than one who is not there.
    assert one_at(OPPONENT, 57, ball=(-57, 0, -2.7, 0)) == NEVER_CYCLES


def test_players_off_the_field_never_have_it() -> None:
    state = situations(50)
    gone = torch.rand(50, 22, generator=torch.Generator().manual_seed(1)) < 0.3
    flags = state.players[..., CHANNEL["flags"]]
    state.players[..., CHANNEL["flags"]] = torch.where(gone, flags - FLAG_ON_FIELD, flags)
    before, steps = reach_of(situations(50)).steps, reach_of(state).steps
    assert (steps[gone.numpy()] == NEVER_CYCLES).all()
    assert (steps[~gone.numpy()] == before[~gone.numpy()]).all()


def plainly(state: State, row: int, player: int, *, slack: float) -> float:
    """The same model cycle by cycle, for a player who is not the actor."""
    x, y, vx, vy, body = (float(state.players[row, player, CHANNEL[name]]) for name in ("x", "y", "vx", "vy", "body"))
    bx, by, bvx, bvy = state.ball[row].tolist()
    types = state.types[row, player]
    decay, inertia = float(types[TYPE_FIELD["player_decay"]]), float(types[TYPE_FIELD["inertia_moment"]])
    reserve = 0.2 if player < 11 else 0.0
    size, margin, ball = (
        float(values[place])
        for values, place in (
            (types, TYPE_FIELD["player_size"]),
            (types, TYPE_FIELD["kickable_margin"]),
            (state.server[row], SERVER_FIELD["ball_size"]),
        )
    )
    area = formulas.kickable_area(size, margin, ball) - reserve + slack
    initial_speed = math.hypot(vx, vy)
    for cycle in range(REACH_CYCLES + 1):
        distance = math.hypot(bx - x, by - y)
        if distance <= area:
            return cycle
        angle = abs(math.remainder(math.degrees(math.atan2(by - y, bx - x)) - body, 360))
        if distance < 10 and angle > 90:
            angle = 180 - angle
        margin = max(15.0, math.degrees(math.asin(area / distance)))
        turns, speed = 0, initial_speed
        while angle > margin and turns < 3:
            angle -= 180 / (1 + inertia * speed)
            speed *= decay
            turns += 1
        if turns + dashes(distance, types, area=area) <= cycle:
            return cycle
        x, y, vx, vy = x + vx, y + vy, vx * decay, vy * decay
        bx, by, bvx, bvy = bx + bvx, by + bvy, bvx * 0.94, bvy * 0.94
    return math.inf


def test_all_players_are_reckoned_as_one_by_one() -> None:
    state = situations(12, seed=3, dtype=torch.float64)
    steps = reach_of(state).steps
    compared = 0
    for row in range(12):
        for player in range(22):
            expected = {plainly(state, row, player, slack=slack) for slack in (-1e-6, 0, 1e-6)}
            if player != int(state.actor[row]) and math.inf not in expected:
                assert float(steps[row, player]) in expected
                compared += 1
    assert compared > 150


@given(distances=st.lists(st.floats(0, 80), min_size=2, max_size=2), body=st.floats(-180, 180))
@settings(max_examples=50)
def test_closer_is_never_later(distances: list[float], body: float) -> None:
    near, far = sorted(distances)
    # From 10 m on nobody runs backwards, which makes some far balls come sooner.
    far = far if far < 10 or near >= 10 else 9.9
    near = min(near, far)
    assert one_at(OPPONENT, -near, body=body) <= one_at(OPPONENT, -far, body=body) + 1e-9


@given(rates=st.lists(st.floats(0.004, 0.007), min_size=2, max_size=2), distance=st.floats(0, 60))
@settings(max_examples=50)
def test_more_power_is_never_later(rates: list[float], distance: float) -> None:
    weak, strong = sorted(rates)
    cycles = [one_at(OPPONENT, -distance, types=of_type(dash_power_rate=rate)) for rate in (strong, weak)]
    assert cycles[0] <= cycles[1] + 1e-9
