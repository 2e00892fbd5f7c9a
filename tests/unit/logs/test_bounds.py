"""Time and memory of reading are bounded by a constant times the log's size, whatever its bytes."""

from __future__ import annotations

import io

import numpy as np
import pytest

from hostile import JSON_SHOW, KINDS, SHORTEST_SHOW, check_cost, made, read
from teamclone.logs import read_match

N_BYTES = 300_000
N_MADE = 12
"""Generated logs of a kind. `tests/faults/fuzz_bounds.py` goes on from there."""


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    for kind in KINDS.values():
        read(kind.begin)


REPEATED = {
    "frames that hold nothing": (b"ULG5\n" + SHORTEST_SHOW, b"(show \n"),
    "frames in no record": (b"[\n", b'"show"'),
    "records that are none": (b"[\n", b'{"show":1}\n'),
    "lines that are no JSON": (b'[\n{"show":1}\n', b"x\n"),
    "frames of one player": (b"[\n", JSON_SHOW + b",\n"),
    "messages without an end": (b"1,0\tRecv A_1: ", b"(say x"),
    "parentheses without an end": (b"1,0\tRecv A_1: ", b"(say ("),
    "records that say nothing": (b"ULG\3\0\1" + bytes(1428), b"\0\4"),
}


@pytest.mark.parametrize(("begin", "piece"), REPEATED.values(), ids=REPEATED)
def test_one_thing_again_and_again(begin: bytes, piece: bytes):
    check_cost(begin + piece * (N_BYTES // len(piece)))


@pytest.mark.parametrize("name", KINDS)
def test_generated_logs(name: str):
    rng = np.random.default_rng(list(name.encode()))
    for _ in range(N_MADE):
        check_cost(made(KINDS[name], rng, n_bytes=N_BYTES // 3))


def test_the_shortest_frame_is_no_short_line():
    """Lines that are too short for a frame get no columns; this one is as short as a frame can be."""
    match = read_match(io.BytesIO(b"ULG5\n" + SHORTEST_SHOW))
    assert match.frames["cycle"].tolist() == [1]
    assert not match.players["x"].any()
