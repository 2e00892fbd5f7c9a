"""What cannot have happened is found, with its place and cause; real matches have nothing of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from teamclone.dynamics.audit import audit, rules_of
from teamclone.dynamics.bodies import BALL
from teamclone.dynamics.logged import Logged
from teamclone.dynamics.residuals import residuals
from teamclone.errors import UsageError
from teamclone.logs import Match, find_matches, read_pair
from teamclone.logs.align import frame_of
from teamclone.logs.match import Columns

SAMPLES = find_matches([Path(__file__).parents[3] / "samples"])
FRAME = 500
"""A frame of play_on, in the middle of play."""
SLOT = 5


@pytest.fixture(scope="module")
def played() -> Match:
    return read_pair(SAMPLES[0])


def copied(columns: Columns) -> Columns:
    return {name: values.copy() for name, values in columns.items()}


def found(match: Match, *, frames: Columns | None = None, players: Columns | None = None, **stated: float) -> list[Any]:
    """The deviations of a match of which something was changed; ``stated`` are parameters of its header."""
    types = copied(match.game.player_types)
    params = dict(match.game.server_params)
    used = match.players["type"][FRAME, SLOT]
    for name, value in stated.items():
        if name in types:
            types[name][used] = value
        else:
            params[name] = value
    frames, players = frames or match.frames, players or match.players
    commands = match.commands | {
        "frame": frame_of(frames, match.commands["cycle"], match.commands["stoppage"], has_stoppage=True)
    }
    logged = Logged.of_columns(frames, players, commands, match.command_text)
    return list(audit(logged, rules_of(params, types)).deviations)


@pytest.mark.parametrize("pair", SAMPLES, ids=lambda pair: pair.path.name)
def test_a_real_match_has_none(pair: Any) -> None:
    match = read_pair(pair)
    result = audit(Logged.of(match), rules_of(match.game.server_params, match.game.player_types))
    assert result.deviations == ()
    assert result.cycles > 1300
    assert result.unknown == 0
    assert min(result.compared.values()) > 250


@pytest.mark.parametrize(
    ("column", "change", "law"),
    [
        ("x", 0.001, "physics-position"),
        ("vy", 0.02, "physics-position"),
        ("body", 20.0, "physics-body"),
        ("neck", 1.0, "physics-neck"),
        ("stamina", 1.0, "physics-stamina"),
        ("effort", -0.001, "physics-effort"),
        ("recovery", -0.001, "physics-recovery"),
        ("capacity", -5.0, "physics-capacity"),
        ("ball_x", 0.001, "physics-position"),
        ("ball_vy", 0.05, "physics-position"),
    ],
)
def test_one_changed_value(played: Match, column: str, change: float, law: str) -> None:
    frames, players = copied(played.frames), copied(played.players)
    if column in frames:
        frames[column][FRAME] += change
    else:
        players[column][FRAME, SLOT] += change
    deviations = [one for one in found(played, frames=frames, players=players) if one.law.name == law]
    assert len(deviations) == 1
    assert deviations[0].cycle in (played.frames["cycle"][FRAME], played.frames["cycle"][FRAME + 1])
    assert ("the ball" if "ball" in column else "left 6") in deviations[0].what
    assert "this value was changed" in deviations[0].what


def test_a_type_that_changes_in_play_hides_nothing(played: Match) -> None:
    """Another type in one frame leaves the player's movement out, and is itself what cannot be."""
    players = copied(played.players)
    players["type"][FRAME, SLOT] = (players["type"][FRAME, SLOT] + 1) % 18
    players["x"][FRAME, SLOT] += 5.0
    [deviation] = [one for one in found(played, players=players) if one.law.name == "physics-type"]
    assert deviation.rows == 2
    assert deviation.cycle == played.frames["cycle"][FRAME]
    assert "left 6 has type" in deviation.what


@pytest.mark.parametrize(
    ("stated", "law", "cause"),
    [
        ({"ball_decay": 0.95}, "physics-position", "ball_decay is 0.94, not 0.95"),
        ({"player_rand": 0.08}, "physics-velocity", "player_rand"),
        ({"ball_rand": 0.04}, "physics-velocity", "ball_rand"),
        ({"side_dash_rate": 0.45}, "physics-velocity", "is not as the header says"),
        ({"recover_dec": 0.003}, "physics-recovery", "recover_dec"),
        ({"player_decay": 0.4}, "physics-position", "player_decay of type 15 is 0.376"),
        ({"dash_power_rate": 0.0055}, "physics-velocity", "of type 15"),
        ({"inertia_moment": 4.0}, "physics-body", "inertia_moment or player_rand of type 15"),
        ({"stamina_inc_max": 44.0}, "physics-stamina", "stamina_inc_max"),
        ({"effort_max": 0.9}, "physics-effort", "effort_max"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else None,
)
def test_a_parameter_that_was_not_played_with(played: Match, stated: dict[str, float], law: str, cause: str) -> None:
    deviations = {one.law.name: one for one in found(played, **stated)}
    assert cause in deviations[law].what
    assert deviations[law].rows > 5


def test_a_dropped_frame(played: Match) -> None:
    keep = np.arange(len(played.frames["cycle"])) != FRAME
    [deviation] = found(
        played,
        frames={name: values[keep] for name, values in played.frames.items()},
        players={name: values[keep] for name, values in played.players.items()},
    )
    assert deviation.law.name == "physics-frames"
    assert deviation.cycle == played.frames["cycle"][FRAME - 1]
    assert deviation.rows == 1


def exchange_sides(players: Columns) -> None:
    for values in players.values():
        values[FRAME:] = np.roll(values[FRAME:], 11, axis=1)


def exchange_frames(players: Columns) -> None:
    for values in players.values():
        values[[FRAME, FRAME + 1]] = values[[FRAME + 1, FRAME]]


@pytest.mark.parametrize("change", [exchange_sides, exchange_frames])
def test_whole_frames_that_are_not_where_they_were(played: Match, change: Callable[[Columns], None]) -> None:
    players = copied(played.players)
    change(players)
    deviations = {one.law.name: one for one in found(played, players=players)}
    assert "frames were lost or exchanged, or teams changed places" in deviations["physics-position"].what
    assert deviations["physics-position"].cycle == played.frames["cycle"][FRAME]


def test_noise_is_as_the_server_draws_it() -> None:
    """Uniform from 0 to its bound, of every term (`object.cpp`, `player.cpp`)."""
    shares: dict[str, list[Any]] = {"player": [], "ball": [], "turn": []}
    for pair in SAMPLES:
        match = read_pair(pair)
        logged = Logged.of(match)
        of = residuals(logged, rules_of(match.game.server_params, match.game.player_types))
        velocity, turned = of.of["velocity"], of.of["body"]
        kicked = (logged.commands.kind[of.frame] == 3).any(axis=-1)
        # Where noise is far over the resolution of the log, and of one term.
        clear = ~np.isnan(velocity.error) & (velocity.noise > 0.03)
        clear[kicked, BALL] = False
        share = velocity.error / np.where(clear, velocity.noise, 1.0)
        shares["player"].append(share[:, :BALL][clear[:, :BALL]])
        shares["ball"].append(share[:, BALL][clear[:, BALL]])
        clear = ~np.isnan(turned.error) & (turned.noise > 1.0)
        shares["turn"].append(turned.error[clear] / turned.noise[clear])
    at = np.linspace(0.05, 0.95, 19)
    for name, parts in shares.items():
        values = np.concatenate(parts)
        assert len(values) > 3000, name
        # The widest gap between the distributions, against its 1 in 1000 value (Kolmogorov and Smirnov).
        gap = np.abs(np.searchsorted(np.sort(values), at) / len(values) - at).max()
        assert gap < 1.95 / np.sqrt(len(values)), name


def test_what_cannot_be_judged_says_why(played: Match) -> None:
    logged = Logged.of(played)
    rules = rules_of(played.game.server_params, played.game.player_types)
    with pytest.raises(UsageError, match="got one without ball_decay"):
        rules_of({}, played.game.player_types)
    with pytest.raises(UsageError, match="without wind and noise by team, got wind_rand = 0"):
        rules_of(dict(played.game.server_params) | {"wind_rand": 0.3}, played.game.player_types)
    bodies = logged.bodies
    with pytest.raises(UsageError, match="player types 0 to 17, which the log lists"):
        audit(replace(logged, bodies=replace(bodies, type=bodies.type + 9)), rules)
    with pytest.raises(UsageError, match="without velocities"):
        audit(replace(logged, bodies=replace(bodies, vx=bodies.vx * np.nan)), rules)
