"""Kicks and tackles from what they did to the ball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.dynamics.bodies import BALL
from teamclone.dynamics.inverse.candidates import CONFIDENCE, Candidates
from teamclone.dynamics.inverse.observed import At, Observed

_DRAWS = 192
"""Draws of the noise that stand for all."""
_OFTEN = 0.25
"""A limit of the server is taken to have cut a velocity where this share of the draws says so."""
_GRAIN = 0.05
"""Share of a tackle's noise that lies between its draws."""
_ENDS = (0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2)


def _draws(n: int, dimensions: int) -> NDArray[np.float64]:
    """Return (n, dimensions) points that fill the unit cube evenly: multiples of powers of the golden ratio's kin."""
    root = 2.0
    for _ in range(30):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    return (0.5 + np.arange(1, n + 1)[:, None] * root ** -np.arange(1.0, dimensions + 1)) % 1.0


_POINTS = _draws(_DRAWS, 6)
_OF_PUSH, _OF_BALL = (_POINTS[:, place] * np.exp(2j * np.pi * _POINTS[:, place + 1]) for place in (0, 2))
"""(_DRAWS,) noises of lengths up to 1, uniform in length and direction."""
_OF_LOG = 2.0 * (_POINTS[:, 4] + 1j * _POINTS[:, 5]) - (1.0 + 1.0j)
"""(_DRAWS,) errors of rounding of up to 1 in each direction."""


class _Ball:
    """How the ball moved in some cycles: complex numbers, ahead of the player and to its right."""

    def __init__(self, observed: Observed, at: At) -> None:
        before = observed.before
        ball = at[0], np.full(len(at[0]), BALL)
        body = np.radians(before.body[at])
        away = (before.x[ball] - before.x[at]) + 1j * (before.y[ball] - before.y[at])
        ahead = np.exp(-1j * body)
        self.distance, self.off_body = np.abs(away), np.angle(away * ahead)
        self.before = (before.vx[ball] + 1j * before.vy[ball]) * ahead
        self.after = (observed.vx[ball] + 1j * observed.vy[ball]) * ahead
        self.blur = observed.blur[ball]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pushes:
    """Numbers of m kicks or tackles: power and direction, or a direction alone.

    Attributes:
        value, low, high: (m, 1 or 2). NaN and the whole circle where no tackle explains how the ball moved.
        bounded: (m,) bool, the server cut what the ball gained, or its speed: the power is only bounded below.
    """

    value: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    bounded: NDArray[np.bool_]


def kicks(observed: Observed, at: At) -> Pushes:
    """Return the kicks of some players, each the only one to push the ball in a cycle that the log shows.

    A kick with a negative power is given as the one that does as much with a positive power.
    """
    server, ball = observed.rules.server, _Ball(observed, at)
    of_type = {name: observed.of(at, name) for name in ("player_size", "kickable_margin")}
    rate = formulas.kick_rate(
        ball.distance,
        ball.off_body,
        kick_power_rate=observed.of(at, "kick_power_rate"),
        ball_size=server["ball_size"],
        **of_type,
    )
    per_power = formulas.kick_noise(
        1.0,
        ball.distance,
        ball.off_body,
        np.abs(ball.before),
        kick_rand=observed.of(at, "kick_rand"),
        server=server,
        **of_type,
    )
    speed_max, accel_max = server["ball_speed_max"], server["ball_accel_max"]
    added = _limited(ball.after, speed_max) - ball.before
    power, direction = np.abs(added) / rate, np.degrees(np.angle(added))
    # What each draw of the noise leaves. The ball's noise is a share of its speed, the kick's one of its power.
    after = (ball.after[:, None] + ball.blur[:, None] * _OF_LOG) / (1.0 + server["ball_rand"] * _OF_BALL)
    gained = _limited(after, speed_max) - ball.before[:, None]
    given = gained / (1.0 + (per_power / rate)[:, None] * _OF_PUSH)
    cut = ((np.abs(after) > speed_max) | (np.abs(gained) > accel_max)).mean(axis=-1) >= _OFTEN
    least, most = np.quantile(np.abs(given) / rate[:, None], _ENDS, axis=-1)
    off = np.degrees(np.angle(given * np.exp(-1j * np.radians(direction))[:, None]))
    right, left = np.quantile(off, _ENDS, axis=-1)
    # Noise alone may have moved the ball.
    least = np.where(left - right > 180.0, 0.0, least)
    limit = server["maxpower"]
    return Pushes(
        value=np.stack([np.minimum(power, limit), direction], axis=-1),
        low=np.stack([np.minimum(least, limit), direction + right], axis=-1),
        high=np.stack([np.where(cut, limit, np.minimum(most, limit)), direction + left], axis=-1),
        bounded=cut,
    )


def tackles(observed: Observed, at: At) -> Pushes:
    """Return the tackles of some players, each a success and the only one to push the ball in a cycle that is shown."""
    server, ball = observed.rules.server, _Ball(observed, at)
    failure = formulas.tackle_failure(
        ball.distance * np.cos(ball.off_body),
        ball.distance * np.sin(ball.off_body),
        tackle_dist=server["tackle_dist"],
        tackle_back_dist=server["tackle_back_dist"],
        tackle_width=server["tackle_width"],
        exponent=server["tackle_exponent"],
    )
    noise = formulas.tackle_noise(failure, np.abs(ball.before), kick_rand=observed.of(at, "kick_rand"), server=server)
    degrees = np.arange(-180.0, 180.0)
    direction = np.radians(degrees)
    power = formulas.tackle_power(
        direction,
        ball.off_body[:, None],
        max_tackle_power=server["max_tackle_power"],
        max_back_tackle_power=server["max_back_tackle_power"],
        tackle_power_rate=server["tackle_power_rate"],
    )
    likelihood = np.zeros((len(failure), len(degrees)))
    for index in range(len(failure)):
        # All directions by all draws of the noise of the tackle: what is left is that of the ball.
        given = ball.before[index] + _limited(
            (power[index] * np.exp(1j * direction))[:, None] + noise[index] * _OF_PUSH, server["ball_accel_max"]
        )
        after = _limited(given, server["ball_speed_max"])
        most = server["ball_rand"] * np.abs(after) + ball.blur[index]
        left = np.abs(ball.after[index] - after)
        near = np.maximum(left, _GRAIN * noise[index] + ball.blur[index])
        likelihood[index] = np.where(left <= most + _GRAIN * noise[index], 1.0 / (near * most), 0.0).mean(axis=-1)
    return _directions(likelihood, degrees)


def _directions(likelihood: NDArray[np.float64], degrees: NDArray[np.float64]) -> Pushes:
    """Return the likeliest directions and their intervals.

    Args:
        likelihood: (m, n) of each of n directions. degrees: (n,) all around.
    """
    n = len(degrees)
    # Each row begins opposite to its likeliest direction.
    chosen = likelihood.argmax(axis=-1) if len(likelihood) else np.zeros(0, np.int64)
    number = (chosen[:, None] - n // 2 + np.arange(n)) % n
    candidates = Candidates(
        start=np.arange(len(likelihood) + 1) * n,
        number=number.reshape(-1),
        likelihood=np.take_along_axis(likelihood, number, axis=-1).reshape(-1),
    )
    ends = candidates.interval(candidates.shares())
    known = likelihood.sum(axis=-1) > 0
    value = np.where(known, degrees[chosen], np.nan)
    middle = candidates.start[:-1] + n // 2
    low, high = (value + (end - middle) * 360.0 / n for end in ends)
    return Pushes(
        value=value[:, None],
        low=np.where(known, low, -180.0)[:, None],
        high=np.where(known, high, 180.0)[:, None],
        bounded=np.zeros(len(value), np.bool_),
    )


def _limited(velocity: NDArray[np.complex128], most: float) -> NDArray[np.complex128]:
    """Return velocities of at most a speed."""
    x, y = formulas.limited(velocity.real, velocity.imag, most)
    limited: NDArray[np.complex128] = x + 1j * y
    return limited
