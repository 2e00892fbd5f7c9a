from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

from teamclone.system.compiling import version_of


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
