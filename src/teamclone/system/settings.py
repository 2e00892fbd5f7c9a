"""Settings from TOML and from the command line: dataclasses from tables, every mistake collected; single values."""

from __future__ import annotations

import tomllib
from dataclasses import MISSING, fields
from enum import StrEnum
from typing import Any, get_type_hints

from teamclone.errors import choose


def value_of(text: str) -> Any:
    """A value as TOML writes it; anything else is a word."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def fill(cls: type[Any], table: Any, key: str, problems: list[str]) -> Any:
    """A dataclass from a TOML table; what does not fit is left out and told."""
    if not isinstance(table, dict):
        problems.append(f"{key}: expected a table, got {table!r}")
        table = {}
    hints = get_type_hints(cls)
    kept: dict[str, Any] = {}
    for name, value in table.items():
        if name not in hints:
            problems.append(f"no setting {key}.{name}; {choose(name, list(hints))}")
        elif hints[name] is float and type(value) is int:
            kept[name] = float(value)
        elif hints[name] == tuple[str, ...]:
            several = [value] if isinstance(value, str) else value
            if isinstance(several, list) and all(isinstance(word, str) for word in several):
                kept[name] = tuple(several)
            else:
                problems.append(f"{key}.{name}: expected a word or a list of words, got {value!r}")
        elif isinstance(hints[name], type) and issubclass(hints[name], StrEnum):
            choices = [member.value for member in hints[name]]
            if value in choices:
                kept[name] = hints[name](value)
            else:
                problems.append(f"{key}.{name}: no {value!r}; choose from {', '.join(choices)}")
        elif hints[name] == dict[str, str]:
            kept[name] = entries(value, f"{key}.{name}", str, problems)
        elif hints[name] == dict[str, Any]:
            kept[name] = entries(value, f"{key}.{name}", object, problems)
        elif type(value) is hints[name]:
            kept[name] = value
        else:
            kinds = {int: "a whole number", float: "a number", bool: "true or false", str: "a text"}
            problems.append(f"{key}.{name}: expected {kinds[hints[name]]}, got {value!r}")
    needed = {item.name for item in fields(cls) if item.default is MISSING and item.default_factory is MISSING}
    return cls(**dict.fromkeys(needed - kept.keys(), ()), **kept)


def entries(table: Any, key: str, kind: type, problems: list[str]) -> dict[str, Any]:
    """A table whose names are free."""
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
