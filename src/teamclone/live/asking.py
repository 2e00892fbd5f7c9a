"""A clone is asked about the newest frame of a match, as both do that play it and that watch it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.clone import CompiledClone
from teamclone.engine.inputs.project import Frames
from teamclone.engine.network.spec import Floats
from teamclone.rcss.players import N_PLAYERS
from teamclone.world.view import FRAME_COLUMNS, PLAYER_COLUMNS, view_columns
from teamclone.world.world import World


def ask(
    clone: CompiledClone, world: World, actor: NDArray[np.int64], *, history: int
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the answers for players in the last frame of a world, see `CompiledClone.answers`.

    Args:
        actor: (n,) 0..10. history: how many frames before it the clone reads.
    """
    now = np.array([len(world) - 1])
    past, known = world.past(now, history)
    frames = Frames(
        ball=world.ball[now],
        players=world.players[now],
        types=world.types_of(now),
        server=world.server[None].astype(np.float32),
        past_ball=world.ball[past],
        past_players=world.players[past],
        past_known=known,
        mode=world.mode[now],
        mode_cycles=world.mode_cycles[now].astype(np.float32),
    )
    return clone.answers(frames, np.zeros(len(actor), np.int64), actor)


def load_kernels(clone: CompiledClone, *, history: int) -> Floats:
    """Load or compile what `ask` calls, which else happens in the first cycle.

    Returns:
        (1, N_OUT) an answer to a frame without anything.
    """
    frames = {name: np.zeros(1, np.int32) for name in FRAME_COLUMNS}
    players = {name: np.zeros((1, N_PLAYERS), np.int32) for name in PLAYER_COLUMNS}
    answers, _ = ask(clone, view_columns(frames, players, params={}, side=1), np.zeros(1, np.int64), history=history)
    return answers
