"""Self-attention over the other players and the goal, as seen by the actor with the ball."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.inputs.layout import GEOMETRY, MATES, OTHER, OTHERS
from teamclone.engine.network.constants import (
    ATTENTION_HEADS,
    NEVER_CYCLES,
    PASS_SPEED,
    PLAYER_COLUMNS,
    RUN_SPEED,
)
from teamclone.engine.network.layers import Member, clamp, layer, layer_norm, softmax
from teamclone.engine.network.spec import (
    AFTER,
    ASK,
    ATTENTION,
    BEFORE,
    BETWEEN,
    HEARD,
    OTHER_IN,
    OTHER_OUT,
    SITUATION,
    THINK_IN,
    THINK_OUT,
    Floats,
)
from teamclone.rcss import pitch
from teamclone.system.compiling import kernel

PLACES = OTHERS + 1
"""The other players, then the goal: an even number."""
PADDED = PLACES + -PLACES % 8
"""As many numbers fill whole vectors of a processor."""
_X, _Y, _VX, _THERE = OTHER.index("x"), OTHER.index("y"), OTHER.index("vx"), OTHER.index("there")
_WIDTH = len(OTHER)
_BALL_X, _BALL_Y, _BALL_DECAY = (GEOMETRY.index(name) for name in ("ball_x", "ball_y", "ball_decay"))
_GOAL_X = pitch.HALF_LENGTH


@kernel
def fill_players(others: Floats, geometry: Floats, columns: NDArray[np.float32]) -> None:
    """Fill what is known of each place: the others, then the goal, as seen from the ball.

    Args:
        others: (OTHERS * len(OTHER),). geometry: (len(GEOMETRY),). columns: (PLACES, PLAYER_COLUMNS).
    """
    ball_x, ball_y = float(geometry[_BALL_X]), float(geometry[_BALL_Y])
    decay = float(geometry[_BALL_DECAY])
    for place in range(PLACES):
        of = columns[place]
        x, y, there = _GOAL_X, 0.0, 1.0
        for index in range(_VX, _WIDTH):
            of[3 + index] = 1.0 if index == _THERE else 0.0
        if place < OTHERS:
            first = place * _WIDTH
            x, y, there = float(others[first + _X]), float(others[first + _Y]), float(others[first + _THERE])
            for index in range(_VX, _WIDTH):
                of[3 + index] = others[first + index]
        x, y = (x - ball_x) * there, (y - ball_y) * there
        distance = math.sqrt(x * x + y * y + 0.01)
        of[0], of[1], of[2] = x / 20, y / 20, math.log(distance)
        of[3], of[4] = x / distance, y / distance
        of[11] = 1.0 if MATES <= place < OTHERS else 0.0
        of[12] = 1.0 if place == OTHERS else 0.0
        _fill_lane((x, y, distance), (ball_x, ball_y, decay), others, of[13:])


@kernel
def _fill_lane(way: tuple[float, float, float], ball: tuple[float, float, float], others: Floats, lane: Floats) -> None:
    """Fill how free a straight kick to a place is, four numbers.

    Radians between it and the nearest opponent before the place; cycles that the ball is there before the first of
    them, if all run at RUN_SPEED to where it passes them, in tens; metres from the place to the nearest opponent, in
    tens; metres to the place, in twenties.

    Args:
        way: from the ball to the place, and its length. ball: its place and decay.
    """
    x, y, distance = way
    ball_x, ball_y, decay = ball
    cos, sin = x / distance, y / distance
    angle, ahead, nearest = math.pi, NEVER_CYCLES, NEVER_CYCLES
    for opponent in range(MATES, OTHERS):
        first = opponent * _WIDTH
        if not others[first + _THERE] > 0:
            continue
        at_x, at_y = float(others[first + _X]) - ball_x, float(others[first + _Y]) - ball_y
        nearest = min(nearest, math.sqrt((x - at_x) * (x - at_x) + (y - at_y) * (y - at_y)))
        along, across = cos * at_x + sin * at_y, abs(cos * at_y - sin * at_x)
        if along > 0 and along < distance + 1:
            angle = min(angle, math.atan2(across, max(along, 0.1)))
            left = max(1.0 - along * (1.0 - decay) / PASS_SPEED, 0.02)
            run = max(across - 1.0, 0.0) / RUN_SPEED + 1
            ahead = min(ahead, run - math.log(left) / math.log(decay))
    lane[0], lane[1] = angle, clamp(ahead, -NEVER_CYCLES, NEVER_CYCLES) / 10
    lane[2], lane[3] = nearest / 10, distance / 20


@kernel
def _attend(asked: NDArray[np.float32], heard: NDArray[np.float32]) -> None:
    """Fill (PLACES, width) what each place hears of the others.

    Args:
        asked: (PLACES, 3 * width) queries, keys and values.
    """
    width = heard.shape[1]
    part = width // ATTENTION_HEADS
    factor = np.float32(part**-0.5)
    keys = np.zeros((part, PADDED), np.float32)
    weight, share = np.empty(PADDED, np.float32), np.empty(PLACES, np.float32)
    for head in range(ATTENTION_HEADS):
        first = head * part
        at_value = 2 * width + first
        for place in range(PLACES):
            for index in range(part):
                keys[index, place] = asked[place, width + first + index] * factor
        for place in range(PLACES):
            weight[:] = 0
            for index in range(part):
                wanted, key = asked[place, first + index], keys[index]
                for other in range(PADDED):
                    weight[other] += wanted * key[other]
            softmax(weight[:PLACES], 1.0, share)
            mine = heard[place, first : first + part]
            mine[:] = 0
            for other in range(0, PLACES, 2):  # in pairs, which halves the reads of ``mine``
                one, two = asked[other, at_value : at_value + part], asked[other + 1, at_value : at_value + part]
                of_one, of_two = share[other], share[other + 1]
                for index in range(part):
                    mine[index] += of_one * one[index] + of_two * two[index]


@kernel
def encode(of: Member, others: Floats, geometry: Floats, situation: Floats, each: NDArray[np.float32]) -> None:
    """Fill the embedding of each place.

    Args:
        others: (OTHERS * len(OTHER),). geometry: (len(GEOMETRY),). situation: features of the whole situation.
        each: (PLACES, ATTENTION).
    """
    spec = of.spec
    width = spec[ATTENTION]
    columns = np.empty((PLACES, PLAYER_COLUMNS), np.float32)
    fill_players(others, geometry, columns)
    everywhere, one, two = np.empty(width, np.float32), np.empty(2 * width, np.float32), np.empty(width, np.float32)
    asked, heard = np.empty((PLACES, 3 * width), np.float32), np.empty((PLACES, width), np.float32)
    layer(of, spec[SITUATION], situation, everywhere)
    for place in range(PLACES):
        mine = each[place]
        layer(of, spec[OTHER_IN], columns[place], one)
        layer(of, spec[OTHER_OUT], one, mine)
        for index in range(width):
            mine[index] += everywhere[index]
        layer_norm(of, spec[BEFORE], mine, two)
        layer(of, spec[ASK], two, asked[place])
    _attend(asked, heard)
    for place in range(PLACES):
        mine = each[place]
        layer(of, spec[HEARD], heard[place], two)
        for index in range(width):
            mine[index] += two[index]
        layer_norm(of, spec[BETWEEN], mine, two)
        layer(of, spec[THINK_IN], two, one)
        layer(of, spec[THINK_OUT], one, two)
        for index in range(width):
            mine[index] += two[index]
        layer_norm(of, spec[AFTER], mine, mine)
