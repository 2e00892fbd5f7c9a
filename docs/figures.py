"""Draw the figures of the explanation pages as SVG: `python docs/figures.py`."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, FancyArrowPatch, FancyBboxPatch, Rectangle

from teamclone.plots.pitch import draw_pitch
from teamclone.rcss.pitch import HALF_LENGTH, HALF_WIDTH, LENGTH, WIDTH

IMAGES = Path(__file__).resolve().parent / "images"
PAPER, INK, GRASS, LINE = "#ffffff", "#1f2933", "#e8f1e4", "#9db892"
OURS, THEIRS, ACCENT = "#1f6fb2", "#c8502d", "#6b3fa0"
SOFT = {"raw": "#eef1f4", "input": "#e3eefa", "layer": "#fbe9dd", "answer": "#e4f3e6", "plan": "#efe6f7"}


def write() -> None:
    """Write both figures; the same bytes for the same code."""
    style = {"svg.hashsalt": "teamclone", "svg.fonttype": "path", "font.size": 9, "font.family": "DejaVu Sans"}
    with mpl.rc_context(style):
        for name, figure in (("frame", frame()), ("network", network())):
            path = IMAGES / f"{name}.svg"
            figure.savefig(path, format="svg", facecolor=PAPER, metadata={"Date": None, "Creator": None})
            path.write_text("\n".join(line.rstrip() for line in path.read_text().splitlines()) + "\n")


def frame() -> Figure:
    """The server's frame beside that of a modelled team on the right."""
    figure = Figure(figsize=(9.6, 3.6))
    left, right = figure.subplots(1, 2)
    figure.subplots_adjust(left=0.01, right=0.99, top=0.92, bottom=0.01, wspace=0.03)
    _pitch(left, "Frame of the server (logs, store)")
    _axes(left)
    _player(left, -22, 10, body=-30, unum=5, colour=OURS, note="body = -30 deg")
    _player(left, 25, -14, body=150, unum=9, colour=THEIRS, note="body = 150 deg")
    left.text(-48, -29, "left team", color=OURS, weight="bold")
    left.text(48, 27, "right team", color=THEIRS, weight="bold", ha="right")
    _arrow(left, (-48, -26), (-30, -26), OURS)
    _arrow(left, (48, 30), (30, 30), THEIRS)
    _pitch(right, "Frame of the right team (its dataset, its clone)")
    _axes(right)
    _player(right, 22, -10, body=150, unum=5, colour=OURS, note="body = 150 deg")
    _player(right, -25, 14, body=-30, unum=9, colour=THEIRS, note="body = -30 deg")
    right.text(-48, -29, "modelled team attacks +x", color=THEIRS, weight="bold")
    _arrow(right, (-48, -26), (-30, -26), THEIRS)
    return figure


def _pitch(axes: Axes, title: str) -> None:
    axes.add_patch(Rectangle((-HALF_LENGTH, -HALF_WIDTH), LENGTH, WIDTH, facecolor=GRASS, edgecolor="none", zorder=0))
    draw_pitch(axes, colour=LINE, width=1)
    axes.set_ylim(HALF_WIDTH + 4, -HALF_WIDTH - 4)  # y grows downwards
    axes.set_title(title, color=INK, size=11)


def _axes(axes: Axes) -> None:
    """Origin and axes, with how angles are counted."""
    _arrow(axes, (0, 0), (20, 0), INK)
    _arrow(axes, (0, 0), (0, 20), INK)
    axes.add_patch(Circle((0, 0), 0.8, color=INK))
    axes.text(21, 0.3, "+x", va="center", color=INK, weight="bold", size=11)
    axes.text(0, 23, "+y", ha="center", va="center", color=INK, weight="bold", size=11)
    axes.add_patch(Arc((0, 0), 24, 24, theta1=6, theta2=78, color=ACCENT, lw=1.4))
    _arrow(axes, (3.4, 11.5), (2.0, 11.9), ACCENT)
    axes.text(9.6, 12.2, "angles,\n0 to 90", color=ACCENT, size=8, va="center")
    axes.text(HALF_LENGTH, HALF_WIDTH + 3, "(52.5, 34)", ha="right", color=INK, size=8)
    axes.text(-HALF_LENGTH, -HALF_WIDTH - 1, "(-52.5, -34)", color=INK, size=8)


def _player(axes: Axes, x: float, y: float, *, body: float, unum: int, colour: str, note: str) -> None:
    axes.plot([x, x + 14], [y, y], color=INK, lw=0.8, ls=":")
    tip = (x + 11 * math.cos(math.radians(body)), y + 11 * math.sin(math.radians(body)))
    _arrow(axes, (x, y), tip, colour)
    axes.add_patch(Arc((x, y), 13, 13, theta1=min(body, 0), theta2=max(body, 0), color=ACCENT, lw=1.2))
    axes.add_patch(Circle((x, y), 2.6, facecolor=colour, edgecolor="white", lw=1, zorder=3))
    axes.text(x, y + 0.1, str(unum), color="white", ha="center", va="center", size=8, weight="bold", zorder=4)
    axes.text(x, y - 4.5 if body > 0 else y + 6.5, note, color=INK, ha="center", size=8)


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], colour: str) -> None:
    axes.add_patch(
        FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=11, color=colour, lw=1.6, shrinkA=0, shrinkB=0)
    )


def network() -> Figure:
    """The network of the preset best, from the state to the answer."""
    figure = Figure(figsize=(9.6, 4.9))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_xlim(0, 96)
    axes.set_ylim(49, 0)
    axes.set_axis_off()
    _box(axes, (1, 17), (13, 12), "raw", ("State", "ball, 22 players,\ntypes, play mode,\nplayer who acts"))
    _box(
        axes,
        (18, 3),
        (17, 15),
        "input",
        (
            "Inputs by geometry",
            "blocks relative to\nthe player: self, role,\ntype, last, ball,\nreach, lines",
        ),
    )
    _box(axes, (18, 21), (17, 9), "plan", ("Planner", "HELIOS Base's decision\nwith the ball"))
    _box(axes, (18, 34), (17, 10), "layer", ("Player encoder", "21 players and the goal,\nself-attention"))
    _box(axes, (39, 1), (17, 8), "layer", ("Target points", "places to go to, turned\ninto angles and powers"))
    _box(axes, (39, 12), (17, 8), "layer", ("Command layers", "MLP"))
    _box(axes, (39, 23), (17, 8), "layer", ("Parameter layers", "of dashes and turns;\nsend no gradient back"))
    _box(axes, (39, 35), (17, 8), "layer", ("Kick layers", "situation and\nits mirror image"))
    _box(axes, (62, 12), (15, 8), "answer", ("Command", "softmax"))
    _box(axes, (62, 23), (15, 8), "answer", ("Dash and turn", "mixtures and classes"))
    _box(axes, (62, 35), (15, 8), "answer", ("Kick and tackle", "velocities of the ball,\n40 directions"))
    _box(
        axes,
        (81, 18),
        (14, 18),
        "answer",
        (
            "Answer",
            "probability of\neach command,\ndistribution of\nits parameters",
        ),
    )
    for start, end in (
        ((14, 21), (18, 12)), ((14, 23), (18, 25)), ((14, 26), (18, 38)),
        ((35, 7), (39, 5)), ((35, 12), (39, 15)), ((35, 16), (39, 25)), ((35, 17.5), (39, 36)),
        ((35, 24), (39, 17.5)), ((35, 28), (39, 37.5)), ((35, 40), (39, 40)),
        ((47.5, 9), (47.5, 12)), ((47.5, 20), (47.5, 23)),
        ((56, 16), (62, 16)), ((56, 27), (62, 27)), ((56, 39), (62, 39)),
        ((77, 16), (81, 21)), ((77, 27), (81, 27)), ((77, 39), (81, 33)),
    ):  # fmt: skip
        _arrow(axes, start, end, INK)
    legend = ((18, "input", "geometry"), (30, "plan", "rules"), (39, "layer", "learned"), (62, "answer", "answer"))
    for x, kind, label in legend:
        axes.add_patch(Rectangle((x, 46), 2, 2, facecolor=SOFT[kind], edgecolor=INK, lw=0.7))
        axes.text(x + 2.8, 47, label, color=INK, size=8, va="center")
    return figure


def _box(axes: Axes, corner: tuple[float, float], size: tuple[float, float], kind: str, words: tuple[str, str]) -> None:
    """A rounded box with a title and a text, `corner` its upper left one."""
    (x, y), (width, height), (title, text) = corner, size, words
    shape = FancyBboxPatch((x, y), width, height, boxstyle="round,pad=0,rounding_size=1", facecolor=SOFT[kind])
    shape.set_edgecolor(INK)
    shape.set_linewidth(0.9)
    axes.add_patch(shape)
    lines = text.count("\n") + 1
    middle = y + height / 2
    axes.text(x + width / 2, middle - 1.15 * lines, title, ha="center", va="center", color=INK, weight="bold", size=9)
    axes.text(x + width / 2, middle + 1.1, text, ha="center", va="center", color=INK, size=7.5, linespacing=1.25)


if __name__ == "__main__":
    write()
