"""The stores and matches that the tests of this folder share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from postgres import Server
from teamclone.logs import Match, read_match
from teamclone.store import Store, create_store

MakeStore = Callable[[], Store]


@pytest.fixture(params=["parquet", "postgresql"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Store]:
    """An empty store of every back end: what is tested with it is the contract of ``Store``."""
    if request.param == "parquet":
        yield create_store(tmp_path / "store")
        return
    server: Server = request.getfixturevalue("postgres")
    url = server.new_url()
    yield create_store(url)
    server.drop(url)


def only_log(folder: Path, suffix: str) -> Path:
    """The one log of this kind in a folder."""
    (path,) = folder.glob(f"*.{suffix}.gz")
    return path


@pytest.fixture(scope="session")
def match(fixtures_dir: Path) -> Match:
    """A real match of 2 x 100 cycles, text version 6, both logs."""
    return read_match(only_log(fixtures_dir / "v6", "rcg"))


@pytest.fixture(
    scope="session", params=["v6", "native-v1", "native-v3", "json", "nan", "onesided", "killed", "penalties"]
)
def any_match(request: pytest.FixtureRequest, fixtures_dir: Path) -> Match:
    """Real matches of every kind of log, whole and not."""
    return read_match(only_log(fixtures_dir / request.param, "rcg"))
