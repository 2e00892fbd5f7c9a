"""Recovered commands in the form of a command log, for all that works on one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.inverse.recover import recover
from teamclone.dynamics.inverse.recovered import Recovered
from teamclone.dynamics.rules import Rules
from teamclone.errors import UsageError
from teamclone.logs import columns
from teamclone.logs.match import Columns, empty_columns
from teamclone.rcss.players import SLOT_SIDES, SLOT_UNUMS


def recovered_commands(
    frames: Columns, players: Columns, *, types: Columns, params: Mapping[str, float | str]
) -> tuple[Columns, tuple[str, ...]]:
    """Return the commands that a game log implies, and what it cannot give, a line each.

    The commands are ``columns.COMMANDS`` and ``columns.INTERVALS``, (n_commands,), in the order of frames and players.
    ``line`` counts them. A dash of two legs is a plain one, that of their sum. Numbers that are not known are NaN, and
    so are both ends of their interval.

    Args:
        frames: ``columns.FRAMES``, (n_frames,). players: ``columns.PLAYERS``, (n_frames, 22).
        types: ``player_types.FIELDS``. params: the server's parameters as the log lists them.

    Raises:
        UsageError: nothing can be said of the match, and why.
    """
    rules = Rules.of(params, types)
    try:
        with np.errstate(all="ignore"):  # an odd log may make numbers that are none; they are then not known
            found = recover(frames, players, rules)
    except IndexError:
        listed = len(next(iter(types.values()), ()))
        raise UsageError(f"expected players of the {listed} types that the log lists, got one of another") from None
    gaps = found.gaps
    if len(frames["cycle"]) and not len(found) and not gaps:
        gaps = ("any command: no counter rises from one cycle to the next",)
    return _columns(found, frames), gaps


def _columns(found: Recovered, frames: Columns) -> Columns:
    made = empty_columns((*columns.COMMANDS, *columns.INTERVALS), len(found))
    known = ~np.isnan(found.value)
    made |= {
        "frame": found.frame,
        "cycle": frames["cycle"][found.frame],
        "stoppage": frames["stoppage"][found.frame],
        "line": np.arange(1, len(found) + 1, dtype=np.int32),
        "order": _place_in_cycle(found),
        "side": SLOT_SIDES[found.slot],
        "unum": SLOT_UNUMS[found.slot],
        "kind": found.kind,
        "valid": np.ones(len(found), np.bool_),
    }
    for index in range(2):
        made[f"arg{index}"] = found.value[:, index].astype(np.float32)
        for name, ends in (("low", found.low), ("high", found.high)):
            made[f"{name}{index}"] = np.where(known[:, index], ends[:, index], np.nan).astype(np.float32)
    return made


def _place_in_cycle(found: Recovered) -> NDArray[np.int32]:
    """Return (n,) which command of its player in its cycle each is, from 0. Those of one player stand together."""
    same = np.zeros(len(found), np.bool_)
    same[1:] = (np.diff(found.frame) == 0) & (np.diff(found.slot) == 0)
    place = np.arange(len(found))
    first = np.maximum.accumulate(np.where(same, 0, place))
    return (place - first).astype(np.int32)
