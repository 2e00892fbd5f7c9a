"""Lines of a shape by name, and situations that are there."""

from __future__ import annotations

import numpy as np
import pytest

from teamclone.scout.shape import name_of_shape, situations


@pytest.mark.parametrize(
    ("x", "name"),
    [
        ([-30, -30, -29, -31, -10, -10, -11, 10, 11, 10], "4-3-3"),
        ([-30, -30, -29, -31, -10, -10, -11, -9, 10, 11], "4-4-2"),
        ([-30, -30, -31, -20, -20, 0, 1, 0, 20, 21], "3-2-3-2"),
        ([-30, -30, np.nan, -10, -10, 20, 21], "2-2-2"),
        ([1, 2, 3], ""),
    ],
)
def test_lines_are_where_the_gaps_are(x: list[float], name: str) -> None:
    assert name_of_shape(np.array(x, float)) == name


def test_situations_are_found() -> None:
    rng = np.random.default_rng(0)
    base = rng.normal(0, 15, (10, 2))
    of = np.repeat([0, 1, 2], (120, 60, 30))
    places = base + np.array([[0, 0], [30, 0], [0, 25]])[of][:, None] + rng.normal(0, 1, (len(of), 10, 2))
    label, centres = situations(places)
    assert len(centres) == 3
    assert (label == of).all()  # the most frequent first
    np.testing.assert_allclose(centres[1], base + np.array([30, 0]), atol=0.6)


def test_few_frames_are_one_situation() -> None:
    label, centres = situations(np.zeros((3, 10, 2)))
    assert label.tolist() == [0, 0, 0]
    assert centres.shape == (1, 10, 2)
