"""Every cycle of a match in its order, after the parameters, from the server alone, whatever else comes."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from datagrams import packet
from teamclone.errors import LiveError
from teamclone.protocol.monitor import MAX_BYTES
from teamclone.protocol.monitor_stream import Frame, Message, MonitorStream
from teamclone.protocol.parameters import Parameters
from teamclone.protocol.udp import LOOPBACK

PARAMETERS = [
    b"(server_param (half_time 300)(ball_decay 0.94))\0",
    b"(player_param (player_types 2))\0",
    b"(player_type (id 0)(player_speed_max 1.05))\0",
    b"(player_type (id 1)(player_speed_max 1.1))\0",
]


class Served:
    """A stream that has asked, with the server's known port and the one for this monitor."""

    def __init__(self, make: Callable[[], socket.socket]) -> None:
        self.known, self.own, self.stranger = make(), make(), make()
        self.stream = MonitorStream(self.known.getsockname()[1])
        assert self.stream.next(0.05) is None
        self.request, self.address = self.known.recvfrom(100)

    def send(self, *datagrams: bytes, by: socket.socket | None = None) -> None:
        for data in datagrams:
            (by or self.own).sendto(data, self.address)

    def cycles(self) -> list[int]:
        """Of all frames that come now."""
        found = []
        while (got := self.stream.next(0.3)) is not None:
            if isinstance(got, Frame):
                found.append(got.show.cycle)
        return found


@pytest.fixture
def served(sockets: Callable[[], socket.socket]) -> Iterator[Served]:
    made = Served(sockets)
    yield made
    made.stream.close()


def test_every_cycle_comes_in_order_after_the_parameters(served: Served) -> None:
    assert served.request == b"(dispinit version 5)\0"
    before = time.time_ns()
    served.send(*PARAMETERS, *(packet(cycle=cycle) for cycle in range(1, 200)))
    got = served.stream.next(1)
    assert isinstance(got, Frame)
    assert got.show.cycle == 1
    assert before <= got.at <= time.time_ns()
    assert served.stream.parameters.server["half_time"] == 300
    assert served.stream.parameters.type_columns["player_speed_max"].tolist() == [1.05, 1.1]
    assert served.cycles() == list(range(2, 200))
    assert served.address[0] == LOOPBACK
    served.stream.close()
    assert served.own.recvfrom(100)[0] == b"(dispbye)\0"


def test_records_of_all_versions_come_in_any_mixture(served: Served) -> None:
    served.send(*PARAMETERS, *(packet(cycle=cycle, version=3 + cycle % 3) for cycle in range(1, 10)))
    assert served.cycles() == list(range(1, 10))


def test_words_come_in_their_place_and_nothing_else_does(served: Served) -> None:
    served.send(*PARAMETERS, packet(cycle=1))
    served.send(b'(msg 1 1 "(goal_l 1)")\0', b'(msg 1 1 "two\nlines")\0', b"(msg 1 1)\0", packet(cycle=2))
    got = [served.stream.next(1) for _ in range(3)]
    assert [type(one) for one in got] == [Frame, Message, Frame]
    assert got[1] == Message(b'(msg 1 1 "(goal_l 1)")')
    assert served.stream.dropped == 2


def test_a_stranger_is_not_heard(served: Served) -> None:
    served.send(b"(server_param (half_time 1))\0", b"(player_param (player_types 1))\0", by=served.stranger)
    served.send(b"(error illegal_client_version)\0", b"(error no_more_monitor)\0", by=served.stranger)
    served.send(*PARAMETERS, packet(cycle=1))
    assert served.cycles() == [1]
    served.send(packet(cycle=99), *PARAMETERS, by=served.stranger)
    served.send(packet(cycle=2))
    assert served.cycles() == [2]
    assert served.stream.parameters.server["half_time"] == 300


def test_giants_and_garbage_cost_nothing(served: Served) -> None:
    served.send(*PARAMETERS, packet(cycle=1))
    assert served.cycles() == [1]
    served.send(packet(cycle=2) + bytes(MAX_BYTES), bytes(60_000), b"", b"(show me)\0", packet(cycle=2)[:-900])
    served.send(packet(cycle=2))
    assert served.cycles() == [2]
    assert served.stream.dropped == 5


def test_parameters_that_were_lost_are_asked_for_again(served: Served, sockets: Callable[[], socket.socket]) -> None:
    served.send(*PARAMETERS[:-1], *(packet(cycle=cycle) for cycle in range(1, 6)))
    assert served.cycles() == []
    assert served.own.recvfrom(100)[0] == b"(dispbye)\0"
    assert served.known.recvfrom(100)[0] == b"(dispinit version 5)\0"
    served.send(packet(cycle=6))  # was under way already
    again = sockets()
    served.send(*PARAMETERS, packet(cycle=7), by=again)
    assert served.cycles() == [7]


def test_an_older_server_is_asked_for_an_older_version(served: Served) -> None:
    served.send(b"(error illegal_client_version)\0", by=served.known)
    assert served.cycles() == []
    while served.known.recvfrom(100)[0] != b"(dispinit version 4)\0":
        pass
    served.send(b"(error illegal_client_version)\0", by=served.known)
    assert served.cycles() == []
    served.send(b"(error illegal_client_version)\0", by=served.known)
    with pytest.raises(LiveError, match=r"knows no text version of monitors from 3 to 5"):
        served.cycles()


def test_a_full_server_says_so(served: Served) -> None:
    served.send(b"(error no_more_monitor)\0", by=served.known)
    with pytest.raises(LiveError, match="takes no more monitors"):
        served.cycles()


def test_a_host_that_is_none_is_an_error() -> None:
    with pytest.raises(LiveError, match=r"no\.such\.host\.invalid: no such host"):
        MonitorStream(6000, host="no.such.host.invalid")


@settings(max_examples=300, deadline=None)
@given(text=st.binary(max_size=200))
def test_garbage_is_no_parameter(text: bytes) -> None:
    for word in (b"", b"(server_param ", b"(player_param ", b"(player_type ", b"(player_type (id "):
        Parameters().take(word + text)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_datagrams_take_no_whole_one_with_them(served: Served, data: st.DataObject) -> None:
    """Whole ones between them come all, and in their order."""
    first = data.draw(st.integers(1, 10**6), label="cycle")
    end = Message(b'(msg 0 1 "end")')
    served.send(*PARAMETERS)
    for cycle in range(first, first + 3):
        whole = packet(cycle=cycle)
        damaged = bytearray(whole)
        place = data.draw(st.integers(0, len(damaged) - 1))
        damaged[place : place + data.draw(st.integers(0, 30))] = b"\xff" + data.draw(st.binary(max_size=20))
        served.send(bytes(damaged), whole)
    served.send(end.text)
    found = []
    while (got := served.stream.next(5)) != end:
        assert got is not None
        if isinstance(got, Frame) and got.text + b"\0" == packet(cycle=got.show.cycle):
            found.append(got.show.cycle)
    assert found == [first, first + 1, first + 2]
