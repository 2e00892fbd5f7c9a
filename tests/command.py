"""The installed `teamclone` command, as a user runs it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

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
