"""Each kind of event and each outcome in made situations, whose moments are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from made_match import LEFT_1, LEFT_2, LEFT_7, LEFT_9, PARAMS, RIGHT_1, RIGHT_2, RIGHT_4, RIGHT_9, MadeMatch
from teamclone.events.definitions import COLUMNS, KINDS, OUTCOMES, EventKind, Outcome
from teamclone.events.find import find_events
from teamclone.logs.columns import FRAMES, PLAYERS
from teamclone.logs.match import empty_columns
from teamclone.rcss import state_bits
from teamclone.rcss.playmodes import PlayMode


@pytest.fixture
def match() -> MadeMatch:
    return MadeMatch()


def test_nothing_happens(match: MadeMatch) -> None:
    events = match.events()
    assert [(one.name, len(events[one.name])) for one in COLUMNS] == [(one.name, 0) for one in COLUMNS]


def test_a_log_without_frames_has_the_columns() -> None:
    events = find_events(empty_columns(FRAMES, 0), empty_columns(PLAYERS, 0, 22), PARAMS)
    assert list(events) == [one.name for one in COLUMNS]
    assert all(len(values) == 0 for values in events.values())


def test_every_kind_is_defined() -> None:
    assert set(KINDS) == set(EventKind)
    assert {outcome for outcomes in OUTCOMES.values() for outcome in outcomes} == set(Outcome) - {Outcome.NONE}


def test_numbers_of_an_event(match: MadeMatch) -> None:
    match.frames["stoppage"][3] = 2
    match.ball(0, -10, 5)
    match.ball(4, -8, 5)
    match.ball(8, 0, 11)
    match.kick(3, LEFT_7)
    match.kick(8, LEFT_9)
    events = match.events()
    [row] = np.flatnonzero(events["kind"] == "pass")
    values = {one.name: events[one.name][row].item() for one in COLUMNS}
    assert values.pop("length") == pytest.approx(np.hypot(10, 6))
    assert np.isnan(values.pop("expected_goals"))
    assert values == {
        **{"kind": "pass", "outcome": "completed", "frame": 3, "cycle": 103, "stoppage": 2, "playmode": 3},
        **{"end_frame": 8, "end_cycle": 108, "side": 1, "unum": 7, "other_side": 1, "other_unum": 9},
        **{"x": -10, "y": 5, "end_x": 0, "end_y": 11, "speed": 2},
    }
    assert {one.name: events[one.name].dtype.name for one in COLUMNS if one.dtype != "string"} == {
        one.name: one.dtype for one in COLUMNS if one.dtype != "string"
    }


def test_a_pass_that_a_teammate_tackles_has_failed(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.tackle(8, LEFT_9)
    assert match.rows("pass") == [("pass", "failed", 3, 8, 1, 7, 1, 9)]


def test_so_has_one_that_two_teammates_touch(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    for slot in (LEFT_2, LEFT_9):
        match.kick(8, slot)
    match.kick(10, LEFT_7)
    assert match.rows("pass") == [("pass", "failed", 3, 8, 1, 7, 1, 0)]


def test_an_intercepted_pass(match: MadeMatch) -> None:
    match.ball(4, 10, 0)
    match.kick(3, LEFT_7)
    match.kick(8, RIGHT_4)
    assert match.rows("pass", "interception", "dribble") == [
        ("pass", "intercepted", 3, 8, 1, 7, -1, 4),
        ("interception", "won", 3, 8, -1, 4, 1, 7),
    ]


def test_two_opponents_intercept(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.kick(8, RIGHT_4)
    match.tackle(8, RIGHT_9)
    assert match.rows("pass", "interception") == [
        ("pass", "intercepted", 3, 8, 1, 7, -1, 0),
        ("interception", "won", 3, 8, -1, 0, 1, 7),
    ]


def test_both_teams_at_once(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    for slot in (LEFT_7, RIGHT_4):
        match.kick(8, slot)
    match.kick(12, RIGHT_4)
    assert match.rows("multi touch", "interception", "dribble", "pass") == [("multi touch", "", 3, 8, 1, 7, 0, 0)]


def test_a_goalkeeper_catches_a_pass(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.catch(8, RIGHT_1)
    match.mode(9, PlayMode.FREE_KICK_R)
    assert match.rows("pass", "interception", "catch") == [
        ("pass", "caught", 3, 8, 1, 7, -1, 1),
        ("catch", "", 8, 8, -1, 1, 1, 7),
    ]


def test_a_pass_out_of_the_field(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.mode(9, PlayMode.KICK_IN_R)
    assert match.rows("pass", "out of bounds", "set play") == [
        ("pass", "out", 3, 9, 1, 7, 0, 0),
        ("out of bounds", "", 3, 9, 1, 7, 0, 0),
        ("set play", "kick in", 9, 19, -1, 0, 0, 0),
    ]


def test_a_pass_into_offside(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.mode(9, PlayMode.OFFSIDE_L)
    assert match.rows("pass", "offside", "foul") == [
        ("pass", "offside", 3, 9, 1, 7, 0, 0),
        ("offside", "", 9, 9, 1, 0, 0, 0),
    ]


@pytest.mark.parametrize(
    ("taker", "row"),
    [
        (RIGHT_4, ("interception", "restart", 3, 11, -1, 4, 1, 7)),
        (LEFT_9, ("pass", "restart", 3, 11, 1, 7, 1, 9)),
        (LEFT_7, ("dribble", "restart", 3, 11, 1, 7, 1, 7)),
    ],
)
def test_after_a_stop_the_next_touch_is_a_restart(match: MadeMatch, taker: int, row: tuple[object, ...]) -> None:
    match.kick(3, LEFT_7)
    match.dash(6, LEFT_7)
    match.mode(5, PlayMode.FOUL_CHARGE_L, 9)
    match.mode(9, PlayMode.FREE_KICK_R if taker == RIGHT_4 else PlayMode.FREE_KICK_L, 12)
    match.kick(11, taker)
    assert match.rows("pass", "interception", "dribble") == [row]


def test_the_ball_that_went_out_is_forgotten(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.mode(5, PlayMode.KICK_IN_R, 9)
    match.kick(8, RIGHT_4)
    match.kick(12, RIGHT_9)
    assert match.rows("interception", "set play", "pass") == [
        ("pass", "out", 3, 5, 1, 7, 0, 0),
        ("set play", "kick in", 5, 9, -1, 4, 0, 0),
        ("pass", "completed", 8, 12, -1, 4, -1, 9),
    ]


def test_touches_while_nothing_is_in_play_begin_nothing(match: MadeMatch) -> None:
    match.mode(2, PlayMode.FREE_KICK_L, 12)
    match.kick(4, LEFT_7)
    match.kick(15, LEFT_9)
    assert match.rows("pass", "kick") == [("kick", "", 4, 4, 1, 7, 0, 0), ("kick", "", 15, 15, 1, 9, 0, 0)]


def test_a_goal_kick_is_in_play_before_it_leaves_the_area(match: MadeMatch) -> None:
    match.mode(0, PlayMode.GOAL_KICK_L, 6)
    match.kick(3, LEFT_1)
    match.kick(9, LEFT_7)
    assert match.rows("pass") == [("pass", "completed", 3, 9, 1, 1, 1, 7)]


def test_a_dribble_needs_a_dash(match: MadeMatch) -> None:
    for frame in (3, 5, 8):
        match.kick(frame, LEFT_7)
    match.dash(6, LEFT_7)
    assert match.rows("dribble", "kick") == [
        *(("kick", "", 3, 3, 1, 7, 0, 0), ("dribble", "completed", 5, 8, 1, 7, 1, 7)),
        *(("kick", "", frame, frame, 1, 7, 0, 0) for frame in (5, 8)),
    ]


def test_without_counters_a_player_that_moved_has_dashed(match: MadeMatch) -> None:
    match.players["count_dash"][:] = -1
    for frame in (3, 5, 8):
        match.kick(frame, LEFT_7)
    match.stand(LEFT_7, 0.9, 0, 0)
    match.stand(LEFT_7, 2.0, 0, 7)
    assert match.rows("dribble") == [("dribble", "completed", 5, 8, 1, 7, 1, 7)]


def test_a_dribble_that_ends_with_a_tackle(match: MadeMatch) -> None:
    match.kick(2, LEFT_7)
    match.dash(3, LEFT_7)
    match.tackle(5, LEFT_7)
    assert match.rows("dribble", "ball touch") == [("dribble", "failed", 2, 5, 1, 7, 1, 7)]


def test_without_a_dash_it_is_a_ball_touch(match: MadeMatch) -> None:
    match.kick(2, LEFT_7)
    match.tackle(5, LEFT_7)
    assert match.rows("dribble", "ball touch") == [("ball touch", "", 2, 5, 1, 7, 1, 7)]


def test_a_ball_lost_at_the_feet_is_a_lost_dribble(match: MadeMatch) -> None:
    match.stand(LEFT_7, 1, 0)
    match.kick(3, LEFT_7)
    match.tackle(6, RIGHT_4)
    assert match.rows("dribble", "pass") == [("dribble", "lost", 3, 6, 1, 7, -1, 4)]


def test_a_long_dribble_is_a_self_pass(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.dash(4, LEFT_7)
    match.ball(10, 5.0, 0)
    match.kick(10, LEFT_7)
    match.dash(11, LEFT_7)
    match.ball(14, 9.9, 0)
    match.kick(14, LEFT_7)
    assert match.rows("self pass") == [("self pass", "completed", 3, 10, 1, 7, 1, 7)]
    assert len(match.rows("dribble")) == 2


@pytest.mark.parametrize(
    ("defenders", "end", "through"),
    [
        ((20.0, 50.0), 25.0, True),
        ((20.0, 50.0), 19.0, False),  # before the second last opponent
        ((-10.0, 50.0), 4.0, True),  # behind whom, but not in the own half
        ((-10.0, 50.0), -4.0, False),
    ],
)
def test_through_passes(match: MadeMatch, defenders: tuple[float, float], end: float, through: bool) -> None:
    match.players["x"][:, 11:] = -30.0
    match.stand(RIGHT_4, defenders[0], 0)
    match.stand(RIGHT_1, defenders[1], 0)
    match.ball(0, -20, 0)
    match.ball(4, end, 0)
    match.kick(3, LEFT_7)
    match.kick(9, LEFT_9)
    expected = [("through pass", "completed", 3, 9, 1, 7, 1, 9)] if through else []
    assert match.rows("through pass") == expected


def test_through_passes_of_the_right_team_go_left(match: MadeMatch) -> None:
    match.players["x"][:, :11] = 30.0
    match.stand(LEFT_1, -50, 0)
    match.stand(LEFT_2, -20, 0)
    match.ball(4, -25, 20)
    match.kick(3, RIGHT_9)
    match.kick(9, LEFT_2)
    assert match.rows("through pass") == [("through pass", "intercepted", 3, 9, -1, 9, 1, 2)]


@pytest.mark.parametrize(
    ("start", "velocity", "outcome"),
    [
        ((30.0, 0.0), (2.5, 0.0), "stopped"),
        ((30.0, 0.0), (2.5, 0.85), "wide"),
        ((30.0, 0.0), (2.5, 2.0), None),  # past the post by metres
        ((30.0, 0.0), (-2.5, 0.0), None),  # the other way
        ((30.0, 0.0), (1.5, 0.0), None),  # led, not shot
        ((0.0, 0.0), (2.9, 0.0), None),  # from half way
        ((18.0, 0.0), (1.9, 0.0), None),  # too slow to get there
    ],
)
def test_shots(
    match: MadeMatch, start: tuple[float, float], velocity: tuple[float, float], outcome: str | None
) -> None:
    match.ball(0, *start)
    match.ball(6, start[0] + velocity[0], start[1] + velocity[1])
    match.kick(5, LEFT_7)
    match.mode(15, PlayMode.DROP_BALL)
    assert match.rows("shot") == ([] if outcome is None else [("shot", outcome, 5, 15, 1, 7, 0, 0)])


def shot(match: MadeMatch) -> None:
    match.ball(0, -30, 0)
    match.ball(6, -32.5, 0)
    match.kick(5, RIGHT_9)


@pytest.mark.parametrize(
    ("what", "outcome", "other"),
    [
        (lambda match: match.catch(9, LEFT_1), "saved", (1, 1)),
        (lambda match: match.kick(9, LEFT_1), "saved", (1, 1)),
        (lambda match: match.kick(9, LEFT_2), "blocked", (1, 2)),
        (lambda match: match.kick(9, RIGHT_2), "blocked", (-1, 2)),
        (lambda match: match.mode(9, PlayMode.GOAL_KICK_L), "wide", (0, 0)),
        (lambda match: match.mode(9, PlayMode.GOAL_R), "goal", (0, 0)),
    ],
)
def test_what_became_of_a_shot(
    match: MadeMatch, what: Callable[[MadeMatch], None], outcome: str, other: tuple[int, int]
) -> None:
    shot(match)
    what(match)
    assert match.rows("shot") == [("shot", outcome, 5, 9, -1, 9, *other)]
    assert match.rows("clearance", "dribble") == []


def test_only_the_last_of_several_kicks_is_the_shot(match: MadeMatch) -> None:
    shot(match)
    match.ball(8, -35.0, 0)
    match.kick(7, RIGHT_9)
    assert match.rows("shot") == [("shot", "stopped", 7, 19, -1, 9, 0, 0)]


def test_goals(match: MadeMatch) -> None:
    match.kick(3, RIGHT_9)
    match.mode(8, PlayMode.GOAL_R)
    assert match.rows("goal", "shot") == [
        ("shot", "goal", 3, 8, -1, 9, 0, 0),
        ("goal", "scored", 8, 8, -1, 9, 0, 0),
    ]
    match.kick(6, LEFT_7)
    assert match.rows("goal", "shot") == [("goal", "own goal", 8, 8, -1, 0, 1, 7)]
    match.kick(6, RIGHT_9)
    assert match.rows("goal", "shot") == [("goal", "unclear", 8, 8, -1, 0, 0, 0)]
    match.kick(7, RIGHT_9)
    match.kick(7, RIGHT_2)
    assert match.rows("goal", "shot") == [
        ("shot", "goal", 7, 8, -1, 0, 0, 0),
        ("goal", "scored", 8, 8, -1, 0, 0, 0),
    ]


def test_a_goal_that_nobody_kicked_is_unclear(match: MadeMatch) -> None:
    match.mode(8, PlayMode.GOAL_R)
    assert match.rows("goal") == [("goal", "unclear", 8, 8, -1, 0, 0, 0)]


@pytest.mark.parametrize(
    ("x", "velocity", "length", "cleared"),
    [(-20, 2, 15, True), (-17, 2, 15, False), (-20, 1.7, 15, False), (-20, -2, 15, False), (-20, 2, 9.9, False)],
)
def test_clearances(match: MadeMatch, x: float, velocity: float, length: float, cleared: bool) -> None:
    match.ball(0, x, 0)
    match.ball(4, x + velocity, 0)
    match.ball(8, x + np.copysign(length, velocity), 0)
    match.kick(3, LEFT_7)
    match.kick(8, RIGHT_4)
    kind = "clearance" if cleared else "pass"
    assert match.rows("clearance", "pass") == [(kind, "intercepted", 3, 8, 1, 7, -1, 4)]


@pytest.mark.parametrize(
    ("after", "outcome", "end", "other"),
    [
        (lambda match: match.kick(9, LEFT_9), "won", 9, (1, 9)),
        (lambda match: match.kick(9, RIGHT_4), "lost", 9, (-1, 4)),
        (lambda match: match.mode(9, PlayMode.KICK_IN_L), "won", 9, (0, 0)),
        (lambda match: match.mode(9, PlayMode.KICK_IN_R), "lost", 9, (0, 0)),
        (lambda match: match.mode(9, PlayMode.FOUL_CHARGE_L), "lost", 9, (0, 0)),
        (lambda match: match.mode(9, PlayMode.GOAL_L), "won", 9, (0, 0)),
        (lambda match: match.catch(9, LEFT_1), "won", 9, (0, 0)),
        (lambda match: None, "lost", 19, (0, 0)),
    ],
)
def test_tackles(
    match: MadeMatch, after: Callable[[MadeMatch], None], outcome: str, end: int, other: tuple[int, int]
) -> None:
    match.tackle(4, LEFT_7)
    after(match)
    assert match.rows("tackle") == [("tackle", outcome, 4, end, 1, 7, *other)]


def test_a_missed_tackle_counts_once(match: MadeMatch) -> None:
    match.tackle(6, RIGHT_9, missed=True)
    assert match.rows("tackle", "kick", "pass") == [("tackle", "missed", 6, 6, -1, 9, 0, 0)]


def test_possession(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.kick(6, LEFT_9)
    for slot in (LEFT_9, RIGHT_4):  # together: the ball stays the left team's
        match.kick(8, slot)
    match.kick(10, RIGHT_4)
    match.mode(13, PlayMode.KICK_IN_L, 16)
    match.kick(15, LEFT_7)
    assert match.rows("possession") == [
        ("possession", "lost", 3, 10, 1, 7, 1, 9),
        ("possession", "out", 10, 13, -1, 4, -1, 4),
        ("possession", "end", 16, 19, 1, 7, 1, 7),
    ]


@pytest.mark.parametrize(
    ("mode", "outcome"),
    [
        (PlayMode.GOAL_L, "goal"),
        (PlayMode.OFFSIDE_L, "offside"),
        (PlayMode.BACK_PASS_L, "foul"),
        (PlayMode.DROP_BALL, "stopped"),
        (PlayMode.CORNER_KICK_R, "out"),
    ],
)
def test_how_possession_ends(match: MadeMatch, mode: PlayMode, outcome: str) -> None:
    match.kick(3, LEFT_7)
    match.mode(9, mode)
    assert match.rows("possession") == [("possession", outcome, 3, 9, 1, 7, 1, 7)]


def test_possession_ends_in_the_hands_of_a_goalkeeper(match: MadeMatch) -> None:
    match.kick(3, LEFT_7)
    match.catch(8, RIGHT_1)
    match.mode(9, PlayMode.FREE_KICK_R)
    assert match.rows("possession") == [("possession", "caught", 3, 9, 1, 7, 1, 7)]


def pressed(match: MadeMatch, *, first: int, last: int, step: float) -> None:
    """The right number 4 runs towards the ball of the left 7 from 4.9 m on, within 5 m from one frame to another."""
    match.kick(2, LEFT_7)
    for frame in range(first, last + 1):
        match.stand(RIGHT_4, 4.9 - (frame - first) * step, 0, frame)
    match.stand(RIGHT_4, 8, 0, last + 1)


def test_a_press(match: MadeMatch) -> None:
    pressed(match, first=5, last=9, step=0.5)
    assert match.rows("press") == [("press", "lost", 5, 10, -1, 4, 1, 7)]
    match.kick(10, RIGHT_2)
    assert match.rows("press") == [("press", "won", 5, 10, -1, 4, 1, 7)]


@pytest.mark.parametrize(("last", "step"), [(8, 0.66), (9, 0.49), (14, -0.01)])
def test_no_press(match: MadeMatch, last: int, step: float) -> None:
    """Too short, too little of a run, standing where the ball is."""
    pressed(match, first=5, last=last, step=step)
    assert match.rows("press") == []


def test_a_team_does_not_press_itself(match: MadeMatch) -> None:
    pressed(match, first=5, last=9, step=0.5)
    match.players["x"][:, LEFT_9] = match.players["x"][:, RIGHT_4]
    match.players["y"][:, LEFT_9] = match.players["y"][:, RIGHT_4]
    assert [row[4:6] for row in match.rows("press")] == [(-1, 4)]


def test_a_foul_has_who_and_whom(match: MadeMatch) -> None:
    match.tackle(8, RIGHT_9)
    match.players["state"][9:, LEFT_7] |= state_bits.FOUL_CHARGED
    match.mode(9, PlayMode.FOUL_CHARGE_R)
    assert match.rows("foul") == [("foul", "charge", 9, 9, -1, 9, 1, 7)]


def test_a_back_pass_has_its_goalkeeper(match: MadeMatch) -> None:
    match.players["state"][9:, LEFT_1] |= state_bits.BACK_PASS
    match.mode(9, PlayMode.BACK_PASS_L)
    assert match.rows("foul") == [("foul", "back pass", 9, 9, 1, 1, 0, 0)]


def test_cards_players_and_periods(match: MadeMatch) -> None:
    match.players["state"][4:, LEFT_7] |= state_bits.YELLOW_CARD
    match.players["state"][6:, LEFT_9] |= state_bits.RED_CARD
    match.players["state"][9:, RIGHT_9] = 0
    match.players["state"][11:, RIGHT_9] = state_bits.STAND
    match.players["type"][12:, LEFT_7] = 5
    match.mode(15, PlayMode.TIME_OVER)
    assert match.rows("card", "player", "period") == [
        ("card", "yellow", 4, 4, 1, 7, 0, 0),
        ("card", "red", 6, 6, 1, 9, 0, 0),
        ("player", "leaves the field", 9, 9, -1, 9, 0, 0),
        ("player", "comes onto the field", 11, 11, -1, 9, 0, 0),
        ("player", "changes to type 5", 12, 12, 1, 7, 0, 0),
        ("period", "time over", 15, 15, 0, 0, 0, 0),
    ]


def test_a_set_play_of_which_somebody_else_kicks_has_no_taker(match: MadeMatch) -> None:
    match.mode(5, PlayMode.CORNER_KICK_L, 9)
    match.kick(8, RIGHT_4)
    assert match.rows("set play") == [("set play", "corner kick", 5, 9, 1, 0, 0, 0)]


def test_an_unknown_play_mode_is_no_event(match: MadeMatch) -> None:
    match.frames["playmode"][5:] = 200
    assert match.rows(*EventKind) == []


def test_numbers_that_are_none_give_no_warning(match: MadeMatch) -> None:
    match.ball(0, np.nan, np.inf)
    match.ball(9, 3e38, -3e38)
    match.players["x"][:] = np.nan
    match.kick(3, LEFT_7)
    match.kick(6, LEFT_9)
    match.kick(12, RIGHT_4)
    assert [row[:2] for row in match.rows("pass", "interception")] == [("pass", "completed"), ("interception", "won")]
