"""Write the generated parts of the documentation from the code.

    python docs/generate.py

Pages under `reference/` are made of prose and of blocks between `<!-- generated: NAME -->` and `<!-- end -->`.
A block is written from the code, so it cannot age; `tests/docs/test_generated.py` compares the pages with it.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import typer
from typer.models import ArgumentInfo

import teamclone
from teamclone.cli.app import app
from teamclone.comparison import profile
from teamclone.events import definitions, statistics
from teamclone.models.config import FAMILIES
from teamclone.scout.sections import SECTIONS
from teamclone.store import schema
from teamclone.system.settings import described
from teamclone.training import config as training_config

DOCS = Path(__file__).resolve().parent
REFERENCE = DOCS / "reference"


def _commands(of: typer.Typer, before: str = "") -> dict[str, Callable[..., Any]]:
    """The functions of all commands by their words: `live watch`."""
    made = {
        f"{before}{one.name or one.callback.__name__}": one.callback
        for one in of.registered_commands
        if one.callback is not None and not one.hidden
    }
    for group in of.registered_groups:
        if group.typer_instance is not None:
            made |= _commands(group.typer_instance, f"{before}{group.name} ")
    return made


COMMANDS = _commands(app)


def pages() -> dict[Path, str]:
    """Return every page that has a generated part, with the text it should have.

    Raises:
        FileNotFoundError: a command has no page under `docs/reference/commands/`.
    """
    made = {_command_page(name): _filled(_command_page(name), options=_options(name)) for name in COMMANDS}
    made[_command_page("events")] = _filled(
        _command_page("events"),
        options=_options("events"),
        kinds=_kinds(),
        columns=_columns(),
        statistics=_statistics(),
    )
    made[_command_page("compare")] = _filled(
        _command_page("compare"), options=_options("compare"), statistics=_compared()
    )
    made[_command_page("scout")] = _filled(_command_page("scout"), options=_options("scout"), measures=_measures())
    made[REFERENCE / "settings.md"] = _filled(REFERENCE / "settings.md", settings=_settings())
    made[REFERENCE / "api.md"] = _filled(REFERENCE / "api.md", api=_api())
    made[REFERENCE / "data-model.md"] = schema.markdown()
    return made


def _command_page(name: str) -> Path:
    return REFERENCE / "commands" / f"{name.replace(' ', '-')}.md"


def _filled(page: Path, **blocks: str) -> str:
    """The text of a page with its generated blocks replaced."""
    text = page.read_text(encoding="utf-8")
    for name, block in blocks.items():
        pattern = re.compile(rf"(<!-- generated: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        if len(pattern.findall(text)) != 1:
            raise ValueError(f"{page}: expected one block `<!-- generated: {name} -->` ... `<!-- end -->`")
        text = pattern.sub(lambda found, block=block: f"{found[1]}\n{block}\n\n{found[2]}", text)
    return text


def _table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table; a `|` inside a cell is escaped."""
    lines = [list(heads)]
    lines += [["---"] * len(lines[0]), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(cells)} |".replace("|  |", "| |").replace("|  |", "| |") for cells in lines)


# Commands


def _options(name: str) -> str:
    """Usage and every argument and option of a command."""
    signature = inspect.signature(COMMANDS[name])
    hints = get_type_hints(COMMANDS[name], include_extras=True)
    found = [(one, *get_args(hints[one.name])) for one in signature.parameters.values()]
    arguments = [each for each in found if isinstance(each[2], ArgumentInfo)]
    usage = " ".join(["teamclone", name, *(_argument(*each) for each in arguments), "[OPTIONS]"])
    rows = [
        (_names(*each), _type(each[1], each[2]), _default(each[0], each[1]), each[2].help or "")
        for each in [*arguments, *(each for each in found if each not in arguments)]
    ]
    return f"```text\n{usage}\n```\n\n{_table(('argument or option', 'type', 'default', 'meaning'), rows)}"


def _argument(parameter: inspect.Parameter, hint: Any, info: Any) -> str:
    """An argument as in a usage line: `RUN`, `PATH...`, `[PLAN]`."""
    name = info.metavar or parameter.name.upper()
    shown = name + ("..." if _repeated(hint) and not name.endswith("...") else "")
    return shown if _required(parameter) or name.startswith("[") else f"[{shown}]"


def _names(parameter: inspect.Parameter, hint: Any, info: Any) -> str:
    if isinstance(info, ArgumentInfo):
        return f"`{_argument(parameter, hint, info)}`"
    # Inside `Annotated`, Typer takes the first declared name for a default until it reads the signature.
    names = [one for one in (info.default, *(info.param_decls or ())) if isinstance(one, str)]
    if not names:
        name = parameter.name.replace("_", "-")
        names = [f"--{name}", f"--no-{name}"] if hint is bool else [f"--{name}"]
    return ", ".join(f"`{name}`" for name in sorted(names, key=lambda name: not name.startswith("--")))


def _type(hint: Any, info: Any) -> str:
    """The type of a value in plain words, with its bounds."""
    (inner, *_) = [one for one in get_args(hint) if one is not type(None)] or [hint]
    if get_origin(inner) is list:
        (inner,) = get_args(inner)
    words = {int: "whole number", float: "number", bool: "switch", str: "text", Path: "path"}
    kind = f"`{info.metavar}`" if info.metavar and not isinstance(info, ArgumentInfo) else words.get(inner, "")
    if not kind:
        kind = " or ".join(f"`{value}`" for value in (get_args(inner) or [one.value for one in inner]))
    if info.min is not None and info.max is not None:
        kind += f", {info.min} to {info.max}"
    elif info.min is not None:
        kind += f", at least {info.min}"
    return f"{kind}, repeatable" if _repeated(hint) else kind


def _repeated(hint: Any) -> bool:
    return any(get_origin(one) is list for one in (hint, *get_args(hint)))


def _required(parameter: inspect.Parameter) -> bool:
    return parameter.default is inspect.Parameter.empty


def _default(parameter: inspect.Parameter, hint: Any) -> str:
    if _required(parameter):
        return "required"
    if hint is bool:
        return "on" if parameter.default else "off"
    return "" if parameter.default in (None, ()) else f"`{getattr(parameter.default, 'value', parameter.default)}`"


# Events


def _kinds() -> str:
    """Every kind of event: its outcomes, whose definition it is, and that."""
    rows = [
        (kind.value, ", ".join(f"`{one}`" for one in definitions.OUTCOMES.get(kind, ())), whose, about)
        for kind, (whose, about) in definitions.KINDS.items()
    ]
    return _table(("kind", "outcomes", "definition of", "definition"), rows)


def _columns() -> str:
    """The columns of the table of events."""
    rows = [(f"`{one.name}`", one.unit, one.about) for one in definitions.COLUMNS]
    return _table(("column", "unit", "meaning"), rows)


def _statistics() -> str:
    """Every statistic of a team."""
    return _table(("statistic", "unit", "meaning"), [(f"`{name}`", *rest) for name, *rest in statistics.described()])


def _measures() -> str:
    """The measures of an opponent report, by section."""
    better = {1: "more", -1: "less", 0: ""}
    rows = [
        (
            f"`{one.key}`",
            section.TITLE.lower(),
            "" if one.unit == "" else one.unit,
            better[one.good],
            f"{one.name}: {one.about}",
        )
        for section in SECTIONS
        for one in section.MEASURES
    ]
    return _table(("measure", "section", "unit", "better", "meaning"), rows)


def _compared() -> str:
    """Every statistic that a comparison has beside those of a team's events."""
    known = {name for name, *_ in statistics.described()}
    rows = [(f"`{one.name}`", one.unit, one.about) for one in profile.STATISTICS if one.name not in known]
    return _table(("statistic", "unit", "meaning"), rows)


# Settings


def _settings() -> str:
    """One table for each model family, then one for each other section of a run's settings."""
    parts = []
    for name, family in FAMILIES.items():
        rows = [("`model.family`", "", f'`"{name}"`', "which of the families"), *_settings_of(family, "model")]
        parts.append(f"### model, family {name}\n\n{_settings_table(rows)}")
    for section, kind in get_type_hints(training_config.Config).items():
        if section != "model":
            parts.append(f"### {section}\n\n{_settings_table(_settings_of(kind, section))}")
    return "\n\n".join(parts)


def _settings_table(rows: Iterable[Iterable[str]]) -> str:
    return _table(("setting", "values", "default", "meaning"), rows)


def _settings_of(kind: type[Any], section: str) -> list[tuple[str, str, str, str]]:
    """Key, values, default and meaning of the settings of a section; meanings are those of the docstrings."""
    about: dict[str, str] = {}
    for base in kind.__mro__[:-1]:
        about = dict(_entries(_sections(inspect.cleandoc(base.__doc__ or "")).get("Attributes", ""))) | about
    return [
        (f"`{section}.{one.name}`", one.values, f"`{one.default}`", about.get(one.name, "")) for one in described(kind)
    ]


# Python API


def _api() -> str:
    """Signature, description and parameters of every public name, in the order of `teamclone.__all__`."""
    names = [name for name in getattr(teamclone, "__all__", ()) if not name.startswith("__")]
    return "\n\n".join(_described(f"teamclone.{name}", getattr(teamclone, name), level=3) for name in names)


def _described(path: str, thing: Any, *, level: int) -> str:
    """One public function, class, module or value."""
    name = path.rpartition(".")[2]
    parts = [f"{'#' * level} {name}"]
    if inspect.isclass(thing) or callable(thing):
        parts.append(f"```python\n{_signature(path, thing)}\n```")
    parts += _prose(inspect.getdoc(thing) or "")
    if inspect.isclass(thing) and not issubclass(thing, BaseException):
        parts += [_described(f"{name}.{member}", found, level=level + 1) for member, found in _members(thing)]
    if inspect.ismodule(thing):
        parts += [_described(f"{path}.{member}", getattr(thing, member), level=level + 1) for member in thing.__all__]
    return "\n\n".join(parts)


def _members(kind: type) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Public methods that a class defines itself and describes."""
    for name, found in vars(kind).items():
        plain = found.__func__ if isinstance(found, classmethod | staticmethod) else found
        if not name.startswith("_") and inspect.isfunction(plain) and plain.__doc__:
            yield name, plain


def _signature(path: str, thing: Any) -> str:
    """A signature, one parameter a line where it is long."""
    if inspect.isclass(thing) and (issubclass(thing, BaseException) or getattr(thing, "_is_protocol", False)):
        return f"class {path}"
    signature = inspect.signature(thing)
    kept = [
        one.replace(annotation=_plain(one.annotation), default=_shown(one.default))
        for one in signature.parameters.values()
    ]
    if not inspect.isclass(thing):
        kept = [one for one in kept if one.name != "self"]
    returned = inspect.Signature.empty if inspect.isclass(thing) else _plain(signature.return_annotation)
    text = f"{path}{signature.replace(parameters=kept, return_annotation=returned)}"
    if len(text) <= 100:
        return text
    head, _, tail = text.partition("(")
    inner, _, result = tail.rpartition(")")
    return f"{head}(\n    {_lines(inner)},\n){result}"


class _Verbatim:
    """An annotation that prints as it was written."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __repr__(self) -> str:
        return self.text


def _shown(default: Any) -> Any:
    """A default that prints the same in every process: the value of an enum, `...` for a function."""
    if default is inspect.Parameter.empty or inspect.isclass(default):
        return default
    return _Verbatim("...") if callable(default) else getattr(default, "value", default)


def _plain(annotation: Any) -> Any:
    if annotation is inspect.Signature.empty:
        return annotation
    return _Verbatim(annotation if isinstance(annotation, str) else inspect.formatannotation(annotation))


def _lines(inner: str) -> str:
    """Parameters one a line: split at commas outside brackets."""
    depth, made = 0, ""
    for sign in inner:
        depth += (sign in "([{") - (sign in ")]}")
        made += sign
        if sign == "," and not depth:
            made += "\n   "
    return made


def _prose(doc: str) -> list[str]:
    """A docstring as Markdown: its paragraphs, then its sections as lists."""
    made = []
    for name, body in _sections(doc).items():
        if not name:
            made += [" ".join(part.split()) if "\n    " not in part else part for part in body.split("\n\n") if part]
        elif entries := _entries(body):
            made.append(f"**{name}**")
            made.append("\n".join(f"- `{entry}`: {text}" for entry, text in entries))
        elif body.strip():
            made.append(f"**{name}**: {' '.join(body.split())}")
    return made


def _sections(doc: str) -> dict[str, str]:
    """The parts of a docstring in Google's style by name; the description is under the empty name."""
    parts = re.split(r"^(Args|Attributes|Returns|Yields|Raises):\n", doc, flags=re.MULTILINE)
    return {"": parts[0].strip()} | dict(zip(parts[1::2], map(inspect.cleandoc, parts[2::2]), strict=True))


def _entries(body: str) -> list[tuple[str, str]]:
    """`name: text` entries of a section, with the lines that continue them."""
    found = re.findall(r"^([\w*., ]+?)(?: \([^)]*\))?: (.*(?:\n[ \t]+.*)*)", body, flags=re.MULTILINE)
    return [(name, " ".join(text.split())) for name, text in found]


if __name__ == "__main__":
    for path, text in pages().items():
        if path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
            print(path.relative_to(DOCS.parent))
