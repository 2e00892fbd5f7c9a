"""What the parts of a translation know of it: kernels that are translated, and how others are."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from typing import Any, Protocol

from teamclone.export.constants import Constants
from teamclone.export.scopes import Scope
from teamclone.export.values import Value


@dataclass(frozen=True, slots=True, kw_only=True)
class Function:
    """A kernel in C++, for given types of its arguments.

    Attributes:
        name: with its namespace. module: of the kernel. returned: the type of what it returns.
        makes: whether it needs scratch memory. writes: places of the arguments that it changes.
        returned_from: places of those in whose memory an array that it returns may lie.
        callees: what it calls. variables: their types. note: what it does. head, body: its lines.
    """

    name: str
    module: str
    returned: Any
    makes: bool
    writes: tuple[int, ...]
    returned_from: tuple[int, ...]
    callees: tuple[Function, ...]
    variables: dict[str, Any]
    note: str
    head: str
    body: list[str]


class Program(Protocol):
    """Kernels in C++, and all that they need; `translate.Translation`.

    Attributes:
        constants: that they use.
    """

    constants: Constants

    def function(self, dispatcher: Any, given: tuple[Any, ...], caller: Scope | None, node: ast.AST | None) -> Function:
        """Return a kernel for arguments of these types."""
        ...

    def function_call(self, expressions: Any, node: ast.Call, called: Any) -> Value:
        """Return the value of a call of a function that is no kernel."""
        ...

    def method_call(self, expressions: Any, node: ast.Call, name: str, base: Value) -> Value:
        """Return the value of a call of an array's method."""
        ...
