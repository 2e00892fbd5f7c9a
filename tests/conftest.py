"""Where the real logs lie that the tests read."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SAMPLES = ROOT / "samples"
FIXTURES = ROOT / "tests" / "data" / "fixtures"


@pytest.fixture(scope="session")
def samples_dir() -> Path:
    """Six real matches of 2 x 1000 cycles, see its README.md."""
    return SAMPLES


@pytest.fixture(scope="session")
def fixtures_dir() -> Path:
    """Small odd matches, a folder each, see its README.md."""
    return FIXTURES
