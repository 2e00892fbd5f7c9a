"""Ports for one server: three free ones in a row, held against the other matches of this machine."""

from __future__ import annotations

import getpass
import socket
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from teamclone.system.files import held

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
    """
    folder = Path(tempfile.gettempdir()) / f"teamclone-ports-{getpass.getuser()}"
    folder.mkdir(exist_ok=True)
    with ExitStack() as stack:
        for port in range(DEFAULT_PORT + STEP, LAST_PORT, STEP) if any_block else (DEFAULT_PORT,):
            lock = folder / str(port)
            lock.touch()
            try:
                stack.enter_context(held(lock))
            except BlockingIOError:
                if not any_block:
                    raise
                continue
            if all(is_free(port + offset) for offset in range(3)):
                yield port
                return
        yield None


def is_free(port: int) -> bool:
    """Return whether no process listens at this UDP port, on any address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as test:
        try:
            test.bind(("", port))
        except OSError:
            return False
    return True
