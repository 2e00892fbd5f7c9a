"""The translation of Numba kernels to one C++17 header."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from itertools import groupby
from typing import Any

from numba import types

from teamclone.export import calls
from teamclone.export.constants import Constants, clean, space
from teamclone.export.expressions import Expressions
from teamclone.export.program import Function
from teamclone.export.rules import KernelError, Problem, RejectedError
from teamclone.export.scopes import Scope, declarations, loaded, source_of
from teamclone.export.statements import Statements, ends, indented
from teamclone.export.values import has_arrays

MOST_PASSES = 10
"""Passes over a kernel after which its types have to be found."""
INCLUDES = ("array", "cmath", "csetjmp", "cstddef", "cstdint", "cstdio", "cstdlib", "cstring", "limits", "memory",
            "new", "tuple", "type_traits", "utility")  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A kernel that the header gives to its users.

    Attributes:
        name: of its function in the header. kernel: as Numba compiles it. arguments: their Numba types.
    """

    name: str
    kernel: Any
    arguments: tuple[Any, ...]


VECTORISES = (
    "// GCC makes vector code of loops at -O2 only where that cannot be longer than the loop; a network needs it.",
    "#if defined(__GNUC__) && !defined(__clang__)",
    "#pragma GCC push_options",
    '#pragma GCC optimize("tree-vectorize", "vect-cost-model=dynamic")',
    "#endif",
    "",
)
ENDS = (
    "#if defined(__GNUC__) && !defined(__clang__)",
    "#pragma GCC pop_options",
    "#endif",
    "#undef TEAMCLONE_VERSION",
    "#undef TEAMCLONE_CHECK",
)
_UNDERWAY = object()
"""In place of a kernel that is being translated."""


class Translation:
    """Kernels in C++, and all that they need.

    Attributes:
        constants: that they use.
        problems: what cannot be translated.
    """

    function_call = staticmethod(calls.function)
    method_call = staticmethod(calls.method)

    def __init__(self) -> None:
        self.constants = Constants()
        self.problems: list[Problem] = []
        self._functions: dict[tuple[Any, tuple[Any, ...]], Function | object | None] = {}

    def function(self, dispatcher: Any, given: tuple[Any, ...], caller: Scope | None, node: ast.AST | None) -> Function:
        """Return a kernel for arguments of these types, translated when it is first asked for.

        Args:
            caller, node: where it is called, None from outside of kernels.

        Raises:
            RejectedError: for one that cannot be translated.
        """
        key = dispatcher.py_func, given
        if key not in self._functions:
            self._functions[key] = _UNDERWAY
            self._functions[key] = self._translate(dispatcher.py_func, given)
        found = self._functions[key]
        if found is _UNDERWAY and caller is not None:
            raise caller.fail(node or caller.tree, "recursion", f"{dispatcher.py_func.__name__} calls itself")
        if not isinstance(found, Function):
            raise RejectedError
        return found

    def entries(self, entries: Sequence[Entry]) -> list[Function]:
        """Return the kernels of entries, without those that cannot be translated."""
        found = []
        for entry in entries:
            with suppress(RejectedError):
                found.append(self.function(entry.kernel, entry.arguments, None, None))
        return found

    def _translate(self, function: Any, given: tuple[Any, ...]) -> Function | None:
        """Return a kernel in C++, None for one that cannot be translated; why is noted."""
        tree = source_of(function)
        names = [argument.arg for argument in tree.args.args]
        known = dict(zip(names, given, strict=True))
        roots = {name: frozenset({name} if has_arrays(part) else ()) for name, part in known.items()}
        scope = Scope(function=function, tree=tree, known=known, roots=roots, declared=declarations(tree))
        body: list[str] = []
        for _ in range(MOST_PASSES):
            scope.begin()
            body = Statements(scope, Expressions(scope, self)).block(tree.body)
            if scope.settled or scope.rejected:
                break
        else:
            scope.reject(tree, "variable", f"types are not found in {MOST_PASSES} passes")
        if [known[name] for name in names] != list(given):
            scope.reject(tree, "variable", "an argument gets another type")
        self.problems += [problem for problem in scope.problems if problem not in self.problems]
        return None if scope.rejected or scope.problems else self._finished(scope, names, body)

    def _finished(self, scope: Scope, names: list[str], body: list[str]) -> Function:
        """Return the function that a scope and its lines make."""
        function, returned = scope.function, types.none if scope.returned is None else scope.returned
        if returned != types.none and not ends(scope.tree.body):
            body = [*body, "return {};"]
        read = loaded(*scope.tree.body)
        keeps = has_arrays(returned)
        parameters = [f"{'rt::Arena& arena' if keeps else 'const rt::Arena& given'}"] if scope.makes else []
        if scope.makes and not keeps:  # copied here, after all arguments have been made
            body = ["rt::Arena arena = given;", *body]
        for name in names:
            unused = "" if name in read else "[[maybe_unused]] "
            parameters.append(f"{unused}{self.constants.spelt(scope.known[name])} {scope.local(name)}")
        module, name = function.__module__, clean(function.__name__)
        return Function(
            name=f"{space(module)}::{name}",
            module=module,
            returned=returned,
            makes=scope.makes,
            writes=tuple(place for place, name in enumerate(names) if name in scope.writes),
            returned_from=tuple(place for place, name in enumerate(names) if name in scope.returned_roots),
            callees=tuple({id(callee): callee for callee in scope.callees}.values()),
            variables=dict(scope.known),
            note=(inspect.getdoc(function) or "").partition("\n")[0],
            head=f"inline {self.constants.spelt(returned)} {name}({', '.join(parameters)})",
            body=body,
        )


def in_order(function: Function, found: dict[int, Function]) -> None:
    """Add a function to those found, after all that it calls."""
    for callee in function.callees:
        in_order(callee, found)
    found.setdefault(id(function), function)


def grouped(blocks: Iterable[tuple[str, list[str]]]) -> list[str]:
    """Return lines of modules, each in the module's namespace."""
    lines = []
    for module, group in groupby(blocks, key=lambda block: block[0]):
        inner = [line for _, block in group for line in block]
        lines += [f"namespace {space(module)} {{", "", *inner, f"}}  // namespace {space(module)}", ""]
    return lines


def _entry(entry: Entry, function: Function, constants: Constants) -> list[str]:
    """Return the function by which users of the header call an entry."""
    names = [clean(name) for name in inspect.signature(entry.kernel.py_func).parameters]
    parameters = [f"{constants.spelt(part)} {name}" for part, name in zip(entry.arguments, names, strict=True)]
    call = f"{function.name}({', '.join((['arena'] if function.makes else []) + names)})"
    if function.returned != types.none:
        parameters.append(f"{constants.spelt(function.returned)}& returned")
        call = f"returned = {call}"
    return [
        f"/// {function.note} Gives false where the memory did not suffice.",
        f"inline bool {entry.name}(rt::Memory& memory, {', '.join(parameters)}) {{",
        f"    return rt::within(memory, [&]([[maybe_unused]] rt::Arena arena) {{ {call}; }});",
        "}",
        "",
    ]


def check_kernels(entries: Sequence[Entry]) -> list[Problem]:
    """Return what keeps kernels, and all that they call, from being translated."""
    program = Translation()
    program.entries(entries)
    return program.problems


def translate(entries: Sequence[Entry], *, version: str, more: str = "") -> str:
    """Return the header with some kernels and all that they call.

    Args:
        version: the name of the namespace within `teamclone`, so that two versions can be in one program.
        more: C++ that stands after them in the namespace.

    Raises:
        KernelError: for a kernel that cannot be translated.
    """
    program, found = Translation(), dict[int, Function]()
    functions = program.entries(entries)
    if program.problems:
        raise KernelError(program.problems)
    for function in functions:
        in_order(function, found)
    bodies = [
        (one.module, [f"/// {one.note}", f"{one.head} {{", *indented(one.body), "}", ""]) for one in found.values()
    ]
    support = files("teamclone.export").joinpath("support.hpp").read_text(encoding="utf-8")
    lines = [
        "// Made by teamclone from the kernels that it runs in Python. Changes belong there.",
        "#pragma once",
        "",
        *(f"#include <{name}>" for name in INCLUDES),
        "",
        f"#define TEAMCLONE_VERSION {version}",
        "",
        *VECTORISES,
        "namespace teamclone {",
        f"namespace {version} {{",
        "",
        *support.splitlines(),
        "",
        *grouped((module, [*block, ""]) for (module, _), block in program.constants.defined.items()),
        *grouped(bodies),
        *(line for pair in zip(entries, functions, strict=True) for line in _entry(*pair, program.constants)),
        *more.splitlines(),
        f"}}  // namespace {version}",
        "}  // namespace teamclone",
        "",
        *ENDS,
    ]
    return "\n".join(lines) + "\n"
