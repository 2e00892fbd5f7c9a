"""Football on the pitch: who stands where, who passes to whom, from where is shot.

Every function takes plain arrays of metres in which the team attacks +x, and draws into axes that have no pitch yet.
Line widths, discs and letters are in points, so that they stay legible on a small pitch. A value is shown by the
opacity of one colour, since this alone looks right on a light and on a dark page.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.patches import Ellipse, FancyArrowPatch, Rectangle
from numpy.typing import ArrayLike, NDArray

from teamclone.plots.pitch import draw_pitch
from teamclone.plots.style import Colours
from teamclone.rcss import pitch

Floats = NDArray[np.float64]

DISC = 13.0
"""Diameter of a player, points: two digits fit."""
LINE = 0.7
"""Width of the pitch's lines, points."""
LEVELS = 9
"""Of a heat map."""
LEAST_SMOOTH_M = 2.5
"""Least standard deviation by which counts of a heat map are spread."""
STRONGEST = 0.75
"""Opacity of the greatest value: lines and letters above it stay legible."""
_LEAST_COUNT = 0.05
"""Share of the greatest value at which the first level of a heat map begins."""
_SHOT = 200.0
"""Area of a shot of size 1, square points."""
_LEAST_SHOT = 0.04
"""Smaller ones are drawn like this, to be seen."""


def draw_formation(
    axes: Any,
    places: ArrayLike,
    *,
    unums: ArrayLike,
    colours: Colours,
    colour: str | None = None,
    spread: ArrayLike | None = None,
    labels: Sequence[str] | None = None,
    ball: ArrayLike | None = None,
) -> None:
    """Draw a pitch with players, see `draw_players`, and the ball (2,) m where there is one."""
    _pitch(axes, colours)
    draw_players(axes, places, unums=unums, colours=colours, colour=colour, spread=spread, labels=labels)
    if ball is not None:
        draw_ball(axes, ball, colours=colours)


def draw_players(
    axes: Any,
    places: ArrayLike,
    *,
    unums: ArrayLike,
    colours: Colours,
    colour: str | None = None,
    spread: ArrayLike | None = None,
    labels: Sequence[str] | None = None,
    body: ArrayLike | None = None,
) -> None:
    """Draw players as discs with their numbers, onto a pitch that is there.

    Args:
        places: (n, 2) m; players with NaN are left out. unums: (n,) their numbers.
        colour: of the players; None for the accent.
        spread: (n, 2) m, standard deviations along and across the pitch, drawn as ellipses.
        labels: (n,) words below the discs.
        body: (n,) degrees, where they face, drawn as strokes.
    """
    places = np.asarray(places, np.float64)
    there = np.isfinite(places).all(1)
    colour = colours.accent if colour is None else colour
    if spread is not None:
        for place, deviation in zip(places[there], np.asarray(spread, np.float64)[there], strict=True):
            axes.add_patch(Ellipse(place, *(2 * deviation), facecolor=colour, alpha=0.16, linewidth=0, zorder=2))
    if body is not None:
        angle = np.radians(np.asarray(body, np.float64)[there])
        axes.quiver(
            *places[there].T, np.cos(angle), np.sin(angle), color=colour, headwidth=0, headlength=0, headaxislength=0,
            angles="xy", units="inches", scale_units="inches", scale=72 / DISC, width=2.5 / 72, zorder=4,
        )  # fmt: skip
    sizes = np.full(len(places), DISC)
    _discs(axes, places, unums, sizes, colour=colour, colours=colours)
    if labels is not None:
        look: Any = {"textcoords": "offset points", "ha": "center", "va": "top", "fontsize": 7, "color": colours.muted}
        for place, label in zip(places[there], np.asarray(labels)[there], strict=True):
            axes.annotate(label, place, (0, -DISC / 2 - 1), zorder=6, **look)


def draw_ball(axes: Any, place: ArrayLike, *, colours: Colours) -> None:
    """Draw the ball at a place (2,) m, onto a pitch that is there."""
    look: Any = {"color": colours.ink, "markeredgecolor": colours.paper, "markeredgewidth": 0.8}
    axes.plot(*np.asarray(place, np.float64), "o", markersize=0.45 * DISC, zorder=7, **look)


def draw_pass_network(
    axes: Any,
    places: ArrayLike,
    counts: ArrayLike,
    *,
    unums: ArrayLike,
    colours: Colours,
    colour: str | None = None,
    least: float | None = None,
) -> None:
    """Draw passes between players: arrows by how many there were, discs by how many a player made.

    Of two players the arrows bend to their own left, so that both directions are seen.

    Args:
        places: (n, 2) m; players with NaN are left out, with their passes. unums: (n,) their numbers.
        counts: (n, n) completed passes from row to column, of a match or on average.
        colour: of players and passes; None for the accent.
        least: pairs with fewer are not drawn; None for all.
    """
    places, counts = np.asarray(places, np.float64), np.array(counts, np.float64)
    colour = colours.accent if colour is None else colour
    _pitch(axes, colours)
    np.fill_diagonal(counts, 0.0)
    there = np.isfinite(places).all(1)
    counts[~there] = counts[:, ~there] = 0.0
    made = counts.sum(1)
    sizes = DISC * np.sqrt(1.0 + 1.5 * _shares(made))
    shares = _shares(counts)
    for passer, receiver in _ascending(counts, 0.0 if least is None else least):
        share = shares[passer, receiver]
        axes.add_patch(
            _arrow(
                places[passer],
                places[receiver],
                width=0.5 + 3.5 * share,
                alpha=0.2 + 0.65 * share,
                colour=colour,
                gaps=(sizes[passer] / 2 + 1, sizes[receiver] / 2 + 1),
                bend=0.13,
            )
        )
    _discs(axes, places, unums, sizes, colour=colour, colours=colours)


def draw_heat(axes: Any, counts: ArrayLike, *, colours: Colours, colour: str | None = None, lines: bool = True) -> None:
    """Draw how often something happened where, smoothed the more the rarer it was, from light to strong.

    Args:
        counts: (nx, ny) over the whole pitch, equal cells of at most 2 m, from its corner of least x and y.
        colour: None for the accent. lines: draw the edges of the levels, too.
    """
    counts = np.asarray(counts, np.float64)
    colour = colours.accent if colour is None else colour
    _pitch(axes, colours)
    size = np.array([pitch.LENGTH, pitch.WIDTH]) / counts.shape
    if not counts.sum() > 0:
        return
    smooth = _smoothed(counts, np.maximum(_bandwidth(counts), LEAST_SMOOTH_M / size))
    # Up to the lines of the pitch, as contours end at the middle of the outermost cells.
    smooth = np.pad(smooth, 1, mode="edge")
    x, y = (
        np.concatenate([[-half], (np.arange(n) + 0.5) * step - half, [half]])
        for half, n, step in zip((pitch.HALF_LENGTH, pitch.HALF_WIDTH), counts.shape, size, strict=True)
    )
    # One above the other instead of side by side: neighbours that are half transparent would show their seams.
    layer = 1.0 - (1.0 - STRONGEST) ** (1.0 / LEVELS)
    for level in np.linspace(_LEAST_COUNT, 1.0, LEVELS, endpoint=False) * smooth.max():
        axes.contourf(x, y, smooth.T, [level, np.inf], colors=[colour], alpha=layer, zorder=0.5)
        if lines:
            axes.contour(x, y, smooth.T, [level], colors=[colour], alpha=0.25, linewidths=0.4, zorder=0.6)


def draw_shots(
    axes: Any,
    x: ArrayLike,
    y: ArrayLike,
    *,
    outcome: ArrayLike,
    colours: Colours,
    size: ArrayLike | None = None,
    colour: str | None = None,
    half: bool = True,
) -> None:
    """Draw shots as circles, goals filled, and how many there are of both.

    Args:
        x, y: (n,) m. outcome: (n,) bool, whether it was a goal.
        size: (n,) areas, such as expected goals; None for 1.
        colour: None for the accent.
        half: leave out the own half, as far as there is no shot in it.
    """
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    area = _SHOT * np.maximum(np.ones(len(x)) if size is None else np.asarray(size, np.float64), _LEAST_SHOT)
    colour = colours.accent if colour is None else colour
    scored = np.asarray(outcome, np.bool_)
    _pitch(axes, colours)
    handles = []
    kinds = ((scored, colour, colours.paper, "goals", 4), (~scored, "none", colour, "other shots", 3))
    for these, face, edge, name, zorder in kinds:
        look: Any = {"facecolors": face, "edgecolors": edge, "linewidths": 1.1, "alpha": 0.85}
        axes.scatter(x[these], y[these], area[these], zorder=zorder, **look)
        # The legend's circles have one size, whatever the shots have.
        handles.append(axes.scatter([], [], _SHOT / 4, label=f"{name}  {these.sum()}", **look))
    # Few shots come from the corners of one's own half, and none from beyond the middle.
    axes.legend(handles=handles, loc="lower left", frameon=False, labelcolor=colours.ink)
    if half:
        axes.set_xlim(min(0.0, *x) - 1.0 if len(x) else -1.0, axes.get_xlim()[1])


def draw_routes(
    axes: Any, start: ArrayLike, end: ArrayLike, *, weight: ArrayLike, colours: Colours, colour: str | None = None
) -> None:
    """Draw ways as arrows, broad and strong by weight.

    Args:
        start, end: (n, 2) m. weight: (n,) such as how often each was taken.
        colour: None for the accent.
    """
    start, end, weight = (np.asarray(values, np.float64) for values in (start, end, weight))
    colour = colours.accent if colour is None else colour
    _pitch(axes, colours)
    shares = _shares(weight)
    for one in np.argsort(weight, kind="stable"):
        share = shares[one]
        axes.add_patch(_arrow(start[one], end[one], width=0.6 + 3.4 * share, alpha=0.25 + 0.6 * share, colour=colour))


def draw_zones(
    axes: Any,
    values: ArrayLike,
    *,
    text: Sequence[Sequence[str]],
    colours: Colours,
    colour: str | None = None,
    scale: tuple[float, float] | None = None,
) -> None:
    """Draw a value for each zone of the pitch, by its opacity and in words.

    Args:
        values: (nx, ny), equal zones from the corner of least x and y; NaN where there is none.
        text: (nx, ny) words.
        colour: None for the accent.
        scale: values without any colour and with the strongest one; None for zero and the greatest.
    """
    values = np.asarray(values, np.float64)
    low, high = (0.0, float(np.nanmax(values, initial=0.0))) if scale is None else scale
    shades = np.clip(np.nan_to_num((values - low) / (high - low or 1.0)), 0.0, 1.0) * STRONGEST
    colour = colours.accent if colour is None else colour
    _pitch(axes, colours)
    size = np.array([pitch.LENGTH, pitch.WIDTH]) / values.shape
    for (along, across), shade in np.ndenumerate(shades):
        corner = size * (along, across) - (pitch.HALF_LENGTH, pitch.HALF_WIDTH)
        axes.add_patch(
            Rectangle((corner[0], corner[1]), *size, facecolor=colour, alpha=shade, edgecolor="none", zorder=0)
        )
        axes.annotate(text[along][across], corner + size / 2, ha="center", va="center", color=colours.ink, fontsize=8)


def _pitch(axes: Any, colours: Colours) -> None:
    draw_pitch(axes, colour=colours.muted, width=LINE)


def _discs(axes: Any, places: Floats, unums: ArrayLike, sizes: Floats, *, colour: str, colours: Colours) -> None:
    """Draw players of some diameters (n,) in points."""
    for place, unum, size in zip(places, np.asarray(unums), sizes, strict=True):
        if np.isfinite(place).all():
            axes.plot(
                *place, "o", markersize=size, color=colour, markeredgecolor=colours.paper, markeredgewidth=0.8, zorder=5
            )
            axes.annotate(
                str(unum),
                place,
                ha="center",
                va="center_baseline",
                fontsize=0.58 * size,
                fontweight="bold",
                color=colours.paper,
                zorder=6,
            )


def _arrow(
    start: Floats,
    end: Floats,
    *,
    width: float,
    alpha: float,
    colour: str,
    gaps: tuple[float, float] = (0.0, 0.0),
    bend: float = 0.0,
) -> FancyArrowPatch:
    """Return an arrow; width and gaps at its ends in points."""
    return FancyArrowPatch(
        (start[0], start[1]),
        (end[0], end[1]),
        arrowstyle="-|>",
        mutation_scale=5.0 + 1.8 * width,
        connectionstyle=f"arc3,rad={bend}",
        shrinkA=gaps[0],
        shrinkB=gaps[1],
        linewidth=width,
        color=colour,
        alpha=alpha,
        zorder=3,
    )


def _shares(values: Floats) -> Floats:
    """Return values by the greatest of them; zeros if it is zero or there is none."""
    shares: Floats = values / (values.max(initial=0.0) or 1.0)
    return shares


def _ascending(counts: Floats, least: float) -> Iterator[tuple[int, int]]:
    """Yield the pairs of (n, n) counts that are at least so many and any, the most at last: they lie on top."""
    for pair in np.argsort(counts, axis=None, kind="stable"):
        passer, receiver = divmod(int(pair), len(counts))
        if counts[passer, receiver] >= least and counts[passer, receiver] > 0:
            yield passer, receiver


def _bandwidth(counts: Floats) -> Floats:
    """Return the standard deviations (2,) in cells that suit counts (nx, ny).

    Half of what Scott's rule gives (Scott 1992), since that is meant for a single hump.
    """
    total = counts.sum()
    cells = np.indices(counts.shape).reshape(2, -1)
    variance = np.cov(cells, aweights=counts.ravel(), bias=True).diagonal()
    bandwidth: Floats = 0.5 * np.sqrt(variance) * total ** (-1.0 / 6.0)
    return bandwidth


def _smoothed(counts: Floats, deviation: Floats) -> Floats:
    """Return counts (nx, ny) spread by normal distributions, standard deviations (2,) in cells.

    What would fall off the pitch is reflected at its lines, so that no place beside them looks emptier than it was.
    """
    for axis, (n, cells) in enumerate(zip(counts.shape, deviation, strict=True)):
        reach = min(n, int(np.ceil(3.0 * cells)))
        weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / cells) ** 2)
        padding = [(reach, reach) if one == axis else (0, 0) for one in (0, 1)]
        padded = np.pad(counts, padding, mode="symmetric")
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1, axis)
        counts = windows @ (weights / weights.sum())
    return counts
