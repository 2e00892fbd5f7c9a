"""The figures of the report, in the colours of the page around them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, PercentFormatter

from teamclone.plots.fans import draw_fans
from teamclone.plots.page import ACCENT, COLOURS, INK, KIND_COLOURS, MUTED, SECOND, STYLE, WIDTH
from teamclone.plots.pitch import draw_pitch
from teamclone.rcss.commands import CLONED, REPERTOIRE

KINDS = CLONED

PERCENT = "\N{NARROW NO-BREAK SPACE}%"


def _figure(height: float, rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.subplots(rows, columns, **options)


def _kinds(given: Mapping[str, Any]) -> list[str]:
    """Return KINDS, and whatever other commands there are."""
    return [kind for kind in REPERTOIRE if kind in KINDS or kind in given]


@mpl.rc_context(STYLE)
def positions(points: Mapping[str, Sequence[Sequence[float]]], counts: Mapping[str, int]) -> Figure:
    """Draw Fig. 4: where each command was given, one pitch per command, a sample of points (n, 2) in metres."""
    kinds = _kinds(points)
    rows = math.ceil(len(kinds) / 2)
    figure, grid = _figure(2.75 * rows, rows, 2)
    for axes in grid.flat[len(kinds) :]:
        axes.set_visible(False)
    for axes, kind in zip(grid.flat, kinds, strict=False):
        draw_pitch(axes, colour=MUTED, width=0.7)
        spots = np.asarray(points.get(kind, []), float).reshape(-1, 2)
        crowd = float(np.clip(300.0 / max(len(spots), 1), 0.3, 0.9))
        axes.scatter(*spots.T, s=5.5, color=KIND_COLOURS[kind], alpha=crowd, linewidths=0, zorder=2, rasterized=True)
        axes.set_title(f"{kind}  ·  {counts.get(kind, 0):,}", loc="center")
    return figure


@mpl.rc_context(STYLE)
def fans(drawn: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw where players and ball may go from some moments, and where they went; see ``plots.fans``."""
    return draw_fans(drawn, colours=COLOURS, width=WIDTH)


@mpl.rc_context(STYLE)
def frequencies(counts: Mapping[str, int]) -> Figure:
    """Draw Fig. 5: commands by kind."""
    kinds = _kinds(counts)
    figure, axes = _figure(1.75 * len(kinds) / len(KINDS))
    total = max(sum(counts.values()), 1)
    values = [counts.get(kind, 0) for kind in kinds]
    axes.barh(kinds, values, color=[KIND_COLOURS[kind] for kind in kinds], height=0.62)
    for place, value in enumerate(values):
        axes.annotate(
            f"{value:,}  ({100 * value / total:.2f}{PERCENT})",
            (value, place),
            xytext=(5, 0),
            textcoords="offset points",
            va="center",
            fontsize=8.5,
        )
    axes.invert_yaxis()
    axes.set_xlim(0, max(values) * 1.22 or 1)
    axes.grid(visible=False)
    axes.tick_params(left=False, bottom=False, labelbottom=False)
    axes.spines[["left", "bottom"]].set_visible(False)
    for label in axes.get_yticklabels():
        label.set_color(INK)
    return figure


@mpl.rc_context(STYLE)
def turn_moments(edges: Sequence[float], counts: Sequence[int], *, zero: int, turns: int) -> Figure:
    """Draw Fig. 6: turn moments in degrees, logarithmic; ``zero`` of all ``turns`` are exactly (turn 0)."""
    figure, axes = _figure(2.7)
    # Limits first: a logarithmic axis cannot find its own where nothing was counted.
    axes.set_ylim(0.7, max([*counts, 1]) * 8)
    axes.set_yscale("log")
    axes.stairs(counts, edges, fill=True, color=KIND_COLOURS["turn"])
    if zero:
        label = f"exactly (turn 0), “nothing to do”: {zero:,} of {turns:,} turns, {100 * zero / turns:.2f}{PERCENT}"
        axes.bar(0, zero, width=edges[1] - edges[0], color=ACCENT, label=label)
        axes.legend(loc="upper right")
    axes.set_xlim(edges[0], edges[-1])
    axes.set_xticks(range(-180, 181, 45))
    axes.set_xlabel("turn moment, degrees")
    axes.set_ylabel("turns, log scale")
    axes.grid(axis="x", visible=False)
    return figure


CURVES = (
    ("cross-entropy, nats", "train_cross_entropy", "validation_cross_entropy"),
    ("accuracy", "train_accuracy", "validation_accuracy"),
    ("error of the parameters, as trained on", "train_parameter_loss", "validation_parameter_loss"),
    ("mean absolute error, as the paper's", "train_parameter_mae", "validation_parameter_mae"),
)


@mpl.rc_context(STYLE)
def training_curves(history: Sequence[Mapping[str, Any]], *, best_epoch: int | None = None) -> Figure:
    """Draw Fig. 7: a panel for every pair of curves in the history, training against validation."""
    epochs = [row["epoch"] for row in history]
    known = [curve for curve in CURVES if any(row.get(key) is not None for row in history for key in curve[1:])]
    columns = 2 if len(known) > 1 else 1
    rows = max(math.ceil(len(known) / columns), 1)
    figure, grid = _figure(2.25 * rows + 0.1, rows, columns, squeeze=False)
    for axes, (title, *keys) in zip(grid.flat, known, strict=False):
        for key, colour, label in zip(keys, (SECOND, ACCENT), ("training", "validation"), strict=True):
            values = [math.nan if row.get(key) is None else float(row[key]) for row in history]
            if np.isfinite(values).any():
                axes.plot(epochs, values, color=colour, label=label, marker="." if len(epochs) < 12 else None)
        if best_epoch is not None:
            axes.axvline(best_epoch, color=MUTED, linewidth=0.9, linestyle=(0, (3, 3)))
        axes.set_title(title)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
        axes.grid(axis="x", visible=False)
    for axes in grid.flat[len(known) :]:
        axes.set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("epoch")
    if known:
        grid.flat[0].legend(loc="upper right")
    return figure


def _error_bars(values: Sequence[Mapping[str, Any]]) -> tuple[list[float], Any]:
    """Return points and the (2, n) lengths of their bars; 0 where there is no interval."""
    points = [math.nan if value["value"] is None else float(value["value"]) for value in values]
    low = [0.0 if v.get("low") is None else max(p - v["low"], 0.0) for p, v in zip(points, values, strict=True)]
    high = [0.0 if v.get("high") is None else max(v["high"] - p, 0.0) for p, v in zip(points, values, strict=True)]
    return points, np.array([low, high])


SEEN_UNSEEN = (
    ("accuracy", "accuracy"),
    ("cross_entropy", "cross-entropy, nats"),
    ("ece", "calibration error"),
    ("paper_mae", "paper's mean abs. error"),
)


@mpl.rc_context(STYLE)
def seen_unseen(splits: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw Fig. 8: figures of every split with 95 % intervals; ``splits`` holds them as {value, low, high}."""
    names = list(splits)
    figure, grid = _figure(0.55 + 0.42 * len(names), 1, len(SEEN_UNSEEN), sharey=True, squeeze=False)
    for axes, (key, title) in zip(grid.flat, SEEN_UNSEEN, strict=True):
        points, bars = _error_bars([splits[name][key] for name in names])
        place = range(len(names))
        colours = [ACCENT if name != "unseen" else SECOND for name in names]
        axes.errorbar(points, place, xerr=bars, fmt="none", ecolor=MUTED, elinewidth=1.2, capsize=0)
        axes.scatter(points, place, c=colours, s=34, zorder=3)
        for x, y in zip(points, place, strict=True):
            text = f"{100 * x:.1f}{PERCENT}" if key == "accuracy" else f"{x:.3f}"
            axes.annotate(text, (x, y), xytext=(0, 6), textcoords="offset points", ha="center", fontsize=8)
        axes.set_yticks(list(place), names)
        axes.set_ylim(len(names) - 0.45, -0.75)
        axes.set_title(title, fontsize=8.5)
        spread = max(np.ptp([*points, *(points - bars[0]), *(points + bars[1])]), 0.03 * max(points))
        middle = (max(points + bars[1]) + min(points - bars[0])) / 2
        axes.set_xlim(middle - 1.1 * spread, middle + 1.1 * spread)
        axes.xaxis.set_major_locator(MaxNLocator(nbins=3))
        if key == "accuracy":
            axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=1, symbol=PERCENT))
        axes.tick_params(left=False)
        axes.spines["left"].set_visible(False)
    return figure


@mpl.rc_context(STYLE)
def opponents(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw accuracy by opponent with 95 % intervals.

    A row has split, opponent, accuracy {value, low, high}, matches.
    """
    figure, axes = _figure(0.6 + 0.26 * len(rows))
    points, bars = _error_bars([row["accuracy"] for row in rows])
    place = np.arange(len(rows))
    colours = [SECOND if row["split"] == "unseen" else ACCENT for row in rows]
    axes.errorbar(points, place, xerr=bars, fmt="none", ecolor=MUTED, elinewidth=1.2)
    axes.scatter(points, place, c=colours, s=32, zorder=3)
    names = [f"{row['opponent']}  ·  {row['split']}, {row['matches']}" for row in rows]
    axes.set_yticks(place, names, parse_math=False)  # a name may have dollars
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=1, symbol=PERCENT))
    axes.set_xlabel("accuracy; the number beside the split counts matches")
    low, high = min(points - bars[0]), max(points + bars[1])
    margin = max(0.12 * (high - low), 0.004)
    axes.set_xlim(low - margin, high + margin)
    axes.tick_params(left=False)
    for label in axes.get_yticklabels():
        label.set_color(INK)
    return figure


@mpl.rc_context(STYLE)
def reliability(calibration: Mapping[str, Any]) -> Figure:
    """Draw reliability diagrams: of the predicted command, and of each command's own probability."""
    figure, (left, right) = _figure(3.5, 1, 2)
    for axes in (left, right):
        axes.plot([0, 1], [0, 1], color=MUTED, linewidth=0.9, linestyle=(0, (3, 3)), zorder=1)
        axes.set_aspect("equal")
        axes.set_xlim(-0.02, 1.02)
        axes.set_ylim(-0.02, 1.02)
        axes.set_xticks([0, 0.25, 0.5, 0.75, 1])
        axes.set_yticks([0, 0.25, 0.5, 0.75, 1])
        axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=PERCENT))
        axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=PERCENT))
    top = calibration["predicted_command"]
    left.plot(top["confidence"], top["observed_frequency"], color=ACCENT, marker="o", markersize=4)
    left.set_title("the predicted command")
    left.set_xlabel("predicted probability")
    left.set_ylabel("share that came true")
    for kind, curve in calibration["commands"].items():
        if sum(curve["rows"]):
            right.plot(
                curve["confidence"],
                curve["observed_frequency"],
                color=KIND_COLOURS[kind],
                marker="o",
                markersize=3,
                label=kind,
            )
    right.set_title("each command")
    right.set_xlabel("predicted probability")
    right.legend(loc="upper left")
    return figure


@mpl.rc_context(STYLE)
def response_times(edges_us: Sequence[float], counts: Sequence[int], *, p50_us: float, p99_us: float) -> Figure:
    """Draw Fig. 9: histogram of the times of single predictions, microseconds."""
    figure, axes = _figure(2.4)
    axes.stairs(counts, edges_us, fill=True, color=ACCENT, alpha=0.85)
    top = max([*counts, 1])
    for value, name in ((p50_us, "half are faster"), (p99_us, "99 % are faster")):
        axes.axvline(value, color=MUTED, linewidth=0.9, linestyle=(0, (3, 3)))
        axes.annotate(
            f"{name}\n{value:,.0f} µs",
            (value, top),
            xytext=(4, -4),
            textcoords="offset points",
            va="top",
            fontsize=8,
        )
    axes.set_xlim(edges_us[0], edges_us[-1])
    axes.set_xlabel("time of one prediction, µs")
    axes.set_ylabel("predictions")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    axes.grid(axis="x", visible=False)
    return figure
