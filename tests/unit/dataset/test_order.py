from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from teamclone.dataset.order import epoch_order

SIZES = st.integers(1, 400)


@given(n=SIZES, slice_rows=SIZES, seed=st.integers(0, 3), first_round=st.integers(0, 2))
def test_one_round_of_slices_is_every_row_once(n: int, slice_rows: int, seed: int, first_round: int) -> None:
    slices = -(-n // slice_rows)
    epochs = range(first_round * slices, (first_round + 1) * slices)
    parts = [epoch_order(n, seed=seed, epoch=epoch, slice_rows=slice_rows) for epoch in epochs]
    assert np.array_equal(np.sort(np.concatenate(parts)), np.arange(n))
    lengths = [len(part) for part in parts]
    assert max(lengths) <= slice_rows
    assert max(lengths) - min(lengths) <= 1


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
