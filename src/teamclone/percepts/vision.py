"""What the server shows a player of one object in a visual message (rcssserver `visualsenderplayer.cpp`).

Scalar kernels. Metres, metres per cycle, radians unless a name says degrees.
"""

from __future__ import annotations

import math

from teamclone.system.compiling import kernel

VISIBLE_DISTANCE_M = 3.0
"""Objects up to here are shown wherever the player looks, outside of its view cone by place alone."""
FAR_M, TOO_FAR_M = 20.0, 40.0
"""Up to FAR_M a player is shown with number and velocity and the ball with velocity, from TOO_FAR_M without."""
DIRECTION_STEP_DEG = 1.0
DISTANCE_STEP_M = 0.1
CHANGE_STEP = 0.02
"""Of the change of distance, as a share of the distance."""
DIRECTION_CHANGE_STEP_DEG = 0.1
_NOT_ZERO = 1e-10


@kernel
def rounded(value: float, step: float) -> float:
    """Return a value in whole steps; halves go to the even one, as with C's ``rint``."""
    return step * float(round(value / step))


@kernel
def _grid(distance: float, step: float) -> float:
    """Return a distance whose logarithm is in whole steps."""
    return math.exp(rounded(math.log(distance + _NOT_ZERO), step))


@kernel
def shown_distance(distance: float, to_focus: float, step: float) -> float:
    """Return the distance that a client without ``gaussian_see`` is told.

    Its error is the mean of the errors that rounding gives to the distances from the player and from the focus point.

    Args:
        distance: from the player. to_focus: from its focus point, ``distance`` for clients before version 18.
        step: ``quantize_step``, of landmarks ``quantize_step_l``.
    """
    error = ((to_focus - _grid(to_focus, step)) + (distance - _grid(distance, step))) / 2.0
    return rounded(max(0.0, distance - error), DISTANCE_STEP_M)


@kernel
def in_cone(direction: float, view_width: float) -> bool:
    """Return whether a direction from the line of sight is within the view cone."""
    return abs(direction) < view_width / 2.0


@kernel
def detail_chance(distance_shown: float) -> float:
    """Return how likely number and velocity are shown, at a distance as shown; clients since version 18."""
    return min(max((TOO_FAR_M - distance_shown) / (TOO_FAR_M - FAR_M), 0.0), 1.0)


@kernel
def shown_direction(x: float, y: float, sight: float) -> float:
    """Return the direction, before rounding, of an object from the line of sight.

    Args:
        x, y: from the player to the object. sight: body and neck direction.
    """
    cos, sin = math.cos(sight), math.sin(sight)
    return math.atan2(y * cos - x * sin, x * cos + y * sin)


@kernel
def shown_change(
    there: tuple[float, float], motion: tuple[float, float], distance: float, shown: float
) -> tuple[float, float]:
    """Return change of distance and change of direction, degrees, as shown.

    Args:
        there: x, y from the player to the object. motion: vx, vy of the object less the player's.
        distance: from the player, more than 0. shown: the same as shown.
    """
    x, y = there[0] / distance, there[1] / distance
    away, aside = motion[0] * x + motion[1] * y, motion[1] * x - motion[0] * y
    turned = math.degrees(aside / distance)
    return shown * rounded(away / distance, CHANGE_STEP), rounded(turned, DIRECTION_CHANGE_STEP_DEG)
