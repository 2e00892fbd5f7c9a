"""The list of a replay: the events in words."""

from __future__ import annotations

from pathlib import Path

import pytest

from made_match import LEFT_1, LEFT_7, LEFT_9, RIGHT_1, RIGHT_4, RIGHT_9, MadeMatch
from teamclone.events.find import find_events
from teamclone.logs import read_match
from teamclone.rcss import state_bits
from teamclone.rcss.playmodes import PlayMode
from teamclone.replay.events import NOT_LISTED, listed

Line = tuple[int, str, int, int, str]


@pytest.fixture
def match() -> MadeMatch:
    return MadeMatch()


def lines(match: MadeMatch, *kinds: str) -> list[Line]:
    """Frame, kind, side, number and text of the events of these kinds."""
    found = [
        (event.frame, event.kind.value, event.side, event.unum, event.text)
        for event in listed(match.events(), match.frames)
    ]
    return [line for line in found if line[1] in kinds]


def test_passes_and_what_became_of_them(match: MadeMatch) -> None:
    for frame, slot in ((3, LEFT_7), (6, LEFT_9), (9, RIGHT_4), (12, RIGHT_9)):
        match.kick(frame, slot)
    match.ball(5, 12, 0)
    match.ball(8, 12, 8)
    match.mode(15, PlayMode.KICK_IN_L)
    assert lines(match, "pass", "interception", "out of bounds") == [
        (3, "pass", 1, 7, "to 9, 12 m"),
        (6, "pass", 1, 9, "8 m, intercepted by 4"),
        (9, "pass", -1, 4, "to 9, 0 m"),
        (9, "interception", -1, 4, "wins the ball from 9"),
        (12, "pass", -1, 9, "0 m, out"),
        (15, "out of bounds", -1, 9, ""),
    ]


def test_a_pass_that_is_no_clean_one(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    for slot in (LEFT_1, LEFT_9):
        match.kick(6, slot)
    match.tackle(10, LEFT_1)
    match.kick(12, LEFT_7)
    match.tackle(14, LEFT_9)
    assert lines(match, "pass") == [
        (3, "pass", 1, 7, "to several, 0 m, not under control"),
        (10, "pass", 1, 1, "to 7, 0 m"),
        (12, "pass", 1, 7, "to 9, 0 m, not under control"),
    ]


def test_dribbles(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.dash(4, LEFT_7)
    match.ball(6, 5, 0)
    match.stand(LEFT_7, 6, 0, 6)
    match.kick(6, LEFT_7)
    match.tackle(9, RIGHT_4)
    assert lines(match, "dribble", "self pass", "tackle") == [
        (3, "dribble", 1, 7, "5 m"),
        (3, "self pass", 1, 7, "5 m"),
        (6, "dribble", 1, 7, "0 m, lost to 4"),
        (9, "tackle", -1, 4, "lost"),
    ]


def test_the_touch_of_a_restart_is_not_listed(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.mode(5, PlayMode.FOUL_CHARGE_L, 7)
    match.mode(7, PlayMode.FREE_KICK_R, 9)
    match.players["state"][5:, RIGHT_4] |= state_bits.FOUL_CHARGED
    match.kick(8, RIGHT_4)
    assert lines(match, "interception", "foul", "set play") == [
        (5, "foul", 1, 0, "charge of 4"),
        (7, "set play", -1, 4, "free kick"),
    ]


def test_shots_and_goals(match: MadeMatch) -> None:
    match.ball(0, 30, 0)
    match.ball(6, 32.5, 0)
    match.kick(5, LEFT_7)
    match.catch(9, RIGHT_1)
    assert lines(match, "shot", "catch") == [(5, "shot", 1, 7, "from 22 m, saved"), (9, "catch", -1, 1, "")]


def test_the_scorer_touched_the_ball_last(match: MadeMatch) -> None:
    match.kick(3, RIGHT_9)
    match.mode(8, PlayMode.GOAL_R)
    match.frames["right_score"][8:] = 1
    assert lines(match, "goal", "shot") == [(3, "shot", -1, 9, "from 52 m, goal"), (8, "goal", -1, 9, "0:1")]
    match.kick(6, LEFT_7)
    assert lines(match, "goal") == [(8, "goal", -1, 0, "0:1, last touched by 7 of the other team")]


def test_a_clearance_and_a_press(match: MadeMatch) -> None:
    match.ball(0, -40, 0)
    match.ball(4, -37, 0)
    match.ball(7, -10, 0)
    match.kick(3, LEFT_7)
    match.kick(9, RIGHT_4)
    for frame in range(10, 16):
        match.stand(LEFT_9, -5.5 - (frame - 10) * 0.5, 0, frame)
    match.stand(LEFT_9, 0, 0, 16)
    assert lines(match, "clearance", "press") == [
        (3, "clearance", 1, 7, "30 m, intercepted"),
        (10, "press", 1, 9, "6 cycles, lost"),
    ]


def test_what_the_referee_says(match: MadeMatch) -> None:
    match.players["state"][4:, LEFT_7] |= state_bits.YELLOW_CARD
    match.players["type"][12:, LEFT_7] = 5
    match.mode(15, PlayMode.OFFSIDE_L, 17)
    match.mode(17, PlayMode.TIME_OVER)
    assert lines(match, "card", "player", "offside", "period") == [
        (4, "card", 1, 7, "yellow"),
        (12, "player", 1, 7, "changes to type 5"),
        (15, "offside", 1, 0, ""),
        (17, "period", 0, 0, "time over"),
    ]


def test_real_events_are_in_order_and_listed_once(samples_dir: Path) -> None:
    match = read_match(min(samples_dir.glob("*.rcg.xz")))
    events = find_events(match.frames, match.players, match.game.server_params)
    made = listed(events, match.frames)
    assert [event.frame for event in made] == sorted(event.frame for event in made)
    left_out = ((events["outcome"] == "restart") | (events["kind"] == NOT_LISTED[0].value)).sum()
    assert len(made) == len(events["kind"]) - left_out > 300
