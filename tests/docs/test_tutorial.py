"""The tutorial's commands run in their order and print what the page shows."""

from __future__ import annotations

import ast
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from command import called

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
STEPS = [
    (command.removeprefix("$ teamclone "), shown)
    for block in re.findall(r"```console\n(.*?)```", PAGE, re.DOTALL)
    for command, _, shown in [block.partition("\n")]
]


def fits(shown: str, printed: str) -> bool:
    """Whether a command printed what the page shows.

    Blank lines and the width of gaps do not count. `...` stands for any text, and alone on a line for any lines.
    """
    wanted = [" ".join(line.split()) for line in shown.splitlines() if line.strip()]
    given = [" ".join(line.split()) for line in printed.splitlines() if line.strip()]
    pattern = "".join(
        "(?:.*\n)*?" if line == "..." else f"{'.*'.join(map(re.escape, line.split('...')))}\n" for line in wanted
    )
    return re.fullmatch(pattern, "".join(f"{line}\n" for line in given)) is not None


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("a  1\n", "a 1\n\n", True),
        ("a 1\n", "a 2\n", False),
        ("took ... s\n", "took 1.5 s\n", True),
        ("took ... s\n", "took 1.5 min\n", False),
        ("a\n...\nz\n", "a\nb\nc\nz\n", True),
        ("a\n...\nz\n", "a\nz\n", True),
        ("a\nz\n", "a\nb\nz\n", False),
        ("a\n", "a\nb\n", False),
    ],
)
def test_the_comparison_itself(shown: str, printed: str, same: bool) -> None:
    assert fits(shown, printed) is same


@pytest.mark.slow
def test_every_command_prints_what_the_page_shows(tmp_path: Path) -> None:
    (tmp_path / "samples").symlink_to(ROOT / "samples")
    assert [command.split()[0] for command, _ in STEPS] == [
        "info", "ingest", "matches", "sql", "dataset", "train", "evaluate", "report",
    ]  # fmt: skip
    for command, shown in STEPS:
        printed = called(*shlex.split(command), cwd=tmp_path).stdout
        assert fits(shown, printed), f"teamclone {command}\n--- the page shows\n{shown}\n--- printed\n{printed}"
    assert (tmp_path / "run" / "report.html").is_file()
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rows, columns = done.stdout.split(" ", 1)
    assert int(rows) > 10_000
    assert {"cycle", "unum", "p_dash"} <= set(ast.literal_eval(columns))


def test_the_better_clone_is_that_of_the_demo() -> None:
    (training,) = re.findall(r"teamclone (train dataset .*) --out better", PAGE)
    assert training.replace("dataset", "$(DEMO)/dataset", 1) in (ROOT / "Makefile").read_text(encoding="utf-8")
