"""Figures as pictures: which way the pitch lies, how wide its goals are, and that SVG fits into one page."""

from __future__ import annotations

import functools
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from teamclone.plots.page import svg
from teamclone.plots.pitch import draw_pitch
from teamclone.report import figures

SCALE = 10  # pixels a metre


@pytest.fixture
def pitch():
    """A drawn pitch, 10 pixels a metre, and a function from metres to (row, column) of its picture."""
    figure = Figure(figsize=(12, 8), dpi=100)
    axes = figure.add_axes((0, 0, 1, 1))
    draw_pitch(axes, colour="#000000", width=1.0)
    return figure, axes


def picture(figure, axes):
    """Darkness of every pixel, and metres to pixels."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = 255 - np.asarray(canvas.buffer_rgba())[..., :3].min(axis=2).astype(int)

    def pixel(x: float, y: float) -> tuple[int, int]:
        column, up = axes.transData.transform((x, y))
        return round(image.shape[0] - up), round(column)

    return image, pixel


def test_y_points_down_the_page_and_x_to_the_right(pitch) -> None:
    figure, axes = pitch
    axes.scatter([40], [25], s=400, color="#ff0000", zorder=5)
    image = FigureCanvasAgg(figure)
    image.draw()
    pixels = np.asarray(image.buffer_rgba()).astype(int)
    rows, columns = np.nonzero((pixels[..., 0] > 200) & (pixels[..., 1] < 60))
    assert rows.mean() > 0.7 * pixels.shape[0], "positive y belongs to the lower half"
    assert columns.mean() > 0.8 * pixels.shape[1], "positive x belongs to the right half"


@pytest.mark.parametrize("side", [-1, 1])
def test_goals_are_as_wide_as_the_simulators(pitch, side: int) -> None:
    """A cut through the goal, a metre behind the goal line, meets the net's two sides and nothing else."""
    figure, axes = pitch
    image, pixel = picture(figure, axes)
    _, column = pixel(side * (52.5 + 1.0), 0)
    dark = np.flatnonzero(image[:, column] > 100)
    top, bottom = dark.min(), dark.max()
    a_metre = (pixel(0, 30)[0] - pixel(0, -30)[0]) / 60
    assert (bottom - top) / a_metre == pytest.approx(14.02, abs=0.25)
    assert (top + bottom) / 2 == pytest.approx(pixel(0, 0)[0], abs=2)


def test_pitch_is_105_by_68_metres(pitch) -> None:
    image, pixel = picture(*pitch)
    for y in (-34, 34):
        row, column = pixel(25, y)
        assert image[row - 2 : row + 3, column].max() > 100
    row, column = pixel(52.5, 25)
    assert image[row, column - 2 : column + 3].max() > 100
    assert image[row, column + 15 :].max() == 0


@functools.cache
def drawn() -> dict[str, Figure]:
    value = {"value": 0.8, "low": 0.75, "high": 0.83}
    alone = {"value": 0.7, "low": None, "high": None}
    model = dict.fromkeys(("accuracy", "cross_entropy", "ece", "paper_mae"), value)
    curve = {"rows": [10, 10], "confidence": [0.3, 0.9], "observed_frequency": [0.4, 0.8]}
    nothing = {"rows": [], "confidence": [], "observed_frequency": []}
    history = [
        {"epoch": epoch, "train_accuracy": 0.5 + epoch / 10, "validation_accuracy": 0.5, "train_cross_entropy": 1.0}
        for epoch in (1, 2, 3)
    ]
    return {
        "positions": figures.positions({"dash": [[1, 2], [3, 4]], "kick": []}, {"dash": 2}),
        "frequencies": figures.frequencies({"dash": 60, "turn": 30, "kick": 1, "tackle": 0}),
        "turns": figures.turn_moments([-180, -1, 1, 180], [5, 1000, 7], zero=400, turns=1012),
        "no turns": figures.turn_moments([-180, 0, 180], [0, 0], zero=0, turns=0),
        "training": figures.training_curves(history, best_epoch=2),
        "splits": figures.seen_unseen({"test": model, "unseen": dict.fromkeys(model, alone)}),
        "opponents": figures.opponents(
            [
                {"split": "test", "opponent": "A<b>", "accuracy": value, "matches": 3},
                {"split": "unseen", "opponent": "C", "accuracy": alone, "matches": 1},
            ]
        ),
        "reliability": figures.reliability(
            {"predicted_command": curve, "commands": {"dash": curve, "turn": curve, "kick": nothing, "tackle": nothing}}
        ),
        "times": figures.response_times([0, 50, 100], [10, 1], p50_us=40, p99_us=90),
    }


NAMES = ("positions", "frequencies", "turns", "no turns", "training", "splits", "opponents", "reliability", "times")


@pytest.mark.parametrize("name", NAMES)
def test_svg_fits_into_a_page(name: str) -> None:
    text = svg(drawn()[name], name="one", alt='a "figure" <here> & there')
    root = ElementTree.fromstring(text)
    assert root.get("role") == "img"
    assert root.get("aria-label") == 'a "figure" <here> & there'
    assert root.get("width") is None, "the page scales it"
    assert root.get("viewBox")
    ids = [element.get("id") for element in root.iter() if element.get("id")]
    assert len(ids) == len(set(ids))
    assert all(name.startswith("one-") for name in ids)
    for reference in re.findall(r'(?:href="#|url\(#)([^")]+)', text):
        assert reference in ids
    assert not re.search(r'(?:href|src)="(?!#|data:)', text)
    assert "#0102" not in text, "a stand-in colour was left"
    assert "var(--" in text


def test_figures_are_the_same_every_time() -> None:
    once, again = (svg(drawn()["training"], name="a", alt="") for _ in range(2))
    assert once == again


def test_dots_of_many_positions_stay_small() -> None:
    spots = np.random.default_rng(0).uniform((-52, -34), (52, 34), (2500, 2)).round(1).tolist()
    text = svg(figures.positions(dict.fromkeys(figures.KINDS, spots), {}), name="a", alt="")
    assert len(text) < 600_000


@pytest.mark.parametrize("name", ["$\\frac{$", "A$b$C", "$", "$$"])
def test_names_are_no_formulas(name: str) -> None:
    rows = [
        {"opponent": one, "split": "test", "matches": 1, "accuracy": {"value": 0.9, "low": None, "high": None}}
        for one in (name, "Blue")
    ]
    assert name in svg(figures.opponents(rows), name="opponents", alt="").replace("&amp;", "&")
