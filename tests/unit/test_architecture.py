"""The plan of the package: which folder may import which, how long a function may be, where server defaults stand."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from teamclone.rcss import server_params

PACKAGE = "teamclone"
SOURCE = Path(__file__).resolve().parents[2] / "src" / PACKAGE

BASE = ("errors", "system", "rcss")
READING = (*BASE, "logs", "world", "percepts", "events", "store")
CLONING = ("dataset", "play", "models", "training", "export", "search", "evaluation")
MAY_IMPORT: Mapping[str, tuple[str, ...]] = {
    "errors": (),
    "system": ("errors",),
    "rcss": (),
    "plots": ("rcss",),
    "logs": BASE,
    "dynamics": ("errors", "rcss", "logs.columns", "logs.match", "logs.align"),
    "protocol": (*BASE, "logs"),
    "world": ("rcss", "dynamics", "logs.columns", "logs.match", "logs.align"),
    "percepts": (*BASE, "logs", "world"),
    "events": (*BASE, "logs", "dynamics"),
    "store": (*BASE, "logs", "dynamics", "events"),
    "dataset": (*READING, "dynamics"),
    "play": (*BASE, "logs", "protocol", "store"),
    "planner": ("system", "rcss", "dynamics", "world.channels"),
    "engine": ("errors", "system", "rcss", "planner", "world.channels"),
    "models": (*BASE, "dynamics", "world", "planner", "engine"),
    "training": (*BASE, "world", "dataset", "engine", "models"),
    "export": (*BASE, "planner", "engine", "world", "dataset", "models", "training"),
    "search": (*BASE, "plots", "dataset", "engine.network.constants", "models", "training"),
    "evaluation": (*READING, "plots", "dynamics", "dataset", "engine", "models", "training"),
    "rollouts": (*BASE, "plots", "logs", "dynamics", "world", "models", "evaluation"),
    "report": (*BASE, "plots", "models", "training", "evaluation", "rollouts"),
    "comparison": (*READING, "plots", "play.holes", "evaluation.bootstrap"),
    "similarity": (*READING, "plots", "models", "dataset", "training", "evaluation"),
    "replay": (*BASE, "plots", "logs", "dynamics", "events", "store", "training", "evaluation", "rollouts"),
    "scout": (*READING, "plots", "comparison.words", "models", "dataset", "training", "evaluation", "replay"),
    "live": (*BASE, "protocol", "logs", "dynamics", "world", "dataset", "engine", "models", "training", "evaluation"),
    "plot": ("errors", "rcss", "plots", "logs", "events", "world"),
    "pipeline": (*BASE, "store", "dataset", "play", "training", "evaluation", "report"),
    "api": (*READING, "dataset", "play", "engine", "models", "training", "search", "evaluation", "pipeline"),
    "cli": (
        *READING,
        *CLONING,
        "rollouts",
        "report",
        "comparison",
        "similarity",
        "replay",
        "scout",
        "protocol",
        "live",
        "pipeline",
        "api",
    ),
    PACKAGE: (
        *READING,
        "dynamics",
        "dataset",
        "training",
        "evaluation",
        "report",
        "comparison",
        "similarity",
        "replay",
        "scout",
        "plot",
        "api",
    ),
    "__main__": ("cli",),
}
"""What a folder, or a module at the top, may import of the package: folders, or modules of them. From low to high."""


MAY_IMPORT_TORCH = (
    "world.state",
    "world.mirror",
    "dataset.reader",
    "models",
    "training",
    "search",
    "export.contract",
    "evaluation",
    "rollouts",
    "report",
)

MOST_LINES = 80
KERNEL = re.compile(r"_?(njit|kernel|cached_kernel|helper)\b")
"""Decorators by which Numba compiles a function. It inlines no call, so a kernel may be long."""

TELLING_DEFAULTS = (0.94, 130600, 0.085)
"""Defaults of the server that are no other number of the game: ball_decay, stamina_capacity, ball_size."""


@cache
def modules() -> dict[str, ast.Module]:
    """Every module of the package by its name, without the package's own in front."""
    found = {}
    for path in sorted(SOURCE.rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts) or PACKAGE
        found[name] = ast.parse(path.read_text(encoding="utf-8"), str(path))
    return found


def imports(module: str, tree: ast.Module, known: frozenset[str]) -> Iterator[str]:
    """Full names of what a module imports, wherever: in functions and under TYPE_CHECKING, too.

    Of the package's own: modules, without its name in front. That a module asks for the version is left out.
    """
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}, line {node.lineno}: write the import with its full name"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            first, _, rest = name.partition(".")
            if first != PACKAGE:
                yield name
            elif rest != "__version__":
                yield rest if rest in known else rest.rpartition(".")[0] or PACKAGE


def own_imports(module: str, tree: ast.Module, known: frozenset[str]) -> set[str]:
    """The modules of the package that a module imports."""
    return {name for name in imports(module, tree, known) if name in known} - {module}


@cache
def graph() -> dict[str, set[str]]:
    """Every module and the modules that it imports."""
    known = frozenset(modules())
    return {name: own_imports(name, tree, known) for name, tree in modules().items()}


def folder_of(module: str) -> str:
    return module.partition(".")[0]


def is_within(module: str, places: tuple[str, ...]) -> bool:
    """Whether a module is one of these, or in one of these folders."""
    return any(module == place or module.startswith(f"{place}.") for place in places)


def test_every_folder_is_in_the_plan() -> None:
    unknown = {folder_of(module) for module in modules()} - set(MAY_IMPORT)
    assert not unknown, f"{sorted(unknown)}: add it to MAY_IMPORT, with what it may import, and to ARCHITECTURE.md"


def test_the_plan_goes_one_way() -> None:
    seen: set[str] = set()
    for folder, allowed in MAY_IMPORT.items():
        assert {folder_of(place) for place in allowed} <= seen, f"{folder}: may import only what stands above it here"
        seen.add(folder)


def test_a_folder_imports_only_what_the_plan_allows() -> None:
    arrows = {
        f"{module} -> {target}"
        for module, targets in graph().items()
        for target in targets
        if folder_of(target) != folder_of(module) and not is_within(target, MAY_IMPORT.get(folder_of(module), ()))
    }
    advice = (
        "the plan has no such arrow. Move what is needed into a folder that both may import; where the plan is wrong, "
        "change MAY_IMPORT and ARCHITECTURE.md"
    )
    assert not arrows, f"{sorted(arrows)}: " + advice


def test_no_modules_import_each_other_in_a_circle() -> None:
    """Inside folders, too, and by whatever import: one in a function hides a circle, it does not undo it."""
    try:
        TopologicalSorter(graph()).prepare()
    except CycleError as error:
        pytest.fail(f"{' -> '.join(reversed(error.args[1]))}: move what both need into a module of its own")


def test_only_what_works_on_tensors_imports_torch() -> None:
    """The base install has no PyTorch: whoever reads logs, keeps a store or plays needs none."""
    known = frozenset(modules())
    found = {
        module
        for module, tree in modules().items()
        if any(folder_of(name) == "torch" for name in imports(module, tree, known))
        and not is_within(module, MAY_IMPORT_TORCH)
    }
    assert not found, f"{sorted(found)}: " + "must do without torch; else put it into a module of MAY_IMPORT_TORCH"


def too_long(tree: ast.Module) -> set[str]:
    """Names of the functions over MOST_LINES that are no kernels."""
    return {
        node.name
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and (node.end_lineno or 0) - node.lineno + 1 > MOST_LINES
        and not any(KERNEL.match(ast.unparse(decorator)) for decorator in node.decorator_list)
    }


def test_a_function_fits_on_a_screen() -> None:
    found = {f"{module}.{name}" for module, tree in modules().items() for name in too_long(tree)}
    assert not found, f"{sorted(found)}: " + f"over {MOST_LINES} lines; split it into functions with names of their own"


def server_defaults(tree: ast.Module) -> set[str]:
    """What in a module repeats a default of the server: a telling number, or a number that has a parameter's name."""
    names = {name.upper() for name in server_params.DEFAULTS}
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.value in TELLING_DEFAULTS:
            found.add(f"{node.value:g}")
        if isinstance(node, ast.Assign | ast.AnnAssign) and isinstance(node.value, ast.Constant):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            called = {target.id.lstrip("_").upper() for target in targets if isinstance(target, ast.Name)}
            if type(node.value.value) in (int, float):
                found |= called & names
    return found


def test_defaults_of_the_server_stand_in_one_place() -> None:
    found = {
        f"{module}: {what}"
        for module, tree in modules().items()
        if module != "rcss.server_params"
        for what in server_defaults(tree)
    }
    advice = "take it from the match, with rcss.server_params.number or vector; the defaults stand there alone"
    assert not found, f"{sorted(found)}: " + advice


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("import teamclone.logs.scan", {"logs.scan"}),
        ("from teamclone.logs.scan import OK", {"logs.scan"}),
        ("from teamclone.store import open_store, schema", {"store", "store.schema"}),
        ("from teamclone import api", {"api"}),
        ("from teamclone import load", {PACKAGE}),
        ("import teamclone", {PACKAGE}),
        ("from teamclone import __version__", set()),
        ("def later():\n    from teamclone.logs import scan", {"logs.scan"}),
        ("if TYPE_CHECKING:\n    from teamclone.logs import scan", {"logs.scan"}),
        ("import teamclonelike.logs, numpy", set()),
    ],
)
def test_every_kind_of_import_is_seen(source: str, found: set[str]) -> None:
    known = frozenset({PACKAGE, "api", "logs", "logs.scan", "store", "store.schema"})
    assert own_imports("play.runner", ast.parse(source), known) == found


def test_imports_have_full_names() -> None:
    with pytest.raises(AssertionError, match=r"play\.runner, line 2: write the import with its full name"):
        list(imports("play.runner", ast.parse("\nfrom . import record"), frozenset()))


def test_a_function_of_81_lines_is_too_long_unless_numba_compiles_it() -> None:
    body = "    x = 1\n" * 79
    assert too_long(ast.parse(f"def f():\n{body}")) == set()
    assert too_long(ast.parse(f"def f():\n    x = 0\n{body}")) == {"f"}
    assert too_long(ast.parse(f"class C:\n    def f(self):\n        x = 0\n{body.replace('    x', '        x')}")) == {
        "f"
    }
    for decorator in ("njit", "njit(nogil=True)", "kernel", "_kernel", "_helper"):
        assert too_long(ast.parse(f"@{decorator}\ndef f():\n    x = 0\n{body}")) == set()
    for decorator in ("property", "cache", "app.command()"):
        assert too_long(ast.parse(f"@{decorator}\ndef f():\n    x = 0\n{body}")) == {"f"}


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("BALL_DECAY = 0.93", {"BALL_DECAY"}),
        ("_HALF_TIME: float = 300", {"HALF_TIME"}),
        ("def f():\n    tackle_dist = 2.0", {"TACKLE_DIST"}),
        ("x = y * 0.94", {"0.94"}),
        ("STAMINA = capacity / 130600.0", {"130600"}),
        ('"""The ball keeps 0.94 of its speed."""', set()),
        ("ball_decay = number(params, 'ball_decay')", set()),
        ("n = 300", set()),
        ("REAL = True", set()),
    ],
)
def test_a_repeated_default_is_seen(source: str, found: set[str]) -> None:
    assert server_defaults(ast.parse(source)) == found
