"""How long it takes to read a match, beside what nobody can go below and what a plain reader takes.

    python benchmarks/reading.py MATCHES [--runs N]

MATCHES is a folder of logs. Each stage works on the largest match packed with gzip (else on the largest of all), on one
core, warm. Times are processor seconds, which a busy machine disturbs less than those of the clock; both are printed.
References: inflating the files with zlib and with ISA-L, and a reader in plain Python, one regular expression a player
and a command, whose numbers are checked against ours. `rcg2txt` of librcsc, the league's C++ library, is measured, too,
where it is on the PATH; it reads the game log and prints part of it.
"""

from __future__ import annotations

import argparse
import lzma
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from measure import cost_of

from teamclone.cli.common import print_table
from teamclone.logs import LogPair, Match, find_matches, read_pair
from teamclone.logs.inflate import read_bytes
from teamclone.logs.rcl import read_commands
from teamclone.logs.read import read_game
from teamclone.rcss.commands import CommandKind

try:
    from isal import isal_zlib
except ImportError:
    isal_zlib = None  # type: ignore[assignment]

NEW_PROCESS = """
import time, sys
start = time.perf_counter()
from pathlib import Path
from teamclone.logs import read_match
read_match(sys.argv[1])
print(time.perf_counter() - start, time.process_time())
"""
# VmHWM, not ru_maxrss: that one begins with what the parent had.
PEAK = """
import re, sys
from pathlib import Path
from teamclone.logs import read_match, scan

def peak():
    return int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) >> 10

before = peak()
read_match(sys.argv[1])
once = peak()
for _ in range(5):
    read_match(sys.argv[1])
print(before, once, peak())
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Median seconds of several runs."""

    cpu: float
    wall: float


def timing(work: Callable[[], object], runs: int) -> Timing:
    cpu, wall = [], []
    for _ in range(runs):
        start = time.process_time(), time.perf_counter()
        work()
        cpu.append(time.process_time() - start[0])
        wall.append(time.perf_counter() - start[1])
    return Timing(cpu=statistics.median(cpu), wall=statistics.median(wall))


_NUMBER = rb"(-?[\d.]+(?:e[-+]?\d+)?)"
_SHOW = re.compile(rb"\(show (\d+) \(\(b\) (\S+) (\S+) (\S+) ([^)]+)\)")
_PLAYER = re.compile(
    rb"\(\(([lr]) (\d+)\) (\d+) (0x[0-9a-f]+) ([^()]+)"
    rb"\(v ([hl]) ([^()]+)\) (?:\(fp ([^()]+)\) )?\(s ([^()]+)\)(?: \(f ([lr]) (\d+)\))? \(c ([^()]+)\)\)"
)
_MESSAGE = re.compile(rb"(\d+),(\d+)\tRecv (\S+)_(\d+): (.*)")
_COMMAND = re.compile(rb"\((\w+)((?: -?[\d.]+(?:e[-+]?\d+)?)*)")


def plain_game(data: bytes) -> list[list[list[float]]]:
    """Every number of every frame, by regular expressions: cycle and ball, then 28 to 31 numbers for each player."""
    frames = []
    for line in data.splitlines():
        show = _SHOW.match(line)
        if show is None:
            continue
        frame = [[float(text) for text in show.groups()]]
        for match in _PLAYER.finditer(line, show.end()):
            _, unum, kind, state, body, _, view, focus, stamina, _, attention, counts = match.groups()
            player = [float(unum), float(kind), float(int(state, 16))]
            for group in (body, view, focus or b"", stamina, attention or b"", counts):
                player += map(float, group.split())
            frame.append(player)
        frames.append(frame)
    return frames


def plain_commands(data: bytes) -> list[tuple[int, int, bytes, int, bytes, list[float]]]:
    """(cycle, stoppage, team, number, word, numbers) of every command of a player, by regular expressions."""
    commands = []
    for line in data.splitlines():
        message = _MESSAGE.match(line)
        if message is None:
            continue
        cycle, stoppage, team, unum, text = message.groups()
        for word, numbers in _COMMAND.findall(text):
            commands.append((int(cycle), int(stoppage), team, int(unum), word, [float(n) for n in numbers.split()]))
    return commands


def check(
    match: Match, frames: list[list[list[float]]], commands: list[tuple[int, int, bytes, int, bytes, list[float]]]
) -> None:
    """Both readers found the same: otherwise their times say nothing."""
    ball = np.stack([match.frames[name] for name in ("cycle", "ball_x", "ball_y", "ball_vx", "ball_vy")], axis=1)
    assert np.array_equal(np.array([frame[0] for frame in frames], np.float32), ball.astype(np.float32))
    for name, place in (("state", 2), ("x", 3), ("count_change_focus", -1)):
        values = np.array([[player[place] for player in frame[1:]] for frame in frames])
        assert np.array_equal(values.astype(match.players[name].dtype), match.players[name])
    is_dash = (
        (match.commands["unum"] > 0) & (match.commands["kind"] == CommandKind.DASH) & (match.commands["legs"] == 0)
    )
    dashes = [numbers[0] for *_, word, numbers in commands if word == b"dash" and numbers]
    assert np.array_equal(np.array(dashes, np.float32), match.commands["arg0"][is_dash])


def inflate(path: Path, module: Any = zlib) -> None:
    """Inflates a file in pieces that stay in the cache and throws them away: nobody can read it in less."""
    inflater = module.decompressobj(wbits=31)
    raw = path.read_bytes()
    for at in range(0, len(raw), 1 << 16):
        inflater.decompress(raw[at : at + (1 << 16)])


def child(code: str, *args: Path | str, cache: str | None = None) -> list[float]:
    environment = os.environ | ({"NUMBA_CACHE_DIR": cache} if cache else {})
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, args)], check=True, capture_output=True, text=True, env=environment
    )
    return [float(word) for word in done.stdout.split()]


def pick(pairs: list[LogPair], suffix: str) -> LogPair | None:
    """The pair with the largest game log of a packing that has both files."""
    both = [pair for pair in pairs if pair.rcg and pair.rcl and pair.rcg.suffix == pair.rcl.suffix == suffix]
    return max(both, key=lambda pair: pair.path.stat().st_size, default=None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("matches", type=Path)
    parser.add_argument("--runs", type=int, default=7)
    options = parser.parse_args()
    pairs = find_matches([options.matches])
    packed = pick(pairs, ".gz")
    if packed is None or packed.rcg is None or packed.rcl is None:
        raise SystemExit(f"{options.matches}: no match with both logs as .gz")
    rcg, rcl = packed.rcg, packed.rcl
    match = read_pair(packed)
    game, log = read_bytes(rcg)[0], read_bytes(rcl)[0]
    left, right = match.left.name, match.right.name
    check(match, plain_game(game), plain_commands(log))

    modules = {"zlib": zlib} | ({} if isal_zlib is None else {"ISA-L": isal_zlib})
    files = {"rcg": [rcg], "rcl": [rcl], "both": [rcg, rcl]}
    floors = {
        name: {
            what: timing(lambda paths=paths, module=module: [inflate(path, module) for path in paths], options.runs)
            for what, paths in files.items()
        }
        for name, module in modules.items()
    }
    plain = {
        "rcg": timing(lambda: plain_game(zlib.decompress(rcg.read_bytes(), wbits=31)), 1),
        "rcl": timing(lambda: plain_commands(zlib.decompress(rcl.read_bytes(), wbits=31)), 1),
    }
    plain["both"] = Timing(cpu=sum(part.cpu for part in plain.values()), wall=sum(part.wall for part in plain.values()))
    ours = {
        "rcg": timing(lambda: read_game(read_bytes(rcg)[0]), options.runs),
        "rcl": timing(lambda: read_commands(read_bytes(rcl)[0], left=left, right=right), options.runs),
        "both": timing(lambda: read_pair(packed), options.runs),
    }
    lines = {"rcg": game.count(b"\n"), "rcl": log.count(b"\n")}
    lines["both"] = sum(lines.values())
    rows = []
    for what in files:
        for name, work, reference in (
            *((f"inflate {what}, {name}", floor[what], None) for name, floor in floors.items()),
            (f"read {what}, plain Python", plain[what], None),
            (f"read {what}", ours[what], plain[what]),
        ):
            rows.append(
                [
                    name,
                    f"{work.cpu * 1e3:.0f}",
                    f"{work.wall * 1e3:.0f}",
                    f"{work.cpu / floors['zlib'][what].cpu:.1f}",
                    f"{work.cpu / floors['ISA-L'][what].cpu:.1f}" if "ISA-L" in floors else "",
                    f"{reference.cpu / work.cpu:.0f}" if reference else "",
                    f"{lines[what] / work.cpu / 1e6:.2f}" if name.startswith("read") else "",
                ]
            )
    print_table(
        ["one match", "cpu ms", "wall ms", "x zlib", "x ISA-L", "x faster than plain", "million lines/s"],
        rows,
        title=f"{packed.path.name}: {len(game) / 1e6:.1f} MB + {len(log) / 1e6:.1f} MB, median of {options.runs} runs",
        numeric=range(1, 7),
    )
    if tool := shutil.which("rcg2txt"):
        took = statistics.median(cost_of(tool, rcg).cpu for _ in range(options.runs))
        print(f"rcg2txt of librcsc: {took * 1e3:.0f} ms of cpu for the rcg, {took / ours['rcg'].cpu:.1f} x ours")

    rows = []
    with tempfile.TemporaryDirectory() as cache:
        wall, cpu = child(NEW_PROCESS, rcg, cache=cache)
        rows.append(["first match ever: compiles", f"{wall:.2f}", f"{cpu:.2f}"])
        again = [child(NEW_PROCESS, rcg, cache=cache) for _ in range(5)]
    rows.append(
        ["first match of a process", *(f"{statistics.median(column):.2f}" for column in zip(*again, strict=True))]
    )
    if (xz := pick(pairs, ".xz")) is not None and xz.rcg is not None and xz.rcl is not None:
        paths = (xz.rcg, xz.rcl)
        for name, work in (
            ("inflate a match packed with xz", lambda: [lzma.decompress(path.read_bytes()) for path in paths]),
            ("read a match packed with xz", lambda: read_pair(xz)),
        ):
            took = timing(work, 3)
            rows.append([name, f"{took.wall:.2f}", f"{took.cpu:.2f}"])
    print_table(["", "wall s", "cpu s"], rows, numeric=(1, 2))
    if Path("/proc/self/status").exists():
        before, once, often = child(PEAK, rcg)
        print(f"peak memory: {before:.0f} MiB before reading, {once:.0f} after this match, {often:.0f} after six times")


if __name__ == "__main__":
    main()
