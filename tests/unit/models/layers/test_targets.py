from __future__ import annotations

import math

import pytest
import torch
from torch import Tensor, nn

from teamclone.engine.inputs.layout import GEOMETRY
from teamclone.engine.network.constants import TARGET_COLUMNS
from teamclone.models.inputs.geometry import geometry_of
from teamclone.models.layers.targets import TargetPoints, layers

SCALE = (0.75 * 52.5, 0.75 * 34.0)


def geometry(batch: int = 1, **values: float) -> Tensor:
    """A player who rests at the centre and faces +x, the offside line at 30; ``values`` say what is otherwise."""
    usual = {"cos": 1.0, "decay": 0.4, "dash_gain": 0.006, "line_x": 30.0, "near_m": 1.0}
    row = [{**usual, **values}.get(name, 0.0) for name in GEOMETRY]
    return torch.tensor(row).expand(batch, -1)


def at(*places: tuple[float, float]) -> TargetPoints:
    """TargetPoints that suppose these places whatever they are given."""
    targets = TargetPoints(3, len(places), (), nn.ReLU)
    with torch.no_grad():
        targets.place.weight.zero_()
        targets.place.bias.copy_((torch.tensor(places) / torch.tensor(SCALE)).flatten())
    return targets


def look(targets: TargetPoints, seen: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    with torch.no_grad():
        columns, bearing, power = targets(torch.randn(len(seen), 3), seen)
    return columns.view(len(seen), targets.count, TARGET_COLUMNS), bearing, power


def test_layers() -> None:
    assert [type(layer) for layer in layers((4, 3, 2), nn.ReLU)] == [nn.Linear, nn.ReLU] * 2
    assert [type(layer) for layer in layers((4, 3), nn.GELU, 0.5)] == [nn.Linear, nn.GELU, nn.Dropout]
    rows = torch.randn(5, 4)
    assert torch.equal(layers((4,), nn.ReLU)(rows), rows)


def test_geometry_by_name() -> None:
    x, line = geometry_of(geometry(2, x=7.0), "x", "line_x")
    assert x.tolist() == [[7], [7]]
    assert line.tolist() == [[30], [30]]


def test_a_place_straight_ahead() -> None:
    columns, bearing, power = look(at((10, 0)), geometry())
    # 10 m / 20; log(10.1); straight ahead; no turn is needed; within a metre of it he would pass; far from there; full.
    assert columns[0, 0].tolist() == pytest.approx([0.5, 0, math.log(10.1), 1, 0, -1, 0, -1, 1, 1.5], abs=1e-4)
    assert float(bearing) == pytest.approx(0, abs=1e-6)
    assert float(power) == pytest.approx(10 * 0.6 / 0.006, rel=1e-5)


def test_a_place_beside_and_behind() -> None:
    # He faces +y, so -x is to his right, which is positive.
    columns, bearing, power = look(at((-4, -3)), geometry(cos=0.0, sin=1.0))
    expected = [-3 / 20, 4 / 20, math.log(5.1), -0.6, 0.8, 1, 1, 1, 1, -0.5]
    assert columns[0, 0].tolist() == pytest.approx(expected, abs=1e-4)
    assert math.degrees(float(bearing)) == pytest.approx(math.degrees(math.atan2(4, -3)), abs=1e-3)
    assert float(power) == pytest.approx(-3 * 0.6 / 0.006, rel=1e-4)


def test_places_are_seen_from_where_the_player_comes_to_rest() -> None:
    values = {"x": 8.0, "y": 3.0, "coast_x": 9.0, "coast_y": 2.0, "forward": 0.3, "near_m": 2.0}
    columns, bearing, power = look(at((9.5, 2.5)), geometry(**values))
    assert columns[0, 0, :2].tolist() == pytest.approx([0.5 / 20, 0.5 / 20], abs=1e-5)
    assert math.degrees(float(bearing)) == pytest.approx(45, abs=1e-2)
    # Turned by 45 degrees, 30 more than he lets be; two metres off count as there.
    distance = math.sqrt(0.5)
    assert columns[0, 0, 5:9].tolist() == pytest.approx([1, 1, -1, (distance - 2) / 2], abs=1e-3)
    # What lacks to roll half a metre: 0.5 * 0.6 - 0.3.
    assert float(power) == pytest.approx(0, abs=1e-2)


def test_the_last_metre_takes_less_than_full_power() -> None:
    columns, _, power = look(at((0.6, 0)), geometry())
    assert float(power) == pytest.approx(60, abs=1e-2)
    assert float(columns[0, 0, 9]) == pytest.approx(0.6, abs=1e-4)
    # One who is spent and gets nothing from a dash asks for no more than can be told.
    columns, _, power = look(at((0.6, 0)), geometry(dash_gain=0.0))
    assert float(columns[0, 0, 9]) == 1.5
    assert power.isfinite().all()


def test_the_first_half_stays_behind_the_offside_line() -> None:
    columns, _, _ = look(at((25, 5), (-10, 5), (25, 5), (40, 5)), geometry(line_x=12.0))
    ahead = (columns[0, :, 0] * 20).tolist()
    assert ahead == pytest.approx([11, -10, 25, 40], abs=1e-4)
    # It is the metre from the line of the pitch, whichever way he faces.
    columns, _, _ = look(at((25, 5), (25, 5)), geometry(line_x=12.0, cos=0.0, sin=1.0, coast_x=2.0))
    assert (columns[0, :, 1] * 20).tolist() == pytest.approx([-9, -23], abs=1e-4)
    # Of a single place there is no first half.
    columns, _, _ = look(at((25, 5)), geometry(line_x=12.0))
    assert float(columns[0, 0, 0]) * 20 == pytest.approx(25)


def test_a_place_where_he_stands_is_a_number() -> None:
    targets = at((0, 0), (0, 0))
    columns, bearing, power = targets(torch.randn(1, 3), geometry())
    (columns.sum() + bearing.sum() + power.sum()).backward()
    assert columns.isfinite().all()
    assert targets.place.bias.grad is not None
    assert targets.place.bias.grad.isfinite().all()


def test_places_follow_from_what_is_seen_and_are_learned() -> None:
    torch.manual_seed(0)
    targets = TargetPoints(3, 2, (16,), nn.ReLU)
    rows = torch.randn(64, 3)
    wanted = torch.stack([10 * rows[:, 0], 10 * rows[:, 1]], 1)
    optimiser = torch.optim.Adam(targets.parameters(), lr=0.02)
    for _ in range(100):
        columns = targets(rows, geometry(64, line_x=100.0))[0].view(64, 2, TARGET_COLUMNS)
        loss = (20 * columns[:, 0, :2] - wanted).square().mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    assert loss.item() < 1


def test_no_places() -> None:
    targets = TargetPoints(3, 0, (), nn.ReLU)
    outputs = targets(torch.randn(5, 3), geometry(5))
    assert [tuple(output.shape) for output in outputs] == [(5, 0)] * 3
    assert list(targets.parameters()) == []


def test_places_are_in_single_precision_under_autocast() -> None:
    targets = at((10.1, 0))
    with torch.autocast("cpu", dtype=torch.bfloat16):
        columns, bearing, power = look(targets, geometry())
    assert {columns.dtype, bearing.dtype, power.dtype} == {torch.float32}
    assert float(columns[0, 0, 0]) * 20 == pytest.approx(10.1, abs=1e-4)
