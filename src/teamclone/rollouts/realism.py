"""How lifelike roll-outs are: whether what players and ball do in them is distributed as in the logs.

After the realism score of the Waymo sim agents challenge (Montali et al. 2023): a histogram of each feature of motion,
and how likely the logged values are under that of the samples. There each object has a histogram; here all players of
the team share one, so that other matches of the team can be scored in the same way. Those are other situations, against
other opponents; roll-outs begin in the very moments that they are compared with, so that good ones may be nearer.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.bodies import BALL
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rollouts.run import MatchRollouts

_BINS = {
    "speed": np.linspace(0, 1.2, 13),
    "acceleration": np.linspace(0, 0.6, 13),
    "change of direction": np.linspace(0, 180, 13),
    "distance to the ball": np.linspace(0, 60, 13),
    "distance to the nearest mate": np.linspace(0, 30, 13),
    "distance to the nearest opponent": np.linspace(0, 30, 13),
    "speed of the ball": np.linspace(0, 3, 13),
}
"""Edges of the histograms, in metres, cycles and degrees. Greater values are in the last bin."""
FEATURES = tuple(_BINS)
"""Features of a cycle: of each player of the team; the last of the ball."""
_PSEUDO = 0.1
"""Added to each bin."""
_MOVES_M = 0.05
"""Way in a cycle below which a body has no direction to speak of."""

Counts = Mapping[str, NDArray[np.float64]]
"""Histograms by feature."""


def realism(matches: Sequence[MatchRollouts]) -> dict[str, dict[str, float]]:
    """Return the score of each feature, and of ``all`` (their mean), by who moves the players.

    A score is exp(-D), D the Kullback-Leibler divergence of the logged cycles from those of the roll-outs: 1 where they
    are distributed alike. ``other matches`` are the logged cycles of a match against those of the others, the mean over
    matches; missing where there are less than two.
    """
    done = [match for match in matches if match.error is None]
    if not done:
        return {}
    logged = [_counts(match, match.truth[:, None]) for match in done]
    truth = _sum(logged)
    found = {name: _score(truth, _sum(_counts(match, match.places[name]) for match in done)) for name in done[0].places}
    if len(done) > 1:
        each = [_score(one, _sum(other for other in logged if other is not one)) for one in logged]
        found["other matches"] = {name: float(np.mean([score[name] for score in each])) for name in each[0]}
    return found


def _score(truth: Counts, sampled: Counts) -> dict[str, float]:
    scores = {}
    for name in FEATURES:
        p, q = (_shares(counts[name]) for counts in (truth, sampled))
        scores[name] = float(np.exp(-np.sum(p * np.log(p / q))))
    return {**scores, "all": float(np.mean(list(scores.values())))}


def _shares(counts: NDArray[np.float64]) -> NDArray[np.float64]:
    # Of equally many cycles, however many there are: the pseudo-count then weighs the same.
    shares = 1000.0 * counts / max(counts.sum(), 1.0) + _PSEUDO
    made: NDArray[np.float64] = shares / shares.sum()
    return made


def _sum(counts: Iterable[Counts]) -> Counts:
    total = {name: np.zeros(len(edges) - 1) for name, edges in _BINS.items()}
    for one in counts:
        for name, values in one.items():
            total[name] += values
    return total


def _counts(match: MatchRollouts, places: NDArray[np.float32]) -> Counts:
    """Return the histograms of (starts, samples, horizon + 1, 23, 2) places, as far as play goes on."""
    return _sum(
        _of_start(places[start, :, : int(match.reach[start]) + 1].astype(np.float64), match.own[start], there)
        for start, there in enumerate(match.on_field)
    )


def _of_start(places: NDArray[np.float64], own: NDArray[np.bool_], there: NDArray[np.bool_]) -> Counts:
    """Return the histograms of (samples, cycles + 1, 23, 2) places from one start."""
    way = np.diff(places, axis=1)
    speed = np.linalg.norm(way, axis=-1)
    turned = np.degrees(np.arctan2(way[..., 1], way[..., 0]))
    turned = np.abs((np.diff(turned, axis=1) + 180.0) % 360.0 - 180.0)
    turned[(speed[:, 1:] < _MOVES_M) | (speed[:, :-1] < _MOVES_M)] = 0.0
    players = places[:, 1:, :BALL]
    mates, others = _teams(own, there)
    values = {
        "speed": speed[..., :BALL][..., own],
        "acceleration": np.linalg.norm(np.diff(way, axis=1), axis=-1)[..., :BALL][..., own],
        "change of direction": turned[..., :BALL][..., own],
        "distance to the ball": np.linalg.norm(players - places[:, 1:, BALL:], axis=-1)[..., own],
        "distance to the nearest mate": _nearest(players, own, mates),
        "distance to the nearest opponent": _nearest(players, own, others),
        "speed of the ball": speed[..., BALL],
    }
    return {name: np.histogram(np.minimum(values[name], edges[-1]), edges)[0] for name, edges in _BINS.items()}


def _teams(own: NDArray[np.bool_], there: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return (22,) who is on the field of the team, and of the other."""
    left = np.arange(N_PLAYERS) < N_TEAM
    ours = left if own[:N_TEAM].any() else ~left
    return there & ours, there & ~ours


def _nearest(players: NDArray[np.float64], own: NDArray[np.bool_], others: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return (samples, cycles, own) distances to the nearest of ``others``, oneself left out."""
    if not (others.sum() > 1 and own.any()):
        return np.zeros(0)
    apart = np.linalg.norm(players[..., own, None, :] - players[..., None, others, :], axis=-1)
    same = np.flatnonzero(own)[:, None] == np.flatnonzero(others)
    apart[..., same] = np.inf
    nearest: NDArray[np.float64] = apart.min(axis=-1)
    return nearest
