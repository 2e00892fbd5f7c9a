"""The step of a cycle against the real server, on logs without noise (tests/data/physics)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from physics import outside, told, transitions
from teamclone.dynamics.bodies import BALL
from teamclone.logs import find_matches, read_pair
from teamclone.rcss import pitch
from teamclone.rcss.commands import CommandKind

LOGS = {pair.path.name.split(".")[0]: pair for pair in find_matches([Path(__file__).parents[2] / "data" / "physics"])}


@pytest.mark.parametrize("name", sorted(LOGS.keys() - {"posts"}))
def test_every_cycle_of_play_is_what_the_server_made_of_it(name: str) -> None:
    moves = transitions(read_pair(LOGS[name]))
    assert len(moves.cycle) > 35
    assert told(moves, outside(moves)) == []


def test_so_it_is_at_the_goal_posts() -> None:
    """But for players that stand within or at a post: how far out they are put hangs on the last bit of a number."""
    moves = transitions(read_pair(LOGS["posts"]))
    reach = pitch.POST_RADIUS + np.append(np.full(BALL, 0.3), 0.085)
    post_x, post_y = pitch.HALF_LENGTH - pitch.POST_RADIUS, pitch.GOAL_WIDTH / 2 + pitch.POST_RADIUS
    distance = np.hypot(np.abs(moves.before.x) - post_x, np.abs(moves.before.y) - post_y)
    clear = ~(distance < reach + 2e-4).any(axis=-1)
    assert clear.sum() > 30
    found = {name: wrong & clear[:, None] for name, wrong in outside(moves).items()}
    assert told(moves, found) == []
    came_near = (distance[clear, BALL] < 3.0).any()
    assert came_near


@pytest.mark.parametrize(
    ("name", "log"),
    [
        ("ball_decay", "kicks"),
        ("side_dash_rate", "dashes"),
        ("back_dash_rate", "dashes"),
        ("recover_dec", "stamina"),
        ("tackle_power_rate", "tackles"),
        ("effort_inc", "stamina"),
        ("dash_power_rate", "helios"),
        ("player_decay", "helios"),
        ("inertia_moment", "turns"),
        ("kick_power_rate", "kicks"),
        ("kickable_margin", "kicks"),
        ("player_size", "collisions"),
        ("stamina_inc_max", "helios"),
        ("effort_min", "stamina"),
        ("extra_stamina", "stamina"),
    ],
)
def test_a_rule_that_is_off_by_a_hundredth_is_seen(name: str, log: str) -> None:
    moves = transitions(read_pair(LOGS[log]))
    rules = moves.rules
    if name in rules.types:
        rules = replace(rules, types={**rules.types, name: rules.types[name] * 0.99})
    else:
        rules = replace(rules, server={**rules.server, name: rules.server[name] * 0.99})
    assert any(wrong.any() for wrong in outside(replace(moves, rules=rules)).values())


def test_the_logs_hold_what_they_are_there_for() -> None:
    seen: dict[int, int] = {}
    legs = touched = foul = short = 0
    for pair in LOGS.values():
        moves = transitions(read_pair(pair))
        for kind in CommandKind:
            seen[kind] = seen.get(kind, 0) + int((moves.commands.kind == kind).sum())
        given = moves.commands.legs
        legs += int((~np.isnan(given[..., 0])).any(-1).sum() - (given[..., 0, :] == given[..., 1, :]).all(-1).sum())
        touched += int(moves.after.touched.sum())
        foul += int(moves.commands.foul.sum())
        short += int((moves.before.stamina < 100).sum())
    assert seen[CommandKind.DASH] > 5000
    assert seen[CommandKind.TURN] > 2000
    assert seen[CommandKind.KICK] > 100
    assert seen[CommandKind.TACKLE] > 40
    assert min(legs, touched, short) > 500
    assert foul > 10
