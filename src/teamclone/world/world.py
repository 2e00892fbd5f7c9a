"""``World``: the cycles of one match as one of the two teams sees them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.world.channels import CHANNEL


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """Frames of one match in metres, metres per cycle and degrees, exactly as the log has them.

    The team attacks +x and comes first on the player axis: index 0..10 are its numbers 1..11, 11..21 the opponents'.

    Attributes:
        cycle, stoppage: (n_frames,) int32, as logged.
        mode: (n_frames,) uint8, the PlayMode as if the team were the left one: KICK_IN_L is its own kick-in.
        mode_cycles: (n_frames,) int32, frames since this mode began, 0 in its first.
        score: (n_frames, 2) int16, goals of the team and of its opponent.
        ball: (n_frames, 4) float32 x, y, vx, vy.
        players: (n_frames, 22, len(PLAYER_CHANNELS)) float32; NaN where the log lacks a value.
        types: (n_types, len(player_types.FIELDS)) float32, row = type id.
        server: (len(server_params.FIELDS),) float64.
        side: 1 where the team is the left one of the log, -1 where it is the right one.
    """

    cycle: NDArray[np.int32]
    stoppage: NDArray[np.int32]
    mode: NDArray[np.uint8]
    mode_cycles: NDArray[np.int32]
    score: NDArray[np.int16]
    ball: NDArray[np.float32]
    players: NDArray[np.float32]
    types: NDArray[np.float32]
    server: NDArray[np.float64]
    side: int

    def __len__(self) -> int:
        return len(self.cycle)

    def channel(self, name: str) -> NDArray[np.float32]:
        """Return (n_frames, 22) one of PLAYER_CHANNELS."""
        return self.players[..., CHANNEL[name]]

    def select(self, frames: NDArray[Any]) -> World:
        """Return some of the frames: indices or a mask."""
        return replace(
            self,
            **{
                name: getattr(self, name)[frames]
                for name in ("cycle", "stoppage", "mode", "mode_cycles", "score", "ball", "players")
            },
        )

    def types_of(self, frames: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return (n, 22, len(player_types.FIELDS)) physical parameters of every player in some frames.

        Raises:
            IndexError: a player has a type that the log does not describe.
        """
        return self.types[self.channel("type")[frames].astype(np.int64)]

    def past(self, frames: NDArray[np.int64], history: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the frames one, two, ... cycles before some frames.

        Returns:
            (n, history) their indices, and whether there is such a frame: not before the clock stood, nor where frames
            were lost. Where there is none the index is that of the frame itself.
        """
        back = np.arange(1, history + 1)
        before = np.maximum(frames[:, None] - back, 0)
        known = self.cycle[before] == self.cycle[frames][:, None] - back
        return np.where(known, before, frames[:, None]), known
