"""Every command has a page that names every option, and the README's commands are the demo's."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import typer.main

from teamclone.cli.app import app

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = {
    name: command
    for name, command in typer.main.get_command(app).commands.items()  # type: ignore[attr-defined]
    if not command.hidden
}


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_a_command_has_a_page_that_names_every_option(name: str) -> None:
    page = (ROOT / "docs" / f"{name}.md").read_text()
    command: Any = COMMANDS[name]
    missing = [
        option
        for parameter in command.params
        for option in parameter.opts
        if option.startswith("--") and option != "--help"
    ]
    assert [option for option in missing if f"`{option}" not in page and f" {option}" not in page] == []


def test_the_readme_links_every_page() -> None:
    readme = (ROOT / "README.md").read_text()
    pages = {path.name for path in (ROOT / "docs").glob("*.md")}
    assert pages - set(re.findall(r"docs/([\w-]+\.md)", readme)) == set()


def test_every_link_of_the_docs_leads_somewhere() -> None:
    for page in (*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")):
        for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text()):
            if not target.startswith("http"):
                assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_commands_of_the_readme_are_those_of_the_demo() -> None:
    """What the README tells to type is what `make demo` runs, so it works."""
    readme = (ROOT / "README.md").read_text()
    blocks = "\n".join(re.findall(r"```sh\n(.*?)```", readme, re.DOTALL))
    typed = {" ".join(line.split()[:2]) for line in blocks.splitlines() if line.startswith("teamclone ")}
    demo = (ROOT / "Makefile").read_text().partition("\ndemo: ")[2].partition("\n\n")[0]
    run = {f"teamclone {verb}" for verb in re.findall(r"/teamclone (\w+)", demo)}
    assert run <= typed
    assert {line.split()[1] for line in typed} <= set(COMMANDS)
