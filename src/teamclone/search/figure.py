"""The figure of a search, as a file of its own: light, for any viewer."""

from __future__ import annotations

import io
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

from teamclone.plots.style import LIGHT, style
from teamclone.search.strategies import OPTIMISERS, RATES, Beam
from teamclone.search.trials import Mode, Search, Status, Trial
from teamclone.system.files import write_atomic

INK, MUTED, FAINT, ACCENT, SECOND = LIGHT.ink, LIGHT.muted, "#b9c3cd", LIGHT.accent, LIGHT.second
OPTIMISER_COLOURS = dict(zip(OPTIMISERS, (ACCENT, SECOND, "#1f9e78"), strict=True))
RATE_LINES: dict[float, Any] = dict(zip(RATES, ((0, (1, 1.2)), "-", (0, (5, 2))), strict=True))

_STYLE = style(LIGHT)


@mpl.rc_context(_STYLE)
def write_figure(search: Search) -> None:
    """Write OUT/search.svg and OUT/search.png; trials that have not finished an epoch are left out."""
    figure = Figure(figsize=(7.4, 4.2), layout="constrained")
    {Mode.BEAM: _beam, Mode.STUDY: _study, Mode.OPTIMISERS: _optimisers}[search.config.mode](search, figure)
    for kind, options in (("svg", {"metadata": {"Date": None}}), ("png", {"dpi": 160})):
        stream = io.BytesIO()
        figure.savefig(stream, format=kind, **options)
        write_atomic(search.path / f"search.{kind}", stream.getvalue())


def _value(search: Search, trial: Trial) -> float:
    """Return the objective; accuracy in percent."""
    return _shown(search, trial.figures[search.config.objective.figure])


def _shown(search: Search, value: float) -> float:
    return 100 * value if search.config.objective.sign > 0 else value


def _label(search: Search) -> str:
    return "validation accuracy, %" if search.config.objective.sign > 0 else "validation cross-entropy, nats"


def _beam(search: Search, figure: Figure) -> None:
    """Draw the objective against the weights, each architecture tied to its parent, and the path to the best."""
    axes: Axes = figure.subplots()
    trials = {trial.name: trial for trial in search.trials if trial.figures}
    place = {name: (trial.figures["weights"], _value(search, trial)) for name, trial in trials.items()}
    for name, trial in trials.items():
        if trial.parent in place:
            axes.plot(*zip(place[trial.parent], place[name], strict=True), color=FAINT, linewidth=0.9, zorder=1)
    beams = Beam(search.config).beams(search.trials)
    last = {trial.name for trial in beams[-1]} if beams else set()
    for label, names, colour in (("tried", place.keys() - last, MUTED), ("the last beam", last, SECOND)):
        spots = np.array([place[name] for name in names]).reshape(-1, 2)
        axes.scatter(spots[:, 0], spots[:, 1], s=30, color=colour, linewidths=0, zorder=4, label=label)
    if last:
        path = _ancestry(search)
        line = np.array([place[name] for name in path])
        axes.plot(line[:, 0], line[:, 1], color=ACCENT, zorder=3, label=" → ".join(path))
    axes.legend(loc="lower right")
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(0.08, 0.1)
    axes.set_xlabel("weights")
    axes.set_ylabel(_label(search))
    axes.set_title(f"{len(trials)} architectures in {max(len(beams) - 1, 0)} steps after the first")


def _ancestry(search: Search) -> list[str]:
    """Return the best trial's ancestors, the first one first, and itself."""
    trials = {trial.name: trial for trial in search.trials}
    path = [search.ranked()[0].name]
    while parent := trials[path[-1]].parent:
        path.append(parent)
    return path[::-1]


def _study(search: Search, figure: Figure) -> None:
    """Draw the objective of every trial in the order of the trials, and the best so far."""
    axes: Axes = figure.subplots()
    trials = [(number, trial) for number, trial in enumerate(search.trials) if trial.figures]
    finished = [spot for spot in trials if spot[1].status is Status.FINISHED]
    others = [spot for spot in trials if spot[1].status is not Status.FINISHED]
    for label, spots, inside in (("finished", finished, ACCENT), ("given up", others, "none")):
        values = [_value(search, trial) for _, trial in spots]
        numbers = [number for number, _ in spots]
        axes.scatter(numbers, values, s=26, facecolors=inside, edgecolors=ACCENT, label=label, zorder=2)
    if finished:
        better = np.maximum if search.config.objective.sign > 0 else np.minimum
        best = better.accumulate([_value(search, trial) for _, trial in finished])
        numbers = [*(number for number, _ in finished), len(search.trials) - 1]
        axes.step(numbers, [*best, best[-1]], where="post", color=SECOND, label="best so far", zorder=1)
    axes.legend(loc="best")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("trial")
    axes.set_ylabel(_label(search))
    axes.set_title(f"{len(trials)} trials")


def _optimisers(search: Search, figure: Figure) -> None:
    """Draw bars of the objective by learning rate, and each curve."""
    bars, curves = figure.subplots(1, 2, sharey=True)
    trials = [trial for trial in search.trials if trial.figures]
    values = [_value(search, trial) for trial in trials]
    for trial, value in zip(trials, values, strict=True):
        optimiser, rate = trial.settings["train.optimiser"], trial.settings["train.learning_rate"]
        colour, spot = OPTIMISER_COLOURS[optimiser], RATES.index(rate) + 0.27 * (OPTIMISERS.index(optimiser) - 1)
        bars.bar(spot, value, width=0.24, color=colour)
        bars.annotate(f"{value:.3g}", (spot, value), xytext=(0, 2), textcoords="offset points", ha="center", fontsize=7)
        line = [_shown(search, point) for point in trial.curve]
        few = "." if len(line) < 12 else None
        curves.plot(range(1, len(line) + 1), line, color=colour, linestyle=RATE_LINES[rate], marker=few)
    if trials:
        # The first epochs of a rate too great may lie far off: half of each curve is enough to see.
        seen = [*values, *(_shown(search, float(np.median(trial.curve))) for trial in trials)]
        margin = max(0.1 * float(np.ptp(seen)), 1e-3)
        bars.set_ylim(max(min(seen) - margin, 0), max(seen) + margin)
    bars.set_xticks(range(len(RATES)), [f"{rate:g}" for rate in RATES])
    bars.set_xlabel("learning rate")
    bars.set_ylabel(_label(search))
    bars.set_title("after the best epoch")
    curves.set_xlabel("epoch")
    curves.set_title("after each epoch")
    curves.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    for axes in (bars, curves):
        axes.grid(axis="x", visible=False)
    key: list[Any] = [Patch(color=colour, label=name) for name, colour in OPTIMISER_COLOURS.items()]
    key += [Line2D([], [], color=MUTED, linestyle=style, label=f"{rate:g}") for rate, style in RATE_LINES.items()]
    figure.legend(handles=key, loc="outside lower center", ncols=len(key))
