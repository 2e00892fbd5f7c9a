"""Where the real logs lie that the tests read, and a real database server."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from postgres import Server, start_server

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


@pytest.fixture(scope="session")
def postgres() -> Iterator[Server]:
    """A running PostgreSQL server."""
    server = start_server()
    yield server
    server.throw_away()


def pytest_configure() -> None:
    # What tests write need not outlive the machine, and a busy disk takes tenths of a second to say that it would.
    os.fsync = lambda handle: None
    # The workers of a run share the processors, and threads of PyTorch that wait for each other keep them busy.
    os.environ["OMP_NUM_THREADS"] = "1"
    # Of the stand-in for rcssserver, see tests/standin: the interpreter that starts quickest.
    os.environ["STANDIN_PYTHON"] = sys.executable
    # A shell that starts the tests in the background has them ignore Ctrl-C, and so every command that they start.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--kills", type=int, default=2, help="how often tests kill a command at random moments")


@pytest.fixture(scope="session")
def kills(request: pytest.FixtureRequest) -> int:
    return int(request.config.getoption("--kills"))
