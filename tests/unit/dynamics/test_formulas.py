"""The formulas by numbers that anybody can check, for NumPy and PyTorch alike."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from teamclone.dynamics import formulas
from teamclone.rcss.player_types import DEFAULTS as TYPE
from teamclone.rcss.player_types import RANGES
from teamclone.rcss.server_params import DEFAULTS as SERVER

LIBRARIES = [lambda values: np.asarray(values, np.float64), lambda values: torch.tensor(values, dtype=torch.float64)]
both = pytest.mark.parametrize("array", LIBRARIES, ids=["numpy", "torch"])
KICK = {name: TYPE[name] for name in ("kick_power_rate", "player_size", "kickable_margin")} | {
    "ball_size": SERVER["ball_size"]
}
DASH = {name: SERVER[name] for name in ("side_dash_rate", "back_dash_rate")}
TACKLE = {name: SERVER[name] for name in ("tackle_dist", "tackle_back_dist", "tackle_width")} | {"exponent": 6.0}


@given(cycles=st.integers(0, 40), speed=st.floats(0.1, 3), decay=st.floats(0.3, 0.95))
@settings(max_examples=40)
def test_a_body_rolls_as_the_server_moves_it(cycles: int, speed: float, decay: float) -> None:
    moved, now = 0.0, speed
    for _ in range(cycles):
        moved, now = moved + now, now * decay
    assert speed * formulas.roll(cycles, decay) == pytest.approx(moved)
    if now > 1e-6:
        assert formulas.cycles_over(moved, speed, decay) == pytest.approx(cycles, abs=1e-4)


@both
def test_what_is_never_reached_takes_as_long_as_the_least_part_says(array: Any) -> None:
    far = formulas.cycles_over(array([1000.0]), 2.7, array([0.94]), least=0.02)
    assert float(far[0]) == pytest.approx(math.log(0.02) / math.log(0.94))


@both
@given(cycles=st.integers(0, 40), acceleration=st.floats(0.1, 0.9), decay=st.floats(*RANGES["player_decay"]))
@settings(max_examples=40)
def test_metres_covered_are_the_sum_of_the_dashes(array: Any, cycles: int, acceleration: float, decay: float) -> None:
    moved, speed = 0.0, 0.0
    for _ in range(cycles):
        speed += acceleration
        moved += speed
        speed *= decay
    got = formulas.covered(array(cycles), array(acceleration), array(decay))
    assert float(got) == pytest.approx(moved, abs=1e-9)


@both
def test_kick_rate_by_the_formula(array: Any) -> None:
    distance, off = array([0.385, 1.085, 0.735, 1.085]), array([0.0, 0.0, -math.pi / 2, math.pi])
    # Touching ahead; at the edge ahead; half a margin away aside; at the edge behind.
    expected = [0.027 * part for part in (1, 0.75, 1 - 0.125 - 0.125, 0.5)]
    assert formulas.kick_rate(distance, off, **KICK).tolist() == pytest.approx(expected)


@given(gap=st.floats(0, 0.7), step=st.floats(0.01, 0.2), angle=st.floats(0, 170), further=st.floats(1, 10))
@settings(max_examples=50)
def test_kicks_are_strongest_near_and_ahead(gap: float, step: float, angle: float, further: float) -> None:
    def rate(gap: float, degrees: float) -> float:
        return float(formulas.kick_rate(0.385 + gap, math.radians(degrees), **KICK))

    assert rate(gap, angle) >= rate(min(gap + step, 0.7), angle) - 1e-9
    assert rate(gap, angle) > rate(gap, angle + further)
    assert rate(gap, angle) == pytest.approx(rate(gap, -angle))


@both
def test_a_kick_is_limited_in_acceleration_and_then_in_speed(array: Any) -> None:
    velocity = (array([0.0, 2.0, -1.0]), array([0.0, 0.0, 0.0]))
    x, y = formulas.kicked(
        velocity,
        array([100.0, 100.0, 50.0]),
        array([0.0, 0.0, math.pi / 2]),
        0.03,
        ball_accel_max=2.7,
        ball_speed_max=3.0,
    )
    # 3.0 is cut to 2.7; 4.7 is cut to 3.0; the last is free.
    assert x.tolist() == pytest.approx([2.7, 3.0, -1.0])
    assert y.tolist() == pytest.approx([0.0, 0.0, 1.5])


@both
def test_tackle_failure_by_the_formula(array: Any) -> None:
    forward = array([1.0, 2.0, 1.0, -0.1, 0.0, 0.5])
    aside = array([0.0, 0.0, -0.625, 0.0, 0.0, 1.25])
    got = formulas.tackle_failure(forward, aside, **TACKLE).tolist()
    assert got[:3] == pytest.approx([1 / 64, 1.0, 2 / 64])
    # Behind the player and beside it at the width a tackle fails for certain.
    assert all(value >= 1 for value in got[3:])


@given(forward=st.floats(0.01, 3), aside=st.floats(-2, 2), more=st.floats(0, 1))
@settings(max_examples=50)
def test_tackles_fail_more_the_further_the_ball(forward: float, aside: float, more: float) -> None:
    def failure(forward: float, aside: float) -> float:
        return float(formulas.tackle_failure(forward, aside, **TACKLE))

    assert failure(forward, aside) <= failure(forward + more, aside)
    assert failure(forward, aside) <= failure(forward, aside + math.copysign(more, aside))


@both
def test_tackle_power_falls_with_both_angles(array: Any) -> None:
    power = {name: SERVER[name] for name in ("max_tackle_power", "max_back_tackle_power", "tackle_power_rate")}
    got = formulas.tackle_power(array([0.0, math.pi, math.pi / 2, 0.0]), array([0.0, 0.0, 0.0, math.pi]), **power)
    assert got.tolist() == pytest.approx([2.7, 0.0, 1.35, 1.35])


@both
def test_dash_rate_by_the_formula(array: Any) -> None:
    got = formulas.dash_rate(array([0.0, 45.0, 90.0, 135.0, 180.0]), **DASH)
    assert got.tolist() == pytest.approx([1.0, 0.7, 0.4, 0.55, 0.7])


@both
def test_turns_get_smaller_with_speed(array: Any) -> None:
    assert formulas.turn(array([180.0, 180.0]), array([0.0, 0.4]), 5.0).tolist() == pytest.approx([180.0, 60.0])


@both
def test_stamina_after_a_cycle(array: Any) -> None:
    """Fresh, below the threshold at which effort and recovery fall, above that at which effort rises, and spent."""
    parts = formulas.rested(
        array([8000.0, 2400.0, 5000.0, 3000.0]),
        array([1.0, 0.6, 0.9, 1.0]),
        array([1.0, 0.501, 1.0, 1.0]),
        array([130600.0, 1000.0, 1000.0, 10.0]),
        server=SERVER,
        stamina_inc_max=45.0,
        effort_min=0.6,
        effort_max=1.0,
    )
    stamina, effort, recovery, capacity = (part.tolist() for part in parts)
    assert stamina == pytest.approx([8000, 2400 + 0.5 * 45, 5045, 3010])
    assert effort == pytest.approx([1.0, 0.6, 0.91, 1.0])
    assert recovery == pytest.approx([1.0, 0.5, 1.0, 1.0])
    assert capacity == pytest.approx([130600, 1000 - 0.5 * 45, 955, 0])


@given(angle=st.floats(-50, 50))
def test_wrapped_angles_are_the_same_directions(angle: float) -> None:
    wrapped = float(formulas.wrap(angle))
    assert -math.pi <= wrapped < math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-6)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-6)
