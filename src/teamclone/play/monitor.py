"""What the server tells monitors: who is there, the play mode, the time. So a match is watched without its logs.

Protocol version 3 of rcssserver (`dispsender.cpp`, `serializermonitor.cpp`), which servers since 13 speak.
"""

from __future__ import annotations

import re
import socket
from dataclasses import dataclass

from teamclone.rcss.playmodes import PlayMode

_HEAD = re.compile(rb"\(show (\d+) \(pm (\d+)\) \(tm (\S+) (\S+) (\d+) (\d+)")
_PLAYER = re.compile(rb"\(\(([lr]) (\d+)\) -?\d+ (0x[0-9a-f]+|0) ")
_MAX_BYTES = 16_384


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
    """A connection to a server on this machine."""

    def __init__(self, port: int) -> None:
        self._server = ("127.0.0.1", port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self._socket.setblocking(False)

    def ask(self) -> None:
        """Ask to be told; while the server is not up yet nobody hears it."""
        self._socket.sendto(b"(dispinit version 3)\0", self._server)

    def latest(self) -> Scene | None:
        """The newest scene that has come since the last call; None where none has."""
        packet = None
        while True:
            try:
                data = self._socket.recv(_MAX_BYTES)
            except BlockingIOError:
                break
            except ConnectionError:  # an earlier question met no server
                continue
            if data.startswith(b"(show "):
                packet = data
        return None if packet is None else scene_of(packet)

    def leave(self) -> None:
        """Say goodbye, so that the server sends no more."""
        self._socket.sendto(b"(dispbye)\0", self._server)
        self._socket.close()
