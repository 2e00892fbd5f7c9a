"""The pictures of a report, in the colours of the page around them: the team blue, its opponents orange."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter
from numpy.typing import NDArray

from teamclone.plots.maps import draw_formation, draw_zones
from teamclone.plots.page import ACCENT, COLOURS, MUTED, SECOND, STYLE, WIDTH
from teamclone.plots.pitch import draw_pitch
from teamclone.rcss import pitch
from teamclone.rcss.players import N_TEAM
from teamclone.scout.measures import ratio, wilson

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]

LEAST_SHOTS = 30
"""With fewer, groups of shots say nothing about expected goals."""
GROUPS = 5
UNUMS = range(1, N_TEAM + 1)
_CAUGHT_TO = -pitch.HALF_LENGTH + pitch.PENALTY_AREA_LENGTH + 2
"""How much of the pitch is drawn where the goalkeeper catches: it may nowhere else."""
RATIOS = (0.2, 1.0)
"""Ratios of a zone without any colour and with the strongest one."""


@mpl.rc_context(STYLE)
def pitches(n: int, *, height: float = 0.36) -> tuple[Figure, list[Any]]:
    """Return a figure and its axes, two beside each other, each for a pitch."""
    rows = (n + 1) // 2
    figure = Figure(figsize=(WIDTH, height * WIDTH * rows), layout="constrained")
    axes = list(figure.subplots(rows, 2, squeeze=False).flat)
    for one in axes[n:]:
        one.set_axis_off()
    return figure, axes[:n]


@mpl.rc_context(STYLE)
def formations(drawn: Sequence[tuple[str, Floats]]) -> Figure:
    """Draw formations beside each other: titles, and places (11, 2) of numbers 1 to 11."""
    figure, axes = pitches(len(drawn))
    for one, (title, places) in zip(axes, drawn, strict=True):
        draw_formation(one, places, unums=UNUMS, colours=COLOURS)
        one.set_title(title)
    return figure


@mpl.rc_context(STYLE)
def ratios_by_zone(drawn: Sequence[tuple[str, Floats, Floats]]) -> Figure:
    """Draw ratios by zone beside each other: titles, parts and wholes (along, across), nothing in zones without."""
    figure, axes = pitches(len(drawn))
    for one, (title, parts, wholes) in zip(axes, drawn, strict=True):
        with np.errstate(invalid="ignore", divide="ignore"):
            shares = np.where(wholes > 0, parts / wholes, np.nan)
        text = [
            [f"{share:.0%}\n{int(n):,}" if n else "" for share, n in zip(*row, strict=True)]
            for row in zip(shares, wholes, strict=True)
        ]
        draw_zones(one, shares, text=text, colours=COLOURS, scale=RATIOS)
        one.set_title(title)
    return figure


Bin = tuple[float, float, float, float, int]
"""Mean expected goals of some shots, the share scored, the ends of its interval, and their number."""


def reliability_bins(expected: Floats, scored: Bools) -> list[Bin]:
    """Return shots in groups of equal size by their expected goals; none where there are too few.

    Intervals of the share are Wilson's (1927), 95 %.
    """
    known = np.isfinite(expected)
    expected, scored = expected[known], scored[known]
    if len(expected) < LEAST_SHOTS:
        return []
    made: list[Bin] = []
    for these in np.array_split(np.argsort(expected, kind="stable"), GROUPS):
        n, share = len(these), float(scored[these].mean())
        low, high = wilson(share, n)
        made.append((float(expected[these].mean()), share, low, high, n))
    return made


@mpl.rc_context(STYLE)
def goals(bins: Sequence[Bin], *, expected: Sequence[Floats], scored: Floats) -> Figure:
    """Draw goals against goals expected: of groups of shots, and of matches.

    Args:
        bins: see `reliability_bins`; empty where there are too few shots.
        expected, scored: (n_matches,) of the team and of its opponents.
    """
    figure = Figure(figsize=(WIDTH, 0.36 * WIDTH), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.set(xlabel="goals expected of a shot", ylabel="scored", xlim=(0, 1), ylim=(0, 1))
    left.plot([0, 1], [0, 1], color=MUTED, linewidth=0.9, linestyle=(0, (3, 3)))
    if bins:
        mean, share, low, high, _ = (np.array(values) for values in zip(*bins, strict=True))
        left.errorbar(mean, share, yerr=np.clip([share - low, high - share], 0, None), fmt="o", color=ACCENT)
    else:
        left.annotate("too few shots", (0.5, 0.4), ha="center", color=MUTED)
    for axis in (left.xaxis, left.yaxis):
        axis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    end = 1.1 * max(1.0, *(float(np.max(values)) for values in (*expected, *scored)))
    right.plot([0, end], [0, end], color=MUTED, linewidth=0.9, linestyle=(0, (3, 3)))
    for worth, goals_of, colour in zip(expected, scored, (ACCENT, SECOND), strict=True):
        right.scatter(worth, goals_of, s=16, color=colour, alpha=0.7, linewidths=0)
    right.set(xlabel="goals expected in a match", ylabel="scored", xlim=(0, end), ylim=(0, end))
    return figure


@mpl.rc_context(STYLE)
def shares_by_zone(drawn: Sequence[tuple[str, Floats]]) -> Figure:
    """Draw beside each other which share of something lies in each zone: titles, and counts (along, across)."""
    figure, axes = pitches(len(drawn))
    for one, (title, counts) in zip(axes, drawn, strict=True):
        shares = counts / max(counts.sum(), 1)
        text = [[f"{share:.0%}" if share else "" for share in row] for row in shares]
        draw_zones(one, shares, text=text, colours=COLOURS)
        one.set_title(title)
    return figure


Panel = tuple[str, Floats, Floats, Floats]
"""Title, places (11, 2) of numbers 1 to 11, and ways from (n, 2) to (n, 2), m."""


@mpl.rc_context(STYLE)
def set_plays(panels: Sequence[Panel]) -> Figure:
    """Draw for each kind of set play where players stand and where the ball goes first."""
    figure, axes = pitches(len(panels))
    for one, (title, places, start, end) in zip(axes, panels, strict=True):
        draw_formation(one, places, unums=UNUMS, colours=COLOURS)
        _arrows(one, start, end)
        one.set_title(title)
    return figure


def _arrows(axes: Any, start: Floats, end: Floats) -> None:
    """Draw many thin ways; those of `draw_routes` are broad, to be told apart by weight."""
    line: Any = {"arrowstyle": "-|>", "mutation_scale": 5, "color": SECOND, "linewidth": 0.6, "alpha": 0.45}
    for from_, to in zip(start, end, strict=True):
        axes.annotate("", to, from_, arrowprops={**line, "shrinkA": 0, "shrinkB": 0}, zorder=4)


Curve = tuple[str, Floats, Floats, Floats]
"""Name of a curve, and per point its value and the ends of its interval (n,); NaN where there is none."""
CurvePanel = tuple[str, str, str, Floats, Sequence[Curve]]
"""Title, what its axes are, x (n,) and the curves, the team's first."""


@mpl.rc_context(STYLE)
def curves(panels: Sequence[CurvePanel]) -> Figure:
    """Draw curves with their intervals beside each other."""
    figure = Figure(figsize=(WIDTH, 0.36 * WIDTH), layout="constrained")
    for axes, panel in zip(np.atleast_1d(figure.subplots(1, len(panels))), panels, strict=True):
        _curves(axes, panel)
    return figure


def _curves(axes: Any, panel: CurvePanel) -> None:
    title, across, upward, x, lines = panel
    for (name, value, low, high), colour in zip(lines, (ACCENT, SECOND), strict=False):
        axes.plot(x, value, color=colour, label=name, marker="o", markersize=2.5)
        axes.fill_between(x, low, high, color=colour, alpha=0.18, linewidth=0)
    axes.set(title=title, xlabel=across, ylabel=upward)
    axes.set_ylim(bottom=0)
    axes.legend()


def by_bin(parts: Floats, wholes: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a ratio (n_bins,) over matches and the ends of its interval, of parts and wholes (n_matches, n_bins)."""
    made = [ratio(part, whole) for part, whole in zip(parts.T, wholes.T, strict=True)]
    value, low, high = (
        np.array([np.nan if one is None else one for one in ends])
        for ends in zip(*((one.value, one.low, one.high) for one in made), strict=True)
    )
    return value, low, high


@mpl.rc_context(STYLE)
def keeper(x: Floats, lines: Sequence[Curve], goals: Floats, saves: Floats, *, caught: Floats) -> Figure:
    """Draw how far the goalkeeper is off its line by the distance of the ball, shots across the goal, and catches.

    Args:
        x: (n,) m. goals, saves: (m,) numbers in equal parts of the goal from its left post. caught: (k, 2) m.
    """
    figure = Figure(figsize=(WIDTH, 0.36 * WIDTH), layout="constrained")
    left, right, area = figure.subplots(1, 3, width_ratios=(3, 3, 2))
    _curves(left, ("Off its line", "ball from the own goal, m", "m off its line", x, lines))
    width = pitch.GOAL_WIDTH
    edges = (np.arange(len(goals)) + 0.5) / len(goals) * width - width / 2
    bar = 0.9 * width / len(goals)
    right.bar(edges, goals, bar, color=SECOND, label="goals against")
    right.bar(edges, saves, bar, bottom=goals, color=ACCENT, alpha=0.6, label="saved")
    right.set(title="Across its goal", xlabel="left post to right post, m from the middle", ylabel="shots")
    right.yaxis.set_major_locator(MaxNLocator(integer=True))
    right.set_ylim(0, 1.3 * max(1.0, float((goals + saves).max())))
    right.legend(ncols=2, loc="upper center")
    draw_pitch(area, colour=MUTED, width=0.7)
    area.plot(*caught.T, "o", color=ACCENT, alpha=0.6, markersize=4, markeredgewidth=0)
    area.set(title=f"Catches ({len(caught)})")
    area.set_xlim(area.get_xlim()[0], _CAUGHT_TO)
    area.set_ylim(pitch.PENALTY_AREA_WIDTH / 2 + 2, -pitch.PENALTY_AREA_WIDTH / 2 - 2)
    return figure


ZonePanel = tuple[str, Floats, Sequence[Sequence[str]]]
"""Title, values of zones (nx, ny) and their words."""


WaysPanel = tuple[str, Floats, Floats]
"""Title, and ways from (n, 2) to (n, 2), m."""


@mpl.rc_context(STYLE)
def zones(panels: Sequence[ZonePanel], ways: WaysPanel) -> Figure:
    """Draw a pitch for each number that is known by zone, and one for ways of the opponents."""
    figure, axes = pitches(len(panels) + 1)
    for one, (title, values, words) in zip(axes, panels, strict=False):
        draw_zones(one, values, text=words, colours=COLOURS)
        one.set_title(title)
    title, start, end = ways
    draw_pitch(axes[-1], colour=MUTED, width=0.7)
    _arrows(axes[-1], start, end)
    axes[-1].set_title(title)
    return figure
