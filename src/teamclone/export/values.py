"""Values of C++: an expression, its type and what is known of it; and how Numba's types are spelt."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from numba import types

SCALARS = {
    types.boolean: "bool",
    types.int64: "rt::Int",
    types.float64: "double",
    types.float32: "float",
    types.uint8: "std::uint8_t",
    types.int32: "std::int32_t",
    types.uint64: "std::uint64_t",
}
"""How numbers are spelt."""
ATOM, UNARY, FACTOR, TERM, COMPARISON, LOGIC, CHOICE = range(7)
"""How tightly code binds, from the tightest on: names and calls, signs, products, sums, and so on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Operand:
    """What an array operation takes: an array or a number.

    Attributes:
        name: in the function of an element. code: what is given to it. type: of the array, or number.
    """

    name: str
    code: str
    type: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """An expression.

    Attributes:
        type: Numba's. code: C++. binds: how tightly. constant: its value where it is known, else None.
        roots: parameters in whose memory an array, or a tuple of them, lies.
        counts: whether it is a number that is surely not negative.
        operands: of an array operation that is still to be made, in which case the code is that of one element.
        changes: whether it has a call that changes an array. reads: whether it reads arrays.
        items: the values of a tuple that is written out.
    """

    type: Any
    code: str
    binds: int = ATOM
    constant: Any = None
    roots: frozenset[str] = frozenset()
    counts: bool = False
    operands: tuple[Operand, ...] = ()
    changes: bool = False
    reads: bool = False
    items: tuple[Value, ...] | None = field(default=None)

    def within(self, binds: int) -> str:
        """Return the code as a part of one that binds so tightly."""
        return self.code if self.binds <= binds else f"({self.code})"

    def typed(self) -> str:
        """Return the code of a number, with its type where C++ would take the literal for one of another type."""
        is_literal = self.type == types.int64 and self.code.lstrip("-").isdigit()
        return f"rt::Int{{{self.code}}}" if is_literal else self.code

    def but(self, **changed: Any) -> Value:
        """Return the value with some attributes changed."""
        return replace(self, **changed)


def is_array(numba_type: Any) -> bool:
    """Return whether a type is that of an array."""
    return isinstance(numba_type, types.Array)


def is_tuple(numba_type: Any) -> bool:
    """Return whether a type is that of a tuple."""
    return isinstance(numba_type, types.BaseTuple)


def is_named(numba_type: Any) -> bool:
    """Return whether a type is that of a NamedTuple."""
    return isinstance(numba_type, types.NamedTuple | types.NamedUniTuple)


def is_float(numba_type: Any) -> bool:
    """Return whether a type is that of a float."""
    return isinstance(numba_type, types.Float)


def is_packed(numba_type: Any) -> bool:
    """Return whether an array's elements are known to lie without gaps, the last index first."""
    return bool(numba_type.layout == "C")


def array_type(dtype: Any, rank: int, *, packed: bool = True, readonly: bool = False) -> Any:
    """Return the type of an array."""
    return types.Array(dtype, rank, "C" if packed else "A", readonly=readonly)


def has_arrays(numba_type: Any) -> bool:
    """Return whether a value of the type is an array, or has one within."""
    if is_tuple(numba_type):
        return any(map(has_arrays, numba_type.types))
    return is_array(numba_type)


def joined(first: Any, second: Any) -> Any:
    """Return the type of a variable that has a value of either type; None where they differ in more than layout."""
    if first == second:
        return first
    if is_array(first) and is_array(second) and (first.dtype, first.ndim) == (second.dtype, second.ndim):
        packed = is_packed(first) and is_packed(second)
        return array_type(first.dtype, first.ndim, packed=packed, readonly=not (first.mutable and second.mutable))
    if is_tuple(first) and is_tuple(second) and len(first.types) == len(second.types) and not is_named(first):
        parts = [joined(*pair) for pair in zip(first.types, second.types, strict=True)]
        return None if None in parts else tuple_type(parts)
    return None


def tuple_type(parts: Iterable[Any]) -> Any:
    """Return the type of a tuple of these."""
    return types.BaseTuple.from_types(tuple(parts))


def number(value: bool | float) -> str:
    """Return a number as a literal that C++ reads as exactly the same one."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return "std::numeric_limits<rt::Int>::min()" if value == -(2**63) else str(value)
    if math.isnan(value):
        return "rt::NOT_A_NUMBER"
    if math.isinf(value):
        return "rt::INF" if value > 0 else "-rt::INF"
    return repr(float(value))
