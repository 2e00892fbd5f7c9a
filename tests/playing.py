"""Short matches of the stand-ins in tests/standin, for tests of ``teamclone play``."""

from __future__ import annotations

import json
import shutil
import subprocess
import time
from pathlib import Path
from typing import IO, Any

import psutil
import pytest

from command import TEAMCLONE, called
from teamclone.play.processes import MARK

STANDIN = Path(__file__).resolve().parent / "standin"
TEAM = f"{STANDIN}/team --host {{host}} --port {{port}} --name {{team}}"
CLIENT = f"{TEAM} --olcoach-port {{olcoach_port}} --unum {{unum}}"
"""One client of a team."""

REAL = shutil.which("rcssserver")
SERVERS = [
    pytest.param(str(STANDIN / "rcssserver"), id="standin"),
    pytest.param(
        REAL,
        id="real",
        marks=[
            pytest.mark.rcssserver,
            pytest.mark.skipif(REAL is None, reason="there is no rcssserver on the PATH"),
        ],
    ),
]
both_servers = pytest.mark.parametrize("server", SERVERS)


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


def play(schedule: Path, out: Path, *options: object, code: int = 0) -> dict[str, Any]:
    """Play a schedule in this process, and return its report."""
    done = called("play", schedule, "--out", out, "--json", *options, code=code)
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def trouble_of(schedule: Path, out: Path, *options: object) -> dict[str, Any]:
    """The trouble of a match that fails."""
    answer = play(schedule, out, *options, code=1)
    [record] = answer["records"]
    trouble: dict[str, Any] = record["trouble"]
    return trouble


def small_team(coach: str = "", *, players: int = 2, player: str = CLIENT) -> str:
    """The table of a team of one process for each client."""
    return f"player = '''{player}'''\nplayers = {players}\n" + (f"coach = '''{coach}'''" if coach else "")


def wait_for_match(out: Path, *, number: int = 1, glob: str = ".playing/*/*/output/right-team.txt") -> None:
    """Until so many matches are being played, with all that belongs to them."""
    deadline = time.monotonic() + 300
    while len(list(out.glob(glob))) < number:
        assert time.monotonic() < deadline, "the matches do not begin"
        time.sleep(0.05)
    time.sleep(1)
