"""The monitor protocol of rcssserver: datagrams to columns, requests to bytes. No socket and no decision is here.

Written after `monitor.cpp` and `serializermonitor.cpp`. A request asks for a text version: 3, which servers since 12.1
speak, 4 and 5. Monitors of different versions that watch one match may get each other's records, so `show_of` reads all
three. A datagram is never trusted: whatever is not one whole record is None, and costs no more than its length.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from teamclone.logs import scan
from teamclone.logs.match import Columns
from teamclone.logs.shows import Shows, read_shows
from teamclone.rcss.playmodes import PlayMode

MAX_BYTES = 16_384
"""Most bytes of a datagram that is read; a record has about 3,400."""

_HEAD = re.compile(
    rb"\(show \d{1,10} \(pm (\d{1,3})\) "
    rb"\(tm ([^\s()]{1,64}) ([^\s()]{1,64}) (\d{1,5}) (\d{1,5})(?:(?: \d{1,5}){4})?\) ?"
)
"""Play mode, names, scores and penalties, which logs have in records of their own and monitors get in each."""
_PLACE_SCALE = 16
"""Positions in requests are whole sixteenths of a metre."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Show:
    """One cycle as a monitor sees it.

    Attributes:
        playmode: its number, one of `PlayMode` unless the server is newer.
        names: of the left and the right team; None where none has come.
        scores: of the left and the right team.
        ball: (4,) float32: x, y in metres, vx, vy in metres per cycle.
        players: the columns `columns.PLAYERS`, (22,) each: left 1 to 11, then right 1 to 11.
    """

    cycle: int
    playmode: int
    names: tuple[str | None, str | None]
    scores: tuple[int, int]
    ball: NDArray[np.float32]
    players: Columns

    @property
    def over(self) -> bool:
        """True once the match has ended."""
        return self.playmode == PlayMode.TIME_OVER

    @property
    def begun(self) -> bool:
        """True once the clock runs."""
        return self.cycle > 0

    @property
    def present(self) -> tuple[frozenset[int], frozenset[int]]:
        """Numbers of the connected players of the left and of the right team; those sent off included."""
        left, right = (self.players["state"] != 0).reshape(2, -1)
        return (
            frozenset((np.flatnonzero(left) + 1).tolist()),
            frozenset((np.flatnonzero(right) + 1).tolist()),
        )


def show_of(datagram: bytes) -> Show | None:
    """Read the record of a cycle; None where the datagram is something else, damaged, cut off or over MAX_BYTES."""
    if len(datagram) > MAX_BYTES:
        return None
    text = datagram.partition(b"\0")[0]
    head = _HEAD.match(text)
    if head is None:
        return None
    shows = _read(text, 1)
    if shows.outcomes[0] != scan.OK:
        return None
    left, right = (None if name == b"null" else name.decode("ascii", "replace") for name in head.group(2, 3))
    return Show(
        cycle=int(shows.cycle[0]),
        playmode=int(head[1]),
        names=(left, right),
        scores=(int(head[4]), int(head[5])),
        ball=shows.ball[0],
        players={name: column[0] for name, column in shows.players.items()},
    )


def load_reader() -> None:
    """Load or compile the kernel of `show_of`, which else happens at its first call; use it before time matters."""
    _read(b" ", 0)


def _read(text: bytes, n: int) -> Shows:
    """Read a text that is ``n`` records, 0 or 1."""
    return read_shows(np.frombuffer(text, np.uint8), np.zeros(n, np.int64), np.full(n, len(text), np.int64))


def init(version: Literal[3, 4, 5] = 3) -> bytes:
    """Make the request to become a monitor; it goes to the server's port, the answers come from another."""
    return b"(dispinit version %d)\0" % version


def bye() -> bytes:
    """Make the request to be a monitor no longer; it goes to the port that the answers come from."""
    return b"(dispbye)\0"


def kick_off() -> bytes:
    """Make the request to kick off. The server obeys it while its clock stands at the beginning of a half."""
    return b"(dispstart)\0"


def place_player(side: Literal[1, -1], unum: int, *, x: float, y: float, body: float) -> bytes:
    """Make the request to put a player, standing, at a place. The server obeys it in every play mode.

    Args:
        side: 1 left, -1 right.
        x, y: metres, rounded to a sixteenth.
        body: degrees, rounded to a whole one.
    """
    place = tuple(round(_PLACE_SCALE * value) for value in (x, y))
    return b"(dispplayer %d %d %d %d %d)\0" % (side, unum, *place, round(body))
