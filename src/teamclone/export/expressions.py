"""Expressions of a kernel as values of C++."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numba import types
from numba.core.dispatcher import Dispatcher

from teamclone.export import functions
from teamclone.export.constants import MISSING, Outside, clean, lookup, named_type
from teamclone.export.program import Program
from teamclone.export.rules import RejectedError
from teamclone.export.scopes import Scope
from teamclone.export.values import (
    ATOM,
    CHOICE,
    COMPARISON,
    FACTOR,
    LOGIC,
    SCALARS,
    TERM,
    UNARY,
    Operand,
    Value,
    array_type,
    has_arrays,
    is_array,
    is_float,
    is_named,
    is_packed,
    is_tuple,
    joined,
    number,
    tuple_type,
)

BINDS = {"Add": TERM, "Sub": TERM, "Mult": FACTOR, "Div": FACTOR}


class Expressions:
    """The expressions of one kernel.

    Attributes:
        scope: of the kernel. program: what it is a part of.
    """

    def __init__(self, scope: Scope, program: Program) -> None:
        self.scope, self.program = scope, program
        self._by_node: dict[type, Callable[[Any], Value]] = {
            ast.Name: self._name,
            ast.Constant: self._constant,
            ast.Attribute: self._attribute,
            ast.BinOp: lambda node: self.operation(node, type(node.op).__name__, self.parts(node.left, node.right)),
            ast.UnaryOp: self._unary,
            ast.Compare: self._compare,
            ast.BoolOp: self._logic,
            ast.IfExp: self._choice,
            ast.Tuple: lambda node: self.tuple([self.of(part) for part in node.elts]),
            ast.Subscript: self._subscript,
            ast.Call: self._call,
        }

    def of(self, node: ast.expr) -> Value:
        """Return the value of an expression; array operations may still have to be made."""
        if type(node) not in self._by_node:
            raise self.scope.fail(node, "expression", f"{ast.unparse(node)} is a {type(node).__name__}")
        return self._by_node[type(node)](node)

    def made(self, node: ast.expr) -> Value:
        """Return the value of an expression, with its array operation made."""
        return self.make(self.of(node))

    def parts(self, *nodes: ast.expr) -> list[Value]:
        """Return the values of expressions that C++ may evaluate in any order."""
        return self.unordered(nodes[0], [self.of(node) for node in nodes])

    def unordered(self, node: ast.AST, values: Sequence[Value]) -> list[Value]:
        """Return values that C++ may evaluate in any order, having seen that none changes what another one reads."""
        if any(value.changes for value in values) and sum(value.changes or value.reads for value in values) > 1:
            raise self.scope.fail(
                node, "order", "a call changes an array while something beside it reads or changes arrays"
            )
        return list(values)

    # ---- Names and numbers.

    def _name(self, node: ast.Name) -> Value:
        if node.id in self.scope.unknown:
            raise RejectedError
        if node.id in self.scope.known:
            known = self.scope.known[node.id]
            return Value(
                type=known,
                code=self.scope.local(node.id),
                roots=self.scope.roots.get(node.id, frozenset()),
                counts=node.id in self.scope.counters,
                reads=has_arrays(known),
            )
        return self._outside(node)

    def outside(self, node: ast.expr) -> Outside:
        """Return what a name that is no variable's means; MISSING if it is one, or another expression."""
        base = node
        while isinstance(base, ast.Attribute):
            base = base.value
        if isinstance(base, ast.Name) and (base.id in self.scope.known or base.id in self.scope.unknown):
            return MISSING
        return lookup(self.scope.function, node)

    def _outside(self, node: ast.expr) -> Value:
        found = self.outside(node)
        value = None if found is MISSING else self.program.constants.value(found.object, found.place)
        if value is None:
            raise self.scope.fail(node, "constant", f"{ast.unparse(node)} is no constant that can be translated")
        return value

    def _constant(self, node: ast.Constant) -> Value:
        value = self.program.constants.value(node.value, None)
        if value is None:
            raise self.scope.fail(node, "type", f"{node.value!r} is no number")
        return value

    def _attribute(self, node: ast.Attribute) -> Value:
        if self.outside(node) is not MISSING:
            return self._outside(node)
        base = self.made(node.value)
        if is_named(base.type) and node.attr in base.type.fields:
            place = base.type.fields.index(node.attr)
            return self.item(node, base, place)
        if is_array(base.type):
            code = base.within(ATOM)
            if node.attr == "shape":
                return Value(type=types.UniTuple(types.int64, base.type.ndim), code=f"{code}.shape")
            if node.attr == "size":
                return Value(type=types.int64, code=f"{code}.size()", counts=True)
            if node.attr == "ndim":
                return self.number(base.type.ndim)
            if node.attr == "T" and base.type.ndim == 2:
                turned = array_type(base.type.dtype, 2, packed=False, readonly=not base.type.mutable)
                return base.but(type=turned, code=f"rt::transpose({base.code})")
        raise self.scope.fail(node, "expression", f"{ast.unparse(node)}: {base.type} has no such attribute")

    def number(self, value: float) -> Value:
        """Return a number."""
        made = self.program.constants.value(value, None)
        assert made is not None
        return made

    # ---- Types.

    def cast(self, node: ast.AST, value: Value, wanted: Any) -> Value:
        """Return a value as one of another type, as Numba converts it."""
        if value.type == wanted:
            return value
        if wanted in SCALARS and value.type in SCALARS:
            return self._cast_number(value, wanted)
        if is_tuple(wanted) and value.items is not None and len(value.items) == len(wanted.types):
            parts = [self.cast(node, *pair) for pair in zip(value.items, wanted.types, strict=True)]
            return self.tuple(parts, wanted)
        if joined(value.type, wanted) == wanted and not isinstance(wanted, types.UniTuple):
            return value.but(type=wanted, code=f"{self.spelt(wanted)}({value.code})", binds=ATOM)
        raise self.scope.fail(node, "type", f"{value.type} is no {wanted}")

    def _cast_number(self, value: Value, wanted: Any) -> Value:
        made = value.but(type=wanted, binds=ATOM, counts=False, constant=None)
        is_literal = isinstance(value.constant, int | float) and value.code == number(value.constant)
        if is_literal and wanted in (types.boolean, types.float64):
            return self.number((bool if wanted == types.boolean else float)(value.constant))
        if wanted == types.boolean:
            return made.but(code=f"{value.within(TERM)} != 0", binds=COMPARISON)
        if is_float(value.type) and isinstance(wanted, types.Integer):
            code = f"rt::to_int({value.code})"
            return made.but(code=code if wanted == types.int64 else f"static_cast<{SCALARS[wanted]}>({code})")
        return made.but(code=f"static_cast<{SCALARS[wanted]}>({value.code})", counts=value.type == types.boolean)

    def spelt(self, numba_type: Any) -> str:
        """Return a type as C++ spells it."""
        return self.program.constants.spelt(numba_type)

    def truth(self, node: ast.expr) -> Value:
        """Return whether an expression counts as true, which need not be one of truths."""
        if isinstance(node, ast.BoolOp):
            return self._joined(node, [self.truth(part) for part in node.values])
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return self._not(self.truth(node.operand))
        value = self.made(node)
        if value.type not in SCALARS:
            raise self.scope.fail(node, "type", f"{ast.unparse(node)} is {value.type}, no number")
        return self.cast(node, value, types.boolean)

    # ---- Operators.

    def operation(self, node: ast.AST, name: str, values: list[Value]) -> Value:
        """Return what an operator of Python's syntax makes of values."""
        if name not in functions.OPERATORS:
            raise self.scope.fail(node, "expression", f"operator {name}")
        if not any(is_array(value.type) for value in values):
            return self._of_numbers(node, name, values)
        if not all(is_array(value.type) or value.type in SCALARS for value in values):
            raise self.scope.fail(node, "type", f"operator {name} of {', '.join(str(value.type) for value in values)}")

        def element(elements: list[Value]) -> Value:
            made = self._of_numbers(node, name, elements)
            loop = functions.loop(functions.OPERATORS[name][1], [one.type for one in elements])
            if loop is None or loop.outputs[0] != made.type:
                given = " and ".join(str(one.type) for one in elements)
                raise self.scope.fail(node, "type", f"operator {name} of elements that are {given}: convert one before")
            return made

        return self.each(values, element)

    def _of_numbers(self, node: ast.AST, name: str, values: list[Value]) -> Value:
        found = functions.signature(functions.OPERATORS[name][0], tuple(value.type for value in values))
        if found is None or not all(part in SCALARS for part in (*found.args, found.return_type)):
            raise self.scope.fail(node, "type", f"operator {name} of {', '.join(str(value.type) for value in values)}")
        made = found.return_type
        given = [self.cast(node, *pair) for pair in zip(values, found.args, strict=True)]
        if name == "Div":
            given = [self.cast(node, value, made) for value in given]
        code, binds = self._spelt_operation(name, made, given)
        counts = made == types.int64 and all(value.counts for value in values) and name not in ("Sub", "USub", "Invert")
        return self.derived(values, type=made, code=code, binds=binds, counts=counts)

    @staticmethod
    def derived(values: Iterable[Value], **made: Any) -> Value:
        """Return a number that comes from values."""
        values = list(values)
        changes, reads = any(value.changes for value in values), any(value.reads for value in values)
        return Value(changes=changes, reads=reads, **made)

    @staticmethod
    def _spelt_operation(name: str, made: Any, given: list[Value]) -> tuple[str, int]:
        """Return an operator's code with operands that have their types, and how tightly it binds."""
        first, last = given[0], given[-1]
        if name in functions.COMPARISONS:
            return f"{first.within(TERM)} {functions.COMPARISONS[name]} {last.within(TERM)}", COMPARISON
        if name == "UAdd":
            return first.code, first.binds
        if is_float(made) and name in functions.FLOAT_SIGNS:
            binds = BINDS[name]
            return f"{first.within(binds)} {functions.FLOAT_SIGNS[name]} {last.within(binds - 1)}", binds
        if name == "USub" and is_float(made):
            return f"-{first.within(ATOM)}", UNARY
        if name == "Invert":
            return f"{'!' if made == types.boolean else '~'}{first.within(ATOM)}", UNARY
        if name in functions.BOOL_BITS and made == types.boolean:
            return f"{functions.BOOL_BITS[name]}({first.code}, {last.code})", ATOM
        if name in functions.INT_BITS:
            return f"{first.within(ATOM)} {functions.INT_BITS[name]} {last.within(ATOM)}", LOGIC
        return f"{functions.CALLS[name]}({', '.join(value.typed() for value in given)})", ATOM

    def _unary(self, node: ast.UnaryOp) -> Value:
        if isinstance(node.op, ast.Not):
            return self._not(self.truth(node.operand))
        value = self.of(node.operand)
        if isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
            return self.number(-value.constant)
        return self.operation(node, type(node.op).__name__, [value])

    @staticmethod
    def _not(value: Value) -> Value:
        return value.but(code=f"!{value.within(ATOM)}", binds=UNARY, constant=None)

    def _compare(self, node: ast.Compare) -> Value:
        values = self.parts(node.left, *node.comparators)
        if len(node.ops) > 1 and any(is_array(value.type) for value in values):
            raise self.scope.fail(node, "expression", "a chain of comparisons of arrays")
        if any(value.binds > UNARY or value.changes or "(" in value.code for value in values[1:-1]):
            raise self.scope.fail(node, "expression", "a chain of comparisons whose middle is no name or number")
        pairs = zip(node.ops, values, values[1:], strict=False)
        return self._joined(node, [self.operation(node, type(op).__name__, [*pair]) for op, *pair in pairs])

    def _logic(self, node: ast.BoolOp) -> Value:
        values = [self.made(part) for part in node.values]
        if any(value.type != types.boolean for value in values):
            raise self.scope.fail(
                node, "type", f"{ast.unparse(node)}: and, or of what is no truth, outside of a condition"
            )
        return self._joined(node, values)

    def _joined(self, node: ast.AST, values: list[Value]) -> Value:
        """Return truths joined by and, or by or; a single one as it is."""
        if len(values) == 1:
            return values[0]
        sign = " || " if isinstance(node, ast.BoolOp) and isinstance(node.op, ast.Or) else " && "
        code = sign.join(value.within(COMPARISON) for value in values)
        return self.derived(values, type=types.boolean, code=code, binds=LOGIC)

    def _choice(self, node: ast.IfExp) -> Value:
        test, body, other = self.truth(node.test), self.made(node.body), self.made(node.orelse)
        made = joined(body.type, other.type)
        if made is None and body.type in SCALARS and other.type in SCALARS:
            made = functions.unified([body.type, other.type])
        if made is None:
            raise self.scope.fail(node, "type", f"{ast.unparse(node)} is {body.type} or {other.type}")
        first, second = self.cast(node, body, made), self.cast(node, other, made)
        code = f"{test.within(COMPARISON)} ? {first.typed()} : {second.typed()}"
        counts, roots = body.counts and other.counts, body.roots | other.roots
        return self.derived([test, body, other], type=made, code=code, binds=CHOICE, counts=counts, roots=roots)

    def tuple(self, items: list[Value], wanted: Any = None) -> Value:
        """Return a tuple of values, of their types unless it is to be of another one with the same."""
        items = [self.make(item) for item in items]
        made = wanted or tuple_type(item.type for item in items)
        if not items:
            return Value(type=made, code="", items=())
        inner = ", ".join(item.typed() for item in items)
        doubled = isinstance(made, types.UniTuple) and not is_named(made)
        code = f"{self.spelt(made)}{'{{' if doubled else '{'}{inner}{'}}' if doubled else '}'}"
        constants = tuple(item.constant for item in items)
        roots = frozenset[str]().union(*(item.roots for item in items))
        known = None if None in constants else constants
        return self.derived(items, type=made, code=code, items=tuple(items), constant=known, roots=roots)

    # ---- Array operations.

    def each(self, values: list[Value], element: Callable[[list[Value]], Value]) -> Value:
        """Return an array operation that is still to be made, by what it makes of one element of each value."""
        operands: dict[str, Operand] = {}
        elements, rank = [], 0
        for value in values:
            rank = max(rank, value.type.ndim if is_array(value.type) else 0)
            if value.operands:
                operands.update({operand.name: operand for operand in value.operands})
                elements.append(value.but(type=value.type.dtype, operands=()))
            elif value.constant is not None:
                elements.append(value)
            else:
                known = (operand for operand in operands.values() if operand.code == value.code)
                operand = next(known, None) or self._operand(value)
                operands[operand.name] = operand
                dtype = value.type.dtype if is_array(value.type) else value.type
                elements.append(value.but(type=dtype, code=operand.name, binds=ATOM))
        made = element(elements)
        return made.but(type=array_type(made.type, rank), operands=tuple(operands.values()), roots=frozenset())

    def _operand(self, value: Value) -> Operand:
        name = value.code if value.code.isidentifier() else self.scope.fresh("e")
        return Operand(name=name, code=value.code, type=value.type)

    def function_of(self, value: Value) -> str:
        """Return the function of one element of an array operation."""
        given = ", ".join(
            f"{SCALARS[getattr(operand.type, 'dtype', operand.type)]} {operand.name}" for operand in value.operands
        )
        return f"[]({given}) {{ return {value.code}; }}"

    def make(self, value: Value) -> Value:
        """Return a value with its array operation made."""
        if not value.operands:
            return value
        self.scope.makes = True
        spelt, rank = SCALARS[value.type.dtype], value.type.ndim
        given = "".join(f", {operand.code}" for operand in value.operands)
        code = f"rt::map<{spelt}, {rank}>(arena, {self.function_of(value)}{given})"
        return value.but(code=code, binds=ATOM, operands=(), counts=False)

    # ---- Indices.

    def item(self, node: ast.AST, base: Value, place: int) -> Value:
        """Return an item of a tuple, by its place."""
        count = len(base.type.types)
        if not -count <= place < count:
            raise self.scope.fail(node, "index", f"{base.code} has no item {place}")
        place %= count
        if base.items is not None:
            return base.items[place]
        spelt = f"{base.within(ATOM)}.{clean(base.type.fields[place])}" if is_named(base.type) else ""
        constant = base.constant[place] if base.constant is not None else None
        made = base.type.types[place]
        counts = base.code.endswith(".shape") or (isinstance(constant, int) and constant >= 0)
        code = spelt or f"std::get<{place}>({base.code})"
        return base.but(type=made, code=code, binds=ATOM, constant=constant, counts=counts, reads=has_arrays(made))

    def _subscript(self, node: ast.Subscript) -> Value:
        base = self.made(node.value)
        if is_tuple(base.type):
            place = self.of(node.slice)
            if isinstance(place.constant, int):
                return self.item(node, base, place.constant)
            if isinstance(base.type, types.UniTuple) and place.type == types.int64:
                self.unordered(node, [base, place])
                return base.but(
                    type=base.type.dtype,
                    code=f"rt::pick({base.code}, {place.code})",
                    binds=ATOM,
                    constant=None,
                    items=None,
                    reads=place.reads or base.reads,
                )
        if not is_array(base.type):
            raise self.scope.fail(node, "index", f"{ast.unparse(node)}: {base.type} has no such item")
        return self.element(node, base)

    def element(self, node: ast.Subscript, base: Value) -> Value:
        """Return what an index chooses of an array: an element, a part, or a new array of rows."""
        nodes = list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]
        if len(nodes) == 1 and not isinstance(nodes[0], ast.Slice) and not self._is_new_axis(nodes[0]):
            place = self.made(nodes[0])
            if is_array(place.type):
                return self._rows(node, base, place)
        places = [
            None if isinstance(part, ast.Slice) or self._is_new_axis(part) else self._index(part) for part in nodes
        ]
        self.unordered(node, [base, *(place for place in places if place is not None)])
        if None not in places and len(places) == base.type.ndim:
            wraps = "" if all(place.counts for place in places if place is not None) else ".wrapped"
            inner = ", ".join(place.code for place in places if place is not None)
            changes = any(place.changes for place in places if place is not None)
            code = f"{base.within(ATOM)}{wraps}({inner})"
            return Value(type=base.type.dtype, code=code, reads=True, roots=base.roots, changes=changes)
        codes = [
            self._axis(part) if place is None else place.typed() for part, place in zip(nodes, places, strict=True)
        ]
        gives = sum(place is None for place in places)
        taken = sum(not self._is_new_axis(part) for part in nodes)
        if taken > base.type.ndim:
            raise self.scope.fail(node, "index", f"{ast.unparse(node)}: more indices than axes")
        packed = is_packed(base.type) and self._stays_packed(nodes)
        made = array_type(
            base.type.dtype, gives + base.type.ndim - taken, packed=packed, readonly=not base.type.mutable
        )
        code = f"rt::part<{'true' if packed else 'false'}>({base.code}, {', '.join(codes)})"
        return Value(type=made, code=code, reads=True, roots=base.roots)

    def _is_new_axis(self, node: ast.expr) -> bool:
        if isinstance(node, ast.Constant):
            return node.value is None
        return isinstance(node, ast.Attribute) and node.attr == "newaxis" and self.outside(node).object is None

    def _index(self, node: ast.expr) -> Value:
        place = self.of(node)
        if not isinstance(place.type, types.Integer | types.Boolean):
            raise self.scope.fail(node, "index", f"{ast.unparse(node)} is {place.type}")
        return self.cast(node, place, types.int64)

    def _axis(self, node: ast.expr) -> str:
        """Return the code of a slice, or of a new axis."""
        if not isinstance(node, ast.Slice):
            return "rt::NewAxis{}"
        bounds = [self._index(part) if part else None for part in (node.lower, node.upper, node.step)]
        start, stop, step = bounds
        if step is not None and step.constant in (None, 0):
            raise self.scope.fail(node, "index", "the step of a slice is a number other than 0")
        codes = [start.code if start else "rt::OPEN", stop.code if stop else "rt::OPEN"]
        return (
            "rt::Slice{}" if not any(bounds) else f"rt::Slice{{{', '.join([*codes, *([step.code] if step else [])])}}}"
        )

    def _stays_packed(self, nodes: list[ast.expr]) -> bool:
        """Return whether indices leave a packed array without gaps: numbers, one slice in steps of one, whole axes."""
        rest = [part for part in nodes if isinstance(part, ast.Slice) or self._is_new_axis(part)]
        leading = nodes[: len(nodes) - len(rest)]
        plain = all(isinstance(part, ast.Slice) and part.step is None for part in rest)
        whole = all(isinstance(part, ast.Slice) and not (part.lower or part.upper) for part in rest[1:])
        return plain and whole and not any(part in rest for part in leading)

    def _rows(self, node: ast.AST, base: Value, places: Value) -> Value:
        """Return the rows of an array that an array of numbers, or of truths, chooses."""
        if places.type.ndim != 1 or is_float(places.type.dtype):
            raise self.scope.fail(node, "index", f"an index that is {places.type}")
        self.unordered(node, [base, places])
        self.scope.makes = True
        name = "rows_where" if places.type.dtype == types.boolean else "rows_at"
        made = array_type(base.type.dtype, base.type.ndim)
        return Value(type=made, code=f"rt::{name}(arena, {base.code}, {places.code})", reads=True)

    # ---- Calls.

    def _call(self, node: ast.Call) -> Value:
        found = self.outside(node.func)
        if isinstance(found.object, Dispatcher):
            return self._kernel(node, found.object)
        if inspect.isclass(found.object) and issubclass(found.object, tuple) and hasattr(found.object, "_fields"):
            return self._named(node, found.object)
        if found is not MISSING:
            return self.program.function_call(self, node, found.object)
        if isinstance(node.func, ast.Attribute):
            return self.program.method_call(self, node, node.func.attr, self.of(node.func.value))
        raise self.scope.fail(node, "call", f"{ast.unparse(node.func)} is not known")

    def _bound(self, node: ast.Call, names: Sequence[str], defaults: dict[str, Any]) -> list[Value]:
        """Return the arguments of a call in the order of their names."""
        if any(isinstance(part, ast.Starred) for part in node.args) or any(word.arg is None for word in node.keywords):
            raise self.scope.fail(node, "call", f"{ast.unparse(node)}: arguments that are unpacked")
        given = dict(zip(names, node.args, strict=False)) | {str(word.arg): word.value for word in node.keywords}
        if len(node.args) > len(names) or not set(given) <= set(names):
            raise self.scope.fail(node, "call", f"{ast.unparse(node)}: arguments are {', '.join(names)}")
        values = []
        for name in names:
            value = self.made(given[name]) if name in given else None
            if value is None and name in defaults:
                value = self.program.constants.value(defaults[name], None)
            if value is None:
                raise self.scope.fail(node, "call", f"{ast.unparse(node)}: {name} is missing")
            values.append(value)
        return self.unordered(node, values)

    def _kernel(self, node: ast.Call, dispatcher: Any) -> Value:
        parameters = inspect.signature(dispatcher.py_func).parameters
        defaults = {name: part.default for name, part in parameters.items() if part.default is not part.empty}
        values = self._bound(node, list(parameters), defaults)
        called = self.program.function(dispatcher, tuple(value.type for value in values), self.scope, node)
        self.scope.callees.append(called)
        self.scope.makes |= called.makes
        for place in called.writes:
            self.scope.change(node, values[place])
        given = [*(["arena"] if called.makes else []), *(value.typed() for value in values)]
        roots = frozenset[str]().union(*(values[place].roots for place in called.returned_from))
        return Value(
            type=called.returned,
            code=f"{called.name}({', '.join(given)})",
            roots=roots,
            changes=bool(called.writes) or any(value.changes for value in values),
            reads=any(value.reads for value in values),
        )

    def _named(self, node: ast.Call, made: Any) -> Value:
        values = self._bound(node, made._fields, made._field_defaults)
        return self.tuple(values, named_type(made, [value.type for value in values]))

    def dtype(self, node: ast.expr) -> Any:
        """Return the type of numbers that an expression names, as np.int64 or other.dtype."""
        if isinstance(node, ast.Attribute) and node.attr == "dtype" and self.outside(node) is MISSING:
            return self.of(node.value).type.dtype
        found = self.outside(node).object
        if not isinstance(found, type | np.dtype) or found not in functions.DTYPES:
            raise self.scope.fail(node, "type", f"{ast.unparse(node)} is no type of numbers that can be translated")
        return functions.DTYPES[found]
