"""How many kicks and tackles of a dataset's team are as planned, by way, and what a plan costs.

    python benchmarks/planner.py DATASET [--kicks 5000]

Kicks are compared by the velocity that they give the ball. The cost is given in microseconds and as a ratio to sorting
1,000 numbers on the same machine.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from kicks import as_planned, kicked, plans, tackles_as_planned

from teamclone.dataset.reader import open_dataset
from teamclone.planner.columns import CHOICES, WAYS
from teamclone.rcss.commands import CLONED

REPEATS = 3


def seconds(of: Callable[[], object]) -> float:
    """Return the least processor time of REPEATS calls."""
    best = float("inf")
    for _ in range(REPEATS):
        start = time.process_time()
        of()
        best = min(best, time.process_time() - start)
    return best


def reference() -> float:
    """Return the seconds that sorting 1,000 numbers takes."""
    numbers = np.random.default_rng(0).random((200, 1000))
    return seconds(lambda: np.sort(numbers, axis=1)) / len(numbers)


def main() -> None:
    """Print the tables of a dataset."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--kicks", type=int, default=5000, help="the first so many")
    options = parser.parse_args()
    data = open_dataset(options.dataset)
    kinds = data.samples["kind"].numpy()
    rows = np.flatnonzero(kinds == CLONED.index("kick"))[: options.kicks]
    state, target = data.state(rows), data.target(rows)
    made = plans(state).numpy()
    exact, chosen, choice = as_planned(made, kicked(state, target.parameters).numpy())
    print(f"{len(rows)} kicks: {exact.any(1).mean():.2%} as any planned way, {chosen.mean():.2%} as the chosen one")
    for index, name in enumerate(WAYS):
        print(f"  as the way {name:10} {int(exact[:, index].sum()):6}")
    for index, name in enumerate(CHOICES):
        here = choice == index
        print(f"  chosen     {name:10} {int(here.sum()):6}, as chosen {int(chosen[here].sum()):6}")
    hits = np.flatnonzero(kinds == CLONED.index("tackle"))
    if len(hits):
        right = tackles_as_planned(plans(data.state(hits)).numpy(), data.target(hits).parameters[:, 0].numpy())
        print(f"{len(hits)} tackles: {right.mean():.2%} in the planned direction")
    if len(rows):
        cost = seconds(lambda: plans(state)) / len(rows)
        print(f"{1e6 * cost:.0f} us a plan, {cost / reference():.0f} times sorting 1,000 numbers")


if __name__ == "__main__":
    main()
