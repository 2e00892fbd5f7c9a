"""Processes of a match: started so that none outlives it, whatever they do and however its supervisor ends.

On Linux the supervisor adopts the orphans of its children, daemons included, and its children die with it. Elsewhere an
orphan is out of reach once its parent is gone.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import psutil

MARK = "TEAMCLONE_MATCH"
"""Environment variable that all processes of a match carry: the folder it is played in."""

GRACE_S = 3.0
"""From the request to end to the end."""

GIVE_UP_S = 10.0
"""From the end of the grace until one does without those that cannot be killed, stuck in the system."""

_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None


def adopt_orphans() -> None:
    """Become the parent of all orphans of processes started from here."""
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def start(words: Sequence[str], *, folder: Path, environment: Mapping[str, str], output: Path) -> psutil.Popen:
    """Start a process in a session of its own, with its output in a file. To be called from a single thread.

    Raises:
        OSError: it cannot be started.
    """
    with output.open("ab") as file:
        return psutil.Popen(
            list(words),
            cwd=folder,
            env={**os.environ, **environment},
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            preexec_fn=_die_with_parent,
        )


def _die_with_parent() -> None:
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


def end_all(*, grace_s: float = GRACE_S) -> None:
    """End all processes that were started from this one or adopted; kill those that do not end in time."""
    deadline = time.monotonic() + grace_s
    give_up = deadline + GIVE_UP_S
    left = _descendants()
    for process in left:
        with suppress(psutil.NoSuchProcess):
            process.terminate()
    while left and time.monotonic() < give_up:
        left = psutil.wait_procs(left, timeout=max(0.0, deadline - time.monotonic()))[1]
        for process in left:
            with suppress(psutil.NoSuchProcess):
                process.kill()
        # The killed may have had children of their own, which are ours now.
        left = _descendants()
        deadline = time.monotonic() + 0.5


def _descendants() -> list[psutil.Process]:
    """Find the processes that descend from this one and live; the dead among them are reaped."""
    found = psutil.Process().children(recursive=True)
    alive = []
    for process in found:
        with suppress(psutil.NoSuchProcess):
            if process.status() != psutil.STATUS_ZOMBIE:
                alive.append(process)
            elif process.ppid() == os.getpid():
                with suppress(psutil.TimeoutExpired):
                    process.wait(0)
    return alive


def kill_marked(folder: Path) -> None:
    """Kill the processes of matches played in or under a folder whose supervisor is gone."""
    folder, killed = folder.resolve(), []
    for process in psutil.process_iter():
        with suppress(psutil.Error, OSError):
            mark = process.environ().get(MARK)
            if mark and Path(mark).resolve().is_relative_to(folder):
                process.kill()
                killed.append(process)
    psutil.wait_procs(killed, timeout=GRACE_S)
