"""The functions that kernels may call, by what Numba has for them in C++; types follow Numba's rules."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
from numba import types
from numba.core.registry import cpu_target
from numba.np.numpy_support import ufunc_find_matching_loop

OPERATORS: Mapping[str, tuple[Callable[..., Any], Any]] = {
    "Add": (operator.add, np.add),
    "Sub": (operator.sub, np.subtract),
    "Mult": (operator.mul, np.multiply),
    "Div": (operator.truediv, np.true_divide),
    "FloorDiv": (operator.floordiv, np.floor_divide),
    "Mod": (operator.mod, np.remainder),
    "Pow": (operator.pow, np.power),
    "BitAnd": (operator.and_, np.bitwise_and),
    "BitOr": (operator.or_, np.bitwise_or),
    "BitXor": (operator.xor, np.bitwise_xor),
    "LShift": (operator.lshift, np.left_shift),
    "RShift": (operator.rshift, np.right_shift),
    "Lt": (operator.lt, np.less),
    "LtE": (operator.le, np.less_equal),
    "Gt": (operator.gt, np.greater),
    "GtE": (operator.ge, np.greater_equal),
    "Eq": (operator.eq, np.equal),
    "NotEq": (operator.ne, np.not_equal),
    "USub": (operator.neg, np.negative),
    "UAdd": (operator.pos, np.positive),
    "Invert": (operator.invert, np.invert),
}
"""Of each operator of Python's syntax: what it does to numbers, and to arrays."""

FLOAT_SIGNS = {"Add": "+", "Sub": "-", "Mult": "*", "Div": "/"}
"""Operators that are C++'s own for floats."""
COMPARISONS = {"Lt": "<", "LtE": "<=", "Gt": ">", "GtE": ">=", "Eq": "==", "NotEq": "!="}
INT_BITS = {"BitAnd": "&", "BitOr": "|", "BitXor": "^"}
BOOL_BITS = {"BitAnd": "rt::both", "BitOr": "rt::either", "BitXor": "rt::differ"}
CALLS = {
    "Add": "rt::add",
    "Sub": "rt::sub",
    "Mult": "rt::mul",
    "FloorDiv": "rt::floor_div",
    "Mod": "rt::floor_mod",
    "Pow": "rt::power",
    "LShift": "rt::shift_left",
    "RShift": "rt::shift_right",
    "USub": "rt::neg",
}
"""Operators that are functions here, for integers or for all numbers."""

MATH: Mapping[Any, str] = {
    math.sin: "std::sin",
    math.cos: "std::cos",
    math.tan: "std::tan",
    math.asin: "std::asin",
    math.acos: "std::acos",
    math.atan: "std::atan",
    math.atan2: "std::atan2",
    math.hypot: "std::hypot",
    math.sqrt: "std::sqrt",
    math.exp: "std::exp",
    math.expm1: "std::expm1",
    math.log: "std::log",
    math.log1p: "std::log1p",
    math.log2: "std::log2",
    math.log10: "std::log10",
    math.tanh: "std::tanh",
    math.atanh: "std::atanh",
    math.erf: "std::erf",
    math.lgamma: "std::lgamma",
    math.sinh: "std::sinh",
    math.cosh: "std::cosh",
    math.pow: "std::pow",
    math.fabs: "std::fabs",
    math.copysign: "std::copysign",
    math.degrees: "rt::degrees",
    math.radians: "rt::radians",
    math.isnan: "rt::is_nan",
    math.isinf: "std::isinf",
    math.isfinite: "std::isfinite",
    math.ceil: "std::ceil",
    math.floor: "std::floor",
    math.trunc: "std::trunc",
}
"""Of the module math. Those whose type is an integer give a float in C++, which is cut."""

UFUNCS: Mapping[Any, str] = {
    np.sin: "std::sin",
    np.cos: "std::cos",
    np.tan: "std::tan",
    np.arcsin: "std::asin",
    np.arccos: "std::acos",
    np.arctan: "std::atan",
    np.arctan2: "std::atan2",
    np.hypot: "std::hypot",
    np.sqrt: "std::sqrt",
    np.exp: "std::exp",
    np.expm1: "std::expm1",
    np.log: "std::log",
    np.log1p: "std::log1p",
    np.tanh: "std::tanh",
    np.degrees: "rt::degrees",
    np.rad2deg: "rt::degrees",
    np.radians: "rt::radians",
    np.deg2rad: "rt::radians",
    np.absolute: "rt::abs",
    np.minimum: "rt::minimum",
    np.maximum: "rt::maximum",
    np.floor: "std::floor",
    np.ceil: "std::ceil",
    np.trunc: "std::trunc",
    np.rint: "std::nearbyint",
    np.copysign: "std::copysign",
    np.isnan: "rt::is_nan",
    np.isinf: "std::isinf",
    np.isfinite: "std::isfinite",
    np.logical_and: "rt::both",
    np.logical_or: "rt::either",
    np.logical_xor: "rt::differ",
}
"""Of NumPy, for numbers and element by element."""

NEEDS_FLOATS = frozenset({np.isnan, np.isinf, np.isfinite, math.isnan, math.isinf, math.isfinite})
"""Functions of which C++ has no form for integers; they are given floats, and the answer is the same."""
LOGICAL = frozenset({np.logical_and, np.logical_or, np.logical_xor})
"""Functions of NumPy that look at whether elements are 0."""
REDUCTIONS = {"any": "rt::any", "all": "rt::all", "max": "rt::largest", "min": "rt::smallest", "sum": "rt::sum",
              "argmax": "rt::argmax", "argmin": "rt::argmin"}  # fmt: skip
"""Methods of arrays, and functions of NumPy, that give one number."""
FILLED: Mapping[str, float] = {"empty": 0, "zeros": 0, "ones": 1, "full": 0}
"""Functions of NumPy that make arrays of a shape, and with what they fill them if they do and are not given it."""
DTYPES: Mapping[Any, Any] = {
    np.float64: types.float64,
    np.float32: types.float32,
    np.int64: types.int64,
    np.int32: types.int32,
    np.uint8: types.uint8,
    np.uint64: types.uint64,
    np.bool_: types.boolean,
    float: types.float64,
    int: types.int64,
    bool: types.boolean,
}
"""Types of numbers by the name that a kernel uses."""


@cache
def signature(function: Callable[..., Any], given: tuple[Any, ...]) -> Any:
    """Return Numba's signature of a function of numbers, or None where it has none."""
    context = cpu_target.typing_context
    context.refresh()
    try:
        return context.resolve_function_type(function, given, {})
    except Exception:  # numba raises several, all of which mean that there is none
        return None


def loop(ufunc: Any, given: list[Any]) -> Any:
    """Return what NumPy's function does with elements of these types: its inputs and outputs, or None."""
    return ufunc_find_matching_loop(ufunc, tuple(given))


def unified(given: list[Any]) -> Any:
    """Return the type that has all values of these types, as Numba finds it for branches that meet; None without."""
    return cpu_target.typing_context.unify_types(*given)
