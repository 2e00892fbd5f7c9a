"""UDP sockets for the tests of clients."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator

import pytest

from teamclone.protocol.udp import LOOPBACK


@pytest.fixture
def sockets() -> Iterator[Callable[[], socket.socket]]:
    """Makes UDP sockets on this machine."""
    made: list[socket.socket] = []

    def make() -> socket.socket:
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        opened.bind((LOOPBACK, 0))
        opened.settimeout(5)
        made.append(opened)
        return opened

    yield make
    for opened in made:
        opened.close()
