"""Figures of merit. One pass sums what is needed per match; every figure is derived from such sums.

The confusion matrix comes first: rates are never averaged over batches or rows, only counts are. Because every figure
is a function of sums over matches, the same functions give the figure of one match, of an opponent, of a split, and of
a thousand bootstrap resamples at once (`evaluation.bootstrap`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.evaluation.predictions import Predictions
from teamclone.rcss.commands import CLONED, parameters_of
from teamclone.rcss.reference_frame import wrap_degrees

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

CALIBRATION_BINS = 15
MOST_LOSS = 20.0
"""Log loss of a command that a clone holds for impossible, nats, in means: one infinity would be all of them."""


def even_log_loss(commands: Sequence[str]) -> dict[str, float]:
    """Return the `Predictions.parameter_log_loss` of an even guess over the whole range of a command's parameters."""
    return {
        name: sum(
            math.log(item.limit if item.unit == "power" else 2 * item.limit)
            for item in parameters_of(tuple(commands))
            if item.kind.name.lower() == name
        )
        for name in commands
    }


class Sums(NamedTuple):
    """The sums from which every figure is computed.

    Leading axes (...) are matches or resamples; none for a total.

    Attributes:
        confusion: (..., commands, commands) rows with [command given, command predicted].
        log_loss: (...) sum of -ln(probability of the command given), nats.
        brier: (...) sum of squared distances between probabilities and the one-hot truth, 0 to 2 a row.
        bin_count: (..., bins) rows by confidence in the predicted command.
        bin_confidence: (..., bins) their summed confidence.
        bin_hits: (..., bins) those predicted right.
        parameter_count: (..., parameters) commands that carried the parameter.
        parameter_error: (..., parameters) their summed absolute error in power, circular degrees and metres.
        likelihood_count: (..., commands) rows of each command given whose parameters got a likelihood.
        parameter_log_loss: (..., commands) their summed -ln likelihood, nats.
        paper_error: (...) sum over rows of the mean over all outputs, as the paper took it.
    """

    confusion: Floats
    log_loss: Floats
    brier: Floats
    bin_count: Floats
    bin_confidence: Floats
    bin_hits: Floats
    parameter_count: Floats
    parameter_error: Floats
    likelihood_count: Floats
    parameter_log_loss: Floats
    paper_error: Floats

    def select(self, matches: NDArray[np.integer] | NDArray[np.bool_]) -> Sums:
        """Return some entries of the first axis."""
        return Sums(*(values[matches] for values in self))

    def total(self) -> Sums:
        """Return the sums over the first axis."""
        return Sums(*(values.sum(axis=0) for values in self))


def confusion_matrix(
    kind: NDArray[np.integer], predicted: NDArray[np.integer], *, n_kinds: int = len(CLONED)
) -> Counts:
    """Return (n_kinds, n_kinds) rows with [command given, command predicted], from (n,) indices of commands."""
    counts = np.bincount(kind * n_kinds + predicted, minlength=n_kinds * n_kinds)
    return counts.astype(np.int64).reshape(n_kinds, n_kinds)


def log_loss(probabilities: NDArray[np.floating], kind: NDArray[np.integer]) -> Floats:
    """Return (n,) -ln of the probability of the true command, nats; 0 counts as the smallest float32 step."""
    given = probabilities[np.arange(len(kind)), kind].astype(np.float64)
    loss: Floats = -np.log(np.clip(given, np.finfo(np.float32).eps, 1.0))
    return loss


def brier(probabilities: NDArray[np.floating], kind: NDArray[np.integer]) -> Floats:
    """Return (n,) squared distance to the one-hot truth, summed over the commands.

    0 is best, 2 worst (Brier 1950).
    """
    distance = probabilities.astype(np.float64)
    distance[np.arange(len(kind)), kind] -= 1.0
    squared: Floats = np.square(distance).sum(axis=1)
    return squared


def parameter_errors(
    predicted: NDArray[np.floating], issued: NDArray[np.floating], commands: tuple[str, ...] = CLONED
) -> Floats:
    """Return (n, parameters) absolute errors.

    In power, degrees around the circle and metres; NaN where nothing was issued.

    Around the circle 179 and -179 degrees are 2 degrees apart.
    """
    difference = predicted.astype(np.float64) - issued.astype(np.float64)
    is_angle = [item.angle for item in parameters_of(commands)]
    difference[:, is_angle] = wrap_degrees(difference[:, is_angle])
    error: Floats = np.abs(difference)
    return error


def paper_errors(
    predicted: NDArray[np.floating], issued: NDArray[np.floating], commands: tuple[str, ...] = CLONED
) -> Floats:
    """Return (n,) the paper's regression error.

    It is the mean over all outputs in [-1, 1], zero expected where nothing was issued.

    Five or four of the six are usually zeros that are easy to predict, and angles do not wrap, so it hardly measures
    the error of a command's parameter; it is here to be compared with the published 0.069.
    """
    limits = np.array([item.limit for item in parameters_of(commands)])
    wanted = np.nan_to_num(issued.astype(np.float64)) / limits
    error: Floats = np.abs(predicted.astype(np.float64) / limits - wanted).mean(axis=1)
    return error


def confidence_edges(probabilities: NDArray[np.floating], bins: int = CALIBRATION_BINS) -> Floats:
    """Return inner edges that cut rows into bins of equal mass by the probability of the predicted command.

    Shape (bins - 1,) or fewer: equal confidences are never parted.
    """
    if len(probabilities) == 0:
        return np.zeros(0)
    return np.unique(np.quantile(probabilities.max(axis=1).astype(np.float64), np.arange(1, bins) / bins))


def measure(outcome: Predictions, *, edges: Floats | None = None) -> tuple[Counts, Sums]:
    """Return the matches of an outcome, ascending (n_matches,), and the sums of each: first axis n_matches.

    Args:
        outcome: the predictions and the true commands.
        edges: inner edges of the confidence bins; None cuts this outcome into bins of equal mass.
    """
    edges = confidence_edges(outcome.probabilities) if edges is None else edges
    matches, code = np.unique(outcome.match, return_inverse=True)
    n_matches, n_bins, n_kinds = len(matches), len(edges) + 1, len(outcome.commands)
    predicted = outcome.probabilities.argmax(axis=1)
    confidence = outcome.probabilities.max(axis=1).astype(np.float64)
    cell = code * n_bins + np.searchsorted(edges, confidence, side="right")
    error = parameter_errors(outcome.parameters, outcome.issued, outcome.commands)
    known = np.isfinite(outcome.issued)
    likely = np.isfinite(outcome.parameter_log_loss)

    def by_match(values: NDArray[np.generic]) -> Floats:
        return np.bincount(code, weights=values.astype(np.float64), minlength=n_matches).astype(np.float64)

    def by_bin(values: NDArray[np.generic]) -> Floats:
        sums = np.bincount(cell, weights=values.astype(np.float64), minlength=n_matches * n_bins)
        return sums.astype(np.float64).reshape(n_matches, n_bins)

    def by_kind(values: NDArray[np.generic]) -> Floats:
        sums = np.bincount(code * n_kinds + outcome.kind, weights=values, minlength=n_matches * n_kinds)
        return sums.astype(np.float64).reshape(n_matches, n_kinds)

    square = (code * n_kinds + outcome.kind) * n_kinds + predicted
    confusion = np.bincount(square, minlength=n_matches * n_kinds**2).reshape(n_matches, n_kinds, n_kinds)
    sums = Sums(
        confusion=confusion.astype(np.float64),
        log_loss=by_match(log_loss(outcome.probabilities, outcome.kind)),
        brier=by_match(brier(outcome.probabilities, outcome.kind)),
        bin_count=by_bin(np.ones(len(outcome))),
        bin_confidence=by_bin(confidence),
        bin_hits=by_bin(predicted == outcome.kind),
        parameter_count=np.stack([by_match(column) for column in known.T], axis=1),
        parameter_error=np.stack([by_match(column) for column in np.where(known, error, 0.0).T], axis=1),
        likelihood_count=by_kind(likely),
        parameter_log_loss=by_kind(np.where(likely, outcome.parameter_log_loss, 0.0)),
        paper_error=by_match(paper_errors(outcome.parameters, outcome.issued, outcome.commands)),
    )
    return matches.astype(np.int64), sums


def ratio(numerator: NDArray[np.number], denominator: NDArray[np.number]) -> Floats:
    """Divide element by element; NaN where the denominator is 0, because such a rate is undefined, not 0."""
    top, bottom = np.broadcast_arrays(np.asarray(numerator, np.float64), np.asarray(denominator, np.float64))
    result: Floats = np.divide(top, bottom, out=np.full(top.shape, np.nan), where=bottom != 0)
    return result


class Rates(NamedTuple):
    """Per command, (..., commands): of a confusion matrix with TP, FP, FN, TN counted one command against the rest.

    Attributes:
        support: rows where the command was given, TP + FN.
        predicted: rows where it was predicted, TP + FP.
        precision: TP / (TP + FP).
        recall: TP / (TP + FN), which the paper calls scaled accuracy.
        specificity: TN / (TN + FP).
        f1: harmonic mean of precision and recall, 2 TP / (2 TP + FP + FN).
        share: TP / all rows, the command's part of the accuracy; the paper's "accuracy" of a command.
        paper_recall: TP / (TP + every error predicted as another command), as the paper's code computed "recall".
        paper_specificity: right answers of other commands / (these + FP), as the paper's code computed "specificity".
    """

    support: Floats
    predicted: Floats
    precision: Floats
    recall: Floats
    specificity: Floats
    f1: Floats
    share: Floats
    paper_recall: Floats
    paper_specificity: Floats


def rates(confusion: NDArray[np.number]) -> Rates:
    """Return rates per command of (..., commands, commands) confusion matrices; NaN where undefined."""
    confusion = np.asarray(confusion, np.float64)
    hits = np.diagonal(confusion, axis1=-2, axis2=-1)
    support, predicted = confusion.sum(axis=-1), confusion.sum(axis=-2)
    everything = confusion.sum(axis=(-2, -1))[..., None]
    right = hits.sum(axis=-1)[..., None]
    false_positives = predicted - hits
    negatives = everything - support
    wrong_elsewhere = (everything - right) - false_positives
    return Rates(
        support=support,
        predicted=predicted,
        precision=ratio(hits, predicted),
        recall=ratio(hits, support),
        specificity=ratio(negatives - false_positives, negatives),
        f1=ratio(2 * hits, support + predicted),
        share=ratio(hits, everything),
        paper_recall=ratio(hits, hits + wrong_elsewhere),
        paper_specificity=ratio(right - hits, right - hits + false_positives),
    )


class Scores(NamedTuple):
    """Figures of a whole set of rows, (...) each.

    Attributes:
        accuracy: share of rows whose command was predicted right.
        cross_entropy: mean -ln(probability of the command given), nats.
        brier: mean Brier score over the commands, 0 to 2.
        ece: expected calibration error: |confidence - accuracy| averaged over confidence bins by their rows
            (Naeini et al. 2015, top label, bins of equal mass).
        balanced_accuracy: mean recall over the commands that occur.
        macro_f1: mean F1 over the commands that occur.
        paper_mae: the paper's mean absolute error over all normalised outputs, zeros included.
    """

    accuracy: Floats
    cross_entropy: Floats
    brier: Floats
    ece: Floats
    balanced_accuracy: Floats
    macro_f1: Floats
    paper_mae: Floats


def scores(sums: Sums) -> Scores:
    """Return figures of every entry of the leading axes; NaN where there is no row."""
    rows = sums.confusion.sum(axis=(-2, -1))
    rate = rates(sums.confusion)
    gap = np.abs(sums.bin_hits - sums.bin_confidence).sum(axis=-1)
    return Scores(
        accuracy=ratio(np.trace(sums.confusion, axis1=-2, axis2=-1), rows),
        cross_entropy=ratio(sums.log_loss, rows),
        brier=ratio(sums.brier, rows),
        ece=ratio(gap, rows),
        balanced_accuracy=_mean_where(rate.recall, rate.support > 0),
        macro_f1=_mean_where(rate.f1, rate.support > 0),
        paper_mae=ratio(sums.paper_error, rows),
    )


def _mean_where(values: Floats, where: NDArray[np.bool_]) -> Floats:
    """Return the mean over the last axis of the values at True."""
    return ratio(np.where(where, np.nan_to_num(values), 0.0).sum(axis=-1), where.sum(axis=-1))


class Curve(NamedTuple):
    """A reliability curve, (bins,) each: rows, mean predicted probability, share that came true."""

    rows: Floats
    confidence: Floats
    observed_frequency: Floats


def top_label_curve(sums: Sums) -> Curve:
    """Return how often the predicted command was right, by the confidence in it; bins without rows are left out."""
    filled = sums.bin_count > 0
    count = sums.bin_count[filled]
    return Curve(
        rows=count, confidence=sums.bin_confidence[filled] / count, observed_frequency=sums.bin_hits[filled] / count
    )


def command_curve(outcome: Predictions, kind: int, bins: int = CALIBRATION_BINS) -> Curve:
    """Return how often a command was given, by its predicted probability, over all rows in bins of equal mass."""
    predicted = outcome.probabilities[:, kind].astype(np.float64)
    if len(predicted) == 0:
        return Curve(rows=np.zeros(0), confidence=np.zeros(0), observed_frequency=np.zeros(0))
    edges = np.unique(np.quantile(predicted, np.arange(1, bins) / bins))
    place = np.searchsorted(edges, predicted, side="right")
    count = np.bincount(place, minlength=len(edges) + 1).astype(np.float64)
    filled = count > 0
    summed = np.bincount(place, weights=predicted, minlength=len(count))
    total_true = np.bincount(place, weights=(outcome.kind == kind).astype(np.float64), minlength=len(count))
    return Curve(
        rows=count[filled],
        confidence=(summed / np.maximum(count, 1))[filled],
        observed_frequency=ratio(total_true, count)[filled],
    )


def median_errors(
    predicted: NDArray[np.floating], issued: NDArray[np.floating], commands: tuple[str, ...] = CLONED
) -> Floats:
    """Return (parameters,) median absolute error of the commands that carried each parameter; NaN where none did."""
    error = parameter_errors(predicted, issued, commands)
    medians = np.full(error.shape[1], np.nan)
    for index, column in enumerate(error.T):
        known = column[np.isfinite(column)]
        if len(known):
            medians[index] = np.median(known)
    return medians
