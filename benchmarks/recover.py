"""How well the commands of a match are known from its game log alone, beside its command log.

    python benchmarks/recover.py FOLDER... [--runs N]

FOLDER holds matches with both logs. Matches with problems are left out, and those of a server without noise. Numbers
are compared as the server uses them: clipped, directions of dashes rounded, a dash of two legs as its sum. Directions
of dashes and kicks with powers below 1 are left out: they have none.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from teamclone.cli.common import print_table
from teamclone.dynamics.commands import used_arguments
from teamclone.dynamics.inverse.recover import recover
from teamclone.dynamics.inverse.recovered import Basis, Recovered
from teamclone.dynamics.rules import Rules
from teamclone.logs import Match, Severity, find_matches, read_pair
from teamclone.logs.align import first_body_commands, slot_of
from teamclone.rcss.commands import BODY_KINDS, PARAMETERS, REPERTOIRE, CommandKind, Parameter, parameters_of
from teamclone.rcss.players import N_PLAYERS

BLURRED = 0.1
"""Degrees and metres: narrower intervals are those of numbers that noise does not blur."""
FAINT = 1.0
"""Powers below which a dash or kick has no direction to speak of."""

WANTED = {
    "kind": ".9995 right",
    "dash_power": "largest 1, no contact",
    "dash_direction": "median 2",
    "turn_moment": "median 0.7",
    "kick_power": "median 2",
    "kick_direction": "median 1.2",
}


@dataclass(frozen=True)
class Compared:
    """Executed body commands of matches, as recovered and as sent."""

    recovered: Recovered
    kind: NDArray[np.uint8]
    truth: NDArray[np.float64]
    """(n, 2), as the server uses them."""

    def numbers(self, parameter: Parameter) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.bool_]]:
        """(m,) rows of a parameter's command, (m,) errors, (m,) whether intervals contain the truth."""
        rows = np.flatnonzero((self.recovered.kind == parameter.kind) & (self.kind == parameter.kind))
        made = self.recovered.select(rows)
        value, low, high = (values[:, parameter.argument] for values in (made.value, made.low, made.high))
        truth = self.truth[rows, parameter.argument]
        error = value - truth
        # The command log's numbers are held in single precision.
        slack = 1e-6 + 1e-7 * np.abs(truth)
        contains = (truth >= low - slack) & (truth <= high + slack)
        if parameter.angle:
            error = (error + 180.0) % 360.0 - 180.0
            contains = (truth - low + slack) % 360.0 <= high - low + 2.0 * slack
        return rows, np.abs(error), contains


def compare(match: Match) -> Compared:
    """The commands that the game log of a match implies, beside those of its command log."""
    log = match.commands
    params = match.game.server_params
    recovered = recover(match.frames, match.players, Rules.of(params, match.game.player_types))
    recovered = recovered.select(np.isin(recovered.kind, BODY_KINDS))
    first = first_body_commands(log, match.frames["playmode"])
    keys = log["frame"][first].astype(np.int64) * N_PLAYERS + slot_of(log["side"][first], log["unum"][first])
    used = used_arguments({name: values[first] for name, values in log.items()}, params)
    sent = np.zeros(match.players["state"].size, np.uint8)
    truth = np.full((sent.size, 2), np.nan)
    sent[keys], truth[keys] = log["kind"][first], used
    at = recovered.frame.astype(np.int64) * N_PLAYERS + recovered.slot
    return Compared(recovered, sent[at], truth[at])


def joined(parts: list[Compared]) -> Compared:
    """All of them as one."""
    names = [name for name in Recovered.__slots__ if name != "gaps"]
    made = {name: np.concatenate([getattr(part.recovered, name) for part in parts]) for name in names}
    kind, truth = (np.concatenate([getattr(part, name) for part in parts]) for name in ("kind", "truth"))
    return Compared(Recovered(**made), kind, truth)


def rows_of(compared: Compared) -> list[tuple[str, ...]]:
    """The table's rows: one a parameter."""
    rows, inside = [], []
    for parameter in parameters_of(REPERTOIRE):
        index, error, contains = compared.numbers(parameter)
        if parameter.name in ("dash_direction", "kick_direction"):
            firm = compared.truth[index, 0] >= FAINT
            index, error, contains = index[firm], error[firm], contains[firm]
        made = compared.recovered.select(index)
        known = ~np.isnan(error)
        width = (made.high - made.low)[:, parameter.argument]
        blurred = known & (made.basis != Basis.BOUND if parameter.kind is CommandKind.CATCH else width >= BLURRED)
        if parameter in PARAMETERS:
            inside.append(contains[blurred])
        clear = known & (made.basis == Basis.MOVEMENT)
        rows.append(
            (
                parameter.name,
                f"{len(index):,}",
                share(known),
                *(f"{number:.3f}" for number in summary(error[known])),
                f"{error[clear].max(initial=0.0):.2f}",
                share(blurred),
                f"{np.median(width[blurred]):.2f}" if blurred.any() else "",
                share(contains[blurred]),
                WANTED.get(parameter.name, ""),
            )
        )
    total = np.concatenate(inside)
    rows.append(("all but catch and move", "", "", "", "", "", "", "", share(total), ".88 to .92"))
    return rows


def summary(error: NDArray[np.float64]) -> tuple[float, float]:
    """Median and mean, NaN of nothing."""
    return (float(np.median(error)), float(error.mean())) if len(error) else (np.nan, np.nan)


def share(what: NDArray[np.bool_]) -> str:
    return f"{what.mean():.4f}" if len(what) else ""


def clean(match: Match) -> bool:
    """Whether a match has both logs, no problems and the server's noise."""
    noise = all(match.game.server_params.get(f"{name}_rand", 1.0) != 0 for name in ("player", "ball", "kick"))
    worse = [problem for problem in match.problems if problem.severity is not Severity.NOTE]
    return match.log is not None and len(match.frames["cycle"]) > 1 and noise and not worse


def seconds(match: Match, runs: int) -> float:
    """Processor seconds that the commands of a match take, the least of some runs."""
    taken = []
    for _ in range(runs):
        start = time.process_time()
        recover(match.frames, match.players, Rules.of(match.game.server_params, match.game.player_types))
        taken.append(time.process_time() - start)
    return min(taken)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--runs", type=int, default=1, help="runs a match of which the fastest counts")
    options = parser.parse_args()
    parts, times = [], []
    for pair in find_matches(options.folders):
        match = read_pair(pair)
        if not clean(match):
            continue
        parts.append(compare(match))
        times.append(seconds(match, options.runs) * 6000 / max(len(match.frames["cycle"]), 6000))
    if not parts:
        sys.exit("expected matches with both logs and no problems, found none")
    compared = joined(parts)
    right = compared.kind == compared.recovered.kind
    print(f"{len(parts)} matches, {len(right):,} executed body commands")
    print(f"kind right: {right.mean():.5f} (wanted .9995), {np.sum(~right):,} not")
    print(f"seconds a match: {np.mean(times):.2f} in the mean, {max(times):.2f} at most (wanted 1)")
    basis = np.bincount(compared.recovered.basis, minlength=len(Basis))
    print("known by", ", ".join(f"{one.name.lower()} {count:,}" for one, count in zip(Basis, basis, strict=True)))
    print_table(
        (
            "parameter",
            "commands",
            "known",
            "median",
            "mean",
            "largest, clear",
            "blurred",
            "width",
            "contains",
            "wanted",
        ),
        rows_of(compared),
    )


if __name__ == "__main__":
    main()
