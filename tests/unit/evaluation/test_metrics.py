"""Figures against hand-made cases whose arithmetic is written out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from teamclone.evaluation import metrics, paper
from teamclone.evaluation.predictions import Predictions
from teamclone.rcss.commands import CLONED, REPERTOIRE

DASH, TURN, KICK, TACKLE = range(4)

# Rows given, columns predicted: 100 rows, 79 right, 21 wrong; columns hold 70, 24, 6, 0.
HAND = np.array([[60, 8, 2, 0], [9, 15, 0, 0], [1, 0, 4, 0], [0, 1, 0, 0]])


def outcome(probabilities, kind, *, parameters=None, losses=None, issued=None, last=None, match=None) -> Predictions:
    n = len(kind)
    return Predictions(
        probabilities=np.asarray(probabilities, np.float32).reshape(n, 4),
        parameters=np.zeros((n, 6), np.float32) if parameters is None else np.asarray(parameters, np.float32),
        parameter_log_loss=np.full(n, np.nan, np.float32) if losses is None else np.asarray(losses, np.float32),
        kind=np.asarray(kind, np.int64),
        issued=np.full((n, 6), np.nan, np.float32) if issued is None else np.asarray(issued, np.float32),
        last=np.full(n, -1, np.int64) if last is None else np.asarray(last, np.int64),
        match=np.zeros(n, np.int64) if match is None else np.asarray(match, np.int64),
        position=np.zeros((n, 2), np.float32),
    )


def of_confusion(confusion) -> Predictions:
    """Rows that give this confusion matrix, with certain predictions."""
    kind, predicted = (np.repeat(index.reshape(-1), confusion.reshape(-1)) for index in np.indices((4, 4)))
    return outcome(np.eye(4)[predicted], kind)


def test_confusion_matrix_counts_given_by_predicted() -> None:
    made = of_confusion(HAND)
    np.testing.assert_array_equal(metrics.confusion_matrix(made.kind, made.probabilities.argmax(1)), HAND)
    np.testing.assert_array_equal(metrics.measure(made)[1].total().confusion, HAND)


def test_rates_of_the_hand_made_case() -> None:
    rates = metrics.rates(HAND)
    np.testing.assert_array_equal(rates.support, [70, 24, 5, 1])
    np.testing.assert_array_equal(rates.predicted, [70, 24, 6, 0])
    np.testing.assert_allclose(rates.precision, [60 / 70, 15 / 24, 4 / 6, math.nan])
    np.testing.assert_allclose(rates.recall, [60 / 70, 15 / 24, 4 / 5, 0 / 1])
    # Of the 30, 76, 95, 99 rows of other commands, 10, 9, 2, 0 were predicted as the command.
    np.testing.assert_allclose(rates.specificity, [20 / 30, 67 / 76, 93 / 95, 99 / 99])
    np.testing.assert_allclose(rates.f1, [120 / 140, 30 / 48, 8 / 11, 0 / 1])
    np.testing.assert_allclose(rates.share, [0.60, 0.15, 0.04, 0.0])


def test_paper_columns_count_errors_of_other_commands_as_misses() -> None:
    rates = metrics.rates(HAND)
    # 21 errors less those predicted as the command: 11, 12, 19, 21 "misses".
    np.testing.assert_allclose(rates.paper_recall, [60 / 71, 15 / 27, 4 / 23, 0 / 21])
    # 79 right less those of the command: 19, 64, 75, 79.
    np.testing.assert_allclose(rates.paper_specificity, [19 / 29, 64 / 73, 75 / 77, 79 / 79])


def test_paper_columns_reproduce_the_published_table() -> None:
    """Counts per million with the paper's supports, hits and precisions give its Table IV, wrong rows included."""
    confusion = np.array(
        [
            [626_300, 49_547, 1_600, 73],
            [98_437, 209_100, 1_280, 0],
            [3_049, 50, 10_000, 0],
            [290, 26, 0, 84],
        ]
    )
    rates = metrics.rates(confusion)
    for field, published in paper.TABLE_IV.items():
        np.testing.assert_allclose(getattr(rates, field), published, atol=5e-3 if field == "precision" else 1e-3)
    assert rates.recall[KICK] == pytest.approx(0.763, abs=1e-3)
    assert rates.paper_recall[KICK] == pytest.approx(0.062, abs=1e-3)
    assert rates.paper_recall[TACKLE] == pytest.approx(0.00054, abs=1e-5)


def test_command_that_never_occurs_has_no_recall_and_leaves_the_means_alone() -> None:
    confusion = np.array([[8, 2, 0, 0], [1, 9, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]])
    rates = metrics.rates(confusion)
    assert np.isnan(rates.recall[KICK])
    assert np.isnan(rates.precision[KICK])
    scores = metrics.scores(metrics.measure(of_confusion(confusion))[1].total())
    assert scores.balanced_accuracy == pytest.approx((0.8 + 0.9) / 2)
    assert scores.macro_f1 == pytest.approx((16 / 19 + 18 / 21) / 2)


def test_cross_entropy_and_brier() -> None:
    made = outcome([[0.5, 0.25, 0.25, 0.0], [0.1, 0.8, 0.1, 0.0]], [DASH, KICK])
    scores = metrics.scores(metrics.measure(made)[1].total())
    assert scores.cross_entropy == pytest.approx((-math.log(0.5) - math.log(0.1)) / 2)
    first, second = 0.5**2 + 0.25**2 + 0.25**2, 0.1**2 + 0.8**2 + 0.9**2
    assert scores.brier == pytest.approx((first + second) / 2)
    assert scores.accuracy == 0.5


def test_cross_entropy_of_an_excluded_command_is_finite() -> None:
    loss = metrics.log_loss(np.array([[1.0, 0.0, 0.0, 0.0]]), np.array([TURN]))
    assert loss[0] == pytest.approx(-math.log(np.finfo(np.float32).eps))


def test_expected_calibration_error() -> None:
    """Four rows said 0.9 of which three are right, two said 0.6 of which one is: (|3-3.6| + |1-1.2|) / 6."""
    sure, unsure = [0.9, 0.1, 0.0, 0.0], [0.6, 0.4, 0.0, 0.0]
    made = outcome([sure] * 4 + [unsure] * 2, [DASH, DASH, DASH, TURN, DASH, TURN])
    sums = metrics.measure(made, edges=np.array([0.75]))[1].total()
    assert metrics.scores(sums).ece == pytest.approx(0.8 / 6, rel=1e-6)
    curve = metrics.top_label_curve(sums)
    np.testing.assert_array_equal(curve.rows, [2, 4])
    np.testing.assert_allclose(curve.confidence, [0.6, 0.9], rtol=1e-6)
    np.testing.assert_allclose(curve.observed_frequency, [0.5, 0.75])


def test_bins_hold_equal_mass_and_never_part_equal_confidences() -> None:
    generator = np.random.default_rng(3)
    probabilities = generator.dirichlet(np.ones(4), 1500)
    made = outcome(probabilities, generator.integers(0, 4, 1500))
    rows = metrics.measure(made)[1].total().bin_count
    assert len(rows) == metrics.CALIBRATION_BINS
    assert rows.max() - rows.min() <= 2
    same = outcome(np.tile([0.7, 0.1, 0.1, 0.1], (50, 1)), np.zeros(50))
    np.testing.assert_array_equal(metrics.top_label_curve(metrics.measure(same)[1].total()).rows, [50])


def test_command_curve_looks_at_one_command_over_all_rows() -> None:
    made = outcome(
        [[0.2, 0.8, 0, 0]] * 5 + [[0.6, 0.4, 0, 0]] * 5, [DASH, TURN, TURN, TURN, TURN] + [DASH] * 3 + [TURN] * 2
    )
    curve = metrics.command_curve(made, DASH, bins=2)
    np.testing.assert_allclose(curve.confidence, [0.2, 0.6], rtol=1e-6)
    np.testing.assert_allclose(curve.observed_frequency, [1 / 5, 3 / 5])


def test_directions_are_compared_around_the_circle() -> None:
    nan = math.nan
    #          dash power, direction, turn, kick power, direction, tackle
    issued = [[-100, -179, nan, nan, nan, nan], [nan, nan, 180, nan, nan, nan], [nan, nan, nan, 30, 90, nan]]
    predicted = [[100, 179, 0, 0, 0, 0], [0, 0, -180, 0, 0, 0], [0, 0, 0, 45.5, -90, 0]]
    error = metrics.parameter_errors(np.array(predicted), np.array(issued))
    np.testing.assert_allclose(
        error, [[200, 2, nan, nan, nan, nan], [nan, nan, 0, nan, nan, nan], [nan, nan, nan, 15.5, 180, nan]]
    )


def test_parameter_errors_count_issued_commands_only() -> None:
    nan = math.nan
    issued = np.array([[50, 0, nan, nan, nan, nan], [70, 10, nan, nan, nan, nan], [nan, nan, 30, nan, nan, nan]])
    predicted = np.array([[40, 5, 99, 99, 99, 99], [100, 350, 99, 99, 99, 99], [99, 99, 20, 99, 99, 99]])
    made = outcome(np.eye(4)[[DASH, DASH, TURN]], [DASH, DASH, TURN], parameters=predicted, issued=issued)
    total = metrics.measure(made)[1].total()
    np.testing.assert_array_equal(total.parameter_count, [2, 2, 1, 0, 0, 0])
    np.testing.assert_allclose(total.parameter_error, [10 + 30, 5 + 20, 10, 0, 0, 0])
    np.testing.assert_allclose(metrics.median_errors(predicted, issued), [20, 12.5, 10, nan, nan, nan])


def test_paper_mae_expects_zero_where_nothing_was_issued_and_does_not_wrap() -> None:
    issued = np.array([[50, -180, math.nan, math.nan, math.nan, math.nan]])
    predicted = np.array([[40, 180, 18, 0, 0, 0]])
    # |0.4-0.5| + |1-(-1)| + |0.1-0| over six outputs.
    np.testing.assert_allclose(metrics.paper_errors(predicted, issued), [(0.1 + 2.0 + 0.1) / 6])


def test_measure_keeps_matches_apart() -> None:
    made = outcome(np.eye(4)[[DASH, DASH, TURN]], [DASH, TURN, TURN], match=[7, 3, 7])
    matches, sums = metrics.measure(made)
    np.testing.assert_array_equal(matches, [3, 7])
    np.testing.assert_allclose(metrics.scores(sums).accuracy, [0.0, 1.0])
    assert metrics.scores(sums.total()).accuracy == pytest.approx(2 / 3)


def test_nothing_at_all_is_undefined_not_wrong() -> None:
    scores = metrics.scores(metrics.measure(outcome(np.zeros((0, 4)), []))[1].total())
    assert all(np.isnan(value) for value in scores)


def test_parameter_log_loss_is_summed_by_match_and_command_given() -> None:
    """Match 0: dashes of 2 and 4 nats, a turn without a likelihood; match 1: a dash of 3, a kick of -1."""
    made = outcome(
        np.full((5, 4), 0.25), [DASH, DASH, TURN, DASH, KICK], losses=[2, 4, math.nan, 3, -1], match=[0, 0, 0, 1, 1]
    )
    _, sums = metrics.measure(made)
    np.testing.assert_array_equal(sums.likelihood_count, [[2, 0, 0, 0], [1, 0, 1, 0]])
    np.testing.assert_array_equal(sums.parameter_log_loss, [[6, 0, 0, 0], [3, 0, -1, 0]])


def test_an_even_guess_spreads_over_the_range_of_each_parameter() -> None:
    power, angle = math.log(100), math.log(360)
    even = list(metrics.even_log_loss(REPERTOIRE).values())
    length, width = math.log(115), math.log(78)
    np.testing.assert_allclose(even, [power + angle, angle, power + angle, angle, angle, length + width, 0])


def test_figures_of_further_commands() -> None:
    """A move in metres, which do not wrap, and a command without parameters."""
    commands = (*CLONED, "move", "none")
    issued = np.full((3, 8), np.nan, np.float32)
    issued[0, 6:], issued[1, 2] = (-50, 30), -170
    predicted = np.zeros((3, 8), np.float32)
    predicted[0, 6:], predicted[1, 2] = (50, 26), 170
    made = Predictions(
        probabilities=np.eye(6, dtype=np.float32)[[4, 0, 5]],
        parameters=predicted,
        parameter_log_loss=np.array([2.0, 3.0, np.nan], np.float32),
        kind=np.array([4, 1, 5]),
        issued=issued,
        last=np.array([-1, 5, 0]),
        match=np.zeros(3, np.int64),
        position=np.zeros((3, 2), np.float32),
        mode=np.array([14, 3, 3]),
        commands=commands,
    )
    sums = metrics.measure(made)[1].total()
    assert sums.confusion.shape == (6, 6)
    assert (sums.confusion[4, 4], sums.confusion[1, 0], sums.confusion[5, 5]) == (1, 1, 1)
    assert sums.parameter_error.tolist() == [0, 0, 20, 0, 0, 0, 100, 4]
    assert sums.likelihood_count.tolist() == [0, 1, 0, 0, 1, 0]
    errors = (100 / 57.5 + 4 / 39) / 8, (340 / 180) / 8, 0
    np.testing.assert_allclose(metrics.paper_errors(predicted, issued, commands), errors, rtol=1e-6)
    assert metrics.median_errors(predicted, issued, commands)[6:].tolist() == [100, 4]
    some = made.rows(np.array([0, 2]))
    assert (len(some), some.commands, some.mode.tolist()) == (2, commands, [14, 3])
