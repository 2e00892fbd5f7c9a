"""Parquet beside PostgreSQL: ingest, reading a match, size on disk, as ratios measured in the same run.

    python benchmarks/stores.py MATCHES [--url postgresql://...]

MATCHES is a folder of logs. Without a URL the server of the tests is started in a temporary folder, with fsync as
PostgreSQL ships it. Logs are read before the clock runs, so that only the stores are compared; one process works. The
processor time is its own plus that of a server it started.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import psutil

from teamclone.cli.common import print_table
from teamclone.dataset import clean
from teamclone.logs import Match, find_matches, read_pair
from teamclone.store import Store, create_store
from teamclone.store.postgres.location import Location
from teamclone.world import view

sys.path.append(str(Path(__file__).resolve().parent.parent / "tests"))
from postgres import start_server


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Seconds: by the clock, and of processors."""

    wall: float
    cpu: float


def processor_s(server: psutil.Process | None) -> float:
    """Of this process and of the server's, those that have ended included."""
    mine = time.process_time()
    if server is None:
        return mine
    family = [server, *server.children(recursive=True)]
    return (
        mine
        + sum(process.cpu_times().user + process.cpu_times().system for process in family)
        + (server.cpu_times().children_user + server.cpu_times().children_system)
    )


def cost(work: Callable[[], object], server: psutil.Process | None) -> Cost:
    wall, cpu = time.perf_counter(), processor_s(server)
    work()
    return Cost(wall=time.perf_counter() - wall, cpu=processor_s(server) - cpu)


def typical(costs: list[Cost]) -> Cost:
    return Cost(wall=statistics.median(c.wall for c in costs), cpu=statistics.median(c.cpu for c in costs))


def read(store: Store, match_id: str) -> None:
    """What a dataset needs of a match."""
    store.read_match_columns(match_id, "frames", columns=view.FRAME_COLUMNS)
    store.read_match_columns(match_id, "player_states", columns=view.PLAYER_COLUMNS)
    store.read_match_columns(match_id, "commands", columns=clean.COMMAND_COLUMNS)
    store.read_parameters(match_id)


def n_rows(match: Match) -> int:
    return len(match.frames["cycle"]) * 23 + len(match.commands["cycle"])


def megabytes(store: Store, url: str | None) -> float:
    if url is None:
        root = Path(store.location)
        return sum(path.stat().st_size for path in root.rglob("*") if path.is_file()) / 1e6
    query = "select sum(pg_total_relation_size(oid))::float8 / 1e6 as size from pg_class where relkind = 'r' and "
    name = Location.parse(url).schema
    return float(store.sql(f"{query} relnamespace = '{name}'::regnamespace").to_pylist()[0]["size"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("matches", type=Path)
    parser.add_argument("--url", help="a schema to use and to leave filled; it must not exist")
    parser.add_argument("--count", type=int, default=6, help="how many of the matches")
    options = parser.parse_args()
    pairs = find_matches([options.matches])[: options.count]
    own = None if options.url else start_server(fsync=True)
    try:
        with tempfile.TemporaryDirectory() as folder:
            server = None
            places: dict[str, tuple[str, str | None]] = {"Parquet": (folder + "/store", None)}
            if own is not None:
                server = psutil.Process(own.pid)
                owner, superuser = own.new_url(), own.new_url()
                own.sql(f"create schema {Location.parse(superuser).schema}", database="matches")
                places["PostgreSQL"] = (owner, owner)
                places["PostgreSQL, trusted keys"] = (own.superuser_url(superuser), superuser)
            else:
                places["PostgreSQL"] = (options.url, options.url)
            stores = {name: create_store(location) for name, (location, _) in places.items()}
            added: dict[str, list[Cost]] = {name: [] for name in stores}
            asked: dict[str, list[Cost]] = {name: [] for name in stores}
            rows = 0
            for pair in pairs:
                match = read_pair(pair)
                rows += n_rows(match)
                for name, store in stores.items():
                    added[name].append(cost(lambda store=store, match=match: store.add(match), server))
            for match_id in stores["Parquet"].match_ids():
                for name, store in stores.items():
                    asked[name].append(cost(lambda store=store, match_id=match_id: read(store, match_id), server))
            table = []
            for name, store in stores.items():
                size = megabytes(store, places[name][1]) / len(pairs)
                first = megabytes(stores["Parquet"], None) / len(pairs)
                for work, costs in (("add", added), ("read", asked)):
                    one, base = typical(costs[name]), typical(costs["Parquet"])
                    table.append(
                        (
                            name,
                            work,
                            f"{one.wall:.2f}",
                            f"{one.wall / base.wall:.1f}",
                            f"{one.cpu:.2f}",
                            f"{one.cpu / base.cpu:.1f}",
                            f"{rows / len(pairs) / one.wall:,.0f}" if work == "add" else "",
                        )
                    )
                table.append((name, "size", f"{size:.1f} MB", f"{size / first:.1f}", "", "", ""))
    finally:
        if own is not None:
            own.throw_away()
    print_table(
        ("store", "work", "s a match", "ratio", "processor s", "ratio", "rows/s"),
        table,
        title=f"{len(pairs)} matches of {rows / len(pairs):,.0f} rows, one process, medians",
        numeric=(2, 3, 4, 5, 6),
    )


if __name__ == "__main__":
    main()
