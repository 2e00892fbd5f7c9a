"""Ports for one server: three free ones in a row, held against the other matches of this machine."""

from __future__ import annotations

import os
import socket
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from teamclone.errors import PlayError
from teamclone.system.files import lock

DEFAULT_PORT = 6000
"""The server's default port for players; the trainer's is the next, the online coaches' the one after."""
STEP = 10
LAST_PORT = 32_000
"""Ports above it are those that the system gives to clients, also to ours."""


@contextmanager
def held_ports(*, any_block: bool) -> Iterator[int | None]:
    """Hold a block of ports that is free, against other matches: its first port, None where no block is free.

    Args:
        any_block: False for teams that can have no port but the default, which is left to them.

    Raises:
        BlockingIOError: another match has the default port, and will give it back.
        PlayError: see `open_locks`.
    """
    with ExitStack() as stack:
        folder = open_locks()
        stack.callback(os.close, folder)
        for port in range(DEFAULT_PORT + STEP, LAST_PORT, STEP) if any_block else (DEFAULT_PORT,):
            try:
                handle = os.open(str(port), os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600, dir_fd=folder)
            except OSError:  # a link, perhaps
                continue
            stack.callback(os.close, handle)
            try:
                lock(handle)
            except BlockingIOError:
                if not any_block:
                    raise
                continue
            if all(is_free(port + offset) for offset in range(3)):
                yield port
                return
        yield None


def default_is_held() -> bool:
    """Return whether another match has the default port.

    Raises:
        PlayError: see `open_locks`.
    """
    try:
        with held_ports(any_block=False):
            return False
    except BlockingIOError:
        return True


def open_locks() -> int:
    """Open the folder of the locks, one for all matches of a user on this machine; return its descriptor.

    It is in the folder for temporary files, where anybody may have made one of its name first and filled it with links.

    Raises:
        PlayError: it belongs to another user, or is no folder.
    """
    path = Path(tempfile.gettempdir()) / f"teamclone-ports-{os.getuid()}"
    with suppress(FileExistsError):
        path.mkdir(mode=0o700)
    try:
        folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError as error:
        reason = error.strerror or str(error)
    else:
        if os.fstat(folder).st_uid == os.getuid():
            os.fchmod(folder, 0o700)
            return folder
        os.close(folder)
        reason = "one of another user"
    raise PlayError(
        f"{path}: expected a folder of your own, for the ports in use, got: {reason}; remove it, or set TMPDIR to a "
        "folder that only you can write"
    )


def is_free(port: int) -> bool:
    """Return whether no process listens at this UDP port, on any address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as test:
        try:
            test.bind(("", port))
        except OSError:
            return False
    return True
