"""The ball: how it rolls, and what a kick does to it."""

from __future__ import annotations

import math
from typing import NamedTuple

from teamclone.planner.scene import (
    ACTOR,
    BALL,
    BALL_ACCEL_MAX,
    BALL_DECAY,
    BALL_RAND,
    BALL_SPEED_MAX,
    BODY,
    GAIN,
    KICK_RAND,
    KICK_RATE,
    MARGIN,
    MAX_POWER,
    PLAYER_RAND,
    ROLL,
    SERVER,
    TOUCH,
    VX,
    VY,
    Array,
    X,
    Y,
    direction,
    gap,
    roll,
    turned,
)
from teamclone.system.compiling import kernel

NEVER_CYCLES = 1000
"""Cycles to where the ball, or a player, does not come."""


class Path(NamedTuple):
    """How the ball leaves its place: speed in metres per cycle, and the unit vector of its direction."""

    speed: float
    cos: float
    sin: float


@kernel
def path_along(speed: float, degrees: float) -> Path:
    """Return the path of a ball that leaves its place in a direction on the pitch."""
    angle = math.radians(degrees)
    return Path(speed, math.cos(angle), math.sin(angle))


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

    `dynamics.formulas.fastest`.

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


@kernel
def kick_noise(scene: Array) -> float:
    """Return the metres per cycle by which a kick at full power may miss (rcssserver `player.cpp`, kick)."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    x, y = ball[X] - me[X], ball[Y] - me[Y]
    off = abs(turned(direction(x, y) - me[BODY])) / 180.0
    far = (math.hypot(x, y) - me[TOUCH]) / me[MARGIN]
    fast = math.hypot(ball[VX], ball[VY]) / (server[BALL_SPEED_MAX] * server[BALL_DECAY])
    return me[KICK_RAND] * (1.0 + 0.25 * (off + far) + 0.5 * fast)


@kernel
def aim_error(scene: Array, noise: float, metres: float, added: float) -> float:
    """Return the metres by which the ball may be off where the actor wants it, seen from itself, in the next cycle.

    Args:
        noise: see `kick_noise`. metres: that the ball covers. added: metres per cycle by which the kick changes the
            ball's velocity, 0 for no kick.
    """
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    moves = math.hypot(me[VX], me[VY]) * server[PLAYER_RAND] + metres * server[BALL_RAND]
    return moves + noise * added / (ball[GAIN] * server[MAX_POWER])


@kernel
def kick_to(ball: Array, place: tuple[float, float]) -> tuple[float, float, float]:
    """Return the velocity that has the ball in a place in the next cycle, and by how much it differs from the present.

    All in metres per cycle.
    """
    vx, vy = place[0] - ball[X], place[1] - ball[Y]
    return vx, vy, gap(vx, vy, ball[VX], ball[VY])


@kernel
def limited(x: float, y: float, most: float) -> tuple[float, float]:
    """Return a vector with its length cut to ``most``; `dynamics.formulas.limited`."""
    length = math.hypot(x, y)
    part = most / length if length > most else 1.0
    return x * part, y * part
