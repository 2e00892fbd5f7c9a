"""The process that looks after one match: starts server and teams, watches them, says what came of it, ends them all.

Run as ``python -m teamclone.play.keeper``, with an `Order` as JSON in a line on standard input, which then stays
open: its end is the request to stop, so that a keeper ends with who asked for the match. The `Record` goes to standard
output.
"""

from __future__ import annotations

import dataclasses
import json
import os
import platform
import select
import shutil
import signal
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

import numpy as np
import psutil

from teamclone import __version__
from teamclone.errors import TeamcloneError
from teamclone.logs import find_matches, read_pair
from teamclone.logs.match import Match, Severity
from teamclone.play.holes import Holes, count_holes
from teamclone.play.monitor import Monitor, Scene
from teamclone.play.plan import N_UNUMS, Fixture, TeamSpec, filled_in
from teamclone.play.ports import held_ports
from teamclone.play.processes import MARK, adopt_orphans, end_all, start
from teamclone.play.record import Fault, Record, Side, Trouble, save_record
from teamclone.play.server import (
    gave_up,
    hashes,
    last_words,
    met_taken_port,
    programs_of,
    server_environment,
    server_report,
    server_words,
)
from teamclone.rcss.playmodes import PlayMode

STOPPED = 3
"""Exit code of a keeper that was asked to stop."""

SIDES = ("left", "right")
LEAST_ROOM = 32 << 20
"""Bytes that must be free: a match takes a quarter of it."""
FULL = 1 << 20
"""With less than this left, what went wrong is the disk's fault."""

_HOST = "127.0.0.1"
_POLL_S = 0.05
_ASK_S = 0.3
"""Between two requests to a server that is not up yet."""
_GONE_S = 0.3
"""From the first player that is gone to the verdict: others may be about to follow."""
_LEAVE_S = 1.0
"""How long teams have to go by themselves when the server is gone."""
_SERVER_LOG = "server.txt"


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """One attempt to make: ``folder`` is there and empty, ``server`` is the server's program."""

    fixture: Fixture
    folder: Path
    server: Path
    attempt: int

    def to_json(self) -> dict[str, Any]:
        return {**dataclasses.asdict(self), "folder": str(self.folder), "server": str(self.server)}

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Self:
        return cls(
            fixture=Fixture.from_json(values["fixture"]),
            folder=Path(values["folder"]),
            server=Path(values["server"]),
            attempt=values["attempt"],
        )


class _StoppedError(Exception):
    """Who asked for the match no longer wants it."""


class _FailedError(Exception):
    """The match cannot go on."""

    def __init__(self, fault: Fault, text: str, *, side: int | None = None, unums: Any = ()) -> None:
        super().__init__(text)
        self.fault, self.text, self.side, self.unums = fault, text, side, tuple(sorted(int(unum) for unum in unums))


class _Game:
    """A match while it is played."""

    def __init__(self, order: Order) -> None:
        self.order, self.fixture = order, order.fixture
        self.teams: tuple[TeamSpec, TeamSpec] = (order.fixture.left, order.fixture.right)
        self.output = order.folder / "output"
        self.output.mkdir()
        self.server: psutil.Popen | None = None
        self.clients: tuple[dict[str, psutil.Popen], dict[str, psutil.Popen]] = ({}, {})
        self.commands: dict[str, list[str]] = {}
        self.port = 0
        self.scene: Scene | None = None
        self.seen: tuple[set[int], set[int]] = (set(), set())
        self.heard_at = time.monotonic()
        self.gone_at: float | None = None
        self.kick_off_at: float | None = None
        self.end_at: float | None = None
        self.stop = False
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._ask_to_stop)

    def _ask_to_stop(self, *_: object) -> None:
        self.stop = True

    # What goes on.

    def look(self, monitor: Monitor | None = None, *, seconds: float = _POLL_S) -> None:
        """Wait a moment, then see what is new; raises what ends the match."""
        readable, _, _ = select.select([sys.stdin], [], [], seconds)
        if self.stop or (readable and not os.read(sys.stdin.fileno(), 1)):
            raise _StoppedError
        scene = monitor.latest() if monitor else None
        if scene is None:
            return
        now = time.monotonic()
        self.heard_at, self.scene = now, scene
        if scene.begun and self.kick_off_at is None:
            self.kick_off_at = now
        if scene.over:
            self.end_at = self.end_at or now
            return
        for side in range(2):
            gone = self.seen[side] - scene.present[side]
            self.seen[side].update(scene.present[side])
            if gone:
                self.gone_at = self.gone_at or now
                if now - self.gone_at > _GONE_S:
                    text = f"{self.who(side, gone)} gone{self.how_ended(side)}"
                    raise _FailedError(Fault.CRASHED, text, side=side, unums=gone)

    def who(self, side: int, unums: Any) -> str:
        numbers = sorted(int(unum) for unum in unums)
        if len(numbers) == N_UNUMS:
            return f"{self.teams[side].name}: the whole team is"
        plural = len(numbers) > 1
        return (
            f"{self.teams[side].name}: player{'s'[:plural]} {', '.join(map(str, numbers))} {'are' if plural else 'is'}"
        )

    def how_ended(self, side: int) -> str:
        """Processes of a team that ended by themselves, in words."""
        labels: dict[int, list[str]] = {}
        for label, client in self.clients[side].items():
            code = client.poll()
            if code is not None:
                labels.setdefault(code, []).append(label)
        told = [f"{', '.join(ended)} {_ending(code)}" for code, ended in labels.items()]
        return f" ({'; '.join(told)})" if told else ""

    def check_server(self) -> None:
        """Raises what ended the server, if it is not the end of the match."""
        assert self.server is not None
        code = self.server.poll()
        if code is None:
            if time.monotonic() - self.heard_at > self.fixture.limits.stall_s:
                raise _FailedError(Fault.STALLED, f"nothing from the server for {self.fixture.limits.stall_s:g} s")
            return
        words = self.server_output()
        if met_taken_port(words):
            raise _FailedError(Fault.NO_PORT, last_words(words))
        if self.scene is None:
            raise _FailedError(Fault.SERVER_START, f"the server {_ending(code)}: {last_words(words)}")
        if gave_up(words):
            raise _FailedError(Fault.HUNG, "the server waited for clients that did not answer")
        raise _FailedError(Fault.SERVER_DIED, f"the server {_ending(code)} before the end: {last_words(words)}")

    def server_output(self) -> str:
        with suppress(OSError):
            return (self.output / _SERVER_LOG).read_text("utf-8", "replace")
        return ""

    # The parts of a match.

    def play(self) -> None:
        """From the start of the server to its end."""
        started = time.monotonic()
        free = shutil.disk_usage(self.order.folder).free
        if free < LEAST_ROOM:
            raise _FailedError(
                Fault.DISK_FULL, f"{free / 1e6:.0f} MB are free, a match needs {LEAST_ROOM / 1e6:.0f} MB"
            )
        while True:
            try:
                with held_ports(any_block=self.fixture.takes_port) as port:
                    if port is None:
                        which = "no ports are" if self.fixture.takes_port else "the default port 6000 is not"
                        raise _FailedError(
                            Fault.NO_PORT, f"{which} free; teams without {{port}} in their commands need 6000"
                        )
                    self.port = port
                    self._play(started)
                    return
            except BlockingIOError:  # held by another match
                self.look(seconds=0.5)
                started = time.monotonic()

    def _play(self, started: float) -> None:
        self.start_server()
        monitor = Monitor(self.port)
        try:
            self.wait_for_server(monitor)
            self.bring_in_teams(monitor)
            while True:
                self.look(monitor)
                assert self.server is not None
                if self.end_at is not None and self.server.poll() is not None:
                    return
                self.check_server()
                if time.monotonic() - started > self.fixture.match_s:
                    raise _FailedError(Fault.TOO_LONG, f"not over after {self.fixture.match_s:g} s")
        finally:
            monitor.leave()

    def start_server(self) -> None:
        conf = self.order.folder / "conf"
        conf.mkdir()
        words = server_words(self.order.server, self.fixture, port=self.port, logs=self.order.folder)
        self.commands["server"] = words
        self.heard_at = time.monotonic()
        try:
            self.server = start(
                words,
                folder=self.order.folder,
                environment={**server_environment(conf), MARK: str(self.order.folder)},
                output=self.output / _SERVER_LOG,
            )
        except OSError as error:
            raise _FailedError(Fault.SERVER_START, f"{self.order.server}: {error.strerror}") from None

    def wait_for_server(self, monitor: Monitor) -> None:
        asked_at = 0.0
        while self.scene is None:
            if time.monotonic() - asked_at > _ASK_S:
                asked_at = time.monotonic()
                monitor.ask()
            self.look(monitor)
            self.check_server()

    def bring_in_teams(self, monitor: Monitor) -> None:
        """One after the other: the first to come is the left one, and a team's first is its goalkeeper."""
        began = [0.0, 0.0]
        for side, team in enumerate(self.teams):
            began[side] = time.monotonic()
            first, *others = team.clients()
            self.start_client(side, *first)
            self.wait_for_players(monitor, 1, side=side, began=began[side])
            for label, words in others:
                self.start_client(side, label, words)
        for side in range(2):
            self.wait_for_players(monitor, N_UNUMS, side=side, began=began[side])

    def wait_for_players(self, monitor: Monitor, number: int, *, side: int, began: float) -> None:
        while len(self.seen[side]) < number:
            self.look(monitor)
            self.check_server()
            broken = {
                label: client.poll() for label, client in self.clients[side].items() if client.poll() not in (None, 0)
            }
            if broken:
                label, code = next(iter(broken.items()))
                words = last_words((self.output / f"{SIDES[side]}-{label}.txt").read_text("utf-8", "replace"))
                text = f"{self.teams[side].name}: {label} {_ending(code)} before the kick-off: {words}"
                raise _FailedError(Fault.TEAM_START, text, side=side)
            if time.monotonic() - began > self.fixture.limits.connect_s:
                count = len(self.seen[side])
                text = (
                    f"{self.teams[side].name}: {count} of {N_UNUMS} players connected within "
                    f"{self.fixture.limits.connect_s:g} s{self.how_ended(side)}"
                )
                raise _FailedError(Fault.NOT_CONNECTED, text, side=side)

    def start_client(self, side: int, label: str, words: list[str]) -> None:
        team = self.teams[side]
        values = {
            "host": _HOST,
            "port": self.port,
            "coach_port": self.port + 1,
            "olcoach_port": self.port + 2,
            "team": team.name,
            "folder": team.folder,
        }
        words = filled_in(words, values)
        environment = dict(zip(team.environment, filled_in(list(team.environment.values()), values), strict=True))
        self.commands[f"{SIDES[side]}-{label}"] = words
        try:
            self.clients[side][label] = start(
                words,
                folder=Path(team.folder),
                environment={**environment, MARK: str(self.order.folder)},
                output=self.output / f"{SIDES[side]}-{label}.txt",
            )
        except OSError as error:
            text = f"{team.name}: {words[0]}: {error.strerror}"
            raise _FailedError(Fault.TEAM_START, text, side=side) from None

    # The end.

    def finish(self, failed: _FailedError | None) -> tuple[dict[str, dict[str, int | None]], int | None]:
        """End all processes; how those ended that did so by themselves, and the server."""
        code = None
        if self.server is not None:
            if failed is None:
                psutil.wait_procs([*self.clients[0].values(), *self.clients[1].values()], timeout=_LEAVE_S)
            else:
                with suppress(psutil.NoSuchProcess):
                    self.server.terminate()  # it then closes its logs
                with suppress(psutil.TimeoutExpired):
                    self.server.wait(1)
            code = self.server.poll()
        exits = {
            SIDES[side]: {label: client.poll() for label, client in self.clients[side].items()} for side in range(2)
        }
        end_all()
        return exits, code


def keep(order: Order) -> Record:
    """Play a match as ordered and say what came of it; nothing of it runs afterwards.

    Raises:
        _StoppedError: it was asked to stop.
    """
    began, now = time.monotonic(), datetime.now(UTC)
    game = _Game(order)
    failed: _FailedError | None = None
    try:
        game.play()
    except _FailedError as error:
        failed = error
    except OSError as error:  # of our own files
        failed = _FailedError(Fault.DISK_FULL if _is_full(order.folder) else Fault.KEEPER_DIED, f"{error}")
    finally:
        exits, _ = game.finish(failed)
    match, holes, problem = _read(order.folder)
    if failed is None:
        failed = _verdict(game, match, holes, problem)
    elif failed.fault is Fault.HUNG and holes is not None:
        failed = _who_hung(game, holes) or failed
    if failed is not None and failed.fault in (Fault.SERVER_DIED, Fault.BAD_LOGS) and _is_full(order.folder):
        failed = _FailedError(Fault.DISK_FULL, f"no room is left ({failed.text})")
    shutil.rmtree(order.folder / "conf", ignore_errors=True)
    record = _record(game, failed, match, holes, exits)
    return dataclasses.replace(
        record,
        started=now.isoformat(timespec="seconds"),
        seconds=round(time.monotonic() - began, 2),
        play_seconds=round(game.end_at - game.kick_off_at, 2) if game.end_at and game.kick_off_at else 0.0,
    )


def _read(folder: Path) -> tuple[Match | None, Holes | None, str | None]:
    """The match in a folder with its holes, and what is wrong with it."""
    try:
        pairs = find_matches([folder])
        if len(pairs) != 1 or pairs[0].rcg is None or pairs[0].rcl is None:
            return None, None, f"expected one game log and one command log, got {len(pairs)} matches"
        match = read_pair(pairs[0])
        holes = count_holes(match) if len(match.frames["cycle"]) else None
    except TeamcloneError as error:
        return None, None, str(error)
    worst = [problem for problem in match.problems if problem.severity is not Severity.NOTE]
    return match, holes, str(worst[0]) if worst else None


def _verdict(game: _Game, match: Match | None, holes: Holes | None, problem: str | None) -> _FailedError | None:
    """What speaks against a match whose server ended by itself."""
    if match is None or holes is None or problem:
        return _FailedError(Fault.BAD_LOGS, problem or "the game log has no frame")
    last, mode = int(match.frames["cycle"][-1]), match.frames["playmode"][-1]
    if not match.game.complete or mode != PlayMode.TIME_OVER or last < game.fixture.server.cycles:
        return _FailedError(Fault.BAD_LOGS, f"the game log ends at cycle {last} of {game.fixture.server.cycles}")
    return _who_vanished(game, match) or _who_hung(game, holes, least=game.fixture.limits.silent_cycles)


def _who_vanished(game: _Game, match: Match) -> _FailedError | None:
    """The team with players who were gone before the end, perhaps too shortly before it to be seen."""
    gone = ((match.players["state"] == 0) & (match.frames["playmode"] != PlayMode.TIME_OVER)[:, None]).any(0)
    for side in range(2):
        unums = 1 + np.flatnonzero(gone[side * N_UNUMS : (side + 1) * N_UNUMS])
        if len(unums):
            text = f"{game.who(side, unums)} gone before the end"
            return _FailedError(Fault.CRASHED, text, side=side, unums=unums)
    return None


def _who_hung(game: _Game, holes: Holes, *, least: int = 1) -> _FailedError | None:
    """The team with the players that went silent."""
    silence = holes.longest_silence if least > 1 else np.where(holes.last_heard < holes.last_heard.max(), least, 0)
    for side in range(2):
        unums = 1 + np.flatnonzero(silence[side * N_UNUMS : (side + 1) * N_UNUMS] >= max(least, 1))
        if len(unums):
            text = f"{game.who(side, unums)} silent"
            text += f" for {least} cycles and more" if least > 1 else ""
            return _FailedError(Fault.HUNG, text, side=side, unums=unums)
    return None


def _record(
    game: _Game,
    failed: _FailedError | None,
    match: Match | None,
    holes: Holes | None,
    exits: dict[str, dict[str, int | None]],
) -> Record:
    order, fixture, output = game.order, game.fixture, game.server_output()
    cycle = game.scene.cycle if game.scene else None
    sides = []
    for side, team in enumerate(game.teams):
        played = None if match is None else (match.left, match.right)[side]
        mine = slice(side * N_UNUMS, (side + 1) * N_UNUMS)
        counts = {
            name: None if holes is None or failed else tuple(int(count) for count in getattr(holes, name)[mine])
            for name in ("holes", "clashes", "missed")
        }
        commands = [words for label, words in game.commands.items() if label.startswith(f"{SIDES[side]}-")]
        sides.append(
            Side(
                team=team.name,
                name=played.name if played else game.scene.names[side] if game.scene else None,
                score=played.score if played else 0,
                files=hashes(programs_of(Path(team.folder), commands)),
                exits=exits[SIDES[side]],
                **counts,
            )
        )
    logs = () if match is None else (match.rcg_path, match.rcl_path)
    trouble = None
    if failed is not None:
        side_name = None if failed.side is None else SIDES[failed.side]
        trouble = Trouble(fault=failed.fault, text=failed.text, side=side_name, unums=failed.unums, cycle=cycle)
    return Record(
        id=fixture.id,
        fingerprint=fixture.fingerprint,
        attempt=order.attempt,
        left=sides[0],
        right=sides[1],
        trouble=trouble,
        cycles=int(match.frames["cycle"][-1]) if match and len(match.frames["cycle"]) else 0,
        logs=tuple(path.name for path in logs if path),
        server={
            **server_report(output),
            "files": hashes([order.server]),
            "options": fixture.server.options,
            "player_types_seed": fixture.seed,
        },
        commands=game.commands,
        ports=tuple(game.port + offset for offset in range(3)) if game.port else (),
        machine=platform.node(),
        cpus=os.cpu_count() or 1,
        teamclone=__version__,
    )


def _is_full(folder: Path) -> bool:
    try:
        return shutil.disk_usage(folder).free < FULL
    except OSError:
        return False


def _ending(code: int | None) -> str:
    """An exit code in words."""
    if code is None:
        return "still runs"
    if code < 0:
        with suppress(ValueError):
            return f"was ended by {signal.Signals(-code).name}"
    return f"ended with code {code}"


def main() -> None:
    line = b""
    while not line.endswith(b"\n"):  # byte by byte: a buffer would hide the end of the stream
        line += os.read(0, 1) or b"\n"
    if not line.strip():
        sys.exit(STOPPED)
    adopt_orphans()
    order = Order.from_json(json.loads(line))
    try:
        record = keep(order)
    except _StoppedError:
        sys.exit(STOPPED)
    with suppress(OSError):
        save_record(order.folder, record)
    json.dump(record.to_json(), sys.stdout)


if __name__ == "__main__":
    main()
