"""Errors of roll-outs by numbers that anybody can check."""

from __future__ import annotations

import math

import numpy as np
import pytest

from teamclone.rollouts.measure import measure


def test_errors_of_two_samples() -> None:
    """Of two bodies one counts: one sample of it is 1 m off after a cycle and 2 m after two, the other 3 m."""
    truth = np.zeros((1, 3, 2, 2))
    sampled = np.zeros((1, 2, 3, 2, 2))
    sampled[0, 0, 1:, 0, 0] = 1.0, 2.0
    sampled[0, 1, 1:, 0, 1] = 3.0, 3.0
    sampled[0, :, :, 1] = 99.0
    one, two = measure(sampled, truth, np.array([[True, False]]), np.array([2]))
    assert (one.cycles, two.cycles) == (1, 2)
    assert one.fde == one.ade == 2.0
    assert two.fde == 2.5
    assert two.ade == pytest.approx((1 + 2 + 3 + 3) / 4)
    assert two.min_fde == 2.0
    assert two.min_ade == 1.5
    assert two.mean_fde == pytest.approx(math.hypot(1.0, 1.5))
    # E|X - y| - E|X - X'| / 2 of {2, 0} around 0, and of {0, 3}.
    assert two.crps == pytest.approx(((1 - 1) + (1.5 - 1.5)) / 2)


def test_bodies_of_a_start_are_judged_together() -> None:
    """The best sample is that of all bodies: not of one body here and of another there."""
    truth = np.zeros((1, 2, 2, 2))
    sampled = np.zeros((1, 2, 2, 2, 2))
    sampled[0, 0, 1, :, 0] = 0.0, 4.0
    sampled[0, 1, 1, :, 0] = 4.0, 0.0
    [found] = measure(sampled, truth, np.ones((1, 2), np.bool_), np.array([1]))
    assert found.min_fde == 2.0


def test_a_start_counts_as_far_as_its_play_goes_on() -> None:
    truth = np.zeros((2, 6, 1, 2))
    sampled = np.zeros((2, 1, 6, 1, 2))
    sampled[1] = 7.0
    found = {one.cycles: one for one in measure(sampled, truth, np.ones((2, 1), np.bool_), np.array([5, 1]))}
    assert sorted(found) == [1, 2, 5]
    assert (found[1].starts, found[2].starts) == (2, 1)
    assert found[2].fde == 0.0
    assert math.isnan(found[2].crps)


def test_intervals_and_crps_of_a_true_distribution() -> None:
    rng = np.random.default_rng(0)
    truth = np.zeros((4000, 2, 1, 2))
    truth[:, 1] = rng.normal(size=(4000, 1, 2))
    sampled = np.zeros((4000, 200, 2, 1, 2))
    sampled[:, :, 1] = rng.normal(size=(4000, 200, 1, 2))
    [found] = measure(sampled, truth, np.ones((4000, 1), np.bool_), np.full(4000, 1))
    assert found.coverage == pytest.approx(0.9, abs=0.01)
    # Of the standard normal distribution: 1 / sqrt(pi).
    assert found.crps == pytest.approx(1 / math.sqrt(math.pi), abs=0.01)
