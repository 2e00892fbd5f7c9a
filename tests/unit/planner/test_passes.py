"""Passes: places in rows, and the conditions by which they are picked."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from teamclone.dynamics import formulas
from teamclone.planner import passes, scene


def test_offsets_lie_in_rows() -> None:
    places, begins = passes.offsets([(2.0, [0.0, 90.0, 180.0]), ([1.0, 3.0], -90.0)])
    assert begins.tolist() == [0, 3, 5]
    np.testing.assert_allclose(places, [[2, 0, -2, 0, 0], [0, 2, 0, -1, -3]], atol=1e-12)


def test_places_around_are_at_least_so_far_apart() -> None:
    """24 or 12 places on each of four rings: the inner rings have 12, whose places would else be too close."""
    places, begins = passes.AROUND
    assert np.diff(begins).tolist() == [12, 12, 24, 24]
    for ring, (begin, end) in enumerate(pairwise(begins), 1):
        x, y = places[:, begin:end]
        np.testing.assert_allclose(np.hypot(x, y), 1.1 * ring)
        assert np.hypot(x - np.roll(x, 1), y - np.roll(y, 1)).min() > 0.55


def test_places_ahead_are_a_fan() -> None:
    places, begins = passes.FAN
    assert np.diff(begins).tolist() == [13] * 15
    degrees, metres = np.degrees(np.arctan2(places[1], places[0])), np.hypot(*places)
    np.testing.assert_allclose(degrees.reshape(15, 13), np.linspace(-40, 40, 15)[:, None] + np.zeros(13), atol=1e-9)
    np.testing.assert_allclose(metres.reshape(15, 13), np.linspace(6, 30, 13) + np.zeros((15, 1)))


def test_nearest_are_the_places_that_are_nearest() -> None:
    random = np.random.default_rng(1)
    made = np.zeros((scene.ROWS, scene.COLUMNS))
    made[:, [scene.X, scene.Y]] = random.uniform(-30, 30, (scene.ROWS, 2))
    made[:, scene.RECEIVES] = random.random(scene.ROWS) < 0.6
    x, y = random.uniform(-40, 40, (2, 500))
    rows = np.flatnonzero(made[: scene.OPPONENT, scene.RECEIVES])
    metres = np.hypot(made[rows, scene.X, None] - x, made[rows, scene.Y, None] - y)
    assert len(rows) > 3
    for place, row in enumerate(rows):
        near = passes.nearest(made, row, x, y)
        assert 0 < near.sum() < 500
        np.testing.assert_array_equal(near, metres.argmin(axis=0) == place)


@pytest.mark.parametrize("decay", [0.9, 0.94, 0.96])
def test_cycles_after_which_the_ball_is_slow(decay: float) -> None:
    """The ball of so many cycles is slow enough where it gets to, that of one less is not."""
    random = np.random.default_rng(2)
    for metres, most in random.uniform((3.0, 0.5), (30.0, 2.0), (200, 2)):
        cycles = passes.cycles_to_slow(metres, most, decay)
        assert cycles > 0
        arriving = [metres / formulas.roll(count, decay) * decay**count for count in (cycles - 1, cycles) if count]
        assert arriving[-1] <= most
        assert len(arriving) == 1 or arriving[0] > most
