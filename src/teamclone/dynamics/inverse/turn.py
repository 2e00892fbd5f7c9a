"""Turns of body and neck from what they did."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.dynamics.inverse.candidates import CONFIDENCE, OF_TWO_ROUNDINGS, Candidates, habits, starts
from teamclone.dynamics.inverse.observed import At, Observed
from teamclone.dynamics.logged import RESOLUTION as OF_VELOCITY
from teamclone.rcss.players import N_TEAM

RESOLUTION = 1e-3
"""Degrees by which text logs round directions."""

_TOO_FAR = 0.1
"""Degrees of a moment by which rounding of the speed makes no turn impossible."""
_SMALLEST = 0.01
"""Degrees: moments that are no whole number are taken to be spread evenly over the logarithms from here on."""


def turns(observed: Observed, at: At) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return (m,) moments in degrees, and the ends of their intervals, of the turns of some players.

    A moment near 180 degrees may have gone around: its interval then ends beyond 180. NaN and the whole range where the
    player turned more than it can, because a referee took its speed before.
    """
    before, server = observed.before, observed.rules.server
    turned = np.degrees(formulas.wrap(np.radians(before.body[at[0] + 1, at[1]] - before.body[at])))
    # To the left as to the right: all is worked out for moments above 0.
    side, size = np.where(turned < 0, -1.0, 1.0), np.abs(turned)
    per_degree = 1.0 / formulas.turn(1.0, np.hypot(before.vx[at], before.vy[at]), observed.of(at, "inertia_moment"))
    most = np.where(side < 0, -server["minmoment"], server["maxmoment"])
    other = np.where(side < 0, server["maxmoment"], -server["minmoment"])
    rand = server["player_rand"]
    rounded = OF_TWO_ROUNDINGS * (
        RESOLUTION * per_degree + 0.5 * OF_VELOCITY * size * observed.of(at, "inertia_moment")
    )
    low = np.minimum((size * per_degree - rounded) / (1.0 + CONFIDENCE * rand), most)
    high = np.minimum((size * per_degree + rounded) / (1.0 - CONFIDENCE * rand), most)
    around = (360.0 - size) * per_degree / (1.0 + CONFIDENCE * rand)
    high = np.where(around <= other, np.maximum(high, 360.0 - around), high)
    value = np.minimum(_likeliest(size * per_degree, at[1] // N_TEAM, rand=rand, most=most), most)
    ends = np.stack([side * low, side * high])
    possible = size * per_degree <= most * (1.0 + rand) + _TOO_FAR
    return (
        np.where(possible, side * value, np.nan),
        np.where(possible, ends.min(axis=0), server["minmoment"]),
        np.where(possible, ends.max(axis=0), server["maxmoment"]),
    )


def _likeliest(
    seen: NDArray[np.float64], team: NDArray[np.int64], *, rand: float, most: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (m,) the likeliest moments: a whole number where the team uses it often, else what was seen.

    Args:
        seen: (m,) degrees above 0 that a turn without noise would need.
    """
    limit = int(np.nanmax(most, initial=0.0))
    first = np.ceil(np.nan_to_num(seen) / (1.0 + rand)).astype(np.int64)
    last = np.minimum(np.floor(np.nan_to_num(seen) / max(1.0 - rand, 1e-9)), most).astype(np.int64)
    count = np.maximum(last - first + 1, 0) + 1
    start = starts(count)
    number = np.arange(start[-1]) + np.repeat(first - start[:-1], count)
    # The last candidate of each is that of all other moments.
    number[start[1:] - 1] = limit + 1
    likelihood = 1.0 / (2.0 * rand * np.maximum(number, 1.0)) if rand > 0 else np.zeros(len(number))
    spread = np.log((1.0 + limit) / _SMALLEST)
    likelihood[start[1:] - 1] = 1.0 / (spread * np.maximum(seen, _SMALLEST))
    candidates = Candidates(start=start, number=number, likelihood=likelihood)
    prior = habits(candidates, team, n_groups=2, n_values=limit + 2)
    chosen = candidates.likeliest(candidates.shares(prior[np.repeat(team, count), number]))
    return np.where(number[chosen] > limit, seen, number[chosen])


def neck_turns(observed: Observed, at: At) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return (m,) moments in degrees, and the ends of their intervals, of turns of the neck: as far as it turned.

    Where it came to its end the moment may have been greater.
    """
    before, server = observed.before, observed.rules.server
    after = before.neck[at[0] + 1, at[1]]
    value = after - before.neck[at]
    rounded = OF_TWO_ROUNDINGS * RESOLUTION
    low = np.where(after <= server["minneckang"] + RESOLUTION, server["minneckmoment"], value - rounded)
    high = np.where(after >= server["maxneckang"] - RESOLUTION, server["maxneckmoment"], value + rounded)
    return value, low, high
