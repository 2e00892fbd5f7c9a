"""What the server tells monitors: who is there, the play mode, the time. So a match is watched without its logs.

Protocol version 3 of rcssserver (`dispsender.cpp`, `serializermonitor.cpp`), which servers since 12.1 speak. In
synchronous mode the server pauses for monitors, 20 ms in 32 cycles, so one looks in only now and then when it can.
"""

from __future__ import annotations

import re
import socket
import time
from contextlib import suppress
from dataclasses import dataclass

from teamclone.rcss.playmodes import PlayMode

_HEAD = re.compile(rb"\(show (\d+) \(pm (\d+)\) \(tm (\S+) (\S+) (\d+) (\d+)")
_PLAYER = re.compile(rb"\(\(([lr]) (\d+)\) -?\d+ (0x[0-9a-f]+|0) ")
_MAX_BYTES = 16_384
_ASK_S = 0.3
"""Between two requests to a server that is not up yet."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """One cycle as a monitor sees it.

    Attributes:
        names: of the left and the right team; None where none has come.
        present: numbers of the connected players of each side.
    """

    cycle: int
    playmode: int
    names: tuple[str | None, str | None]
    scores: tuple[int, int]
    present: tuple[frozenset[int], frozenset[int]]

    @property
    def over(self) -> bool:
        return self.playmode == PlayMode.TIME_OVER

    @property
    def begun(self) -> bool:
        return self.cycle > 0


def scene_of(packet: bytes) -> Scene | None:
    """The scene in a packet; None where it is of another kind."""
    head = _HEAD.match(packet)
    if head is None:
        return None
    present: tuple[set[int], set[int]] = (set(), set())
    for side, unum, state in _PLAYER.findall(packet):
        if int(state, 16):
            present[side == b"r"].add(int(unum))
    names = [None if name == b"null" else name.decode("ascii", "replace") for name in head.group(3, 4)]
    return Scene(
        cycle=int(head[1]),
        playmode=int(head[2]),
        names=(names[0], names[1]),
        scores=(int(head[5]), int(head[6])),
        present=(frozenset(present[0]), frozenset(present[1])),
    )


class Monitor:
    """A connection to a server on this machine.

    Attributes:
        rest_s: how long to be away once something was seen; 0 stays.
    """

    def __init__(self, port: int) -> None:
        self.rest_s = 0.0
        self._there, self._ask_at = False, 0.0
        self._server = ("127.0.0.1", port)
        self._served_at = self._server  # the server answers each monitor from a port of its own
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self._socket.setblocking(False)

    def latest(self) -> Scene | None:
        """The newest scene that has come since the last call; None where none has. Never waits."""
        packet = None
        while True:
            try:
                data, address = self._socket.recvfrom(_MAX_BYTES)
            except BlockingIOError:
                break
            except ConnectionError:  # an earlier question met no server
                continue
            if data.startswith(b"(show "):
                packet, self._served_at = data, address
        now = time.monotonic()
        self._there = self._there or packet is not None
        if self._there and self.rest_s:
            self._send(b"(dispbye)", self._served_at)
            self._there, self._ask_at = False, now + self.rest_s
        elif not self._there and now >= self._ask_at:
            self._send(b"(dispinit version 3)", self._server)
            self._ask_at = now + _ASK_S
        return None if packet is None else scene_of(packet)

    def close(self) -> None:
        """Leave for good."""
        self._send(b"(dispbye)", self._served_at)
        self._socket.close()

    def _send(self, message: bytes, address: tuple[str, int]) -> None:
        with suppress(OSError):
            self._socket.sendto(message + b"\0", address)
