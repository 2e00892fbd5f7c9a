"""Eleven players and a coach of one clone, in one process, in a match of rcssserver.

Each player has a connection of its own, as the server wants it. What one of them is told of the state of all is enough
for the whole team, so the clone answers once a cycle, for all of them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from teamclone.errors import LiveError
from teamclone.live.decisions import HISTORY, Decisions, Order
from teamclone.live.frames import LiveWorld
from teamclone.live.line_up import TypesByCoach, kicks_off
from teamclone.live.seats import Seats
from teamclone.protocol import agent
from teamclone.protocol.agent import MEASURED, FullState, Sense
from teamclone.protocol.udp import LOOPBACK
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

    Attributes:
        summary: what has become of the match so far.
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
    ) -> None:
        self._decisions, self._line_up, self._name = decisions, line_up, name
        self._host, self._coach_port = host, coach_port
        self._seats = Seats(name=name, goalkeeper=line_up.goalkeeper, host=host, port=port)
        self._coach: TypesByCoach | None = None
        self._world: LiveWorld | None = None
        self._cycle, self._blind = -1, 0
        self._moved_at: dict[int, int] = {}
        self._stopped = False
        self.summary = Summary()

    def stop(self, *_: object) -> None:
        """Have `play` end before its next cycle with KeyboardInterrupt; fit for a handler of signals.

        An error that a handler raises may come while a kernel makes its result in Python, and that ends the process.
        """
        self._stopped = True

    def play(self, *, connect_s: float = CONNECT_S) -> Summary:
        """Take part in a match until it is over.

        Raises:
            LiveError: the server is not there, refuses the team, sends no full state, or goes away during the match.
            KeyboardInterrupt: after `stop`.
        """
        begun = time.monotonic()
        try:
            while not self._ended():
                if self._stopped:
                    raise KeyboardInterrupt
                if not self._seats.side and time.monotonic() - begun > connect_s:
                    raise LiveError(
                        f"no server answers at {self._seats.where} after {connect_s:g} s; "
                        "start rcssserver first, or give its --port"
                    )
                self._seats.knock()
                self._seats.read(0.05)
                self._give_types()
                if self._seats.due:
                    self._answer()
        finally:
            self._seats.close()
            if self._coach is not None:
                self._coach.close()
        return self.summary

    def _ended(self) -> bool:
        """Return whether the match is over, and see that the server is still there."""
        silent = time.monotonic() - self._seats.heard_at
        left = self._seats.left
        if not left and (not self._seats.joined or silent < SILENT_S):
            return False
        if self.summary.over:
            return True
        what = "has gone" if left else f"has not said a word for {silent:.0f} s"
        raise LiveError(
            f"the server at {self._seats.where} {what}, after cycle {self._cycle}; see its output for the reason"
        )

    def _give_types(self) -> None:
        """Let the coach go on with giving types, until the kick-off."""
        seats = self._seats
        if not self._coach_port or self._cycle > 0 or not seats.joined:
            return
        if self._coach is None:
            self._coach = TypesByCoach(
                self._line_up, team=self._name, host=self._host, port=self._coach_port, version=seats.version
            )
        if not self._coach.done:
            whole = len(seats.joined) == N_TEAM and len(seats.parameters.types) >= N_TEAM
            self._coach.work(seats.parameters.type_columns, whole=whole)
        self.summary.types = self._coach.done and not self._coach.refusal

    def _answer(self) -> None:
        """Send the commands of a cycle."""
        began = self._seats.heard_at
        state, senses = self._seats.seen()
        if state is None:
            self._see_nothing()
            self._seats.answer({})
            return
        self._blind = 0
        orders, words = self._orders(state, senses), dict[int, list[str]]()
        for unum in self._there(state):
            order = orders.get(unum)
            said = [] if order is None or order.kind is None else [agent.command(order.kind, order.numbers)]
            if moment := self._to_the_ball(state, unum):
                said.append(agent.command(CommandKind.TURN_NECK, (moment,)))
            words[unum] = said
        self._seats.answer(words)
        self._take_note(state, began)

    def _see_nothing(self) -> None:
        self._blind += len(self._seats.joined) == N_TEAM
        if self._blind > _BLIND_CYCLES:
            side = "l" if self._seats.side > 0 else "r"
            raise LiveError(
                f"the server at {self._seats.where} sends no full state, which this clone needs; "
                f"start it with server::fullstate_{side}=on"
            )

    def _take_note(self, state: FullState, began: float) -> None:
        summary = self.summary
        summary.answer_ms.append(1000 * (time.monotonic() - began))
        summary.cycles += 1
        summary.missed += max(state.cycle - self._cycle - 1, 0) if self._cycle >= 0 else 0
        summary.scores, self._cycle = state.scores, state.cycle
        summary.over |= state.playmode == PlayMode.TIME_OVER
        summary.side, summary.returned = self._seats.side, self._seats.returned
        self._seats.expect(frozenset(self._there(state)))

    def _orders(self, state: FullState, senses: dict[int, Sense]) -> dict[int, Order]:
        """Return the body commands of a cycle by the numbers of the players."""
        seats = self._seats
        if self._world is None:
            if not seats.parameters.server or not seats.parameters.types:
                return {}
            self._world = LiveWorld(side=seats.side, parameters=seats.parameters, history=HISTORY)
        world, situation = self._world.add(state, senses), SITUATION[state.playmode]
        if situation == Situation.OTHER:
            return {}
        able = [unum for unum in self._there(state) if state.doing[self._slot(unum)] not in agent.HELD]
        orders = dict.fromkeys(able, _TURN_ZERO)
        if situation != Situation.BEFORE_KICK_OFF:
            keepers = [unum for unum in able if state.goalie[self._slot(unum)]]
            holders = keepers if state.held == seats.side else []
            decided = self._decisions.of(world, able, movers=holders, catchers=keepers)
            orders |= {unum: order for unum, order in decided.items() if order.kind is not None}
        if situation in (Situation.BEFORE_KICK_OFF, Situation.GOAL):
            orders |= self._to_places(state, world, able)
        return orders

    def _to_places(self, state: FullState, world: World, unums: Sequence[int]) -> dict[int, Order]:
        """Return what players do that line up for a kick-off: a move to their place, or nothing once they are there."""
        half = server_params.half_cycles(self._seats.parameters.server)
        own = kicks_off(state.playmode, cycle=state.cycle, side=self._seats.side, half_cycles=half)
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

    def _there(self, state: FullState) -> list[int]:
        """Return the numbers of the own players on the field."""
        return [unum for unum in range(1, N_TEAM + 1) if state.present[self._slot(unum)]]

    def _slot(self, unum: int) -> int:
        return unum - 1 + (0 if self._seats.side > 0 else N_TEAM)

    def _to_the_ball(self, state: FullState, unum: int) -> float:
        """Return the moment that turns a player's neck to the ball, as far as it can; 0 for none."""
        x, y, body, neck = state.measured[[_X, _Y, _BODY, _NECK], self._slot(unum)].tolist()
        towards = math.degrees(math.atan2(state.ball[1] - y, state.ball[0] - x))
        least, most = (
            server_params.number(self._seats.parameters.server, name) for name in ("minneckang", "maxneckang")
        )
        moment = min(max(math.remainder(towards - body, 360.0), least), most) - neck
        return moment if abs(moment) > _LEAST_TURN_NECK else 0.0
