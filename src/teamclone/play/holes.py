"""Holes and clashes: how reliably a team's commands reached the server, counted from the logs of a match.

A hole is a cycle in which a player on the field gave no body command, a clash one with several, of which the server
takes the first. In a missed cycle nothing at all came from the player, in synch mode not even ``(done)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.logs.align import body_commands, slot_of
from teamclone.logs.match import Columns, Match
from teamclone.rcss import state_bits
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.playmodes import PlayMode

_FROZEN = state_bits.TACKLE | state_bits.FOUL_CHARGED


@dataclass(frozen=True, slots=True, kw_only=True)
class Holes:
    """Counts over the cycles of a match in which a player could act: connected, on the field, not frozen.

    Attributes:
        holes, clashes, missed: (22,) number of cycles, left 1..11 then right 1..11.
        longest_silence: (22,) most missed cycles in a row.
        last_heard: (22,) time of the last frame on which something came from the player; -1 where nothing did.
    """

    holes: NDArray[np.int64]
    clashes: NDArray[np.int64]
    missed: NDArray[np.int64]
    longest_silence: NDArray[np.int64]
    last_heard: NDArray[np.int64]


def count_holes(match: Match) -> Holes:
    """Count holes, clashes and missed cycles of every player."""
    return holes_of(match.frames, match.players, match.commands)


def holes_of(frames: Columns, players: Columns, commands: Columns) -> Holes:
    """Count them from the columns of a match.

    Args:
        frames: ``columns.FRAMES``, (n_frames,). players: ``columns.PLAYERS``, (n_frames, 22).
        commands: ``columns.COMMANDS``, (n_commands,), of a command log.
    """
    cycle = frames["cycle"]
    n_frames = len(cycle)
    slot = slot_of(commands["side"], commands["unum"])
    place = commands["frame"].astype(np.int64) * N_PLAYERS + slot

    def per_frame(index: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.bincount(place[index], minlength=n_frames * N_PLAYERS).reshape(n_frames, N_PLAYERS)

    mode = frames["playmode"]
    body = per_frame(body_commands(commands, mode))
    heard = per_frame(np.flatnonzero((commands["frame"] >= 0) & (slot >= 0))) > 0
    state = players["state"]
    free = ((state & state_bits.STAND) != 0) & ((state & _FROZEN) == 0)
    free &= ((mode != PlayMode.TIME_OVER) & (mode != PlayMode.BEFORE_KICK_OFF))[:, None]
    silent = free & ~heard
    last = np.where(heard, cycle[:, None], -1).max(axis=0, initial=-1)
    return Holes(
        holes=(free & (body == 0)).sum(0),
        clashes=(free & (body > 1)).sum(0),
        missed=silent.sum(0),
        longest_silence=np.array([_longest_run(silent[:, player]) for player in range(N_PLAYERS)]),
        last_heard=last.astype(np.int64),
    )


def _longest_run(flags: NDArray[np.bool_]) -> int:
    """Return the greatest number of True in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))
