from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from teamclone.engine.network.constants import DEGREE, LEAST_ANGLE, LEAST_POWER
from teamclone.models.distributions import (
    Mixture,
    angle_terms,
    clipped_terms,
    halves,
    log_likelihood,
    merged,
    mirrored,
    scale_of,
    weighted_medoid,
    weighted_medoid_place,
    wrap,
)


def mixture(centre: Sequence[float], scale: Sequence[float], logits: Sequence[float] | None = None) -> Mixture:
    """One row, in double precision."""
    rows = ([0.0] * len(centre) if logits is None else logits, centre, scale)
    return Mixture(*(torch.tensor([list(row)], dtype=torch.float64) for row in rows))


def repeated(parts: Mixture, n: int) -> Mixture:
    return Mixture(*(part.expand(n, -1) for part in parts))


def double(*values: float) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)


def power_likelihood(parts: Mixture, power: Tensor) -> Tensor:
    return log_likelihood(
        repeated(parts, len(power)).logits, clipped_terms(repeated(parts, len(power)), power, low=0.0, high=100.0)
    ).exp()


def angle_likelihood(parts: Mixture, degrees: Tensor, factor: float | None = None) -> Tensor:
    many = repeated(parts, len(degrees))
    factors = None if factor is None else torch.full_like(degrees, factor)
    return log_likelihood(many.logits, angle_terms(many, degrees, factor=factors)).exp()


@pytest.mark.parametrize("centre", [[-30.0, 20.0], [50.0, 99.9], [100.0, 130.0], [0.0, 0.0]])
@pytest.mark.parametrize("scale", [[0.1, 5.0], [40.0, 1.0]])
def test_powers_with_their_bounds_make_up_one(centre: list[float], scale: list[float]) -> None:
    parts = mixture(centre, scale, [0.3, -1.0])
    inner = torch.linspace(0.011, 99.989, 200_001, dtype=torch.float64)
    inside = float(torch.trapezoid(power_likelihood(parts, inner), inner))
    low, high = power_likelihood(parts, double(0.0, 100.0)).tolist()
    # Of the hundredth beside each bound, which counts as clipped, the density is left out.
    assert inside + low + high == pytest.approx(1, abs=0.06 if min(scale) < 1 else 2e-3)


def test_places_with_their_bounds_make_up_one() -> None:
    parts = repeated(mixture([-20.0, 60.0], [1.0, 4.0], [0.3, -1.0]), 115_000)
    inner = torch.linspace(-57.489, 57.489, 115_000, dtype=torch.float64)
    at = [log_likelihood(parts.logits, clipped_terms(parts, x, low=-57.5, high=57.5)).exp() for x in (inner, -inner)]
    assert torch.equal(at[1], at[0].flip(0))
    ends = repeated(mixture([-20.0, 60.0], [1.0, 4.0], [0.3, -1.0]), 2)
    beyond = log_likelihood(ends.logits, clipped_terms(ends, double(-57.5, 57.5), low=-57.5, high=57.5)).exp()
    assert float(torch.trapezoid(at[0], inner) + beyond.sum()) == pytest.approx(1, abs=2e-3)


def test_the_middle_place_is_that_of_a_component() -> None:
    x, y = double(-40.0, -40.0, -10.0)[None], double(13.0, -13.0, 0.0)[None]
    chosen = [
        weighted_medoid_place(torch.log(double(*shares))[None], x, y)[0].tolist() for shares in ((5, 4, 1), (4, 5, 1))
    ]
    assert chosen == [[-40, 13], [-40, -13]]


def test_a_power_at_its_bound_is_all_beyond() -> None:
    parts = mixture([90.0], [5.0])
    above = 1 / (1 + math.exp(2.0))
    assert power_likelihood(parts, double(100.0, 99.995)).tolist() == pytest.approx([above, above])
    assert float(power_likelihood(parts, double(0.0))) == pytest.approx(1 / (1 + math.exp(18.0)))
    # The logistic density at its centre is a quarter over the scale.
    assert float(power_likelihood(parts, double(90.0))) == pytest.approx(1 / 20)


@pytest.mark.parametrize("factor", [None, 1.0, 1.05, 1.5, 2.0, 4.7, 12.0])
@pytest.mark.parametrize("scale", [[0.01, 0.3], [2.0, 0.05]])
@pytest.mark.parametrize("centre", [[0.0, 1.0], [3.1, -3.1], [-2.0, 3.14159]])
def test_angles_with_their_bounds_make_up_one(factor: float | None, scale: list[float], centre: list[float]) -> None:
    parts = mixture(centre, scale, [-0.5, 0.5])
    inner = torch.linspace(-179.989, 179.989, 100_001, dtype=torch.float64)
    total = float(torch.trapezoid(angle_likelihood(parts, inner, factor), inner))
    if factor is not None and factor > 1.02:
        total += float(angle_likelihood(parts, double(-180.0, 180.0), factor).sum())
    # 0.02 degrees beside the bounds are left out; a sharp component behind the player has much of itself there.
    assert total == pytest.approx(1, abs=0.02)


def test_hardly_moving_players_lose_little_behind() -> None:
    """Below a factor of 1.02 a clipped moment counts like any other: of a broad bell three hundredths are lost."""
    parts = mixture([math.pi], [1.0])
    inner = torch.linspace(-180.0, 180.0, 100_001, dtype=torch.float64)
    total = float(torch.trapezoid(angle_likelihood(parts, inner, 1.015), inner))
    assert 0.97 < total < 1


@pytest.mark.parametrize("factor", [1.2, 2.0, 3.5, 30.0])
def test_a_clipped_moment_is_all_that_is_wanted_beyond(factor: float) -> None:
    """Against the same bell by small steps, from the bound to straight behind."""
    parts = mixture([2.0], [0.4])
    angles = torch.linspace(math.pi / factor, math.pi, 50_001, dtype=torch.float64)
    density = angle_likelihood(parts, angles / DEGREE) / DEGREE
    beyond = float(torch.trapezoid(density, angles))
    left, right = angle_likelihood(parts, double(-180.0, 180.0), factor).tolist()
    assert right == pytest.approx(beyond, rel=1e-4)
    assert left < right


@given(
    centre=st.floats(-math.pi, math.pi),
    scale=st.floats(0.01, 3),
    degrees=st.floats(-179.9, 179.9),
    factor=st.sampled_from([1.0, 1.5, 6.0]),
)
@settings(max_examples=60)
def test_around_the_circle(centre: float, scale: float, degrees: float, factor: float) -> None:
    """Full turns of the centre change nothing, and left and right are alike, clipped or not."""

    def of(centre: float, degrees: float) -> float:
        parts = mixture([centre], [scale])
        return float(angle_terms(parts, double(degrees), factor=double(factor)))

    for value in (degrees, 180.0, -180.0):
        plain = of(centre, value)
        assert of(centre + 2 * math.pi, value) == pytest.approx(plain, abs=1e-6)
        assert of(centre - 4 * math.pi, value) == pytest.approx(plain, abs=1e-6)
        # At exactly half a turn from the centre the mirror image is the other end of the circle.
        assert of(-centre, -value) == pytest.approx(plain, abs=1e-6)
    assert of(0.0, 180.0) == pytest.approx(of(0.0, -180.0))


def test_wrap() -> None:
    angles = double(0, 3, -3, math.pi, -math.pi, 3.5, -3.5, 100.0)
    wrapped = wrap(angles)
    assert ((wrapped >= -math.pi) & (wrapped < math.pi)).all()
    assert torch.allclose(torch.cos(wrapped), torch.cos(angles))
    assert torch.allclose(torch.sin(wrapped), torch.sin(angles))
    assert wrapped[:3].tolist() == pytest.approx([0, 3, -3])


def test_both_sides_of_behind_are_close() -> None:
    parts = mixture([179 * DEGREE], [1 * DEGREE])
    near, far = angle_likelihood(parts, double(-179.0, 177.0)).tolist()
    assert near == pytest.approx(far)


@pytest.mark.parametrize("angle", [False, True])
def test_middle_has_the_least_expected_distance(angle: bool) -> None:
    generator = torch.Generator().manual_seed(0)
    logits = 2 * torch.randn(50, 7, generator=generator)
    centre = torch.randn(50, 7, generator=generator) * (2 if angle else 50)
    got = weighted_medoid(logits, centre, angle=angle)
    for row in range(50):
        shares = logits[row].softmax(0).tolist()
        centres = centre[row].tolist()

        def expected(place: float, shares: list[float] = shares, centres: list[float] = centres) -> float:
            away = [
                abs(math.remainder(other - place, 2 * math.pi)) if angle else abs(other - place) for other in centres
            ]
            return sum(share * distance for share, distance in zip(shares, away, strict=True))

        assert expected(float(got[row])) == pytest.approx(min(map(expected, centres)), rel=1e-5)


@given(
    weights=st.lists(st.floats(0.05, 1), min_size=1, max_size=7),
    data=st.data(),
)
@settings(max_examples=60)
def test_middle_of_powers_is_the_weighted_median(weights: list[float], data: st.DataObject) -> None:
    """As much lies below it as above, as far as components allow."""
    count = len(weights)
    centres = data.draw(st.lists(st.integers(0, 100), min_size=count, max_size=count))
    logits = torch.tensor([weights], dtype=torch.float64).log()
    got = float(weighted_medoid(logits, torch.tensor([centres], dtype=torch.float64), angle=False))
    below = sum(weight for weight, centre in zip(weights, centres, strict=True) if centre < got)
    above = sum(weight for weight, centre in zip(weights, centres, strict=True) if centre > got)
    assert max(below, above) <= sum(weights) / 2 + 1e-9


def test_middle_is_never_between_left_and_right() -> None:
    logits, centre = double(0.0, 0.0, 0.0)[None], double(-60, 60, 61)[None] * DEGREE
    assert float(weighted_medoid(logits, centre, angle=True)) / DEGREE == pytest.approx(60)
    # Across behind, -179 and 179 are neighbours.
    logits, centre = double(0.0, 0.0, 0.0)[None], double(-179, 179, 0)[None] * DEGREE
    assert abs(float(weighted_medoid(logits, centre, angle=True))) / DEGREE == pytest.approx(179)


def test_scales_are_bounded_and_about_typical_for_zero() -> None:
    raw = torch.tensor([0.0, -1e6, 1e6])
    usual, least, most = scale_of(raw, least=0.03, typical=3.0).tolist()
    # e^3 / (1 + e^3) of it, the logistic function of the distance to the bend.
    assert usual == pytest.approx(0.03 + 3 / (1 + math.exp(-3)))
    assert least == pytest.approx(0.03)
    assert most == pytest.approx(0.03 + 3 * math.exp(3))


def test_scales_grow_and_can_always_come_back() -> None:
    raw = torch.linspace(-12, 12, 200, dtype=torch.float64, requires_grad=True)
    scales = scale_of(raw, least=0.03, typical=3.0)
    (slope,) = torch.autograd.grad(scales.sum(), raw)
    assert (scales.diff() > 0).all()
    assert (slope > 0).all()


def test_halves_and_mirrors() -> None:
    parts = Mixture(*(torch.randn(6, 3) for _ in Mixture._fields))
    first, second = halves(parts)
    for whole, one, other in zip(parts, first, second, strict=True):
        assert torch.equal(whole, torch.cat([one, other]))
    turned = mirrored(first)
    assert torch.equal(turned.centre, -first.centre)
    assert turned.logits is first.logits
    assert turned.scale is first.scale
    for empty in halves(Mixture(*(part[:0] for part in parts))):
        assert [part.shape for part in empty] == [(0, 3)] * 3


def test_a_mirrored_mixture_takes_left_for_right() -> None:
    parts, degrees = mixture([0.4, -2.0], [0.2, 0.5], [0.3, -1.0]), double(-170.0, -23.0, 0.0, 90.0)
    assert angle_likelihood(mirrored(parts), degrees).tolist() == pytest.approx(
        angle_likelihood(parts, -degrees).tolist()
    )


def test_merged_mixtures_are_their_mean() -> None:
    one, other = mixture([20.0, 60.0], [3.0, 5.0], [4.0, 3.0]), mixture([70.0], [2.0], [-9.0])
    power = double(0.0, 20.0, 65.0, 100.0)
    mean = (power_likelihood(one, power) + power_likelihood(other, power)) / 2
    assert power_likelihood(merged([one, other]), power).tolist() == pytest.approx(mean.tolist())


@pytest.mark.parametrize("raw", [-1e4, 0.0, 1e4])
@pytest.mark.parametrize("centre", [-1e4, -3.2, 0.0, 3.14, 100.0, 1e4])
@pytest.mark.parametrize("logit", [0.0, 1e4])
def test_likelihoods_and_gradients_are_numbers_at_the_extremes(raw: float, centre: float, logit: float) -> None:
    logits = torch.tensor([[logit, 0.0]], requires_grad=True)
    centres = torch.tensor([[centre, 0.0]], requires_grad=True)
    scales = torch.tensor([[raw, 0.0]], requires_grad=True)
    for value in (0.0, 1e-3, 57.3, 99.999, 100.0):
        one = Mixture(logits, centres, scale_of(scales, least=LEAST_POWER, typical=3.0))
        loss = log_likelihood(one.logits, clipped_terms(one, torch.tensor([value]), low=0.0, high=100.0))
        gradients = torch.autograd.grad(loss.sum(), (logits, centres, scales))
        assert loss.isfinite().all()
        assert all(gradient.isfinite().all() for gradient in gradients)
    for value in (-180.0, -179.9, 0.0, 45.0, 180.0):
        for factor in (1.0, 1.0201, 3.0, 7.0):
            one = Mixture(logits, centres, scale_of(scales, least=LEAST_ANGLE, typical=2 * DEGREE))
            terms = angle_terms(one, torch.tensor([value]), factor=torch.tensor([factor]))
            loss = log_likelihood(one.logits, terms)
            gradients = torch.autograd.grad(loss.sum(), (logits, centres, scales))
            assert loss.isfinite().all()
            assert all(gradient.isfinite().all() for gradient in gradients)


def test_the_likeliest_mixture_is_found() -> None:
    """Gradients lead to the two powers and the atom at 100 that the samples have."""
    generator = torch.Generator().manual_seed(0)
    power = torch.cat([30 + torch.randn(300, generator=generator), torch.full((200,), 100.0)])
    raw = torch.tensor([[0.0, 35.0, 0.0], [0.0, 102.0, 0.0]], requires_grad=True)
    optimiser = torch.optim.Adam([raw], lr=0.2)
    for _ in range(300):
        parts = Mixture(raw[:, 0][None], raw[:, 1][None], scale_of(raw[:, 2][None], least=LEAST_POWER, typical=3.0))
        many = repeated(parts, len(power))
        loss = -log_likelihood(many.logits, clipped_terms(many, power, low=0.0, high=100.0)).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    found = Mixture(*(part.detach() for part in parts))
    assert found.logits.softmax(1)[0].tolist() == pytest.approx([0.6, 0.4], abs=0.01)
    assert float(found.centre[0, 0]) == pytest.approx(30, abs=0.3)
    assert float(power_likelihood(found, torch.tensor([100.0]))) == pytest.approx(0.4, abs=0.01)
