"""Football on a pitch: by day and by night, as many things as there are, each where it belongs."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import same_color, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, FancyArrowPatch, Rectangle

from teamclone.plots import maps, page
from teamclone.plots.fans import draw_fan
from teamclone.plots.style import LIGHT
from teamclone.rcss import pitch

RNG = np.random.default_rng(3)
PLACES = RNG.uniform((-45, -30), (45, 30), (11, 2))
PASSES = RNG.poisson(1.5, (11, 11))
UNUMS = range(1, 12)
HEAT = np.histogram2d(*RNG.normal((10, -5), 15, (1500, 2)).T, bins=(53, 34), range=((-52.5, 52.5), (-34, 34)))[0]
FAN = {
    "cycle": 100,
    "ahead": 20,
    "others": [[10.0, 5.0]],
    "bodies": [{"of": "ball", "truth": [[0, 0], [5, 5]], "samples": [[[0, 0], [4, 5]], [[0, 0], [5, 4]]]}],
}

DRAWINGS: dict[str, Callable[[Any, Any], None]] = {
    "formation": lambda axes, colours: maps.draw_formation(
        axes, PLACES, unums=UNUMS, colours=colours, spread=PLACES / 9, labels=["goalkeeper"] * 11, ball=(3, 4)
    ),
    "pass network": lambda axes, colours: maps.draw_pass_network(axes, PLACES, PASSES, unums=UNUMS, colours=colours),
    "heat": lambda axes, colours: maps.draw_heat(axes, HEAT, colours=colours),
    "shots": lambda axes, colours: maps.draw_shots(
        axes, PLACES[:, 0], PLACES[:, 1], outcome=PLACES[:, 1] > 0, size=np.linspace(0, 1, 11), colours=colours
    ),
    "routes": lambda axes, colours: maps.draw_routes(axes, PLACES, -PLACES, weight=np.arange(11), colours=colours),
    "zones": lambda axes, colours: maps.draw_zones(
        axes, [[1.0, np.nan], [3.0, 4.0]], text=[["1", ""], ["3", "4"]], colours=colours
    ),
    "fan": lambda axes, colours: draw_fan(axes, FAN, colours=colours),
}


@pytest.fixture
def axes() -> Any:
    return Figure(figsize=(11.4, 7), dpi=100).add_axes((0, 0, 1, 1))


def patches(axes: Any, kind: type) -> list[Any]:
    """Those of a kind that are no lines of the pitch."""
    return [
        one for one in axes.patches if type(one) is kind and not (kind is Rectangle and one.get_facecolor()[3] == 0)
    ]


def discs(axes: Any) -> dict[str, tuple[float, float]]:
    """Places of numbers that are drawn."""
    return {one.get_text(): tuple(one.xy) for one in axes.texts if one.get_text().isdigit()}


def reds(axes: Any) -> Any:
    """Share of red in every pixel of a drawing in red on white."""
    canvas = FigureCanvasAgg(axes.figure)
    canvas.draw()
    rgb = np.asarray(canvas.buffer_rgba())[..., :3].astype(float) / 255
    return rgb[..., 0] - rgb[..., 1]


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_drawing_has_the_whole_pitch_with_the_goals_of_the_simulator(name: str, axes: Any) -> None:
    DRAWINGS[name](axes, LIGHT)
    goals = [one for one in axes.patches if one.get_label() == "goal"]
    assert [abs(goal.get_height()) for goal in goals] == [14.02, 14.02]
    top, bottom = reversed(axes.get_ylim())
    assert top < -34 < 34 < bottom, "positive y belongs to the lower half"
    left, right = axes.get_xlim()
    assert left < -52.5 - 2.44 or name == "shots", "of shots, half a pitch"
    assert right > 52.5 + 2.44


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_drawing_follows_the_page_by_day_and_night(name: str) -> None:
    with mpl.rc_context(page.STYLE):
        figure = Figure(figsize=(4, 3), layout="constrained")
        DRAWINGS[name](figure.subplots(), page.COLOURS)
        text = page.svg(figure, name="one", alt="a drawing")
    ElementTree.fromstring(text)
    assert set(re.findall(r"#[0-9a-f]{6}", text)) == set(), "a colour that does not follow the page"
    assert "<image" not in text, "pixels cannot follow the page"
    assert {"accent", "second"} & set(re.findall(r"var\(--(\w+)\)", text))
    assert text.count("<path") < 250
    assert len(text) < 80_000


def test_players_stand_at_their_places_with_their_numbers(axes: Any) -> None:
    there = PLACES.copy()
    there[4] = np.nan
    maps.draw_formation(axes, there, unums=UNUMS, colours=LIGHT, spread=np.ones((11, 2)), ball=(3, 4))
    assert discs(axes) == {str(unum): tuple(PLACES[unum - 1]) for unum in UNUMS if unum != 5}
    assert len(patches(axes, Ellipse)) == 10
    assert {(one.width, one.height) for one in patches(axes, Ellipse)} == {(2.0, 2.0)}
    assert [3.0, 4.0] in [[*one.get_xdata(), *one.get_ydata()] for one in axes.lines]


def test_a_player_faces_down_the_page_at_90_degrees(axes: Any) -> None:
    red = "#ff0000"
    maps.draw_formation(axes, [[0, 0]], unums=[7], colours=LIGHT, colour=red)
    before = reds(axes)
    maps.draw_players(axes, [[0, 0]], unums=[7], colours=LIGHT, colour=red, body=[90.0])
    rows, columns = np.nonzero(reds(axes) - before > 0.5)
    assert rows.min() > before.shape[0] / 2, "90 degrees are +y"
    assert abs(columns.mean() - before.shape[1] / 2) < 2


def test_passes_are_arrows_by_their_number(axes: Any) -> None:
    counts = np.zeros((11, 11), int)
    counts[6, 8], counts[8, 6], counts[0, 1], counts[3, 3] = 9, 3, 1, 5
    maps.draw_pass_network(axes, PLACES, counts, unums=UNUMS, colours=LIGHT)
    arrows = sorted(patches(axes, FancyArrowPatch), key=lambda one: one.get_linewidth())
    assert len(arrows) == 3, "a pass to oneself is none"
    ends = [[tuple(point) for point in one._posA_posB] for one in arrows]
    assert ends == [[tuple(PLACES[a]), tuple(PLACES[b])] for a, b in ((0, 1), (8, 6), (6, 8))]
    alphas = [one.get_alpha() for one in arrows]
    assert alphas == sorted(set(alphas))
    sizes = {one.get_markersize() for one in axes.lines if one.get_marker() == "o"}
    assert max(sizes) > 1.3 * min(sizes), "who passes more is larger"


@pytest.mark.parametrize(("least", "shown"), [(None, 3), (0.5, 2), (2, 1), (10, 0)])
def test_rare_passes_can_be_left_out(axes: Any, least: float | None, shown: int) -> None:
    counts = np.zeros((3, 3))
    counts[0, 1], counts[1, 0], counts[1, 2] = 0.2, 1.0, 9.0
    maps.draw_pass_network(axes, PLACES[:3], counts, unums=[1, 2, 3], colours=LIGHT, least=least)
    assert len(patches(axes, FancyArrowPatch)) == shown


def test_passes_of_players_without_a_place_are_left_out(axes: Any) -> None:
    places = PLACES.copy()
    places[2] = np.nan
    maps.draw_pass_network(axes, places, np.ones((11, 11)), unums=UNUMS, colours=LIGHT)
    assert len(patches(axes, FancyArrowPatch)) == 10 * 9
    assert "3" not in discs(axes)


def test_players_may_stand_at_one_place(axes: Any) -> None:
    maps.draw_pass_network(axes, np.zeros((11, 2)), np.ones((11, 11)), unums=UNUMS, colours=LIGHT)
    axes.figure.savefig("/dev/null", format="png")


@pytest.mark.parametrize(("along", "across"), [(0, 0), (52, 0), (0, 33), (40, 20)])
def test_heat_is_where_it_was_counted(axes: Any, along: int, across: int) -> None:
    counts = np.zeros((53, 34))
    counts[along, across] = 10
    maps.draw_heat(axes, counts, colours=LIGHT, colour="#ff0000", lines=False)
    heat = reds(axes)
    row, column = np.unravel_index(heat.argmax(), heat.shape)
    hot = np.argwhere(heat > 0.99 * heat[row, column])
    x, y = axes.transData.inverted().transform((hot[:, 1].mean(), heat.shape[0] - hot[:, 0].mean()))
    middle = (np.array([along, across]) + 0.5) * (105 / 53, 68 / 34) - (52.5, 34)
    assert np.hypot(x - middle[0], y - middle[1]) < 2.5
    assert heat[row, column] == pytest.approx(maps.STRONGEST, abs=0.03), "the most is as strong as may be"


def test_rare_events_are_smoothed_more(axes: Any) -> None:
    spots = RNG.integers((0, 0), (53, 34), (2000, 2))
    few, many = np.zeros((53, 34)), np.zeros((53, 34))
    np.add.at(few, tuple(spots[:20].T), 1)
    np.add.at(many, tuple(spots.T), 1)
    assert (maps._bandwidth(few) > 1.5 * maps._bandwidth(many)).all()


def test_smoothing_keeps_the_number_of_what_was_seen() -> None:
    counts = RNG.poisson(0.2, (53, 34)).astype(float)
    smooth = maps._smoothed(counts, np.array([2.0, 3.0]))
    assert smooth.sum() == pytest.approx(counts.sum())
    assert smooth.max() < 0.5 * counts.max()


def test_nothing_seen_is_an_empty_pitch(axes: Any) -> None:
    maps.draw_heat(axes, np.zeros((53, 34)), colours=LIGHT)
    assert reds(axes).max() < 0.05


def test_shots_are_circles_by_size_and_goals_are_filled(axes: Any) -> None:
    size = [0.0, 0.1, 0.4]
    maps.draw_shots(axes, [30, 40, 45], [0, 5, -5], outcome=[False, True, False], size=size, colours=LIGHT)
    goals, others = (one for one in axes.collections if len(one.get_offsets()))
    assert goals.get_offsets().tolist() == [[40, 5]]
    assert others.get_offsets().tolist() == [[30, 0], [45, -5]]
    assert same_color(goals.get_facecolor()[0][:3], to_rgb(LIGHT.accent))
    assert len(others.get_facecolor()) == 0
    assert others.get_sizes()[1] == pytest.approx(4 * goals.get_sizes()[0]), "areas"
    assert others.get_sizes()[0] > 0, "and what is worth nothing is seen, too"
    assert [one.get_text() for one in axes.get_legend().get_texts()] == ["goals  1", "other shots  2"]


@pytest.mark.parametrize(("x", "half", "left"), [([30, 40], True, -1.0), ([-10, 40], True, -11.0), ([], True, -1.0)])
def test_half_a_pitch_shows_every_shot(axes: Any, x: list[float], half: bool, left: float) -> None:
    maps.draw_shots(axes, x, np.zeros(len(x)), outcome=np.zeros(len(x), bool), colours=LIGHT, half=half)
    assert axes.get_xlim()[0] == left


def test_ways_are_broad_by_weight(axes: Any) -> None:
    maps.draw_routes(axes, PLACES[:3], PLACES[3:6], weight=[5, 1, 3], colours=LIGHT)
    arrows = patches(axes, FancyArrowPatch)
    assert [tuple(one._posA_posB[0]) for one in arrows] == [tuple(PLACES[one]) for one in (1, 2, 0)], "the most on top"
    widths = [one.get_linewidth() for one in arrows]
    assert widths == sorted(set(widths))


@pytest.mark.parametrize(
    ("scale", "shades"), [(None, [0.0, 0.25, 0.5, 1.0]), ((1.0, 3.0), [0.0, 0.0, 0.5, 1.0])]
)  # fmt: skip
def test_zones_cover_the_pitch_and_are_coloured_by_value(axes: Any, scale: Any, shades: list[float]) -> None:
    values = [[0.0, 1.0], [2.0, 4.0]]
    maps.draw_zones(axes, values, text=[["a", "b"], ["c", "d"]], colours=LIGHT, scale=scale)
    zones = [one for one in axes.patches if isinstance(one, Rectangle) and one.get_width() == pitch.HALF_LENGTH]
    assert [one.get_xy() for one in zones] == [(-52.5, -34), (-52.5, 0), (0, -34), (0, 0)]
    assert {one.get_height() for one in zones} == {34}
    assert [one.get_alpha() / maps.STRONGEST for one in zones] == pytest.approx(shades)
    assert {one.get_text(): tuple(one.xy) for one in axes.texts}["c"] == (26.25, -17)


def test_a_zone_without_a_value_has_no_colour(axes: Any) -> None:
    maps.draw_zones(axes, [[np.nan]], text=[[""]], colours=LIGHT)
    assert [one.get_alpha() for one in axes.patches if one.get_alpha() is not None] == [0]


def test_a_fan_has_a_path_for_each_sample(axes: Any) -> None:
    draw_fan(axes, FAN, colours=LIGHT)
    thin = [one for one in axes.lines if one.get_linewidth() == 0.5]
    assert [[list(point) for point in one.get_xydata()] for one in thin] == FAN["bodies"][0]["samples"]
    assert axes.get_title() == "cycle 100, 20 cycles ahead"
