"""What tests of whole commands have in common."""

from __future__ import annotations

from collections.abc import Iterator
from multiprocessing import forkserver
from pathlib import Path

import pytest

from playing import strays


@pytest.fixture(scope="session", autouse=True)
def imported_once() -> None:
    """The server from which the processes of commands are forked has imported what any of them needs."""
    forkserver.set_forkserver_preload(["teamclone.search.worker", "teamclone.store.ingest", "torch._dynamo"])
    forkserver.ensure_running()


@pytest.fixture
def nothing_stays(tmp_path: Path) -> Iterator[None]:
    """Whatever happens in a test, no process of its matches outlives it."""
    yield
    assert strays(tmp_path) == []
