"""Statements of a kernel as lines of C++."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from typing import Any

from numba import types

from teamclone.export import functions
from teamclone.export.expressions import Expressions
from teamclone.export.rules import RejectedError
from teamclone.export.scopes import IGNORED, Scope, loaded, stored
from teamclone.export.values import (
    ATOM,
    SCALARS,
    Value,
    array_type,
    has_arrays,
    is_array,
    is_float,
    is_tuple,
    joined,
    tuple_type,
)

INDENT = "    "


def indented(lines: list[str]) -> list[str]:
    """Return lines one step further in."""
    return [INDENT + line for line in lines]


class Statements:
    """The statements of one kernel.

    Attributes:
        scope: of the kernel. expressions: in it.
    """

    def __init__(self, scope: Scope, expressions: Expressions) -> None:
        self.scope, self.expressions = scope, expressions
        names = stored(scope.tree)
        self._once = {name for name in names if names.count(name) == 1}
        self._read = loaded(scope.tree)
        self._by_node: dict[type, Callable[[Any], list[str]]] = {
            ast.Assign: self._assign,
            ast.AugAssign: self._change,
            ast.If: self._if,
            ast.For: self._for,
            ast.While: self._while,
            ast.Return: self._return,
            ast.Expr: self._expression,
            ast.Break: lambda node: ["break;"],
            ast.Continue: lambda node: ["continue;"],
            ast.Pass: lambda node: [],
        }

    def block(self, statements: list[ast.stmt]) -> list[str]:
        """Return the lines of statements, with what is declared before each."""
        lines = []
        for statement in statements:
            try:
                own = self._lines(statement)
            except RejectedError:
                self.scope.rejected = True
                self.scope.unknown |= set(stored(statement))
                continue
            before = [name for name in self.scope.declared.before.get(id(statement), []) if name in self.scope.known]
            lines += [f"{self._unread(name)}{self._spelt(name)} {self.scope.local(name)}{{}};" for name in before]
            lines += own
        return lines

    def _lines(self, statement: ast.stmt) -> list[str]:
        if type(statement) not in self._by_node:
            raise self.scope.fail(statement, "statement", f"a {type(statement).__name__}")
        return self._by_node[type(statement)](statement)

    def _spelt(self, name: str) -> str:
        return self.expressions.spelt(self.scope.known[name])

    def _unread(self, name: str) -> str:
        return "" if name in self._read else "[[maybe_unused]] "

    # ---- Assignments.

    def _assign(self, node: ast.Assign) -> list[str]:
        first = node.targets[0]
        if len(node.targets) == 1:
            return self._give(node, first, node.value)
        if not all(isinstance(target, ast.Name) for target in node.targets):
            raise self.scope.fail(node, "statement", "an assignment to several targets that are not all names")
        lines = self._give(node, first, node.value)
        for target in node.targets[1:]:
            lines += self._give(node, target, first)
        return lines

    def _give(self, statement: ast.stmt, target: ast.expr, value: ast.expr) -> list[str]:
        """Return the lines that assign an expression to a target, part by part if both are tuples."""
        pairs = list(self._pairs(target, value))
        if len(pairs) == 1:
            return self._store(statement, pairs[0][0], self.expressions.of(pairs[0][1]))
        if not self._disturbs(pairs):
            return [line for place, of in pairs for line in self._store(statement, place, self.expressions.of(of))]
        lines, kept = [], []
        for _, of in pairs:
            made = self.expressions.made(of)
            name = self.scope.fresh("t")
            lines.append(f"const {self.expressions.spelt(made.type)} {name} = {made.code};")
            kept.append(made.but(code=name, binds=ATOM, constant=None, items=None, changes=False))
        for (place, _), made in zip(pairs, kept, strict=True):
            lines += self._store(statement, place, made)
        return lines

    def _pairs(self, target: ast.expr, value: ast.expr) -> Iterator[tuple[ast.expr, ast.expr]]:
        """Yield targets and what they get, as deep as both are written out."""
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            if len(target.elts) != len(value.elts):
                raise self.scope.fail(target, "statement", f"{len(value.elts)} values for {len(target.elts)} targets")
            for pair in zip(target.elts, value.elts, strict=True):
                yield from self._pairs(*pair)
        else:
            yield target, value

    @staticmethod
    def _disturbs(pairs: list[tuple[ast.expr, ast.expr]]) -> bool:
        """Return whether an assignment changes what a later one of the same statement reads."""
        names: set[str] = set()
        writes = False
        for target, value in pairs:
            reads = any(isinstance(part, ast.Subscript | ast.Call | ast.Attribute) for part in ast.walk(value))
            if names & loaded(value) or (writes and reads):
                return True
            names |= set(stored(target))
            writes |= any(isinstance(part, ast.Subscript) for part in ast.walk(target))
        return False

    def _store(self, statement: ast.stmt, target: ast.expr, value: Value) -> list[str]:
        """Return the lines that assign a value to a target."""
        if isinstance(target, ast.Name):
            return self._store_name(statement, target, self.expressions.make(value))
        if isinstance(target, ast.Tuple):
            return self._store_parts(statement, target, self.expressions.make(value))
        if isinstance(target, ast.Subscript):
            return self._store_item(target, value)
        raise self.scope.fail(target, "statement", f"an assignment to {ast.unparse(target)}")

    def _store_name(self, statement: ast.stmt, target: ast.Name, value: Value) -> list[str]:
        if target.id == IGNORED:
            return [f"static_cast<void>({value.code});"] if value.changes else []
        self.scope.learn(target, target.id, value)
        name = self.scope.local(target.id)
        value = self.expressions.cast(target, value, self.scope.known[target.id])
        if target.id not in self.scope.declared.at.get(id(statement), ()):
            return [f"{name} = {value.code};"]
        const = "const " if target.id in self._once else ""
        return [f"{self._unread(target.id)}{const}{self._spelt(target.id)} {name} = {value.code};"]

    def _store_parts(self, statement: ast.stmt, target: ast.Tuple, value: Value) -> list[str]:
        if not is_tuple(value.type) or len(value.type.types) != len(target.elts):
            raise self.scope.fail(target, "type", f"{ast.unparse(target)} from {value.type}")
        lines = []
        if value.items is None and not value.code.isidentifier():
            name = self.scope.fresh("t")
            lines.append(f"const {self.expressions.spelt(value.type)} {name} = {value.code};")
            value = value.but(code=name, binds=ATOM, changes=False)
        for place, part in enumerate(target.elts):
            lines += self._store(statement, part, self.expressions.item(target, value, place))
        return lines

    def _store_item(self, target: ast.Subscript, value: Value) -> list[str]:
        base = self.expressions.made(target.value)
        if not is_array(base.type):
            raise self.scope.fail(target, "statement", f"an assignment to an item of {base.type}")
        chosen = self._chosen(target, base)
        self.scope.change(target, base)
        if isinstance(chosen, str):
            put = self.expressions.cast(target, self.expressions.make(value), base.type.dtype)
            return [f"rt::{chosen}, {put.typed()});"]
        if not is_array(chosen.type):
            put = self.expressions.cast(target, self.expressions.make(value), chosen.type)
            return [f"{chosen.code} = {put.code};"]
        return self._fill(target, chosen, value)

    def _chosen(self, target: ast.Subscript, base: Value) -> Value | str:
        """Return the element or part that is assigned to; or the begun call that assigns to chosen elements."""
        if not isinstance(target.slice, ast.Slice | ast.Tuple):
            place = self.expressions.made(target.slice)
            if is_array(place.type):
                masks = place.type.dtype == types.boolean
                if is_float(place.type.dtype) or place.type.ndim != (base.type.ndim if masks else 1):
                    raise self.scope.fail(target, "index", f"an index that is {place.type}")
                return f"{'put_where' if masks else 'put_at'}({base.code}, {place.code}"
        return self.expressions.element(target, base)

    def _fill(self, target: ast.Subscript, part: Value, value: Value) -> list[str]:
        """Return the lines that assign to all of a part of an array."""
        if is_tuple(value.type):
            name = self.scope.fresh("t")
            lines = [f"const {self.expressions.spelt(part.type)} {name} = {part.code};"]
            if value.items is None:
                kept = self.scope.fresh("t")
                lines.insert(0, f"const {self.expressions.spelt(value.type)} {kept} = {value.code};")
                value = value.but(code=kept, binds=ATOM)
            for place in range(len(value.type.types)):
                item = self.expressions.cast(target, self.expressions.item(target, value, place), part.type.dtype)
                lines.append(f"{name}({place}) = {item.code};")
            return lines
        if is_array(value.type) and value.type.ndim > part.type.ndim:
            raise self.scope.fail(target, "type", f"{value.type} has more axes than {ast.unparse(target)}")
        if value.operands:
            return self._map_into(target, part, value)
        if is_array(value.type):
            return [f"rt::copy_into({part.code}, {value.code});"]
        return [f"rt::fill_with({part.code}, {self.expressions.cast(target, value, part.type.dtype).typed()});"]

    def _map_into(self, node: ast.AST, out: Value, value: Value) -> list[str]:
        """Return the line that fills an array with an array operation."""
        element = self.expressions.cast(node, value.but(type=value.type.dtype, operands=()), out.type.dtype)
        function = self.expressions.function_of(value.but(code=element.code))
        given = "".join(f", {operand.code}" for operand in value.operands)
        return [f"rt::map_into({out.code}, {function}{given});"]

    def _change(self, node: ast.AugAssign) -> list[str]:
        name = type(node.op).__name__
        right = self.expressions.of(node.value)
        place = ast.copy_location(
            ast.Name(node.target.id, ast.Load())
            if isinstance(node.target, ast.Name)
            else ast.Subscript(node.target.value, node.target.slice, ast.Load())
            if isinstance(node.target, ast.Subscript)
            else ast.Constant(None),
            node,
        )
        left = self.expressions.of(place)
        made = self.expressions.operation(node, name, self.expressions.unordered(node, [left, right]))
        if is_array(left.type):
            self.scope.change(node, left)
            if made.type.dtype != left.type.dtype or made.type.ndim != left.type.ndim:
                raise self.scope.fail(node, "type", f"{left.type} cannot keep {made.type}")
            return self._map_into(node, left, made)
        if isinstance(node.target, ast.Name):
            self.scope.learn(node, node.target.id, made)
        else:
            self.scope.change(node, self.expressions.made(node.target.value))
        made = self.expressions.cast(node, made, left.type)
        if is_float(left.type) and name in functions.FLOAT_SIGNS and right.type == left.type:
            return [f"{left.code} {functions.FLOAT_SIGNS[name]}= {right.code};"]
        return [f"{left.code} = {made.code};"]

    # ---- Control.

    def _if(self, node: ast.If) -> list[str]:
        lines = [f"if ({self.expressions.truth(node.test).code}) {{", *indented(self.block(node.body))]
        if not node.orelse:
            return [*lines, "}"]
        other = self.block(node.orelse)
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If) and other[0].startswith("if ("):
            return [*lines, f"}} else {other[0]}", *other[1:]]
        return [*lines, "} else {", *indented(other), "}"]

    def _while(self, node: ast.While) -> list[str]:
        if node.orelse:
            raise self.scope.fail(node, "statement", "an else of a loop")
        head = f"while ({self.expressions.truth(node.test).code}) {{"
        return [head, *indented(self.block(node.body)), "}"]

    def _return(self, node: ast.Return) -> list[str]:
        if node.value is None:
            self._returns(node, types.none, frozenset())
            return ["return;"]
        value = self.expressions.made(node.value)
        made = self._returns(node, value.type, value.roots)
        return [f"return {self.expressions.cast(node, value, made).code};"]

    def _returns(self, node: ast.AST, made: Any, roots: frozenset[str]) -> Any:
        """Note what the kernel returns, and return the type of all that it does."""
        before = self.scope.returned
        after = made if before is None else self._meeting(before, made)
        if after is None:
            raise self.scope.fail(node, "type", f"returns {before} and {made}")
        if after != before or not roots <= self.scope.returned_roots:
            self.scope.returned, self.scope.settled = after, False
            self.scope.returned_roots |= roots
        return after

    def _meeting(self, first: Any, second: Any) -> Any:
        """Return the type that has the values of both, or None."""
        found = joined(first, second)
        if found is not None:
            return found
        if first in SCALARS and second in SCALARS:
            return functions.unified([first, second])
        if is_tuple(first) and is_tuple(second) and len(first.types) == len(second.types):
            parts = [self._meeting(*pair) for pair in zip(first.types, second.types, strict=True)]
            return None if None in parts else tuple_type(parts)
        return None

    def _expression(self, node: ast.Expr) -> list[str]:
        if isinstance(node.value, ast.Constant):
            return []
        if not isinstance(node.value, ast.Call):
            raise self.scope.fail(node, "statement", f"{ast.unparse(node)} does nothing")
        return [f"{self.expressions.made(node.value).code};"]

    # ---- Loops.

    def _for(self, node: ast.For) -> list[str]:
        if node.orelse:
            raise self.scope.fail(node, "statement", "an else of a loop")
        called = self.expressions.outside(node.iter.func).object if isinstance(node.iter, ast.Call) else None
        if called is range:
            return self._count(node, node.target, node.iter)  # type: ignore[arg-type]
        if called is enumerate:
            return self._go_through(node, node.iter.args, node.target, counted=True)  # type: ignore[attr-defined]
        if called is zip:
            return self._go_through(node, node.iter.args, node.target)  # type: ignore[attr-defined]
        over = self.expressions.made(node.iter)
        if is_tuple(over.type):
            return self._go_through_tuple(node, over)
        return self._go_through(node, [node.iter], node.target)

    def _is_own(self, node: ast.For, target: ast.expr) -> bool:
        """Return whether a target is a variable that only this loop's head assigns, and nothing outside reads."""
        if not isinstance(target, ast.Name) or target.id == IGNORED:
            return False
        return target.id in self.scope.declared.at.get(id(node), ()) and target.id not in stored(
            ast.Module(node.body, [])
        )

    def _counter(self, node: ast.For, target: ast.expr) -> tuple[str, list[str]]:
        """Return the name of a loop's counter, and the lines that give its value to the target if it is another one."""
        value = Value(type=types.int64, code="", counts=True)
        if isinstance(target, ast.Name) and self._is_own(node, target):
            self.scope.learn(target, target.id, value)
            return self.scope.local(target.id), []
        name = self.scope.fresh("i")
        return name, self._store(node, target, value.but(code=name))

    def _count(self, node: ast.For, target: ast.expr, call: ast.Call) -> list[str]:
        if not 1 <= len(call.args) <= 3 or call.keywords:
            raise self.scope.fail(call, "statement", f"{ast.unparse(call)} takes one to three numbers")
        values = [self.expressions.cast(call, value, types.int64) for value in self.expressions.parts(*call.args)]
        zero, one = self.expressions.number(0), self.expressions.number(1)
        start, stop, step = {1: (zero, *values, one), 2: (*values, one), 3: tuple(values)}[len(values)]
        if not isinstance(step.constant, int) or step.constant == 0:
            raise self.scope.fail(call, "statement", "the step of a range is a number other than 0")
        counter, lines = self._counter(node, target)
        counts = start.counts and step.constant > 0
        if counts and isinstance(target, ast.Name) and self._is_own(node, target):
            self.scope.counters.add(target.id)
        head, limit = f"rt::Int {counter} = {start.code}", stop.code
        if stop.constant is None:
            limit = self.scope.fresh("stop")
            head += f", {limit} = {stop.code}"
        sign, by = "<" if step.constant > 0 else ">", abs(step.constant)
        advance = f"{'++' if step.constant > 0 else '--'}{counter}"
        if by != 1:
            advance = f"{counter} {'+' if step.constant > 0 else '-'}= {by}"
        body = indented([*lines, *self.block(node.body)])
        return [f"for ({head}; {counter} {sign} {limit}; {advance}) {{", *body, "}"]

    def _go_through(
        self, node: ast.For, nodes: list[ast.expr], target: ast.expr, *, counted: bool = False
    ) -> list[str]:
        """Return a loop over the rows of arrays, of all at once; counted: with the number of each before it."""
        arrays = [self.expressions.make(value) for value in self.expressions.parts(*nodes)]
        if not all(is_array(array.type) for array in arrays) or (counted and len(arrays) != 1):
            raise self.scope.fail(node, "statement", f"a loop over {', '.join(str(array.type) for array in arrays)}")
        targets = target.elts if isinstance(target, ast.Tuple) else [target]
        if len(targets) != len(arrays) + counted:
            raise self.scope.fail(
                node, "statement", f"a loop over {len(arrays) + counted} values with {len(targets)} targets"
            )
        lines: list[str] = []
        inner: list[str] = []
        if counted:
            counter, inner = self._counter(node, targets[0])
            if isinstance(targets[0], ast.Name) and self._is_own(node, targets[0]):
                self.scope.counters.add(targets[0].id)
        else:
            counter = self.scope.fresh("i")
        limits = []
        for place, array in zip(targets[counted:], arrays, strict=True):
            name = self.scope.fresh("rows")
            lines.append(f"const {self.expressions.spelt(array.type)} {name} = {array.code};")
            limits.append(f"{name}.shape[0]")
            inner += self._store(node, place, self._row(array, name, counter))
        limit = limits[0] if len(limits) == 1 else f"rt::min<rt::Int>({', '.join(limits)})"
        body = indented([*inner, *self.block(node.body)])
        return [*lines, f"for (rt::Int {counter} = 0; {counter} < {limit}; ++{counter}) {{", *body, "}"]

    @staticmethod
    def _row(array: Value, name: str, counter: str) -> Value:
        """Return a row of an array, or an element of one with a single axis."""
        made, rank = array.type, array.type.ndim
        if rank == 1:
            return Value(type=made.dtype, code=f"{name}({counter})", reads=True)
        packed = made.layout == "C"
        row = array_type(made.dtype, rank - 1, packed=packed, readonly=not made.mutable)
        code = f"rt::part<{'true' if packed else 'false'}>({name}, {counter})"
        return Value(type=row, code=code, roots=array.roots, reads=True)

    def _go_through_tuple(self, node: ast.For, over: Value) -> list[str]:
        """Return a loop over the items of a tuple, which have one type."""
        if not isinstance(over.type, types.UniTuple):
            raise self.scope.fail(node, "statement", f"a loop over a tuple of several types, {over.type}")
        item, name = over.type.dtype, self.scope.fresh("item")
        value = Value(type=item, code=name, roots=over.roots, reads=has_arrays(item))
        if isinstance(over.constant, tuple) and item == types.int64:
            value = value.but(counts=min(over.constant) >= 0)
            if isinstance(node.target, ast.Name) and self._is_own(node, node.target) and value.counts:
                self.scope.counters.add(node.target.id)
        inner = self._store(node, node.target, value)
        body = indented([*inner, *self.block(node.body)])
        return [f"for (const {self.expressions.spelt(item)}& {name} : {over.code}) {{", *body, "}"]


def ends(block: list[ast.stmt]) -> bool:
    """Return whether a block surely returns at its end."""
    last = block[-1]
    if isinstance(last, ast.If):
        return bool(last.orelse) and ends(last.body) and ends(last.orelse)
    return isinstance(last, ast.Return)
