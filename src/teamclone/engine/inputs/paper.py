"""The inputs of the paper as a kernel: positions and velocities of the pitch, each divided by its bound.

`models.inputs.paper.PaperFeatures` says what they are; a test holds the two together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone import rcss
from teamclone.engine import inputs
from teamclone.engine.inputs.blocks import projected
from teamclone.engine.inputs.project import Frames, as_arrays
from teamclone.rcss import pitch
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.system import compiling
from teamclone.system.compiling import cached_kernel, kernel, version_of
from teamclone.world import channels
from teamclone.world.channels import CHANNEL, TYPE_FIELD

BODY_LIMIT_DEG = 180.0
_X, _Y, _BODY, _VX, _VY = (CHANNEL[name] for name in ("x", "y", "body", "vx", "vy"))
_BALL_SPEED, _BALL_DECAY = SERVER_FIELD["ball_speed_max"], SERVER_FIELD["ball_decay"]
_SPEED, _DECAY = TYPE_FIELD["player_speed_max"], TYPE_FIELD["player_decay"]


def fields(own: tuple[str, ...], every: tuple[str, ...]) -> NDArray[np.int64]:
    """Return what `fill_paper` is told of the types: how many parameters of the actor, which, and so of all players."""
    return np.array([len(own), *(TYPE_FIELD[name] for name in own), *(TYPE_FIELD[name] for name in every)], np.int64)


@kernel
def fill_paper(frames: Frames, index: int, actor: int, of_types: NDArray[np.int64], out: NDArray[np.float32]) -> None:
    """Fill the inputs of an actor.

    Args:
        index: of the frame. of_types: see `fields`. out: (inputs,).
    """
    ball, players, types, server = frames.ball[index], frames.players[index], frames.types[index], frames.server[index]
    fastest = server[_BALL_SPEED] * server[_BALL_DECAY]
    out[0], out[1] = ball[0] / pitch.MAX_X, ball[1] / pitch.MAX_Y
    out[2], out[3] = ball[2] / fastest, ball[3] / fastest
    own = 4 + 5 * N_PLAYERS
    for player in range(N_PLAYERS):
        now, at = players[player], 4 + player
        speed = types[player, _SPEED] * types[player, _DECAY]
        out[at] = now[_X] / pitch.MAX_X
        out[at + N_PLAYERS] = now[_Y] / pitch.MAX_Y
        out[at + 2 * N_PLAYERS] = now[_BODY] / BODY_LIMIT_DEG
        out[at + 3 * N_PLAYERS] = now[_VX] / speed
        out[at + 4 * N_PLAYERS] = now[_VY] / speed
    for part in range(5):
        out[own + part] = out[4 + part * N_PLAYERS + actor]
    at, count = own + 5, of_types[0]
    for place in range(1, 1 + count):
        out[at] = projected(types[actor], of_types[place])
        at += 1
    for place in range(1 + count, len(of_types)):
        for player in range(N_PLAYERS):
            out[at] = projected(types[player], of_types[place])
            at += 1


def _compiled() -> Any:
    """Return a kernel that fills the inputs of many samples."""
    version = version_of(inputs, rcss, channels, compiling)

    @cached_kernel(nogil=True, error_model="numpy")
    def project_all(
        frames: Frames,
        frame: NDArray[np.int64],
        actor: NDArray[np.int64],
        of_types: NDArray[np.int64],
        out: NDArray[np.float32],
    ) -> int:
        for row in range(len(frame)):
            fill_paper(frames, frame[row], actor[row], of_types, out[row])
        return version

    return project_all


_project_all = _compiled()


def project_paper(
    frames: Frames, frame: NDArray[np.int64], actor: NDArray[np.int64], of_types: Sequence[int], columns: int
) -> NDArray[np.float32]:
    """Return (n, columns) inputs of samples, before normalisation.

    Args:
        frames: the frames. frame: (n,) of each sample. actor: (n,) 0..10. of_types: see `fields`.
    """
    out = np.empty((len(frame), columns), np.float32)
    _project_all(as_arrays(frames), frame, actor, np.array(of_types, np.int64), out)
    return out
