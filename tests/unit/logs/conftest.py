"""Matches of the fixture folders, each read once."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from teamclone.logs import Match, read_match


@pytest.fixture(scope="session")
def rcg_of(fixtures_dir: Path) -> Callable[[str], Path]:
    """The game log of a fixture folder, or the one named inside ``converted``: ``converted/3``."""

    def find(name: str) -> Path:
        (path,) = fixtures_dir.glob(f"{name}.rcg.gz" if "/" in name else f"{name}/*.rcg.gz")
        return path

    return find


@pytest.fixture(scope="session")
def match_of(rcg_of: Callable[[str], Path]) -> Callable[[str], Match]:
    """The match of a fixture folder. Shared between tests: not to be changed."""

    @cache
    def read(name: str) -> Match:
        return read_match(rcg_of(name))

    return read
