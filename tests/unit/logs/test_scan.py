"""The kernels' numbers and words are those of the text, on the quick way and on the careful one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numba.core import event

from teamclone.logs import scan
from teamclone.rcss.commands import CommandKind

number = scan._number
any_number = scan._any_number
whole_number = scan._whole_number
kind_of = scan._kind_of


@njit(error_model="numpy")
def _from(buffer, start, stop):  # type: ignore[no-untyped-def]
    return number(buffer, start, stop), any_number(buffer, start, stop)


@njit(error_model="numpy")
def _whole(buffer, stop):  # type: ignore[no-untyped-def]
    return whole_number(buffer, 0, stop)


@njit(error_model="numpy")
def _kind(buffer, stop):  # type: ignore[no-untyped-def]
    return kind_of(buffer, 0, stop)


def values(text: str, behind: bytes) -> list[tuple[float, int]]:
    """Value and end of a number by the quick and by the careful way."""
    data = text.encode()
    return list(_from(np.frombuffer(data + behind, np.uint8), 0, len(data)))


behinds = st.sampled_from(
    [b"", b")", b" ", b"\n", b") (s 8000 1 1 130600)", b" 99999999 88888888", b"\r\n", b"(1 2 3 4 5 6 7"]
)
digits = st.text("0123456789", min_size=1, max_size=9)
logged = st.one_of(
    # As the server writes: six significant digits, or quantised to 4 decimals.
    st.floats(-1e7, 1e7, allow_nan=False).map(lambda value: f"{value:g}"),
    st.floats(allow_nan=False, allow_infinity=False, min_value=-1e-2, max_value=1e-2).map(lambda value: f"{value:g}"),
    st.integers(-10_000_000, 10_000_000).map(lambda value: f"{value / 10_000:.4f}"),
    st.integers(-(10**15), 10**15).map(str),
    # As clients write.
    st.builds("{}{}.{}".format, st.sampled_from(["", "-", "+"]), digits, digits.map(lambda text: text[:6])),
    st.sampled_from(
        ["-0", "0", "-0.0", "0.00000", "1e-5", "-7.10543e-15", "5.69606e-06", "1e+06", ".5", "-.25", "00012"]
    ),
)


@settings(max_examples=2000, deadline=None)
@given(text=logged, behind=behinds)
def test_a_number_is_the_double_nearest_to_its_text(text: str, behind: bytes):
    expected = float(text)
    if expected and not 1e-15 < abs(expected) < 1e22:
        return  # smaller ones are the next test's
    for value, end in values(text, behind):
        assert (value, math.copysign(1, value), end) == (expected, math.copysign(1, expected), len(text))


@settings(max_examples=1000, deadline=None)
@given(
    text=st.one_of(
        st.floats(-1e30, 1e30, allow_nan=False).map(repr),
        st.floats(-1e30, 1e30, allow_nan=False).map(lambda value: f"{value:.25f}"),
        st.builds("{}.{}".format, st.text("0123456789", min_size=10, max_size=30), digits),
    ),
    behind=behinds,
)
def test_long_digits_are_right_in_single_precision(text: str, behind: bytes):
    for value, end in values(text, behind):
        assert (np.float32(value), end) == (np.float32(float(text)), len(text))


@pytest.mark.parametrize("text", ["1e400", "-1e4000", "1e-400", "-1e-4000", "0e999", f"{'9' * 400}", f"0.{'0' * 400}1"])
def test_beyond_the_range_of_a_double(text: str):
    for value, end in values(text, b" 1 2 3 4 5 6"):
        assert (value, math.copysign(1, value), end) == (float(text), math.copysign(1, float(text)), len(text))


@pytest.mark.parametrize("behind", [b"", b" 1 2 3 4 5 6", b")"])
@pytest.mark.parametrize("text", ["", "-", ".", "-.", "5.", "x", "1e", "1e+", "--1", "+-1"])
def test_what_is_no_number(text: str, behind: bytes):
    assert [end for _, end in values(text, behind)] == [-1, -1]


@pytest.mark.parametrize("text", ["nan", "-nan", "inf", "-inf"])
def test_broken_values_are_nan(text: str):
    for value, end in values(text, b" 1 2 3 4 5 6"):
        assert math.isnan(value)
        assert end == len(text)


@pytest.mark.parametrize(("text", "end"), [("1.2.3", 3), ("12x", 2), ("1-2", 1), ("12345678901.5", 13), ("1,5", 1)])
def test_both_ways_end_at_the_same_place(text: str, end: int):
    assert [found for _, found in values(text, b" 1 2 3 4 5 6")] == [end, end]


@settings(max_examples=500, deadline=None)
@given(value=st.integers(-(2**31) + 1, 2**31 - 1), behind=behinds)
def test_counters(value: int, behind: bytes):
    text = str(value).encode()
    assert _whole(np.frombuffer(text + behind, np.uint8), len(text)) == (value, len(text))


@pytest.mark.parametrize("text", ["2147483648", "-2147483648", "99999999999", "nan", "x", ""])
def test_counters_beyond_32_bits_are_refused(text: str):
    assert _whole(np.frombuffer(text.encode() + b" 1 2 3 4 5 6 7", np.uint8), len(text))[1] == -1


@pytest.mark.parametrize("kind", CommandKind)
def test_every_command_is_known_by_its_word(kind: CommandKind):
    word = kind.name.lower().encode()
    for behind in (b"", b" 100)(done)        "):
        assert _kind(np.frombuffer(word + behind, np.uint8), len(word)) == kind


@settings(max_examples=500, deadline=None)
@given(word=st.text("abcdefghijklmnopqrstuvwxyz_", max_size=24), start=st.sampled_from(list(CommandKind)))
def test_no_other_word_is_a_command(word: str, start: CommandKind):
    known = {kind.name.lower(): int(kind) for kind in CommandKind}
    for text in (word, start.name.lower() + word[:2], start.name.lower()[:-1] + word[:1]):
        found = _kind(np.frombuffer(text.encode() + b" 100)(done)        ", np.uint8), len(text))
        assert found == known.get(text, CommandKind.ILLEGAL)


def test_compiling_is_announced(caplog: pytest.LogCaptureFixture):
    """It takes seconds, once; a command line shows the line."""
    for kernel in (scan.scan_shows, scan.scan_commands, scan._number):
        with caplog.at_level("INFO", logger="teamclone"), event.trigger_event("numba:compile", {"dispatcher": kernel}):
            pass
    assert [record.getMessage().partition(",")[0] for record in caplog.records] == [
        "compiling the reader of game logs",
        "compiling the reader of command logs",
    ]


def test_a_number_ends_before_the_next_line():
    data = np.frombuffer(b"12 \n34 56 78 90 12 34", np.uint8)
    assert [end for _, end in _from(data, 3, 3)] == [-1, -1]
    assert [end for _, end in _from(data, 4, 3)] == [-1, -1]
