"""The pages on training and on the run folder name everything that there is."""

from __future__ import annotations

import re
from contextlib import chdir
from pathlib import Path

import pytest
from tests.synthetic import make_dataset

from teamclone.training.config import preset_names
from teamclone.training.run import BEST, open_run

REFERENCE = Path(__file__).parents[2] / "docs" / "reference"
PAGE = (REFERENCE / "commands" / "train.md").read_text(encoding="utf-8")
FORMATS = (REFERENCE / "formats.md").read_text(encoding="utf-8")


def test_every_preset_and_checkpoint_is_documented() -> None:
    for name in preset_names():
        assert f"`{name}`" in PAGE
    for name in BEST:
        stem, _, command = name.rpartition("-")
        assert f"checkpoints/{name}.safetensors" in FORMATS or (stem == "best-recall" and f"`{command}`" in FORMATS)


def test_the_example_runs_and_every_figure_is_documented(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_dataset(tmp_path / "DS", frames_per_match=20)
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict[str, object] = {}
    with chdir(tmp_path):
        exec(compile(code, "docs/reference/commands/train.md", "exec"), names)
    assert 0 <= float(capsys.readouterr().out) <= 1
    for key in open_run(tmp_path / "RUN").history()[-1]:
        figure = key.removeprefix("train_").removeprefix("validation_")
        assert f"`{figure}`" in FORMATS, key
