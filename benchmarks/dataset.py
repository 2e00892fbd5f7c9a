"""What a dataset costs beside reading its columns alone, and whether it grows with the matches as it should.

    python benchmarks/dataset.py STORE --team NAME [--jobs 2] [--copies 1 3 10]

STORE is what `teamclone ingest` made. A copy of a match is its folder under another id. The ratio is to reading the
columns that cleaning needs, by as many processes, measured just before.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
from measure import HEADERS, cost_of

from teamclone.cli.common import print_table
from teamclone.dataset import clean
from teamclone.store import create_store, open_store
from teamclone.system.workers import available_cpus, run_tasks
from teamclone.world import view

COLUMNS = {
    "frames": view.FRAME_COLUMNS,
    "player_states": view.PLAYER_COLUMNS,
    "commands": clean.COMMAND_COLUMNS,
}


def copy(source: Path, target: Path, *, n: int) -> None:
    """A store with ``n`` copies of each match, the first as it is."""
    create_store(target)
    for match in (source / "matches").iterdir():
        for number in range(n):
            name = match.name if number == 0 else f"{number:04x}{match.name[4:]}"
            made = Path(shutil.copytree(match, target / "matches" / name, copy_function=os.symlink))
            (made / "matches.parquet").unlink()
            row = pq.read_table(match / "matches.parquet")
            pq.write_table(row.set_column(0, row.schema.field(0), pa.array([name])), made / "matches.parquet")


def read(task: tuple[Path, str]) -> None:
    store = open_store(task[0])
    for table, columns in COLUMNS.items():
        store.read_match_columns(task[1], table, columns=columns)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store", type=Path)
    parser.add_argument("--team", required=True)
    parser.add_argument("--jobs", type=int, default=available_cpus())
    parser.add_argument("--copies", type=int, nargs="+", default=[1])
    parser.add_argument("--read", action="store_true", help="only read: the reference, which it runs by itself")
    options = parser.parse_args()
    ids = open_store(options.store).match_ids()
    if options.read:
        for _ in run_tasks(read, [(options.store, match_id) for match_id in ids], jobs=options.jobs):
            pass
        return
    rows = []
    for copies in options.copies:
        with tempfile.TemporaryDirectory() as name:
            folder, n = Path(name), copies * len(ids)
            copy(options.store.absolute(), folder / "store", n=copies)
            floor = cost_of(
                *(sys.executable, __file__, folder / "store", "--team", options.team),
                *("--jobs", options.jobs, "--read"),
            )
            ours = cost_of(
                *(sys.executable, "-m", "teamclone", "dataset", "--store", folder / "store", "--team", options.team),
                *("--out", folder / "dataset", "--jobs", options.jobs),
            )
            size = sum(path.stat().st_size for path in (folder / "dataset").rglob("*") if path.is_file())
        rows += [
            ("read columns", n, *floor.row(n, floor), ""),
            ("dataset", n, *ours.row(n, floor), f"{size / n / 1e6:.2f} MB"),
        ]
    print_table(
        ("work", "matches", *HEADERS, "disk a match"),
        rows,
        title=f"{options.jobs} processes, team {options.team}",
        numeric=range(1, len(HEADERS) + 3),
    )


if __name__ == "__main__":
    main()
