"""The pictures of a similarity: the tree of the teams, and their map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.text import Text

from teamclone.plots.page import ACCENT, INK, RULE, STYLE, WIDTH, short
from teamclone.similarity import geometry


@mpl.rc_context(STYLE)
def tree(found: Mapping[str, Any]) -> Figure:
    """Draw which teams join at which distance."""
    names = [short(team) for team in found["teams"]]
    lines = geometry.dendrogram(found["tree"])
    figure = Figure(figsize=(WIDTH, 0.7 + 0.36 * len(names)), layout="constrained")
    axes = figure.subplots()
    for across, along in zip(lines["icoord"], lines["dcoord"], strict=True):
        axes.plot(along, across, color=ACCENT, linewidth=1.6)
    axes.set_yticks(5.0 + 10.0 * np.arange(len(names)), [names[leaf] for leaf in lines["leaves"]], parse_math=False)
    axes.set_ylim(10.0 * len(names), 0)
    axes.set_xlim(left=0)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("distance, nats a command")
    for label in axes.get_yticklabels():
        label.set_color(INK)
    return figure


@mpl.rc_context(STYLE)
def plane(found: Mapping[str, Any]) -> Figure:
    """Draw the teams in a plane, the nearest two of each joined."""
    places = np.array(found["map"]["places"])
    distance = np.array(found["nats"])
    figure = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    axes = figure.subplots()
    for one in range(len(places)):
        other = int(np.argsort(distance[one])[1])
        axes.plot(*places[[one, other]].T, color=RULE, linewidth=1.2, zorder=1)
    axes.scatter(places[:, 0], places[:, 1], s=46, color=ACCENT, zorder=2)
    for (x, y), team in zip(places, found["teams"], strict=True):
        label: Text = axes.annotate(short(team), (x, y), (0, 7), textcoords="offset points", ha="center", color=INK)
        label.set_parse_math(False)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.18)
    axes.set_xticks([])
    axes.set_yticks([])
    return figure


def shades(values: Sequence[float]) -> list[float]:
    """Return for each of a row's losses how far it lies from the least one, 1 as far as the farthest."""
    least, most = min(values), max(values)
    return [(value - least) / (most - least) if most > least else 0.0 for value in values]
