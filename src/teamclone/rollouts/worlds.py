"""``Worlds``: the worlds of a roll-out, from frames of a match to what a model sees of the cycles that were made up."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from teamclone.dynamics.bodies import BALL, Bodies, Commands
from teamclone.dynamics.logged import Logged
from teamclone.dynamics.rules import Rules
from teamclone.rcss.player_types import FIELDS as TYPE_FIELDS
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import OTHER_SIDE
from teamclone.rcss.reference_frame import rotate_angle, rotate_point
from teamclone.world.channels import (
    CHANNEL,
    FLAG_CHARGED,
    FLAG_COLLIDED,
    FLAG_TACKLING,
)
from teamclone.world.state import State
from teamclone.world.world import World


@dataclass(frozen=True, slots=True, kw_only=True)
class Worlds:
    """n worlds of one match in the same cycle of their roll-outs.

    Attributes:
        bodies: ball and players, in the log's frame of reference.
        players: (n, 22, channels) float32, the channels of `World.players` as the left team sees them. Those that a
            step changes are kept up to date; view width, type and the rest stay as in the frame that it began with.
        mode_cycles: (n,) float32. rules: of the match. server: (len(server_params.FIELDS),) as of `World`.
    """

    bodies: Bodies
    players: NDArray[np.float32]
    mode_cycles: NDArray[np.float32]
    rules: Rules
    server: NDArray[np.float64]

    @classmethod
    def of(cls, match: Logged, world: World, rules: Rules, frames: NDArray[np.int64]) -> Worlds:
        """Return the worlds of some frames of a match; ``world`` is that of its left team."""
        return cls(
            bodies=match.bodies.select(frames),
            players=world.players[frames].copy(),
            mode_cycles=world.mode_cycles[frames].astype(np.float32),
            rules=rules,
            server=world.server,
        )

    def after(self, bodies: Bodies, commands: Commands, executed: NDArray[np.uint8]) -> Worlds:
        """Return the worlds a cycle later.

        Args:
            bodies: of the next cycle. commands: what was done. executed: (n, 22) CommandKind of each player, 0 none.
        """
        players = self.players.copy()
        for name in ("x", "y", "vx", "vy"):
            players[..., CHANNEL[name]] = getattr(bodies, name)[:, :BALL]
        for name in ("body", "neck", "stamina", "effort", "recovery", "capacity"):
            players[..., CHANNEL[name]] = getattr(bodies, name)
        flags = players[..., CHANNEL["flags"]].astype(np.int64)
        # The bit of a tackle or foul stays one frame longer than the player is frozen.
        was_free = (self.bodies.frozen == 0) & (bodies.frozen == 0)
        flags[was_free] &= ~(FLAG_TACKLING | FLAG_CHARGED)
        flags[(self.bodies.frozen == 0) & (bodies.frozen > 0)] |= FLAG_TACKLING
        flags &= ~FLAG_COLLIDED
        flags[bodies.touched[:, :BALL]] |= FLAG_COLLIDED
        players[..., CHANNEL["flags"]] = flags
        players[..., CHANNEL["last_command"]] = executed
        return replace(self, bodies=bodies, players=players, mode_cycles=self.mode_cycles + 1)

    def state(self, frame: NDArray[np.int64], actor: NDArray[np.int64], *, side: int) -> State:
        """Return what a model of the team on ``side``, 1 left or -1 right, sees.

        Args:
            frame: (batch,) worlds. actor: (batch,) 0..10, a player of this team.
        """
        players, ball = self.players, np.stack([getattr(self.bodies, name)[:, BALL] for name in _BALL], axis=-1)
        mode = self.bodies.mode
        if side < 0:
            players = np.roll(players, N_TEAM, axis=1)
            turned = [CHANNEL[name] for name in _BALL]
            players[..., turned] = rotate_point(players[..., turned])
            players[..., CHANNEL["body"]] = rotate_angle(players[..., CHANNEL["body"]])
            ball, mode = rotate_point(ball), OTHER_SIDE[mode]
        types = np.stack([self.rules.types[name] for name in TYPE_FIELDS], axis=-1).astype(np.float32)
        return State.now(
            ball=torch.from_numpy(ball.astype(np.float32)),
            players=torch.from_numpy(players),
            types=torch.from_numpy(types[players[..., CHANNEL["type"]].astype(np.int64)]),
            server=torch.from_numpy(self.server.astype(np.float32)).expand(len(players), -1),
            mode=torch.from_numpy(mode.astype(np.int64)),
            mode_cycles=torch.from_numpy(self.mode_cycles),
            actor=torch.from_numpy(actor),
        )._replace(frame=torch.from_numpy(frame))


_BALL = ("x", "y", "vx", "vy")


def slots_of(side: int) -> slice:
    """Return the places of a team among the players."""
    return slice(0, N_TEAM) if side > 0 else slice(N_TEAM, N_PLAYERS)
