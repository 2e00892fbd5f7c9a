"""From what a server sends the players of a team, cycle by cycle, to the `World` that its logs would have."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.logs.columns import counter_name
from teamclone.protocol.agent import CHARGED, KICKED, MEASURED, TACKLES, FullState, Sense
from teamclone.protocol.parameters import Parameters
from teamclone.rcss import state_bits
from teamclone.rcss.commands import BODY_KINDS, CommandKind
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.world.view import FRAME_COLUMNS, view_columns
from teamclone.world.world import World

_WIDE = 180.0
"""View cone of players that see in time with the server and look wide, degrees."""


class LiveWorld:
    """The last cycles of a match as columns of a log, made of the full states of a team's players.

    A full state says less than a log. Of the own players the server's counters fill the gap. Of the others a command is
    known if it was a kick or a tackle, the view cone and collisions are not.

    Args:
        side: of the team, 1 left, -1 right.
        parameters: of the match.
        history: how many cycles before the present a model reads.
    """

    def __init__(
        self,
        *,
        side: int,
        parameters: Parameters,
        history: int,
    ) -> None:
        self._side, self._params, self._types = side, parameters.server, parameters.type_columns
        # The last command of a frame follows from the counters of the one before.
        self._rows: deque[tuple[dict[str, Any], dict[str, NDArray[Any]]]] = deque(maxlen=history + 2)
        self._counts = np.zeros((len(BODY_KINDS), N_PLAYERS), np.int32)
        self._last: FullState | None = None
        self._stoppage = self._mode_cycles = 0
        self._own = slice(0, N_TEAM) if side > 0 else slice(N_TEAM, N_PLAYERS)

    def add(self, state: FullState, senses: Mapping[int, Sense]) -> World:
        """Add a cycle; return the last ones as the team sees them, the present one last.

        Args:
            senses: what the own players feel in this cycle, by their numbers; may lack some.
        """
        before, self._last = self._last, state
        repeats = before is not None and state.cycle == before.cycle
        self._stoppage = self._stoppage + 1 if repeats else 0
        same_mode = before is not None and state.playmode == before.playmode
        self._mode_cycles = self._mode_cycles + 1 if same_mode else 0
        self._count(state, before, senses)
        left, right = state.scores if self._side > 0 else state.scores[::-1]
        numbers = (state.cycle, self._stoppage, state.playmode, left, right, *state.ball)
        self._rows.append((dict(zip(FRAME_COLUMNS, numbers, strict=True)), self._players(state, before, senses)))
        frames, players = zip(*self._rows, strict=True)
        world = view_columns(
            {name: np.array([frame[name] for frame in frames]) for name in FRAME_COLUMNS},
            {name: np.stack([row[name] for row in players]) for name in players[0]},
            types=self._types,
            params=self._params,
            side=self._side,
        )
        # The play mode may have begun before the cycles that are kept.
        return replace(world, mode_cycles=np.append(world.mode_cycles[:-1], np.int32(self._mode_cycles)))

    def _count(self, state: FullState, before: FullState | None, senses: Mapping[int, Sense]) -> None:
        """Count the commands that were executed since the cycle before."""
        self._counts = self._counts.copy()
        lies = state.doing == TACKLES
        fell = lies if before is None else lies & (before.doing != TACKLES)
        for kind, given in ((CommandKind.KICK, state.doing == KICKED), (CommandKind.TACKLE, fell)):
            self._counts[BODY_KINDS.index(kind)] += given
        for unum, sense in senses.items():
            self._counts[:, self._own.start + unum - 1] = sense.counts

    def _players(
        self, state: FullState, before: FullState | None, senses: Mapping[int, Sense]
    ) -> dict[str, NDArray[Any]]:
        """Return the columns of the players, (22,) each."""
        columns: dict[str, NDArray[Any]] = dict(zip(MEASURED, state.measured, strict=True))
        columns["type"] = np.where(state.type < len(next(iter(self._types.values()))), state.type, 0)
        columns["view_width"] = np.full(N_PLAYERS, np.nan)
        columns["view_width"][self._own] = _WIDE
        bits = np.where(state.present, state_bits.STAND, 0)
        for letter, bit in ((TACKLES, state_bits.TACKLE), (CHARGED, state_bits.FOUL_CHARGED)):
            # In a log both last one frame longer than in a full state.
            lies = (state.doing == letter) | (before is not None and before.doing == letter)
            bits |= np.where(lies, bit, 0)
        for is_so, bit in (
            (state.goalie, state_bits.GOALIE),
            (state.doing == KICKED, state_bits.KICK),
            (state.cards == b"y", state_bits.YELLOW_CARD),
        ):
            bits |= np.where(is_so, bit, 0)
        for unum, sense in senses.items():
            bits[self._own.start + unum - 1] |= state_bits.PLAYER_COLLIDE if sense.collided else 0
        columns["state"] = bits
        columns |= {counter_name(kind): self._counts[place] for place, kind in enumerate(BODY_KINDS)}
        return columns
