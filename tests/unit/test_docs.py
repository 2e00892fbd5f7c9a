"""Every command has a page that names every option, every page is in the menu, and links lead somewhere."""

from __future__ import annotations

import importlib
import re
import shlex
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import typer.main

import teamclone
from teamclone.cli.app import app
from teamclone.training.config import setting_names

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"


def _commands(group: Any, before: str = "") -> dict[str, Any]:
    """Every command by its words: `live watch`."""
    found: dict[str, Any] = {}
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            found |= _commands(command, f"{before}{name} ")
        elif not command.hidden:
            found[f"{before}{name}"] = command
    return found


COMMANDS = _commands(typer.main.get_command(app))


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_a_command_has_a_page_that_names_every_option(name: str) -> None:
    page = (DOCS / "reference" / "commands" / f"{name.replace(' ', '-')}.md").read_text()
    command: Any = COMMANDS[name]
    options = [
        option
        for parameter in command.params
        for option in parameter.opts
        if option.startswith("--") and option != "--help"
    ]
    assert options
    assert [option for option in options if f"`{option}`" not in page] == []


def test_every_command_page_is_of_a_command() -> None:
    assert {page.stem for page in (DOCS / "reference" / "commands").glob("*.md")} == {
        name.replace(" ", "-") for name in COMMANDS
    }


def test_the_menu_lists_every_page_once() -> None:
    listed = re.findall(r": ([\w/-]+\.(?:md|ipynb))$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE)
    pages = (*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb"))
    assert sorted(listed) == sorted(str(page.relative_to(DOCS)) for page in pages)


def test_every_link_leads_somewhere() -> None:
    """Files and headings, as GitHub and the site both name them."""
    for page in (*ROOT.glob("*.md"), *DOCS.rglob("*.md")):
        for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)]*))?\)", page.read_text()):
            if target.startswith("http"):
                continue
            found = page.parent / target if target else page
            assert found.exists(), f"{page.name}: {target}"
            assert not anchor or anchor in anchors(found), f"{page.name}: {target}#{anchor}"


def anchors(page: Path) -> set[str]:
    """Names of the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_links_inside_the_docs_stay_there() -> None:
    """The site holds nothing else."""
    for page in DOCS.rglob("*.md"):
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text()):
            assert target.startswith("http") or (page.parent / target).resolve().is_relative_to(DOCS), page


def test_pages_speak_of_players_without_gender() -> None:
    for page in (ROOT / "README.md", *DOCS.rglob("*.md")):
        assert re.findall(r"\b(he|him|his)\b", page.read_text(), re.IGNORECASE) == [], page


def test_the_commands_of_the_readme_are_those_of_the_demo() -> None:
    """What the README asks to type is what `make demo` runs, so it works."""
    readme = (ROOT / "README.md").read_text()
    blocks = "\n".join(re.findall(r"```sh\n(.*?)```", readme, re.DOTALL))
    typed = {_parted(line.split()[1:])[0] for line in blocks.splitlines() if line.startswith("teamclone ")}
    demo = (ROOT / "Makefile").read_text().partition("\ndemo: ")[2].partition("\n\n")[0]
    assert set(re.findall(r"/teamclone (\w+)", demo)) <= typed <= set(COMMANDS)


def typed() -> list[tuple[str, list[str]]]:
    """Every `teamclone` command in a block of the README and the pages: the page, and its words."""
    found = []
    for page in (ROOT / "README.md", *DOCS.rglob("*.md")):
        for block in re.findall(r"^```(?:sh|console|)\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE):
            lines = re.sub(r"\\\n", " ", block)
            # A quoted argument may go over several lines.
            commands = re.findall(r"^(?:\$ )?teamclone ((?:[^\n\"']|\"[^\"]*\"|'[^']*')*)", lines, re.MULTILINE)
            found += [(page.name, _parted(shlex.split(command, comments=True))) for command in commands]
    return found


def _parted(words: list[str]) -> list[str]:
    """The words of a command line, those that name the command as one."""
    name = " ".join(words[:2])
    return [name, *words[2:]] if name in COMMANDS else words


def test_commands_in_the_pages_have_these_options() -> None:
    assert len(typed()) > 50
    for page, (name, *words) in typed():
        assert name in COMMANDS, f"{page}: teamclone {name}"
        known = {option for parameter in COMMANDS[name].params for option in parameter.opts} | {"--help"}
        options = [word for word in words if re.fullmatch(r"--?[a-z][a-z-]*", word)]
        assert [option for option in options if option not in known] == [], f"{page}: teamclone {name}"


def test_settings_in_the_pages_are_settings() -> None:
    """Of `--set`, and wherever a page names one."""
    known = setting_names()
    for page, (name, *words) in typed():
        if name in ("train", "adapt", "search"):
            given = [after.partition("=")[0] for word, after in pairwise(words) if word == "--set"]
            assert [key for key in given if key not in known] == [], f"{page}: teamclone {name}"
    for path in DOCS.rglob("*.md"):
        named = re.findall(r"`((?:model|data|train)\.[a-z_]+)(?: = [^`]*)?`", path.read_text())
        assert [key for key in named if key not in known] == [], path.name


def test_imports_in_the_pages_are_there() -> None:
    for path in (ROOT / "README.md", *DOCS.rglob("*.md")):
        for block in re.findall(r"```python\n(.*?)```", path.read_text(), re.DOTALL):
            for module, names in re.findall(r"^from (teamclone[\w.]*) import (.*)$", block, re.MULTILINE):
                found = importlib.import_module(module)
                assert [name for name in names.split(", ") if not hasattr(found, name)] == [], f"{path.name}: {module}"


def test_public_names_in_the_pages_are_there() -> None:
    for path in (ROOT / "README.md", *DOCS.rglob("*.md")):
        for block in re.findall(r"```python\n(.*?)```", path.read_text(), re.DOTALL):
            assert set(re.findall(r"\btc\.(\w+)", block)) <= set(teamclone.__all__), path.name
