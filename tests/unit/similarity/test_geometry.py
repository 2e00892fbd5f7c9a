"""Distances, tree and map of teams, against numbers by hand."""

from __future__ import annotations

import numpy as np

from teamclone.similarity.geometry import dendrogram, distances, flat, tree


def test_a_distance_is_what_the_wrong_clone_costs_on_average() -> None:
    loss = np.array([[0.1, 0.4, 0.9], [0.3, 0.2, 0.8], [1.0, 1.0, 0.5]])
    found = distances(loss)
    np.testing.assert_allclose(found[0], [0, (0.3 + 0.1) / 2, (0.8 + 0.5) / 2])
    np.testing.assert_array_equal(found, found.T)


def test_a_clone_that_knows_another_team_better_makes_no_distance_below_zero() -> None:
    assert distances(np.array([[0.5, 0.3], [0.4, 0.4]]))[0, 1] == 0.0


def test_the_tree_joins_the_nearest_first() -> None:
    distance = np.array([[0, 1, 5, 6], [1, 0, 5, 6], [5, 5, 0, 2], [6, 6, 2, 0]], float)
    merges = tree(distance)
    assert [sorted(map(int, merge[:2])) for merge in merges] == [[0, 1], [2, 3], [4, 5]]
    assert [merge[2] for merge in merges] == [1, 2, 5.5]
    order = dendrogram(merges)["leaves"]
    assert {frozenset(order[:2]), frozenset(order[2:])} == {frozenset({0, 1}), frozenset({2, 3})}
    assert sorted(order) == [0, 1, 2, 3]


def test_a_map_keeps_what_fits_in_a_plane() -> None:
    places = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0], [3.0, 4.0]])
    squares = ((places[:, None] - places) ** 2).sum(2)
    found, explained = flat(squares)
    np.testing.assert_allclose(((found[:, None] - found) ** 2).sum(2), squares, atol=1e-9)
    assert explained == 1.0
    assert flat(np.zeros((3, 3)))[1] == 1.0


def test_a_map_says_how_much_it_lacks() -> None:
    found, explained = flat(1.0 - np.eye(4))  # a tetrahedron
    assert found.shape == (4, 2)
    np.testing.assert_allclose(explained, 2 / 3)
