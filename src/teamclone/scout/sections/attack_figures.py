"""The pictures of the section on a team with the ball."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from teamclone.plots.maps import draw_formation, draw_pass_network, draw_routes, draw_shots, draw_zones
from teamclone.plots.page import COLOURS, STYLE
from teamclone.scout.figures import UNUMS, Floats, pitches

CELL_M = 8.0
"""Ways that begin in one square of this size and end in one are one route."""
ROUTES = 20
"""Routes that are drawn, those that are taken most."""
_WORDS = ("pass", "dribble", "shot", "clear")


@mpl.rc_context(STYLE)
def situations(drawn: Sequence[tuple[str, Floats, Floats]]) -> Figure:
    """Draw formations with the ball: title, places (11, 2), and the ball's (2,)."""
    figure, axes = pitches(len(drawn))
    for one, (title, places, ball) in zip(axes, drawn, strict=True):
        draw_formation(one, places, unums=UNUMS, colours=COLOURS, ball=ball)
        one.set_title(title)
    return figure


@mpl.rc_context(STYLE)
def network_and_shots(places: Floats, counts: Floats, shots: Floats, *, matches: int) -> Figure:
    """Draw the pass network and the shot map; shots are (n, 4): place, expected goals, scored."""
    figure, (left, right) = pitches(2)
    # A pair that passes less than once in two matches is chance.
    draw_pass_network(left, places, counts / matches, unums=UNUMS, colours=COLOURS, least=0.5)
    left.set_title("passes")
    draw_shots(right, shots[:, 0], shots[:, 1], outcome=shots[:, 3] > 0, size=shots[:, 2], colours=COLOURS)
    right.set_title("shots")
    return figure


@mpl.rc_context(STYLE)
def routes_and_kicks(entries: Floats, kicks: Floats) -> Figure:
    """Draw the ways into the penalty area, (n, 4) from and to, and the kicks (kinds, along, across) by zone."""
    figure, (left, right) = pitches(2)
    start, end, taken = _routes(entries[:, :2], entries[:, 2:])
    draw_routes(left, start, end, weight=taken, colours=COLOURS)
    left.set_xlim(0, left.get_xlim()[1])
    left.set_title("into the penalty area")
    total = kicks.sum(0)
    most = kicks.argmax(0)
    text = [
        [
            f"{_WORDS[most[i, j]]}\n{kicks[most[i, j], i, j] / total[i, j]:.0%}" if total[i, j] else ""
            for j in range(total.shape[1])
        ]
        for i in range(total.shape[0])
    ]
    draw_zones(right, total / max(total.max(), 1), text=text, colours=COLOURS)
    right.set_title("what is done with the ball")
    return figure


def _routes(start: Floats, end: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the ways (n, 2) that are taken most, from where to where, and how often: means of ways of equal cells."""
    ways = np.concatenate([start, end], axis=1).reshape(-1, 4)
    ways = ways[np.isfinite(ways).all(axis=1)]
    cells, of = np.unique((ways // CELL_M).astype(np.int64), axis=0, return_inverse=True)
    taken = np.bincount(of.ravel(), minlength=len(cells)).astype(np.float64)
    most = np.argsort(-taken, kind="stable")[:ROUTES]
    means = np.array([ways[of.ravel() == cell].mean(0) for cell in most]).reshape(-1, 4)
    return means[:, :2], means[:, 2:], taken[most]
