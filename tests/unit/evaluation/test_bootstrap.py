"""Intervals: paired, repeatable, exact in what they resample, and about as wide as they claim."""

from __future__ import annotations

import numpy as np

from teamclone.evaluation import bootstrap, metrics
from teamclone.evaluation.predictions import Predictions


def made(seed: int, *, n: int = 400, n_matches: int = 3) -> Predictions:
    generator = np.random.default_rng(seed)
    issued = np.full((n, 6), np.nan, np.float32)
    kind = generator.integers(0, 4, n)
    issued[kind == 1, 2] = generator.uniform(-180, 180, int((kind == 1).sum()))
    return Predictions(
        probabilities=generator.dirichlet(np.ones(4), n).astype(np.float32),
        parameters=generator.uniform(-100, 100, (n, 6)).astype(np.float32),
        parameter_log_loss=generator.normal(3, 1, n).astype(np.float32),
        kind=kind,
        issued=issued,
        last=generator.integers(-1, 4, n),
        match=generator.integers(0, n_matches, n),
        position=np.zeros((n, 2), np.float32),
    )


def test_draws_are_whole_samples_and_repeat_with_the_seed() -> None:
    draws = bootstrap.draw(5, seed=1, n_resamples=200)
    assert draws.shape == (200, 5)
    np.testing.assert_array_equal(draws.sum(axis=1), 5)
    np.testing.assert_array_equal(draws, bootstrap.draw(5, seed=1, n_resamples=200))
    assert (draws != bootstrap.draw(5, seed=2, n_resamples=200)).any()


def test_a_resample_has_the_figures_of_its_rows() -> None:
    """Match 0 twice, match 1 never, match 2 once: the same as measuring these rows again."""
    outcome = made(4)
    edges = metrics.confidence_edges(outcome.probabilities)
    _, sums = metrics.measure(outcome, edges=edges)
    resampled = bootstrap.resample(sums, np.array([[2, 0, 1]]))
    rows = np.concatenate([np.flatnonzero(outcome.match == match) for match in (0, 0, 2)])
    again = metrics.measure(outcome.rows(rows), edges=edges)[1].total()
    for one, other in zip(resampled, again, strict=True):
        np.testing.assert_allclose(one[0], other)
    for one, other in zip(metrics.scores(resampled), metrics.scores(again), strict=True):
        np.testing.assert_allclose(one[0], other)


def test_interval_is_the_middle_of_the_resamples() -> None:
    values = np.stack([np.arange(1001.0), np.full(1001, np.nan)], axis=1)
    low, high = bootstrap.interval(values)
    np.testing.assert_allclose(low, [25, np.nan])
    np.testing.assert_allclose(high, [975, np.nan])


def test_interval_ignores_resamples_in_which_a_figure_is_undefined() -> None:
    low, high = bootstrap.interval(np.array([np.nan, 0.5, 0.5, np.nan]))
    assert low == high == 0.5


def test_intervals_cover_the_truth_about_as_often_as_they_say() -> None:
    """Matches of a known mean accuracy: of 200 intervals from 30 matches each, 95 % less a little hold it."""
    generator = np.random.default_rng(0)
    covered = 0
    for trial in range(200):
        hits = generator.binomial(1000, np.clip(generator.normal(0.8, 0.03, 30), 0, 1))
        draws = bootstrap.draw(30, seed=trial, n_resamples=400)
        low, high = bootstrap.interval((draws @ hits) / 30_000)
        covered += bool(low <= 0.8 <= high)
    assert 0.88 <= covered / 200 <= 0.985
