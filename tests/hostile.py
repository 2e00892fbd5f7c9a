"""Hostile logs: a beginning that a reader takes for its own, and then pieces again and again, to any size."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import time
import tracemalloc
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import zstandard

from teamclone.errors import LogError
from teamclone.logs import read_match

_PLAYERS = b"".join(b"((%c%d)0 0 0 0 0 0 0 0)" % (side, unum) for side in b"lr" for unum in range(1, 12))
SHORTEST_SHOW = b"(show 1((b)0 0 0 0)" + _PLAYERS + b")\n"
"""The shortest record of a text log that is whole."""
JSON_SHOW = b'{"show":{"time":1,"ball":{"x":0,"y":0,"vx":0,"vy":0},"players":[{"side":"l","unum":1}]}}'
"""The shortest record of a JSON log that is whole."""
_SHOW_2 = b"\0\1" + bytes(316)
_SHOW_3 = b"\0\1" + bytes(1428)


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """Logs for one reader.

    Attributes:
        begin: the first bytes, which a reader goes by.
        pieces: what the rest is made of.
    """

    begin: bytes
    pieces: tuple[bytes, ...]


_ANY = (b"\n", b" ", b"(", b")", b'"', b"x", b"1", b"\0", b"-1e999", b"9" * 50, b"\r\n", b"\xff")
_TEXT = (
    *(b"(show ", b"(show 1 ", b"((b) 0 0 0 0)", b"((l 1) 0 0x1 ", b"(v h 1)", b"(s 1 1 1 1)", b"(c 1 1", b"(result "),
    *(b"(playmode 1 play_on)\n", b"(playmode 1 ", b"(team 1 A B 0 0)\n", b"(team ", b"(msg 1 ", b"(player_type (id 1"),
    *(b"(server_param (a ", b'(goal "', b"(a 1)", SHORTEST_SHOW),
)
_JSON = (
    *(b'"show"', b'{"show":1}\n', JSON_SHOW, JSON_SHOW + b",\n", b"[", b"]", b"{", b"}", b",", b'{"a":', b"[],"),
    *(b"{},", b"1,", b"1e1,", b'{"playmode":{"time":1,"mode":"x"}},\n', b'"players":[', b'{"side":"l","unum":1},'),
    *(b"null", b'{"team":{"l":{"name":"A","score":1},"r":{"name":"B","score":1}}}\n'),
)
_COMMANDS = (
    *(b"\n1,0\tRecv A_1: ", b"1,0\t", b"(say x", b"(say (", b'(say "', b"(dash 1)", b"(dash 1", b"(dash (l 1 2)"),
    *(b"()", b"(turn 1 ", b"(tackle 1 on)", b"(change_view wide high)", b"Recv ", b"A_1", b"_", b": ", b"\n \t"),
    *(b"1,0\t(referee goal_l_1)\n", b"\n(dash 1)", b"1\t\n"),
)
_BINARY = (
    *(b"\0\1", b"\0\2\0\1\0\0", b"\0\4", b"\0\5\3", b"\0\5\4", b"\0\6" + bytes(36), b"\0\7"),
    *(_SHOW_2, _SHOW_3, b"\0\1" + bytes(2050)),
)


def _packed(pack: Callable[[bytes], bytes]) -> Kind:
    return Kind(begin=pack(b"ULG5\n"), pieces=(*_ANY, pack(b""), pack(b"(")))


KINDS = {
    "text": Kind(begin=b"ULG5\n", pieces=_ANY + _TEXT),
    "text with a frame": Kind(begin=b"ULG6\n" + SHORTEST_SHOW, pieces=_ANY + _TEXT),
    "json": Kind(begin=b"[\n", pieces=_ANY + _JSON),
    "json of server 17": Kind(begin=b"ULG6\n[", pieces=_ANY + _JSON),
    "json with a frame": Kind(begin=b"[\n" + JSON_SHOW + b",\n", pieces=_ANY + _JSON),
    "commands": Kind(begin=b"1,0\tRecv A_1: ", pieces=_ANY + _COMMANDS),
    "binary 1": Kind(begin=b"\0\1" + bytes(2050), pieces=_ANY + _BINARY),
    "binary 2": Kind(begin=b"ULG\2" + _SHOW_2, pieces=_ANY + _BINARY),
    "binary 3": Kind(begin=b"ULG\3" + _SHOW_3, pieces=_ANY + _BINARY),
    "gzip": _packed(gzip.compress),
    "xz": _packed(lzma.compress),
    "zst": _packed(zstandard.compress),
    "bz2": _packed(bz2.compress),
}
"""Logs for each reader, by its name."""


def made(kind: Kind, rng: np.random.Generator, *, n_bytes: int) -> bytes:
    """Return a log of about ``n_bytes``: up to four pieces, again and again, and perhaps another one at the end."""
    unit = b"".join(kind.pieces[index] for index in rng.integers(len(kind.pieces), size=rng.integers(1, 5)))
    end = kind.pieces[rng.integers(len(kind.pieces))] if rng.integers(2) else b""
    return kind.begin + unit * max((n_bytes - len(kind.begin)) // len(unit), 1) + end


MOST_SECONDS_PER_BYTE = 5e-6
"""Five times what the dearest hostile log needs, many times what a real one does."""
MOST_MEMORY_PER_BYTE = 100
"""Twice what the dearest hostile log needs. The columns of a real one take less than itself."""
FREE_SECONDS, FREE_MEMORY = 0.3, 16 << 20
"""For buffers and tables that any log needs."""


def check_cost(data: bytes) -> None:
    """Read a log twice and assert that processor time and memory are in proportion to its bytes."""
    begin = time.process_time()
    read(data)
    seconds = time.process_time() - begin
    tracemalloc.start()
    try:
        read(data)
        _, memory = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    n_bytes = len(data)
    told = f"{n_bytes} bytes took {seconds:.2f} s and {memory / n_bytes:.0f} times their memory: {data[:300]!r}"
    assert seconds < FREE_SECONDS + n_bytes * MOST_SECONDS_PER_BYTE, told
    assert memory < FREE_MEMORY + n_bytes * MOST_MEMORY_PER_BYTE, told


def read(data: bytes) -> None:
    """Read a log; a clear error is fine, any other exception is not."""
    with suppress(LogError):
        read_match(io.BytesIO(data))
