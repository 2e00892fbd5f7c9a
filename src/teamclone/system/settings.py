"""Settings as dataclasses: types and bounds beside each field, one reader for TOML and for the command line.

A field declared with `setting` carries its bounds. `from_table` fills a dataclass from a TOML table and collects every
mistake; `assignment` reads one ``KEY=VALUE``; `table_of` and `to_toml` write settings; `described` lists them for the
documentation.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from enum import StrEnum
from typing import Any, get_args, get_origin, get_type_hints

from teamclone.errors import UsageError, choose

_NAMES: dict[Any, str] = {int: "a whole number", float: "a number", bool: "true or false", str: "a word"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """What a setting may be beside its type; of a list, what each of its items may be.

    Attributes:
        choices: the words to choose from; empty where any will do.
        at_least, above, at_most, below: of a number.
        items: how many items a list has; None for any number. some: a list has at least one. most: and at most so many.
        rule: of the whole value: returns what was expected, or None where the value is right.
    """

    choices: tuple[str, ...] = ()
    at_least: float = -math.inf
    above: float = -math.inf
    at_most: float = math.inf
    below: float = math.inf
    items: int | None = None
    some: bool = False
    most: int | None = None
    rule: Callable[[Any], str | None] | None = None


ANY = Bounds()
"""The bounds of a field that was not declared with `setting`."""


def setting(default: Any = MISSING, **bounds: Any) -> Any:
    """Declare a field of a settings dataclass with its `Bounds`; without a default it has to be given."""
    metadata = {"bounds": Bounds(**bounds)}
    return field(metadata=metadata) if default is MISSING else field(default=default, metadata=metadata)


def bounds_of(item: Field[Any]) -> Bounds:
    """Return the bounds of a field."""
    bounds: Bounds = item.metadata.get("bounds", ANY)
    return bounds


def value_of(text: str) -> Any:
    """Return the value of a text in TOML's notation; any other text is a word."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return text


def assignment(text: str, *, option: str = "--set") -> tuple[str, Any]:
    """Split ``KEY=VALUE`` into the key and its `value_of`.

    Raises:
        UsageError: there is no ``=``.
    """
    key, equals, value = text.partition("=")
    if not equals:
        raise UsageError(f"{option}: expected KEY=VALUE, got {text!r}")
    return key.strip(), value_of(value.strip())


def from_table(
    cls: type[Any], table: Any, key: str, problems: list[str], *, renamed: Mapping[str, str] | None = None
) -> Any:
    """Make a dataclass of a TOML table.

    A value that does not fit is left out, so its field has the default. A class may have a method ``problems(key)``
    that returns what is wrong between its settings; it is asked where every single one is right.

    Args:
        cls: a dataclass whose fields are int, float, bool, str, a StrEnum, a tuple of one of these, or a dictionary
            from names to texts or to anything.
        table: the table as `tomllib` read it.
        key: what messages call the table: ``train`` of ``train.epochs``.
        problems: mistakes are appended to it.
        renamed: present names of settings by former ones, each ``section.name``; None for none.
    """
    if not isinstance(table, dict):
        problems.append(f"{key}: expected a table, got {table!r}")
        table = {}
    now = renamed or {}
    before, hints, names = len(problems), get_type_hints(cls), [item.name for item in fields(cls)]
    problems += [
        f"no setting {where}; {renaming(where, now) or choose(name, names)}"
        for name, where in ((name, f"{key}.{name}") for name in table)
        if name not in names
    ]
    kept: dict[str, Any] = {}
    for item in fields(cls):
        where = f"{key}.{item.name}"
        if item.name in table:
            try:
                kept[item.name] = _converted(where, table[item.name], hints[item.name], bounds_of(item))
            except UsageError as error:
                problems.append(str(error))
        elif item.default is MISSING and item.default_factory is MISSING:
            problems.append(f"{where}: expected a value, got none")
        if item.name not in kept and item.default is MISSING and item.default_factory is MISSING:
            kept[item.name] = (get_origin(hints[item.name]) or hints[item.name])()
    made = cls(**kept)
    if len(problems) == before and hasattr(made, "problems"):
        problems += made.problems(key)
    return made


def renaming(key: str, renamed: Mapping[str, str]) -> str:
    """Return the remedy for a former name of a setting, empty for a name that never was one."""
    return f"{key} is now {renamed[key]}" if key in renamed else ""


def without_effect(settings: Any, key: str, names: Iterable[str], beside: str) -> list[str]:
    """Return a problem for each field of ``names`` that was changed from its default and has no effect.

    Args:
        settings: a settings dataclass. key: what messages call it. beside: the setting for which they have no effect.
    """
    usual = {item.name: item.default for item in fields(settings)}
    return [
        f"{key}.{name} has no effect with {beside}; leave it out, or set it to {toml_value(_plain(usual[name]))}"
        for name in names
        if getattr(settings, name) != usual[name]
    ]


def entries(table: Any, key: str, kind: type, problems: list[str]) -> dict[str, Any]:
    """Return a table whose names are free, without the values that are not of ``kind``: those are ``problems``."""
    if not isinstance(table, dict):
        problems.append(f"{key}: expected a table, got {table!r}")
        return {}
    words = {str: "a text", dict: "a table", object: "a value"}
    problems += [
        f"{key}.{name}: expected {words[kind]}, got {value!r}"
        for name, value in table.items()
        if not isinstance(value, kind)
    ]
    return {name: value for name, value in table.items() if isinstance(value, kind)}


def _converted(key: str, value: Any, hint: Any, bounds: Bounds) -> Any:
    """Return the value as the type of its field, within its bounds."""
    if get_origin(hint) is dict:
        problems: list[str] = []
        made = entries(value, key, str if get_args(hint)[1] is str else object, problems)
        if problems:
            raise UsageError("; ".join(problems))
        return made
    converted = _list(key, value, get_args(hint)[0], bounds) if get_origin(hint) is tuple else None
    if converted is None:
        converted = _scalar(key, value, hint, bounds)
    expected = bounds.rule(converted) if bounds.rule else None
    if expected is not None:
        raise UsageError(f"{key}: expected {expected}")
    return converted


def _list(key: str, value: Any, kind: Any, bounds: Bounds) -> tuple[Any, ...]:
    if isinstance(value, str):  # --set model.all_types=kick,stamina
        # Words that are not chosen from a list may hold a comma.
        parts = [part.strip() for part in (value.split(",") if bounds.choices or kind is not str else [value])]
        if "" in parts and len(parts) > 1:
            raise UsageError(f"{key}: expected a value on both sides of each comma, got {value!r}")
        value = [value_of(part) for part in parts if part]
    values = value if isinstance(value, list | tuple) else [value]
    converted = tuple(_scalar(key, part, kind, bounds) for part in values)
    if bounds.items is not None and len(converted) != bounds.items:
        raise UsageError(f"{key}: expected {bounds.items} values, got {list(converted)}")
    if bounds.some and not converted:
        raise UsageError(f"{key}: expected at least one value, got none")
    if bounds.most is not None and len(converted) > bounds.most:
        raise UsageError(f"{key}: expected at most {bounds.most} values, got {len(converted)}")
    if bounds.choices and len(set(converted)) != len(converted):
        raise UsageError(f"{key}: names one more than once: {', '.join(converted)}")
    return converted


def _scalar(key: str, value: Any, kind: Any, bounds: Bounds) -> Any:
    if issubclass(kind, StrEnum):
        choices = [member.value for member in kind]
        if value not in choices:
            raise UsageError(f"{key}: no {value!r}; {choose(str(value), choices)}")
        return kind(value)
    if kind is float and type(value) is int:
        value = float(value)
    if type(value) is not kind:
        raise UsageError(f"{key}: expected {_NAMES[kind]}, got {value!r}")
    if bounds.choices and value not in bounds.choices:
        raise UsageError(f"{key}: no {value!r}; {choose(value, list(bounds.choices))}")
    if isinstance(value, int | float):
        _check_number(key, value, bounds)
    return value


def _check_number(key: str, value: float, bounds: Bounds) -> None:
    for right, words in (
        (value >= bounds.at_least or bounds.at_least == -math.inf, f"at least {bounds.at_least}"),
        (value > bounds.above or bounds.above == -math.inf, f"a number above {bounds.above}"),
        (value <= bounds.at_most or bounds.at_most == math.inf, f"at most {bounds.at_most}"),
        (value < bounds.below or bounds.below == math.inf, f"a number below {bounds.below}"),
        (math.isfinite(value), "a finite number"),
    ):
        if not right:
            raise UsageError(f"{key}: expected {words}, got {value}")


def table_of(settings: Any) -> dict[str, Any]:
    """Return a settings dataclass as a TOML table: names to plain values, tuples as lists."""
    return {item.name: _plain(getattr(settings, item.name)) for item in fields(settings)}


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    return value.value if isinstance(value, StrEnum) else value


def to_toml(tables: Mapping[str, Mapping[str, Any]]) -> str:
    """Return tables by name as TOML."""
    lines: list[str] = []
    for name, table in tables.items():
        lines += [f"[{name}]", *(f"{key} = {toml_value(value)}" for key, value in table.items()), ""]
    return "\n".join(lines)


def toml_value(value: Any) -> str:
    """Return a number, switch, word or list of these in TOML's notation."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(toml_value(item) for item in value)}]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Described:
    """One setting for the documentation.

    Attributes:
        name: of its field. values: what it may be, in words and Markdown. default: in TOML's notation, empty without.
    """

    name: str
    values: str
    default: str


def described(cls: type[Any]) -> list[Described]:
    """Return the settings of a dataclass in the order of their fields."""
    hints = get_type_hints(cls)
    return [
        Described(
            name=item.name,
            values=_values(hints[item.name], bounds_of(item)),
            default="" if item.default is MISSING else toml_value(_plain(item.default)),
        )
        for item in fields(cls)
    ]


def _values(hint: Any, bounds: Bounds) -> str:
    """Return what a setting may be: its choices, or its type with its bounds."""
    kind = get_args(hint)[0] if get_origin(hint) is tuple else hint
    choices = [member.value for member in kind] if issubclass(kind, StrEnum) else bounds.choices
    if choices:
        text = ", ".join(f"`{choice}`" for choice in choices)
    else:
        limits = {"at least": bounds.at_least, "above": bounds.above, "at most": bounds.at_most, "below": bounds.below}
        text = {int: "whole number", float: "number", bool: "switch", str: "word"}[kind]
        text += "".join(f", {name} {limit}" for name, limit in limits.items() if math.isfinite(limit))
    return text if kind is hint else f"list: {text}"
