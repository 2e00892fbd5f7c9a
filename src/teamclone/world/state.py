"""The state: the only input of every model, in training, evaluation, export and live play."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from teamclone.rcss.playmodes import PlayMode
from teamclone.rcss.server_params import SERVER_DEFAULTS
from teamclone.world.world import World


class State(NamedTuple):
    """Frames as a team sees them, and for each sample of a batch its frame and the actor.

    Eleven players of a cycle share one frame. Units and order of players are those of `World`.

    Attributes:
        ball: (frames, 4) x, y, vx, vy.
        players: (frames, 22, len(PLAYER_CHANNELS)); NaN where the log lacks a value.
        types: (frames, 22, len(player_types.FIELDS)), each player's physical parameters.
        server: (frames, len(server_params.FIELDS)) parameters of the server.
        past_ball, past_players: (frames, history, 4) and (frames, history, 22, channels), one, two, ... cycles before;
            as many as the model asks for, none for most.
        past_known: (frames, history) bool; False where play had not yet begun, there the past repeats the present.
        mode: (frames,) int64, the PlayMode as if the modelled team were the left one: KICK_IN_L is its own kick-in.
        mode_cycles: (frames,) frames since this mode began, 0 in its first.
        frame: (batch,) int64, index into the frames.
        actor: (batch,) int64, index 0..10 of the player whose command is asked for.
    """

    ball: Tensor
    players: Tensor
    types: Tensor
    server: Tensor
    past_ball: Tensor
    past_players: Tensor
    past_known: Tensor
    mode: Tensor
    mode_cycles: Tensor
    frame: Tensor
    actor: Tensor

    @classmethod
    def of(cls, world: World, frame: NDArray[np.int64], actor: NDArray[np.int64], *, history: int = 0) -> State:
        """Return the state of players in frames of a match.

        Args:
            frame: (batch,) indices into ``world``. actor: (batch,) 0..10.
            history: how many frames before each to give too.

        Raises:
            IndexError: a player has a type that the log does not describe.
        """
        frames, place = np.unique(frame, return_inverse=True)
        past, known = world.past(frames, history)
        return cls(
            ball=torch.from_numpy(world.ball[frames]),
            players=torch.from_numpy(world.players[frames]),
            types=torch.from_numpy(world.types_of(frames)),
            server=torch.from_numpy(world.server.astype(np.float32)).expand(len(frames), -1),
            past_ball=torch.from_numpy(world.ball[past]),
            past_players=torch.from_numpy(world.players[past]),
            past_known=torch.from_numpy(known),
            mode=torch.from_numpy(world.mode[frames].astype(np.int64)),
            mode_cycles=torch.from_numpy(world.mode_cycles[frames].astype(np.float32)),
            frame=torch.from_numpy(place.astype(np.int64)),
            actor=torch.from_numpy(np.asarray(actor, np.int64)),
        )

    @classmethod
    def now(
        cls,
        *,
        ball: Tensor,
        players: Tensor,
        types: Tensor,
        actor: Tensor,
        server: Tensor | None = None,
        mode: Tensor | None = None,
        mode_cycles: Tensor | None = None,
    ) -> State:
        """Return a state of one frame a sample and no past.

        Without ``server`` its parameters are the defaults; without a mode it is a play_on that just began.
        """
        n, n_players, n_channels = players.shape
        if server is None:
            server = torch.from_numpy(SERVER_DEFAULTS).to(ball).expand(n, -1)
        return cls(
            ball=ball,
            players=players,
            types=types,
            server=server,
            past_ball=ball.new_empty(n, 0, 4),
            past_players=players.new_empty(n, 0, n_players, n_channels),
            past_known=torch.empty(n, 0, dtype=torch.bool, device=ball.device),
            mode=torch.full_like(actor, PlayMode.PLAY_ON) if mode is None else mode,
            mode_cycles=ball.new_zeros(n) if mode_cycles is None else mode_cycles,
            frame=torch.arange(n, device=ball.device),
            actor=actor,
        )

    def select(self, rows: Tensor | slice) -> State:
        """Return some of the samples: indices, a mask or a slice. The frames stay."""
        return self._replace(frame=self.frame[rows], actor=self.actor[rows])

    def each(self) -> State:
        """Return the samples with a frame of its own for each."""
        frames = [part.index_select(0, self.frame) for part in self[: self._fields.index("frame")]]
        return State._make([*frames, torch.arange(self.frame.shape[0], device=self.frame.device), self.actor])

    def to(self, device: torch.device) -> State:
        """Return the state in the memory of a device."""
        return State(*(tensor.to(device, non_blocking=True) for tensor in self))


class Target(NamedTuple):
    """The commands of the actors.

    Attributes:
        kind: (batch,) int64 index into the dataset's commands.
        parameters: (batch, 2) power, degrees and metres.
        interval: (batch, 2, 2) the ends of the 90 % interval of each parameter less the parameter, infinite where
            nothing is known of it; None where all commands were logged, and so are known exactly.
    """

    kind: Tensor
    parameters: Tensor
    interval: Tensor | None = None

    def to(self, device: torch.device) -> Target:
        """Return the commands in the memory of a device."""
        interval = None if self.interval is None else self.interval.to(device, non_blocking=True)
        return Target(self.kind.to(device, non_blocking=True), self.parameters.to(device, non_blocking=True), interval)

    def select(self, rows: Tensor) -> Target:
        """Return some of the commands: indices or a mask."""
        interval = None if self.interval is None else self.interval[rows]
        return Target(self.kind[rows], self.parameters[rows], interval)

    @property
    def known(self) -> Tensor:
        """(batch, 2) bool, whether anything is known of each parameter."""
        if self.interval is None:
            return torch.ones_like(self.parameters, dtype=torch.bool)
        return torch.isfinite(self.interval).all(2)
