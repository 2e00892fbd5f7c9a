"""The page on logs is true: its code runs, its tables are complete."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from teamclone.logs import Match

ROOT = Path(__file__).resolve().parents[3]
PAGE = (ROOT / "docs" / "reference" / "logs.md").read_text()


def test_the_code_runs(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.chdir(ROOT)
    names: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
        exec(compile(block, "docs/reference/logs.md", "exec"), names)
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "HELIOS_base 8 - 0 WEBase"
    assert printed[-1] == "b'ULG5'"
    share = next(float(line.split()[0]) for line in printed if " of " in line)
    assert share > 0.999


def table(heading: str) -> set[str]:
    section = PAGE.split(f"## {heading}\n")[1].split("\n## ")[0]
    return {
        row.split("`")[1].strip('"')
        for row in section.splitlines()
        if row.startswith("| `") and "." not in row.split("`")[1]
    }


def test_each_problem_is_in_the_table():
    package = ROOT / "src" / "teamclone"
    source = "".join(path.read_text() for path in (*(package / "logs").glob("*.py"), package / "store/convert.py"))
    codes = set(re.findall(r'code="([a-z-]+)"', source)) | set(re.findall(r'warn\("([a-z-]+)"', source))
    codes |= set(re.findall(r'code="[a-z-]+" if \w+ else "([a-z-]+)"', source))
    assert codes == table("Problems")


def test_each_format_is_in_the_table(match_of: Callable[[str], Match]):
    names = ("native-v1", "native-v2", "native-v3", "native-v4", "native-v5", "v6", "json")
    assert {match_of(name).game.log_version for name in names} | {"json-17", "json-18"} == table("Formats")
