"""The public names."""

from __future__ import annotations

import subprocess
import sys

import pytest

import teamclone


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = (
        "import sys, time; began = time.perf_counter(); import teamclone; seconds = time.perf_counter() - began; "
        "print(seconds, *({'torch', 'numba', 'duckdb', 'numpy', 'pyarrow'} & set(sys.modules)))"
    )
    seconds, *heavy = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert heavy == []
    assert float(seconds) < 1


@pytest.mark.parametrize("name", teamclone.__all__)
def test_a_public_name_is_there_and_has_a_docstring(name: str) -> None:
    assert getattr(teamclone, name).__doc__
    assert name in dir(teamclone)


def test_an_unknown_name() -> None:
    with pytest.raises(AttributeError, match="no attribute 'lode'"):
        teamclone.lode  # noqa: B018
