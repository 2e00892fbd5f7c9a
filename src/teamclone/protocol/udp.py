"""UDP sockets of clients."""

from __future__ import annotations

import socket

from teamclone.errors import LiveError

LOOPBACK = "127.0.0.1"


def address_of(host: str) -> str:
    """Return the address of a host.

    Raises:
        LiveError: it has none.
    """
    try:
        return socket.gethostbyname(host)
    except OSError as error:
        raise LiveError(f"{host}: no such host ({error.strerror or error}); name another with --host") from None


def open_socket(host: str, *, buffer_bytes: int) -> socket.socket:
    """Open a socket to a host, with so much room for what is not read yet; no other machine reaches one to this host.

    It waits for nothing.
    """
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer_bytes)
    made.setblocking(False)
    if host == LOOPBACK:
        made.bind((LOOPBACK, 0))
    return made
