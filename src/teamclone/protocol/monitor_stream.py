"""Everything that a server shows a monitor, in order: one thread reads the socket and does nothing else.

`client.MonitorClient` asks for the newest cycle now and then; this one takes every cycle of a whole match, and before
them the parameters. A datagram is never trusted: what is not from the server, or no message of a monitor, is dropped.
"""

from __future__ import annotations

import queue
import re
import socket
import sys
import threading
import time
from collections import deque
from contextlib import suppress
from typing import Literal, NamedTuple

from teamclone.errors import LiveError
from teamclone.protocol import monitor
from teamclone.protocol.monitor import Show
from teamclone.protocol.parameters import Parameters
from teamclone.protocol.udp import LOOPBACK, address_of, open_socket

BUFFER_BYTES = 4 << 20
"""Asked of the system for datagrams that are not read yet: some hundred cycles."""
_WAITING = 20_000
"""Most datagrams that are read and not taken: the cycles of three matches."""
_ASK_S = 0.3
"""Seconds between two requests to a server that does not answer."""
_HELD, _PORTS = 64, 8
"""Most datagrams that are kept of each of the first ports that answer, until one of them shows the match."""
_SHOWS_WITHOUT = 5
"""Cycles that come without all parameters before the server is asked for them again: a datagram may be lost."""
_STAMPED = 35 if sys.platform == "linux" else None
"""SO_TIMESTAMPNS: the system says when a datagram arrived, however late it is read. Python has no name for it."""
_VERSIONS: tuple[Literal[5, 4, 3], ...] = (5, 4, 3)
"""Text versions in the order in which they are asked for."""

_MESSAGE = re.compile(rb'\(msg (\d{1,10}) (\d{1,3}) "[^\0\r\n]*"\)')


class Received(NamedTuple):
    """A datagram; ``at`` is when it arrived, nanoseconds of `time.time_ns`."""

    data: bytes
    address: tuple[str, int]
    at: int


class Frame(NamedTuple):
    """A cycle, its record as it came, and when: see `Received`."""

    show: Show
    text: bytes
    at: int


class Message(NamedTuple):
    """A ``(msg CYCLE BOARD "...")`` as it came: words of the referee, substitutions, team graphics."""

    text: bytes


class MonitorStream:
    """A connection to a server that shows its match.

    Only datagrams from its host count, and only those of the port that first shows the match: each monitor is served
    from a port of its own. What a stranger's port says is dropped.

    Attributes:
        parameters: of the match, once `next` has returned a frame. version: of the text that is asked for.
        dropped: datagrams of the server that were no message of a monitor, and those beyond what is kept.
        buffer_bytes: what the system keeps of datagrams that are not read yet.
    """

    def __init__(self, port: int, *, host: str = LOOPBACK) -> None:
        self._server = (address_of(host), port)
        self.parameters, self.version = Parameters(), _VERSIONS[0]
        self.dropped = 0
        self._served_at: tuple[str, int] | None = None
        self._left: set[tuple[str, int]] = set()
        self._held: dict[tuple[str, int], list[Received]] = {}
        self._ready: deque[Frame | Message] = deque()
        self._asked, self._ask_at, self._without = False, 0.0, 0
        self._waiting: queue.SimpleQueue[Received] = queue.SimpleQueue()
        self._socket = open_socket(host, buffer_bytes=BUFFER_BYTES)
        self.buffer_bytes = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
        if _STAMPED is not None:
            self._socket.setsockopt(socket.SOL_SOCKET, _STAMPED, 1)
        self._socket.settimeout(0.2)
        self._closing = threading.Event()
        self._reader = threading.Thread(target=self._read, name="monitor", daemon=True)
        self._reader.start()

    @property
    def behind(self) -> int:
        """How many datagrams are read and not taken yet."""
        return len(self._ready) + self._waiting.qsize()

    def next(self, timeout: float) -> Frame | Message | None:
        """Return what came next; None where nothing does within some seconds. No frame comes before all parameters.

        Raises:
            LiveError: the server takes no more monitors, or none that reads what we do.
        """
        until = time.monotonic() + timeout
        while not self._ready:
            now = time.monotonic()
            if self._served_at is None and now >= self._ask_at:
                self._send(monitor.init(self.version), self._server)
                self._asked, self._ask_at = True, now + _ASK_S
            left = until - now
            if left < 0:
                return None
            with suppress(queue.Empty):
                self._take(self._waiting.get(timeout=left if self._served_at is not None else min(left, _ASK_S)))
        return self._ready.popleft()

    def close(self) -> None:
        """Send the server a farewell, end the thread and close the socket."""
        if self._served_at is not None:
            self._send(monitor.bye(), self._served_at)
        self._closing.set()
        self._reader.join()
        self._socket.close()

    def _read(self) -> None:
        """Read the socket until it is closed; runs in a thread of its own."""
        while not self._closing.is_set():
            try:
                data, extra, _, address = self._socket.recvmsg(monitor.MAX_BYTES + 1, 64)
            except TimeoutError:
                continue
            except OSError:  # an earlier request met no server
                self._closing.wait(0.01)
                continue
            served_at = self._served_at
            if (address[0] != self._server[0]) if served_at is None else (address != served_at):
                continue
            if len(data) > monitor.MAX_BYTES or self._waiting.qsize() >= _WAITING:
                self.dropped += 1
                continue
            self._waiting.put(Received(data, address, _stamp(extra)))

    def _take(self, got: Received) -> None:
        """Sort a datagram: of the server, of a port that may be its, or of nobody."""
        if not self._asked or got.address in self._left:
            return
        if self._served_at is None:
            show = monitor.show_of(got.data)
            if show is None:
                self._hold(got)
                return
            self._served_at = got.address
            for held in self._held.pop(got.address, ()):
                self._sort(held)
            self._held.clear()
            self._add(show, got)
        elif got.address == self._served_at:
            self._sort(got)

    def _hold(self, got: Received) -> None:
        text = _text(got.data)
        refused = text if got.address == self._server else None
        if refused == b"(error no_more_monitor)":
            raise LiveError(f"{_words(self._server)}: the server takes no more monitors (server::max_monitors)")
        if refused == b"(error illegal_client_version)":
            if self.version == _VERSIONS[-1]:
                raise LiveError(
                    f"{_words(self._server)}: the server knows no text version of monitors from {_VERSIONS[-1]} to "
                    f"{_VERSIONS[0]}; it needs rcssserver 12.1 or later"
                )
            self.version, self._ask_at = _VERSIONS[_VERSIONS.index(self.version) + 1], 0.0
        elif got.address in self._held or len(self._held) < _PORTS:
            held = self._held.setdefault(got.address, [])
            if len(held) < _HELD:
                held.append(got)

    def _sort(self, got: Received) -> None:
        """Take in a datagram of the server."""
        show = monitor.show_of(got.data)
        if show is not None:
            self._add(show, got)
            return
        text = _text(got.data)
        if _MESSAGE.fullmatch(text):
            self._ready.append(Message(text))
        elif not self.parameters.take(text):
            self.dropped += 1

    def _add(self, show: Show, got: Received) -> None:
        """Give out a frame; where parameters were lost, ask for them again instead."""
        if self.parameters.whole:
            self._ready.append(Frame(show, _text(got.data), got.at))
            return
        self._without += 1
        if self._without >= _SHOWS_WITHOUT and self._served_at is not None:
            self._send(monitor.bye(), self._served_at)
            self._left.add(self._served_at)
            self._served_at, self._without, self._ask_at = None, 0, 0.0

    def _send(self, message: bytes, address: tuple[str, int]) -> None:
        with suppress(OSError):
            self._socket.sendto(message, address)


def _text(data: bytes) -> bytes:
    """Return a datagram without the zero at its end."""
    return data.partition(b"\0")[0]


def _words(address: tuple[str, int]) -> str:
    return f"{address[0]} port {address[1]}"


def _stamp(extra: list[tuple[int, int, bytes]]) -> int:
    """Return when a datagram arrived, by what the system says of it; now, where it says nothing."""
    for level, kind, data in extra:
        if level == socket.SOL_SOCKET and kind == _STAMPED and len(data) == 16:
            seconds, nanoseconds = (int.from_bytes(part, sys.byteorder) for part in (data[:8], data[8:]))
            return seconds * 1_000_000_000 + nanoseconds
    return time.time_ns()
