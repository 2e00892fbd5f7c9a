"""Fans of futures on the pitch: where bodies may go from a moment of a match, and where they went."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from teamclone.plots.pitch import draw_pitch
from teamclone.plots.style import Colours


def draw_fans(fans: Sequence[Mapping[str, Any]], *, colours: Colours, width: float) -> Figure:
    """Draw a pitch for each fan, two beside each other.

    Args:
        fans: as ``rollouts.fans`` has them. width: of the figure, inches.
    """
    rows = (len(fans) + 1) // 2
    figure = Figure(figsize=(width, 0.36 * width * rows), layout="constrained")
    grid = figure.subplots(rows, 2, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, fan in zip(grid.flat, fans, strict=False):
        draw_fan(axes, fan, colours=colours)
    return figure


def draw_fan(axes: Any, fan: Mapping[str, Any], *, colours: Colours) -> None:
    """Draw a fan into axes that have no pitch yet; see `draw_fans`."""
    draw_pitch(axes, colour=colours.rule)  # its spots are to be no players
    for place in fan["others"]:
        axes.plot(*place, "o", color=colours.muted, markersize=2.2, zorder=4)
    for body in fan["bodies"]:
        colour = colours.second if body["of"] == "ball" else colours.accent
        for path in body["samples"]:
            axes.plot(*zip(*path, strict=True), color=colour, linewidth=0.5, alpha=0.25, zorder=2)
        axes.plot(*zip(*body["truth"], strict=True), color=colours.ink, linewidth=1.1, zorder=3)
        axes.plot(*body["truth"][0], "o", color=colour, markersize=2.6, zorder=4)
    axes.set_title(f"cycle {fan['cycle']}, {fan['ahead']} cycles ahead")
