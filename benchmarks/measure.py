"""What a command costs: wall time, processor time of all its processes, and the memory of the largest of them."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """Seconds, seconds, bytes."""

    wall: float
    cpu: float
    peak: int

    def row(self, n: int, floor: Cost) -> tuple[str, ...]:
        """Cells of ``HEADERS``, for ``n`` matches and the cost of what nobody can go below."""
        return (
            f"{self.wall:.1f} s",
            f"{self.cpu:.1f} s",
            f"{self.cpu / n:.3f} s",
            f"{self.wall / floor.wall:.2f}",
            f"{self.cpu / floor.cpu:.2f}",
            f"{self.peak / 1e6:.0f} MB",
        )


HEADERS = ("wall", "cpu", "cpu a match", "wall ratio", "cpu ratio", "largest process")


def cost_of(*command: object, output: BinaryIO | None = None) -> Cost:
    """Runs a command to its end; its output goes to a file, or nowhere.

    Raises:
        SystemExit: it failed.
    """
    start = time.perf_counter()
    process = subprocess.Popen([*map(str, command)], stdout=output or subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    if status:
        sys.exit(f"{' '.join(map(str, command))} failed")
    # Of the command and of every process it waited for.
    return Cost(wall=wall, cpu=usage.ru_utime + usage.ru_stime, peak=usage.ru_maxrss * 1024)


class Commands:
    """The commands of a benchmark that keeps what it has made.

    Args:
        names: what folders are called in ``shown``.

    Attributes:
        shown: every command as a person types it, also of what was made before.
    """

    def __init__(self, names: Mapping[Path, str]) -> None:
        self.names = names
        self.shown: list[str] = []

    def run(self, *arguments: object, made: Path, shown: str | None = None) -> float | None:
        """Run a teamclone command whose product is not there.

        Args:
            made: its product. shown: the command as typed, where its arguments are too many.

        Returns:
            Its seconds; None where the product was there.

        Raises:
            SystemExit: it failed.
        """
        command = [*map(str, arguments)]
        text = shown or " ".join(command)
        for folder, name in self.names.items():
            text = text.replace(str(folder), name)
        if f"teamclone {text}" not in self.shown:
            self.shown.append(f"teamclone {text}")
        if made.exists():
            return None
        print(f"{made} ...", file=sys.stderr, flush=True)
        return cost_of(sys.executable, "-m", "teamclone", *command).wall
