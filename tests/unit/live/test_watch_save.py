"""A saved log is the server's: the same columns, without a loss, also where the watcher was killed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from datagrams import packet
from showing import parameters_of, shows_of
from teamclone.errors import LiveError
from teamclone.live.watch_frames import Seen
from teamclone.live.watch_save import RcgWriter
from teamclone.logs import read_match
from teamclone.protocol.monitor import show_of
from teamclone.protocol.monitor_stream import Frame
from teamclone.protocol.parameters import Parameters


def parameters(texts: list[bytes]) -> Parameters:
    made = Parameters()
    assert all(made.take(text) for text in texts)
    assert made.whole
    return made


def frame(text: bytes) -> Frame:
    show = show_of(text)
    assert show is not None
    return Frame(show, text.rstrip(b"\0"), 0)


@pytest.fixture(scope="module")
def log(samples_dir: Path) -> Path:
    return min(samples_dir.glob("*.rcg.xz"))


def test_what_was_seen_is_what_the_server_logged(log: Path, tmp_path: Path) -> None:
    seen, path = Seen(), tmp_path / "seen.rcg"
    writer = RcgWriter(path, parameters(parameters_of(log)), version=5)
    for text in shows_of(log):
        if seen.add(frame(text)):
            writer.frame(frame(text))
    assert not path.exists()
    writer.close()
    assert [one.name for one in tmp_path.iterdir()] == ["seen.rcg"]
    saved, logged = read_match(path), read_match(log)
    assert saved.game.complete
    assert saved.game.problems == ()
    assert (saved.left, saved.right) == (logged.left, logged.right)
    assert saved.game.server_params == logged.game.server_params
    assert saved.game.player_params == logged.game.player_params
    for mine, theirs in (
        (saved.frames, logged.frames),
        (saved.players, logged.players),
        (saved.game.player_types, logged.game.player_types),
        (seen.window(0, len(seen))[0], logged.frames),
        (seen.window(0, len(seen))[1], logged.players),
    ):
        for name, column in theirs.items():
            np.testing.assert_array_equal(mine[name], column, err_msg=name)


def test_a_log_that_was_broken_off_is_one_that_ends_early(log: Path, tmp_path: Path) -> None:
    writer = RcgWriter(tmp_path / "seen.rcg", parameters(parameters_of(log)), version=5)
    for cycle in range(1, 20):
        writer.frame(frame(packet(cycle=cycle, version=5)))
    writer._file.flush()  # a second of the match would do it
    saved = read_match(tmp_path / ".seen.rcg.part")
    assert saved.frames["cycle"].tolist() == list(range(1, 20))
    assert not saved.game.complete
    writer.close()
    assert not read_match(tmp_path / "seen.rcg").game.complete


def test_penalties_and_older_records_are_kept(log: Path, tmp_path: Path) -> None:
    writer = RcgWriter(tmp_path / "seen.rcg", parameters(parameters_of(log)), version=5)
    for cycle in range(1, 10):
        writer.frame(frame(packet(cycle=cycle, version=3 + cycle % 3, teams=b"Red Blue 1 1 3 0 2 1")))
    writer.message(b'(msg 9 1 "(penalty_score_l)")')
    writer.close()
    saved = read_match(tmp_path / "seen.rcg")
    assert saved.game.problems == ()
    assert (saved.left.penalties_scored, saved.right.penalties_missed) == (3, 1)
    assert len(saved.frames["cycle"]) == 9


def test_a_place_that_cannot_be_written_is_named(log: Path, tmp_path: Path) -> None:
    with pytest.raises(LiveError, match=r"nowhere/seen\.rcg: cannot be written .*--save"):
        RcgWriter(tmp_path / "nowhere" / "seen.rcg", parameters(parameters_of(log)), version=5)
