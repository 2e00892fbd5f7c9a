"""The likelihood over an interval is the mean of the density, in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from teamclone.models import distributions, intervals
from teamclone.models.distributions import Mixture

N, COMPONENTS = 300, 5
GENERATOR = torch.Generator().manual_seed(1)
STEPS = torch.linspace(0, 1, 2001, dtype=torch.float64)


def uniform(low: float, high: float, *shape: int) -> Tensor:
    return low + (high - low) * torch.rand(shape, generator=GENERATOR, dtype=torch.float64)


POWERS = Mixture(uniform(-2, 2, N, COMPONENTS), uniform(-20, 120, N, COMPONENTS), uniform(0.5, 30, N, COMPONENTS))
ANGLES = Mixture(uniform(-2, 2, N, COMPONENTS), uniform(-3.1, 3.1, N, COMPONENTS), uniform(0.01, 2, N, COMPONENTS))
CLASSES = uniform(-40, 40, N, 24)
FACTOR = uniform(1.1, 4, N)


def mean_density(density: Callable[[Tensor], Tensor], span: Tensor) -> Tensor:
    first, last = span.unbind(1)
    values = torch.stack([density(first + (last - first) * step).exp() for step in STEPS])
    return torch.trapezoid(values, STEPS, dim=0)


def of(parts: Mixture, terms: Tensor) -> Tensor:
    return distributions.log_likelihood(parts.logits, terms)


def powers(value: Tensor) -> Tensor:
    return of(POWERS, distributions.clipped_terms(POWERS, value, low=0.0, high=100.0))


def powers_within(span: Tensor) -> Tensor:
    return of(POWERS, intervals.clipped_terms(POWERS, span, low=0.0, high=100.0))


def around(degrees: Tensor) -> Tensor:
    return (degrees + 180) % 360 - 180


def test_powers() -> None:
    first = uniform(1, 98, N)
    span = torch.stack([first, first + (99 - first) * uniform(0, 1, N)], 1)
    torch.testing.assert_close(powers_within(span).exp(), mean_density(powers, span), rtol=1e-3, atol=1e-9)


def test_all_clipped_powers_and_those_below() -> None:
    """Probabilities add up: of an interval up to the bound, and of the one below it."""
    middle = uniform(10, 90, N)
    lower = powers_within(torch.stack([torch.zeros(N), middle], 1)).exp() * middle
    upper = powers_within(torch.stack([middle, torch.full((N,), 100.0)], 1)).exp() * (100 - middle)
    torch.testing.assert_close(lower + upper, torch.ones(N, dtype=torch.float64), rtol=1e-4, atol=1e-4)


def test_angles_around_the_circle() -> None:
    first = uniform(-180, 180, N)
    span = torch.stack([first, first + uniform(1, 359, N)], 1)

    def density(degrees: Tensor) -> Tensor:
        return of(ANGLES, distributions.angle_terms(ANGLES, around(degrees)))

    found = of(ANGLES, intervals.angle_terms(ANGLES, span)).exp()
    torch.testing.assert_close(found, mean_density(density, span), rtol=2e-2, atol=1e-6)


def test_angles_that_are_clipped() -> None:
    """Probabilities add up: of both halves of what an argument may be."""
    middle = uniform(-150, 150, N)
    ends = torch.full((N,), 180.0, dtype=torch.float64)
    total = torch.zeros(N, dtype=torch.float64)
    for first, last in ((-ends, middle), (middle, ends)):
        terms = intervals.angle_terms(ANGLES, torch.stack([first, last], 1), factor=FACTOR)
        total += of(ANGLES, terms).exp() * (last - first)
    torch.testing.assert_close(total, torch.ones(N, dtype=torch.float64), rtol=1e-4, atol=1e-4)


def test_classes_of_directions() -> None:
    first = uniform(-180, 180, N)
    span = torch.stack([first, first + uniform(0.5, 359, N)], 1)

    def density(degrees: Tensor) -> Tensor:
        return distributions.log_class(CLASSES, around(degrees))

    found = intervals.log_class(CLASSES, span).exp()
    torch.testing.assert_close(found, mean_density(density, span), rtol=5e-2, atol=1e-5)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_an_exact_number_has_its_density(dtype: torch.dtype) -> None:
    powers, angles = (Mixture(*(part.to(dtype) for part in parts)) for parts in (POWERS, ANGLES))
    value = torch.cat([uniform(0.1, 99.9, N - 2), torch.tensor([0.0, 100.0])]).to(dtype)
    exact = torch.stack([value, value], 1)
    torch.testing.assert_close(
        intervals.clipped_terms(powers, exact, low=0.0, high=100.0),
        distributions.clipped_terms(powers, value, low=0.0, high=100.0),
        rtol=1e-3,
        atol=2e-3,
    )
    degrees = torch.cat([uniform(-179.9, 179.9, N - 2), torch.tensor([-180.0, 180.0])]).to(dtype)
    exact = torch.stack([degrees, degrees], 1)
    for factor in (None, FACTOR.to(dtype)):
        found = of(angles, intervals.angle_terms(angles, exact, factor=factor))
        torch.testing.assert_close(
            found, of(angles, distributions.angle_terms(angles, degrees, factor=factor)), rtol=1e-3, atol=5e-3
        )


def test_nothing_is_learned_where_nothing_is_known_and_gradients_are_finite() -> None:
    spans = torch.tensor([[-math.inf, math.inf], [20.0, 20.0], [0.0, 100.0], [-180.0, 180.0], [170.0, 200.0]])
    narrow = torch.full((5, 3), 0.001)
    centre = torch.tensor([-3.0, 0.0, 3.0]).expand(5, -1)
    parts = Mixture(*(part.clone().requires_grad_(True) for part in (narrow, centre, narrow)))
    logits = torch.randn(5, 24, requires_grad=True)
    likelihood = (
        of(parts, intervals.angle_terms(parts, spans))
        + of(parts, intervals.angle_terms(parts, spans, factor=torch.full((5,), 2.0)))
        + of(parts, intervals.clipped_terms(parts, spans, low=0.0, high=100.0))
        + intervals.log_class(logits, spans)
    )
    assert float(likelihood[0].detach()) == pytest.approx(0, abs=1e-6)
    likelihood.sum().backward()
    for values in (*parts, logits):
        assert values.grad is not None
        assert torch.isfinite(values.grad).all()
        assert values.grad[0].abs().max() < 1e-6
    assert parts.centre.grad is not None
    assert parts.centre.grad[1].abs().max() > 0
