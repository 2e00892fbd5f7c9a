"""The protocol of rcssserver's players and online coaches: datagrams to values, requests to bytes. No socket is here.

Written after `initsenderplayer.cpp`, `fullstatesender.cpp`, `serializerplayerstdv*.cpp` and `bodysender.cpp` of servers
16 to 19. A datagram is never trusted: what is not one whole message is None, and costs no more than its length.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.rcss.commands import BODY_KINDS, CommandKind
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import BY_NAME, PlayMode

MAX_BYTES = 16_384
"""Most bytes of a datagram that is read: a full state has about 2,700, the parameters of a server about 5,000."""
VERSIONS = (19, 18, 17, 16, 15, 14)
"""Versions of the protocol that are spoken, the first choice first. Older ones do not say who tackles or is fouled."""
NAME = re.compile(r"[A-Za-z0-9_.+-]{1,15}")
"""Names of teams that every server takes."""

TACKLES, KICKED, CHARGED = b"t", b"k", b"f"
"""Letters of a player in a full state: cannot move after its tackle, gave a kick command, cannot move after a foul."""

HELD = (TACKLES, CHARGED)
"""Of those the server takes no body command."""

_NUMBER = rb"[-+]?(?:\d{1,20}(?:\.\d{0,20})?|\.\d{1,20})(?:e-\d{1,3}|e\+0\d)?"
"""As the server writes it; no number that 32 bits cannot hold."""
_INIT = re.compile(rb"\(init ([lr]) (\d{1,2}) (\w{1,40})\)")
_RECONNECTED = re.compile(rb"\(reconnect ([lr]) (\w{1,40})\)")
_COACH_INIT = re.compile(rb"\(init ([lr])(?: \w{1,20})? ok\)")
_STATE = re.compile(
    rb"\(fullstate (\d{1,9}) \(pmode (\w{1,40})\)[^*]{0,400}?\(score (\d{1,5}) (\d{1,5})\) "
    rb"\(\(b\) (%b) (%b) (%b) (%b)\)" % ((_NUMBER,) * 4)
)
_PLAYER = re.compile(
    rb" \(\(p ([lr]) (\d{1,2})( g)?(?: (\d{1,3}))?\) (%b) (%b) (%b) (%b) (%b) (%b)(?: %b %b)?"
    rb"(?: \(focus_point %b %b\))? \(stamina (%b) (%b) (%b)(?: (%b))?\)(?: ([tkf]))?(?: ([yr]))?\)" % ((_NUMBER,) * 14)
)
_SENSE = re.compile(rb"\(sense_body (\d{1,9}) ")
_COUNT = re.compile(rb"\((kick|dash|turn|catch|move) (\d{1,9})\)")
_TACKLE = re.compile(rb"\(tackle \(expires (\d{1,9})\) \(count (\d{1,9})\)\)")
_REFUSED = re.compile(rb"\(error (.{1,120})\)")
_CHANGED = re.compile(rb"\(ok change_player_type (\d{1,2}) (\d{1,3})\)")
_HOLDING = {b"goalie_catch_ball_l": (PlayMode.FREE_KICK_L, 1), b"goalie_catch_ball_r": (PlayMode.FREE_KICK_R, -1)}
"""What a full state calls a free kick while the goalkeeper holds the ball, and whose; logs have the free kick."""

MEASURED = ("x", "y", "vx", "vy", "body", "neck", "stamina", "effort", "recovery", "capacity")
"""Rows of `FullState.measured`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Welcome:
    """What a server answers to a player that comes, or comes back.

    Attributes:
        side: 1 left, -1 right. unum: 0 in the answer to a player that comes back.
    """

    side: int
    unum: int
    playmode: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FullState:
    """The ball and all players as the server has them, in the frame of reference of logs.

    Attributes:
        cycle: server time; it repeats while the clock stands.
        playmode: its number, of `PlayMode`. held: side of the goalkeeper that holds the ball, 0 where none does.
        scores: goals of the own and of the other team.
        ball: (4,) x, y in metres, vx, vy in metres per cycle.
        present: (22,) bool, who is on the field: left 1 to 11, then right 1 to 11. The rest is 0 for others.
        goalie: (22,) bool. type: (22,) player types.
        measured: (len(MEASURED), 22), metres, metres per cycle, degrees, stamina; NaN for what the version lacks.
        doing: (22,) bytes, TACKLES, KICKED, CHARGED or empty. cards: (22,) bytes, ``y``, ``r`` or empty.
    """

    cycle: int
    playmode: int
    held: int
    scores: tuple[int, int]
    ball: NDArray[np.float64]
    present: NDArray[np.bool_]
    goalie: NDArray[np.bool_]
    type: NDArray[np.int64]
    measured: NDArray[np.float64]
    doing: NDArray[np.bytes_]
    cards: NDArray[np.bytes_]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sense:
    """What a player feels of itself.

    Attributes:
        cycle: server time. counts: executed commands since the match began, in the order of BODY_KINDS.
        frozen: cycles for which a tackle holds the player. collided: touched the ball, a player or a post.
    """

    cycle: int
    counts: tuple[int, ...]
    frozen: int
    collided: bool


def welcome_of(datagram: bytes) -> Welcome | None:
    """Read the answer to `init` or `reconnect`; None where the datagram is something else."""
    text = text_of(datagram)
    if found := _INIT.fullmatch(text):
        side, unum, mode = found.groups()
        number = int(unum)
        return _welcome(side, number, mode) if 1 <= number <= N_TEAM else None
    if found := _RECONNECTED.fullmatch(text):
        return _welcome(found[1], 0, found[2])
    return None


def _welcome(side: bytes, unum: int, mode: bytes) -> Welcome:
    return Welcome(side=1 if side == b"l" else -1, unum=unum, playmode=playmode_of(mode))


def coach_side_of(datagram: bytes) -> int | None:
    """Read the answer to a coach's `init`: its side, 1 left or -1 right; None where it is something else."""
    found = _COACH_INIT.fullmatch(text_of(datagram))
    return None if found is None else (1 if found[1] == b"l" else -1)


def refusal_of(datagram: bytes) -> str | None:
    """Read the server's words of an ``(error ...)``; None where the datagram is something else."""
    found = _REFUSED.fullmatch(text_of(datagram))
    return None if found is None else found[1].decode("ascii", "replace")


def changed_type_of(datagram: bytes) -> tuple[int, int] | None:
    """Read number and type of a player whose type the coach has changed; None where it is something else."""
    found = _CHANGED.fullmatch(text_of(datagram))
    return None if found is None else (int(found[1]), int(found[2]))


def full_state_of(datagram: bytes) -> FullState | None:
    """Read a full state; None where the datagram is something else, or damaged."""
    text = text_of(datagram)
    head = _STATE.match(text)
    if head is None:
        return None
    cycle, mode, own, other, *ball = head.groups()
    present, goalie = np.zeros((2, N_PLAYERS), np.bool_)
    types = np.zeros(N_PLAYERS, np.int64)
    measured = np.zeros((len(MEASURED), N_PLAYERS))
    doing, cards = np.zeros((2, N_PLAYERS), "S1")
    at = head.end()
    while (found := _PLAYER.match(text, at)) is not None:
        side, unum, keeps, kind, *numbers, does, card = found.groups()
        slot = int(unum) - 1 + (0 if side == b"l" else N_TEAM)
        if not 1 <= int(unum) <= N_TEAM or present[slot]:
            return None
        present[slot], goalie[slot], types[slot] = True, keeps is not None, int(kind or 0)
        measured[:, slot] = [np.nan if number is None else float(number) for number in numbers]
        doing[slot], cards[slot] = does or b"", card or b""
        at = found.end()
    if text[at:] != b")":
        return None
    return FullState(
        cycle=int(cycle),
        playmode=playmode_of(mode),
        held=_HOLDING[mode][1] if mode in _HOLDING else 0,
        scores=(int(own), int(other)),
        ball=np.array([float(number) for number in ball]),
        present=present,
        goalie=goalie,
        type=types,
        measured=measured,
        doing=doing,
        cards=cards,
    )


def sense_of(datagram: bytes) -> Sense | None:
    """Read what a player feels; None where the datagram is something else, or damaged."""
    text = text_of(datagram)
    head, tackle = _SENSE.match(text), _TACKLE.search(text)
    if head is None or tackle is None or not text.endswith(b")"):
        return None
    counts = {name: int(count) for name, count in _COUNT.findall(text)}
    counts[b"tackle"] = int(tackle[2])
    words = [kind.name.lower().encode() for kind in BODY_KINDS]
    if not all(word in counts for word in words):
        return None
    return Sense(
        cycle=int(head[1]),
        counts=tuple(counts[word] for word in words),
        frozen=int(tackle[1]),
        collided=b"(collision (" in text,
    )


def playmode_of(word: bytes) -> int:
    """Return the number of a play mode by the server's word for it, 0 for one that is not known."""
    if word in _HOLDING:
        return int(_HOLDING[word][0])
    return int(BY_NAME.get(word.decode("ascii", "replace"), PlayMode.NULL))


def asks_to_think(datagram: bytes) -> bool:
    """Return whether the server waits for the client's commands."""
    return text_of(datagram) == b"(think)"


def init(team: str, version: int, *, goalie: bool = False) -> bytes:
    """Make a player's request to take part, or an online coach's; the answer comes from another port."""
    return _message(f"(init {team} (version {version}){' (goalie)' if goalie else ''})")


def reconnect(team: str, unum: int) -> bytes:
    """Make the request of a player to take its place again. The server refuses it in play_on."""
    return _message(f"(reconnect {team} {unum})")


def change_player_type(unum: int, type_id: int) -> bytes:
    """Make a coach's request to give a player a type."""
    return _message(f"(change_player_type {unum} {type_id})")


def commands(words: Sequence[str]) -> bytes:
    """Make one datagram of commands, see `command`."""
    return _message("".join(words))


def command(kind: CommandKind, numbers: Sequence[float] = ()) -> str:
    """Return a command as the server reads it: ``(dash 80 -15)``."""
    # No more digits than a full state has; the server takes no number without a digit behind its point.
    return f"({' '.join([kind.name.lower(), *(f'{_finite(number):.4f}' for number in numbers)])})"


BYE = b"(bye)\0"
"""The farewell of a player or coach."""
SET_UP = ("(synch_see)", "(change_view wide high)", "(ear (off our))", "(ear (off opp))")
"""What a client with a full state sends at first, to be sent less."""
DONE = "(done)"
"""The end of a client's commands in a cycle, for which a server in synchronous mode waits."""


def _finite(number: Any) -> float:
    value = float(number)
    if not np.isfinite(value):
        raise ValueError(f"a command has the number {value}")
    return value


def _message(text: str) -> bytes:
    return text.encode("ascii") + b"\0"


def text_of(datagram: bytes) -> bytes:
    """Return the text of a datagram, empty where it is too long to be a message."""
    return datagram.partition(b"\0")[0].rstrip() if len(datagram) <= MAX_BYTES else b""
