"""Baselines without a network: rules from the training counts and, at most, the player's last command.

A clone that does not beat them has learned nothing. Each gives probabilities, so that the same figures apply.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from teamclone.evaluation.metrics import Counts, Floats
from teamclone.evaluation.predictions import Predictions
from teamclone.rcss.commands import CLONED, parameters_of

SMOOTHING = 1.0
"""Added to every count (Laplace), so that events missing in the training matches keep a probability."""

NAMES = ("majority", "persistence", "markov")


@dataclass(frozen=True, slots=True, kw_only=True)
class Baselines:
    """Counts of the training rows.

    Attributes:
        transitions: (commands + 1, commands) rows with [last executed command, command given]; last place of the first
            axis: none known.
        parameters: (parameters,) the constant guess of each: its median, around the circle for angles; NaN if unseen.
    """

    transitions: Counts
    parameters: Floats

    @property
    def prior(self) -> Floats:
        """(commands,) smoothed share of every command in training."""
        counts = self.transitions.sum(axis=0) + SMOOTHING
        share: Floats = counts / counts.sum()
        return share

    def table(self, name: str) -> Floats:
        """Return (commands + 1, commands) a baseline's probabilities after each last command, the last row if unknown.

        majority: the prior, whatever came before; its prediction is the most frequent command.
        persistence: the last command with the share of repetitions in training, the rest split by the prior; the
            prior where no last command is known.
        markov: smoothed share of each command after the last one.
        """
        prior = self.prior
        n_kinds = len(prior)
        if name == "majority":
            return np.tile(prior, (n_kinds + 1, 1))
        if name == "persistence":
            pairs = self.transitions[:n_kinds]
            repeats = (np.trace(pairs) + SMOOTHING) / (pairs.sum() + 2 * SMOOTHING)
            # It predicts the repetition by definition, so the repetition stays the most probable.
            repeats = max(float(repeats), 0.5)
            table = np.tile(prior, (n_kinds + 1, 1))
            for kind in range(n_kinds):
                others = prior.copy()
                others[kind] = 0.0
                table[kind] = (1.0 - repeats) * others / others.sum()
                table[kind, kind] = repeats
            return table
        if name == "markov":
            counts = self.transitions + SMOOTHING
            smoothed: Floats = counts / counts.sum(axis=1, keepdims=True)
            return smoothed
        raise ValueError(f"unknown baseline {name!r}, expected one of {', '.join(NAMES)}")

    def answer(self, name: str, outcome: Predictions) -> Predictions:
        """Return the rows of ``outcome`` with a baseline's answers in place of the model's."""
        probabilities = self.table(name)[outcome.last].astype(np.float32)  # -1, none known, is the last row
        parameters = np.broadcast_to(self.parameters.astype(np.float32), outcome.parameters.shape)
        return replace(
            outcome,
            probabilities=probabilities,
            parameters=parameters,
            parameter_log_loss=np.full(len(outcome), np.nan, np.float32),
        )


@dataclass(slots=True)
class Counter:
    """Counts training rows batch by batch: parameters in whole units, degrees and metres, enough for a median."""

    commands: tuple[str, ...]
    transitions: Counts
    histograms: Counts

    @classmethod
    def empty(cls, commands: tuple[str, ...] = CLONED) -> Counter:
        """Return counts of zero."""
        n_kinds, n_parameters = len(commands), len(parameters_of(commands))
        return cls(
            commands=commands,
            transitions=np.zeros((n_kinds + 1, n_kinds), np.int64),
            histograms=np.zeros((n_parameters, 361), np.int64),
        )

    def add(self, *, kind: NDArray[np.integer], last: NDArray[np.integer], issued: NDArray[np.floating]) -> None:
        """Count rows: kind and last (n,), issued (n, parameters) with NaN for parameters of other commands."""
        np.add.at(self.transitions, (last, kind), 1)
        for index, column in enumerate(issued.T):
            steps = np.rint(column[np.isfinite(column)]).astype(np.int64)
            self.histograms[index] += np.bincount(np.clip(steps, -180, 180) + 180, minlength=361)

    def finish(self) -> Baselines:
        """Return the baselines of everything counted."""
        items = parameters_of(self.commands)
        parameters = np.array(
            [_median(counts, angle=item.angle) for counts, item in zip(self.histograms, items, strict=True)]
        )
        return Baselines(transitions=self.transitions, parameters=parameters)


def _median(counts: Counts, *, angle: bool) -> float:
    """Return the value in -180..180 with the least mean absolute distance to all, around the circle for angles."""
    if not counts.any():
        return float("nan")
    values = np.arange(-180, 181)
    distance = np.abs(values[:, None] - values[None, :])
    if angle:
        distance = np.minimum(distance, 360 - distance)
    cost = distance @ counts
    best = values[cost == cost.min()]
    return float(best[np.abs(best).argmin()])
