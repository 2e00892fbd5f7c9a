"""Whether players have a ball in time: the two radii around where they drift to."""

from __future__ import annotations

import numpy as np
import pytest
from tests.situations import dashed

from teamclone.planner import players, scene
from teamclone.planner.players import HARDLY_M, SELF_PASS, TACKLE, Allowance, short_m
from teamclone.rcss.player_types import DEFAULTS
from teamclone.rcss.server_params import SERVER_DEFAULTS
from teamclone.world.channels import CHANNEL, FLAG_ON_FIELD, FLAG_TACKLING, TYPE_FIELD

PLAIN = Allowance()
REACH_M = 1.085
TURN_CYCLES = 2
"""Of a turn, and of the cycle after it in which the player sees the ball again."""


def player(*, body: float = 0.0, vx: float = 0.0, flags: int = FLAG_ON_FIELD) -> scene.Array:
    """Return the row of a player of the default type in the middle of the pitch."""
    channels, types = np.zeros((1, 22, len(CHANNEL))), np.zeros((1, 22, len(TYPE_FIELD)))
    for name, value in DEFAULTS.items():
        types[..., TYPE_FIELD[name]] = value
    for name, value in (("body", body), ("vx", vx), ("flags", float(flags))):
        channels[..., CHANNEL[name]] = value
    made = np.zeros((scene.ROWS, scene.COLUMNS))
    scene.fill_scene(np.zeros(4), channels[0], types[0], SERVER_DEFAULTS, made)
    scene.complete(made, 0)
    return made[0]


@pytest.mark.parametrize(("cycle", "later"), [(1, 0), (5, 0), (5, 2), (40, 2), (50, 2)])
def test_dashes_carry_the_reach(cycle: int, later: int) -> None:
    short = short_m(player(), (60.0, 0.0), cycle, PLAIN, later)
    assert short == pytest.approx(60.0 - REACH_M - dashed(cycle + later) - HARDLY_M)


def test_the_allowance_widens_the_radius() -> None:
    allowance = Allowance(touch_m=0.15, reach=0.5, ahead_m=0.2, early=1.0)
    assert short_m(player(), (20.0, 0.0), 6, allowance, 0) == pytest.approx(
        20.0 - 0.5 * REACH_M - 0.2 - dashed(7) - HARDLY_M
    )
    late = allowance._replace(reach_from=7.0)
    assert short_m(player(), (20.0, 0.0), 6, late, 0) == pytest.approx(20.0 - dashed(7) - HARDLY_M)
    # In its first cycle after a turn there is no dash, and the reach is what it is.
    assert short_m(player(body=90.0), (3.0, 0.0), 0, allowance, 0) == pytest.approx(3.0 - REACH_M - 0.15 - HARDLY_M)


def test_a_player_drifts() -> None:
    drift = 0.3 * (1 - 0.4**4) / (1 - 0.4)
    assert short_m(player(vx=0.3), (20.0, 0.0), 4, PLAIN, 0) == pytest.approx(
        short_m(player(), (20.0 - drift, 0.0), 4, PLAIN, 0)
    )


def test_turns_cost_cycles() -> None:
    facing = short_m(player(), (9.0, 0.0), 8, PLAIN, 0)
    assert short_m(player(body=10.0), (9.0, 0.0), 8, PLAIN, 0) == facing
    away = short_m(player(body=180.0), (9.0, 0.0), 8, PLAIN, 0)
    assert away == short_m(player(), (9.0, 0.0), 8 - TURN_CYCLES, PLAIN, 0) > facing
    # It need not turn for what is near, to dash backwards to.
    assert short_m(player(body=180.0), (4.0, 0.0), 8, TACKLE, 0) == short_m(player(), (4.0, 0.0), 8, TACKLE, 0)


def test_what_is_in_reach_needs_no_turn() -> None:
    """Neither does a player that has no cycle left."""
    for body in (0.0, 90.0, 180.0):
        assert short_m(player(body=body), (REACH_M, 0.0), 1, PLAIN, 0) <= 0
        assert short_m(player(body=body), (REACH_M + 0.002, 0.0), 0, PLAIN, 0) > 0


def test_a_tackle_costs_half_of_its_cycles() -> None:
    tackling = player(flags=FLAG_ON_FIELD | FLAG_TACKLING)
    assert short_m(tackling, (9.0, 0.0), 9, PLAIN, 0) == short_m(player(), (9.0, 0.0), 4, PLAIN, 0)
    assert short_m(tackling, (9.0, 0.0), 4, PLAIN, 0) == pytest.approx(9.0 - REACH_M - HARDLY_M)


def test_no_player_is_faster_than_it_can_be() -> None:
    """A player far from the actor is given metres, but not more than its top speed allows."""
    far = player()
    far[scene.AWAY] = 400.0
    assert short_m(far, (REACH_M + 2.9, 0.0), 3, SELF_PASS, 0) <= 0
    assert short_m(far, (REACH_M + 3.1, 0.0), 3, SELF_PASS, 0) > 0
    assert short_m(far, (REACH_M + 3.1, 0.0), 3, SELF_PASS._replace(bound=0.0), 0) <= 0


def test_radii_agree_with_the_number_of_dashes() -> None:
    me, random = player(), np.random.default_rng(4)
    for metres, cycle in zip(random.uniform(1.2, 8.0, 500), random.integers(1, 10, 500), strict=True):
        has = short_m(me, (metres, 0.0), cycle, PLAIN, 0) <= 0
        assert has == (players.dashes(me, metres - REACH_M) <= cycle)
