from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamclone.logs.assemble import (
    TeamMark,
    checked_type,
    fill_marks,
    final_teams,
    frame_columns,
    player_type_columns,
    stoppage_of,
)
from teamclone.rcss import player_types


def mark(frame: int, left: str | None = "A", right: str | None = "B", scores=(0, 0, 0, 0, 0, 0)) -> TeamMark:
    return TeamMark(frame=frame, left=left, right=right, scores=scores)


@pytest.mark.parametrize(
    ("cycle", "expected"),
    [
        ([], []),
        ([5], [0]),
        ([1, 2, 3], [0, 0, 0]),
        ([7, 7, 7, 8, 9, 9], [0, 1, 2, 0, 0, 1]),
        ([2, 2, 1, 2, 2], [0, 1, 0, 0, 1]),
    ],
)
def test_stoppage_counts_repetitions_of_neighbours(cycle, expected):
    assert stoppage_of(np.array(cycle, np.int32)).tolist() == expected


@given(st.lists(st.integers(1, 3), max_size=30))
def test_stoppage_is_the_run_length_so_far(cycle):
    expected = []
    for index, value in enumerate(cycle):
        expected.append(expected[-1] + 1 if index and cycle[index - 1] == value else 0)
    assert stoppage_of(np.array(cycle, np.int32)).tolist() == expected


def test_marks_hold_until_the_next_one():
    filled = fill_marks(6, [(1, (3, 30)), (4, (5, 50)), (6, (9, 90))], 2)
    assert filled.tolist() == [[0, 0], [3, 30], [3, 30], [3, 30], [5, 50], [5, 50]]


def test_of_two_marks_before_one_frame_the_last_counts():
    assert fill_marks(2, [(0, (1,)), (0, (2,))], 1)[:, 0].tolist() == [2, 2]
    assert fill_marks(3, [], 1)[:, 0].tolist() == [0, 0, 0]
    assert fill_marks(0, [(0, (1,))], 1).shape == (0, 1)


def test_frame_columns():
    made = frame_columns(
        cycle=np.array([1, 2, 2], np.int32),
        ball=np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]),
        modes=[(0, 4), (2, 3)],
        teams=[mark(0), mark(1, scores=(1, 2, 3, 4, 5, 6))],
    )
    assert made["stoppage"].tolist() == [0, 0, 1]
    assert made["playmode"].tolist() == [4, 4, 3]
    assert made["right_score"].tolist() == [0, 2, 2]
    assert made["left_penalties_missed"].tolist() == [0, 4, 4]
    assert made["right_penalties_scored"].tolist() == [0, 5, 5]
    assert made["ball_y"].tolist() == [2, 4, 6]
    assert np.isnan(made["ball_vx"]).all()


def test_final_teams_keep_a_name_once_stated():
    left, right = final_teams([mark(0), mark(5, right=None, scores=(2, 1, 3, 4, 5, 6))])
    assert (left.name, left.score, left.penalties_scored, left.penalties_missed) == ("A", 2, 3, 4)
    assert (right.name, right.score, right.penalties_scored, right.penalties_missed) == ("B", 1, 5, 6)
    assert [team.name for team in final_teams([])] == [None, None]


def test_player_types_a_log_leaves_out_are_the_default():
    number, fields = checked_type({"id": 2.0, "kick_rand": 0.2, "from_the_future": 7.0})
    made = player_type_columns({number: fields})
    assert set(made) == set(player_types.FIELDS)
    assert made["kick_rand"].tolist() == [0.1, 0.1, 0.2]
    assert len(player_type_columns({})["kick_rand"]) == 0


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"id": "two"},
        {"id": 256.0},
        {"id": -1.0},
        {"id": 0.5},
        {"id": 0.0, "kick_rand": "0.x"},
        {"id": 0.0, "kick_rand": np.nan},
    ],
)
def test_player_types_without_sense_are_refused(fields):
    with pytest.raises(ValueError):  # noqa: PT011  the caller names the record
        checked_type(fields)
