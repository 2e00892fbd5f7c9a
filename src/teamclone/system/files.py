"""Writing a file in one step, naming content by its hash, holding a file or folder against other processes."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def write_atomic(path: Path, data: bytes) -> None:
    """Write a file so that a reader, also after a crash, sees the old one or the new one.

    One process at a time may write a path; the next one removes the remains of a killed one.
    """
    temporary = path.with_name(f".{path.name}.part")
    # What has this name, in a folder that may be somebody else's, may be a link to anywhere.
    temporary.unlink(missing_ok=True)
    try:
        with temporary.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def digest(data: bytes) -> str:
    """Return 16 hex digits that stand for the content."""
    return hashlib.blake2b(data, digest_size=8).hexdigest()


@contextmanager
def held(path: Path, *, busy: Exception | None = None) -> Iterator[None]:
    """Lock a file or folder for this process; the system lets go of it when the process ends, however it ends.

    Raises:
        BlockingIOError: another process holds it; ``busy`` instead, where it is given.
    """
    # Over NFS only a file that may be written can be locked.
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        try:
            lock(handle)
        except BlockingIOError as error:
            raise busy or error from None
        yield
    finally:
        os.close(handle)


def lock(handle: int) -> None:
    """Lock an open file or folder until it is closed.

    Raises:
        BlockingIOError: another process holds it.
    """
    if sys.platform != "win32":
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
