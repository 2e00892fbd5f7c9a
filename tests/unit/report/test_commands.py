"""The commands that a report prints are commands that `teamclone` takes."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import pytest

from teamclone.report.page import commands


@pytest.mark.parametrize("goalkeepers", [True, False])
def test_flags_stand_without_a_value_and_only_where_they_are_set(goalkeepers: bool) -> None:
    options: dict[str, Any] = {
        "team": "A B",
        "unseen": ["C"],
        "split": "match",
        "train_goalkeepers": goalkeepers,
        "test_matches": ["20261122110359"],
        "validation_matches": [],
        "test": 0.15,
    }
    evaluation = {
        "dataset": {"options": options, "teams": ["A B"], "own": True, "path": "DS"},
        "run": {"base": None, "path": "RUN", "checkpoint": "best-loss"},
    }
    printed = commands(evaluation, trained_on=Path("DS"))[1].replace("\\\n", " ")
    words = shlex.split(printed)
    expected = ["teamclone", "dataset", "--store", "STORE", "--team", "A B", "--unseen", "C", "--split", "match"]
    expected += ["--train-goalkeepers"] if goalkeepers else []
    assert words == [*expected, "--test-match", "20261122110359", "--test", "0.15", "--out", "DS"]


def test_what_is_no_option_is_not_to_be_copied() -> None:
    """A run may be somebody else's: its names reach no shell unquoted."""
    evil = "x; rm -rf $HOME"
    evaluation = {
        "dataset": {"options": {"team": "A", evil: "1", f"{evil} #": True, "seed": evil}, "teams": [evil], "own": True}
        | {"path": evil},
        "run": {"base": None, "path": evil, "checkpoint": evil},
    }
    for line in commands(evaluation, trained_on=Path(evil)):
        words = shlex.split(line.replace("\\\n", " "), comments=True)
        assert "rm" not in words
