"""Distances between teams, their tree and their map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def distances(loss: Floats) -> Floats:
    """Return how much worse two clones predict each other's team than that team's own clone does.

    The mean of both directions, an estimate of the symmetrised divergence between the teams' decisions (Jeffreys 1946)
    in the states that either gets into; what comes out below 0 by chance is 0.

    Args:
        loss: (teams, teams) mean log loss, nats a command, of the clone of one (column) on what another did (row).

    Returns:
        (teams, teams), symmetric with a diagonal of 0.
    """
    more = loss - np.diag(loss)[:, None]
    return np.maximum((more + more.T) / 2, 0.0)


def tree(distance: Floats) -> list[list[float]]:
    """Return the merges of average linkage (Sokal & Michener 1958), each as in `scipy.cluster.hierarchy.linkage`."""
    from scipy.cluster.hierarchy import linkage
    from scipy.spatial.distance import squareform

    merges: list[list[float]] = linkage(squareform(distance, checks=False), "average").tolist()
    return merges


def flat(distance: Floats) -> tuple[Floats, float]:
    """Return (teams, 2) places whose distances are as near as a plane allows, and the share that they explain.

    Classical scaling (Torgerson 1952). Distances that add up as nats do are squares of lengths, so their roots are
    drawn.
    """
    n = len(distance)
    centred = np.eye(n) - 1.0 / n
    values, vectors = np.linalg.eigh(-0.5 * centred @ distance @ centred)
    order = np.argsort(values)[::-1]
    values, vectors = np.maximum(values[order], 0.0), vectors[:, order]
    places = vectors[:, :2] * np.sqrt(values[:2])
    total = values.sum()
    return places * np.where(places.sum(0) < 0, -1.0, 1.0), float(values[:2].sum() / total) if total > 0 else 1.0


def dendrogram(merges: list[list[float]]) -> dict[str, Any]:
    """Return the lines of the tree, see `scipy.cluster.hierarchy.dendrogram`."""
    from scipy.cluster.hierarchy import dendrogram as lines

    found: dict[str, Any] = lines(np.array(merges), no_plot=True)
    return found
