"""From the columns of a match to the `World` of one of its teams."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.logs.align import executed_kind, follows
from teamclone.logs.columns import counter_name
from teamclone.logs.match import Columns, Match, default_player_types
from teamclone.rcss import server_params as server
from teamclone.rcss import state_bits
from teamclone.rcss.commands import BODY_KINDS
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import OTHER_SIDE
from teamclone.rcss.reference_frame import rotate_angle, rotate_point
from teamclone.world.channels import (
    CHANNEL,
    FLAG_CHARGED,
    FLAG_COLLIDED,
    FLAG_GOALIE,
    FLAG_ON_FIELD,
    FLAG_TACKLING,
    FLAG_YELLOW,
    MEASURED,
)
from teamclone.world.world import World

_BALL = ("ball_x", "ball_y", "ball_vx", "ball_vy")
FRAME_COLUMNS = ("cycle", "stoppage", "playmode", "left_score", "right_score", *_BALL)
PLAYER_COLUMNS = (
    "type",
    "state",
    "x",
    "y",
    *(channel.name for channel in MEASURED),
    *(counter_name(kind) for kind in BODY_KINDS),
)
"""Columns of a match's tables that a view needs."""

_FLAGS = (
    (FLAG_ON_FIELD, state_bits.STAND),
    (FLAG_GOALIE, state_bits.GOALIE),
    (FLAG_TACKLING, state_bits.TACKLES),
    (FLAG_CHARGED, state_bits.FOUL_CHARGED),
    (FLAG_COLLIDED, state_bits.BALL_COLLIDE | state_bits.PLAYER_COLLIDE | state_bits.POST_COLLIDE),
    (FLAG_YELLOW, state_bits.YELLOW_CARD),
)


def view(match: Match, *, side: int) -> World:
    """Return a match as the team on ``side``, 1 left or -1 right, sees it."""
    game = match.game
    return view_columns(game.frames, game.players, types=game.player_types, params=game.server_params, side=side)


def view_columns(
    frames: Columns,
    players: Columns,
    *,
    types: Columns | None = None,
    params: Mapping[str, float | str],
    side: int,
) -> World:
    """Return the columns of a match as the team on ``side`` sees them.

    Args:
        frames: FRAME_COLUMNS, (n_frames,). players: PLAYER_COLUMNS, (n_frames, 22).
        types: the columns of ``player_types.FIELDS``, (n_types,); None for the server's default type alone.
        params: the server's parameters as the log lists them; defaults where one is missing.
        side: 1 left or -1 right.
    """
    turned = side < 0
    types = default_player_types(1) if types is None else types
    axis = np.roll(np.arange(N_PLAYERS), N_TEAM) if turned else np.arange(N_PLAYERS)
    ball = np.stack([frames[name] for name in _BALL], axis=-1)
    made = np.empty((len(frames["cycle"]), N_PLAYERS, len(CHANNEL)), np.float32)
    for name in ("x", "y", "type", *(channel.name for channel in MEASURED)):
        made[..., CHANNEL[name]] = players[name][:, axis]
    if turned:
        ball = rotate_point(ball)
        for name in ("x", "y", "vx", "vy"):
            made[..., CHANNEL[name]] = rotate_point(made[..., CHANNEL[name]])
        made[..., CHANNEL["body"]] = rotate_angle(made[..., CHANNEL["body"]])
    # Adding zero turns the -0.0 of logs and of the rotation into 0.0.
    made[..., [CHANNEL["x"], CHANNEL["y"]]] += np.float32(0)
    state = players["state"][:, axis]
    made[..., CHANNEL["flags"]] = sum(
        (np.where((state & bits) != 0, flag, 0) for flag, bits in _FLAGS), np.zeros(state.shape, np.int64)
    )
    made[..., CHANNEL["age"]] = 0
    executed = executed_kind(frames, players)
    made[:1, :, CHANNEL["last_command"]] = 0
    made[1:, :, CHANNEL["last_command"]] = executed[:-1, axis]
    own, other = ("right_score", "left_score") if turned else ("left_score", "right_score")
    mode = frames["playmode"].astype(np.uint8)
    return World(
        cycle=frames["cycle"],
        stoppage=frames["stoppage"],
        mode=OTHER_SIDE[mode] if turned else mode,
        mode_cycles=mode_cycles(frames),
        score=np.stack([frames[own], frames[other]], axis=-1),
        ball=ball.astype(np.float32) + np.float32(0),
        players=made,
        types=np.stack([types[name] for name in FIELDS], axis=-1).astype(np.float32),
        server=server.vector(params, version=server.OLDEST),
        side=side,
    )


def mode_cycles(frames: Columns) -> NDArray[np.int32]:
    """Return (n_frames,) frames since the play mode began, 0 in its first, and in the first after lost frames.

    Args:
        frames: ``cycle``, ``stoppage`` and ``playmode``, (n_frames,) each.
    """
    mode: NDArray[Any] = frames["playmode"]
    began = np.ones(len(mode), np.bool_)
    began[1:] = (mode[1:] != mode[:-1]) | ~follows(frames)[:-1]
    place = np.arange(len(mode), dtype=np.int32)
    since: NDArray[np.int32] = place - np.maximum.accumulate(np.where(began, place, 0))
    return since
