"""The socket of a monitor: it asks a server to show the match, and again where the server does not answer.

In synchronous mode the server pauses for monitors, 20 ms in 32 cycles, so one that can looks in only now and then.
"""

from __future__ import annotations

import time
from contextlib import suppress

from teamclone.protocol import monitor
from teamclone.protocol.monitor import Show
from teamclone.protocol.udp import LOOPBACK, address_of, open_socket

_ASK_S = 0.3
"""Seconds between two requests to a server that does not answer."""
_SILENT_S = 3.0
"""Seconds after which a server that has answered is asked again."""
_BUFFER = 1 << 20
"""Bytes that the socket keeps."""
_MOST_DATAGRAMS = 512
"""Read in one go: more than the socket keeps, and an end to a flood."""


class MonitorClient:
    """A connection to a server.

    Only datagrams from its host count, and once it shows the match only those from the port that it shows it from.

    Attributes:
        rest_s: how long to be away once something was seen; 0 stays.
    """

    def __init__(self, port: int, *, host: str = LOOPBACK) -> None:
        self.rest_s = 0.0
        self._server = (address_of(host), port)
        self._served_at: tuple[str, int] | None = None  # the server answers each monitor from a port of its own
        self._ask_at = self._heard_at = 0.0
        self._asked = False
        self._socket = open_socket(host, buffer_bytes=_BUFFER)

    def latest(self) -> Show | None:
        """Return the newest cycle that has come since the last call; None where none has. Never waits."""
        show = self._newest()
        now = time.monotonic()
        if show is not None:
            self._heard_at = now
        elif self._served_at is not None and now - self._heard_at > _SILENT_S:
            self._served_at = None
        if self._served_at is not None and self.rest_s:
            self._leave()
            self._ask_at = now + self.rest_s
        elif self._served_at is None and now >= self._ask_at:
            self._send(monitor.init(), self._server)
            self._asked = True
            self._ask_at = now + _ASK_S
        return show

    def kick_off(self) -> None:
        """Ask the server to kick off; it is not asked while it does not show the match."""
        if self._served_at is not None:
            self._send(monitor.kick_off(), self._served_at)

    def close(self) -> None:
        """Send the server a farewell and close the socket."""
        self._leave()
        self._socket.close()

    def _newest(self) -> Show | None:
        """Return the last of the waiting datagrams that is a whole record from the server."""
        received = []
        for _ in range(_MOST_DATAGRAMS):
            try:
                data, address = self._socket.recvfrom(monitor.MAX_BYTES + 1)
            except BlockingIOError:
                break
            except ConnectionError:  # an earlier request met no server
                continue
            if self._is_server(address):
                received.append((data, address))
        for data, address in reversed(received):
            show = monitor.show_of(data)
            if show is not None:
                self._served_at = address
                return show
        return None

    def _is_server(self, address: tuple[str, int]) -> bool:
        if self._served_at is not None:
            return address == self._served_at
        return self._asked and address[0] == self._server[0]

    def _leave(self) -> None:
        if self._served_at is not None:
            self._send(monitor.bye(), self._served_at)
        self._served_at, self._asked = None, False

    def _send(self, message: bytes, address: tuple[str, int]) -> None:
        with suppress(OSError):
            self._socket.sendto(message, address)
