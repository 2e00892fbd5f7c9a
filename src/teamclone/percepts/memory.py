"""What each player of a match believes of others and ball: what it last saw, moved on by the server's rules."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone import rcss
from teamclone.logs.match import Columns
from teamclone.percepts import sight, vision
from teamclone.percepts.sight import BALL, BODY, HIDDEN, N_OBJECTS, SEEN, SIGHT, VX, VY, Sight, X, Y, objects_of
from teamclone.percepts.vision import detail_chance
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.server_params import number
from teamclone.system import compiling
from teamclone.system.compiling import cached_kernel, kernel, version_of

Array = NDArray[np.float64]

MAX_AGE = 254
"""Cycles; also of what was never seen."""
_BELIEF = slice(X, BODY + 1)
"""Columns of `sight.objects_of` that are believed of an object."""
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
    objects = objects_of(frames, players)
    n = len(objects)
    decays = np.concatenate([decay, np.full((n, 1), number(params, "ball_decay"))], axis=1)
    shape = (n, N_PLAYERS, N_OBJECTS)
    made = Memory(
        place=np.empty((*shape, 2), np.float32),
        velocity=np.empty((*shape, 2), np.float32),
        body=np.empty((n, N_PLAYERS, N_PLAYERS), np.float32),
        age=np.empty(shape, np.uint8),
    )
    _remember(objects, decays, seen, made)
    return made


@kernel
def _move_on(belief: Array, decay: float) -> None:
    """Move a belief on by a cycle."""
    belief[X], belief[Y] = belief[X] + belief[VX], belief[Y] + belief[VY]
    belief[VX], belief[VY] = belief[VX] * decay, belief[VY] * decay


@kernel
def _look(belief: Array, me: Array, there: tuple[float, float], told: Array, share: float) -> None:
    """Take over what is seen.

    Args:
        me: the player who sees. there: distance as shown, and direction on the pitch, radians.
        told: changes of distance and direction, NaN where they are not told.
        share: where they are not, of the way between the places believed and seen what is added to the velocity.
    """
    shown, cos, sin = there[0], math.cos(there[1]), math.sin(there[1])
    x, y = me[X] + shown * cos, me[Y] + shown * sin
    if not math.isnan(told[0]) and detail_chance(shown) >= _LIKELY:
        away, aside = told[0], math.radians(told[1]) * shown
        belief[VX] = me[VX] + away * cos - aside * sin
        belief[VY] = me[VY] + away * sin + aside * cos
    else:
        belief[VX] += (x - belief[X]) * share
        belief[VY] += (y - belief[Y]) * share
    belief[X], belief[Y] = x, y


def _compiled() -> Any:
    """Return a kernel that fills in a memory."""
    version = version_of(sight, vision, rcss, compiling)

    @cached_kernel(nogil=True, error_model="numpy")
    def remember_all(objects: Array, decay: Array, seen: Sight, made: Memory) -> int:
        beliefs = np.zeros((N_PLAYERS, N_OBJECTS, BODY + 1))
        since = np.full((N_PLAYERS, N_OBJECTS), MAX_AGE)
        for frame in range(objects.shape[0]):
            now = objects[frame]
            for me in range(N_PLAYERS):
                for it in range(N_OBJECTS):
                    belief = beliefs[me, it]
                    if it == me or frame == 0:
                        belief[:] = now[it, _BELIEF]
                        since[me, it] = 0 if it == me else MAX_AGE
                    else:
                        _move_on(belief, decay[frame, it])
                        since[me, it] = min(since[me, it] + 1, MAX_AGE)
                    if seen.what[frame, me, it] != HIDDEN:
                        angle = now[me, SIGHT] + math.radians(seen.direction[frame, me, it])
                        share = decay[frame, it] / since[me, it] if it == BALL and since[me, it] <= _RECENT else 0.0
                        _look(belief, now[me], (seen.distance[frame, me, it], angle), seen.change[frame, me, it], share)
                        if seen.what[frame, me, it] == SEEN:
                            belief[BODY] = now[it, BODY]
                        since[me, it] = 0
                    made.place[frame, me, it, 0], made.place[frame, me, it, 1] = belief[X], belief[Y]
                    made.velocity[frame, me, it, 0], made.velocity[frame, me, it, 1] = belief[VX], belief[VY]
                    made.age[frame, me, it] = since[me, it]
                    if it != BALL:
                        made.body[frame, me, it] = belief[BODY]
        return version

    return remember_all


_remember = _compiled()
