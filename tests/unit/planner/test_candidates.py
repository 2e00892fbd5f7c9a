"""Candidates in rows, and in the order of their values."""

from __future__ import annotations

import numpy as np

from teamclone.planner import candidates


def test_a_row_ends_at_the_first_place_that_ends_it() -> None:
    allowed = np.array([True, False, True, True, True, True, True])
    ends = np.array([False, False, True, False, False, False, True])
    candidates.cut(allowed, ends, np.array([0, 4, 6, 7]))
    assert allowed.tolist() == [True, False, False, False, True, True, False]


def test_of_equal_values_the_first_comes_first() -> None:
    made = np.array([[1.0, 0.0], [3.0, 0.0], [1.0, 9.0], [3.0, 9.0], [-np.inf, 0.0]])
    assert candidates.by_value(made).tolist() == [1, 3, 0, 2, 4]
