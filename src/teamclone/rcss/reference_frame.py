"""The one frame of reference of a model: its team attacks +x.

The server logs both teams in one frame (origin at the centre spot, +x to the goal that the left team attacks,
+y downwards on a monitor, degrees from +x towards +y). For a team on the right side the scene is rotated by 180
degrees, which is its own inverse. Arguments of dash, turn, kick and tackle are relative to the body: they stay.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def rotate_point(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return positions in metres or velocities in metres per cycle seen from the other side.

    Any shape; its own inverse.
    """
    return -values


def rotate_angle(degrees: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return global directions in degrees seen from the other side, in [-180, 180).

    Any shape; its own inverse modulo 360.
    """
    return wrap_degrees(degrees + 180.0)


def wrap_degrees(degrees: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return directions in degrees, any shape, in [-180, 180)."""
    wrapped: NDArray[np.floating] = np.mod(degrees + 180.0, 360.0) - 180.0
    return wrapped
