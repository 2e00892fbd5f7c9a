"""Whose a stretch of a match is, from losses by hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from teamclone.similarity.guess import guesses, stretches
from teamclone.similarity.watched import Watched


def watched(team: str, loss: NDArray[np.float64]) -> Watched:
    n = loss.shape[1]
    return Watched(match_id="m", team=team, loss=loss, commands=np.full(n, 2), kinds=np.array([n, n, 0, 0]))


def test_each_stretch_is_of_the_clone_that_loses_least() -> None:
    loss = np.ones((2, 1200))
    loss[0, :500] = 0.5  # the first clone's
    loss[1, 500:1000] = 0.8  # the second's
    found = {one["window"]: one for one in guesses([watched("A", loss)], ["A", "B"])}
    assert (found["500 cycles"]["stretches"], found["500 cycles"]["right"]) == (2, 1)
    assert found["500 cycles"]["taken"] == [[1, 1], [0, 0]]
    assert found["half a match"]["taken"] == [[1, 1], [0, 0]]
    assert (found["a match"]["stretches"], found["a match"]["right"]) == (1, 1)


def test_what_is_no_whole_stretch_is_left_out() -> None:
    loss = np.arange(2 * 499, dtype=float).reshape(2, 499)
    assert list(stretches(watched("A", loss), "500 cycles")) == []
    halves = list(stretches(watched("A", loss), "half a match"))
    assert len(halves) == 2
    np.testing.assert_allclose(sum(halves), loss[:, :498].sum(1))
    assert len(list(stretches(watched("A", loss[:, :1]), "half a match"))) == 0


def test_teams_without_a_clone_are_not_guessed() -> None:
    found = guesses([watched("C", np.ones((2, 600)))], ["A", "B"])
    assert all(one["stretches"] == one["right"] == 0 for one in found)
