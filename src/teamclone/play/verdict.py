"""A check of a match's logs: are they whole, and which players were missing or silent?"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import TeamcloneError
from teamclone.logs import find_matches, read_pair
from teamclone.logs.match import Match, Severity
from teamclone.play.holes import Holes, count_holes
from teamclone.play.record import FailedError, Fault, who
from teamclone.play.schedule import Fixture
from teamclone.rcss import state_bits
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.playmodes import PlayMode
from teamclone.rcss.server_params import number


def read_logs(folder: Path) -> tuple[Match | None, Holes | None, str | None]:
    """Read the match in a folder, its holes and the first problem; None for each that is missing."""
    try:
        pairs = find_matches([folder])
        if len(pairs) != 1 or pairs[0].rcg is None or pairs[0].rcl is None:
            return None, None, f"expected one game log and one command log, got {len(pairs)} matches"
        match = read_pair(pairs[0])
        holes = count_holes(match) if len(match.frames["cycle"]) else None
    except TeamcloneError as error:
        return None, None, str(error)
    worst = [problem for problem in match.problems if problem.severity is not Severity.NOTE]
    return match, holes, str(worst[0]) if worst else None


def verdict(
    fixture: Fixture, match: Match | None, holes: Holes | None, problem: str | None, *, gave_up: bool
) -> FailedError | None:
    """Judge a match whose server ended by itself; return the failure, None where there is none.

    Args:
        gave_up: whether the server waited for clients in vain. After the end of a match that does not matter.
    """
    if match is None or holes is None or problem:
        return FailedError(Fault.BAD_LOGS, problem or "the game log has no frame")
    try:
        last, cycles = int(match.frames["cycle"][-1]), _cycles(match)
    except ValueError as error:
        return FailedError(Fault.BAD_LOGS, str(error))
    if not match.game.complete or match.frames["playmode"][-1] != PlayMode.TIME_OVER or last < cycles:
        if gave_up:
            there = (match.players["state"][-1] & state_bits.STAND) != 0
            silent = there & (holes.last_heard < holes.last_heard[there].max(initial=0))
            text = "the server waited for clients that did not answer"
            return _blame(fixture, silent, Fault.HUNG, "silent") or FailedError(Fault.HUNG, text)
        return FailedError(Fault.BAD_LOGS, f"the game log ends at cycle {last} of {cycles}")
    # Perhaps too shortly before the end to have been seen.
    running = (match.frames["playmode"] != PlayMode.TIME_OVER)[:, None]
    counts = [fixture.left.players, fixture.right.players]
    asked = np.tile(np.arange(N_TEAM), 2) < np.repeat(counts, N_TEAM)
    gone = ((match.players["state"] == 0) & running).any(0) & asked
    least = fixture.limits.silent_cycles or len(running)
    return _blame(fixture, gone, Fault.CRASHED, "gone before the end") or _blame(
        fixture, holes.longest_silence >= least, Fault.HUNG, f"silent for {least} cycles and more"
    )


def _cycles(match: Match) -> int:
    """Return how many cycles the regular halves have, as the server counts them (`serverparam.cpp`).

    0 or less where ``half_time`` is: then no match is too short, and its play mode alone says whether it ended.

    Raises:
        ValueError: the log's parameters give no number of cycles; the text names them.
    """
    names = ("half_time", "simulator_step", "nr_normal_halfs")
    half, step, halves = (number(match.game.server_params, name) for name in names)
    if not (math.isfinite(half) and math.isfinite(halves) and math.isfinite(step) and step > 0):
        found = ", ".join(f"{name} {value:g}" for name, value in zip(names, (half, step, halves), strict=True))
        raise ValueError(f"the game log gives the match no length: expected numbers, the step above 0, got {found}")
    return int(half * 1000 / step + 0.5) * int(halves)


def _blame(fixture: Fixture, flags: NDArray[np.bool_], fault: Fault, text: str) -> FailedError | None:
    """Blame the first team that has such players."""
    for side, team in enumerate((fixture.left, fixture.right)):
        unums = [1 + int(index) for index in np.flatnonzero(flags[side * N_TEAM : (side + 1) * N_TEAM])]
        if unums:
            return FailedError(fault, f"{who(team, unums)} {text}", side=side, unums=unums)
    return None
