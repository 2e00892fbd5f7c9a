"""What each player of a match believes of others and ball: what it last saw, moved on by the server's rules."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.logs.match import Columns
from teamclone.percepts.sight import BALL, HIDDEN, N_OBJECTS, SEEN, Sight
from teamclone.percepts.vision import detail_chance
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.server_params import number
from teamclone.system.compiling import cached_kernel, kernel

Array = NDArray[np.float64]

MAX_AGE = 254
"""Cycles; also of what was never seen."""
_X, _Y, _VX, _VY, _FACES, _SIGHT = range(6)
"""Columns of the truth, but for the last of a belief, too."""
_RECENT = 3
"""Cycles over which the velocity of the ball follows from its places."""
_LIKELY = 0.5
"""Number and velocity are taken as told where they are as likely as this."""


class Memory(NamedTuple):
    """What every player believes in every frame, decided after the visual message of the frame.

    The object axis is that of `sight`: players in the order of the log, then the ball. A player knows itself.

    Attributes:
        place: (n_frames, 22, N_OBJECTS, 2) float32, metres, and velocity: metres per cycle.
        body: (n_frames, 22, 22) float32, degrees, as last seen.
        age: (n_frames, 22, N_OBJECTS) uint8, cycles since it was last seen, at most MAX_AGE.
    """

    place: NDArray[np.float32]
    velocity: NDArray[np.float32]
    body: NDArray[np.float32]
    age: NDArray[np.uint8]


def remember(
    frames: Columns, players: Columns, seen: Sight, *, decay: NDArray[Any], params: Mapping[str, float | str]
) -> Memory:
    """Return what the players of a match believe.

    Of what it saw a player keeps place and velocity as the messages told them, moves them on cycle by cycle without
    knowing of new dashes and kicks, and takes over what it sees anew. It knows its own place exactly, as teams nearly
    do from the landmarks. What players say to each other is not used: each team has its own language.

    Args:
        frames: `sight.FRAME_COLUMNS`, (n_frames,). players: `sight.PLAYER_COLUMNS`, (n_frames, 22).
        decay: (n_frames, 22) of each player's velocity. params: the server's parameters as the log lists them.
    """
    n = len(frames["ball_x"])
    truth = np.empty((n, N_OBJECTS, 6))
    for place, (name, ball) in enumerate((("x", "ball_x"), ("y", "ball_y"), ("vx", "ball_vx"), ("vy", "ball_vy"))):
        truth[:, :BALL, place], truth[:, BALL, place] = players[name], frames[ball]
    truth[:, :BALL, _FACES] = players["body"]
    truth[:, :BALL, _SIGHT] = np.radians(players["body"].astype(np.float64) + players["neck"])
    truth[:, BALL, _FACES:] = 0
    decays = np.concatenate([decay, np.full((n, 1), number(params, "ball_decay"))], axis=1)
    shape = (n, N_PLAYERS, N_OBJECTS)
    made = Memory(
        place=np.empty((*shape, 2), np.float32),
        velocity=np.empty((*shape, 2), np.float32),
        body=np.empty((n, N_PLAYERS, N_PLAYERS), np.float32),
        age=np.empty(shape, np.uint8),
    )
    _remember(truth, decays, seen, made)
    return made


@kernel
def _move_on(belief: Array, decay: float) -> None:
    """Move a belief on by a cycle."""
    belief[_X], belief[_Y] = belief[_X] + belief[_VX], belief[_Y] + belief[_VY]
    belief[_VX], belief[_VY] = belief[_VX] * decay, belief[_VY] * decay


@kernel
def _look(belief: Array, me: Array, there: tuple[float, float], told: Array, share: float) -> None:
    """Take over what is seen.

    Args:
        me: the player who sees. there: distance as shown, and direction on the pitch, radians.
        told: changes of distance and direction, NaN where they are not told.
        share: where they are not, of the way between the places believed and seen what is added to the velocity.
    """
    shown, cos, sin = there[0], math.cos(there[1]), math.sin(there[1])
    x, y = me[_X] + shown * cos, me[_Y] + shown * sin
    if not math.isnan(told[0]) and detail_chance(shown) >= _LIKELY:
        away, aside = told[0], math.radians(told[1]) * shown
        belief[_VX] = me[_VX] + away * cos - aside * sin
        belief[_VY] = me[_VY] + away * sin + aside * cos
    else:
        belief[_VX] += (x - belief[_X]) * share
        belief[_VY] += (y - belief[_Y]) * share
    belief[_X], belief[_Y] = x, y


@cached_kernel(nogil=True, error_model="numpy")
def _remember(truth: Array, decay: Array, seen: Sight, made: Memory) -> None:
    """Fill in a memory.

    Args:
        truth: (n_frames, N_OBJECTS, 6) x, y, vx, vy, body in degrees, line of sight in radians; the last two not of the
            ball.
        decay: (n_frames, N_OBJECTS) of velocities.
    """
    beliefs = np.zeros((N_PLAYERS, N_OBJECTS, _FACES + 1))
    since = np.full((N_PLAYERS, N_OBJECTS), MAX_AGE)
    for frame in range(truth.shape[0]):
        now = truth[frame]
        for me in range(N_PLAYERS):
            for it in range(N_OBJECTS):
                belief = beliefs[me, it]
                if it == me or frame == 0:
                    belief[:] = now[it, : _FACES + 1]
                    since[me, it] = 0 if it == me else MAX_AGE
                else:
                    _move_on(belief, decay[frame, it])
                    since[me, it] = min(since[me, it] + 1, MAX_AGE)
                if seen.what[frame, me, it] != HIDDEN:
                    angle = now[me, _SIGHT] + math.radians(seen.direction[frame, me, it])
                    share = decay[frame, it] / since[me, it] if it == BALL and since[me, it] <= _RECENT else 0.0
                    _look(belief, now[me], (seen.distance[frame, me, it], angle), seen.change[frame, me, it], share)
                    if seen.what[frame, me, it] == SEEN:
                        belief[_FACES] = now[it, _FACES]
                    since[me, it] = 0
                made.place[frame, me, it, 0], made.place[frame, me, it, 1] = belief[_X], belief[_Y]
                made.velocity[frame, me, it, 0], made.velocity[frame, me, it, 1] = belief[_VX], belief[_VY]
                made.age[frame, me, it] = since[me, it]
                if it != BALL:
                    made.body[frame, me, it] = belief[_FACES]
