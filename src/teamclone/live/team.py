"""Eleven players and a coach of one clone, in one process, in a match of rcssserver.

Each player has a connection of its own, as the server wants it. What one of them is told of the state of all is enough
for the whole team, so the clone answers once a cycle, for all of them.
"""

from __future__ import annotations

import math
import select
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from teamclone.errors import LiveError
from teamclone.live.decisions import HISTORY, Decisions, Order
from teamclone.live.frames import LiveWorld
from teamclone.live.line_up import TypesByCoach, kicks_off
from teamclone.protocol import agent
from teamclone.protocol.agent import MEASURED, FullState, Sense
from teamclone.protocol.agent_client import AgentClient
from teamclone.protocol.client import LOOPBACK
from teamclone.rcss import server_params
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.playmodes import SITUATION, PlayMode, Situation
from teamclone.training.line_up import LineUp
from teamclone.world.world import World

CONNECT_S = 60.0
"""How long the server may take to be there."""
SILENT_S = 15.0
"""Seconds without a word of the server after which it counts as gone."""

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
_BLIND_CYCLES = 100
"""Cycles without a full state after which it is clear that the server sends none."""
_AT_PLACE_M = 0.5
_MOVE_AGAIN = 5
"""Cycles between two moves to a place: the server executes one in the next step."""
_LEAST_TURN_NECK = 1.0
"""Degrees."""
_X, _Y, _BODY, _NECK = (MEASURED.index(name) for name in ("x", "y", "body", "neck"))
_TURN_ZERO = Order(CommandKind.TURN, (0.0,))
"""What a player does that has nothing to do: no cycle is without a command."""


@dataclass(slots=True, kw_only=True)
class Seat:
    """A player's connection and what came over it since its last answer."""

    unum: int
    client: AgentClient
    returns: bool = False
    """Whether the player was there before and lost its connection."""
    knocked_at: float = -math.inf
    sense: Sense | None = None
    state: bytes = b""
    thinks: bool = False
    refusal: str = ""


@dataclass(slots=True)
class Summary:
    """What became of a match.

    Attributes:
        cycles: cycles that were answered. missed: cycles between two answers that went by without one.
        answer_ms: of each cycle, from the message that completed it to the last command.
        scores: goals of the own and of the other team.
        side: 1 left, -1 right; 0 before the server has said it.
        over: whether the server has said that time is over.
        types: whether the coach has given the player types. returned: players that lost their connection and came back.
    """

    cycles: int = 0
    missed: int = 0
    answer_ms: list[float] = field(default_factory=list)
    scores: tuple[int, int] = (0, 0)
    side: int = 0
    over: bool = False
    types: bool = False
    returned: int = 0

    def percentiles(self) -> dict[str, float]:
        """Return p50, p99, p99.9 and the greatest of ``answer_ms``."""
        if not self.answer_ms:
            return {}
        values = np.percentile(self.answer_ms, [50, 99, 99.9, 100]).round(3).tolist()
        return dict(zip(("p50", "p99", "p99.9", "max"), values, strict=True))


class Team:
    """A cloned team in a match.

    Args:
        decisions: the clone's. line_up: how its team lines up.
        name: the team's name on the server.
        host, port: of the server, for players. coach_port: for online coaches; 0 for no coach.
        on_cycle: called after each answer.
    """

    def __init__(
        self,
        decisions: Decisions,
        line_up: LineUp,
        *,
        name: str,
        port: int,
        coach_port: int,
        host: str = LOOPBACK,
        on_cycle: Callable[[FullState], None] = lambda _: None,
    ) -> None:
        self._decisions, self._line_up, self._name, self._on_cycle = decisions, line_up, name, on_cycle
        self._host, self._port, self._coach_port = host, port, coach_port
        self._versions = list(agent.VERSIONS)
        self._seats: list[Seat] = []
        self._coach: TypesByCoach | None = None
        self._params: dict[str, float | str] = {}
        self._types: dict[int, dict[str, float]] = {}
        self._world: LiveWorld | None = None
        self._cycle, self._mode = -1, int(PlayMode.NULL)
        self._moved_at: dict[int, int] = {}
        self._blind = 0
        self._heard_at = self._due_since = time.monotonic()
        self.summary = Summary()

    def play(self, *, connect_s: float = CONNECT_S) -> Summary:
        """Take part in a match until it is over.

        Raises:
            LiveError: the server is not there, refuses the team, sends no full state, or goes away during the match.
        """
        begun = time.monotonic()
        try:
            while not self._ended():
                now = time.monotonic()
                if not self._joined() and now - begun > connect_s:
                    raise LiveError(
                        f"no server answers at {self._where()} after {connect_s:g} s; "
                        "start rcssserver first, or give its --port"
                    )
                self._knock(now)
                self._read(0.05)
                self._coach_on()
                if self._due():
                    self._answer()
        finally:
            self._leave()
        return self.summary

    def _where(self) -> str:
        return f"{self._host}:{self._port}"

    def _joined(self) -> list[Seat]:
        return [seat for seat in self._seats if seat.client.welcomed and not seat.client.gone]

    def _ended(self) -> bool:
        """Return whether the match is over, and see that the server is still there."""
        now = time.monotonic()
        joined = self._joined()
        if not self._seats or (not joined and not any(seat.client.gone for seat in self._seats)):
            return False
        silent = now - self._heard_at
        if joined and silent < SILENT_S:
            return False
        if self.summary.over:
            return True
        what = f"has not said a word for {silent:.0f} s" if joined else "has gone"
        raise LiveError(
            f"the server at {self._where()} {what}, after cycle {self._cycle}; see its output for the reason"
        )

    def _knock(self, now: float) -> None:
        """Let the next player ask to take part, and players that have lost their connection come back."""
        for place, seat in enumerate(self._seats):
            if seat.client.gone and not seat.refusal and self._joined():
                seat.client.close()
                self._seats[place] = Seat(unum=seat.unum, client=self._client(), returns=True, knocked_at=now)
        waiting = next((seat for seat in self._seats if not seat.client.welcomed and not seat.refusal), None)
        if waiting is None and len(self._seats) < N_TEAM:
            waiting = Seat(unum=len(self._seats) + 1, client=self._client())
            self._seats.append(waiting)
        if waiting is not None and now - waiting.knocked_at > (_RETURN_S if waiting.returns else _KNOCK_S):
            waiting.knocked_at = now
            goalie = waiting.unum == self._line_up.goalkeeper
            waiting.client.send(
                agent.reconnect(self._name, waiting.unum)
                if waiting.returns
                else agent.init(self._name, self._versions[0], goalie=goalie)
            )
        if now - self._heard_at > _PROBE_S:
            for seat in self._joined():
                seat.client.send(agent.commands([agent.DONE]))

    def _client(self) -> AgentClient:
        return AgentClient(self._host, self._port, lambda data: agent.welcome_of(data) is not None)

    def _read(self, wait_s: float) -> None:
        """Read what has come, waiting for it at most so long."""
        if self._due():
            wait_s = 0.0
        live = [seat.client for seat in self._seats if not seat.client.gone]
        select.select(live, [], [], wait_s if live else 0.0)
        for seat in self._seats:
            for datagram in seat.client.receive() if not seat.client.gone else ():
                self._heard_at = time.monotonic()
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
        elif datagram.startswith(b"(player_type "):
            described = agent.player_type_of(datagram)
            self._types |= dict([described] if described else [])
        elif datagram.startswith(b"(server_param "):
            self._params = agent.server_params_of(datagram) or self._params
        elif (refusal := agent.refusal_of(datagram)) is not None and not seat.client.welcomed:
            self._refused(seat, refusal)

    def _welcome(self, seat: Seat, welcome: agent.Welcome) -> None:
        self.summary.side = welcome.side
        self.summary.returned += seat.returns
        seat.unum = welcome.unum or seat.unum
        for text in agent.SET_UP:
            seat.client.send(agent.commands([text]))

    def _refused(self, seat: Seat, refusal: str) -> None:
        if "illegal_client_version" in refusal and len(self._seats) == 1 and len(self._versions) > 1:
            self._versions.pop(0)
            seat.knocked_at = -math.inf
        elif refusal == "cannot_reconnect_while_playon":
            pass
        elif self._world is not None:
            seat.refusal = refusal
            seat.client.gone = True
        else:
            raise LiveError(
                f"the server at {self._where()} does not take player {seat.unum} of {self._name}: {refusal}"
            )

    def _coach_on(self) -> None:
        """Let the coach go on with giving types, until the kick-off."""
        if not self._coach_port or len(self._joined()) < N_TEAM:
            return
        if self._coach is None:
            self._coach = TypesByCoach(
                self._line_up, team=self._name, host=self._host, port=self._coach_port, version=self._versions[0]
            )
        if self._cycle <= 0 and not self._coach.done and len(self._types) >= N_TEAM:
            self._coach.work(self._types)
        self.summary.types = self._coach.done and not self._coach.refusal

    def _due(self) -> bool:
        """Return whether the server now waits for commands."""
        joined = self._joined()
        now = time.monotonic()
        if self._params.get("synch_mode"):
            thinking = sum(seat.thinks for seat in joined)
            complete, limit = thinking == len(joined), _LATE_S
        else:
            thinking = sum(bool(seat.state) for seat in joined)
            complete, limit = thinking > 0 and all(seat.sense is not None for seat in joined), _TOGETHER_S
        if not thinking:
            self._due_since = now
            return False
        return complete or now - self._due_since > limit

    def _answer(self) -> None:
        """Send the commands of a cycle."""
        began, joined = self._heard_at, self._joined()
        state = next(filter(None, (agent.full_state_of(seat.state) for seat in joined if seat.state)), None)
        orders: dict[int, Order] = {}
        if state is not None:
            self._blind = 0
            orders = self._orders(state, joined)
        else:
            self._blind += self._cycle > 0 or len(joined) == N_TEAM
            if self._blind > _BLIND_CYCLES:
                side = "l" if self.summary.side > 0 else "r"
                raise LiveError(
                    f"the server at {self._where()} sends no full state, which this clone needs; "
                    f"start it with server::fullstate_{side}=on"
                )
        synch = bool(self._params.get("synch_mode"))
        for seat in joined:
            words = []
            if (order := orders.get(seat.unum)) is not None and order.kind is not None:
                words.append(agent.command(order.kind, order.numbers))
            if state is not None and (moment := self._to_the_ball(state, seat.unum)):
                words.append(agent.command(CommandKind.TURN_NECK, (moment,)))
            if synch and seat.thinks:
                words.append(agent.DONE)
            if words:
                seat.client.send(agent.commands(words))
            seat.thinks, seat.state, seat.sense = False, b"", None
        if state is not None:
            self._count(state, began)

    def _count(self, state: FullState, began: float) -> None:
        self.summary.answer_ms.append(1000 * (time.monotonic() - began))
        self.summary.cycles += 1
        self.summary.missed += max(state.cycle - self._cycle - 1, 0) if self._cycle >= 0 else 0
        self.summary.scores, self._cycle, self._mode = state.scores, state.cycle, state.playmode
        self.summary.over |= state.playmode == PlayMode.TIME_OVER
        self._on_cycle(state)

    def _orders(self, state: FullState, seats: Iterable[Seat]) -> dict[int, Order]:
        """Return the body commands of a cycle by the numbers of the players."""
        if self._world is None:
            if not self._params or not self._types:
                return {}
            self._world = LiveWorld(side=self.summary.side, params=self._params, types=self._types, history=HISTORY)
        senses = {seat.unum: seat.sense for seat in seats if seat.sense is not None}
        world = self._world.add(state, senses)
        situation = SITUATION[state.playmode]
        if situation == Situation.OTHER:
            return {}
        slots = {seat.unum: self._slot(seat.unum) for seat in seats}
        able = [
            unum
            for unum, slot in slots.items()
            if state.present[slot] and state.doing[slot] not in (agent.TACKLES, agent.CHARGED)
        ]
        orders = dict.fromkeys(able, _TURN_ZERO)
        if situation != Situation.BEFORE_KICK_OFF:
            keepers = [unum for unum in able if state.goalie[slots[unum]]]
            holders = keepers if state.held == self.summary.side else []
            decided = self._decisions.of(world, able, movers=holders, catchers=keepers)
            orders |= {unum: order for unum, order in decided.items() if order.kind is not None}
        if situation in (Situation.BEFORE_KICK_OFF, Situation.GOAL):
            orders |= self._places(state, world, able)
        return orders

    def _places(self, state: FullState, world: World, unums: Iterable[int]) -> dict[int, Order]:
        """Return the moves of players that are not at their place for the next kick-off, and what the others do."""
        half = (
            server_params.number(self._params, "half_time")
            * 1000
            / server_params.number(self._params, "simulator_step")
        )
        own = kicks_off(state.playmode, cycle=state.cycle, side=self.summary.side, half_cycles=half)
        places = self._line_up.own_kick_off if own else self._line_up.other_kick_off
        now, orders = self.summary.cycles, {}
        for unum in unums:
            x, y = places[unum - 1]
            if math.hypot(*(world.players[-1, unum - 1, :2] - (x, y))) < _AT_PLACE_M:
                orders[unum] = _TURN_ZERO
            elif now - self._moved_at.get(unum, -_MOVE_AGAIN) >= _MOVE_AGAIN:
                self._moved_at[unum] = now
                orders[unum] = Order(CommandKind.MOVE, (x, y))
        return orders

    def _slot(self, unum: int) -> int:
        return unum - 1 + (0 if self.summary.side > 0 else N_TEAM)

    def _to_the_ball(self, state: FullState, unum: int) -> float:
        """Return the moment that turns a player's neck to the ball, as far as it can; 0 for none."""
        slot = self._slot(unum)
        if not state.present[slot]:
            return 0.0
        x, y, body, neck = (state.measured[row, slot] for row in (_X, _Y, _BODY, _NECK))
        towards = math.degrees(math.atan2(state.ball[1] - y, state.ball[0] - x)) - body
        wanted = min(max((towards + 180) % 360 - 180, -90.0), 90.0)
        return wanted - neck if abs(wanted - neck) > _LEAST_TURN_NECK else 0.0

    def _leave(self) -> None:
        for seat in self._seats:
            seat.client.close()
        if self._coach is not None:
            self._coach.close()
