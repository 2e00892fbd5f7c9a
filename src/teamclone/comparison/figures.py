"""The pictures of a comparison, in the colours of the page around them: the original orange, the clone blue."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator, PercentFormatter

from teamclone.comparison.profile import ZONES
from teamclone.comparison.words import label_of, name_of
from teamclone.plots.maps import draw_zones
from teamclone.plots.page import ACCENT, COLOURS, INK, MUTED, SECOND, STYLE, WIDTH, short

_WHOSE = (("original", SECOND, -0.16), ("clone", ACCENT, 0.16))
_LEAST_UNITS, _MOST_UNITS = 0.1, 100.0
"""Ends of the axis of units; what is beyond stands at its end."""

Groups = Sequence[Mapping[str, Any]]


@mpl.rc_context(STYLE)
def statistic(groups: Groups, at: int, *, name: str, unit: str, matches: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw one statistic by opponent: means, intervals and matches, and beside it the distance in units.

    Of a statistic without means, one of histograms, the distances take their place.

    Args:
        groups, matches: of the document. at: the statistic's place in a group.
    """
    figure, (left, right) = _two_panels(len(groups))
    for y, group in enumerate(groups):
        row = group["statistics"][at]
        names = set(group["opponents"])
        for whose, colour, shift in _WHOSE:
            if row[whose] is None:
                value = row.get("own" if whose == "original" else "distance")
                left.scatter([np.nan if value is None else value], [y + shift], s=34, color=colour, zorder=3)
                continue
            dots = [one[name] for one in matches if one["whose"] == whose and one["opponent"] in names]
            dots = [value for value in dots if value is not None]
            left.scatter(dots, [y + shift] * len(dots), s=9, color=colour, alpha=0.3, linewidths=0, zorder=2)
            _point(left, row[whose], y + shift, colour)
        if row.get("units"):
            _units(right, row, y)
    _label(left, right, [_row_name(group) for group in groups])
    left.set_xlabel(_axis(name, unit))
    if unit == "share":
        left.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=None))
    left.xaxis.set_major_locator(MaxNLocator(nbins=5))
    return figure


@mpl.rc_context(STYLE)
def overview(group: Mapping[str, Any]) -> Figure:
    """Draw the distance in units of every statistic of a group."""
    rows = [row for row in group["statistics"] if row.get("units") and row["own"]]
    figure = Figure(figsize=(WIDTH, 0.7 + 0.2 * len(rows)), layout="constrained")
    axes = figure.subplots()
    for y, row in enumerate(rows):
        _units(axes, row, y)
    axes.set_yticks(range(len(rows)), [name_of(row["statistic"]) for row in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    _unit_axis(axes)
    for label in axes.get_yticklabels():
        label.set_color(INK)
    return figure


@mpl.rc_context(STYLE)
def places(where: Mapping[str, Any]) -> Figure:
    """Draw the distance of positions in units: by zone of the ball on a pitch, and by player."""
    figure = Figure(figsize=(WIDTH, 3.0), layout="constrained")
    field, bars = figure.subplots(1, 2, width_ratios=(1.6, 1))
    values = np.reshape(_quotients(where["zones"]), (ZONES, ZONES))
    text = [["" if np.isnan(value) else f"{value:.1f}" for value in row] for row in values]
    # No colour where the clone is as near as the original's own matches are to each other.
    draw_zones(field, values, text=text, colours=COLOURS, scale=(1.0, 5.0))
    field.set_title("by zone of the ball, in units")
    players = _quotients(where["players"])
    numbers = np.arange(1, len(players) + 1)
    bars.barh(numbers, players, color=ACCENT, height=0.6)
    bars.axvline(1.0, color=MUTED, linewidth=0.9, linestyle=(0, (3, 3)))
    bars.set_yticks(numbers)
    bars.invert_yaxis()
    bars.grid(axis="y", visible=False)
    bars.set_title("by player, in units")
    return figure


@mpl.rc_context(STYLE)
def speeds(shares: Mapping[str, Any]) -> Figure:
    """Draw the histograms of ways in a cycle."""
    figure = Figure(figsize=(WIDTH, 2.4), layout="constrained")
    axes = figure.subplots()
    for whose, colour, _ in _WHOSE:
        values = np.array(shares[whose], float)
        axes.stairs(values, np.arange(len(values) + 1) * shares["bin"], color=colour, label=whose)
    axes.set_xlabel("way of a field player in a cycle, m")
    axes.set_ylabel("share of cycles")
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=None))
    axes.legend(loc="upper right")
    return figure


def _two_panels(rows: int) -> tuple[Figure, tuple[Any, Any]]:
    # Margins are given, since finding them costs as much as the drawing, and there is one picture a statistic.
    height = 0.75 + 0.42 * rows
    figure = Figure(figsize=(WIDTH, height))
    edges: Any = {"left": 0.27, "right": 0.97, "bottom": 0.55 / height, "top": 1 - 0.1 / height, "wspace": 0.1}
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.5, 1), gridspec_kw=edges)
    return figure, (left, right)


def _row_name(group: Mapping[str, Any]) -> str:
    """Return opponent and numbers of matches, a name of any length cut to the margin."""
    return f"{short(label_of(group))}, {_counts(group)}"


def _counts(group: Mapping[str, Any]) -> str:
    return "{original} | {clone}".format(**group["matches"])


def _axis(name: str, unit: str) -> str:
    return name_of(name) + (f", {unit}" if unit and unit != "share" else "")


def _point(axes: Any, value: Mapping[str, Any], y: float, colour: str) -> None:
    if value["value"] is None:
        return
    if value["low"] is not None:
        axes.plot([value["low"], value["high"]], [y, y], color=colour, linewidth=2.2, zorder=3)
    axes.scatter([value["value"]], [y], s=34, color=colour, zorder=4)


def _units(axes: Any, row: Mapping[str, Any], y: float) -> None:
    """Draw a distance in units, what is beyond the axis at its end."""
    value, low, high = (row["units"][key] for key in ("value", "low", "high"))
    if value is None:
        if not row["distance"]:
            return
        value = _MOST_UNITS
    ends = [value if low is None and high is None else low, value if low is None and high is None else high]
    ends = np.clip([_MOST_UNITS if end is None else end for end in ends], _LEAST_UNITS, _MOST_UNITS).tolist()
    axes.plot(ends, [y, y], color=MUTED, linewidth=1.2, zorder=2)
    axes.scatter([np.clip(value, _LEAST_UNITS, _MOST_UNITS)], [y], s=30, color=ACCENT, zorder=3)


def _unit_axis(axes: Any) -> None:
    axes.set_xscale("log")
    axes.set_xlim(_LEAST_UNITS * 0.9, _MOST_UNITS * 1.1)
    axes.xaxis.set_major_locator(FixedLocator([0.1, 0.3, 1, 3, 10, 30, 100]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.axvline(1.0, color=INK, linewidth=0.9, linestyle=(0, (3, 3)), zorder=1)
    axes.set_xlabel("distance, in the original's own")


def _label(left: Any, right: Any, names: Sequence[str]) -> None:
    left.set_yticks(range(len(names)), names, parse_math=False)  # a name may have dollars
    left.set_ylim(len(names) - 0.45, -0.55)
    for label in left.get_yticklabels():
        label.set_color(INK)
    _unit_axis(right)
    for axes in (left, right):
        axes.tick_params(axis="y", left=False)
        axes.grid(axis="y", visible=False)


def _quotients(of: Mapping[str, Sequence[float | None]]) -> list[float]:
    """Return distances in units, NaN where there is none."""
    return [
        float("nan") if not own or apart is None else apart / own
        for own, apart in zip(of["own"], of["distance"], strict=True)
    ]
