"""The step of a cycle by numbers that anybody can check; `test_physics.py` holds it to the real server."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from teamclone.dynamics.bodies import BALL, N_BODIES, Bodies, Commands
from teamclone.dynamics.rules import Rules
from teamclone.dynamics.step import step
from teamclone.errors import UsageError
from teamclone.rcss import player_types, server_params
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.playmodes import PlayMode

TYPES = {name: np.array([value]) for name, value in player_types.DEFAULTS.items()}
RULES = Rules.of({**server_params.DEFAULTS}, TYPES, version=19)
OLD = Rules.of({**server_params.DEFAULTS, "min_dash_power": -100.0}, TYPES, version=18)
DECAY = player_types.DEFAULTS["player_decay"]
BALL_DECAY = server_params.DEFAULTS["ball_decay"]


def at_rest(n: int = 1, *, mode: PlayMode = PlayMode.PLAY_ON) -> Bodies:
    """Players far from each other, 2 m apart along two lines, the ball in the middle of the pitch."""
    x = np.tile(np.append(np.tile(np.arange(11) * 2.0 - 40.0, 2), 0.0), (n, 1))
    y = np.tile(np.append(np.repeat([-10.0, 10.0], 11), 0.0), (n, 1))

    def players(value: Any) -> Any:
        return np.full((n, N_PLAYERS), value)

    return Bodies(
        x=x,
        y=y,
        vx=np.zeros((n, N_BODIES)),
        vy=np.zeros((n, N_BODIES)),
        body=players(0.0),
        neck=players(0.0),
        stamina=players(8000.0),
        effort=players(1.0),
        recovery=players(1.0),
        capacity=players(130600.0),
        type=players(0),
        on_field=players(True),
        goalie=np.tile(np.arange(N_PLAYERS) % 11 == 0, (n, 1)),
        frozen=players(0),
        banned=players(0),
        touched=np.zeros((n, N_BODIES), np.bool_),
        mode=np.full(n, mode, np.uint8),
    )


def does(slot: int, kind: CommandKind, *numbers: float, n: int = 1) -> Commands:
    kinds = np.zeros((n, N_PLAYERS), np.uint8)
    given = np.full((n, N_PLAYERS, 2), np.nan)
    kinds[:, slot] = kind
    given[:, slot, : len(numbers)] = numbers
    return Commands.of(kinds, given)


def nobody(n: int = 1) -> Commands:
    return Commands.of(np.zeros((n, N_PLAYERS), np.uint8), np.full((n, N_PLAYERS, 2), np.nan))


def put(bodies: Bodies, place: int, **values: float) -> Bodies:
    changed = {name: getattr(bodies, name).copy() for name in values}
    for name, value in values.items():
        changed[name][:, place] = value
    return replace(bodies, **changed)


def test_who_does_nothing_coasts_and_recovers() -> None:
    before = put(put(at_rest(), 3, vx=0.5, stamina=5000.0), BALL, vy=-1.0)
    after = step(before, nobody(), RULES)
    assert after.x[0, 3] == before.x[0, 3] + 0.5
    assert after.vx[0, 3] == pytest.approx(0.5 * DECAY)
    assert after.y[0, BALL] == -1.0
    assert after.vy[0, BALL] == pytest.approx(-BALL_DECAY)
    assert after.stamina[0, 3] == 5045.0
    assert after.capacity[0, 3] == 130600.0 - 45.0
    assert not after.touched.any()


def test_a_dash_forward_and_one_to_the_side() -> None:
    after = step(at_rest(), does(2, CommandKind.DASH, 50.0, 0.0), RULES)
    assert after.x[0, 2] == pytest.approx(-36.0 + 0.3)
    assert after.vx[0, 2] == pytest.approx(0.3 * DECAY)
    assert after.stamina[0, 2] == pytest.approx(7950.0 + 45.0)
    after = step(at_rest(), does(2, CommandKind.DASH, 100.0, -90.4), RULES)
    assert after.y[0, 2] == pytest.approx(-10.0 - 0.6 * 0.4)
    assert after.x[0, 2] == pytest.approx(-36.0)


@pytest.mark.parametrize("rules", [RULES, OLD])
def test_versions_agree_on_a_plain_dash_while_there_is_stamina(rules: Rules) -> None:
    after = step(at_rest(), does(2, CommandKind.DASH, 80.0, 30.0), rules)
    rate = 0.4 + 0.6 * (1 - 30 / 90)
    assert after.x[0, 2] == pytest.approx(-36.0 + 80 * 0.006 * rate * np.cos(np.radians(30)))
    assert after.body[0, 2] == pytest.approx(0.0)


def test_without_stamina_only_two_legs_turn_the_body() -> None:
    before = put(at_rest(), 2, stamina=10.0, effort=0.6)
    dash = does(2, CommandKind.DASH, 100.0, 0.0)
    # C = 60 of 100: the left leg has 30, the right one 60 * 50 / (30 + 50) = 37.5 (reference: leg.cpp).
    turned = np.degrees(0.6 * 0.006 * 2 * (30 - 37.5) / 0.6)
    assert step(before, dash, RULES).body[0, 2] == pytest.approx(turned)
    old = step(before, dash, OLD)
    assert old.body[0, 2] == 0.0
    assert old.x[0, 2] == pytest.approx(-36.0 + 60 * 0.6 * 0.006)
    assert old.stamina[0, 2] == step(before, dash, RULES).stamina[0, 2] == pytest.approx(45.0 * 0.998)


def test_backwards_costs_twice_before_version_19() -> None:
    after = step(at_rest(), does(2, CommandKind.DASH, -50.0, 0.0), OLD)
    assert after.x[0, 2] == pytest.approx(-36.0 - 50 * 0.006)
    assert after.stamina[0, 2] == pytest.approx(8000.0 - 100.0 + 45.0)


def test_a_turn_is_slower_in_motion() -> None:
    moving = put(at_rest(), 4, vx=0.4)
    assert step(at_rest(), does(4, CommandKind.TURN, 90.0), RULES).body[0, 4] == pytest.approx(90.0)
    assert step(moving, does(4, CommandKind.TURN, 90.0), RULES).body[0, 4] == pytest.approx(30.0)
    assert step(at_rest(), does(4, CommandKind.TURN, 500.0), RULES).body[0, 4] == pytest.approx(-180.0)


def near_the_ball(mode: PlayMode = PlayMode.PLAY_ON) -> Bodies:
    return put(at_rest(mode=mode), 5, x=-0.385, y=0.0)


def test_a_kick() -> None:
    after = step(near_the_ball(), does(5, CommandKind.KICK, 50.0, 0.0), RULES)
    assert after.x[0, BALL] == pytest.approx(50 * 0.027)
    assert after.vx[0, BALL] == pytest.approx(50 * 0.027 * BALL_DECAY)
    out_of_reach = put(near_the_ball(), 5, x=-1.1)
    assert step(out_of_reach, does(5, CommandKind.KICK, 50.0, 0.0), RULES).x[0, BALL] == 0.0


def test_kicks_of_one_cycle_add_up_to_the_greatest_acceleration() -> None:
    bodies = put(near_the_ball(), 16, x=0.385, y=0.0, body=180.0)
    both = does(5, CommandKind.KICK, 100.0, 90.0)
    both.kind[0, 16], both.numbers[0, 16] = CommandKind.KICK, (100.0, -90.0)
    assert step(bodies, both, RULES).y[0, BALL] == pytest.approx(2.7)


@pytest.mark.parametrize(
    ("mode", "moves", "later"),
    [
        (PlayMode.KICK_OFF_L, True, PlayMode.PLAY_ON),
        (PlayMode.FREE_KICK_R, True, PlayMode.PLAY_ON),
        (PlayMode.GOAL_KICK_L, True, PlayMode.GOAL_KICK_L),
        (PlayMode.OFFSIDE_L, False, PlayMode.OFFSIDE_L),
        (PlayMode.GOAL_R, False, PlayMode.GOAL_R),
        (PlayMode.TIME_OVER, False, PlayMode.TIME_OVER),
    ],
)
def test_a_kick_in_other_play_modes(mode: PlayMode, moves: bool, later: PlayMode) -> None:
    after = step(near_the_ball(mode), does(5, CommandKind.KICK, 50.0, 0.0), RULES)
    assert (after.x[0, BALL] > 1.0) == moves
    assert after.mode[0] == later


def test_a_tackle_freezes_and_moves_the_ball_if_it_succeeds() -> None:
    tackle = does(5, CommandKind.TACKLE, 0.0)
    success, failure = np.ones((1, N_PLAYERS), np.bool_), np.zeros((1, N_PLAYERS), np.bool_)
    after = step(near_the_ball(), tackle, RULES, succeeded=success)
    assert after.x[0, BALL] == pytest.approx(2.7)
    assert after.frozen[0, 5] == 9
    after = step(near_the_ball(), tackle, RULES, succeeded=failure)
    assert after.x[0, BALL] == 0.0
    assert after.frozen[0, 5] == 9
    # A ball at (0.385 m ahead, 0 m aside) is nearly sure; one behind the player cannot be had.
    assert step(near_the_ball(), tackle, RULES).x[0, BALL] == pytest.approx(2.7)
    assert step(put(near_the_ball(), 5, body=180.0), tackle, RULES, succeeded=success).x[0, BALL] == 0.0


def test_an_intended_foul_freezes_its_victim_and_not_the_tackler() -> None:
    bodies = put(near_the_ball(), 16, x=0.385, y=0.0)
    tackle = does(5, CommandKind.TACKLE, 0.0)
    tackle.foul[0, 5] = True
    after = step(bodies, tackle, RULES, succeeded=np.ones((1, N_PLAYERS), np.bool_))
    assert after.frozen[0, 16] == 4
    assert after.frozen[0, 5] == 0
    assert step(after, nobody(), RULES).frozen[0, 16] == 3


def test_a_catch_holds_the_ball_and_gives_a_free_kick() -> None:
    bodies = put(put(at_rest(), 0, x=-1.0, y=0.0), BALL, vx=-0.5)
    caught = step(bodies, does(0, CommandKind.CATCH, 0.0), RULES)
    assert caught.mode[0] == PlayMode.FREE_KICK_L
    assert caught.x[0, 0] == pytest.approx(-0.385)
    assert (caught.x[0, BALL], caught.vx[0, BALL]) == (pytest.approx(0.0), 0.0)
    missed = step(bodies, does(0, CommandKind.CATCH, 0.0), RULES, succeeded=np.zeros((1, N_PLAYERS), np.bool_))
    assert missed.mode[0] == PlayMode.PLAY_ON
    assert missed.vx[0, BALL] == pytest.approx(0.5 * BALL_DECAY)
    assert missed.banned[0, 0] == 4
    assert step(put(bodies, 0, banned=1), does(0, CommandKind.CATCH, 0.0), RULES).mode[0] == PlayMode.PLAY_ON
    assert step(bodies, does(1, CommandKind.CATCH, 0.0), RULES).mode[0] == PlayMode.PLAY_ON


def test_a_move_of_the_right_team_is_turned_and_in_play_ignored() -> None:
    move = does(13, CommandKind.MOVE, -10.0, 5.0)
    after = step(at_rest(mode=PlayMode.BEFORE_KICK_OFF), move, RULES)
    assert (after.x[0, 13], after.y[0, 13]) == (10.0, -5.0)
    assert step(at_rest(), move, RULES).x[0, 13] == at_rest().x[0, 13]


def test_before_the_kick_off_nobody_moves_and_bodies_turn() -> None:
    bodies = put(at_rest(mode=PlayMode.BEFORE_KICK_OFF), 4, vx=0.5)
    after = step(bodies, does(4, CommandKind.TURN, 90.0), RULES)
    assert (after.x[0, 4], after.vx[0, 4]) == (bodies.x[0, 4], 0.0)
    assert after.body[0, 4] > 10.0


def test_who_collides_is_put_apart_and_bounces() -> None:
    bodies = put(put(at_rest(), 6, x=10.0, y=0.0, vx=0.4), 17, x=10.5, y=0.0)
    after = step(bodies, nobody(), RULES)
    assert after.x[0, 17] - after.x[0, 6] == pytest.approx(0.6)
    assert after.x[0, 6] + after.x[0, 17] == pytest.approx(20.9)
    assert after.vx[0, 6] == pytest.approx(-0.1 * 0.4 * DECAY)
    assert after.touched[0, [6, 17]].all()


def test_outside_play_the_ball_stays_where_it_is() -> None:
    after = step(put(at_rest(mode=PlayMode.KICK_IN_R), 6, x=0.2, y=0.0), nobody(), RULES)
    assert after.x[0, BALL] == 0.0
    assert after.x[0, 6] == pytest.approx(0.385)


@pytest.mark.parametrize("rng", [None, np.random.default_rng(1)])
def test_bodies_at_one_place_go_apart(rng: np.random.Generator | None) -> None:
    after = step(put(put(at_rest(), 6, x=10.0, y=0.0), 17, x=10.0, y=0.0), nobody(), RULES, rng)
    assert np.hypot(after.x[0, 6] - after.x[0, 17], after.y[0, 6] - after.y[0, 17]) == pytest.approx(0.6)


def test_a_ball_bounces_off_a_post_with_all_its_speed() -> None:
    bodies = put(at_rest(), BALL, x=52.44 - 1.145, y=7.07, vx=2.0)
    after = step(bodies, nobody(), RULES)
    # 1 m to the post, and 1 m back.
    assert after.x[0, BALL] == pytest.approx(52.44 - 1.145)
    assert after.vx[0, BALL] == pytest.approx(-2.0 * BALL_DECAY)
    assert after.touched[0, BALL]


def test_the_referee_keeps_players_near_the_pitch() -> None:
    bodies = put(at_rest(), 6, x=57.3, y=0.0, vx=0.5)
    assert step(bodies, nobody(), RULES).x[0, 6] == 57.5
    assert step(bodies, nobody(), replace(RULES, referee=False)).x[0, 6] == 57.8


def test_players_off_the_field_are_left_alone() -> None:
    bodies = put(put(at_rest(), 6, x=10.0, y=0.0, on_field=False), 17, x=10.1, y=0.0)
    after = step(bodies, does(6, CommandKind.DASH, 100.0, 0.0), RULES)
    assert after.x[0, 6] == 10.0
    assert not after.touched.any()


def test_noise_is_within_its_bounds_and_drawn_anew() -> None:
    n = 4000
    bodies = put(put(at_rest(n), 3, vx=0.5), BALL, vx=2.0)
    commands = does(4, CommandKind.TURN, 90.0, n=n)
    after = step(bodies, commands, RULES, np.random.default_rng(0))
    for body, expected, rand in ((3, 0.5, 0.1), (BALL, 2.0, 0.05)):
        off = np.hypot(after.x[:, body] - bodies.x[:, body] - expected, after.y[:, body] - bodies.y[:, body])
        assert off.max() < expected * rand
        assert np.quantile(off / (expected * rand), [0.25, 0.5, 0.75]) == pytest.approx([0.25, 0.5, 0.75], abs=0.03)
    assert np.abs(after.body[:, 4] - 90.0).max() < 9.0
    assert np.quantile(after.body[:, 4], [0.25, 0.75]) == pytest.approx([85.5, 94.5], abs=0.4)


def test_tackles_succeed_as_often_as_they_should() -> None:
    n = 4000
    bodies = put(at_rest(n), 5, x=-1.6, y=0.0)
    after = step(bodies, does(5, CommandKind.TACKLE, 0.0, n=n), RULES, np.random.default_rng(0))
    assert (after.x[:, BALL] > 1.0).mean() == pytest.approx(1 - (1.6 / 2.0) ** 6, abs=0.03)


def test_cycles_of_a_batch_are_independent() -> None:
    rng = np.random.default_rng(3)
    n = 300
    crowd = at_rest(n)
    crowd = replace(crowd, x=rng.uniform(-3, 3, (n, N_BODIES)), y=rng.uniform(-3, 3, (n, N_BODIES)))
    kinds = rng.choice([0, 1, 2, 3, 4], (n, N_PLAYERS)).astype(np.uint8)
    commands = Commands.of(kinds, rng.uniform(-100, 100, (n, N_PLAYERS, 2)))
    whole = step(crowd, commands, RULES)
    for row in (0, 17, n - 1):
        alone = step(crowd.select(slice(row, row + 1)), commands.select(slice(row, row + 1)), RULES)
        for name in ("x", "y", "vx", "vy", "body", "stamina", "frozen", "mode"):
            assert getattr(alone, name)[0] == pytest.approx(getattr(whole, name)[row], abs=1e-12)
    assert whole.touched.any(axis=1).mean() > 0.9


def test_what_is_not_computed_is_refused() -> None:
    for unlisted in (1, -1):
        with pytest.raises(IndexError):
            step(put(at_rest(), 3, type=unlisted), nobody(), RULES)
    with pytest.raises(UsageError, match="wind_rand = 0"):
        Rules.of({"wind_rand": 0.1}, TYPES)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("ball_decay", 1.0, "expected ball_decay to be more than 0 and less than 1, got 1"),
        ("player_decay", 1.0, "expected player_decay to be more than 0 and less than 1, got 1"),
        ("player_decay", np.nan, "got nan"),
        ("player_decay", 0.0, "expected player_decay to be more than 0 and less than 1, got 0"),
        ("simulator_step", 0.0, "expected simulator_step to be more than 0 and at most 1e.07, got 0"),
        ("ball_decay", "x", "expected ball_decay to be a number, got 'x'"),
        ("ball_size", 0.0, "expected ball_size to be more than 0 and at most 1e.07, got 0"),
        ("stamina_max", np.inf, "got inf"),
        ("dash_power_rate", 1e5, "expected a dash_power_rate of at most 0.1, got 100000"),
        ("inertia_moment", 1e30, "expected inertia_moment to be a number within 1e"),
    ],
)
def test_rules_that_no_match_is_played_by(name: str, value: Any, expected: str) -> None:
    types: dict[str, Any] = dict(TYPES)
    params: dict[str, Any] = {}
    if name in types:
        types[name] = np.array([value])
    else:
        params[name] = value
    with pytest.raises(UsageError, match=expected):
        Rules.of(params, types)


@pytest.mark.parametrize(
    ("params", "version"),
    [
        ({}, 16),
        ({"stamina_capacity": 148600.0}, 13),
        ({"stamina_capacity": 130600.0, "tackle_rand_factor": 2.0}, 14),
        ({"red_card_probability": 0.0}, 15),
        ({"illegal_defense_number": 0.0}, 16),
        ({"max_catch_angle": 90.0}, 17),
        ({"dist_noise_rate": 0.0125}, 19),
    ],
)
def test_the_version_is_what_the_parameters_show(params: dict[str, float], version: int) -> None:
    rules = Rules.of(params, TYPES)
    assert rules.version == version
    assert rules.legs == (version == 19)
    assert rules.server["back_dash_rate"] == {13: 0.5, 17: 0.7, 19: 0.7}.get(version, 0.6)
    assert rules.server["dash_angle_step"] == {13: 90.0, 14: 45.0, 15: 45.0}.get(version, 1.0)
    assert rules.server["tackle_rand_factor"] == (1.0 if version == 13 else 2.0)


def test_what_versions_before_14_and_15_do_otherwise() -> None:
    old = Rules.of({"stamina_capacity": 148600.0, "kick_power_rate": 0.016}, TYPES)
    kicked = step(near_the_ball(), does(5, CommandKind.KICK, 50.0, 0.0), old)
    assert kicked.x[0, BALL] == pytest.approx(50 * 0.016)
    bodies = put(put(at_rest(), 0, x=-1.0, y=0.0), BALL, vx=-0.5)
    missed = step(bodies, does(0, CommandKind.CATCH, 0.0), old, succeeded=np.zeros((1, N_PLAYERS), np.bool_))
    assert missed.vx[0, BALL] == pytest.approx(-0.5 * BALL_DECAY)
    assert missed.banned[0, 0] == 0


def test_no_cycles_at_all() -> None:
    assert len(step(at_rest(0), nobody(0), RULES)) == 0
