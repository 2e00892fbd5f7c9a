"""Target points: what the places that a player may be making for mean for its dashes and turns."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.inputs.layout import GEOMETRY
from teamclone.engine.network.constants import PLACE_X, PLACE_Y, TARGET_COLUMNS, TURN_DEG
from teamclone.engine.network.layers import clamp
from teamclone.engine.network.spec import Floats
from teamclone.system.compiling import kernel

(_COAST_X, _COAST_Y, _COS, _SIN, _LINE, _NEAR, _FORWARD, _DECAY, _GAIN) = (
    GEOMETRY.index(name)
    for name in ("coast_x", "coast_y", "cos", "sin", "line_x", "near_m", "forward", "decay", "dash_gain")
)

BEARING, DASH_POWER = range(2)
"""What places mean, see `fill_targets`."""


@kernel
def fill_targets(places: Floats, geometry: Floats, columns: Floats, aims: NDArray[np.float32]) -> None:
    """Fill the inputs of the places, and the bearing and dash power to each.

    Args:
        places: (2 * count,) x and y of each, in PLACE_X and PLACE_Y; the first half of them stays a metre behind the
            offside line.
        geometry: (len(GEOMETRY),). columns: (count * TARGET_COLUMNS,).
        aims: (2, count) BEARING: radians from the body to the place, from where the player comes to rest. DASH_POWER:
            of a dash after which the player rolls as far as from there to the place. It counts the present velocity
            twice, but agents of the league compute it so.
    """
    count = aims.shape[1]
    x, y, cos, sin = float(geometry[_COAST_X]), float(geometry[_COAST_Y]), float(geometry[_COS]), float(geometry[_SIN])
    line, near, forward = float(geometry[_LINE]) - 1.0, float(geometry[_NEAR]), float(geometry[_FORWARD])
    decay, gain = float(geometry[_DECAY]), max(float(geometry[_GAIN]), 1e-4)
    for index in range(count):
        to_x, to_y = PLACE_X * float(places[2 * index]), PLACE_Y * float(places[2 * index + 1]) - y
        if index < count // 2:
            to_x = min(to_x, line)
        to_x -= x
        ahead, aside = to_x * cos + to_y * sin, to_y * cos - to_x * sin
        distance = math.sqrt(ahead * ahead + aside * aside + 1e-4)
        angle = math.atan2(aside, ahead + 1e-6)
        degrees = angle * (180 / math.pi)
        wanted = (ahead * (1 - decay) - forward) / gain
        aims[BEARING, index], aims[DASH_POWER, index] = angle, wanted
        of = columns[index * TARGET_COLUMNS : (index + 1) * TARGET_COLUMNS]
        of[0], of[1] = ahead / 20, aside / 20
        of[2] = math.log(distance + 0.1)
        of[3], of[4] = ahead / distance, aside / distance
        of[5] = clamp((abs(degrees) - TURN_DEG) / 10, -1.0, 1.0)
        of[6] = clamp(degrees / 10, -1.0, 1.0)
        # Whether a straight run passes within ``near`` of the place, and whether the player is there.
        of[7] = clamp(abs(aside) - near, -1.0, 1.0)
        of[8] = clamp(distance - near, -2.0, 2.0) / 2
        of[9] = clamp(wanted / 100, -0.5, 1.5)
