"""``describe``: the figures of one split, from predictions beside the true commands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.evaluation import baselines as rules
from teamclone.evaluation import bootstrap, metrics
from teamclone.evaluation.metrics import Scores, Sums
from teamclone.evaluation.predictions import Predictions
from teamclone.rcss.commands import parameters_of
from teamclone.rcss.playmodes import RESTARTS, PlayMode

Value = dict[str, float | None]
"""A figure as ``value``, ``low``, ``high``: the ends of its 95 % interval, None where there is none."""


def describe(
    outcome: Predictions, *, baselines: rules.Baselines, matches: Sequence[dict[str, Any]], seed: int = 0
) -> dict[str, Any]:
    """Return all figures of one split; intervals where it has two matches or more.

    Args:
        outcome: the split.
        baselines: counts of the training split.
        matches: facts of each match, indexed by ``outcome.match``; ``match_id`` and ``opponent`` are read. The
            two entries of a match in which both teams are modelled count as one.
        seed: of the bootstrap.
    """
    used, by_entry = metrics.measure(outcome)
    sums, entries = _by_match(by_entry, used, matches)
    total = sums.total()
    several = len(entries) > 1
    occurrences = bootstrap.draw(len(entries), seed=seed) if several else None
    resampled = bootstrap.resample(sums, occurrences) if occurrences is not None else None
    point = metrics.scores(total)
    spread = metrics.scores(resampled) if resampled is not None else None
    section: dict[str, Any] = {
        "rows": len(outcome),
        "matches": [
            _match([matches[index] for index in of_match], sums.select(np.array([place])))
            for place, of_match in enumerate(entries)
        ],
        "model": _scores(point, spread),
        "confusion": total.confusion.astype(int).tolist(),
        "commands": _commands(outcome.commands, total, resampled),
        "parameters": _parameters(outcome, total, resampled),
        "calibration": {
            "predicted_command": _curve(metrics.top_label_curve(total)),
            "commands": {
                name: _curve(metrics.command_curve(outcome, kind)) for kind, name in enumerate(outcome.commands)
            },
        },
        "baselines": {},
        **_situations(outcome),
        "opponents": _opponents(used, by_entry, matches, seed=seed),
    }
    for name in rules.NAMES:
        answer = baselines.answer(name, outcome)
        other, _ = _by_match(metrics.measure(answer)[1], used, matches)
        other_point = metrics.scores(other.total())
        other_spread = metrics.scores(bootstrap.resample(other, occurrences)) if occurrences is not None else None
        gain, skill = _gain(point, other_point)
        gains, skills = _gain(spread, other_spread) if spread is not None and other_spread is not None else (None, None)
        section["baselines"][name] = {
            **_scores(other_point, other_spread),
            "accuracy_gain": _value(gain, gains),
            "cross_entropy_skill": _value(skill, skills),
        }
        # Made for networks that answer zero for parameters not issued; it has no meaning for a constant guess.
        del section["baselines"][name]["paper_mae"]
    guess = baselines.answer("majority", outcome)
    medians = metrics.median_errors(guess.parameters, guess.issued, guess.commands)
    means = metrics.ratio(metrics.measure(guess)[1].total().parameter_error, total.parameter_count)
    for index, parameter in enumerate(parameters_of(outcome.commands)):
        constant = {
            "guess": number(baselines.parameters[index]),
            "mean": number(means[index]),
            "median": number(medians[index]),
        }
        section["parameters"][parameter.name]["constant"] = constant
    return section


def unseen_numbers(
    outcome: Predictions, *, players: NDArray[np.uint8], trained: NDArray[np.uint8]
) -> dict[str, dict[str, float | int]]:
    """Return uniform numbers that play in a split but never played in training, each with its rows and accuracy.

    Teams now and then give the goalkeeper another number than 1. A network that knows players by their number, as the
    paper's does, has then never seen a field player with the number that the goalkeeper had in training.

    Args:
        outcome: the split. players: (n,) the actors in it. trained: the actors in the rows of training.
    """
    right = outcome.probabilities.argmax(axis=1) == outcome.kind
    return {
        str(int(player) + 1): {
            "rows": int((players == player).sum()),
            "accuracy": float(right[players == player].mean()),
        }
        for player in np.setdiff1d(players, trained)
    }


def number(value: Any) -> float | None:
    """Return a Python float for JSON, None where it is undefined."""
    scalar = float(value)
    return scalar if math.isfinite(scalar) else None


def _value(point: Any, spread: NDArray[np.float64] | None) -> Value:
    """Return a figure with its interval, from its resampled values (n_resamples,)."""
    if spread is None:
        return {"value": number(point), "low": None, "high": None}
    low, high = bootstrap.interval(spread)
    return {"value": number(point), "low": number(low), "high": number(high)}


def _scores(point: Scores, spread: Scores | None) -> dict[str, Value]:
    return {
        name: _value(getattr(point, name), None if spread is None else getattr(spread, name)) for name in Scores._fields
    }


def _situations(outcome: Predictions) -> dict[str, Any]:
    """Return ``situations``: rows, accuracy and cross-entropy in play_on and by the team that restarts.

    Nothing where all is play_on.
    """
    if outcome.mode is None or (outcome.mode == PlayMode.PLAY_ON).all():
        return {}
    restarts = RESTARTS[outcome.mode]
    masks = {
        "play_on": outcome.mode == PlayMode.PLAY_ON,
        "own restart": restarts > 0,
        "their restart": restarts < 0,
    }
    table = {}
    for name, mask in masks.items():
        point = metrics.scores(metrics.measure(outcome.rows(mask))[1].total())
        table[name] = {
            "rows": int(mask.sum()),
            "accuracy": number(point.accuracy),
            "cross_entropy": number(point.cross_entropy),
        }
    return {"situations": table}


def _gain(model: Scores, other: Scores) -> tuple[Any, Any]:
    """Return by how much accuracy is higher, and which share of the other's cross-entropy is gone."""
    return model.accuracy - other.accuracy, 1.0 - metrics.ratio(model.cross_entropy, other.cross_entropy)


def _by_match(sums: Sums, used: NDArray[np.int64], matches: Sequence[dict[str, Any]]) -> tuple[Sums, list[list[int]]]:
    """Return sums of entries, those indexed by ``used``, as sums of matches, and the entries of each.

    Two entries of one match, each of another team, are the same game: no independent draws.
    """
    places: dict[str, list[int]] = {}
    for place, index in enumerate(used):
        places.setdefault(matches[index]["match_id"], []).append(place)
    grouped = [sums.select(np.array(of_match)).total() for of_match in places.values()]
    joined = Sums(*map(np.stack, zip(*grouped, strict=True))) if grouped else sums
    return joined, [[int(used[place]) for place in of_match] for of_match in places.values()]


def _match(entries: Sequence[dict[str, Any]], sums: Sums) -> dict[str, Any]:
    point = metrics.scores(sums.total())
    return {
        "match_id": entries[0]["match_id"],
        "opponent": " and ".join(entry["opponent"] for entry in entries),
        "rows": int(sums.confusion.sum()),
        "accuracy": number(point.accuracy),
        "cross_entropy": number(point.cross_entropy),
    }


def _commands(commands: Sequence[str], total: Sums, resampled: Sums | None) -> dict[str, Any]:
    point = metrics.rates(total.confusion)
    spread = metrics.rates(resampled.confusion) if resampled is not None else None
    losses = metrics.ratio(total.parameter_log_loss, total.likelihood_count)
    loss_spread = (
        metrics.ratio(resampled.parameter_log_loss, resampled.likelihood_count) if resampled is not None else None
    )
    counts = ("support", "predicted")
    table: dict[str, Any] = {}
    for kind, name in enumerate(commands):
        row: dict[str, Any] = {field: int(getattr(point, field)[kind]) for field in counts}
        for field in point._fields:
            if field not in counts:
                values = None if spread is None else getattr(spread, field)[:, kind]
                row[field] = _value(getattr(point, field)[kind], values)
        row["parameter_log_loss"] = _value(losses[kind], None if loss_spread is None else loss_spread[:, kind])
        table[name] = row
    return table


def _parameters(outcome: Predictions, total: Sums, resampled: Sums | None) -> dict[str, Any]:
    means = metrics.ratio(total.parameter_error, total.parameter_count)
    spread = metrics.ratio(resampled.parameter_error, resampled.parameter_count) if resampled is not None else None
    medians = metrics.median_errors(outcome.parameters, outcome.issued, outcome.commands)
    right = outcome.rows(outcome.probabilities.argmax(axis=1) == outcome.kind)
    _, sums = metrics.measure(right)
    when_right = metrics.ratio(sums.total().parameter_error, sums.total().parameter_count)
    return {
        parameter.name: {
            "command": parameter.kind.name.lower(),
            "unit": parameter.unit,
            "rows": int(total.parameter_count[index]),
            "mean": _value(means[index], None if spread is None else spread[:, index]),
            "median": number(medians[index]),
            "mean_when_command_right": number(when_right[index]),
        }
        for index, parameter in enumerate(parameters_of(outcome.commands))
    }


def _curve(curve: metrics.Curve) -> dict[str, list[Any]]:
    return {
        "rows": curve.rows.astype(int).tolist(),
        "confidence": [round(float(value), 6) for value in curve.confidence],
        "observed_frequency": [round(float(value), 6) for value in curve.observed_frequency],
    }


def _opponents(
    used: NDArray[np.int64], sums: Sums, matches: Sequence[dict[str, Any]], *, seed: int
) -> list[dict[str, Any]]:
    """Return the split by opponent, the most accurate first."""
    names = np.array([str(matches[index]["opponent"]) for index in used], object)
    table = []
    for name in sorted(set(names)):
        mine = sums.select(np.flatnonzero(names == name))
        n_matches = len(mine.log_loss)
        point = metrics.scores(mine.total())
        draws = bootstrap.draw(n_matches, seed=seed) if n_matches > 1 else None
        spread = metrics.scores(bootstrap.resample(mine, draws)) if draws is not None else None
        figures = _scores(point, spread)
        table.append(
            {
                "opponent": name,
                "matches": n_matches,
                "rows": int(mine.confusion.sum()),
                "accuracy": figures["accuracy"],
                "cross_entropy": figures["cross_entropy"],
            }
        )
    return sorted(table, key=lambda row: -(row["accuracy"]["value"] or 0.0))
