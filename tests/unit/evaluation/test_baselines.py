"""Rules without a network, on counts made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from teamclone.evaluation import metrics
from teamclone.evaluation.baselines import NAMES, Baselines, Counter
from teamclone.evaluation.predictions import Predictions
from teamclone.rcss.commands import CLONED

# Last command by command given; the last row is "none known". 100 rows: 61 dash, 35 turn, 4 kick.
TRANSITIONS = np.array([[50, 10, 1, 0], [5, 20, 0, 0], [1, 0, 3, 0], [0, 0, 0, 0], [5, 5, 0, 0]])


@pytest.fixture
def baselines() -> Baselines:
    return Baselines(transitions=TRANSITIONS, parameters=np.array([80.0, 0.0, 10.0, 100.0, -5.0, np.nan]))


def outcome(kind, last) -> Predictions:
    n = len(kind)
    return Predictions(
        probabilities=np.full((n, 4), 0.25, np.float32),
        parameters=np.zeros((n, 6), np.float32),
        parameter_log_loss=np.full(n, -1.5, np.float32),
        kind=np.array(kind),
        issued=np.full((n, 6), np.nan, np.float32),
        last=np.array(last),
        match=np.zeros(n, np.int64),
        position=np.zeros((n, 2), np.float32),
    )


@pytest.mark.parametrize("name", NAMES)
def test_tables_are_distributions(baselines: Baselines, name: str) -> None:
    table = baselines.table(name)
    assert table.shape == (5, 4)
    assert (table > 0).all()
    np.testing.assert_allclose(table.sum(axis=1), 1.0)


def test_majority_says_the_smoothed_shares_whatever_came_before(baselines: Baselines) -> None:
    expected = np.array([62, 36, 5, 1]) / 104  # each count plus one
    np.testing.assert_allclose(baselines.table("majority"), np.tile(expected, (5, 1)))


def test_markov_counts_what_follows(baselines: Baselines) -> None:
    table = baselines.table("markov")
    np.testing.assert_allclose(table[0], np.array([51, 11, 2, 1]) / 65)
    np.testing.assert_allclose(table[2], np.array([2, 1, 4, 1]) / 8)
    np.testing.assert_allclose(table[3], np.full(4, 0.25))  # never seen


def test_persistence_repeats_and_falls_back_on_the_majority(baselines: Baselines) -> None:
    answer = baselines.answer("persistence", outcome([0, 0, 2, 1], [1, 0, 2, -1]))
    np.testing.assert_array_equal(answer.probabilities.argmax(axis=1), [1, 0, 2, 0])
    # 73 of the 90 rows with a known last command repeat it; smoothed (73 + 1) / (90 + 2).
    np.testing.assert_allclose(answer.probabilities[[0, 1, 2], [1, 0, 2]], 74 / 92, rtol=1e-6)
    # The rest goes to the others by their shares: dash and tackle after a turn stand 62 to 1.
    assert answer.probabilities[0, 0] / answer.probabilities[0, 3] == pytest.approx(62, rel=1e-5)
    scores = metrics.scores(metrics.measure(answer)[1].total())
    assert scores.accuracy == 0.5


def test_persistence_predicts_the_repetition_even_of_restless_teams() -> None:
    restless = Baselines(
        transitions=np.array([[0, 90, 0, 0], [9, 1, 0, 0], *np.zeros((3, 4), int)]), parameters=np.zeros(6)
    )
    np.testing.assert_array_equal(restless.table("persistence")[:4].argmax(axis=1), [0, 1, 2, 3])


def test_counter_counts_in_batches_and_finds_circular_medians() -> None:
    nan = np.nan
    counter = Counter.empty()
    counter.add(
        kind=np.array([0, 1]),
        last=np.array([-1, 0]),
        issued=np.array([[60, nan, nan, nan, nan, nan], [nan, nan, 170, *[nan] * 3]]),
    )
    counter.add(
        kind=np.array([0, 1, 1]),
        last=np.array([0, 1, 1]),
        issued=np.array([[90, *[nan] * 5], [nan, nan, -170, *[nan] * 3], [nan, nan, -179.7, *[nan] * 3]]),
    )
    counted = counter.finish()
    np.testing.assert_array_equal(counted.transitions, [[1, 1, 0, 0], [0, 2, 0, 0], [0] * 4, [0] * 4, [1, 0, 0, 0]])
    assert 60 <= counted.parameters[0] <= 90
    # 170, -170 and 180 lie around 180; the plain median would be -170.
    assert abs(counted.parameters[2]) == 180
    assert np.isnan(counted.parameters[3])


def test_constant_guess_stands_for_every_row(baselines: Baselines) -> None:
    answer = baselines.answer("majority", outcome([0, 1], [0, 0]))
    np.testing.assert_allclose(answer.parameters[:, 0], 80)
    assert np.isnan(answer.parameters[:, 5]).all()


def test_rules_know_further_commands() -> None:
    commands = (*CLONED, "move", "none")
    counter = Counter.empty(commands)
    issued = np.full((4, 8), np.nan)
    issued[:3, 6:] = [(-15, 5), (-15, 10), (-49, 0)]
    counter.add(kind=np.array([4, 4, 4, 5]), last=np.array([-1, 4, 5, 5]), issued=issued)
    found = counter.finish()
    assert found.transitions.shape == (7, 6)
    np.testing.assert_allclose(found.table("markov")[5], np.array([1, 1, 1, 1, 2, 2]) / 8)
    np.testing.assert_allclose(found.table("majority")[0], np.array([1, 1, 1, 1, 4, 2]) / 10)
    assert found.parameters[6:].tolist() == [-15, 5]
