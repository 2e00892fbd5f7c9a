"""A match while it is played: server and teams are started, watched as a monitor does, and ended."""

from __future__ import annotations

import os
import select
import shutil
import signal
import sys
import time
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import psutil

from teamclone.errors import PlayError
from teamclone.play.ports import held_ports
from teamclone.play.processes import MARK, end_all, start
from teamclone.play.record import FailedError, Fault, who
from teamclone.play.schedule import Fixture, TeamSpec, filled_in
from teamclone.play.server import coach_connected, last_words, met_taken_port, server_environment, server_words
from teamclone.protocol.client import MonitorClient
from teamclone.protocol.monitor import Show, load_reader
from teamclone.protocol.udp import LOOPBACK
from teamclone.rcss.playmodes import PlayMode

SIDES = ("left", "right")
LEAST_ROOM = 32 << 20
"""Bytes that must be free: a match takes a quarter of it."""

_POLL_S = 0.05
_LOOK_S = 2.0
"""Between two looks at a running match."""
_GONE_S = 0.3
"""From the first player that is gone to the verdict, in case others follow."""
_ASK_S = 1.0
"""Between two requests to kick off."""
_LEAVE_S = 1.0
"""How long teams may take to end by themselves after the server."""
_SERVER_LOG = "server.txt"
_FROM_OUTSIDE = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Signals that say nothing about the program that they end."""


class StoppedError(Exception):
    """The match is no longer wanted."""


class Game:
    """A match while it is played.

    Args:
        folder: where to, there and empty.
        program: the server.
    """

    def __init__(self, fixture: Fixture, *, folder: Path, program: Path) -> None:
        self.fixture, self.folder, self.program = fixture, folder, program
        self.teams: tuple[TeamSpec, TeamSpec] = (fixture.left, fixture.right)
        self.output = folder / "output"
        self.output.mkdir()
        self.held = ExitStack()
        self.server: psutil.Popen | None = None
        self.clients: tuple[dict[str, psutil.Popen], dict[str, psutil.Popen]] = ({}, {})
        self.commands: dict[str, list[str]] = {}
        self.port = 0
        self.show: Show | None = None
        self.seen: tuple[set[int], set[int]] = (set(), set())
        self.team_at = [0.0, 0.0]
        self.awaited: dict[int, float] = {}  # by side, when a coach was started that is not there yet
        self.began_at = self.heard_at = time.monotonic()
        self.gone_at: float | None = None
        self.kick_off_at: float | None = None
        self.end_at: float | None = None
        self.stop = False
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._ask_to_stop)

    def _ask_to_stop(self, *_: object) -> None:
        self.stop = True

    def look(self, monitor: MonitorClient | None = None, *, seconds: float = _POLL_S) -> None:
        """Wait a moment, then take in the monitor's newest cycle.

        Args:
            monitor: None before the server shows anything.
            seconds: how long to wait.

        Raises:
            FailedError: players are gone.
            StoppedError: the match is no longer wanted.
        """
        readable, _, _ = select.select([sys.stdin], [], [], seconds)
        if self.stop or (readable and not os.read(sys.stdin.fileno(), 1)):
            raise StoppedError
        show = monitor.latest() if monitor else None
        if show is None:
            return
        now = time.monotonic()
        self.heard_at, self.show = now, show
        if show.begun and self.kick_off_at is None:
            self.kick_off_at = now
        if show.over:
            self.end_at = self.end_at or now
            return
        missing = False
        for side, present in enumerate(show.present):
            gone = self.seen[side] - present
            self.seen[side].update(present)
            if gone:
                missing = True
                self.gone_at = self.gone_at or now
                if now - self.gone_at > _GONE_S:
                    text = f"{who(self.teams[side], gone)} gone{self.how_ended(side)}"
                    raise FailedError(Fault.CRASHED, text, side=side, unums=gone)
        if not missing:
            self.gone_at = None

    def how_ended(self, side: int) -> str:
        """Describe which processes of a team ended by themselves, and how."""
        labels: dict[int, list[str]] = {}
        for label, client in self.clients[side].items():
            code = client.poll()
            if code is not None:
                labels.setdefault(code, []).append(label)
        ended = [f"{', '.join(names)} {_ending(code)}" for code, names in labels.items()]
        return f" ({'; '.join(ended)})" if ended else ""

    def is_over(self, *, kicked_off: bool = True) -> bool:
        """Return whether the server has ended, or is silent after the end of the match.

        Args:
            kicked_off: False while teams are still to come, when the server should not end at all.

        Raises:
            FailedError: it ended in another way, or gives no sign of life.
        """
        code = None if self.server is None else self.server.poll()
        if code is None:
            silent = time.monotonic() - self.heard_at > self.fixture.limits.stall_s
            if silent and self.end_at is None:
                raise FailedError(Fault.STALLED, f"nothing from the server for {self.fixture.limits.stall_s:g} s")
            return silent
        words = self.server_output()
        if met_taken_port(words):
            raise FailedError(Fault.NO_PORT, last_words(words))
        if self.show is None:
            fault = Fault.SERVER_DIED if -code in _FROM_OUTSIDE else Fault.SERVER_START
            raise FailedError(fault, f"the server {_ending(code)}: {last_words(words)}")
        if code != 0 or not kicked_off:
            raise FailedError(Fault.SERVER_DIED, f"the server {_ending(code)} before the end: {last_words(words)}")
        self.end_at = self.end_at or time.monotonic()
        return True

    def server_output(self) -> str:
        """Return the server's output so far."""
        with suppress(OSError):
            return (self.output / _SERVER_LOG).read_text("utf-8", "replace")
        return ""

    def play(self) -> None:
        """Play from the start of the server to its end. Afterwards call `finish`, whatever happened.

        Raises:
            FailedError: the match failed.
            StoppedError: the match is no longer wanted.
        """
        load_reader()
        self.port = self.take_port()
        self.began_at = time.monotonic()
        free = shutil.disk_usage(self.folder).free
        if free < LEAST_ROOM:
            text = f"{free / 1e6:.0f} MB are free, a match needs {LEAST_ROOM / 1e6:.0f} MB"
            raise FailedError(Fault.DISK_FULL, text)
        self.start_server()
        with closing(MonitorClient(self.port)) as monitor:
            self.wait_for_server(monitor)
            self.bring_in_teams(monitor)
            if not self.fixture.whole_teams:
                self.kick_off(monitor)
            while not self.is_over():
                # When a player is gone, wait to see which others are.
                watching = self.kick_off_at is None or self.gone_at is not None
                monitor.rest_s = 0.0 if watching else min(_LOOK_S, self.fixture.limits.stall_s / 4)
                self.look(monitor)
                if self.kick_off_at is None:
                    self.check_clients(monitor)
                self.check_coaches()
                if time.monotonic() - self.began_at > self.fixture.match_s:
                    if self.end_at is not None:
                        break
                    raise FailedError(Fault.TOO_LONG, f"not over after {self.fixture.match_s:g} s")
            self.check_coaches(ended=True)

    def take_port(self) -> int:
        """Take three ports in a row until the processes have ended; return the first."""
        while True:
            try:
                port = self.held.enter_context(held_ports(any_block=self.fixture.takes_port))
            except PlayError as error:
                raise FailedError(Fault.NO_PORT, str(error)) from None
            except BlockingIOError:  # another match has the default, and will give it back
                self.look(seconds=0.5)
                continue
            if port is None:
                which = "no ports are" if self.fixture.takes_port else "the default port 6000 is not"
                text = f"{which} free; teams without {{port}} in their commands need 6000"
                raise FailedError(Fault.NO_PORT, text)
            return port

    def start_server(self) -> None:
        """Start the server in the folder of the match."""
        conf = self.folder / "conf"
        conf.mkdir()
        words = server_words(self.program, self.fixture, port=self.port)
        self.commands["server"] = words
        self.heard_at = time.monotonic()
        try:
            self.server = start(
                words,
                folder=self.folder,
                environment={**server_environment(conf), MARK: str(self.folder)},
                output=self.output / _SERVER_LOG,
            )
        except OSError as error:
            raise FailedError(Fault.SERVER_START, f"{self.program}: {error.strerror}") from None

    def wait_for_server(self, monitor: MonitorClient) -> None:
        """Wait until the server answers the monitor."""
        while self.show is None:
            self.look(monitor)
            self.is_over(kicked_off=False)

    def bring_in_teams(self, monitor: MonitorClient) -> None:
        """Start one client after the other, so that each gets a known number; the left goalkeeper first."""
        waiting = [team.clients() for team in self.teams]
        number = 0
        while any(waiting):
            number += 1
            for side in range(2):
                if waiting[side]:
                    self.team_at[side] = self.team_at[side] or time.monotonic()
                    self.start_client(side, *waiting[side].pop(0))
                    if number == 1:
                        self.wait_for_players(monitor, 1, side=side)
            for side in range(2):
                if waiting[side]:
                    self.wait_for_players(monitor, number, side=side)
        for side in range(2):
            self.wait_for_players(monitor, self.teams[side].players, side=side)

    def wait_for_players(self, monitor: MonitorClient, number: int, *, side: int) -> None:
        """Wait until so many players of a side have connected."""
        while len(self.seen[side]) < number:
            self.look(monitor)
            self.is_over(kicked_off=False)
            self.check_clients(monitor)
            if time.monotonic() - self.team_at[side] > self.fixture.limits.connect_s:
                count, team = len(self.seen[side]), self.teams[side]
                text = (
                    f"{team.name}: {count} of {team.players} players connected within "
                    f"{self.fixture.limits.connect_s:g} s{self.how_ended(side)}"
                )
                raise FailedError(Fault.NOT_CONNECTED, text, side=side)

    def kick_off(self, monitor: MonitorClient) -> None:
        """Have the server kick off once the coaches are there, too; by itself it waits for eleven players a side."""
        asked = False
        ask_at = time.monotonic() + self.fixture.server.kick_off_wait_s
        while self.show is not None and self.show.playmode == PlayMode.BEFORE_KICK_OFF:
            if any(self.clients[side]["coach"].poll() is None for side in self.awaited):
                ask_at = max(ask_at, time.monotonic() + _POLL_S)
            elif time.monotonic() > ask_at:
                monitor.kick_off()
                asked = True
                ask_at = time.monotonic() + _ASK_S
            self.look(monitor)
            if self.is_over(kicked_off=asked):
                return
            self.check_clients(monitor)
            self.check_coaches()

    def check_coaches(self, *, ended: bool = False) -> None:
        """Raise FailedError if a coach that the schedule names did not connect in time, or at all.

        Args:
            ended: True after the match, when none can connect any more.
        """
        for side, started in list(self.awaited.items()):
            code = self.clients[side]["coach"].poll()
            name = self.show.names[side] if self.show else None
            if coach_connected(self.server_output(), name) is not False:
                del self.awaited[side]
            elif ended or code not in (None, 0) or time.monotonic() - started > self.fixture.limits.connect_s:
                words = last_words((self.output / f"{SIDES[side]}-coach.txt").read_text("utf-8", "replace"))
                text = f"{self.teams[side].name}: the coach never connected, it {_ending(code)}: {words}"
                raise FailedError(Fault.NOT_CONNECTED, text, side=side)

    def check_clients(self, monitor: MonitorClient) -> None:
        """Raise FailedError if a process ended before the kick-off, unless it ended well, as scripts do."""
        for side in range(2):
            for label, client in self.clients[side].items():
                code = client.poll()
                if code not in (None, 0):
                    self.look(monitor, seconds=0.0)  # the match may have begun before it ended
                    if self.kick_off_at is not None:
                        return
                    words = last_words((self.output / f"{SIDES[side]}-{label}.txt").read_text("utf-8", "replace"))
                    text = f"{self.teams[side].name}: {label} {_ending(code)} before the kick-off: {words}"
                    raise FailedError(Fault.TEAM_START, text, side=side)

    def start_client(self, side: int, label: str, words: list[str]) -> None:
        """Start a client in its team's folder."""
        team = self.teams[side]
        values = {
            "host": LOOPBACK,
            "port": self.port,
            "coach_port": self.port + 1,
            "olcoach_port": self.port + 2,
            "team": team.name,
            "folder": team.folder,
        }
        words = filled_in(words, values)
        environment = dict(zip(team.environment, filled_in(list(team.environment.values()), values), strict=True))
        self.commands[f"{SIDES[side]}-{label}"] = words
        if team.coach and label == "coach":
            self.awaited[side] = time.monotonic()
        try:
            self.clients[side][label] = start(
                words,
                folder=Path(team.folder),
                environment={**environment, MARK: str(self.folder)},
                output=self.output / f"{SIDES[side]}-{label}.txt",
            )
        except OSError as error:
            text = f"{team.name}: {words[0]}: {error.strerror}"
            raise FailedError(Fault.TEAM_START, text, side=side) from None

    def finish(self, *, failed: bool) -> dict[str, dict[str, int | None]]:
        """End all processes; return how those of the teams ended that did so by themselves, by side and label."""
        if self.server is not None and self.server.poll() is None:
            with suppress(psutil.NoSuchProcess):
                self.server.terminate()  # it then closes its logs
            with suppress(psutil.TimeoutExpired):
                self.server.wait(1)
        if not failed:
            psutil.wait_procs([*self.clients[0].values(), *self.clients[1].values()], timeout=_LEAVE_S)
        exits = {
            SIDES[side]: {label: client.poll() for label, client in self.clients[side].items()} for side in range(2)
        }
        end_all()
        self.held.close()
        return exits


def _ending(code: int | None) -> str:
    """Return an exit code in words."""
    if code is None:
        return "still runs"
    if code < 0:
        with suppress(ValueError):
            return f"was ended by {signal.Signals(-code).name}"
    return f"ended with code {code}"
