"""Short matches of the stand-ins in tests/standin, for tests of ``teamclone play``."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import IO

import psutil

from command import TEAMCLONE
from teamclone.play.processes import MARK

STANDIN = Path(__file__).resolve().parent / "standin"
TEAM = f"{STANDIN}/team --host {{host}} --port {{port}} --name {{team}}"
CLIENT = f"{TEAM} --olcoach-port {{olcoach_port}} --unum {{unum}}"
"""One client of a team."""


def strays(folder: Path) -> list[str]:
    """Processes of matches that are played under a folder."""
    found = []
    for process in psutil.process_iter():
        try:
            if process.environ().get(MARK, "").startswith(str(folder)):
                found.append(" ".join(process.cmdline()))
        except (psutil.Error, OSError):
            continue
    return found


def write_schedule(
    folder: Path,
    pairings: list[tuple[str, str]],
    *,
    server: str = str(STANDIN / "rcssserver"),
    teams: dict[str, str] | None = None,
    matches: int = 1,
    half_time: int = 2,
    attempts: int = 1,
    limits: str = "connect_s = 20",
    more: str = "",
) -> Path:
    """A schedule of short matches; ``teams`` maps names to commands or to whole tables, others are sound."""
    names = dict.fromkeys(name for pairing in pairings for name in pairing)
    tables = dict.fromkeys(names, f"command = '''{TEAM}'''")
    for name, text in (teams or {}).items():
        tables[name] = text if text.lstrip().startswith(("start", "player")) else f"command = '''{text}'''"
    path = folder / "schedule.toml"
    path.write_text(
        f"[server]\ncommand = '{server}'\n"
        f"options = {{ half_time = {half_time}, kick_off_wait = 5, game_over_wait = 5 }}\n"
        f"[play]\nattempts = {attempts}\n[limits]\n{limits}\n"
        + "".join(f"[teams.{name}]\n{text}\n" for name, text in tables.items())
        + "".join(
            f"[[pairings]]\nleft = '{left}'\nright = '{right}'\nmatches = {matches}\n" for left, right in pairings
        )
        + more
    )
    return path


def started(
    schedule: Path, out: Path, *options: str, stderr: int | IO[bytes] = subprocess.DEVNULL
) -> subprocess.Popen[bytes]:
    command = [str(TEAMCLONE), "play", str(schedule), "--out", str(out), *options]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=stderr, start_new_session=True)
