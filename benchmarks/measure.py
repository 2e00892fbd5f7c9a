"""What a command costs: wall time, processor time of all its processes, and the memory of the largest of them."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import dataclass
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
