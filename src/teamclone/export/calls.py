"""Calls of functions of Python, math and NumPy, and of methods of arrays, as values of C++."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numba import types

from teamclone.export import functions
from teamclone.export.expressions import Expressions
from teamclone.export.rules import RejectedError
from teamclone.export.values import (
    ATOM,
    CHOICE,
    SCALARS,
    Value,
    array_type,
    is_array,
    is_float,
    is_packed,
    is_tuple,
)

STABLE = ("mergesort", "stable")
"""What a sort has to be, since other ones leave open how equal keys are ordered."""


class Call:
    """One call: what it is given, by position and by name.

    Attributes:
        expressions: of the kernel. node: the call's syntax.
    """

    def __init__(self, expressions: Expressions, node: ast.Call, base: Value | None = None) -> None:
        self.expressions, self.node = expressions, node
        self.nodes = list(node.args)
        self.words = {str(word.arg): word.value for word in node.keywords}
        self.base = base

    def fail(self, rule: str, problem: str) -> RejectedError:
        """Note a problem of the call, and return the exception that ends the translation of its statement."""
        return self.expressions.scope.fail(self.node, rule, f"{ast.unparse(self.node)}: {problem}")

    def only(self, least: int, most: int, *words: str) -> None:
        """Raise unless there are so many arguments, and by name none but these."""
        if not least <= len(self.nodes) <= most or not set(self.words) <= set(words):
            raise self.fail("call", f"takes {least} to {most} arguments and of names {', '.join(words) or 'none'}")

    def values(self) -> list[Value]:
        """Return the arguments; array operations may still have to be made."""
        given = [self.expressions.of(node) for node in self.nodes]
        given = [self.base, *given] if self.base is not None else given
        return self.expressions.unordered(self.node, given)

    def made(self) -> list[Value]:
        """Return the arguments with their array operations made."""
        return [self.expressions.make(value) for value in self.values()]

    def word(self, name: str, otherwise: Any) -> Any:
        """Return the constant that is given by name."""
        if name not in self.words:
            return otherwise
        node = self.words[name]
        return node.value if isinstance(node, ast.Constant) else self.expressions.of(node).constant

    def cast(self, value: Value, wanted: Any) -> Value:
        """Return a value converted, see `Expressions.cast`."""
        return self.expressions.cast(self.node, value, wanted)

    def array(self, value: Value, rank: int | None = None) -> Value:
        """Return a value, which has to be an array, of a rank if one is given."""
        if not is_array(value.type) or (rank is not None and value.type.ndim != rank):
            raise self.fail("type", f"{value.type} is no array{'' if rank is None else f' of {rank} axes'}")
        return value

    def new(self, dtype: Any, rank: int, code: str, *of: Value) -> Value:
        """Return a new array, made by code that takes scratch memory."""
        self.expressions.scope.makes = True
        return self.expressions.derived(of, type=array_type(dtype, rank), code=code).but(reads=True)

    def plain(self, made: Any, code: str, *of: Value, **more: Any) -> Value:
        """Return a number that comes from values."""
        return self.expressions.derived(of, type=made, code=code, **more)


# ---- Python.


def _len(call: Call) -> Value:
    call.only(1, 1)
    outside = call.expressions.outside(call.nodes[0]).object
    if isinstance(outside, tuple):
        return call.expressions.number(len(outside))
    (value,) = call.made()
    if is_tuple(value.type):
        return call.expressions.number(len(value.type.types))
    return call.plain(types.int64, f"{call.array(value).within(ATOM)}.shape[0]", value, counts=True)


def _abs(call: Call) -> Value:
    call.only(1, 1)
    (value,) = call.values()
    if value.type == types.boolean:
        raise call.fail("type", "of a truth")
    return _ufunc(call, np.absolute, [value])


def _extreme(call: Call, name: str) -> Value:
    call.only(2, 99)
    values = call.values()
    made = functions.unified([value.type for value in values])
    if made not in SCALARS:
        raise call.fail("type", "numbers are compared, two or more")
    codes = ", ".join(call.cast(value, made).code for value in values)
    counts = all(value.counts for value in values)
    return call.plain(made, f"rt::{name}<{SCALARS[made]}>({codes})", *values, counts=counts)


def _convert(call: Call, wanted: Any) -> Value:
    call.only(1, 1)
    (value,) = call.made()
    if value.type not in SCALARS:
        raise call.fail("type", f"{value.type} is no number")
    return call.cast(value, wanted).but(constant=None)


def _round(call: Call) -> Value:
    call.only(1, 1)
    (value,) = call.values()
    if not is_float(value.type):
        raise call.fail("type", "floats are rounded")
    return call.plain(types.int64, f"rt::to_int(std::nearbyint({value.code}))", value)


# ---- Functions of numbers, and of elements.


def _math(call: Call, function: Any) -> Value:
    values = call.values()
    found = functions.signature(function, tuple(value.type for value in values))
    if found is None or call.words:
        raise call.fail("call", f"of {', '.join(str(value.type) for value in values)}")
    wanted = list(found.args)
    if any(map(is_float, wanted)) or is_float(found.return_type) or function in functions.NEEDS_FLOATS:
        wanted = [part if is_float(part) else types.float64 for part in wanted]
    codes = ", ".join(call.cast(*pair).code for pair in zip(values, wanted, strict=True))
    code = f"{functions.MATH[function]}({codes})"
    whole = isinstance(found.return_type, types.Integer)
    return call.plain(found.return_type, f"rt::to_int({code})" if whole else code, *values)


def _ufunc(call: Call, function: Any, values: list[Value]) -> Value:
    def element(elements: list[Value]) -> Value:
        loop = functions.loop(function, [value.type for value in elements])
        if loop is None or not all(part in SCALARS for part in (*loop.inputs, *loop.outputs)):
            raise call.fail("type", f"of {', '.join(str(value.type) for value in elements)}")
        wanted = loop.inputs
        if function in functions.NEEDS_FLOATS:
            wanted = [part if is_float(part) else types.float64 for part in wanted]
        if function in functions.LOGICAL:
            wanted = [types.boolean] * len(wanted)
        given = [call.cast(*pair) for pair in zip(elements, wanted, strict=True)]
        name = functions.UFUNCS[function]
        same = f"<{SCALARS[wanted[0]]}>" if function in (np.minimum, np.maximum) else ""
        return call.plain(loop.outputs[0], f"{name}{same}({', '.join(value.code for value in given)})", *elements)

    if any(is_array(value.type) for value in values):
        return call.expressions.each(values, element)
    return element(values)


def _of_elements(call: Call, function: Any) -> Value:
    call.only(function.nin, function.nin)
    return _ufunc(call, function, call.values())


def _where(call: Call) -> Value:
    call.only(3, 3)
    values = call.values()
    if not any(is_array(value.type) for value in values):
        raise call.fail("type", "one of the three is an array")

    def element(elements: list[Value]) -> Value:
        test, body, other = elements
        if body.type != other.type:
            raise call.fail("type", f"chooses between {body.type} and {other.type}: convert one before")
        code = f"{call.cast(test, types.boolean).within(ATOM)} ? {body.typed()} : {other.typed()}"
        return call.plain(body.type, code, *elements, binds=CHOICE)

    return call.expressions.each(values, element)


# ---- Arrays from arrays.


def _summed(call: Call, dtype: Any) -> Any:
    """Return the type of a sum of elements."""
    if dtype not in (types.boolean, types.int64, types.float32, types.float64):
        raise call.fail("type", f"a sum of {dtype}: convert it before")
    return types.int64 if dtype == types.boolean else dtype


def _reduction(call: Call, name: str) -> Value:
    call.only(0 if call.base is not None else 1, 1, *(["axis"] if name == "sum" else []))
    value = call.array(call.made()[0])
    dtype = value.type.dtype
    if name == "sum":
        made = _summed(call, dtype)
        axis = call.word("axis", None)
        if axis is not None:
            if not isinstance(axis, int) or value.type.ndim < 2:
                raise call.fail("call", "the axis is a number, of an array of several")
            code = f"rt::sum_over<{SCALARS[made]}, {axis % value.type.ndim}>(arena, {value.code})"
            return call.new(made, value.type.ndim - 1, code, value)
        return call.plain(made, f"rt::sum<{SCALARS[made]}>({value.code})", value)
    made = {"any": types.boolean, "all": types.boolean, "argmax": types.int64, "argmin": types.int64}.get(name, dtype)
    code = f"{functions.REDUCTIONS[name]}({value.code})"
    return call.plain(made, code, value, counts=name in ("argmax", "argmin"))


def _argsort(call: Call) -> Value:
    call.only(0 if call.base is not None else 1, 1, "kind")
    if call.word("kind", "quicksort") not in STABLE:
        raise call.fail("sort", "a sort that is not stable")
    value = call.array(call.made()[0], 1)
    return call.new(types.int64, 1, f"rt::argsort(arena, {value.code})", value)


def _flatnonzero(call: Call) -> Value:
    call.only(1, 1)
    value = call.array(call.made()[0])
    return call.new(types.int64, 1, f"rt::flatnonzero(arena, {value.code})", value)


def _searchsorted(call: Call) -> Value:
    call.only(2, 2, "side")
    array, value = call.made()
    dtype = call.array(array, 1).type.dtype
    right = "true" if call.word("side", "left") == "right" else "false"
    if not is_array(value.type):
        code = f"rt::searchsorted<{right}>({array.code}, {call.cast(value, dtype).code})"
        return call.plain(types.int64, code, array, value, counts=True).but(reads=True)
    if value.type.dtype != dtype:
        raise call.fail("type", f"{value.type.dtype} among {dtype}")
    return call.new(types.int64, 1, f"rt::searchsorted<{right}>(arena, {array.code}, {value.code})", array, value)


def _cumsum(call: Call) -> Value:
    call.only(0 if call.base is not None else 1, 1)
    value = call.array(call.made()[0], 1)
    made = _summed(call, value.type.dtype)
    return call.new(made, 1, f"rt::running_sum<{SCALARS[made]}>(arena, {value.code})", value)


def _concatenate(call: Call) -> Value:
    call.only(1, 1)
    node: ast.expr = call.nodes[0]
    if not isinstance(node, ast.Tuple | ast.List):
        raise call.fail("call", "takes a tuple of arrays")
    values = [call.array(call.expressions.made(part)) for part in node.elts]
    call.expressions.unordered(call.node, values)
    first = values[0].type
    if any((value.type.dtype, value.type.ndim) != (first.dtype, first.ndim) for value in values):
        raise call.fail("type", "arrays of one type are joined")
    codes = ", ".join(value.code for value in values)
    code = f"rt::concatenate<{SCALARS[first.dtype]}, {first.ndim}>(arena, {codes})"
    return call.new(first.dtype, first.ndim, code, *values)


def _append(call: Call) -> Value:
    call.only(2, 2)
    array, value = call.made()
    dtype = call.array(array, 1).type.dtype
    if value.type != dtype:
        raise call.fail("type", f"{value.type} to {dtype}")
    return call.new(dtype, 1, f"rt::append(arena, {array.code}, {value.typed()})", array, value)


def _repeat(call: Call) -> Value:
    call.only(2, 2)
    array, counts = call.made()
    code = f"rt::repeat(arena, {call.array(array, 1).code}, {counts.typed()})"
    return call.new(array.type.dtype, 1, code, array, counts)


def _copy(call: Call) -> Value:
    call.only(0 if call.base is not None else 1, 1)
    value = call.array(call.made()[0])
    return call.new(value.type.dtype, value.type.ndim, f"rt::copy(arena, {value.code})", value)


def _astype(call: Call) -> Value:
    call.only(1, 1)
    dtype, value = call.expressions.dtype(call.nodes[0]), call.base
    assert value is not None
    return call.expressions.each([value], lambda elements: call.cast(elements[0], dtype))


def _ravel(call: Call) -> Value:
    call.only(0, 0)
    (value,) = call.made()
    if not is_packed(value.type):
        raise call.fail("type", "of an array with gaps: copy it before")
    code = f"rt::reshape({value.code}, rt::Shape<1>{{-1}})"
    return value.but(type=array_type(value.type.dtype, 1, readonly=not value.type.mutable), code=code)


def _flatten(call: Call) -> Value:
    call.only(0, 0)
    value = _copy(call)
    return value.but(type=array_type(value.type.dtype, 1), code=f"rt::reshape({value.code}, rt::Shape<1>{{-1}})")


def _reshape(call: Call) -> Value:
    value, *sizes = call.made()
    if len(sizes) == 1 and sizes[0].items is not None:
        sizes = list(sizes[0].items)
    if not is_packed(value.type) or call.words or any(size.type != types.int64 for size in sizes):
        raise call.fail("type", "takes whole numbers, of an array without gaps")
    codes = ", ".join(size.code for size in sizes)
    made = array_type(value.type.dtype, len(sizes), readonly=not value.type.mutable)
    return value.but(type=made, code=f"rt::reshape({value.code}, rt::Shape<{len(sizes)}>{{{codes}}})")


# ---- New arrays.


def _shape(call: Call, value: Value) -> tuple[str, int]:
    """Return the shape that a value gives, and its rank."""
    if is_tuple(value.type):
        items = value.items or [
            call.expressions.item(call.node, value, place) for place in range(len(value.type.types))
        ]
    else:
        items = (value,)
    if any(not isinstance(item.type, types.Integer) for item in items):
        raise call.fail("type", f"a shape of {value.type}")
    codes = ", ".join(item.code for item in items)
    return f"rt::Shape<{len(items)}>{{{codes}}}", len(items)


def _filled(call: Call, name: str) -> Value:
    least = 2 if name == "full" else 1
    call.only(least, least + 1, "dtype")
    given = [call.expressions.made(node) for node in call.nodes[:least]]
    named = call.words.get("dtype") or (call.nodes[least] if len(call.nodes) > least else None)
    dtype = given[1].type if name == "full" else types.float64
    dtype = call.expressions.dtype(named) if named is not None else dtype
    shape, rank = _shape(call, given[0])
    if name == "empty":
        return call.new(dtype, rank, f"rt::empty<{SCALARS[dtype]}, {rank}>(arena, {shape})", *given)
    value = given[1] if name == "full" else call.expressions.number(functions.FILLED[name])
    code = f"rt::full<{SCALARS[dtype]}, {rank}>(arena, {shape}, {call.cast(value, dtype).typed()})"
    return call.new(dtype, rank, code, *given)


def _like(call: Call, name: str) -> Value:
    call.only(1, 1)
    value = call.array(call.made()[0])
    dtype, rank = value.type.dtype, value.type.ndim
    shape = f"{value.within(ATOM)}.shape"
    if name == "empty":
        return call.new(dtype, rank, f"rt::empty<{SCALARS[dtype]}, {rank}>(arena, {shape})", value)
    start = call.cast(call.expressions.number(0 if name == "zeros" else 1), dtype)
    code = f"rt::full<{SCALARS[dtype]}, {rank}>(arena, {shape}, {start.typed()})"
    return call.new(dtype, rank, code, value)


def _arange(call: Call) -> Value:
    call.only(1, 3)
    values = call.made()
    if any(value.type != types.int64 for value in values):
        raise call.fail("type", "takes whole numbers")
    given = [value.code for value in values]
    codes = {1: ["0", *given, "1"], 2: [*given, "1"], 3: given}[len(given)]
    return call.new(types.int64, 1, f"rt::arange(arena, {', '.join(codes)})", *values)


def _linspace(call: Call) -> Value:
    call.only(3, 3)
    start, stop, count = call.made()
    ends = [call.cast(value, types.float64).code for value in (start, stop)]
    code = f"rt::linspace(arena, {', '.join(ends)}, {call.cast(count, types.int64).code})"
    return call.new(types.float64, 1, code, start, stop, count)


def _array(call: Call) -> Value:
    call.only(1, 1)
    node = call.nodes[0]
    if isinstance(node, ast.List | ast.Tuple):
        values = [call.expressions.made(part) for part in node.elts]
        call.expressions.unordered(call.node, values)
    else:
        value = call.expressions.made(node)
        if not isinstance(value.type, types.UniTuple):
            raise call.fail("type", "is made of numbers, or of a tuple of them")
        spelt = SCALARS[value.type.dtype]
        return call.new(value.type.dtype, 1, f"rt::array_from<{spelt}>(arena, {value.code})", value)
    dtype = functions.unified([value.type for value in values])
    if dtype not in SCALARS:
        raise call.fail("type", "is made of numbers")
    codes = ", ".join(call.cast(value, dtype).typed() for value in values)
    return call.new(dtype, 1, f"rt::array_of<{SCALARS[dtype]}>(arena, {codes})", *values)


ARRAYS: Mapping[Any, Callable[[Call], Value]] = {
    np.argsort: _argsort,
    np.flatnonzero: _flatnonzero,
    np.searchsorted: _searchsorted,
    np.cumsum: _cumsum,
    np.concatenate: _concatenate,
    np.append: _append,
    np.repeat: _repeat,
    np.copy: _copy,
    np.where: _where,
    np.arange: _arange,
    np.linspace: _linspace,
    np.array: _array,
}
"""Functions of NumPy that take or make arrays."""
METHODS: Mapping[str, Callable[[Call], Value]] = {
    "argsort": _argsort,
    "cumsum": _cumsum,
    "copy": _copy,
    "astype": _astype,
    "ravel": _ravel,
    "flatten": _flatten,
    "reshape": _reshape,
}
"""Methods of arrays, beside those of `functions.REDUCTIONS`."""
BUILTINS: Mapping[Any, Callable[[Call], Value]] = {
    len: _len,
    abs: _abs,
    round: _round,
    min: partial(_extreme, name="min"),
    max: partial(_extreme, name="max"),
}


def _by_object() -> dict[Any, Callable[[Call], Value]]:
    """Return what translates a call, by what is called."""
    found: dict[Any, Callable[[Call], Value]] = {**BUILTINS, **ARRAYS}
    found |= {of: partial(_math, function=of) for of in functions.MATH}
    found |= {of: partial(_of_elements, function=of) for of in functions.UFUNCS}
    found |= {of: partial(_convert, wanted=dtype) for of, dtype in functions.DTYPES.items()}
    found |= {getattr(np, name): partial(_reduction, name=name) for name in functions.REDUCTIONS}
    found |= {getattr(np, name): partial(_filled, name=name) for name in functions.FILLED}
    found |= {getattr(np, f"{name}_like"): partial(_like, name=name) for name in ("empty", "zeros", "ones")}
    return found


BY_OBJECT = _by_object()


def function(expressions: Expressions, node: ast.Call, called: Any) -> Value:
    """Return the value of a call of a function that is no kernel."""
    try:
        translated = BY_OBJECT.get(called)
    except TypeError:  # what cannot be hashed is no function
        translated = None
    if translated is None:
        raise expressions.scope.fail(node, "call", f"{ast.unparse(node.func)} has no translation")
    return translated(Call(expressions, node))


def method(expressions: Expressions, node: ast.Call, name: str, base: Value) -> Value:
    """Return the value of a call of an array's method."""
    if is_array(base.type) and name in functions.REDUCTIONS:
        return _reduction(Call(expressions, node, base), name)
    if not is_array(base.type) or name not in METHODS:
        raise expressions.scope.fail(node, "call", f"{ast.unparse(node.func)} has no translation")
    return METHODS[name](Call(expressions, node, base))
