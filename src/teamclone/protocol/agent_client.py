"""The socket of a player or an online coach."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from teamclone.protocol.agent import BYE, MAX_BYTES
from teamclone.protocol.udp import address_of, open_socket

_MOST_DATAGRAMS = 4096
"""Read in one go: more than the socket keeps, and an end to a flood."""
_BUFFER = 1 << 20
"""Bytes that the socket keeps, some hundred cycles."""


class AgentClient:
    """A connection to a server.

    Until the server has welcomed the client only datagrams from its host count, then only those from the port that it
    has answered from: the server gives each client a port of its own.

    Args:
        welcomes: whether a datagram is the server's welcome.

    Raises:
        LiveError: the host has no address.

    Attributes:
        welcomed: whether one has come. gone: whether the server no longer listens.
    """

    def __init__(self, host: str, port: int, welcomes: Callable[[bytes], bool]) -> None:
        self.welcomed = self.gone = False
        self._server, self._welcomes = (address_of(host), port), welcomes
        self._socket = open_socket(host, buffer_bytes=_BUFFER)

    def fileno(self) -> int:
        """Return the socket's descriptor, for ``select``."""
        return self._socket.fileno()

    def receive(self) -> list[bytes]:
        """Return the datagrams that have come since the last call; never waits."""
        received: list[bytes] = []
        for _ in range(_MOST_DATAGRAMS):
            try:
                data, address = self._socket.recvfrom(MAX_BYTES + 1)
            except BlockingIOError:
                break
            except ConnectionError:
                self.gone = self.welcomed
                if self.gone:
                    break
                continue  # an earlier request met no server
            if not self.welcomed:
                if address[0] != self._server[0]:
                    continue
                if self._welcomes(data):
                    self._socket.connect(address)
                    self.welcomed = True
            received.append(data)
        return received

    def send(self, message: bytes) -> None:
        """Send a message: the first ones to the server's port, those after the welcome to the client's own."""
        try:
            if self.welcomed:
                self._socket.send(message)
            else:
                self._socket.sendto(message, self._server)
        except ConnectionError:
            self.gone = self.welcomed
        except OSError:  # a full buffer or a network that is down loses a datagram, as networks do
            pass

    def close(self) -> None:
        """Send the server a farewell and close the socket."""
        if self.welcomed and not self.gone:
            with suppress(OSError):
                self._socket.send(BYE)
        self._socket.close()
