"""Time to find the events of matches, and their numbers beside rcg2data's.

    python benchmarks/events.py MATCH... [--rcg2data FOLDER]

FOLDER has the files that rcg2data (github.com/hidehisaakiyama/rcg2data) wrote of the same matches: NAME.event.csv.
Without it the table has our side alone.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from teamclone.events.find import find_events
from teamclone.events.rcg2data import TYPES, as_rcg2data
from teamclone.logs import Match, read_match

REPEATS = 5
KEYS = ("Type", "Side1", "Unum1", "Time1", "Side2", "Unum2", "Time2", "Success")
"""What makes two events the same."""

Row = tuple[Any, ...]


def ours(match: Match) -> tuple[list[Row], list[Row], float]:
    """All events that rcg2data has, those of them that are no restarts, and the seconds to find all events."""
    arguments = match.frames, match.players, match.game.server_params
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        events = find_events(*arguments)
        seconds.append(time.perf_counter() - start)
    in_play = {name: values[events["outcome"] != "restart"] for name, values in events.items()}
    return _rows(events), _rows(in_play), min(seconds)


def _rows(events: dict[str, Any]) -> list[Row]:
    made = as_rcg2data(events)
    return list(zip(*(made[name].tolist() for name in KEYS), strict=True))


def theirs(path: Path) -> list[Row]:
    """The rows of an ``.event.csv``; an unknown number is 0 as ours."""
    with path.open(encoding="utf-8", newline="") as file:
        return [
            (
                *(row["Type"], row["Side1"], max(int(row["Unum1"]), 0), int(row["Time1"])),
                *(row["Side2"], max(int(row["Unum2"]), 0), int(row["Time2"]), row["Success"] == "true"),
            )
            for row in csv.DictReader(file)
        ]


def of_type(rows: Iterable[Row], name: str) -> Counter[Row]:
    return Counter(row for row in rows if row[0] == name)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("matches", nargs="+", type=Path)
    parser.add_argument("--rcg2data", type=Path, help="folder of its .event.csv files")
    options = parser.parse_args()
    for path in options.matches:
        mine, in_play, seconds = ours(read_match(path))
        print(f"{path.name}: {1000 * seconds:.0f} ms")
        if options.rcg2data is None:
            print(f"  {'':14}{'ours':>8}{'in play':>9}")
            for name in dict.fromkeys(TYPES.values()):
                print(f"  {name:14}{of_type(mine, name).total():8}{of_type(in_play, name).total():9}")
            continue
        other = theirs(options.rcg2data / f"{path.name.partition('.rcg')[0]}.event.csv")
        print(f"  {'':14}{'rcg2data':>9}{'ours':>6}{'equal':>7}{'in play':>9}")
        for name in dict.fromkeys([*TYPES.values(), *(row[0] for row in other)]):
            one, two = of_type(other, name), of_type(mine, name)
            counts = one.total(), two.total(), (one & two).total(), of_type(in_play, name).total()
            print(f"  {name:14}{counts[0]:9}{counts[1]:6}{counts[2]:7}{counts[3]:9}")
        for who, rows in (("rcg2data", Counter(other) - Counter(mine)), ("ours", Counter(mine) - Counter(other))):
            for row in rows:
                print(f"  only {who}: {row}")


if __name__ == "__main__":
    main()
