"""What a team does with the ball, by hand and against the log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from made_match import LEFT_2, LEFT_7, LEFT_9, RIGHT_4, MadeMatch
from scouted import of_made, of_match
from teamclone.events.find import find_events
from teamclone.logs import Match, read_match
from teamclone.rcss.playmodes import PlayMode
from teamclone.scout.measures import Look
from teamclone.scout.sections import attack, identity
from teamclone.scout.seen import Seen


def passing() -> MadeMatch:
    """2 passes to 7 on the left, 7 to 9 in the penalty area, 9 to nobody but number 4 of the others."""
    match = MadeMatch(40)
    match.ball(0, 0, -30)
    match.stand(LEFT_2, 0, -30)
    match.stand(LEFT_7, 20, -30)
    match.stand(LEFT_9, 45, 0)
    match.stand(RIGHT_4, 48, 10)
    for frame, slot in ((2, LEFT_2), (10, LEFT_7), (20, LEFT_9), (30, RIGHT_4)):
        match.kick(frame, slot)
    match.ball(10, 20, -30)
    match.ball(20, 45, 0)
    match.ball(30, 48, 10)
    return match


def test_progressive_passes_and_entries_by_hand() -> None:
    look = attack.look(of_made(passing()))
    assert look.numbers["progressive"][0] == 2
    assert look.numbers["entries"][0] == 1
    assert [look.numbers[f"entries_{lane}"] for lane in ("left", "centre", "right")] == [(1, 1), (0, 1), (0, 1)]
    assert look.numbers["entries_by_pass"] == (1, 1)
    assert look.arrays["network"][1, 6] == look.arrays["network"][6, 8] == 1
    assert look.arrays["network"].sum() == 2
    assert look.arrays["entries"].tolist() == [[20, -30, 45, 0]]
    # 9 is under pressure of 4 but not within 5 m; the pass is lost.
    assert look.numbers["completed_free"] == (2, 3)


def test_the_other_team_sees_it_turned() -> None:
    match = passing()
    match.turn()
    one, other = attack.look(of_made(passing())), attack.look(of_made(match, side=-1))
    assert one.numbers == other.numbers
    for name, values in one.arrays.items():
        np.testing.assert_array_equal(values, other.arrays[name], err_msg=name)


@pytest.fixture(scope="module")
def match(samples_dir: Path) -> Match:
    return read_match(next(samples_dir.glob("*Cyrus2DBase_0-vs-HELIOS_base*.rcg.xz")))


@pytest.fixture(scope="module")
def seen(match: Match) -> Seen:
    return of_match(match, side=-1)


def test_counts_are_those_of_the_events(match: Match, seen: Seen) -> None:
    events = find_events(match.frames, match.players, match.game.server_params)
    own = (events["side"] == -1) & (events["kind"] == "pass")
    look = attack.look(seen)
    assert look.arrays["counts"][:, 1].sum() == (own & (events["outcome"] != "restart")).sum()
    done = own & (events["outcome"] == "completed")
    assert look.arrays["counts"][:, 2].sum() == look.arrays["network"].sum() == done.sum()
    for unum in range(1, 12):
        assert look.arrays["network"][unum - 1].sum() == (done & (events["unum"] == unum)).sum()
    # Every pass in one third, and with or without pressure.
    for names in (("pressed", "free"), ("0", "1", "2")):
        parts = [look.numbers[f"completed_{name}"] for name in names]
        assert sum(part for part, _ in parts) == done.sum()
    assert identity.look(seen).numbers["pass_completion"] == (done.sum(), look.arrays["counts"][:, 1].sum())


def test_pressure_by_a_plain_walk(match: Match, seen: Seen) -> None:
    """Opponents within 5 m of the ball on the frame of the pass, straight from the log's columns."""
    passes = seen.pick(attack.EventKind.PASS)
    pressed = 0
    for frame, outcome in zip(passes["frame"].tolist(), passes["outcome"].tolist(), strict=True):
        if outcome == "restart":
            continue
        ball = match.frames["ball_x"][frame], match.frames["ball_y"][frame]
        pressed += any(
            (match.players["x"][frame, slot] - ball[0]) ** 2 + (match.players["y"][frame, slot] - ball[1]) ** 2 <= 25
            and match.players["state"][frame, slot] & 1
            for slot in range(11)
        )
    assert attack.look(seen).numbers["completed_pressed"][1] == pressed


def test_who_has_the_ball_is_what_the_statistics_say(match: Match, seen: Seen) -> None:
    from teamclone.events.statistics import team_statistics

    both = team_statistics(find_events(match.frames, match.players, match.game.server_params))
    part, whole = identity.look(seen).numbers["possession"]
    assert part / whole == pytest.approx(both.right.possession)
    assert not seen.has[match.frames["playmode"] != PlayMode.PLAY_ON].any()


def test_nothing_happens_and_nothing_breaks() -> None:
    for frames in (1, 5):
        empty = of_made(MadeMatch(frames))
        for section in (identity, attack):
            look = section.look(empty)
            assert isinstance(look, Look)
            assert all(np.isfinite(pair).all() for pair in look.numbers.values()), section.KEY
    nowhere = MadeMatch(5)
    for name in ("x", "y"):
        nowhere.players[name][:] = np.nan
    nowhere.players["state"][:] = 0
    nowhere.frames["ball_x"][:] = np.nan
    for section in (identity, attack):
        assert isinstance(section.look(of_made(nowhere)), Look)
