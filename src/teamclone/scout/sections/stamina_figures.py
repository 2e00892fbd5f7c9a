"""Pictures of stamina and pace over a match."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from teamclone.plots.page import ACCENT, MUTED, RULE, SECOND, STYLE, WIDTH
from teamclone.scout.seen import Floats, Ints

HALVES = 2
LATE = 0.75
"""Where the last quarter of a half begins."""


@mpl.rc_context(STYLE)
def stamina(means: Floats, groups: Sequence[tuple[str, Ints]]) -> Figure:
    """Draw stamina over the match, one panel a group.

    Args:
        means: (bins, 11) shares of the greatest, halves of equal length. groups: names, and indices of players.
    """
    figure = Figure(figsize=(WIDTH, WIDTH * 0.34), layout="constrained")
    for axes, (title, who) in zip(figure.subplots(1, len(groups), sharey=True), groups, strict=True):
        _halves(axes)
        ends = []
        for player in who:
            _line(axes, means[:, player], colour=ACCENT, alpha=0.75)
            ends.append((float(means[-1, player]), str(player + 1)))
        for place, words in _apart([end for end in ends if np.isfinite(end[0])]):
            axes.annotate(
                words, (HALVES, place), (3, 0), textcoords="offset points", va="center", color=ACCENT, fontsize=8
            )
        axes.set(ylim=(0, 1.02))
        axes.set_title(title)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    return figure


@mpl.rc_context(STYLE)
def pace(paces: Sequence[Floats], worth: Sequence[Floats], *, span: int) -> Figure:
    """Draw pace and expected goals over the match, of the team and of its opponents.

    Args:
        paces: (bins,) m a cycle of both. worth: (bins,) expected goals of both in ``span`` cycles of play.
    """
    figure = Figure(figsize=(WIDTH, WIDTH * 0.34), layout="constrained")
    left, right = figure.subplots(1, 2)
    for axes, both, title in ((left, paces, "m a cycle"), (right, worth, f"expected goals in {span} cycles of play")):
        _halves(axes)
        for values, colour in zip(both, (ACCENT, SECOND), strict=True):
            _line(axes, values, colour=colour)
        axes.set_ylim(bottom=0)
        axes.set_title(title)
    return figure


def _halves(axes: Any) -> None:
    for half in range(HALVES):
        axes.axvspan(half + LATE, half + 1, color=RULE, alpha=0.6, linewidth=0, zorder=0)
    axes.axvline(1, color=MUTED, linewidth=0.7)
    axes.set(xlim=(0, HALVES), xticks=[0.5, 1.5], xticklabels=["first half", "second half"])
    axes.tick_params(axis="x", length=0)
    axes.grid(axis="x", visible=False)


def _line(axes: Any, values: Floats, *, colour: str, alpha: float = 1.0) -> None:
    """Draw values (bins,), each half for itself."""
    n = len(values) // HALVES
    for half in range(HALVES):
        x = half + (np.arange(n) + 0.5) / n
        axes.plot(x, values[half * n : (half + 1) * n], color=colour, alpha=alpha, marker="o", markersize=2.5)


def _apart(ends: list[tuple[float, str]], least: float = 0.075) -> list[tuple[float, str]]:
    """Return labels moved upwards until they do not meet."""
    placed: list[tuple[float, str]] = []
    for place, words in sorted(ends):
        placed.append((max(place, placed[-1][0] + least) if placed else place, words))
    return placed
