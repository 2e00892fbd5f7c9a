"""Each formula of the server, once: elementwise over NumPy arrays, PyTorch tensors or plain numbers.

Lengths in metres, velocities in metres per cycle, angles in radians unless a name ends in ``_deg``. Parameters of the
server and of player types are arguments, so that a match is computed by its own. Sources name the files of rcssserver.

The planner's compiled kernels need scalar forms of some of these; `tests/unit/planner/test_formulas.py` holds the two
equal.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np

Value = Any
"""A NumPy array, a PyTorch tensor or a number; all arguments of one call broadcast against each other."""


def _of(*values: Value) -> Any:
    """Return the library that these values belong to: PyTorch if one is a tensor, else NumPy."""
    torch = sys.modules.get("torch")
    return torch if torch is not None and any(isinstance(value, torch.Tensor) for value in values) else np


def radians(degrees: Value) -> Value:
    """Return degrees in radians."""
    return degrees * (math.pi / 180.0)


def degrees(angle: Value) -> Value:
    """Return an angle in radians as degrees in [-180, 180)."""
    return wrap(angle) * (180.0 / math.pi)


def wrap(angle: Value) -> Value:
    """Return an angle in [-pi, pi)."""
    return _of(angle).remainder(angle + math.pi, 2 * math.pi) - math.pi


def off_angle(angle: Value) -> Value:
    """Return how far an angle is off straight ahead, in [0, pi]; the same to the bit for its opposite."""
    return abs(wrap(abs(angle)))


def roll(cycles: Value, decay: Value) -> Value:
    """Return the metres that a free body covers in so many cycles, per metre per cycle of its first velocity.

    ``object.cpp``: every cycle it moves by its velocity, which is then multiplied by ``decay``. Logs hold velocities
    after decay, so the first cycle is covered with the velocity as logged.
    """
    return (1.0 - decay**cycles) / (1.0 - decay)


def cycles_over(distance: Value, speed: Value, decay: Value, *, least: float = 0.0) -> Value:
    """Return the cycles in which a body of this speed covers a distance, the inverse of `roll`; not whole.

    Args:
        least: the share of the speed that is taken to be left where the distance is never covered; with 0 the answer
            is infinite or not a number there.
    """
    left = 1.0 - distance * (1.0 - decay) / speed
    xp = _of(left)
    if least:
        left = xp.clip(left, least, None)
    return xp.log(left) / (math.log(decay) if isinstance(decay, float) else _of(decay).log(decay))


def covered(cycles: Value, acceleration: Value, decay: Value) -> Value:
    """Return the metres from rest in so many dashes.

    Each adds ``acceleration`` to a velocity that then decays.
    """
    return acceleration / (1.0 - decay) * (cycles - decay * (1.0 - decay**cycles) / (1.0 - decay))


def kickable_area(player_size: Value, kickable_margin: Value, ball_size: Value) -> Value:
    """Return the metres between the centres of player and ball up to which the player can kick (``player.cpp``)."""
    return player_size + ball_size + kickable_margin


def ball_reach(player_size: Value, kickable_margin: Value, *, server: Any) -> Value:
    """Return the metres between the centres of player and ball beyond which the player can neither kick nor tackle it.

    Args:
        server: parameters of the server by name.
    """
    kick = kickable_area(player_size, kickable_margin, server["ball_size"])
    tackle = math.hypot(max(server["tackle_dist"], server["tackle_back_dist"]), server["tackle_width"])
    return _of(kick).maximum(kick, _like(kick, tackle))


def kick_rate(
    distance: Value,
    off_body: Value,
    *,
    kick_power_rate: Value,
    player_size: Value,
    kickable_margin: Value,
    ball_size: Value,
) -> Value:
    """Return the metres per cycle that a unit of kick power gives the ball (``player.cpp``, kick).

    Args:
        distance: between the centres of player and ball.
        off_body: angle between the body and the ball.
    """
    off = off_angle(off_body) / math.pi
    gap = distance - player_size - ball_size
    return kick_power_rate * (1.0 - 0.25 * off - 0.25 * gap / kickable_margin)


def kick_noise(
    power: Value,
    distance: Value,
    off_body: Value,
    ball_speed: Value,
    *,
    kick_rand: Value,
    player_size: Value,
    kickable_margin: Value,
    server: Any,
) -> Value:
    """Return the greatest metres per cycle by which the server's noise changes what a kick gives the ball.

    The formula is that of ``player.cpp``, kick. The noise has a random direction and a length uniform from 0 to this.

    Args:
        distance, off_body: see `kick_rate`.
        ball_speed: as logged.
        server: parameters of the server by name.
    """
    gap = distance - player_size - server["ball_size"]
    where = 0.5 + 0.25 * (off_angle(off_body) / math.pi + gap / kickable_margin)
    return kick_rand * abs(power) / server["maxpower"] * (where + _moving(ball_speed, server))


def tackle_noise(failure: Value, ball_speed: Value, *, kick_rand: Value, server: Any) -> Value:
    """Return the greatest metres per cycle by which the server's noise changes what a tackle gives the ball.

    The formula is that of ``player.cpp``, tackle, for clients from version 12; see `kick_noise`.

    Args:
        failure: the probability that it fails, see `tackle_failure`.
    """
    return kick_rand * server["tackle_rand_factor"] * (1.0 - 0.5 * failure + _moving(ball_speed, server))


def _moving(ball_speed: Value, server: Any) -> Value:
    """Return the part of a kick's noise that comes from the ball's speed: half at rest, all at the greatest speed."""
    return 0.5 + 0.5 * ball_speed / (server["ball_speed_max"] * server["ball_decay"])


def limited(x: Value, y: Value, most: Value) -> tuple[Value, Value]:
    """Return a vector with its length cut to ``most`` (``object.cpp``: accelerations and velocities)."""
    xp = _of(x, y, most)
    length = xp.hypot(x, y)
    factor = xp.where(length > most, most / xp.where(length > most, length, 1.0), 1.0)
    return x * factor, y * factor


def kicked(
    velocity: tuple[Value, Value],
    power: Value,
    direction: Value,
    rate: Value,
    *,
    ball_accel_max: Value,
    ball_speed_max: Value,
) -> tuple[Value, Value]:
    """Return the ball's velocity after a single kick, before it moves and decays, without noise.

    The formula is that of ``player.cpp``, kick.

    Args:
        velocity: of the ball before, as logged.
        power, direction: of the kick; the direction is that on the pitch: body plus argument.
        rate: see `kick_rate`.
    """
    xp = _of(direction)
    x, y = limited(rate * power * xp.cos(direction), rate * power * xp.sin(direction), ball_accel_max)
    return limited(velocity[0] + x, velocity[1] + y, ball_speed_max)


def fastest(
    velocity: tuple[Value, Value],
    toward: tuple[Value, Value],
    *,
    most_added: Value,
    ball_speed_max: Value,
) -> Value:
    """Greatest speed in a direction that one kick gives the ball, 0 if it cannot go there.

    The velocities that a kick can give fill a disc around the velocity before. The ray in the direction leaves it with
    the greatest speed.

    Args:
        velocity: of the ball before.
        toward: unit vector.
        most_added: by how much the kick changes the velocity at most.
    """
    middle = velocity[0] * toward[0] + velocity[1] * toward[1]
    off = velocity[1] * toward[0] - velocity[0] * toward[1]
    xp = _of(middle, most_added)
    half = xp.sqrt(xp.clip(most_added**2 - off**2, 0.0, None))
    meets = (abs(off) <= most_added) & (middle - half <= ball_speed_max)
    return xp.where(meets, xp.clip(middle + half, 0.0, ball_speed_max), 0.0)


def dash_angle(direction_deg: Value, *, server: Any) -> Value:
    """Return the direction of a dash in degrees as the server takes it: within its limits and in steps (``leg.cpp``).

    Args:
        server: parameters of the server by name.
    """
    xp, step = _of(direction_deg), server["dash_angle_step"]
    limited_deg = xp.clip(direction_deg, server["min_dash_angle"], server["max_dash_angle"])
    return xp.round(limited_deg / step) * step if step > 0 else limited_deg


def dash_rate(direction_deg: Value, *, side_dash_rate: Value, back_dash_rate: Value) -> Value:
    """Return the share of a dash's power that a direction leaves (``player.cpp``, dash).

    Args:
        direction_deg: off the body, 0..180 degrees.
    """
    ahead = side_dash_rate + (1.0 - side_dash_rate) * (1.0 - direction_deg / 90.0)
    behind = back_dash_rate - (back_dash_rate - side_dash_rate) * (1.0 - (direction_deg - 90.0) / 90.0)
    xp = _of(direction_deg)
    return xp.clip(xp.where(direction_deg <= 90.0, ahead, behind), 0.0, 1.0)


def leg_costs(left: Value, right: Value, available: Value) -> tuple[Value, Value]:
    """Return the stamina that each leg of a dash takes (``leg.cpp``).

    A leg takes half its power, backwards all of it. Where less is available the right leg gets more than its share,
    since the server divides by the left leg's cost after it was cut: a plain dash of an exhausted player turns it.

    Args:
        left, right: powers of the legs, 0 where one stands still; not both 0.
        available: stamina and extra stamina.
    """
    xp = _of(left, right)
    wanted_left, wanted_right = xp.where(left < 0, -left, 0.5 * left), xp.where(right < 0, -right, 0.5 * right)
    total = xp.minimum(wanted_left + wanted_right, available)
    cost_left = total * wanted_left / (wanted_left + wanted_right)
    return cost_left, total * wanted_right / (cost_left + wanted_right)


def dash_cost(power: Value) -> Value:
    """Return the stamina that a dash takes before version 19 of the server: twice its power backwards."""
    return _of(power).where(power < 0, -2.0 * power, power)


def turn(moment: Value, speed: Value, inertia_moment: Value) -> Value:
    """Return the angle by which a player turns, in the unit of ``moment`` (``player.cpp``, turn).

    Args:
        speed: of the player, as logged.
    """
    return moment / (1.0 + inertia_moment * speed)


def tackle_failure(
    forward: Value,
    aside: Value,
    *,
    tackle_dist: Value,
    tackle_back_dist: Value,
    tackle_width: Value,
    exponent: Value,
) -> Value:
    """Return the probability that a tackle fails, 1 and more where it cannot succeed (``player.cpp``, tackle).

    Args:
        forward, aside: metres to the ball along the body direction and across it.
        exponent: tackle_exponent, or foul_exponent where an opponent can kick the ball and a foul is meant.
    """
    xp = _of(forward)
    ahead = forward > 0
    reach = xp.where(ahead, tackle_dist, tackle_back_dist)
    # Nothing is reached behind the player where the distance is 0: always a failure.
    near = xp.where(reach > 0, (abs(forward) / xp.where(reach > 0, reach, 1.0)) ** exponent, 2.0)
    return near + (abs(aside) / tackle_width) ** exponent


def tackle_power(
    direction: Value,
    off_body: Value,
    *,
    max_tackle_power: Value,
    max_back_tackle_power: Value,
    tackle_power_rate: Value,
) -> Value:
    """Return the metres per cycle that a tackle adds to the ball's velocity.

    The formula is that of ``player.cpp``, tackle, for clients from version 12.

    Args:
        direction: argument of the tackle, from the body.
        off_body: angle between the body and the ball.
    """
    power = max_back_tackle_power + (max_tackle_power - max_back_tackle_power) * (1.0 - abs(direction) / math.pi)
    return power * tackle_power_rate * (1.0 - 0.5 * off_angle(off_body) / math.pi)


def catch_chance(forward: Value, aside: Value, stretch: Value, *, server: Any) -> Value:
    """Return the probability that a catch succeeds, NaN where it does not reach the ball (``player.cpp``, catch).

    Args:
        forward, aside: metres to the ball along the direction of the catch and across it.
        stretch: catchable_area_l_stretch of the goalkeeper's type.
        server: parameters of the server by name.
    """
    xp = _of(forward)
    spread = server["catchable_area_l"] * (stretch - 1.0)
    surely, most = server["catchable_area_l"] - spread, server["catchable_area_l"] + spread
    beyond = (forward - surely) / xp.where(most > surely, most - surely, 1.0)
    reached = (forward >= 0) & (forward <= most) & (abs(aside) <= 0.5 * server["catchable_area_w"])
    return xp.where(
        reached, server["catch_probability"] * xp.clip(1.0 - xp.where(forward > surely, beyond, 0.0), 0, 1), math.nan
    )


def rested(
    stamina: Value,
    effort: Value,
    recovery: Value,
    capacity: Value,
    *,
    server: Any,
    stamina_inc_max: Value,
    effort_min: Value,
    effort_max: Value,
) -> tuple[Value, Value, Value, Value]:
    """Return stamina, effort, recovery and capacity after the end of a cycle (``player.cpp``, updateStamina).

    Args:
        stamina: after the commands of the cycle.
        server: parameters of the server by name: anything with ``server["stamina_max"]``.
    """
    xp = _of(stamina, effort)
    most = server["stamina_max"]
    recovers_less = stamina <= server["recover_dec_thr"] * most
    recovery = xp.where(
        recovers_less, xp.maximum(recovery - server["recover_dec"], _like(recovery, server["recover_min"])), recovery
    )
    falls = stamina <= server["effort_dec_thr"] * most
    effort = xp.where(falls, xp.maximum(effort - server["effort_dec"], _like(effort, effort_min)), effort)
    rises = stamina >= server["effort_inc_thr"] * most
    effort = xp.where(rises, xp.minimum(effort + server["effort_inc"], _like(effort, effort_max)), effort)
    gain = xp.minimum(recovery * stamina_inc_max, most - stamina)
    limited_gain = xp.where(_like(gain, server["stamina_capacity"]) >= 0, xp.minimum(gain, capacity), gain)
    return stamina + limited_gain, effort, recovery, xp.clip(capacity - limited_gain, 0.0, None)


def _like(values: Value, number: Value) -> Value:
    """Return a number in the type of ``values``: PyTorch's minimum and maximum take tensors only."""
    xp = _of(values, number)
    return number if xp is np else xp.as_tensor(number, dtype=values.dtype, device=values.device)
