"""Self passes: where they may end."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.situations import dashed

from teamclone.planner import dribble, scene, self_pass
from teamclone.rcss.player_types import DEFAULTS
from teamclone.rcss.server_params import SERVER_DEFAULTS
from teamclone.world.channels import CHANNEL, FLAG_ON_FIELD, TYPE_FIELD


def ends(x: float, y: float, body: float, *, stamina: float = 8000.0) -> dict[int, list[int]]:
    """Return the dashes of the self passes of a player at rest by degrees from its body, in their order."""
    channels, types = np.zeros((1, 22, len(CHANNEL))), np.zeros((1, 22, len(TYPE_FIELD)))
    for name, value in DEFAULTS.items():
        types[..., TYPE_FIELD[name]] = value
    state = {"x": x, "y": y, "body": body, "stamina": stamina, "effort": 1.0, "recovery": 1.0, "capacity": 1e5}
    for name, value in {**state, "flags": float(FLAG_ON_FIELD)}.items():
        channels[..., CHANNEL[name]] = value
    ball = np.array([[x + 0.6 * math.cos(math.radians(body)), y + 0.6 * math.sin(math.radians(body)), 0.0, 0.0]])
    made = np.zeros((scene.ROWS, scene.COLUMNS))
    scene.fill_scene(ball[0], channels[0], types[0], SERVER_DEFAULTS, made)
    made[scene.BALL, scene.GAIN] = DEFAULTS["kick_power_rate"]
    scene.complete(made, 0)
    found: dict[int, list[int]] = {}
    for one in self_pass._self_passes(made):
        way_x, way_y = one[dribble.TO_X] - x, one[dribble.TO_Y] - y
        off = round(float(scene.turned(scene.direction(way_x, way_y) - body)))
        found.setdefault(off, []).append(int(one[dribble.ARRIVES]) - (2 if off else 1))
    return found


@pytest.mark.parametrize(
    ("x", "dashes"),
    [
        (0.0, [13, 11, 9, 8, 7, 6, 5]),
        (12.0, [15, 13, 11, 9, 8, 7, 6, 5]),
        (25.0, [20, 18, 16, 14, 12, *range(10, 4, -1)]),
    ],
)
def test_most_dashes_come_first_and_long_runs_in_steps_of_two(x: float, dashes: list[int]) -> None:
    found = ends(x, 0.0, 0.0)
    assert list(found) == [*range(0, 85, 6), *range(-84, 0, 6)]
    assert all(row == dashes for row in found.values())


def test_a_row_ends_before_the_goal_line() -> None:
    """From its last place back the steps of two are counted."""
    found = ends(45.0, 0.0, 0.0)
    for off in range(0, 73, 6):
        last = max(count for count in range(1, 21) if dashed(count) * math.cos(math.radians(off)) <= 52.5 - 2.5 - 45.0)
        assert last < 20
        wanted = [count for count in range(last, 4, -1) if count < 10 or (last - count) % 2 == 0]
        assert found.get(off, []) == wanted == found.get(-off if off else 0, [])


def test_a_row_ends_at_the_side_line_it_goes_to_alone() -> None:
    """A player beyond where a row ends may still run back onto the pitch."""
    found = {(90 + off + 180) % 360 - 180 for off in ends(30.0, 32.0, 90.0)}
    assert found == set(range(-84, 1, 6))


def test_none_ends_before_the_own_goal() -> None:
    """Nor goes further round from +x there than 85 degrees, but beside it."""
    assert ends(-42.0, 0.0, 0.0) == {}
    assert ends(-42.0, 20.0, 0.0)
    assert max(abs(off) for off in ends(-20.0, 0.0, 0.0)) == 84


def test_a_tired_player_begins_none() -> None:
    assert ends(25.0, 0.0, 0.0, stamina=2600.0) == {}
    assert ends(25.0, 0.0, 0.0, stamina=3000.0)
