"""Some starts of roll-outs to look at: samples and truth of the bodies that the clone moves, thinned out for a page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.bodies import BALL
from teamclone.rcss.players import N_TEAM
from teamclone.rollouts.run import MatchRollouts

MOST = 6
"""Fans."""
SAMPLES, POINTS = 16, 26
"""Paths of a body in a fan, and points of a path, at most."""


def fans_of(matches: Sequence[MatchRollouts]) -> list[dict[str, Any]]:
    """Return the starts whose play goes on longest, from all matches.

    Each has ``match_id``, ``cycle``, ``ahead`` (cycles that it shows), ``bodies`` and ``others``: places of the players
    that the clone does not move. A body is ``of`` "ball" or a number 1 to 11; ``truth`` and each of ``samples`` are
    paths of [x, y] in metres, in the log's frame of reference, to a tenth.
    """
    order = [(match, start) for match in matches for start in np.argsort(-match.reach, kind="stable")[:MOST]]
    order.sort(key=lambda one: -int(one[0].reach[one[1]]))
    return [_fan(match, int(start)) for match, start in order[:MOST]]


def shown_cycles(ahead: int) -> NDArray[np.int64]:
    """Return how many cycles ahead the points of a fan's paths are, (n,)."""
    cycles: NDArray[np.int64] = np.unique(np.linspace(0, ahead, POINTS).round().astype(int))
    return cycles


def _fan(match: MatchRollouts, start: int) -> dict[str, Any]:
    ahead = int(min(match.reach[start], match.truth.shape[1] - 1))
    shown = shown_cycles(ahead)
    own = np.append(match.own[start], True)
    there = match.on_field[start]
    return {
        "match_id": match.match_id,
        "cycle": int(match.cycles[start]),
        "ahead": ahead,
        "bodies": [
            {
                "of": "ball" if body == BALL else int(body % N_TEAM) + 1,
                "truth": _path(match.truth[start, shown, body]),
                "samples": [_path(path) for path in match.places["samples"][start, :SAMPLES][:, shown, body]],
            }
            for body in np.flatnonzero(own)
        ],
        "others": _path(match.truth[start, 0, :BALL][there & ~own[:BALL]]),
    }


def _path(places: NDArray[np.float32]) -> list[list[float]]:
    """Return (n, 2) places to a tenth of a metre."""
    return [[round(float(x), 1), round(float(y), 1)] for x, y in places]
