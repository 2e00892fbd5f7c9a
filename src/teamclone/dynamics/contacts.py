"""What happens where bodies meet: collisions (rcssserver `stadium.cpp`) and goal posts (`object.cpp`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.bodies import BALL, N_BODIES
from teamclone.rcss import pitch

BOUNCE = -0.1
"""A body that collided keeps this share of its velocity (rcssserver `object.h`)."""

_PASSES = 10
_TINY = 1e-10
"""The server puts bodies apart by this much more than their radii."""

_FIRST, _SECOND = (indices.astype(np.intp) for indices in np.triu_indices(N_BODIES, 1))
"""All pairs of bodies; the ball is always the second."""

_AT_ONCE = 256
"""Cycles whose pairs are looked at in one go: few enough to stay in the processor's cache."""


def overlapping(
    x: NDArray[np.float64], y: NDArray[np.float64], radius: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return which pairs of bodies overlap.

    Args:
        x, y, radius: (n, 23) metres; a radius of -inf for a body that meets nobody.

    Returns:
        (m,) the cycle of each, and the place of its pair in all pairs of bodies.
    """
    widest = 2.0 * max(radius.max(initial=0.0), 0.0)
    cycles, pairs = [], []
    for start in range(0, max(len(x), 1), _AT_ONCE):
        across = np.ascontiguousarray(x[start : start + _AT_ONCE].T)
        # Hardly any pair is near in x alone, so all else is computed of few.
        pair, cycle = np.nonzero(np.abs(across[_FIRST] - across[_SECOND]) < widest)
        cycle += start
        one, other = (cycle, _FIRST[pair]), (cycle, _SECOND[pair])
        dx, dy, reach = x[one] - x[other], y[one] - y[other], radius[one] + radius[other]
        overlap = (reach > 0) & (dx * dx + dy * dy < reach * reach)
        cycles.append(cycle[overlap])
        pairs.append(pair[overlap])
    return np.concatenate(cycles), np.concatenate(pairs)


def collide(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    radius: NDArray[np.float64],
    *,
    ball_stays: NDArray[np.bool_],
    rng: np.random.Generator | None = None,
) -> NDArray[np.bool_]:
    """Move bodies apart that overlap, in place, and return (n, 23) which have touched another.

    In each of ten passes every pair proposes places for its two bodies, and a body goes to the mean of all that are
    proposed for it (`stadium.cpp`, collisions).

    Args:
        x, y: (n, 23) metres, changed. radius: (n, 23), -inf for a body that meets nobody.
        ball_stays: (n,) outside play_on a player is moved from the ball, which stays.
        rng: draws the direction in which two bodies at the same place go apart; None for +x.
    """
    touched = np.zeros(x.shape, np.bool_)
    # Which cycles, then only these: hardly any has a collision.
    cycle, pair = overlapping(x, y, radius)
    rows = np.unique(cycle)
    cycle = np.searchsorted(rows, cycle)
    some_x, some_y, some_radius, stays = x[rows], y[rows], radius[rows], ball_stays[rows]
    for _ in range(_PASSES):
        if not len(cycle):
            break
        one, other = _FIRST[pair], _SECOND[pair]
        bodies = np.concatenate([cycle * N_BODIES + one, cycle * N_BODIES + other])
        proposals = _apart(some_x, some_y, some_radius, (cycle, one, other), stays, rng=rng)
        count = np.bincount(bodies, minlength=some_x.size)
        moved = count > 0
        for values, proposed in zip((some_x, some_y), proposals, strict=True):
            mean = np.bincount(bodies, weights=proposed, minlength=values.size)[moved] / count[moved]
            values.reshape(-1)[moved] = mean
        touched[rows] |= moved.reshape(some_x.shape)
        cycle, pair = overlapping(some_x, some_y, some_radius)
    x[rows], y[rows] = some_x, some_y
    return touched


def _apart(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    radius: NDArray[np.float64],
    pairs: tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]],
    ball_stays: NDArray[np.bool_],
    *,
    rng: np.random.Generator | None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (2 m,) x and y that m pairs propose, for all their first bodies and then for all their second ones.

    Args:
        pairs: (m,) cycle, first and second body of each.
    """
    cycle, one, other = pairs
    dx, dy = x[cycle, one] - x[cycle, other], y[cycle, one] - y[cycle, other]
    distance = np.hypot(dx, dy)
    same = distance < _TINY
    if same.any():
        angle = rng.uniform(-np.pi, np.pi, int(same.sum())) if rng is not None else np.zeros(int(same.sum()))
        dx[same], dy[same], distance[same] = np.cos(angle), np.sin(angle), 1.0
    reach = (radius[cycle, one] + radius[cycle, other]) / distance
    from_ball = (other == BALL) & ball_stays[cycle]
    proposed = []
    for values, off in ((x, dx), (y, dy)):
        first, second = values[cycle, one], values[cycle, other]
        middle, step = (first + second) / 2, off * (reach / 2 + _TINY / distance)
        proposed.append(
            np.concatenate(
                [np.where(from_ball, second + off * reach, middle + step), np.where(from_ball, second, middle - step)]
            )
        )
    return proposed[0], proposed[1]


_POST_X, _POST_Y = pitch.HALF_LENGTH - pitch.POST_RADIUS, pitch.GOAL_WIDTH / 2 + pitch.POST_RADIUS


def move_past_posts(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    vx: NDArray[np.float64],
    vy: NDArray[np.float64],
    radius: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return where bodies are after a move by their velocity, and which met a goal post; turn velocities in place.

    A body knows only the post of the quarter of the pitch in which it starts. It bounces off elastically and goes on
    with what is left of its way (`object.cpp`).

    Args:
        x, y, vx, vy, radius: (n, 23); all finite.
    """
    new_x, new_y, hit = x + vx, y + vy, np.zeros(x.shape, np.bool_)
    reach = radius + pitch.POST_RADIUS
    for place in zip(*np.nonzero(near_a_post(x, y, vx, vy, radius)), strict=True):
        # Few bodies come near a post, so each is followed by itself.
        post = np.copysign(_POST_X, x[place]), np.copysign(_POST_Y, y[place])
        at, velocity, hit[place] = _bounced((x[place], y[place]), (vx[place], vy[place]), post, reach[place])
        if hit[place]:
            (new_x[place], new_y[place]), (vx[place], vy[place]) = at, velocity
    return new_x, new_y, hit


def near_a_post(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    vx: NDArray[np.float64],
    vy: NDArray[np.float64],
    radius: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Return which bodies may meet a post on a way of one cycle: no other does. Arguments as of `move_past_posts`."""
    reach = radius + pitch.POST_RADIUS
    near: NDArray[np.bool_] = np.abs(np.abs(x) - _POST_X) < np.abs(vx) + reach
    near &= np.abs(np.abs(y) - _POST_Y) < np.abs(vy) + reach
    return near


def _bounced(
    start: tuple[float, float], velocity: tuple[float, float], post: tuple[float, float], reach: float
) -> tuple[tuple[float, float], tuple[float, float], bool]:
    """Return place and velocity after a move by ``velocity`` with bounces off a post, and whether there was one."""
    centre, at, left = complex(*post), complex(*start), complex(*velocity)
    speed, hit = abs(left), False
    if abs(at - centre) < reach and at != centre:
        outward = (at - centre) / abs(at - centre)
        at, left, hit = centre + reach * outward, _mirrored(left, outward), True
    for _ in range(_PASSES):
        off = at - centre
        toward = _dot(off, left)
        inside = toward**2 - abs(left) ** 2 * (abs(off) ** 2 - reach**2)
        if toward >= 0 or inside <= 0:
            break
        share = (-toward - inside**0.5) / abs(left) ** 2
        if share >= 1:
            break
        at += max(share, 0.0) * left
        left = _mirrored((1 - max(share, 0.0)) * left, (at - centre) / abs(at - centre))
        hit = True
    end = at + left
    heading = left / abs(left) if left else 0j
    return (end.real, end.imag), ((speed * heading).real, (speed * heading).imag), hit


def _dot(one: complex, other: complex) -> float:
    return one.real * other.real + one.imag * other.imag


def _mirrored(vector: complex, outward: complex) -> complex:
    return vector - 2 * _dot(vector, outward) * outward
