"""Events of made matches, whose moments are known, and of real ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from teamclone.logs import read_match
from teamclone.logs.columns import FRAMES, PLAYERS
from teamclone.logs.match import Columns, empty_columns
from teamclone.rcss import state_bits
from teamclone.rcss.playmodes import PlayMode
from teamclone.replay.events import EventKind, find_events, touches

RIGHT_9 = 11 + 8
LEFT_7 = 6


@pytest.fixture
def match() -> tuple[Columns, Columns]:
    """Twenty frames of play_on with everybody on the field and the ball at rest in the middle."""
    frames, players = empty_columns(FRAMES, 20), empty_columns(PLAYERS, 20, 22)
    frames["cycle"][:] = np.arange(100, 120)
    frames["playmode"][:] = PlayMode.PLAY_ON
    frames["ball_x"][:] = frames["ball_y"][:] = 0
    players["state"][:] = state_bits.STAND
    return frames, players


def found(match: tuple[Columns, Columns]) -> list[tuple[int, str, int, int, str]]:
    frames, players = match
    events = find_events(frames, players, {"ball_decay": 0.94, "ball_speed_max": 3.0})
    return [(event.frame, event.kind.value, event.side, event.unum, event.text) for event in events]


def kick(match: tuple[Columns, Columns], frame: int, slot: int) -> None:
    """A kick on a frame: its bit is in the next."""
    match[1]["state"][frame + 1, slot] |= state_bits.KICK


def test_nothing_happens(match: tuple[Columns, Columns]) -> None:
    assert found(match) == []
    assert find_events(empty_columns(FRAMES, 0), empty_columns(PLAYERS, 0, 22), {}) == []


def test_kicks_one_after_another(match: tuple[Columns, Columns]) -> None:
    for frame in (3, 4, 6):
        kick(match, frame, LEFT_7)
    match[1]["state"][9, LEFT_7] |= state_bits.KICK_FAULT | state_bits.KICK  # missed the ball
    assert found(match) == [(frame, "kick", 1, 7, "") for frame in (3, 4, 6)]


def test_a_turnover_is_the_first_touch_of_the_other_team(match: tuple[Columns, Columns]) -> None:
    for frame, slot in ((3, LEFT_7), (6, RIGHT_9), (8, RIGHT_9), (12, LEFT_7)):
        kick(match, frame, slot)
    assert [event for event in found(match) if event[1] == "turnover"] == [
        (6, "turnover", -1, 9, "wins the ball from 7"),
        (12, "turnover", 1, 7, "wins the ball from 9"),
    ]


def test_after_a_stop_of_play_it_is_none(match: tuple[Columns, Columns]) -> None:
    kick(match, 3, LEFT_7)
    match[0]["playmode"][5:9] = PlayMode.KICK_IN_R
    kick(match, 8, RIGHT_9)
    kick(match, 10, RIGHT_9)
    assert [event[1] for event in found(match)] == ["kick", "set play", "kick", "kick"]
    assert (5, "set play", -1, 0, "kick in") in found(match)


def test_both_teams_at_once_is_none(match: tuple[Columns, Columns]) -> None:
    kick(match, 3, LEFT_7)
    for slot in (LEFT_7, RIGHT_9):
        kick(match, 5, slot)
    kick(match, 7, LEFT_7)
    assert [event[1] for event in found(match)] == ["kick"] * 4


@pytest.mark.parametrize(
    ("start", "velocity", "text"),
    [
        ((30.0, 0.0), (2.5, 0.0), "from 20 m, on target"),
        ((30.0, 0.0), (2.5, 0.85), "from 20 m, wide"),
        ((30.0, 0.0), (2.5, 2.0), None),  # past the post by metres
        ((30.0, 0.0), (-2.5, 0.0), None),  # the other way
        ((30.0, 0.0), (1.5, 0.0), None),  # led, not shot
        ((0.0, 0.0), (2.9, 0.0), None),  # from half way
    ],
)
def test_shots(
    match: tuple[Columns, Columns], start: tuple[float, float], velocity: tuple[float, float], text: str | None
) -> None:
    frames, _ = match
    frames["ball_x"][:], frames["ball_y"][:] = start
    frames["ball_x"][6:] += velocity[0]
    frames["ball_y"][6:] += velocity[1]
    kick(match, 5, LEFT_7)
    shots = [event for event in found(match) if event[1] == "shot"]
    assert shots == ([] if text is None else [(5, "shot", 1, 7, text)])


def test_the_scorer_touched_the_ball_last(match: tuple[Columns, Columns]) -> None:
    frames, _ = match
    kick(match, 3, RIGHT_9)
    frames["playmode"][8:] = PlayMode.GOAL_R
    frames["right_score"][8:] = 1
    assert (8, "goal", -1, 9, "0:1") in found(match)
    kick(match, 6, LEFT_7)
    assert (8, "goal", -1, 0, "0:1, last touched by 7 of the other team") in found(match)


def test_a_tackle_counts_once_and_may_fail(match: tuple[Columns, Columns]) -> None:
    state = match[1]["state"]
    state[5:15, LEFT_7] |= state_bits.TACKLE
    state[7:17, RIGHT_9] |= state_bits.TACKLE_FAULT
    assert found(match) == [(4, "tackle", 1, 7, "gets the ball"), (6, "tackle", -1, 9, "misses the ball")]


def test_cards_players_and_faults(match: tuple[Columns, Columns]) -> None:
    frames, players = match
    players["state"][4:, LEFT_7] |= state_bits.YELLOW_CARD
    players["state"][9:, RIGHT_9] = 0
    players["type"][12:, LEFT_7] = 5
    frames["playmode"][15:] = PlayMode.OFFSIDE_L
    assert found(match) == [
        (4, "card", 1, 7, "yellow"),
        (9, "player", -1, 9, "leaves the field"),
        (12, "player", 1, 7, "changes to type 5"),
        (15, "foul", 1, 0, "offside"),
    ]


def test_an_unknown_play_mode_is_no_event(match: tuple[Columns, Columns]) -> None:
    match[0]["playmode"][5:] = 200
    assert found(match) == []


def test_real_goals_have_their_scorers(samples_dir: Path) -> None:
    """By the referee's own words in the command log."""
    goals = 0
    for path in sorted(samples_dir.glob("*.rcg.xz")):
        match = read_match(path)
        events = find_events(match.frames, match.players, match.game.server_params)
        mine = [event for event in events if event.kind is EventKind.GOAL]
        goals += len(mine)
        assert (sum(event.side > 0 for event in mine), sum(event.side < 0 for event in mine)) == (
            match.left.score,
            match.right.score,
        )
        kicks = sum(event.kind is EventKind.KICK for event in events)
        assert kicks == sum(touch.kind is EventKind.KICK for touch in touches(match.players["state"]))
        counted = match.players["count_kick"][-1] - match.players["count_kick"][0]
        assert 0.9 * counted.sum() <= kicks <= counted.sum()
        for event in mine:
            assert any(
                shot.kind in (EventKind.SHOT, EventKind.KICK, EventKind.TACKLE)
                and event.frame - 60 < shot.frame < event.frame
                and shot.side == event.side
                for shot in events
            )
    assert goals > 10
