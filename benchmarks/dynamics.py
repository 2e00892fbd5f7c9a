"""Does every cycle of a match follow from the one before by the server's rules, and how fast is that told?

    python benchmarks/dynamics.py MATCHES [--runs N]

MATCHES is a folder of logs. Every cycle of play_on is compared with what `teamclone.dynamics` makes of the cycle before
and its commands; what neither the server's noise nor the resolution of the logs explains is counted. The noise itself
is shown by the quantiles of its share of the greatest possible one, which are those of a uniform distribution if the
bound is right. Times are processor seconds of one core, beside reading the same match.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from teamclone.cli.common import print_table
from teamclone.dynamics.audit import audit, rules_of
from teamclone.dynamics.bodies import BALL
from teamclone.dynamics.logged import Logged
from teamclone.dynamics.residuals import residuals
from teamclone.dynamics.step import step
from teamclone.errors import UsageError
from teamclone.logs import LogPair, find_matches, read_pair
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS

QUANTILES = (0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99)
CLEAR = {"velocity": 0.03, "body": 1.0}
"""Noise of at least so many metres per cycle or degrees is far above the resolution of logs."""
BATCH = 4096


@dataclass
class Totals:
    """Of all matches."""

    matches: int = 0
    cycles: int = 0
    touching: int = 0
    dropped: int = 0
    caught: int = 0
    compared: dict[str, int] = field(default_factory=dict)
    beyond: dict[str, int] = field(default_factory=dict)
    shares: dict[str, list[Any]] = field(default_factory=dict)

    def add(self, logged: Logged, pair: LogPair, params: Any, types: Any) -> None:
        rules = rules_of(params, types)
        found = residuals(logged, rules)
        self.matches += 1
        self.cycles += len(found.frame)
        self.touching += found.touching
        self.dropped += found.dropped
        self.caught += found.caught
        for name, residual in found.of.items():
            with np.errstate(invalid="ignore"):
                beyond = int((residual.excess > 0).sum())
            self.compared[name] = self.compared.get(name, 0) + int((~np.isnan(residual.error)).sum())
            self.beyond[name] = self.beyond.get(name, 0) + beyond
            if beyond:
                print(f"{pair.path}: {beyond} values of {name} beyond noise and rounding")
        kicked = (logged.commands.kind[found.frame] == CommandKind.KICK).any(axis=-1)
        for name, least in CLEAR.items():
            residual = found.of[name]
            clear = ~np.isnan(residual.error) & (residual.noise > least)
            share = residual.error / np.where(clear, residual.noise, 1.0)
            if name == "velocity":
                self.shares.setdefault("player_rand, velocities", []).append(share[:, :BALL][clear[:, :BALL]])
                free = clear[:, BALL] & ~kicked
                self.shares.setdefault("ball_rand, ball without a kick", []).append(share[free, BALL])
                hit = clear[:, BALL] & kicked
                self.shares.setdefault("kick_rand and ball_rand, kicked ball", []).append(share[hit, BALL])
            else:
                self.shares.setdefault("player_rand, turns", []).append(share[clear])


def seconds(work: Callable[[], object], runs: int) -> float:
    times = []
    for _ in range(runs):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return statistics.median(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("matches", type=Path)
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    totals = Totals()
    largest: tuple[int, LogPair] | None = None
    for pair in find_matches([options.matches]):
        match = read_pair(pair)
        try:
            totals.add(Logged.of(match), pair, match.game.server_params, match.game.player_types)
        except UsageError as error:
            print(f"{pair.path}: left out: {error}")
            continue
        largest = max(largest or (0, pair), (len(match.frames["cycle"]), pair), key=lambda one: one[0])
    if largest is None:
        raise SystemExit(f"{options.matches}: no match that can be judged")
    print(
        f"{totals.matches} matches, {totals.cycles:,} cycles of play_on with {totals.touching:,} contacts; left out: "
        f"{totals.dropped} dropped balls, {totals.caught} caught ones\n"
    )
    print_table(
        ("quantity", "values", "beyond noise and rounding"),
        [(name, f"{totals.compared[name]:,}", str(totals.beyond[name])) for name in totals.compared],
    )
    print("\nNoise as a share of its bound")
    print_table(
        ("term", "values", *(f"{100 * q:g} %" for q in QUANTILES)),
        [
            (name, f"{sum(map(len, parts)):,}", *(f"{v:.3f}" for v in np.quantile(np.concatenate(parts), QUANTILES)))
            for name, parts in totals.shares.items()
        ],
    )
    print(f"\nOne core, {largest[1].path.name}")
    speed(largest[1], options.runs)


def speed(pair: LogPair, runs: int) -> None:
    match = read_pair(pair)
    rules = rules_of(match.game.server_params, match.game.player_types)
    logged = Logged.of(match)
    rows = np.resize(np.flatnonzero(logged.frames["playmode"] == 3), BATCH)
    bodies, commands, rng = logged.bodies.select(rows), logged.commands.select(rows), np.random.default_rng(0)
    reading = seconds(lambda: read_pair(pair), runs)
    auditing = seconds(lambda: audit(Logged.of(match), rules), runs)
    steps = {
        name: seconds(lambda draw=draw: step(bodies, commands, rules, draw), runs)
        for name, draw in (("step, mean", None), ("step, with noise", rng))
    }
    print_table(
        ("work", "seconds", "beside reading the match", "player steps/s"),
        [
            ("reading the match", f"{reading:.3f}", "1", ""),
            ("audit of the match", f"{auditing:.3f}", f"{auditing / reading:.2f}", ""),
            *(
                (f"{name}, {BATCH} worlds", f"{took:.3f}", f"{took / reading:.2f}", f"{BATCH * N_PLAYERS / took:,.0f}")
                for name, took in steps.items()
            ),
        ],
    )


if __name__ == "__main__":
    main()
