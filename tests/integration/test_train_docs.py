"""docs/train.md says what there is."""

from __future__ import annotations

import re
from contextlib import chdir
from pathlib import Path

import pytest
from tests.synthetic import make_dataset

from teamclone.training.config import Config, preset_names, to_table
from teamclone.training.run import BEST, open_run

PAGE = (Path(__file__).parents[2] / "docs" / "train.md").read_text(encoding="utf-8")


def rows(heading: str) -> dict[str, str]:
    """First column to second column of the table under a heading."""
    part = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return dict(re.findall(r"^\| `([^`]+)` \| ([^|]*) \|", part, re.MULTILINE))


def test_every_setting_is_listed_with_its_default() -> None:
    listed = rows("Settings")
    table = {
        f"{section}.{key}": value for section, values in to_table(Config()).items() for key, value in values.items()
    }
    assert list(listed) == list(table)
    for key, value in table.items():
        text = {True: "true", False: "false"}.get(value, value) if isinstance(value, bool) else value
        written = listed[key].strip("`").strip('"')
        assert written == str(text) or float(written) == value, key


def test_every_preset_and_checkpoint_is_told() -> None:
    for name in preset_names():
        assert f"`{name}`" in PAGE
    for name in BEST:
        stem, _, command = name.rpartition("-")
        assert f"checkpoints/{name}.safetensors" in PAGE or (stem == "best-recall" and f"`{command}`" in PAGE)


def test_the_example_runs_and_every_figure_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_dataset(tmp_path / "DS", frames_per_match=20)
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict[str, object] = {}
    with chdir(tmp_path):
        exec(compile(code, "docs/train.md", "exec"), names)
    assert 0 <= float(capsys.readouterr().out) <= 1
    for key in open_run(tmp_path / "RUN").history()[-1]:
        figure = key.removeprefix("train_").removeprefix("validation_")
        assert f"`{figure}`" in PAGE, key
