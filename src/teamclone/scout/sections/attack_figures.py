"""The pictures of the section on a team with the ball."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
from matplotlib.figure import Figure

from teamclone.plots.maps import draw_formation, draw_pass_network, draw_routes, draw_shots, draw_zones
from teamclone.plots.page import COLOURS, STYLE
from teamclone.scout.figures import UNUMS, Floats, pitches, routes_taken

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
    start, end, taken = routes_taken(entries[:, :2], entries[:, 2:])
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
