"""Likelihoods of parameters that are known up to an interval, as those of recovered commands are.

Each is the mean of the density over the interval: of a narrow interval the density itself, of one that holds all
values a constant, from which nothing is learned. The probability of an interval under a logistic density has a closed
form, which here loses no digits in the tails.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor
from torch.nn import functional

from teamclone.engine.network.constants import DEGREE
from teamclone.models.distributions import CLIPPED, LEAST_MASS, Mixture, wrap

LEAST_WIDTH = 1e-3
"""Units and degrees, far below every scale: by so much intervals are taken as wider, so that none is without width."""
_FAR = 1e6
"""Beyond all values."""


def log_mass(low: Tensor, width: Tensor, scale: Tensor) -> Tensor:
    """Return the logarithm of the probability of ``low`` to ``low + width`` under a logistic density centred at 0.

    Either end may be infinite. ``width`` of 0 gives minus infinity.
    """
    low, width = low / scale, width / scale
    # F(b) - F(a) = F(b) F(-a) (1 - exp(a - b)) for the logistic distribution function F.
    return functional.logsigmoid(low + width) + functional.logsigmoid(-low) + torch.log(-torch.expm1(-width))


def clipped_terms(parts: Mixture, span: Tensor, *, low: float, high: float) -> Tensor:
    """Return (batch, components) the log-likelihood of a value in ``low``..``high`` under each component.

    Args:
        parts: of a parameter.
        span: (batch, 2) ends of the interval. One at a bound holds all values beyond, which the server clips.
    """
    first, width = _ends(span)
    last = first + width
    below, above = first <= low + CLIPPED, last >= high - CLIPPED
    # What is clipped has a probability, not a density.
    unit = torch.where(below | above, width.clamp(min=1.0), width)
    start = first.masked_fill(below, -_FAR)
    width = torch.where(below | above, last.masked_fill(above, _FAR) - start, width)
    terms = log_mass(start[:, None] - parts.centre, width[:, None], parts.scale) - torch.log(unit)[:, None]
    return torch.where(torch.isfinite(span).all(1)[:, None], terms, 0.0)


def angle_terms(parts: Mixture, span: Tensor, *, factor: Tensor | None = None) -> Tensor:
    """Return (batch, components) the log-likelihood of an angle under each component, wrapped around the circle.

    Args:
        parts: centres and scales in radians.
        span: (batch, 2) ends of the interval of the argument, degrees; they may lie beyond 180.
        factor: (batch,) arguments are the angle times this, clipped to 180 degrees; None for 1.
    """
    first, width = _ends(span)
    whole = torch.tanh(math.pi / (2 * parts.scale))  # of the bell within half a turn to each side
    unit = width
    if factor is not None:
        last, bounded = first + width, factor > 1.02
        below, above = (first <= -180.0 + CLIPPED) & bounded, (last >= 180.0 - CLIPPED) & bounded
        unit = torch.where(below | above, width.clamp(min=1.0), width)
        # Angles beyond the bound: up to straight behind.
        first = torch.where(below, -180.0, first / factor)
        width = torch.where(below | above, torch.where(above, 180.0, last / factor) - first, width / factor)
    length = (width * DEGREE).clamp(max=2 * math.pi)[:, None]
    low = wrap((first * DEGREE)[:, None] - parts.centre)
    over = (low + length - math.pi).clamp(min=0.0)
    inside = log_mass(low, (length - over).clamp(min=1e-9), parts.scale)
    around = log_mass(torch.full_like(low, -math.pi), over.clamp(min=1e-9), parts.scale)
    terms = torch.logaddexp(inside, around) - torch.log(whole) - torch.log(unit)[:, None]
    if factor is not None:  # as of numbers that are clipped for sure
        terms = torch.where((below | above)[:, None], terms.clamp(min=math.log(LEAST_MASS)), terms)
    return torch.where(torch.isfinite(span).all(1)[:, None], terms, 0.0)


def log_class(logits: Tensor, span: Tensor) -> Tensor:
    """Return (batch,) the log-likelihood of a direction, uniform within each of ``logits.shape[1]`` classes.

    Args:
        logits: (batch, classes), the first class straight ahead.
        span: (batch, 2) ends of the interval, degrees.
    """
    step = 360.0 / logits.shape[1]
    first, width = _ends(span)
    half = (width / 2).clamp(max=180.0)[:, None]
    classes = torch.arange(logits.shape[1], device=logits.device, dtype=logits.dtype) * step
    away = (((first + width / 2)[:, None] - classes + 180.0) % 360.0 - 180.0).abs()
    # Of the class to both sides of it, since a wide interval reaches around the circle.
    share = _overlap(away, half, step / 2) + _overlap(360.0 - away, half, step / 2)
    log_share = torch.log(share.clamp(min=1e-12)).masked_fill(share <= 0, -math.inf)
    likelihood = torch.logsumexp(torch.log_softmax(logits, 1) + log_share, 1)
    likelihood = likelihood - torch.log(step * width.clamp(max=360.0))
    return torch.where(torch.isfinite(span).all(1), likelihood, 0.0)


def _overlap(away: Tensor, one: Tensor, other: float) -> Tensor:
    """Return the length that two intervals share, of half lengths ``one`` and ``other``, centres ``away`` apart."""
    return (torch.minimum(one, away + other) - torch.maximum(-one, away - other)).clamp(min=0.0)


def _ends(span: Tensor) -> tuple[Tensor, Tensor]:
    """Return the first end and the width (batch,) of intervals; of an unknown number some finite ones."""
    first, last = torch.nan_to_num(span, posinf=90.0, neginf=-90.0).unbind(1)
    # The width apart, since the difference of two ends that are close has few digits.
    return first - LEAST_WIDTH / 2, (last - first).clamp(min=0.0) + LEAST_WIDTH
