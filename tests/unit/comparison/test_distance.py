"""Distances in units: about 1 for matches like the original's, more for others, whatever the numbers of matches."""

from __future__ import annotations

import numpy as np
import pytest

from teamclone.comparison import distance
from teamclone.comparison.distance import Pairing


def units(original: np.ndarray, clone: np.ndarray, *, resamples: int = 40) -> distance.Distances:
    pairing = Pairing.of(["a"] * len(original), ["a"] * len(clone))
    return distance.measured(
        distance.of_means, pairing, original, clone, seed=0, draws=200, resamples=resamples, draws_each=40
    )


@pytest.mark.parametrize(("n", "m"), [(8, 8), (30, 30), (30, 9), (9, 30)])
def test_matches_of_the_same_team_are_one_unit_away(n: int, m: int) -> None:
    rng = np.random.default_rng(n * 100 + m)
    # 400 statistics at once: the mean of the distances against the mean of the units.
    found = units(rng.normal(5, 2, (n, 400)), rng.normal(5, 2, (m, 400)), resamples=1)
    assert found.clone.mean() / found.own.mean() == pytest.approx(1.0, abs=0.08)


def test_a_shifted_team_is_farther_the_more_matches_there_are() -> None:
    rng = np.random.default_rng(1)
    few, many = (
        units(rng.normal(0, 1, (n, 400)), rng.normal(2, 1, (n, 400)), resamples=1).units.mean() for n in (8, 40)
    )
    assert 2.5 < few < many


def test_the_unit_is_that_of_two_halves() -> None:
    """Of 0, 0, 4, 4 a third of the splits pairs equals and is 4 apart; the others are 0 apart."""
    found = units(np.array([[0.0], [0.0], [4.0], [4.0]]), np.array([[4.0], [4.0]]))
    assert found.own[0] == pytest.approx(4 / 3, rel=0.2)
    # A half's mean is 0, 2, 4 with 1/6, 4/6, 1/6.
    assert found.clone[0] == pytest.approx(2.0, rel=0.2)


def test_the_interval_holds_the_value_and_tells_a_shift() -> None:
    rng = np.random.default_rng(2)
    original = rng.normal(0, 1, (20, 50))
    same, shifted = (units(original, rng.normal(shift, 1, (20, 50)), resamples=200) for shift in (0.0, 3.0))
    assert (same.low <= same.units * 1.2).all()
    assert (shifted.low > 1).all()
    assert (same.low < 1).mean() > 0.8


def test_a_statistic_that_never_varies_has_no_units() -> None:
    found = units(np.zeros((6, 1)), np.zeros((6, 1)))
    assert np.isnan(found.units).all()
    assert np.isnan(found.low).all()
    other = units(np.zeros((6, 1)), np.ones((6, 1)))
    assert np.isinf(other.units).all()
    assert np.isinf(other.low).all()


def test_what_a_match_lacks_is_left_out_of_means() -> None:
    values = np.array([[1.0, np.nan], [3.0, np.nan], [np.nan, np.nan]])
    assert distance.means(values, np.ones((1, 3)))[0].tolist() == pytest.approx([2.0, np.nan], nan_ok=True)


def test_both_teams_have_the_opponents_in_equal_parts() -> None:
    pairing = Pairing.of(["a"] * 6 + ["b"] * 2, ["b"] * 5 + ["a"] * 2)
    assert pairing.sizes.tolist() == [2, 1]
    original, clone = pairing.weights()
    assert [original[:6].sum(), clone[5:].sum()] == pytest.approx([2 / 3, 2 / 3])
    half, rest, others = pairing.draw(50, rng=np.random.default_rng(0))
    assert (half[:, :6].sum(1) == 2).all()
    assert (rest[:, 6:].sum(1) == 1).all()
    assert (others[:, 5:].sum(1) == 2).all()
    assert not (half * rest).any(), "halves share no match"
    first, _ = pairing.resample(rng=np.random.default_rng(0))
    assert (pairing.original[first] == pairing.original).all()


def histogram(place: int, cycles: int = 10) -> np.ndarray:
    made = np.zeros((1, 8), np.int64)
    made[0, place] = cycles
    return distance.cumulated(made)


def test_histograms_are_apart_by_the_way_of_their_mass() -> None:
    one = np.ones((1, 1))
    found = distance.of_histograms(histogram(1), one, histogram(4, cycles=3), one)
    assert found.tolist() == [[3.0]]


def test_places_weigh_the_time_that_both_have() -> None:
    """Player 1 is 2 bins apart along the pitch while the ball is in zone 0, which both have for a half of the time."""
    first, second = np.zeros((2, 1, 11, 2, 9, 6), np.int64)
    for each, place in ((first, 1), (second, 3)):
        each[0, 0, :, 0, 1] = each[0, 0, :, 1, 2] = 10
        each[0, 0, 0, 0] = 0
        each[0, 0, 0, 0, place] = 10
    second[0, 0, :, 2, 0] = 99  # a zone that only one has
    one = np.ones((1, 1))
    apart, weight = distance.cells(distance.cumulated(first), one, distance.cumulated(second), one)
    assert apart[0, 0, :, 0].tolist() == [2.0, 0.0]
    assert weight[0, 0, 0, 2] == 0
    assert distance.of_places(distance.cumulated(first), one, distance.cumulated(second), one)[0, 0] == 0.5
    assert np.isnan(distance.averaged(apart, weight, axes=(2, 3))[0, 1]), "a player that neither has"
