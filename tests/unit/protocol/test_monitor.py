"""Datagrams of monitors: those of every text version are read, whatever else comes is None, soon and without a mark."""

from __future__ import annotations

import subprocess
import sys
import time
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from datagrams import WHOLE, packet
from teamclone.logs.columns import PLAYERS
from teamclone.logs.rcg_text import read_text
from teamclone.protocol import monitor
from teamclone.protocol.monitor import MAX_BYTES, show_of
from teamclone.rcss.playmodes import PlayMode


def test_a_datagram_says_when_and_in_which_mode_and_who_is_there() -> None:
    show = show_of(packet({("l", 1): "0x9", ("l", 11): "0x1", ("r", 3): "0x100"}))
    assert show is not None
    assert (show.cycle, show.playmode, show.names, show.scores) == (7, PlayMode.PLAY_ON, ("Red", None), (1, 2))
    assert show.present == ({1, 11}, {3})  # sent off is still there
    assert show.begun
    assert not show.over


def test_before_the_kick_off_nothing_has_begun_and_time_over_is_the_end() -> None:
    before, after = show_of(packet(cycle=0, pm=1)), show_of(packet(cycle=6000, pm=2))
    assert before is not None
    assert after is not None
    assert (before.begun, before.over) == (False, False)
    assert (after.begun, after.over) == (True, True)


@pytest.mark.parametrize("version", [3, 4, 5])
def test_every_text_version_is_read_into_the_columns_of_a_log(version: int) -> None:
    show = show_of(packet({("r", 2): "0x1"}, version=version))
    assert show is not None
    assert show.ball.tolist() == [1.5, -2, 0.25, 0]
    assert {name: (column.shape, column.dtype) for name, column in show.players.items()} == {
        column.name: ((22,), np.dtype(column.dtype)) for column in PLAYERS
    }
    player = {name: column[12].item() for name, column in show.players.items()}
    assert player["state"] == 1
    assert (player["x"], player["y"], player["vx"], player["vy"]) == (-50, 0.5, 0.25, -0.125)
    assert (player["body"], player["neck"], player["stamina"]) == (90, -45, 8000)
    assert player["capacity"] == 130600 if version > 3 else np.isnan(player["capacity"])
    assert player["focus_distance"] == 12 if version == 5 else np.isnan(player["focus_distance"])
    assert player["count_change_focus"] == (11 if version == 5 else -1)


def test_a_record_is_read_as_in_a_log() -> None:
    """One reader for both: the groups that monitors alone get change nothing of the rest."""
    datagram = packet({("l", 4): "0x1", ("r", 9): "0x3"}, version=5)
    show = show_of(datagram)
    line = datagram.rstrip(b"\0").replace(b"(pm 3) (tm Red null 1 2) ", b"")
    log = read_text(b"ULG6\n" + line + b"\n")
    assert show is not None
    assert log.problems == ()
    assert log.frames["cycle"].tolist() == [show.cycle]
    assert [log.frames[f"ball_{name}"][0] for name in ("x", "y", "vx", "vy")] == show.ball.tolist()
    for name, column in log.players.items():
        np.testing.assert_array_equal(column[0], show.players[name], err_msg=name)


def test_scores_of_a_shoot_out_and_names_of_both_teams_are_taken() -> None:
    show = show_of(packet(teams=b"HELIOS_base WE-Base+2 2 2 3 1 2 2"))
    assert show is not None
    assert (show.names, show.scores) == (("HELIOS_base", "WE-Base+2"), (2, 2))


HOSTILE = {
    "nothing": b"",
    "a zero": b"\0",
    "another message": b"(server_param (audio_cut_dist 50))\0",
    "an error": b"(error no_more_monitor)\0",
    "a record of a log": WHOLE.replace(b"(pm 3) (tm Red null 1 2) ", b""),
    "no ball": WHOLE.replace(b"((b) 1.5 -2 0.25 0) ", b""),
    "a ball of words": WHOLE.replace(b"1.5", b"one"),
    "21 players": WHOLE.replace(b"((l 3) ", b"((l 4) "),
    "a player 12": WHOLE.replace(b"(r 11)", b"(r 12)"),
    "a side c": WHOLE.replace(b"((l 3)", b"((c 3)"),
    "a state of words": WHOLE.replace(b"0x9", b"standing"),
    "words behind it": WHOLE.replace(b"\0", b"x"),
    "a zero inside": WHOLE.replace(b"(l 5)", b"(l\0 5)"),
    "a cycle without end": WHOLE.replace(b"(show 7 ", b"(show " + b"9" * 5000 + b" "),
    "a cycle over 2^31": WHOLE.replace(b"(show 7 ", b"(show 4294967303 "),
    "a cycle below 0": WHOLE.replace(b"(show 7 ", b"(show -7 "),
    "a half cycle": WHOLE.replace(b"(show 7 ", b"(show 7.5 "),
    "a score without end": WHOLE.replace(b"null 1 2", b"null " + b"1" * 5000 + b" 2"),
    "a play mode without end": WHOLE.replace(b"(pm 3)", b"(pm " + b"3" * 5000 + b")"),
    "a name without end": WHOLE.replace(b"Red", b"R" * 9000),
    "one group in the other": b"(show 7 (pm 3) (tm Red null 1 2) " + b"(a" * 5000,
    "parentheses": b"(show 7 (pm 3) (tm Red null 1 2) " + b"(" * 9000,
    "over the limit": WHOLE + bytes(MAX_BYTES),
    "giant": WHOLE * 10_000,
}


@pytest.mark.parametrize("datagram", HOSTILE.values(), ids=HOSTILE.keys())
def test_what_is_no_whole_record_is_none(datagram: bytes) -> None:
    assert show_of(WHOLE) is not None
    assert show_of(datagram) is None


def test_a_datagram_cut_off_anywhere_is_none() -> None:
    text = WHOLE.rstrip(b"\0")
    assert show_of(text) is not None  # the zero is but the end of the datagram
    assert [length for length in range(len(text)) if show_of(text[:length]) is not None] == []


@settings(max_examples=500, deadline=None)
@given(
    datagram=st.one_of(st.binary(max_size=300), st.text("()show 0123456789pmtblr.-xe", max_size=300).map(str.encode))
)
def test_garbage_is_none(datagram: bytes) -> None:
    assert show_of(datagram) is None
    assert show_of(b"(show 7 (pm 3) (tm Red null 1 2) " + datagram) is None


@settings(max_examples=1000, deadline=None)
@given(data=st.data())
def test_a_damaged_record_is_none_or_still_has_its_form(data: st.DataObject) -> None:
    damaged = bytearray(WHOLE)
    for _ in range(data.draw(st.integers(1, 5))):
        place = data.draw(st.integers(0, len(damaged) - 1))
        damaged[place : place + data.draw(st.integers(0, 20))] = data.draw(st.binary(max_size=20))
        if not damaged:
            break
    show = show_of(bytes(damaged))
    if show is not None:
        assert 0 <= show.cycle < 2**31
        assert 0 <= show.playmode < 1000
        assert all(0 <= score < 100_000 for score in show.scores)
        assert show.ball.shape == (4,)
        assert {column.shape for column in show.players.values()} == {(22,)}
        assert all(numbers <= frozenset(range(1, 12)) for numbers in show.present)


def test_a_datagram_costs_no_more_than_its_length() -> None:
    monitor.load_reader()
    longest = [datagram for datagram in HOSTILE.values() if len(datagram) > 5000]
    show_of(WHOLE)
    tracemalloc.start()
    began = time.perf_counter()
    for datagram in longest:
        assert show_of(datagram) is None
    took, (_, peak) = time.perf_counter() - began, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(longest) >= 8
    assert took < 0.5
    assert peak < 200_000


def test_what_is_loaded_ahead_is_what_a_datagram_needs() -> None:
    code = (
        "from teamclone.logs.scan import scan_shows\n"
        "from teamclone.protocol import monitor\n"
        "monitor.load_reader()\n"
        "loaded = list(scan_shows.signatures)\n"
        f"assert monitor.show_of({WHOLE!r}) is not None\n"
        "assert loaded and scan_shows.signatures == loaded"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_requests_are_what_the_server_reads() -> None:
    assert monitor.init() == b"(dispinit version 3)\0"
    assert monitor.init(5) == b"(dispinit version 5)\0"
    assert monitor.bye() == b"(dispbye)\0"
    assert monitor.kick_off() == b"(dispstart)\0"
    assert monitor.place_player(-1, 7, x=-10.5, y=3.03, body=89.6) == b"(dispplayer -1 7 -168 48 90)\0"
