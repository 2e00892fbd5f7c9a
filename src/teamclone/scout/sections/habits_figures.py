"""Pictures of habits: where they are easy to foresee, and the passes that come again and again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from teamclone.plots.maps import draw_routes
from teamclone.plots.page import COLOURS, INK, STYLE, WIDTH
from teamclone.scout.predictability import Habit
from teamclone.scout.seen import Floats

OFTEN = 0.6
"""Passes of a cell are drawn whose share is at least this, as far as chance allows to say."""
MOST_ROUTES = 14


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """A pass that comes again and again: from and to (2,) m, by and to which number, and how often."""

    start: Floats
    end: Floats
    unum: int
    receiver: int
    times: float


def route(habit: Habit, places: Floats) -> Route:
    """Return the route of a habit that is a pass.

    Args:
        places: (11, 3, 3, 2, answers, 4) sums of places of the ball, over matches.
    """
    cell = tuple(slice(None) if index is None else index for index in habit.cell)
    times = float(habit.parts.sum())
    mean = places[(*cell, habit.answer)].reshape(-1, 4).sum(0) / times
    return Route(start=mean[:2], end=mean[2:], unum=(habit.cell[0] or 0) + 1, receiver=habit.answer + 1, times=times)


@mpl.rc_context(STYLE)
def routes(drawn: Sequence[Route]) -> Figure:
    """Draw passes as arrows with the numbers of both players."""
    figure = Figure(figsize=(WIDTH * 0.8, WIDTH * 0.54), layout="constrained")
    axes = figure.subplots()
    start, end = (np.array([getattr(one, name) for one in drawn]) for name in ("start", "end"))
    draw_routes(axes, start, end, weight=[one.times for one in drawn], colours=COLOURS)
    for one in drawn:
        words = f"{one.unum}\N{RIGHTWARDS ARROW}{one.receiver}"
        middle = (float(one.start[0] + one.end[0]) / 2, float(one.start[1] + one.end[1]) / 2)
        axes.annotate(words, middle, (0, 7), textcoords="offset points", ha="center", color=INK, fontsize=8, zorder=6)
    return figure
