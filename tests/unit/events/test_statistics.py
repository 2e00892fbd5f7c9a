"""Statistics of teams: by hand on a made match, and of a real one against counts of its own log."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from made_match import LEFT_7, LEFT_9, RIGHT_1, RIGHT_4, RIGHT_9, MadeMatch
from teamclone.events.find import find_events
from teamclone.events.rcg2data import as_rcg2data
from teamclone.events.statistics import TeamStatistics, described, team_statistics
from teamclone.logs import read_match
from teamclone.rcss.playmodes import PlayMode


def made() -> MadeMatch:
    """The left team passes twice, loses the third and, after a goal of the right one, the fourth."""
    match = MadeMatch(40)
    match.frames["ball_x"][:] = -40
    for frame, slot in ((2, LEFT_7), (6, LEFT_9), (10, LEFT_7), (14, RIGHT_9), (18, RIGHT_4)):
        match.kick(frame, slot)
    match.ball(4, -30, 0)
    match.ball(8, -30, 20)
    match.ball(14, -30, 0)
    match.ball(19, -32.9, 0)
    match.mode(22, PlayMode.GOAL_R, 30)
    match.mode(30, PlayMode.KICK_OFF_L, 35)
    match.kick(34, LEFT_9)
    match.tackle(36, RIGHT_4, missed=True)
    match.catch(37, RIGHT_1)
    return match


def test_by_hand() -> None:
    events = made().events()
    found = team_statistics(events)
    [chance] = events["expected_goals"][events["kind"] == "shot"].tolist()
    expected = {
        **{"passes": 4, "passes_completed": 2, "pass_completion": 0.5, "pass_length": 15.0},
        **{"possession": 16 / 24, "kicks": 4},
    }
    zero = {name: 0 for name, _, _ in described()}
    assert asdict(found.left) == zero | expected
    assert asdict(found.right) == zero | {
        **{"goals": 1, "shots": 1, "shots_on_target": 1, "interceptions": 1, "passes": 1, "passes_completed": 1},
        **{"pass_completion": 1.0, "pass_length": 0.0, "possession": 8 / 24, "tackles_missed": 1, "catches": 1},
        **{"kicks": 2, "expected_goals": chance},
    }


def test_a_match_without_events_has_no_shares() -> None:
    found = team_statistics(MadeMatch().events())
    assert math.isnan(found.left.possession)
    assert math.isnan(found.left.pass_completion)
    values = found.left.to_json()
    assert values["possession"] is values["pass_completion"] is values["pass_length"] is None
    assert {value for value in values.values() if value is not None} == {0}


def test_goals_are_expected_of_the_shots_whose_chance_is_known() -> None:
    match = MadeMatch(40)
    for frame in (3, 20):
        match.kick(frame, LEFT_9)
        match.ball(frame, 40, 0)
        match.ball(frame + 1, 42.5, 0)
        match.mode(frame + 2, PlayMode.GOAL_KICK_R, frame + 4)
    both = team_statistics(match.events()).left
    match.frames["playmode"][20] = PlayMode.PENALTY_READY_L
    one = team_statistics(match.events()).left
    assert (both.shots, one.shots) == (2, 2)
    assert both.expected_goals == pytest.approx(2 * one.expected_goals)
    assert 0 < one.expected_goals < 1
    match.players["state"][:, RIGHT_1] = 0
    assert math.isnan(team_statistics(match.events()).left.expected_goals)


def test_every_statistic_is_described() -> None:
    assert [name for name, _, _ in described()] == list(TeamStatistics.__dataclass_fields__)
    assert all(about and unit in ("", "share", "m", "goals") for _, unit, about in described())


def test_of_real_matches(samples_dir: Path) -> None:
    goals = 0
    for path in sorted(samples_dir.glob("*.rcg.xz")):
        match = read_match(path)
        found = team_statistics(find_events(match.frames, match.players, match.game.server_params))
        counted = match.players["count_kick"][-1].reshape(2, 11).sum(1)
        shares = 0.0
        for team, of, kicks in ((match.left, found.left, counted[0]), (match.right, found.right, counted[1])):
            assert of.goals == team.score
            assert 0.9 * kicks <= of.kicks <= kicks
            assert of.shots >= of.shots_on_target
            assert 0 <= of.expected_goals <= of.shots
            assert of.passes >= of.passes_completed > 0
            shares += of.possession
            goals += of.goals
        assert shares == pytest.approx(1)
        assert found.left.shots_on_target >= found.right.saves
    assert goals > 10


def test_the_columns_of_rcg2data() -> None:
    match = made()
    match.kick(12, LEFT_7)
    found = as_rcg2data(match.events())
    rows = list(zip(*(found[name].tolist() for name in found), strict=True))
    assert list(found) == [
        "Type",
        "Side1",
        "Unum1",
        "Time1",
        "X1",
        "Y1",
        "Side2",
        "Unum2",
        "Time2",
        "X2",
        "Y2",
        "Success",
    ]
    assert rows == [
        ("Pass", "left", 7, 102, -40.0, 0.0, "left", 9, 106, -30.0, 0.0, True),
        ("Pass", "left", 9, 106, -30.0, 0.0, "left", 7, 110, -30.0, 20.0, True),
        ("Interception", "left", 7, 112, -30.0, 20.0, "right", 9, 114, -30.0, 0.0, True),
        ("Pass", "right", 9, 114, -30.0, 0.0, "right", 4, 118, -30.0, 0.0, True),
        (
            *("Shoot", "right", 4, 118),
            *np.float32((-30.0, 0.0)).tolist(),
            "neutral",
            0,
            122,
            *np.float32((-32.9, 0)).tolist(),
            True,
        ),
        ("Interception", "right", 4, 118, -30.0, 0.0, "left", 9, 134, *np.float32((-32.9, 0)).tolist(), True),
    ]
