"""The monitor's socket against a server of a few lines: whom it hears, when it asks, when it leaves."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator

import pytest

from datagrams import WHOLE, packet
from teamclone.protocol import client
from teamclone.protocol.client import MonitorClient
from teamclone.protocol.udp import LOOPBACK


def port_of(opened: socket.socket) -> int:
    port: int = opened.getsockname()[1]
    return port


class Served:
    """A client that has asked, with the server's two ports: the known one, and the one for this monitor."""

    def __init__(self, make: Callable[[], socket.socket]) -> None:
        self.known, self.own = make(), make()
        self.client = MonitorClient(port_of(self.known))
        assert self.client.latest() is None
        self.request, self.address = self.known.recvfrom(100)

    def send(self, data: bytes, *, by: socket.socket | None = None) -> None:
        (by or self.own).sendto(data, self.address)

    def cycle(self) -> int | None:
        """Of the show that is the newest now."""
        show = self.client.latest()
        return None if show is None else show.cycle


@pytest.fixture
def served(sockets: Callable[[], socket.socket]) -> Iterator[Served]:
    made = Served(sockets)
    yield made
    made.client.close()


def test_it_asks_on_the_known_port_and_hears_the_answer_from_another(served: Served) -> None:
    assert served.request == b"(dispinit version 3)\0"
    served.send(b"(server_param (half_time 300))\0")
    assert served.cycle() is None
    served.send(packet(cycle=3))
    served.send(packet(cycle=4))
    assert served.cycle() == 4
    assert served.cycle() is None
    served.client.close()
    assert served.own.recvfrom(100)[0] == b"(dispbye)\0"


def test_its_socket_is_open_to_this_machine_alone(served: Served) -> None:
    assert served.address[0] == LOOPBACK
    assert served.client._socket.getsockname()[0] == LOOPBACK


def test_a_stranger_s_port_is_not_heard_once_the_server_s_is_known(
    served: Served, sockets: Callable[[], socket.socket]
) -> None:
    stranger = sockets()
    served.send(packet(cycle=3))
    assert served.cycle() == 3
    served.send(packet(cycle=99), by=stranger)
    assert served.cycle() is None
    served.send(packet(cycle=4))
    served.send(packet(cycle=99), by=stranger)
    assert served.cycle() == 4


def test_before_it_has_asked_nothing_is_heard(sockets: Callable[[], socket.socket]) -> None:
    listener = MonitorClient(port_of(sockets()))
    sockets().sendto(WHOLE, listener._socket.getsockname())
    assert listener.latest() is None
    assert listener.latest() is None
    listener.close()


def test_garbage_hides_no_show_and_is_no_answer(served: Served) -> None:
    served.send(b"(show me)\0")
    served.send(bytes(60_000))
    assert served.cycle() is None
    assert served.client._served_at is None
    served.send(packet(cycle=5))
    for junk in (b"", b"(show 6 (pm 3)", WHOLE[:-500], b"\xff" * 5000):
        served.send(junk)
    assert served.cycle() == 5


def test_a_flood_is_read_in_pieces(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client, "_MOST_DATAGRAMS", 3)
    for cycle in range(1, 6):
        served.send(packet(cycle=cycle))
    assert [served.cycle() for _ in range(3)] == [3, 5, None]


def test_it_asks_again_until_a_server_is_there(sockets: Callable[[], socket.socket]) -> None:
    server = sockets()
    waiting = MonitorClient(port_of(server))
    deadline = time.monotonic() + 5
    server.setblocking(False)
    requests = 0
    while requests < 2 and time.monotonic() < deadline:
        assert waiting.latest() is None
        time.sleep(0.02)
        try:
            requests += server.recv(100) == b"(dispinit version 3)\0"
        except BlockingIOError:
            continue
    waiting.close()
    assert requests == 2


def test_no_server_at_the_port_is_no_error(sockets: Callable[[], socket.socket]) -> None:
    gone = sockets()
    port = port_of(gone)
    gone.close()
    waiting = MonitorClient(port)
    for _ in range(5):
        assert waiting.latest() is None
        time.sleep(0.1)
    waiting.close()


def test_it_leaves_for_a_while_and_may_then_be_served_from_another_port(
    served: Served, sockets: Callable[[], socket.socket]
) -> None:
    served.client.rest_s = 0.2
    served.send(packet(cycle=3))
    assert served.cycle() == 3
    assert served.own.recvfrom(100)[0] == b"(dispbye)\0"
    served.send(packet(cycle=4))  # was under way already
    assert served.cycle() is None
    time.sleep(0.25)
    assert served.cycle() is None
    assert served.known.recvfrom(100)[0] == b"(dispinit version 3)\0"
    served.send(packet(cycle=90), by=sockets())
    assert served.cycle() == 90


def test_a_server_that_fell_silent_is_asked_again(
    served: Served, sockets: Callable[[], socket.socket], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client, "_SILENT_S", 0.1)
    served.send(packet(cycle=3))
    assert served.cycle() == 3
    time.sleep(0.4)
    assert served.cycle() is None
    assert served.known.recvfrom(100)[0] == b"(dispinit version 3)\0"
    served.send(packet(cycle=50), by=sockets())
    assert served.cycle() == 50
