"""The raw state: the only input of every model, in training, evaluation, export and live play."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from teamclone.rcss.playmodes import PlayMode


class State(NamedTuple):
    """A batch of situations, in metres, metres per cycle and degrees; the modelled team attacks +x and comes first.

    Attributes:
        ball: (batch, 4) x, y, vx, vy.
        players: (batch, 22, len(PLAYER_CHANNELS)); NaN where the log lacks a value.
        types: (batch, 22, len(player_types.FIELDS)), each player's physical parameters.
        actor: (batch,) int64, place 0..10 of the player who acts.
        past_ball, past_players: (batch, frames, 4) and (batch, frames, 22, channels), the same one, two, ... cycles
            before; as many frames as the model asks for, none for most.
        past_known: (batch, frames) bool; False where play had not yet begun, there the past repeats the present.
        mode: (batch,) int64, the PlayMode as if the modelled team were the left one: KICK_IN_L is its own kick-in.
        mode_cycles: (batch,) frames since this mode began, 0 in its first.
    """

    ball: Tensor
    players: Tensor
    types: Tensor
    actor: Tensor
    past_ball: Tensor
    past_players: Tensor
    past_known: Tensor
    mode: Tensor
    mode_cycles: Tensor

    @classmethod
    def now(
        cls,
        *,
        ball: Tensor,
        players: Tensor,
        types: Tensor,
        actor: Tensor,
        mode: Tensor | None = None,
        mode_cycles: Tensor | None = None,
    ) -> State:
        """Situations of which no past is asked; without a mode in play_on, and of a mode that just began."""
        n, n_players, n_channels = players.shape
        return cls(
            ball=ball,
            players=players,
            types=types,
            actor=actor,
            past_ball=ball.new_empty(n, 0, 4),
            past_players=players.new_empty(n, 0, n_players, n_channels),
            past_known=torch.empty(n, 0, dtype=torch.bool, device=ball.device),
            mode=torch.full_like(actor, PlayMode.PLAY_ON) if mode is None else mode,
            mode_cycles=ball.new_zeros(n) if mode_cycles is None else mode_cycles,
        )

    def to(self, device: torch.device) -> State:
        return State(*(tensor.to(device, non_blocking=True) for tensor in self))


class Target(NamedTuple):
    """What the player did: kind (batch,) int64 index into the dataset's commands; parameters (batch, 2) in power,
    degrees and metres."""

    kind: Tensor
    parameters: Tensor
