"""Fans of roll-outs for a replay page: from ``fans.json`` of `teamclone rollout`, or from its trajectories."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import RunError
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.rcss.players import N_PLAYERS, N_TEAM

MOST_FANS, MOST_SAMPLES, MOST_POINTS = 24, 16, 26
"""Fans of a page, paths of a body, and points of a path, at most: beyond that one sees no more."""
STEP_M = 0.1
"""Resolution of the paths."""
_TRAJECTORY = ("match_id", "frame", "ahead", "sample", "side", "unum", "x", "y")


def read_fans(path: Path, match: MatchColumns) -> list[dict[str, Any]]:
    """Return the fans of a match.

    Each has ``frame``, ``ahead`` (cycles ahead of each point) and ``bodies``: ``slot`` (place on the player axis, 22
    for the ball) and ``paths``, flat lists x, y, x, y, ... in steps of STEP_M.

    Args:
        path: ``fans.json``, the folder that has it, or ``trajectories.parquet``. match: the match.

    Raises:
        RunError: the file is missing or damaged, of another format, or has no roll-out of the match.
    """
    fans = _of_trajectories(path, match) if path.suffix == ".parquet" else _of_fans(path, match)
    if not fans:
        raise RunError(
            f"{path}: expected roll-outs of match {match.match_id}, found none; run `teamclone rollout` on it"
        )
    return sorted(fans, key=lambda fan: int(fan["frame"]))[:MOST_FANS]


def _of_fans(path: Path, match: MatchColumns) -> list[dict[str, Any]]:
    from teamclone.rollouts.fans import shown_cycles
    from teamclone.rollouts.files import load_rollouts

    document, fans = load_rollouts(path if path.is_dir() else path.parent)
    made = []
    try:
        sides = {row["match_id"]: row["side"] for row in document["matches"]}
        for fan in fans:
            if fan["match_id"] != match.match_id:
                continue
            frames = np.flatnonzero((match.frames["cycle"] == fan["cycle"]) & (match.frames["stoppage"] == 0))
            if not len(frames):
                continue
            first = 0 if sides[fan["match_id"]] == "left" else N_TEAM
            bodies = [
                {
                    "slot": N_PLAYERS if body["of"] == "ball" else first + int(body["of"]) - 1,
                    "paths": [_flat(np.asarray(one, np.float64)) for one in body["samples"][:MOST_SAMPLES]],
                }
                for body in fan["bodies"]
            ]
            made.append({"frame": int(frames[0]), "ahead": shown_cycles(fan["ahead"]).tolist(), "bodies": bodies})
    except (KeyError, TypeError, ValueError) as error:
        raise RunError(
            f"{path}: expected fans as `teamclone rollout` writes them, got {error!r}; run it again"
        ) from None
    return made


def _of_trajectories(path: Path, match: MatchColumns) -> list[dict[str, Any]]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        rows = pq.read_table(
            path,
            columns=list(_TRAJECTORY),
            filters=[("match_id", "=", match.match_id), ("sample", ">=", 0), ("sample", "<", MOST_SAMPLES)],
        )
    except (OSError, pa.ArrowException, KeyError) as error:
        raise RunError(
            f"{path}: expected trajectories.parquet of `teamclone rollout --trajectories`: {error}"
        ) from None
    column = {name: rows[name].to_numpy() for name in _TRAJECTORY[1:]}
    starts = np.unique(column["frame"])
    chosen = (
        starts[np.unique(np.linspace(0, len(starts) - 1, MOST_FANS).round().astype(int))] if len(starts) else starts
    )
    made = []
    for frame in chosen[chosen < len(match.frames["cycle"])]:
        here = {name: values[column["frame"] == frame] for name, values in column.items()}
        most = int(here["ahead"].max())
        ahead = np.unique(np.linspace(0, most, MOST_POINTS).round().astype(int))
        slot = np.where(here["side"] == 0, N_PLAYERS, here["unum"].astype(int) - 1 + N_TEAM * (here["side"] < 0))
        bodies = []
        for body in np.unique(slot):
            paths = []
            for sample in range(int(here["sample"].max()) + 1):
                path_of = (slot == body) & (here["sample"] == sample)
                order = np.argsort(here["ahead"][path_of])
                places = np.stack([here["x"][path_of][order], here["y"][path_of][order]], 1).astype(np.float64)
                if len(places) == most + 1 and np.isfinite(places).all():
                    paths.append(_flat(places[ahead]))
            # Bodies that all samples agree on are the log's own.
            if any(one != paths[0] for one in paths[1:]):
                bodies.append({"slot": int(body), "paths": paths})
        made.append({"frame": int(frame), "ahead": ahead.tolist(), "bodies": bodies})
    return made


def _flat(places: NDArray[np.float64]) -> list[int]:
    """Return (n, 2) places as x, y, x, y, ... in steps."""
    steps: list[int] = np.rint(places / STEP_M).astype(int).ravel().tolist()
    return steps
