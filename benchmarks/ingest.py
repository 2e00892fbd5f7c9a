"""What ingest costs beside inflating the same files, and whether it grows with the matches as it should.

    python benchmarks/ingest.py MATCHES [--jobs 2] [--copies 1 3 10]

MATCHES is a folder of logs. A copy of a match is its files with one message line more in a second compressed member of
the game log, so that it is another match and costs as much to inflate and read. The ratio is to inflating alone, by as
many processes, measured just before. Processor time is beside wall time, because other programs may be running.
"""

from __future__ import annotations

import argparse
import gzip
import lzma
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from measure import HEADERS, cost_of

from teamclone.cli.common import print_table
from teamclone.logs import LogPair, find_matches
from teamclone.logs.inflate import read_bytes
from teamclone.store import open_store
from teamclone.store.ingest import files_of
from teamclone.system.workers import available_cpus, run_tasks

PACK: dict[str, Callable[[bytes], bytes]] = {".gz": gzip.compress, ".xz": lzma.compress, ".rcg": bytes}


def copy(pairs: list[LogPair], folder: Path, *, n: int) -> None:
    """``n`` copies of each match, the first as it is."""
    for number in range(n):
        (folder / str(number)).mkdir(parents=True)
        for pair in pairs:
            for path in files_of(pair):
                target = folder / str(number) / path.name
                if number and path == pair.rcg:
                    line = f'(msg 6000 1 "copy {number}")\n'.encode()
                    target.write_bytes(path.read_bytes() + PACK[path.suffix](line))
                else:
                    target.symlink_to(path.absolute())


def inflate(pair: LogPair) -> None:
    for path in files_of(pair):
        read_bytes(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("matches", type=Path)
    parser.add_argument("--jobs", type=int, default=available_cpus())
    parser.add_argument("--copies", type=int, nargs="+", default=[1])
    parser.add_argument("--inflate", action="store_true", help="only inflate: the reference, which it runs by itself")
    options = parser.parse_args()
    pairs = find_matches([options.matches])
    if options.inflate:
        for _ in run_tasks(inflate, pairs, jobs=options.jobs):
            pass
        return
    rows = []
    for copies in options.copies:
        with tempfile.TemporaryDirectory() as name:
            folder, n = Path(name), copies * len(pairs)
            copy(pairs, folder / "logs", n=copies)
            floor = cost_of(sys.executable, __file__, folder / "logs", "--jobs", options.jobs, "--inflate")
            ours = cost_of(
                *(sys.executable, "-m", "teamclone", "ingest", folder / "logs"),
                *("--store", folder / "store", "--jobs", options.jobs),
            )
            found = len(open_store(folder / "store").match_ids())
            if found != n:
                sys.exit(f"expected {n} matches in the store, found {found}")
            size = sum(path.stat().st_size for path in (folder / "store").rglob("*.parquet"))
        rows += [
            ("inflate", n, *floor.row(n, floor), ""),
            ("ingest", n, *ours.row(n, floor), f"{size / n / 1e6:.2f} MB"),
        ]
    print_table(
        ("work", "matches", *HEADERS, "disk a match"),
        rows,
        title=f"{options.jobs} processes",
        numeric=range(1, len(HEADERS) + 3),
    )


if __name__ == "__main__":
    main()
