"""What of a match goes into a replay page, and how finely."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.commands import used_arguments
from teamclone.logs.align import executed_kind, first_body_commands, follows, slot_of
from teamclone.logs.match import Columns
from teamclone.replay.payload import Channel, Coding

_WHOLE = Coding(step=1)
_SHORT = Coding(step=1, bytes=1)

FRAMES: Mapping[str, Coding] = {
    "cycle": Coding(step=1, bytes=4),
    "stoppage": Coding(step=1, bytes=4),
    "playmode": _SHORT,
    "left_score": _WHOLE,
    "right_score": _WHOLE,
    "left_penalties_scored": _WHOLE,
    "left_penalties_missed": _WHOLE,
    "right_penalties_scored": _WHOLE,
    "right_penalties_missed": _WHOLE,
    "ball_x": Coding(step=0.01, order=2),
    "ball_y": Coding(step=0.01, order=2),
    "ball_vx": Coding(step=0.001),
    "ball_vy": Coding(step=0.001),
}
"""Columns of the frames."""

PLAYERS: Mapping[str, Coding] = {
    "x": Coding(step=0.01, order=2),
    "y": Coding(step=0.01, order=2),
    "body": Coding(step=0.1),
    "neck": _WHOLE,
    "state": Coding(step=1, bytes=4),
    "type": _WHOLE,
    "stamina": Coding(step=10),
    "effort": Coding(step=0.01),
    "recovery": Coding(step=0.01),
    "capacity": Coding(step=100),
    "pointto_x": Coding(step=0.1),
    "pointto_y": Coding(step=0.1),
    "view_width": _WHOLE,
    "focus_distance": Coding(step=0.1),
    "focus_direction": _WHOLE,
}
"""Columns of the players."""

DONE = Coding(step=1, bytes=1, order=0)
ARGUMENT = Coding(step=0.1, order=0)
"""Kinds of commands and their numbers: power, degrees, metres."""


def of_match(frames: Columns, players: Columns) -> Iterator[Channel]:
    """Yield the channels of frames and players; listening is a place on the player axis, counted from 1, 0 for none."""
    for name, coding in FRAMES.items():
        yield Channel(name=name, coding=coding, values=frames[name])
    for name, coding in PLAYERS.items():
        yield Channel(name=name, coding=coding, values=players[name])
    listens = slot_of(players["attention_side"], players["attention_unum"]) + 1
    yield Channel(name="listens", coding=_SHORT, values=listens)


def of_commands(
    frames: Columns, players: Columns, commands: Columns, params: Mapping[str, float | str]
) -> Iterator[Channel]:
    """Yield the body command of each player and frame: ``kind`` (0 for none), its numbers, whether it was refused.

    Nothing is yielded where there are no commands. Without any command the kind of those executed is still known where
    the log counts them.
    """
    shape = players["state"].shape
    executed = executed_kind(frames, players)
    first = first_body_commands(commands, frames["playmode"])
    if not len(first):
        if executed.any():
            yield Channel(name="kind", coding=DONE, values=executed)
        return
    taken = {name: commands[name][first] for name in ("kind", "legs", "arg0", "arg1", "arg2", "arg3")}
    at = commands["frame"][first], slot_of(commands["side"][first], commands["unum"][first])
    kind: NDArray[Any] = np.zeros(shape, np.uint8)
    kind[at] = taken["kind"]
    yield Channel(name="kind", coding=DONE, values=kind)
    unknown = np.isnan(np.stack([taken["arg0"], taken["arg1"]], 1))
    numbers = np.where(unknown & (taken["legs"] == 0)[:, None], np.nan, used_arguments(taken, params))
    for index in range(2):
        grid = np.full(shape, np.nan)
        grid[at] = numbers[:, index]
        yield Channel(name=f"argument{index}", coding=ARGUMENT, values=grid)
    # Where the next frame is not the next step, or nothing is counted, the log does not say what became of a command.
    told = follows(frames)[:, None] & (players["count_dash"] >= 0)
    refused = (kind != 0) & (executed != kind) & told
    yield Channel(name="refused", coding=DONE, values=refused)
