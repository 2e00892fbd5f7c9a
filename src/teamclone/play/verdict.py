"""What the logs of a match say of it: whole or not, and who was missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import TeamcloneError
from teamclone.logs import find_matches, read_pair
from teamclone.logs.match import Match, Severity
from teamclone.play.game import FailedError, who
from teamclone.play.holes import Holes, count_holes
from teamclone.play.record import Fault
from teamclone.play.schedule import Fixture
from teamclone.rcss import state_bits
from teamclone.rcss.players import TEAM_SLOTS
from teamclone.rcss.playmodes import PlayMode


def read_logs(folder: Path) -> tuple[Match | None, Holes | None, str | None]:
    """The match in a folder with its holes, and what is wrong with it."""
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
    """What speaks against a match whose server ended by itself; None where nothing does.

    Args:
        gave_up: the server said that it waited for clients in vain. After the end of a match that does not matter.
    """
    if match is None or holes is None or problem:
        return FailedError(Fault.BAD_LOGS, problem or "the game log has no frame")
    last, cycles = int(match.frames["cycle"][-1]), _cycles(match)
    if not match.game.complete or match.frames["playmode"][-1] != PlayMode.TIME_OVER or last < cycles:
        if gave_up:
            there = (match.players["state"][-1] & state_bits.STAND) != 0
            silent = there & (holes.last_heard < holes.last_heard[there].max(initial=0))
            text = "the server waited for clients that did not answer"
            return _blame(fixture, silent, Fault.HUNG, "silent") or FailedError(Fault.HUNG, text)
        return FailedError(Fault.BAD_LOGS, f"the game log ends at cycle {last} of {cycles}")
    # Perhaps too shortly before the end to have been seen.
    running = (match.frames["playmode"] != PlayMode.TIME_OVER)[:, None]
    gone = ((match.players["state"] == 0) & running).any(0)
    least = fixture.limits.silent_cycles or len(running)
    return _blame(fixture, gone, Fault.CRASHED, "gone before the end") or _blame(
        fixture, holes.longest_silence >= least, Fault.HUNG, f"silent for {least} cycles and more"
    )


def _cycles(match: Match) -> int:
    """Of the regular halves, as the server counts them (`serverparam.cpp`)."""

    def number(name: str, usual: float) -> float:
        value = match.game.server_params.get(name, usual)
        return value if isinstance(value, float) else usual

    per_half = int(number("half_time", 300) * 1000 / number("simulator_step", 100) + 0.5)
    return per_half * int(number("nr_normal_halfs", 2))


def _blame(fixture: Fixture, flags: NDArray[np.bool_], fault: Fault, text: str) -> FailedError | None:
    """The first team with such players."""
    for side, team in enumerate((fixture.left, fixture.right)):
        unums = [1 + int(index) for index in np.flatnonzero(flags[TEAM_SLOTS[side]])]
        if unums:
            return FailedError(fault, f"{who(team, unums)} {text}", side=side, unums=unums)
    return None
