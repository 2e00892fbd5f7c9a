"""Where the variables of a kernel are declared in C++, and what is known of them while it is translated."""

from __future__ import annotations

import ast
import inspect
import textwrap
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from teamclone.export.constants import clean
from teamclone.export.rules import Problem, RejectedError
from teamclone.export.values import Value, is_array, joined

IGNORED = "_"
"""The name of what is not used."""


def source_of(function: Any) -> ast.FunctionDef:
    """Return the syntax of a function, with the lines of its file."""
    lines, first = inspect.getsourcelines(function)
    tree = ast.parse(textwrap.dedent("".join(lines))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    ast.increment_lineno(tree, first - 1)
    return tree


def stored(node: ast.AST) -> list[str]:
    """Return the names that are assigned within a node, as often as they are."""
    names = [part for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)]
    return [name.id for name in names]


def loaded(*nodes: ast.AST) -> set[str]:
    """Return the names that are read within nodes."""
    parts = (part for node in nodes for part in ast.walk(node))
    return {part.id for part in parts if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Load)}


def mentions(node: ast.AST, name: str) -> bool:
    """Return whether a name stands within a node."""
    return any(isinstance(part, ast.Name) and part.id == name for part in ast.walk(node))


def is_assigned_by(statement: ast.stmt, name: str) -> bool:
    """Return whether a statement is an assignment to a name that does not read it."""
    if not isinstance(statement, ast.Assign) or name not in stored(statement):
        return False
    return name not in loaded(statement.value, *statement.targets)


def assigns(block: list[ast.stmt], name: str) -> bool:
    """Return whether a block assigns a name on every way before it reads it."""
    for statement in block:
        if is_assigned_by(statement, name):
            return True
        if mentions(statement, name):
            if not isinstance(statement, ast.If) or mentions(statement.test, name):
                return False
            return assigns(statement.body, name) and assigns(statement.orelse, name)
        if isinstance(statement, ast.Return | ast.Break | ast.Continue):
            return True
    return False


@dataclass(slots=True)
class Declarations:
    """Where variables are declared: with a statement that assigns them, or before one, by its identity."""

    at: dict[int, set[str]] = field(default_factory=dict)
    before: dict[int, list[str]] = field(default_factory=dict)

    def place(self, block: list[ast.stmt], name: str, in_loop: bool) -> bool:
        """Declare a variable of which all mentions are in a block, as far in as it keeps its meaning.

        Returns:
            Whether it could be: in a loop, a variable that is not assigned first keeps its value from round to round.
        """
        places = [statement for statement in block if mentions(statement, name)]
        first = places[0]
        if len(places) == 1 and self._within(first, name, in_loop):
            return True
        if is_assigned_by(first, name):
            self.at.setdefault(id(first), set()).add(name)
        elif not in_loop or assigns(places, name):
            self.before.setdefault(id(first), []).append(name)
        else:
            return False
        return True

    def _within(self, statement: ast.stmt, name: str, in_loop: bool) -> bool:
        """Declare a variable that only this statement mentions in one of its blocks, or its head, if it can be."""
        if isinstance(statement, ast.If):
            inner = [block for block in (statement.body, statement.orelse) if any(mentions(one, name) for one in block)]
            if len(inner) == 1 and not mentions(statement.test, name):
                return self.place(inner[0], name, in_loop)
        if isinstance(statement, ast.For):
            if name in stored(statement.target):
                self.at.setdefault(id(statement), set()).add(name)
                return name not in loaded(statement.iter)
            if not mentions(statement.iter, name):
                return self.place(statement.body, name, True)
        if isinstance(statement, ast.While) and not mentions(statement.test, name):
            return self.place(statement.body, name, True)
        return False


def declarations(tree: ast.FunctionDef) -> Declarations:
    """Return where the variables of a function are declared."""
    made = Declarations()
    given = {argument.arg for argument in tree.args.args}
    for name in dict.fromkeys(name for statement in tree.body for name in stored(statement)):
        if name not in given and name != IGNORED:
            made.place(tree.body, name, False)
    return made


@dataclass(slots=True)
class Scope:
    """What is known of a kernel for given types of its arguments, found anew in each pass over it.

    Attributes:
        known: types of variables. roots: in the memory of which parameters an array variable may lie.
        counters: variables that are surely not negative.
        writes: parameters whose memory it changes. makes: whether it needs scratch memory.
        given, returned_roots: the type of what it returns, and in which parameters' memory that may lie.
        callees: kernels that it calls. settled: whether the last pass found nothing new.
        problems: what cannot be translated. unknown: variables that depend on it, or on a kernel with problems.
        rejected: whether a statement could not be translated.
    """

    function: Any
    tree: ast.FunctionDef
    known: dict[str, Any]
    roots: dict[str, frozenset[str]]
    declared: Declarations
    counters: set[str] = field(default_factory=set)
    writes: set[str] = field(default_factory=set)
    makes: bool = False
    returned: Any = None
    returned_roots: frozenset[str] = frozenset()
    callees: list[Any] = field(default_factory=list)
    settled: bool = False
    problems: list[Problem] = field(default_factory=list)
    unknown: set[str] = field(default_factory=set)
    rejected: bool = False
    last_name: int = 0

    def begin(self) -> None:
        """Begin another pass."""
        self.settled, self.last_name, self.callees = True, 0, []
        self.rejected, self.problems = False, []
        self.counters.clear()
        self.unknown.clear()

    def fail(self, node: ast.AST, rule: str, text: str) -> RejectedError:
        """Note a problem, and return the exception that ends the translation of the statement."""
        self.reject(node, rule, text)
        return RejectedError()

    def reject(self, node: ast.AST, rule: str, text: str) -> None:
        """Note a problem."""
        file = Path(inspect.getsourcefile(self.function) or "?")
        line = getattr(node, "lineno", self.tree.lineno)
        self.problems.append(Problem(file=file, line=line, kernel=self.function.__name__, rule=rule, text=text))

    def fresh(self, letter: str) -> str:
        """Return a name that the kernel does not have."""
        self.last_name += 1
        return f"{letter}_{self.last_name}"

    def learn(self, node: ast.AST, name: str, value: Value) -> None:
        """Note that a variable gets a value."""
        before = self.known.get(name)
        after = value.type if before is None else joined(before, value.type)
        if after is None:
            raise self.fail(node, "variable", f"{name} is {before} and becomes {value.type}")
        roots = self.roots.get(name, frozenset()) | value.roots
        if after != before or roots != self.roots.get(name):
            self.known[name], self.roots[name], self.settled = after, roots, False

    def change(self, node: ast.AST, array: Value) -> None:
        """Note that an array, or one within a tuple, is changed."""
        if is_array(array.type) and not array.type.mutable:
            raise self.fail(node, "constant", f"{array.code} is read-only")
        if not array.roots <= self.writes:
            self.writes |= array.roots
            self.settled = False

    def local(self, name: str) -> str:
        """Return a variable's name in C++."""
        return clean(name)
