"""Permutations against what can be counted by hand, and that chance is called chance."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from teamclone.scout.significance import PERMUTATIONS, discoveries, permuted, swapped


def test_swapping_is_near_the_count_of_all_swaps() -> None:
    own = np.array([5.0, 7, 6, 9, 4, 8]), np.full(6, 10.0)
    other = np.array([3.0, 6, 5, 9, 4, 2]), np.full(6, 10.0)
    apart = (own[0] - other[0]).sum()
    every = [
        abs(sum(sign * one for sign, one in zip(signs, own[0] - other[0], strict=True)))
        for signs in product((1, -1), repeat=6)
    ]
    exact = np.mean(np.array(every) >= apart)
    assert swapped(own, other) == pytest.approx(exact, abs=0.02)
    assert swapped(other, own) == pytest.approx(exact, abs=0.02)


def test_equal_teams_are_not_apart() -> None:
    one = np.arange(8.0), np.full(8, 10.0)
    assert swapped(one, one) == 1.0
    assert np.isnan(swapped((np.zeros(3), np.zeros(3)), (np.zeros(3), np.zeros(3))))


def test_a_change_is_found_and_one_of_opponents_is_not() -> None:
    rng = np.random.default_rng(1)
    before, since = (np.clip(rng.normal(mean, 0.05, 10), 0, 1) for mean in (0.3, 0.5))
    whole = np.ones(10)
    assert permuted((before, whole), (since, whole), ["A"] * 20) < 0.01
    # All matches before against one opponent, all since against another: nothing may change places.
    assert permuted((before, whole), (since, whole), ["A"] * 10 + ["B"] * 10) == 1.0


def test_chance_is_rarely_called_a_change() -> None:
    rng = np.random.default_rng(2)
    values = [
        permuted((rng.normal(size=8), np.ones(8)), (rng.normal(size=8), np.ones(8)), ["A"] * 16) for _ in range(60)
    ]
    assert np.mean(np.array(values) < 0.1) < 0.25
    assert min(values) >= 1 / (1 + PERMUTATIONS)


def test_corrected_as_in_the_example_of_the_paper() -> None:
    """Benjamini and Hochberg 1995, section 3.2: four of fifteen are discoveries at .05."""
    p = [
        0.0001,
        0.0004,
        0.0019,
        0.0095,
        0.0201,
        0.0278,
        0.0298,
        0.0344,
        0.0459,
        0.3240,
        0.4262,
        0.5719,
        0.6528,
        0.7590,
        1,
    ]
    corrected = discoveries(p)
    assert (corrected <= 0.05).sum() == 4
    assert corrected[0] == pytest.approx(0.0001 * 15)
    assert (np.diff(corrected) >= 0).all()
    assert np.isnan(discoveries([0.5, float("nan")])[1])
    assert len(discoveries([])) == 0
