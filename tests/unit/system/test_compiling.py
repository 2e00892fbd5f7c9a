"""Kernels are kept on disk where there is a place for them, as long as their sources stay the same."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from teamclone.system.compiling import version_of

SCRIPT = """
import numba.core.caching as caching

class Nowhere(caching._CacheLocator):
    @classmethod
    def from_function(cls, function, file):
        return None

caching.CacheImpl._locator_classes = [Nowhere]
import io
from teamclone.logs import read_match
import teamclone.logs.scan as scan
from hostile import SHORTEST_SHOW
print(len(read_match(io.BytesIO(b"ULG5\\n" + SHORTEST_SHOW)).frames["cycle"]))
"""
"""A process in which Numba finds no folder that it may write."""


def test_without_a_place_for_compiled_code_all_works_and_says_so_once() -> None:
    paths = [str(Path(__file__).parents[2]), *sys.path]
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "1\n"), done.stderr
    (line,) = done.stderr.splitlines()
    assert "set NUMBA_CACHE_DIR to a folder that can be written" in line


def test_the_version_changes_with_every_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "kernels_for_a_test"
    package.mkdir()
    (package / "__init__.py").write_text("", encoding="utf-8")
    (package / "one.py").write_text("A = 1\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    whole, one = (importlib.import_module(name) for name in (package.name, f"{package.name}.one"))
    seen = {(version_of(whole), version_of(one), version_of(whole, one))}
    (package / "one.py").write_text("A = 2\n", encoding="utf-8")
    seen.add((version_of(whole), version_of(one), version_of(whole, one)))
    assert [len(set(column)) for column in zip(*seen, strict=True)] == [2, 2, 2]
    before = version_of(one)
    (package / "two.py").write_text("B = 1\n", encoding="utf-8")
    assert version_of(one) == before
    assert version_of(whole) not in {each[0] for each in seen}
    for name in [name for name in sys.modules if name.startswith(package.name)]:
        del sys.modules[name]
