"""The realism of roll-outs, on made ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from teamclone.rollouts.realism import FEATURES, realism
from teamclone.rollouts.run import MatchRollouts

STARTS, SAMPLES, HORIZON = 20, 4, 10


def walks(rng: np.random.Generator, *shape: int, speed: float = 0.5) -> np.ndarray:
    """Paths of 23 bodies that turn a little each cycle."""
    start = rng.uniform(-30, 30, (*shape, 1, 23, 2))
    angle = rng.uniform(-np.pi, np.pi, (*shape, 1, 23)) + rng.normal(0, 0.3, (*shape, HORIZON, 23)).cumsum(-2)
    way = speed * rng.uniform(0.5, 1.5, (*shape, HORIZON, 23, 1)) * np.stack([np.cos(angle), np.sin(angle)], -1)
    return np.concatenate([start, start + way.cumsum(-3)], -3).astype(np.float32)


def made(seed: int, **options: float) -> MatchRollouts:
    rng = np.random.default_rng(seed)
    own = np.zeros((STARTS, 22), bool)
    own[:, 1:11] = True
    return MatchRollouts(
        path=Path("made"),
        starts=np.arange(STARTS),
        cycles=np.arange(STARTS),
        reach=np.full(STARTS, HORIZON),
        own=own,
        on_field=np.ones((STARTS, 22), bool),
        truth=walks(rng, STARTS),
        places={"samples": walks(rng, STARTS, SAMPLES, **options)},
    )


def test_what_happened_is_real() -> None:
    match = made(0)
    scores = realism([replace(match, places={"samples": np.repeat(match.truth[:, None], 3, axis=1)})])
    assert set(scores) == {"samples"}
    assert scores["samples"] == pytest.approx(dict.fromkeys((*FEATURES, "all"), 1.0))


def test_the_same_distribution_is_nearly_real_and_another_less() -> None:
    same, faster = (realism([made(1, speed=speed)])["samples"] for speed in (0.5, 0.9))
    assert same["all"] > 0.95
    assert faster["speed"] < 0.6 < same["speed"]
    assert faster["speed of the ball"] < 0.6
    # How players stand to one another does not hang on their speed.
    assert faster["distance to the nearest mate"] == pytest.approx(same["distance to the nearest mate"], abs=0.05)


def test_a_score_by_hand() -> None:
    """Half of the cycles slow, half fast, against a quarter and three quarters."""
    match = made(2)
    line = np.zeros((1, 1, HORIZON + 1, 23, 2), np.float32)
    line[..., 1:, :, 0] = np.cumsum(np.where(np.arange(HORIZON) < 5, 0.25, 0.75))[:, None]
    other = np.zeros_like(line)
    other[..., 1:, :, 0] = np.cumsum(np.where(np.arange(HORIZON) < 2, 0.25, 0.75))[:, None]
    one = replace(
        match,
        reach=np.array([HORIZON]),
        own=match.own[:1],
        on_field=match.on_field[:1],
        truth=line[:, 0],
        places={"samples": other},
    )
    expected = np.exp(-(0.5 * np.log(0.5 / 0.2) + 0.5 * np.log(0.5 / 0.8)))
    assert realism([one])["samples"]["speed"] == pytest.approx(expected, rel=5e-3)


def test_other_matches_of_the_team_are_the_measure() -> None:
    scores = realism([made(3), made(4), made(5)])
    assert scores["other matches"]["all"] > 0.95
    failed = MatchRollouts(path=Path("bad"), error="bad")
    assert realism([made(3), failed, made(4), made(5)]) == scores
    assert realism([failed]) == {}


def test_only_cycles_of_play_count() -> None:
    match = made(6)
    beyond = {name: values.copy() for name, values in match.places.items()}
    beyond["samples"][:, :, 6:] += 40.0
    cut = replace(match, reach=np.full(STARTS, 5))
    assert realism([replace(cut, places=beyond)]) == realism([cut])


def test_a_team_alone_on_the_field() -> None:
    match = made(7)
    there = match.on_field.copy()
    there[:, 11:] = False
    assert realism([replace(match, on_field=there)])["samples"]["all"] > 0.9
