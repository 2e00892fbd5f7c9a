"""What is foreseen from other matches, and what counts as a habit: by hand."""

from __future__ import annotations

import numpy as np
import pytest

from teamclone.scout.predictability import entropy, foreseen, habits, hits, mean_entropy, share


def test_a_match_is_foreseen_from_the_others() -> None:
    """One cell, two answers. Without match 0 it is 3:2 for the first, without 1 2:10, without 2 5:8."""
    each = np.array([[[2, 8]], [[3, 0]], [[0, 2]]])
    assert hits(each).tolist() == [[2], [0], [2]]
    parts, wholes = foreseen(each)
    assert parts.tolist() == [2, 0, 2]
    assert wholes.tolist() == [10, 3, 2]


def test_what_the_others_never_saw_is_not_foreseen() -> None:
    assert hits(np.array([[[5, 0]]])).tolist() == [[0]]
    assert foreseen(np.array([[[5, 0], [0, 1]], [[0, 0], [0, 4]]]))[0].tolist() == [1, 4]


def test_entropy() -> None:
    few, many = np.array([2, 2]), np.array([2_000_000, 2_000_000])
    assert entropy(many) == pytest.approx(1.0, abs=1e-6)
    assert entropy(few) == pytest.approx(1 + 1 / (2 * 4 * np.log(2)))
    assert entropy(np.array([7, 0])) == 0
    assert np.isnan(entropy(np.array([0, 0])))
    assert mean_entropy(np.array([[3_000_000, 3_000_000], [2_000_000, 0], [0, 0]])) == pytest.approx(0.75, abs=1e-6)
    assert mean_entropy(np.zeros((2, 2), int)) is None


def cells(*counts: list[list[int]]) -> np.ndarray:
    """Return (n_matches, 1, 2, answers) of one cell, free and pressed."""
    return np.array([[one] for one in counts])


def test_a_habit_needs_cases_and_a_sure_share() -> None:
    assert not habits(cells([[19, 0], [0, 0]]))
    (one,) = habits(cells([[12, 0], [0, 0]], [[8, 0], [0, 0]]))
    assert (one.cell, one.answer, one.share) == ((0, None), 0, 1.0)
    assert one.wholes.tolist() == [12, 8]
    assert not habits(cells([[17, 3], [0, 0]]))
    # 19 of 20: the lower end of its interval is .764, but hardly anything else was ever seen.
    assert habits(cells([[19, 1], [0, 0]]))[0].least == pytest.approx(0.764, abs=1e-3)
    assert habits(cells([[0, 0], [75, 25]]), sure=0.6)[0].answer == 0


def test_a_habit_whether_pressed_or_not_is_one() -> None:
    (both,) = habits(cells([[40, 1], [20, 0]]))
    assert both.cell == (0, None)
    assert both.wholes.sum() == 61
    (pressed,) = habits(cells([[20, 20], [1, 40]]))
    assert (pressed.cell, pressed.answer) == ((0, 1), 1)
    first, second = habits(cells([[30, 0], [0, 40]]), names=(7, 9))
    assert [(one.cell, one.answer) for one in (first, second)] == [((0, 1), 9), ((0, 0), 7)]


def test_the_interval_of_a_share_is_never_a_point() -> None:
    always = share(np.array([10.0, 10.0]), np.array([10.0, 10.0]))
    assert always.value == always.high == 1
    assert always.low == pytest.approx(0.839, abs=1e-3)
    assert share(np.array([3.0]), np.array([10.0])).low is None
    assert share(np.array([0.0]), np.array([0.0])).value is None
