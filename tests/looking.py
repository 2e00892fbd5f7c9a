"""Players that look at something: a recorded match, and situations that are made."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from teamclone.logs.match import Columns
from teamclone.rcss import state_bits
from teamclone.rcss.players import N_PLAYERS

DATA = Path(__file__).parent / "data" / "percepts"


def situation(n: int = 1, **of_player: float) -> tuple[Columns, Columns]:
    """Return columns of frames in which player 0 stands in the middle and looks ahead; all others are far behind it."""
    players = {name: np.zeros((n, N_PLAYERS), np.float32) for name in ("vx", "vy", "body", "neck", "focus_direction")}
    players |= {
        "state": np.full((n, N_PLAYERS), state_bits.STAND, np.uint32),
        "x": np.full((n, N_PLAYERS), -50, np.float32),
        "y": np.tile(np.arange(N_PLAYERS, dtype=np.float32), (n, 1)),
        "view_width": np.full((n, N_PLAYERS), 60, np.float32),
        "focus_distance": np.zeros((n, N_PLAYERS), np.float32),
    }
    players["x"][:, 0] = players["y"][:, 0] = 0
    for name, value in of_player.items():
        players[name][:, 0] = value
    frames = {name: np.zeros(n, np.float32) for name in ("ball_x", "ball_y", "ball_vx", "ball_vy")}
    return {**frames, "cycle": np.arange(1, n + 1, dtype=np.int32), "stoppage": np.zeros(n, np.int32)}, players
