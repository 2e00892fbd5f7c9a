"""rcssserver: its path, its version, its command line."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from teamclone.errors import PlayError
from teamclone.play.schedule import CYCLES_PER_S, Fixture, ServerSpec, option_words

MAX_PROGRAMS = 64
"""Programs of a team of which hashes are kept, at most."""

_VERSION = re.compile(r"rcssserver-([\w.]+)")
_SEED = re.compile(r"Simulator Random Seed: (-?\d+)")
_PLAYER = re.compile(r"^A new \(v[\d.]+\) player \(", re.MULTILINE)
_COACH = re.compile(r"^A new \(v[\d.]+\) online coach \((\S+)\) connected", re.MULTILINE)
_MISSED = "Someone missed a cycle"
_GAVE_UP = "Waiting too long for clients"
_NO_SOCKET = "Error initializing sockets"


def find_server(server: ServerSpec) -> Path:
    """Find the server's program.

    Raises:
        PlayError: there is none.
    """
    found = shutil.which(server.command)
    if found is None:
        raise PlayError(
            f"{server.command}: no such program on the PATH; install rcssserver (https://rcsoccersim.github.io), or "
            "name it with --server or [server] command"
        )
    return Path(found).absolute()


def server_words(program: Path, fixture: Fixture, *, port: int) -> list[str]:
    """Return the command that starts the server of a match; its logs go where it is started."""
    wait = int(2 * CYCLES_PER_S * fixture.limits.connect_s) + 400  # we give up before the server does
    ours: dict[str, Any] = {
        "server::port": port,
        "server::coach_port": port + 1,
        "server::olcoach_port": port + 2,
        "server::auto_mode": True,
        "server::connect_wait": wait,
        # Of a longer path the server's parser may not take every letter.
        "server::game_log_dir": ".",
        "server::text_log_dir": ".",
        "player::random_seed": fixture.seed,
    }
    return [str(program), *option_words(fixture.server.options | ours)]


def server_environment(folder: Path) -> dict[str, str]:
    """Return variables that keep the user's own settings, in the home folder or by variable, out of a match."""
    return {"RCSS_CONF_DIR": str(folder), "HOME": str(folder)}


def server_report(output: str) -> dict[str, Any]:
    """Read a server's output: version, seed of the game, cycles that it waited for clients in vain."""
    version, seed = _VERSION.search(output), _SEED.search(output)
    return {
        "version": version and version[1],
        "random_seed": seed and int(seed[1]),
        "missed_cycles": output.count(_MISSED),
    }


def coach_connected(output: str, name: str | None) -> bool | None:
    """Return whether the online coach of a team has ever connected; None for servers that do not report connections.

    Args:
        name: of the team, as its players gave it to the server; None where none has come.
    """
    if not _PLAYER.search(output):
        return None
    return name in _COACH.findall(output)


def gave_up(output: str) -> bool:
    """Return whether the server stopped because clients did not answer."""
    return _GAVE_UP in output


def met_taken_port(output: str) -> bool:
    """Return whether the server could not open its ports."""
    return _NO_SOCKET in output


def last_words(output: str) -> str:
    """Return the last line that mentions an error, else the last line that is not empty."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    errors = [line for line in lines if re.search(r"\berror\b", line, re.IGNORECASE)]
    return (errors or lines or ["it printed nothing"])[-1][:200]


def hashes(paths: Iterable[Path]) -> dict[str, str]:
    """Return the SHA-256 of files that can be read, by their path."""
    found = {}
    for path in sorted(set(paths)):
        with suppress(OSError), path.open("rb") as file:
            found[str(path)] = hashlib.file_digest(file, "sha256").hexdigest()
    return found


def programs_of(folder: Path, commands: Iterable[list[str]]) -> list[Path]:
    """Find the files that identify a team's version: the programs of its commands and of its folder."""
    found = []
    for program, *others in commands:
        named = folder / program if "/" in program else Path(shutil.which(program) or program)
        found += [named, *(folder / word for word in others if "/" in word)]
    nearby = (path for depth in ("*", "*/*") for path in folder.glob(depth))
    found += [path for path in nearby if os.access(path, os.X_OK)]
    return [path for path in dict.fromkeys(found) if os.path.isfile(path)][:MAX_PROGRAMS]  # noqa: PTH113 (any word)
