"""Programs of C++ with a header of the package: compiled where there is a compiler, and run."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

SOURCES = Path(__file__).resolve().parent / "data" / "cpp"
FLAGS = ("-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off", "-fno-exceptions", "-fno-rtti")
"""What the header has to compile with. Contraction would round once where Python rounds twice."""
QUICK = ("-O2",)
CHECKED = ("-O0", "-DTEAMCLONE_CHECKED", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
"""Ends the program at once where it reads or writes outside of an array, or does what C++ leaves undefined.

Without optimisation, which removes some of that, and which takes longer than all that the tests run.
"""


def compiled(
    folder: Path,
    header: str,
    name: str,
    *,
    source: Path | None = None,
    compiler: str = "g++",
    flags: tuple[str, ...] = QUICK,
) -> Path:
    """Return the program that a file, by default one of tests/data/cpp, makes with a header.

    Skips where there is no such compiler.
    """
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}: the header is not compiled")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "teamclone.hpp").write_text(header, encoding="utf-8")
    program = folder / name
    command = [compiler, *FLAGS, *flags, "-I", str(folder), "-I", str(SOURCES), str(source or SOURCES / f"{name}.cpp")]
    done = subprocess.run([*command, "-o", str(program)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:4000]
    return program


def run(program: Path, *arguments: str) -> None:
    """Run a program, which has to end well."""
    done = subprocess.run([str(program), *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:4000]
