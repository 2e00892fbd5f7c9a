from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from teamclone.dataset.order import epoch_mirrored, epoch_order

SIZES = st.integers(1, 400)


@given(n=SIZES, slice_rows=SIZES, seed=st.integers(0, 3), first_round=st.integers(0, 2))
def test_one_round_of_slices_is_every_row_once(n: int, slice_rows: int, seed: int, first_round: int) -> None:
    slices = max(1, round(n / slice_rows))
    epochs = range(first_round * slices, (first_round + 1) * slices)
    parts = [epoch_order(n, seed=seed, epoch=epoch, slice_rows=slice_rows) for epoch in epochs]
    assert np.array_equal(np.sort(np.concatenate(parts)), np.arange(n))
    lengths = [len(part) for part in parts]
    assert max(lengths) < 1.5 * slice_rows + 1
    assert n < slice_rows or min(lengths) > 0.66 * slice_rows - 1
    assert max(lengths) - min(lengths) <= 1


@given(n=SIZES, slice_rows=SIZES, seed=st.integers(0, 3), epoch=st.integers(0, 5))
def test_too_few_rows_are_repeated(n: int, slice_rows: int, seed: int, epoch: int) -> None:
    once, more = (
        epoch_order(n, seed=seed, epoch=epoch, slice_rows=slice_rows, repeat=repeat) for repeat in (False, True)
    )
    times = max(1, round((slice_rows / n) ** 0.5))
    assert np.array_equal(more[: len(once)], once)
    assert len(more) == times * len(once)
    assert np.array_equal(np.bincount(more, minlength=n), times * np.bincount(once, minlength=n))


@given(n=SIZES, slice_rows=SIZES, epoch=st.integers(0, 20))
def test_order_is_a_pure_function(n: int, slice_rows: int, epoch: int) -> None:
    before = epoch_order(n, seed=1, epoch=epoch, slice_rows=slice_rows)
    epoch_order(n + 1, seed=2, epoch=epoch, slice_rows=slice_rows)
    assert np.array_equal(epoch_order(n, seed=1, epoch=epoch, slice_rows=slice_rows), before)


def test_a_slice_returns_with_the_same_rows_in_another_order() -> None:
    first, again = (epoch_order(1000, seed=0, epoch=epoch, slice_rows=250) for epoch in (1, 5))
    assert set(first) == set(again)
    assert not np.array_equal(first, again)


def test_slices_are_shuffled_and_depend_on_the_seed() -> None:
    zero, one = (epoch_order(1000, seed=seed, epoch=0, slice_rows=1000) for seed in (0, 1))
    assert not np.array_equal(zero, one)
    # A sorted or merely rotated order has a neighbour difference of 1 almost everywhere.
    assert np.mean(np.abs(np.diff(zero)) == 1) < 0.05


DRAWS = st.lists(st.floats(0.01, 6), min_size=1, max_size=200)


@given(draws=DRAWS, slice_rows=SIZES, turn=st.integers(0, 3))
def test_a_round_has_every_row_as_often_as_asked(draws: list[float], slice_rows: int, turn: int) -> None:
    total = max(1, round(sum(draws)))
    slices = max(1, round(total / slice_rows))
    parts = [
        epoch_order(len(draws), seed=0, epoch=epoch, slice_rows=slice_rows, draws=np.array(draws))
        for epoch in range(turn * slices, (turn + 1) * slices)
    ]
    lengths = [len(part) for part in parts]
    assert sum(lengths) == total
    assert max(lengths) < 1.5 * slice_rows + 1
    assert max(lengths) - min(lengths) <= 1
    count = np.bincount(np.concatenate(parts), minlength=len(draws))
    wanted = np.array(draws) * total / sum(draws)
    assert (np.abs(count - wanted) < 1 + 1e-9).all()


def test_over_the_rounds_all_rows_are_drawn_as_often_as_asked() -> None:
    draws = np.repeat([0.1, 0.5, 3.0], 100)
    epochs = [epoch_order(300, seed=0, epoch=epoch, slice_rows=360, draws=draws) for epoch in range(400)]
    assert not np.array_equal(np.sort(epochs[0]), np.sort(epochs[1]))
    mean = np.bincount(np.concatenate(epochs), minlength=300) / 400
    assert np.abs(mean - draws).max() < 0.12
    again = epoch_order(300, seed=0, epoch=7, slice_rows=360, draws=draws)
    assert np.array_equal(again, epochs[7])


def test_repeated_rows_are_drawn_anew_each_time() -> None:
    draws = np.repeat([0.1, 0.5, 3.0], 100)
    order = epoch_order(300, seed=0, epoch=2, slice_rows=360 * 9, draws=draws, repeat=True)
    rounds = np.split(order, 3)
    assert len(order) == 3 * 360
    assert not np.array_equal(np.sort(rounds[0]), np.sort(rounds[1]))
    assert np.abs(np.bincount(order, minlength=300) / 3 - draws).max() < 1


def test_of_an_epoch_the_wanted_share_is_mirrored() -> None:
    first, again, other = (epoch_mirrored(10_000, seed=0, epoch=epoch, share=0.3) for epoch in (0, 0, 1))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert abs(first.mean() - 0.3) < 0.02
    assert epoch_mirrored(100, seed=0, epoch=0, share=1.0).all()
