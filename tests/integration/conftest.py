"""What tests of matches that are played have in common."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from playing import strays


@pytest.fixture
def nothing_stays(tmp_path: Path) -> Iterator[None]:
    """Whatever happens in a test, no process of its matches outlives it."""
    yield
    assert strays(tmp_path) == []
