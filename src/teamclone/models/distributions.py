"""Distributions of command parameters: mixtures of logistic components, cut off where the server cuts off.

A logistic component has heavier tails than a normal one, and its distribution function is a plain sigmoid. So the
probability of clipped values, all powers above 100 and turn moments beyond 180, has a closed form.
All densities are per unit of power or per degree of the command's argument.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional

from teamclone.engine.network.constants import DEGREE, MEDOID_COMPONENTS

LEAST_MASS = 1e-12
"""Below this the probability of all clipped angles counts no less."""
CLIPPED = 1e-2
"""An argument this close to its bound, in its unit, counts as clipped."""


class Mixture(NamedTuple):
    """Components of one parameter, (batch, components) each: logits of their shares, centres, scales."""

    logits: Tensor
    centre: Tensor
    scale: Tensor

    def select(self, rows: Tensor) -> Mixture:
        """Return the mixtures of some of the batch: indices or a mask."""
        return Mixture(*(part[rows] for part in self))


def scale_of(raw: Tensor, *, least: float, typical: float) -> Tensor:
    """Return a scale from an unbounded output: about ``typical`` for 0, at most some twenty times as much."""
    # Bent, not cut off: beyond a cut there is no gradient.
    return least + typical * torch.exp(3.0 - functional.softplus(3.0 - raw))


def wrap(angle: Tensor) -> Tensor:
    """Return angles in radians, any shape, in [-pi, pi)."""
    return torch.remainder(angle + math.pi, 2 * math.pi) - math.pi


def _log_bell(away: Tensor, scale: Tensor) -> Tensor:
    """Return the logarithm of the logistic density at a distance from its centre."""
    z = away / scale
    return -z - 2 * functional.softplus(-z) - torch.log(scale)


def _mass(low: Tensor, high: Tensor, scale: Tensor) -> Tensor:
    """Return the probability of ``low``..``high`` under a logistic density centred at 0.

    It is evaluated in the tail, where the difference of two sigmoids loses no digits.
    """
    flip = low + high > 0
    low, high = torch.where(flip, -high, low), torch.where(flip, -low, high)
    return torch.sigmoid(high / scale) - torch.sigmoid(low / scale)


def clipped_terms(parts: Mixture, value: Tensor, *, low: float, high: float) -> Tensor:
    """Return (batch, components) the log-likelihood of a value in ``low``..``high`` under each component.

    Args:
        value: (batch,). At a bound its likelihood is the probability of all values beyond.
    """
    away = value[:, None] - parts.centre
    inside = _log_bell(away, parts.scale)
    above = functional.logsigmoid(-(high - parts.centre) / parts.scale)
    below = functional.logsigmoid((low - parts.centre) / parts.scale)
    terms = torch.where(value[:, None] >= high - CLIPPED, above, inside)
    return torch.where(value[:, None] <= low + CLIPPED, below, terms)


def angle_terms(parts: Mixture, degrees: Tensor, *, factor: Tensor | None = None) -> Tensor:
    """Return (batch, components) the log-likelihood of an angle under each component, wrapped around the circle.

    Args:
        parts: centres and scales in radians.
        degrees: (batch,) the argument.
        factor: (batch,) arguments are the angle times this, clipped to 180 degrees; None for 1.
    """
    factor = torch.ones_like(degrees) if factor is None else factor
    whole = torch.tanh(math.pi / (2 * parts.scale))  # of the bell within half a turn to each side
    away = wrap((degrees / factor * DEGREE)[:, None] - parts.centre)
    inside = _log_bell(away, parts.scale) - torch.log(whole) + math.log(DEGREE) - torch.log(factor)[:, None]
    # Angles beyond the bound: an arc from it to straight behind, on the side of the argument.
    bound = (math.pi / factor).clamp(max=0.99 * math.pi)
    length = (math.pi - bound)[:, None]
    start = torch.where(degrees > 0, bound, -math.pi)[:, None]
    low = wrap(start - parts.centre)
    high = low + length
    over = (high - math.pi).clamp(min=0.0)
    mass = _mass(low, high - over, parts.scale) + _mass(torch.full_like(over, -math.pi), over - math.pi, parts.scale)
    beyond = torch.log((mass / whole).clamp(min=LEAST_MASS))
    clipped = (degrees.abs() >= 180.0 - CLIPPED) & (factor > 1.02)
    return torch.where(clipped[:, None], beyond, inside)


def log_likelihood(logits: Tensor, terms: Tensor) -> Tensor:
    """Return (batch,) the log-likelihood of the mixture, from those of its components."""
    return torch.logsumexp(torch.log_softmax(logits, 1) + terms, 1)


def halves(parts: Mixture) -> tuple[Mixture, Mixture]:
    """Return the mixtures of the first and of the second half of the batch."""
    # Not by chunk, which torch.export knows for one length of the batch only.
    n = parts.centre.shape[0] // 2
    return Mixture(*(part[:n] for part in parts)), Mixture(*(part[n:] for part in parts))


def mirrored(angles: Mixture) -> Mixture:
    """Return the mixture with left and right exchanged."""
    return angles._replace(centre=-angles.centre)


def concatenate(parts: Sequence[Mixture]) -> Mixture:
    """Concatenate the components of mixtures; their logits are on one scale and are not renormalised."""
    return Mixture(*(torch.cat(columns, 1) for columns in zip(*parts, strict=True)))


def merged(parts: Sequence[Mixture]) -> Mixture:
    """Return the mean of several mixtures: their components, each share divided by their number."""
    shares = [part._replace(logits=torch.log_softmax(part.logits, 1)) for part in parts]
    return concatenate(shares)


def weighted_medoid(logits: Tensor, centre: Tensor, *, angle: bool) -> Tensor:
    """Return (batch,) the centre with the least expected distance to all: the median among the components.

    A mean would lie between left and right, where no player kicks.
    """
    if centre.shape[1] > MEDOID_COMPONENTS:
        chosen = logits.topk(MEDOID_COMPONENTS, dim=1).indices
        logits, centre = logits.gather(1, chosen), centre.gather(1, chosen)
    # As far from one to the other as back, to the bit: the first of two that are equally near is taken.
    distance = (centre[:, :, None] - centre[:, None, :]).abs()
    if angle:
        distance = wrap(distance).abs()
    return centre.gather(1, _nearest_to_all(logits, distance)).squeeze(1)


def weighted_medoid_place(logits: Tensor, x: Tensor, y: Tensor) -> Tensor:
    """Return (batch, 2) the place with the least expected distance to all, see `weighted_medoid`."""
    apart = torch.hypot(x[:, :, None] - x[:, None, :], y[:, :, None] - y[:, None, :])
    place = _nearest_to_all(logits, apart)
    return torch.cat([x.gather(1, place), y.gather(1, place)], 1)


def _nearest_to_all(logits: Tensor, apart: Tensor) -> Tensor:
    """Return (batch, 1) the component with the least expected distance.

    ``apart`` is (batch, components, components).
    """
    return (apart * logits.softmax(1)[:, :, None]).sum(1).argmin(1, keepdim=True)


def mean_logits(logits: Sequence[Tensor]) -> Tensor:
    """Return (batch, classes) logarithms of the mean probabilities."""
    return torch.stack([torch.log_softmax(of, 1) for of in logits]).logsumexp(0) - math.log(len(logits))


def class_of(degrees: Tensor, count: int) -> Tensor:
    """Return (batch,) the nearest of ``count`` directions, the first of them straight ahead."""
    return torch.round(degrees * (count / 360.0)).long() % count


def log_class(logits: Tensor, degrees: Tensor) -> Tensor:
    """Return (batch,) the log-likelihood of a direction, uniform within its class."""
    count = logits.shape[1]
    chosen = torch.log_softmax(logits, 1).gather(1, class_of(degrees, count)[:, None]).squeeze(1)
    return chosen - math.log(360.0 / count)


def direction_of(logits: Tensor) -> Tensor:
    """Return (batch,) degrees of the most probable direction."""
    count = logits.shape[1]
    degrees = logits.argmax(1).to(logits.dtype) * (360.0 / count)
    return torch.where(degrees > 180.0, degrees - 360.0, degrees)


def draw_component(logits: Tensor, generator: torch.Generator | None) -> Tensor:
    """Return (batch, 1) a component of each mixture, drawn with the probabilities of ``logits`` (batch, components)."""
    # By the distribution function: several times as fast as torch.multinomial.
    cumulative = logits.softmax(1).cumsum(1)
    level = _uniform(cumulative[:, -1:], generator) * cumulative[:, -1:]
    return (cumulative <= level).sum(1, keepdim=True)


def draw_value(
    parts: Mixture, component: Tensor, generator: torch.Generator | None, *, low: float, high: float
) -> Tensor:
    """Return (batch,) values of the components (batch, 1), clipped to ``low``..``high`` as in `clipped_terms`."""
    centre, scale = parts.centre.gather(1, component), parts.scale.gather(1, component)
    uniform = _uniform(centre, generator)
    return (centre + scale * torch.logit(uniform)).squeeze(1).clamp(low, high)


def draw_angle(
    parts: Mixture, component: Tensor, generator: torch.Generator | None, *, factor: Tensor | None = None
) -> Tensor:
    """Return (batch,) degrees of the components (batch, 1), distributed as in `angle_terms`."""
    centre, scale = parts.centre.gather(1, component), parts.scale.gather(1, component)
    # A component ends half a turn to each side of its centre.
    ratio = torch.tanh(math.pi / (2 * scale)) * (2 * _uniform(centre, generator) - 1)
    angle = wrap(centre + 2 * scale * torch.atanh(ratio)).squeeze(1) / DEGREE
    return angle if factor is None else (angle * factor).clamp(-180.0, 180.0)


def draw_direction(logits: Tensor, generator: torch.Generator | None) -> Tensor:
    """Return (batch,) degrees of a class (batch, classes), even within the class as in `log_class`."""
    step = 360.0 / logits.shape[1]
    component = draw_component(logits, generator)
    degrees = (component + _uniform(component.to(logits.dtype), generator) - 0.5).squeeze(1) * step
    return torch.where(degrees > 180.0, degrees - 360.0, degrees)


def _uniform(like: Tensor, generator: torch.Generator | None) -> Tensor:
    """Return random numbers between 0 and 1, neither of them included, of the shape of ``like``."""
    values = torch.rand(like.shape, generator=generator, device=like.device, dtype=like.dtype)
    return values.clamp(1e-6, 1 - 1e-6)
