"""Shapes of a team: its lines by name, and the situations in which it stands alike."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Ints = NDArray[np.int64]

LINES = (3, 4)
"""How many lines of field players a shape may have."""
LINE_COST = 0.6
"""By which factor a fourth line must lower the squared spread within lines; with more lines it is always lower."""
LINE_M = 1.5
"""Players that are within this of the middle of their line, in the root mean square, are not split further."""
SITUATIONS = (2, 3, 4, 5)
"""How many situations are tried."""


def name_of_shape(x: Floats) -> str:
    """Return a shape as "4-3-3", from the hindmost line on.

    The field players (n,), by their mean x, are split into lines such that the players of a line are nearest to each
    other (Jenks's natural breaks); n below 4 gives an empty text.
    """
    x = np.sort(x[np.isfinite(x)])
    if len(x) <= max(LINES):
        return ""
    best = {k: min(_splits(x, k)) for k in LINES}
    few, many = LINES
    loose = best[few][0] > len(x) * LINE_M**2
    chosen = best[many] if loose and best[many][0] < LINE_COST * best[few][0] else best[few]
    return "-".join(str(size) for size in chosen[1])


def _splits(x: Floats, k: int) -> list[tuple[float, tuple[int, ...]]]:
    """Return for every split of sorted numbers into k runs its squared spread and the sizes of the runs."""
    found = []
    for cuts in combinations(range(1, len(x)), k - 1):
        parts = np.split(x, cuts)
        found.append((float(sum(((part - part.mean()) ** 2).sum() for part in parts)), tuple(map(len, parts))))
    return found


def situations(places: Floats, *, seed: int = 0) -> tuple[Ints, Floats]:
    """Return the situations in which field players stand alike, found by clustering (k-means).

    The number of clusters is that with the greatest silhouette (Rousseeuw 1987), over SITUATIONS.

    Args:
        places: (n, m, 2) m, of the same m players in n frames, without NaN.

    Returns:
        The situation (n,) of each frame, the most frequent first, and the centres (k, m, 2). One situation where there
        are too few frames for more.
    """
    from scipy.cluster.vq import kmeans2

    flat = places.reshape(len(places), -1).astype(np.float64)
    best = (-1.0, np.zeros(len(flat), np.int64))
    for k in SITUATIONS:
        if len(flat) < 10 * k:
            break
        _, label = kmeans2(flat, k, minit="++", rng=np.random.default_rng(seed))
        if len(np.unique(label)) < k:
            continue
        best = max(best, (_silhouette(flat, label), label.astype(np.int64)), key=lambda one: one[0])
    label = best[1]
    order = np.argsort(-np.bincount(label), kind="stable")
    label = np.argsort(order)[label]
    centres = np.stack([places[label == k].mean(0) for k in range(label.max() + 1)])
    return label, centres


def _silhouette(flat: Floats, label: Ints) -> float:
    """Return the mean silhouette by distances to the centres of clusters, which needs no distances of all pairs."""
    centres = np.stack([flat[label == k].mean(0) for k in range(label.max() + 1)])
    apart = np.linalg.norm(flat[:, None] - centres[None], axis=-1)
    own = apart[np.arange(len(flat)), label]
    apart[np.arange(len(flat)), label] = np.inf
    next_best = apart.min(1)
    return float(np.mean((next_best - own) / np.maximum(np.maximum(own, next_best), 1e-9)))
