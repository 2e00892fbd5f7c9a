"""Commands whose standard streams are closed, or are not UTF-8: what was asked for, or one clear line."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

from hostile import SHORTEST_SHOW

TEAMCLONE = f"'{sys.executable}' -m teamclone"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of teams whose names are in no encoding but Unicode's."""
    path = tmp_path_factory.mktemp("streams") / "x.rcg"
    path.write_bytes(b"ULG5\n" + "(team 1 ☃é 😀 0 0)\n".encode() + SHORTEST_SHOW)
    return path


@pytest.fixture(scope="module")
def store(log: Path) -> Path:
    folder = log.with_name("store")
    assert shell(f"{TEAMCLONE} ingest '{log}' --store '{folder}'").returncode == 0
    return folder


def shell(command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-c", command],
        env=os.environ | environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )


def test_closed_streams(log: Path, store: Path) -> None:
    done = shell(f"{TEAMCLONE} matches --store '{store}' >&-")
    assert (done.returncode, done.stderr) == (0, "")
    done = shell(f"{TEAMCLONE} info '{log}' 2>&-")
    assert done.returncode == 0
    assert "☃é 0 : 0 😀" in done.stdout
    assert shell(f"{TEAMCLONE} info '{log}' <&- >&- 2>&-").returncode == 0
    done = shell(f"{TEAMCLONE} sql - --store '{store}' <&-")
    assert (done.returncode, done.stderr) == (2, "teamclone: expected one SQL statement, got 0\n")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_output_that_is_not_utf_8(log: Path, store: Path, encoding: str) -> None:
    done = shell(f"{TEAMCLONE} info '{log}' | tr -d '\\351'", PYTHONIOENCODING=encoding)
    assert done.stderr == ""
    assert "\\u2603" in done.stdout
    for command in (f"info '{log}' --json", f"sql 'select left_name from matches' --json --store '{store}'"):
        done = shell(f"{TEAMCLONE} {command}", PYTHONIOENCODING=encoding)
        assert "☃é" in str(json.loads(done.stdout))


def test_a_query_that_is_not_utf_8(store: Path) -> None:
    for command in (
        f"sql $'select \\'\\xff\\'' --store '{store}'",
        f"sql - --store '{store}' <<< $'select \\'\\xff\\''",
    ):
        done = shell(f"{TEAMCLONE} {command}")
        assert (done.returncode, done.stderr.count("\n")) == (2, 1)
        assert "expected a query in UTF-8" in done.stderr


def test_csv_shows_control_characters_on_a_terminal_and_gives_them_to_a_program(store: Path) -> None:
    command = [sys.executable, "-m", "teamclone", "sql", "select chr(27) || 'x' as a", "--csv", "--store", str(store)]
    assert subprocess.run(command, capture_output=True, check=True).stdout == b"a\n\x1bx\n"
    ours, theirs = pty.openpty()
    subprocess.run(command, stdout=theirs, check=True)
    os.close(theirs)
    shown = os.read(ours, 1000)
    os.close(ours)
    assert shown.split() == [b"a", b"\\u001bx"]
