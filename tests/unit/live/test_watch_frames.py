"""Which of a monitor's cycles are frames of the match, and how they are counted."""

from __future__ import annotations

import numpy as np

from datagrams import packet
from teamclone.live.watch_frames import Seen
from teamclone.protocol.monitor import show_of
from teamclone.protocol.monitor_stream import Frame
from teamclone.rcss.playmodes import PlayMode
from teamclone.world.view import mode_cycles

GOAL = int(PlayMode.GOAL_L)


def add(seen: Seen, cycle: int, *, pm: int = 3, teams: bytes = b"Red Blue 1 2") -> bool:
    text = packet(cycle=cycle, pm=pm, teams=teams)
    show = show_of(text)
    assert show is not None
    return seen.add(Frame(show, text, 0))


def test_frames_are_those_that_a_log_has() -> None:
    seen = Seen()
    assert not any(add(seen, 0, pm=1) for _ in range(3))
    assert all(add(seen, cycle) for cycle in (1, 2))
    assert not add(seen, 3, pm=1)  # half time
    assert add(seen, 4)
    assert add(seen, 5, pm=2)
    assert not add(seen, 5, pm=2)
    frames, players = seen.window(0, 10)
    assert frames["cycle"].tolist() == [1, 2, 4, 5, *[0] * 6]
    assert players["stamina"].shape == (10, 22)
    assert len(seen) == 4
    assert seen.counts.waiting == 5
    assert seen.counts.lost == 0


def test_where_the_clock_stands_equal_frames_are_different_ones() -> None:
    seen = Seen()
    assert add(seen, 7)
    assert all(add(seen, 7, pm=GOAL) for _ in range(3))
    assert [seen.cycle(index) for index in range(4)] == [(7, 0), (7, 1), (7, 2), (7, 3)]
    assert add(seen, 8)
    assert seen.cycle(4) == (8, 0)
    assert seen.counts.doubled == 0


def test_the_age_of_a_play_mode_is_that_of_the_log() -> None:
    seen = Seen()
    for cycle, pm in ((1, 4), (2, 4), (2, 3), (3, 3), (4, 3), (7, 3), (8, 3), (8, GOAL), (8, GOAL), (9, 3), (9, 3)):
        if add(seen, cycle, pm=pm):
            assert seen.mode_cycles == mode_cycles(seen.window(0, len(seen))[0])[-1]


def test_doubled_late_and_lost_datagrams_are_counted_and_no_frame_comes_twice() -> None:
    seen = Seen()
    assert [add(seen, cycle) for cycle in (1, 2, 2, 5, 4, 6)] == [True, True, False, True, False, True]
    assert (seen.counts.doubled, seen.counts.late, seen.counts.lost) == (1, 1, 2)
    assert seen.window(0, 4)[0]["cycle"].tolist() == [1, 2, 5, 6]


def test_there_is_room_for_a_long_match_and_for_odd_numbers() -> None:
    seen = Seen()
    for cycle in range(1, 2500):
        assert add(seen, cycle, teams=b"Red Blue %d 99999" % (cycle % 9))
    assert add(seen, 2500, pm=259)  # of a server of the future
    frames, players = seen.window(0, 2500)
    np.testing.assert_array_equal(frames["cycle"], np.arange(1, 2501))
    assert frames["right_score"].max() == 32767
    assert frames["playmode"][-1] == PlayMode.NULL
    assert (players["stamina"] == 8000).all()
