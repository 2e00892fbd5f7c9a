"""Records ``(show ...)``, which text logs and monitors share, read into columns by the kernel of `scan`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.logs import scan
from teamclone.logs.columns import COUNTERS, PLAYERS, counter_name
from teamclone.logs.match import Columns
from teamclone.rcss.players import N_PLAYERS


@dataclass(frozen=True, slots=True, kw_only=True)
class Shows:
    """n records; the rows of a bad one are undefined.

    Attributes:
        cycle: (n,) int32.
        ball: (n, 4) float32: x, y in metres, vx, vy in metres per cycle.
        players: the columns `columns.PLAYERS`, (n, 22) each.
        outcomes: (n,) `scan.OK` or the code of an error.
        places: (n,) the byte of the error.
    """

    cycle: NDArray[np.int32]
    ball: NDArray[np.float32]
    players: Columns
    outcomes: NDArray[np.uint8]
    places: NDArray[np.int64]


def read_shows(buffer: NDArray[np.uint8], starts: NDArray[np.int64], stops: NDArray[np.int64]) -> Shows:
    """Read the records at these places of a buffer.

    Args:
        buffer: (n_bytes,) the text.
        starts: (n,) where each record begins, at its parenthesis.
        stops: (n,) the byte behind each.
    """
    n = len(starts)
    cycles = np.empty(n, np.int32)
    ball = np.empty((4, n), np.float32)
    floats = np.empty((len(scan.PLAYER_FLOATS), n, N_PLAYERS), np.float32)
    counters = np.empty((len(COUNTERS), n, N_PLAYERS), np.int32)
    dtypes = {column.name: column.dtype for column in PLAYERS}
    whole = {
        name: np.empty((n, N_PLAYERS), dtypes[name])
        for name in ("type", "state", "view_quality", "attention_side", "attention_unum")
    }
    outcomes = np.empty(n, np.uint8)
    places = np.empty(n, np.int64)
    scan.scan_shows(
        buffer,
        starts,
        stops,
        cycles,
        ball,
        floats,
        whole["type"],
        whole["state"],
        whole["view_quality"],
        whole["attention_side"],
        whole["attention_unum"],
        counters,
        outcomes,
        places,
    )
    players: Columns = dict(zip(scan.PLAYER_FLOATS, floats, strict=True)) | whole
    players |= {counter_name(kind): counters[index] for index, kind in enumerate(COUNTERS)}
    ordered = {column.name: players[column.name] for column in PLAYERS}
    return Shows(cycle=cycles, ball=ball.T, players=ordered, outcomes=outcomes, places=places)
