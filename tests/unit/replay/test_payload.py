"""The data of a page come back to their resolution, whatever they are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pages import unpack
from teamclone.replay.payload import Channel, Coding, packed

CODINGS = st.builds(
    Coding, step=st.sampled_from([0.01, 0.5, 1.0, 10.0]), bytes=st.sampled_from([1, 2, 4]), order=st.integers(0, 2)
)
VALUES = arrays(np.float64, st.tuples(st.integers(1, 9), st.just(22)), elements=st.floats(-1e4, 1e4) | st.just(np.nan))


@given(values=VALUES, coding=CODINGS)
@settings(max_examples=60, deadline=None)
def test_values_come_back(values: np.ndarray, coding: Coding) -> None:
    data = packed({"frames": len(values)}, [Channel(name="it", coding=coding, values=values)])
    found = unpack(data).columns
    if np.isnan(values).all():
        assert found == {}
        return
    largest = (2 ** (8 * coding.bytes - 1) - 1) * coding.step
    expected = np.clip(values, -largest, largest)
    np.testing.assert_array_equal(np.isnan(found["it"]), np.isnan(values))
    np.testing.assert_allclose(found["it"], expected, atol=coding.step * 0.5001, rtol=0)


def test_columns_follow_one_another() -> None:
    ramp, step = np.arange(6.0), np.repeat([5.0, -7.0], 3)
    channels = [
        Channel(name="a", coding=Coding(step=1, bytes=4, order=2), values=ramp),
        Channel(name="nothing", coding=Coding(step=1), values=np.full(6, np.nan)),
        Channel(name="b", coding=Coding(step=1, bytes=1, order=0), values=step),
    ]
    found = unpack(packed({"frames": 6, "word": "</script>"}, channels))
    assert [column["name"] for column in found.head["columns"]] == ["a", "b"]
    assert found.head["word"] == "</script>"
    np.testing.assert_array_equal(found.columns["a"], ramp)
    np.testing.assert_array_equal(found.columns["b"], step)


def test_a_head_that_is_no_json_is_refused() -> None:
    with pytest.raises(ValueError, match="JSON"):
        packed({"frames": 0, "bad": float("nan")}, [])
