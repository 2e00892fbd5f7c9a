"""A server that shows a match of a game log to monitors, as rcssserver would, in this process."""

from __future__ import annotations

import re
import socket
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from teamclone.logs.inflate import read_bytes
from teamclone.rcss.playmodes import BY_NAME

LOOPBACK = "127.0.0.1"
Send = Callable[[bytes], None]


def parameters_of(log: Path) -> list[bytes]:
    """The messages that a monitor gets first."""
    lines = read_bytes(log)[0].split(b"\n")
    return [line for line in lines if line.startswith((b"(server_param", b"(player_param", b"(player_type"))]


def shows_of(log: Path, *, waiting: int = 3) -> Iterator[bytes]:
    """The cycles of a text log as monitors get them, some before the kick-off first."""
    mode, teams = b"1", b"null null 0 0"
    for line in read_bytes(log)[0].split(b"\n"):
        if found := re.match(rb"\(playmode \d+ (\w+)\)", line):
            mode = b"%d" % BY_NAME[found[1].decode()]
        elif found := re.match(rb"\(team \d+ (.*)\)", line):
            teams = found[1]
        elif found := re.match(rb"\(show (\d+) ", line):
            for _ in range(waiting):
                yield b"(show 0 (pm 1) (tm %b) %b" % (teams, line[found.end() :])
            waiting = 0
            yield b"(show %b (pm %b) (tm %b) %b" % (found[1], mode, teams, line[found.end() :])


class Showing:
    """A server with one monitor: it answers its request from a port of its own, with parameters and then shows.

    Attributes:
        port: where monitors ask. requests: what they sent there. address: of the monitor. sent: how many shows.
    """

    def __init__(self, parameters: Iterable[bytes], shows: Iterable[bytes], *, pause_s: float = 0.001) -> None:
        self.parameters, self.shows, self.pause_s = list(parameters), shows, pause_s
        self.requests: list[bytes] = []
        self.sent = 0
        self.address: tuple[str, int] | None = None
        self.known, self.own = (self._socket() for _ in range(2))
        self.port: int = self.known.getsockname()[1]
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _socket(self) -> socket.socket:
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.bind((LOOPBACK, 0))
        made.settimeout(0.05)
        return made

    def __enter__(self) -> Showing:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        self.known.close()
        self.own.close()

    def send(self, data: bytes) -> None:
        assert self.address is not None
        self.own.sendto(data + b"\0", self.address)

    def greet(self) -> None:
        """What a new monitor gets first."""
        for text in self.parameters:
            self.send(text)

    def _run(self) -> None:
        while self.address is None and not self._over.is_set():
            self._listen()
        self.greet() if self.address else None
        for show in self.shows:
            if self._over.is_set():
                return
            self.send(show)
            self.sent += 1
            time.sleep(self.pause_s)

    def _listen(self) -> None:
        try:
            data, self.address = self.known.recvfrom(1000)
        except TimeoutError:
            return
        self.requests.append(data)
