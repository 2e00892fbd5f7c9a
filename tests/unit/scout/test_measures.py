"""Sums over sums with intervals over matches, and which moments are shown."""

from __future__ import annotations

import numpy as np
import pytest

from teamclone.comparison.words import NOTHING
from teamclone.scout.findings import claim, number, rounded
from teamclone.scout.measures import Figure, Look, Looks, Measure, Moment, ratio

SHARE = Measure(key="share", name="a share", unit="share", about="of something")


def looks(*pairs: tuple[float, float]) -> Looks:
    return Looks([Look(numbers={"share": pair}) for pair in pairs], [SHARE])


def test_a_figure_is_the_sum_of_parts_over_that_of_wholes() -> None:
    figure = looks((1, 2), (3, 10), (0, 0)).figure("share")
    assert figure.value == pytest.approx(4 / 12)
    assert figure.matches == 2
    assert figure.low is not None
    assert figure.high is not None
    assert figure.low <= 4 / 12 <= figure.high


def test_an_interval_is_of_whole_matches() -> None:
    """Of two matches a resample has the first twice, the second twice, or one of each."""
    figure = looks((0, 10), (10, 10)).figure("share")
    assert (figure.low, figure.high) == (0, 1)
    alike = looks(*[(3, 10)] * 8).figure("share")
    assert (alike.low, alike.high) == (pytest.approx(0.3), pytest.approx(0.3))


def test_one_match_has_no_interval_and_none_no_value() -> None:
    assert looks((3, 10), (0, 0)).figure("share") == Figure(value=0.3, low=None, high=None, matches=1)
    assert looks((0, 0)).figure("share").value is None
    assert ratio(np.array([]), np.array([])).value is None


def test_what_is_no_number_does_not_count() -> None:
    assert looks((np.nan, 10), (3, 10)).figure("share").value == 0.3


def test_moments_come_from_as_many_matches_as_there_are() -> None:
    made = [
        Look(moments={"goals": [Moment(match_id=name, cycle=at, weight=at) for at in cycles]})
        for name, cycles in (("a", (9, 8, 7)), ("b", (1,)), ("c", (2,)))
    ]
    found = Looks(made, [])
    assert [(one.match_id, one.cycle) for one in found.moments("goals")] == [("a", 9), ("c", 2), ("b", 1)]
    assert [one.cycle for one in found.moments("goals", most=4)] == [9, 2, 1, 8]
    found.shown = frozenset({"b"})
    assert [one.match_id for one in found.moments("goals")] == ["b"]
    assert found.moments("nothing") == ()


def test_a_claim_needs_all_its_numbers() -> None:
    measures = [SHARE, Measure(key="other", name="other", unit="m", about="")]
    both = Looks([Look(numbers={"share": (1, 4), "other": (30, 2)})], measures)
    made = claim(both, "It does {share} over {other}.")
    assert made is not None
    assert made.text == "It does 25 % over 15 m."
    assert claim(looks((1, 4)), "It does {share}.") is not None
    assert claim(Looks([Look(numbers={"share": (1, 4)})], measures), "It does {share} over {other}.") is None


def test_numbers_have_no_more_digits_than_one_reads() -> None:
    assert [rounded(value, "") for value in (1234.5, 12.34, 1.234, 0.1234, 0.0, None)] == [
        "1,234",
        "12",
        "1.2",
        "0.12",
        "0",
        NOTHING,
    ]
    assert rounded(0.0512, "share") == "5.1 %"
    assert number(Figure(value=0.5, low=0.404, high=0.611, matches=3), "share") == ("50 %", "40 to 61")
    assert number(Figure(value=12.0, low=None, high=None, matches=1), "m") == ("12 m", "")
