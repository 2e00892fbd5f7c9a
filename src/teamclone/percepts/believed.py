"""A match as each player of a team believes it: a `World` with a frame for each (frame, actor)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import UsageError
from teamclone.logs.match import Columns, default_player_types
from teamclone.percepts.memory import Memory, remember
from teamclone.percepts.sight import BALL, Sight, sight
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.reference_frame import rotate_angle, rotate_point
from teamclone.world.channels import CHANNEL
from teamclone.world.world import World


def perceive(
    frames: Columns, players: Columns, *, types: Columns, params: Mapping[str, float | str]
) -> tuple[Sight, Memory]:
    """Return what the players of a match were sent, and what they believe.

    Args:
        frames: `sight.FRAME_COLUMNS`, (n_frames,). players: `sight.PLAYER_COLUMNS` and ``type``, (n_frames, 22).
        types: the column ``player_decay`` of the player types, (n_types,). params: the server's parameters.

    Raises:
        UsageError: the log does not show where players look.
    """
    for name in ("neck", "view_width"):
        if np.isnan(players[name]).all():
            raise UsageError(f"the log does not show {name}: logs of version 3 and later do")
    seen = sight(frames, players, params)
    decays = (types if len(types["player_decay"]) else default_player_types(1))["player_decay"]
    decay = decays[np.minimum(players["type"], len(decays) - 1)]
    return seen, remember(frames, players, seen, decay=decay, params=params)


@dataclass(frozen=True, slots=True, kw_only=True)
class Believed:
    """What the players of one team believe.

    Attributes:
        world: the match as the team sees it, see `world.view`. memory: of all its players.
    """

    world: World
    memory: Memory

    def select(self, frame: NDArray[Any], actor: NDArray[Any]) -> World:
        """Return a world with a frame for each of some actors in some frames.

        Places and velocities of ball and other players, and the body directions of these, are those that the actor
        believes; the channel ``age`` says for how long. All else is as the log has it, of the others, too.

        Args:
            frame: (n,) indices into the world. actor: (n,) 0..10.
        """
        turned = self.world.side < 0
        me = np.asarray(actor) + (N_TEAM if turned else 0)
        axis = np.roll(np.arange(N_PLAYERS), N_TEAM if turned else 0)
        order = np.append(axis, BALL)
        memory = self.memory
        place, velocity = memory.place[frame, me][:, order], memory.velocity[frame, me][:, order]
        body, age = memory.body[frame, me][:, axis], memory.age[frame, me][:, order]
        if turned:
            place, velocity, body = rotate_point(place), rotate_point(velocity), rotate_angle(body)
        made = self.world.select(np.asarray(frame))
        row = np.arange(len(me))
        own = made.players[row, actor].copy()
        for name, values in (
            ("x", place[:, :BALL, 0]),
            ("y", place[:, :BALL, 1]),
            ("vx", velocity[:, :BALL, 0]),
            ("vy", velocity[:, :BALL, 1]),
            ("body", body),
            ("age", age[:, :BALL]),
        ):
            made.players[..., CHANNEL[name]] = values
        made.players[row, actor] = own
        made.players[row, actor, CHANNEL["age"]] = age[:, BALL]
        ball = np.concatenate([place[:, BALL], velocity[:, BALL]], axis=-1)
        return replace(made, ball=ball.astype(np.float32) + np.float32(0))
