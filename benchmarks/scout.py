"""What a report on a team costs beside the ingest of its matches, and whether its memory grows with their number.

    python benchmarks/scout.py MATCHES --team T [--counts 3 100 200]

MATCHES is a folder of logs. Where the team has fewer matches than a count asks for, copies of them take their places;
see `ingest.copy`. The ratio is to the ingest of the same matches by as many processes, measured just before. Processor
time is beside wall time, because other programs may be running.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from ingest import copy
from measure import HEADERS, cost_of

from teamclone.cli.common import print_table
from teamclone.logs import LogPair, find_matches, read_pair
from teamclone.system.workers import available_cpus


def plays(pair: LogPair, team: str) -> bool:
    match = read_pair(pair)
    return team in (match.left.name, match.right.name)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("matches", type=Path)
    parser.add_argument("--team", required=True)
    parser.add_argument("--counts", type=int, nargs="+", default=[3, 100, 200])
    parser.add_argument("--replays", type=int, default=3)
    parser.add_argument("--jobs", type=int, default=available_cpus())
    options = parser.parse_args()
    pairs = [pair for pair in find_matches([options.matches]) if plays(pair, options.team)]
    if not pairs:
        sys.exit(f"{options.team} plays in no match of {options.matches}")
    rows = []
    for count in options.counts:
        with tempfile.TemporaryDirectory() as name:
            folder, jobs = Path(name), ("--jobs", options.jobs)
            whole, rest = divmod(count, len(pairs))
            copy(pairs[:rest], folder / "logs" / "first", n=whole + 1)
            copy(pairs[rest:], folder / "logs" / "others", n=whole)
            command = (sys.executable, "-m", "teamclone")
            floor = cost_of(*command, "ingest", folder / "logs", "--store", folder / "store", *jobs)
            what = ("--team", options.team, "--replays", options.replays, "--out", folder / "scout.html", *jobs)
            ours = cost_of(*command, "scout", folder / "store", *what)
            found = len(json.loads((folder / "scout.json").read_text())["matches"])
            size = (folder / "scout.html").stat().st_size
        if found != count:
            sys.exit(f"expected a report on {count} matches, found {found}")
        rows += [
            ("ingest", count, *floor.row(count, floor), ""),
            ("scout", count, *ours.row(count, floor), f"{size / 1e6:.1f} MB"),
        ]
    print_table(
        ("work", "matches", *HEADERS, "page"),
        rows,
        title=f"{options.team}, {options.replays} replays, {options.jobs} processes",
        numeric=range(1, len(HEADERS) + 3),
    )


if __name__ == "__main__":
    main()
