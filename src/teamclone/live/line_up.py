"""The places of a team before a kick-off, and the player types that its coach gives."""

from __future__ import annotations

import time

import numpy as np

from teamclone.logs.match import Columns
from teamclone.protocol import agent
from teamclone.protocol.agent_client import AgentClient
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.playmodes import RESTARTS, PlayMode
from teamclone.training.line_up import LineUp

_ASK_S = 0.5
"""Seconds between two requests that the server does not answer."""


def kicks_off(playmode: int, *, cycle: int, side: int, half_cycles: float) -> bool:
    """Return whether a team restarts play with the kick-off that comes next.

    Args:
        playmode: BEFORE_KICK_OFF or one of the goals. side: of the team, 1 left, -1 right.
        half_cycles: cycles of half a match; the left team begins the first.
    """
    if playmode == PlayMode.BEFORE_KICK_OFF:
        half = int(cycle // half_cycles) if half_cycles > 0 else 0
        return (half % 2 == 0) == (side > 0)
    return bool(RESTARTS[playmode] == side)


class TypesByCoach:
    """A coach that gives the players of a team their types before the match, and is silent then.

    Args:
        team: name of the team. host, port: of the server, for online coaches.
    """

    def __init__(self, line_up: LineUp, *, team: str, host: str, port: int, version: int) -> None:
        self._line_up, self._team, self._version = line_up, team, version
        self._client = AgentClient(host, port, lambda data: agent.coach_side_of(data) is not None)
        self._asked_at = -_ASK_S
        self._left: dict[int, int] | None = None
        self.refusal = ""

    @property
    def done(self) -> bool:
        """True once all players have their types, or the server wants no coach of this team."""
        return bool(self.refusal) or self._left == {}

    def work(self, types: Columns, *, whole: bool) -> None:
        """Go on with the work, as far as the server's answers allow; never waits.

        Args:
            types: the columns of ``player_types.FIELDS``, (n_types,), of the match.
            whole: whether all players are there, so that each can be given a type.
        """
        for datagram in self._client.receive():
            refusal = agent.refusal_of(datagram)
            if refusal and refusal != "no_such_team":  # which it is until a player has come
                self.refusal = refusal
            changed = agent.changed_type_of(datagram)
            if changed and self._left and self._left.get(changed[0]) == changed[1]:
                del self._left[changed[0]]
        now = time.monotonic()
        # The server may kick off soon after the last player has come, so types are not kept waiting.
        begins = self._client.welcomed and whole and self._left is None
        if self.done or (self._client.welcomed and not whole) or (now - self._asked_at < _ASK_S and not begins):
            return
        self._asked_at = now
        if not self._client.welcomed:
            self._client.send(agent.init(self._team, self._version))
            return
        if self._left is None:
            chosen = self._line_up.types(np.stack([types[name] for name in FIELDS], axis=1))
            self._left = dict(enumerate(chosen.tolist(), 1))
        # All begin with type 0, so whoever keeps it comes last.
        for unum, kind in sorted(self._left.items(), key=lambda item: item[1] == 0):
            self._client.send(agent.change_player_type(unum, kind))

    def close(self) -> None:
        """Say bye to the server."""
        self._client.close()
