"""The connections of a team's players: they join one after the other, and come back where a connection is lost."""

from __future__ import annotations

import math
import select
import time
from collections.abc import Mapping
from dataclasses import dataclass

from teamclone.errors import LiveError
from teamclone.protocol import agent
from teamclone.protocol.agent import FullState, Sense, Welcome
from teamclone.protocol.agent_client import AgentClient
from teamclone.protocol.parameters import Parameters
from teamclone.rcss.players import N_TEAM

_KNOCK_S = 0.5
"""Seconds between two requests of a player to take part."""
_RETURN_S = 1.0
"""Seconds between two requests of a player to come back."""
_PROBE_S = 1.0
"""Seconds of silence after which the server is sent something: a closed port answers."""
_LATE_S = 0.3
"""How long, in synchronous mode, a player whose message was lost holds the others up."""
_TOGETHER_S = 0.015
"""How long, in real time, what the players feel may come after the state of all."""


@dataclass(slots=True, kw_only=True)
class Seat:
    """A player's connection and what has come over it since its last answer.

    Attributes:
        returns: whether the player was there before and lost its connection.
        knocked_at, heard_at: when it last asked to take part, and when the server last spoke to it or was last probed.
        refusal: why the server does not take it back.
    """

    unum: int
    client: AgentClient
    returns: bool = False
    knocked_at: float = -math.inf
    heard_at: float = -math.inf
    refusal: str = ""
    sense: Sense | None = None
    state: bytes = b""
    thinks: bool = False


class Seats:
    """The players of a team on a server.

    Args:
        name: the team's name there. goalkeeper: number of the goalkeeper, 0 for none. host, port: of the server.

    Attributes:
        parameters: of the match, as far as they have come.
        side: 1 left, -1 right, 0 before the server has said it.
        heard_at: when the last datagram came, seconds of ``time.monotonic``.
        returned: players that have come back.
    """

    def __init__(self, *, name: str, goalkeeper: int, host: str, port: int) -> None:
        self._name, self._goalkeeper, self._host, self._port = name, goalkeeper, host, port
        self._versions, self._seats = list(agent.VERSIONS), list[Seat]()
        self._expected = frozenset(range(1, N_TEAM + 1))
        self.parameters = Parameters()
        self.side = self.returned = 0
        self.heard_at = self._due_since = time.monotonic()

    @property
    def where(self) -> str:
        """The server in words."""
        return f"{self._host}:{self._port}"

    @property
    def version(self) -> int:
        """Version of the protocol that is spoken."""
        return self._versions[0]

    @property
    def synch(self) -> bool:
        """Whether the server waits for its clients in every cycle."""
        return bool(self.parameters.server.get("synch_mode"))

    @property
    def joined(self) -> list[Seat]:
        """The players that are connected."""
        return [seat for seat in self._seats if seat.client.welcomed and not seat.client.gone]

    @property
    def left(self) -> bool:
        """Whether there were players, and the server has closed the ports of all of them."""
        return not self.joined and any(seat.client.gone for seat in self._seats)

    def expect(self, unums: frozenset[int]) -> None:
        """Take note of who is on the field: the server asks nobody else to think."""
        self._expected = unums

    def knock(self) -> None:
        """Let the next player ask to take part, and those whose connection was lost ask to come back.

        Raises:
            LiveError: the server does not take the team, or the host has no address.
        """
        now = time.monotonic()
        for place, seat in enumerate(self._seats):
            if seat.client.gone and not seat.refusal and self.joined:
                seat.client.close()
                self._seats[place] = Seat(unum=seat.unum, client=self._client(), returns=True, knocked_at=now)
        waiting = next((seat for seat in self._seats if not seat.client.welcomed and not seat.refusal), None)
        if waiting is None and len(self._seats) < N_TEAM:
            waiting = Seat(unum=len(self._seats) + 1, client=self._client())
            self._seats.append(waiting)
        if waiting is not None and now - waiting.knocked_at > (_RETURN_S if waiting.returns else _KNOCK_S):
            waiting.knocked_at = now
            waiting.client.send(
                agent.reconnect(self._name, waiting.unum)
                if waiting.returns
                else agent.init(self._name, self.version, goalie=waiting.unum == self._goalkeeper)
            )
        for seat in self.joined:
            if now - seat.heard_at > _PROBE_S:
                seat.heard_at = now
                seat.client.send(agent.commands([agent.DONE]))

    def _client(self) -> AgentClient:
        return AgentClient(self._host, self._port, lambda data: agent.welcome_of(data) is not None)

    def read(self, wait_s: float) -> None:
        """Read what has come, waiting for it at most so many seconds."""
        open_ones = [seat.client for seat in self._seats if not seat.client.gone]
        select.select(open_ones, [], [], 0.0 if self.due else wait_s)
        for seat in self._seats:
            for datagram in seat.client.receive() if not seat.client.gone else ():
                self.heard_at = seat.heard_at = time.monotonic()
                self._take(seat, datagram)

    def _take(self, seat: Seat, datagram: bytes) -> None:
        """Take a datagram of the server in."""
        if datagram.startswith(b"(sense_body "):
            seat.sense = agent.sense_of(datagram) or seat.sense
        elif datagram.startswith(b"(fullstate "):
            seat.state = datagram
        elif agent.asks_to_think(datagram):
            seat.thinks = True
        elif (welcome := agent.welcome_of(datagram)) is not None:
            self._welcome(seat, welcome)
        elif self.parameters.take(agent.text_of(datagram)):
            pass
        elif (refusal := agent.refusal_of(datagram)) is not None and not seat.client.welcomed:
            self._refused(seat, refusal)

    def _welcome(self, seat: Seat, welcome: Welcome) -> None:
        self.side = welcome.side
        self.returned += seat.returns
        seat.unum = welcome.unum or seat.unum
        for text in agent.SET_UP:
            seat.client.send(agent.commands([text]))

    def _refused(self, seat: Seat, refusal: str) -> None:
        if "illegal_client_version" in refusal and len(self._seats) == 1 and len(self._versions) > 1:
            self._versions.pop(0)
            seat.knocked_at = -math.inf
        elif not seat.returns:
            raise LiveError(f"the server at {self.where} does not take player {seat.unum} of {self._name}: {refusal}")
        elif refusal != "cannot_reconnect_while_playon":  # which passes
            seat.refusal = refusal

    @property
    def due(self) -> bool:
        """Whether the server now waits for commands."""
        joined, now = self.joined, time.monotonic()
        expected = [seat for seat in joined if seat.unum in self._expected]
        if self.synch:
            waits, limit = any(seat.thinks for seat in joined), _LATE_S
            complete = all(seat.thinks for seat in expected)
        else:
            waits, limit = any(seat.state for seat in joined), _TOGETHER_S
            complete = all(seat.sense is not None for seat in expected)
        if not waits:
            self._due_since = now
        return waits and (complete or now - self._due_since > limit)

    def seen(self) -> tuple[FullState | None, dict[int, Sense]]:
        """Return the state of all, None where none has come, and what the players feel by number."""
        joined = self.joined
        states = (agent.full_state_of(seat.state) for seat in joined if seat.state)
        senses = {seat.unum: seat.sense for seat in joined if seat.sense is not None}
        return next(filter(None, states), None), senses

    def answer(self, words: Mapping[int, list[str]]) -> None:
        """Send the players' commands by number, and begin to wait for the next cycle."""
        for seat in self.joined:
            said = [*words.get(seat.unum, ()), *([agent.DONE] if self.synch and seat.thinks else [])]
            if said:
                seat.client.send(agent.commands(said))
            seat.thinks, seat.state, seat.sense = False, b"", None

    def close(self) -> None:
        """Say bye for all players."""
        for seat in self._seats:
            seat.client.close()
