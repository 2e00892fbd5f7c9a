"""The ball: how it rolls, and what a kick does to it."""

from __future__ import annotations

import math
from typing import NamedTuple

from teamclone.planner.scene import (
    BALL,
    BALL_ACCEL_MAX,
    BALL_SPEED_MAX,
    KICK_RATE,
    MARGIN,
    MAX_POWER,
    ROLL,
    SERVER,
    TOUCH,
    VX,
    VY,
    Array,
    X,
    Y,
    kernel,
    roll,
    turned,
)

NEVER_CYCLES = 1000
"""Cycles to where the ball, or a player, does not come."""


class Path(NamedTuple):
    """How the ball leaves its place: speed in metres per cycle, and the unit vector of its direction."""

    speed: float
    cos: float
    sin: float


@kernel
def ball_after(scene: Array, path: Path, cycle: int) -> tuple[float, float]:
    """Return where the ball is after at most CYCLES on a path."""
    metres = path.speed * scene[BALL, ROLL + cycle]
    return scene[BALL, X] + path.cos * metres, scene[BALL, Y] + path.sin * metres


@kernel
def speed_over(metres: float, cycles: float, decay: float) -> float:
    """Return the speed with which a ball rolls so far in so many cycles."""
    return metres / roll(cycles, decay)


@kernel
def cycles_over(metres: float, speed: float, decay: float) -> int:
    """Return the whole cycles after which a ball has rolled so far; `dynamics.formulas.cycles_over`, rounded up."""
    left = 1.0 - metres * (1.0 - decay) / speed
    return NEVER_CYCLES if left <= 0 else math.ceil(math.log(left) / math.log(decay))


@kernel
def kick_rate(player: Array, metres: float, aside: float) -> float:
    """Return the speed that a unit of power gives a ball so far off; `dynamics.formulas.kick_rate`.

    Args:
        metres: from the player's centre to the ball's. aside: degrees between the body and the ball.
    """
    off = abs(turned(aside)) / 180.0
    return player[KICK_RATE] * (1.0 - 0.25 * off - 0.25 * (metres - player[TOUCH]) / player[MARGIN])


@kernel
def most_acceleration(server: Array, gain: float) -> float:
    """Return the metres per cycle by which one kick changes the ball's velocity at most."""
    return min(server[MAX_POWER] * gain, server[BALL_ACCEL_MAX])


@kernel
def fastest(limits: tuple[float, float], toward: tuple[float, float], velocity: tuple[float, float]) -> float:
    """Return the greatest speed in a direction that one kick gives a ball with this velocity; 0 if it cannot go there.

    Velocities after a kick fill a disc around the velocity before: the speed is that where the ray leaves the disc.

    Args:
        limits: by how much the kick changes the velocity at most, and the ball's speed at most. toward: unit vector.
    """
    radius, limit = limits
    middle = velocity[0] * toward[0] + velocity[1] * toward[1]
    off = velocity[1] * toward[0] - velocity[0] * toward[1]
    if abs(off) > radius:
        return 0.0
    half = math.sqrt(radius * radius - off * off)
    if middle - half > limit:
        return 0.0
    return max(0.0, min(middle + half, limit))


@kernel
def kick_limits(server: Array, gain: float) -> tuple[float, float]:
    """Return the limits of `fastest` where a unit of kick power gives the ball so much speed."""
    return most_acceleration(server, gain), server[BALL_SPEED_MAX]


@kernel
def fastest_from(scene: Array, cos: float, sin: float, gain: float) -> float:
    """Return `fastest` of the ball of a scene."""
    return fastest(kick_limits(scene[SERVER], gain), (cos, sin), (scene[BALL, VX], scene[BALL, VY]))
