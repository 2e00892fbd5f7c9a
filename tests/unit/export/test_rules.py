"""What kernels may use: all that are translated obey; each rule names what breaks it, where, and what is allowed."""

from __future__ import annotations

import inspect
from collections.abc import Callable

import numpy as np
import pytest
from numba import types

from teamclone.errors import TeamcloneError
from teamclone.export.entries import ENTRIES
from teamclone.export.rules import RULES, KernelError
from teamclone.export.translate import Entry, check_kernels, translate
from teamclone.export.values import array_type
from teamclone.system.compiling import kernel

TABLE = {"a": 1}
GIVEN = (array_type(types.float64, 1), types.int64)


def test_all_kernels_that_are_exported_obey_the_rules() -> None:
    assert [str(problem) for problem in check_kernels(ENTRIES)] == []


@kernel
def changes(values, count) -> int:
    """Change an array."""
    values[0] = count
    return count


@kernel
def again(values, count) -> float:
    """Call itself."""
    return 1.0 if count < 1 else again(values, count - 1)


@kernel
def with_try(values, count):
    """Break the rule of statements."""
    try:
        return values[0]
    except Exception:
        return 0.0


@kernel
def with_list(values, count):
    """Break the rule of expressions."""
    parts = [count, count]
    return parts[0]


@kernel
def with_call(values, count):
    """Break the rule of calls."""
    return np.polyfit(values, values, 1)


@kernel
def with_method(values, count):
    """Break the rule of calls by a method."""
    return values.tolist()


@kernel
def with_index(values, count):
    """Break the rule of indices."""
    return values[1.5]


@kernel
def with_text(values, count):
    """Break the rule of types."""
    return "text"


@kernel
def with_other_type(values, count):
    """Break the rule of variables."""
    count = values[0]
    values[1] = count


@kernel
def with_dict(values, count):
    """Break the rule of constants."""
    return TABLE


@kernel
def with_order(values, count):
    """Break the rule of order."""
    return changes(values, count) + values[0]


@kernel
def with_sort(values, count):
    """Break the rule of sorts."""
    return np.argsort(values)


@kernel
def with_recursion(values, count):
    """Break the rule of recursion."""
    return again(values, count)


BREAKING = (
    (with_try, "statement", "a Try"),
    (with_list, "expression", "[count, count] is a List"),
    (with_call, "call", "np.polyfit has no translation"),
    (with_method, "call", "values.tolist has no translation"),
    (with_index, "index", "1.5 is float64"),
    (with_text, "type", "'text' is no number"),
    (with_other_type, "variable", "count is int64 and becomes float64"),
    (with_dict, "constant", "TABLE is no constant"),
    (with_order, "order", "a call changes an array"),
    (with_sort, "sort", "not stable"),
    (with_recursion, "recursion", "again calls itself"),
)


@pytest.mark.parametrize(("broken", "rule", "text"), BREAKING, ids=[rule for _, rule, _ in BREAKING])
def test_a_broken_rule_is_named_with_its_place(broken: Callable[..., object], rule: str, text: str) -> None:
    entries = (Entry(name="broken", kernel=broken, arguments=GIVEN),)
    with pytest.raises(KernelError) as raised:
        translate(entries, version="v1")
    (problem,) = raised.value.problems
    assert problem.rule == rule
    assert text in problem.text
    lines, first = inspect.getsourcelines(again if rule == "recursion" else broken.py_func)
    assert first < problem.line <= first + len(lines)
    assert f"{__file__}, line {problem.line}: " in str(problem)
    assert RULES[rule] in str(problem)
    assert isinstance(raised.value, TeamcloneError)


def test_every_rule_can_be_broken() -> None:
    assert {rule for _, rule, _ in BREAKING} == set(RULES)


@kernel
def with_two(values, count):
    """Break two rules; what depends on them is no problem of its own."""
    first = np.polyfit(values, values, 1)
    second = first + 1.0
    count = int(second) + count
    return np.argsort(values)[count]


def test_all_problems_are_found_and_nothing_that_follows_from_them() -> None:
    problems = check_kernels((Entry(name="broken", kernel=with_two, arguments=GIVEN),))
    assert [problem.rule for problem in problems] == ["call", "sort"]
