"""Names that kernels find outside of themselves: where they are defined, and their values in C++."""

from __future__ import annotations

import ast
import builtins
import importlib
import inspect
import sys
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numba import typeof, types

from teamclone.export.functions import DTYPES
from teamclone.export.values import SCALARS, Value, array_type, is_array, is_named, is_tuple, number, tuple_type

RESERVED = frozenset(
    [
        "alignas",
        "alignof",
        "and",
        "and_eq",
        "asm",
        "auto",
        "bitand",
        "bitor",
        "bool",
        "break",
        "case",
        "catch",
        "char",
        "class",
        "compl",
        "const",
        "constexpr",
        "continue",
        "decltype",
        "default",
        "delete",
        "do",
        "double",
        "dynamic_cast",
        "else",
        "enum",
        "explicit",
        "export",
        "extern",
        "false",
        "float",
        "for",
        "friend",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "mutable",
        "namespace",
        "new",
        "noexcept",
        "not",
        "not_eq",
        "nullptr",
        "operator",
        "or",
        "or_eq",
        "given",
        "returned",
        "memory",
        "private",
        "protected",
        "public",
        "register",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "template",
        "this",
        "throw",
        "true",
        "try",
        "typedef",
        "typename",
        "union",
        "unsigned",
        "using",
        "virtual",
        "void",
        "volatile",
        "while",
        "xor",
        "xor_eq",
        "arena",
        "std",
        "rt",
        "errno",
        "stdin",
        "stdout",
        "stderr",
        "assert",
        "NAN",
        "INFINITY",
        "EOF",
        "NULL",
    ]
)


def clean(name: str) -> str:
    """Return a Python name as one that C++ allows: none of its words, nothing that it reserves."""
    bare = name.strip("_").replace("__", "_")
    return f"{bare}_" if bare in RESERVED or name.startswith("_") else bare


def space(module: str) -> str:
    """Return the namespace of a module."""
    return "_".join(module.split(".")[1:]) or module


@cache
def imported(module: str) -> dict[str, tuple[str, str]]:
    """Return from where a module imports its names, at the top: module and name there."""
    file = getattr(sys.modules[module], "__file__", None)
    if file is None or not file.endswith(".py"):
        return {}
    tree = ast.parse(Path(file).read_text(encoding="utf-8"))
    nodes = [node for node in tree.body if isinstance(node, ast.ImportFrom) and node.module]
    return {alias.asname or alias.name: (str(node.module), alias.name) for node in nodes for alias in node.names}


def home(module: str, name: str) -> tuple[str, str]:
    """Return the module and the name where a name of a module is defined."""
    while name in imported(module):
        source, name_there = imported(module)[name]
        found = importlib.import_module(source)
        if not hasattr(found, name_there) or isinstance(getattr(found, name_there), ModuleType):
            break
        module, name = source, name_there
    return module, name


@dataclass(frozen=True, slots=True)
class Outside:
    """An object outside of a kernel, and where it is defined: module and name, or None for a part of another one."""

    object: Any
    place: tuple[str, str] | None = None


MISSING = Outside(None)


def lookup(function: Any, node: ast.expr) -> Outside:
    """Return what a name, or a dotted name, outside of a function means; MISSING for anything else."""
    if isinstance(node, ast.Name):
        if node.id in function.__globals__:
            return Outside(function.__globals__[node.id], home(function.__module__, node.id))
        return Outside(getattr(builtins, node.id)) if hasattr(builtins, node.id) else MISSING
    if isinstance(node, ast.Attribute):
        base = lookup(function, node.value)
        if isinstance(base.object, ModuleType):
            module = base.object.__name__
            place = home(module, node.attr) if module.split(".")[0] == function.__module__.split(".")[0] else None
            return Outside(getattr(base.object, node.attr), place)
    return MISSING


def type_of(value: Any) -> Any:
    """Return the type of a constant, or None where it has none that kernels know."""
    if isinstance(value, bool | np.bool_):
        return types.boolean
    if isinstance(value, int):
        return types.int64 if -(2**63) <= value < 2**63 else None
    if isinstance(value, float | np.generic):
        return typeof(value) if typeof(value) in SCALARS else None
    if isinstance(value, np.ndarray):
        dtype = DTYPES.get(value.dtype.type)
        return None if dtype is None else array_type(dtype, value.ndim, readonly=True)
    if isinstance(value, tuple) and value:
        parts = [type_of(part) for part in value]
        if None in parts:
            return None
        return named_type(type(value), parts) if hasattr(value, "_fields") else tuple_type(parts)
    return None


def named_type(made: type, parts: list[Any]) -> Any:
    """Return the type of a NamedTuple with fields of these types."""
    if all(part == parts[0] for part in parts):
        return types.NamedUniTuple(parts[0], len(parts), made)
    return types.NamedTuple(parts, made)


@dataclass
class Constants:
    """The NamedTuples and constants that a header needs, in an order in which each stands after what it needs."""

    structs: dict[Any, str] = field(default_factory=dict)
    defined: dict[tuple[str, str], list[str]] = field(default_factory=dict)

    def spelt(self, numba_type: Any) -> str:
        """Return a type as C++ spells it."""
        if numba_type in SCALARS:
            return SCALARS[numba_type]
        if is_array(numba_type):
            element = ("" if numba_type.mutable else "const ") + SCALARS[numba_type.dtype]
            return f"rt::View<{element}, {numba_type.ndim}{'' if numba_type.layout == 'C' else ', false'}>"
        if is_named(numba_type):
            return self.struct(numba_type)
        if isinstance(numba_type, types.UniTuple):
            return f"rt::Same<{self.spelt(numba_type.dtype)}, {numba_type.count}>"
        if is_tuple(numba_type):
            return f"rt::Mixed<{', '.join(map(self.spelt, numba_type.types))}>"
        return "void"

    def struct(self, numba_type: Any) -> str:
        """Return the name of a NamedTuple's struct, which is defined if it is not yet."""
        if numba_type not in self.structs:
            for part in numba_type.types:
                self.spelt(part)
            made = numba_type.instance_class
            same = sum(other.instance_class is made for other in self.structs)
            name = clean(made.__name__) + (str(same + 1) if same else "")
            self.structs[numba_type] = f"{space(made.__module__)}::{name}"
            note = (inspect.getdoc(made) or "").partition("\n")[0]
            fields = [f"    {self.spelt(part)} {clean(field)};" for field, part in self.fields(numba_type)]
            self.defined[made.__module__, f"struct {name}"] = [f"/// {note}", f"struct {name} {{", *fields, "};"]
        return self.structs[numba_type]

    @staticmethod
    def fields(numba_type: Any) -> list[tuple[str, Any]]:
        """Return the names and types of a NamedTuple's fields."""
        return list(zip(numba_type.fields, numba_type.types, strict=True))

    def value(self, of: Any, place: tuple[str, str] | None) -> Value | None:
        """Return a constant as a value: a literal, or the name of what is defined for it; None for what is none."""
        numba_type = type_of(of)
        if numba_type is None:
            return None
        known = of if numba_type in SCALARS or is_tuple(numba_type) else None
        counts = numba_type == types.int64 and of >= 0
        if place is None:
            if is_array(numba_type):
                return None
            code = self.literal(of, numba_type)
            return Value(type=numba_type, code=code, constant=known, counts=counts, binds=1 if code[0] == "-" else 0)
        module, name = place
        if (module, name) not in self.defined:
            literal = self.literal(of, numba_type, place)
            line = f"inline constexpr {self.spelt(numba_type)} {clean(name)} = {literal};"
            self.defined[module, name] = [line]
        return Value(type=numba_type, code=f"{space(module)}::{clean(name)}", constant=known, counts=counts)

    def literal(self, of: Any, numba_type: Any, place: tuple[str, str] | None = None) -> str:
        """Return a constant written out."""
        if is_array(numba_type):
            return self.array(of, numba_type, place or ("", ""))
        if is_tuple(numba_type):
            inner = [
                self.literal(part, part_type, place and (place[0], f"{place[1]}_{index}"))
                for index, (part, part_type) in enumerate(zip(of, numba_type.types, strict=True))
            ]
            doubled = isinstance(numba_type, types.UniTuple) and not is_named(numba_type)
            return f"{self.spelt(numba_type)}{'{{' if doubled else '{'}{', '.join(inner)}{'}}' if doubled else '}'}"
        plain = of.item() if isinstance(of, np.generic) else of
        return f"static_cast<float>({number(plain)})" if numba_type == types.float32 else number(plain)

    def array(self, of: Any, numba_type: Any, place: tuple[str, str]) -> str:
        """Return the view of an array whose elements are defined as data of its module."""
        name = f"{clean(place[1])}_data"
        cells = [self.literal(cell, numba_type.dtype) for cell in of.ravel()]
        spelt = SCALARS[numba_type.dtype]
        rows = [f"    {', '.join(cells[start : start + 8])}," for start in range(0, len(cells), 8)]
        self.defined[place[0], name] = [f"inline constexpr {spelt} {name}[] = {{", *rows, "};"]
        return f"{self.spelt(numba_type)}{{{name}, {{{', '.join(map(str, of.shape))}}}}}"
