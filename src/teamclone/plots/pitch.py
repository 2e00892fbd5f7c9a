"""The pitch as the server's monitor shows it: +x to the right, +y downwards, the goals 14.02 m wide."""

from __future__ import annotations

from typing import Any

from matplotlib.patches import Arc, Circle, Rectangle

from teamclone.rcss import pitch


def draw_pitch(axes: Any, *, colour: str, width: float = 0.8) -> None:
    """Draw the lines into matplotlib axes and set their limits: metres, equal scales, y pointing down the page."""
    line: Any = {"edgecolor": colour, "facecolor": "none", "linewidth": width, "zorder": 1}
    x, y = pitch.HALF_LENGTH, pitch.HALF_WIDTH
    axes.add_patch(Rectangle((-x, -y), pitch.LENGTH, pitch.WIDTH, **line))
    axes.plot([0, 0], [-y, y], color=colour, linewidth=width, zorder=1)
    axes.add_patch(Circle((0, 0), pitch.CENTER_CIRCLE_RADIUS, **line))
    axes.add_patch(Circle((0, 0), 0.4, edgecolor="none", facecolor=colour, zorder=1))
    for side in (-1, 1):
        for length, across in (
            (pitch.PENALTY_AREA_LENGTH, pitch.PENALTY_AREA_WIDTH),
            (pitch.GOAL_AREA_LENGTH, pitch.GOAL_AREA_WIDTH),
        ):
            axes.add_patch(Rectangle((side * x, -across / 2), -side * length, across, **line))
        axes.add_patch(
            Rectangle(
                (side * x, -pitch.GOAL_WIDTH / 2), side * pitch.GOAL_DEPTH, pitch.GOAL_WIDTH, label="goal", **line
            )
        )
        spot = side * (x - pitch.PENALTY_SPOT_DISTANCE)
        axes.add_patch(Circle((spot, 0), 0.4, edgecolor="none", facecolor=colour, zorder=1))
        for corner in (-1, 1):
            start = {(1, 1): 180, (-1, 1): 270, (-1, -1): 0, (1, -1): 90}[(side, corner)]
            axes.add_patch(
                Arc((side * x, corner * y), 2, 2, theta1=start, theta2=start + 90, color=colour, linewidth=width)
            )
    axes.set_xlim(-x - pitch.GOAL_DEPTH - 1, x + pitch.GOAL_DEPTH + 1)
    axes.set_ylim(y + 1, -y - 1)
    axes.set_aspect("equal")
    axes.set_axis_off()
