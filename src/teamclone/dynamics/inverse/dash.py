"""Dashes from what they did: power by the balance of stamina, direction by the change of velocity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.dynamics.inverse.candidates import CONFIDENCE, OF_TWO_ROUNDINGS, Candidates, habits, starts
from teamclone.dynamics.inverse.observed import At, Observed
from teamclone.dynamics.motion import slowness
from teamclone.rcss.players import N_TEAM

_ALONG, _ALONG_ONE_SIDED = 0.77, 0.61
"""Up to this share of the greatest noise reaches CONFIDENCE of its component in a direction: to both sides, to one."""
_MIDDLE = CONFIDENCE - 0.02
"""Share of the likelihood that holds CONFIDENCE of the directions.

Players mostly dash straight ahead, and there a dash is worth more than to both sides. Such a corner is nearer to what
is seen than the directions around it, and so lies in the middle more often.
"""
_WRITTEN = 1e-3
"""Powers to which clients and logs round what is left of the stamina."""
_AT_ONCE = 1500
"""Dashes that are looked at in one go: few enough to stay in the processor's cache."""
_TURNED = 2e-3
"""Degrees by which rounding does not turn a body."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Costs:
    """The stamina that m dashes took.

    Attributes:
        value, low, high: (m,) stamina. Where the log only bounds it ``value`` is NaN.
        least, most: (m,) bounds of what the dash was worth: the power that moved the player.
        short: (m,) bool, the dash took all that the player had.
    """

    value: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    least: NDArray[np.float64]
    most: NDArray[np.float64]
    short: NDArray[np.bool_]


def dash_costs(observed: Observed, at: At) -> Costs:
    """Return what dashes cost: the stamina before and what was recovered, less the stamina after (`player.cpp`).

    Where it is full afterwards, the capacity says what was recovered. A player that comes in for another begins anew,
    and the log says nothing of its dash.
    """
    before, server = observed.before, observed.rules.server
    after = at[0] + 1, at[1]
    stamina, left = before.stamina[at], before.stamina[after]
    capacity, capacity_left = before.capacity[at], before.capacity[after]
    limited = (server["stamina_capacity"] >= 0) & ~np.isnan(capacity)
    increase = before.recovery[after] * observed.of(at, "stamina_inc_max")
    gain = np.where(limited, np.minimum(increase, capacity), increase)
    full = left >= server["stamina_max"] - _step(left)
    by_capacity = full & limited & (capacity_left > 0)
    gain = np.where(by_capacity, capacity - capacity_left, gain)
    blur = np.where(by_capacity, _step(capacity), 0.5 * (_step(stamina) + _step(left)))
    cost = np.clip(stamina + gain - left, 0.0, None)
    anew = (before.recovery[after] > before.recovery[at]) | (capacity_left > capacity) | np.isnan(cost)
    bounded = full & ~by_capacity & ~anew
    short = (left - gain <= blur) & ~full & ~anew
    available = np.where(np.isnan(stamina), np.inf, stamina + observed.of(at, "extra_stamina") + _WRITTEN)
    most = max(-2.0 * server["min_dash_power"], server["max_dash_power"])
    high = np.select([anew, bounded, short], [np.inf, cost, available], cost + OF_TWO_ROUNDINGS * blur)
    low = np.select([anew | bounded, short], [0.0, np.minimum(cost, available)], cost - OF_TWO_ROUNDINGS * blur)
    unknown = anew | bounded | short
    return Costs(
        value=np.where(unknown, np.nan, np.select([cost > most - blur, cost < blur], [most, 0.0], cost)),
        low=np.clip(low, 0.0, most),
        high=np.clip(high, 0.0, most),
        least=np.clip(np.where(unknown, low, cost - blur), 0.0, most),
        most=np.clip(np.where(unknown, high, cost + blur), 0.0, most),
        short=short,
    )


def _step(value: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the steps in which a text log writes numbers, with six digits."""
    steps: NDArray[np.float64] = 10.0 ** (np.floor(np.log10(np.maximum(value, 1.0))) - 5.0)
    return steps


@dataclass(frozen=True, slots=True, kw_only=True)
class Dashes:
    """Powers and directions of m dashes.

    Attributes:
        value, low, high: (m, 2). A direction is NaN, and its interval the whole circle, where the log does not show
            the player's movement or no dash explains it.
        bounded: (m,) bool, the balance of stamina only bounds the power.
        turned: (m,) degrees by which the legs turned the body, 0 for a plain dash.
    """

    value: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    bounded: NDArray[np.bool_]
    turned: NDArray[np.float64]


def dashes(observed: Observed, at: At) -> Dashes:
    """Return the dashes of some players; of two legs the sum."""
    after = at[0] + 1, at[1]
    turned = formulas.degrees(np.radians(observed.before.body[after] - observed.before.body[at]))
    turned = np.where((np.abs(turned) > _TURNED) & observed.rules.legs, turned, 0.0)
    costs = _with_legs(dash_costs(observed, at), turned, observed.rules.server)
    legs = (turned != 0) & ~costs.short
    inverse = _Inverse(observed, at, costs)
    # The sum of two legs has any direction.
    inverse.blur += np.where(legs, inverse.per_cost * costs.high * np.radians(inverse.step) / 2.0, 0.0)
    candidates = inverse.candidates()
    team = at[1] // N_TEAM
    prior = habits(candidates, team, n_groups=2, n_values=len(inverse.push_x))
    chosen = candidates.likeliest(candidates.shares(prior[np.repeat(team, candidates.count), candidates.number]))
    number = candidates.number[chosen]
    sign = number // inverse.n
    shares = candidates.shares(candidates.number // inverse.n == np.repeat(sign, candidates.count))
    ends = candidates.interval(shares, middle=_MIDDLE)
    known = candidates.likelihood[chosen] > 0
    # Of both ways to name the direction straight back it is 180 degrees.
    steps = (number + (inverse.n - 1) // 2) % inverse.n - (inverse.n - 1) // 2
    direction = np.where(known, steps * inverse.step, np.nan)
    low, high = (direction + (end - chosen) * inverse.step for end in ends)
    pressed = (turned != 0) & costs.short
    ranges = _powers(inverse, costs, number)
    if pressed.any():
        ranges = [
            np.where(pressed, asked, values)
            for asked, values in zip(_asked(inverse, costs, number, turned), ranges, strict=True)
        ]
    power, least, most = ranges
    power, least, most = (values * inverse.signs[sign] for values in (power, least, most))
    return Dashes(
        value=np.stack([power, direction], axis=-1),
        low=np.stack([np.minimum(least, most), np.where(known, low, -180.0)], axis=-1),
        high=np.stack([np.maximum(least, most), np.where(known, high, 180.0)], axis=-1),
        bounded=np.isnan(costs.value),
        turned=np.where(legs, turned, 0.0),
    )


def _with_legs(costs: Costs, turned: NDArray[np.float64], server: Mapping[str, float]) -> Costs:
    """Return costs with what is known of dashes that turned the player by so many degrees.

    Two legs that differ turn it, and all that they take bounds what their sum is. So does a plain dash for which there
    was not enough left: its right leg then dashes harder than what it takes, see `formulas.leg_costs`.
    """
    legs, pressed = (turned != 0) & ~costs.short, (turned != 0) & costs.short
    asked = server["max_dash_power"]
    harder = np.maximum(costs.high * (0.5 + asked / (costs.high + asked)), costs.high)
    # Each leg may go where a dash is worth more than in the direction of both.
    of_both = costs.high / max(server["side_dash_rate"], 0.1)
    return replace(
        costs,
        value=np.where(legs, np.nan, costs.value),
        low=np.select([legs, pressed], [0.0, costs.high], costs.low),
        least=np.select([legs, pressed], [0.0, costs.high], costs.least),
        most=np.select([legs, pressed], [of_both, harder], costs.most),
    )


def _asked(
    inverse: _Inverse, costs: Costs, number: NDArray[np.int64], turned: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Return (m,) powers and ends of their intervals of plain dashes that turned tired players by so many degrees."""
    most, rand = inverse.server["max_dash_power"], CONFIDENCE * inverse.server["player_rand"]
    per_cost = np.maximum(np.abs(inverse.push_x[number]) * inverse.per_cost, 1e-9)
    cost, powers = costs.low, []
    for noise in (1.0, 1.0 + rand, 1.0 - rand):
        # Both legs take `cost`; by so much less than half of it does the left one dash than the right one.
        less = np.radians(np.abs(turned)) * inverse.size / per_cost / noise
        share = np.minimum(2.0 * less / np.maximum(cost, 1e-9), 0.999)
        powers.append(np.clip(cost * (1.0 + share) / (1.0 - share), np.minimum(cost, most), most))
    return powers


def _powers(inverse: _Inverse, costs: Costs, number: NDArray[np.int64]) -> list[NDArray[np.float64]]:
    """Return (m,) the likeliest power and the ends of its interval, by the change of velocity where stamina bounds it.

    Args:
        number: (m,) of the directions, see `_Inverse.candidates`.
    """
    x, y = inverse.push_x[number] * inverse.per_cost, inverse.push_y[number] * inverse.per_cost
    length = np.maximum(np.hypot(x, y), 1e-9)
    seen = (inverse.gained_x * x + inverse.gained_y * y) / length**2
    noise = inverse.server["player_rand"] * np.hypot(inverse.vx + inverse.gained_x, inverse.vy + inverse.gained_y)
    reach = (noise + inverse.blur) / length
    unseen = np.isnan(seen)
    low = np.where(unseen, costs.low, np.clip(seen - _ALONG * reach, costs.low, costs.high - 2.0 * _WRITTEN))
    high = np.where(unseen, costs.high, np.clip(seen + _ALONG_ONE_SIDED * reach, costs.low, costs.high))
    # Most players that tire out ask for all that they have.
    value = np.where(costs.short & (high == costs.high), costs.high, np.clip(seen, costs.low, costs.high))
    bounded = np.isnan(costs.value)
    return [
        np.where(bounded, value, costs.value),
        np.where(bounded, low, costs.low),
        np.where(bounded, high, costs.high),
    ]


class _Inverse:
    """Which dashes may have changed the velocities of m players: +x ahead of the player, +y to its right."""

    def __init__(self, observed: Observed, at: At, costs: Costs) -> None:
        before, rules = observed.before, observed.rules
        self.server, self.costs = rules.server, costs
        body = np.radians(before.body[at])
        x, y = np.cos(body), np.sin(body)
        vx, vy = before.vx[at], before.vy[at]
        gained_x, gained_y = observed.vx[at] - vx, observed.vy[at] - vy
        self.vx, self.vy = vx * x + vy * y, vy * x - vx * y
        self.gained_x, self.gained_y = gained_x * x + gained_y * y, gained_y * x - gained_x * y
        self.blur = observed.blur[at]
        slow = slowness(before, rules)[at]
        self.fastest = observed.of(at, "player_speed_max") * slow
        self.strongest = self.server["player_accel_max"] * slow
        self.size = observed.of(at, "player_size")
        self.per_cost = before.effort[at] * observed.of(at, "dash_power_rate") / slow
        step = self.server["dash_angle_step"]
        self.n = max(round(360.0 / step), 1) if step > 0 else 360
        self.step = 360.0 / self.n
        angle = np.radians(np.arange(self.n) * self.step)
        rate = formulas.dash_rate(
            np.degrees(formulas.off_angle(angle)),
            side_dash_rate=self.server["side_dash_rate"],
            back_dash_rate=self.server["back_dash_rate"],
        )
        # Backwards a dash costs twice its power.
        self.signs = np.array([1.0, -0.5] if self.server["min_dash_power"] < 0 else [1.0])
        self.most = np.array([self.server["max_dash_power"], -2.0 * self.server["min_dash_power"]])
        self.push_x = (self.signs[:, None] * rate * np.cos(angle)).reshape(-1)
        self.push_y = (self.signs[:, None] * rate * np.sin(angle)).reshape(-1)

    def candidates(self) -> Candidates:
        """Return the directions in which dashes may have gone, those with a negative power after the others.

        Numbers are steps from straight ahead, with a negative power after all of those with a positive one.
        """
        rand = self.server["player_rand"]
        speed = np.hypot(self.vx + self.gained_x, self.vy + self.gained_y)
        noise = rand / (1.0 - rand) * speed + 2.0 * self.blur
        known = ~np.isnan(noise)
        length = np.where(known, np.hypot(self.gained_x, self.gained_y), 1.0)
        ratio = np.where(known, noise, 0.0) / np.maximum(length, 1e-9)
        half = np.degrees(np.where(ratio < 1.0, np.arcsin(np.minimum(ratio, 1.0)), np.pi)) / self.step
        middle = np.where(known, np.degrees(np.arctan2(self.gained_y, self.gained_x)), 0.0)
        middle = (middle[:, None] + np.where(self.signs < 0, 180.0, 0.0)) / self.step
        first = np.floor(middle - half[:, None]).astype(np.int64).reshape(-1)
        count = np.where(known, np.minimum(np.ceil(2.0 * half).astype(np.int64) + 2, self.n), 1)
        count = np.repeat(count, len(self.signs))
        start = starts(count)
        number = (np.arange(start[-1]) + np.repeat(first - start[:-1], count)) % self.n
        number += np.repeat(np.arange(len(count)) % len(self.signs) * self.n, count)
        start = start[:: len(self.signs)]
        likelihood = [
            self._likelihood(number[start[begin] : start[min(begin + _AT_ONCE, len(start) - 1)]], begin, start)
            for begin in range(0, len(start) - 1, _AT_ONCE)
        ]
        return Candidates(start=start, number=number, likelihood=np.concatenate([*likelihood, np.zeros(0)]))

    def _likelihood(self, number: NDArray[np.int64], begin: int, start: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return how likely the noise is that candidates leave to the server: uniform in its length and direction.

        Args:
            number: the candidates of _AT_ONCE dashes from the dash ``begin``. start: see `Candidates`.
        """
        part = slice(begin, begin + _AT_ONCE)
        count = np.diff(start[begin : begin + _AT_ONCE + 1])

        def each(values: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.repeat(values[part], count)

        x, y = self.push_x[number], self.push_y[number]
        vx, vy, gained_x, gained_y, blur = map(each, (self.vx, self.vy, self.gained_x, self.gained_y, self.blur))
        seen = (gained_x * x + gained_y * y) / np.maximum(x * x + y * y, 1e-9)
        strength = np.clip(seen, each(self.costs.least * self.per_cost), each(self.costs.most * self.per_cost))
        x, y = formulas.limited(strength * x, strength * y, each(self.strongest))
        reached_x, reached_y = formulas.limited(
            vx + x, vy + y, np.where((x == 0) & (y == 0), np.inf, each(self.fastest))
        )
        noise = np.hypot(vx + gained_x - reached_x, vy + gained_y - reached_y)
        most = self.server["player_rand"] * np.hypot(reached_x, reached_y) + blur
        likelihood = np.where(noise <= most, 1.0 / (np.maximum(noise, blur) * most), 0.0)
        if len(self.signs) > 1:
            likelihood[each(self.costs.low) > self.most[number // self.n]] = 0.0
        return likelihood
