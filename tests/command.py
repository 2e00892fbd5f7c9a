"""The `teamclone` command: the installed one as a user runs it, and the same in this process, without its imports."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from unittest.mock import patch

from teamclone.cli import main

TEAMCLONE = Path(sys.executable).with_name("teamclone")


def teamclone(
    *args: object, code: int = 0, cwd: Path | None = None, seconds: float = 1000
) -> subprocess.CompletedProcess[str]:
    """Runs a command and checks its exit code; what went wrong never comes as a traceback."""
    done = subprocess.run(
        [TEAMCLONE, *map(str, args)], capture_output=True, text=True, cwd=cwd, timeout=seconds, check=False
    )
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode == code, f"exit code {done.returncode}, expected {code}\n{done.stdout}\n{done.stderr}"
    return done


@contextmanager
def signals_kept() -> Iterator[None]:
    kept = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)


def called(*args: object, code: int = 0, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Runs a command in this process, which saves seconds of imports; an error that it does not catch is raised."""
    words = ["teamclone", *map(str, args)]
    out, err, got = StringIO(), StringIO(), 0
    with (
        patch.object(sys, "argv", words),
        chdir(cwd or Path.cwd()),
        redirect_stdout(out),
        redirect_stderr(err),
        signals_kept(),
    ):
        try:
            main()
        except SystemExit as end:
            got = int(end.code or 0)
    assert got == code, f"exit code {got}, expected {code}\n{out.getvalue()}\n{err.getvalue()}"
    return subprocess.CompletedProcess(words, got, out.getvalue(), err.getvalue())
