"""Binding commands to frames: a command stamped (t, k) was decided on frame (t, k) and shows its effect in the next.

Frames and commands are matched by the pair of time and stoppage counter, since the time alone repeats while the
clock is stopped. Commands of cycle 0, of half time and behind the last frame have no frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.logs.columns import counter_name
from teamclone.logs.match import Columns
from teamclone.rcss.commands import BODY_KINDS, CommandKind
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import MAY_MOVE, PlayMode

_STOPPAGES = 1 << 20

_IS_BODY = np.zeros(256, np.bool_)
_IS_BODY[list(BODY_KINDS)] = True


def frame_of(frames: Columns, cycle: NDArray[Any], stoppage: NDArray[Any], *, has_stoppage: bool) -> NDArray[np.int32]:
    """Return the index of the frame of each (cycle, stoppage), shape of ``cycle``; -1 where there is none.

    Without stoppage counters (servers 12.x) stamps inside a stoppage are ambiguous: -1.
    """
    keys = frames["cycle"].astype(np.int64) * _STOPPAGES + frames["stoppage"]
    if not len(keys) or not len(cycle):
        return np.full(len(cycle), -1, np.int32)
    # A log has dozens of commands in a row with one stamp: each row is looked up once.
    changes = (cycle[1:] != cycle[:-1]) | (stoppage[1:] != stoppage[:-1])
    first = np.concatenate([[0], np.flatnonzero(changes) + 1])
    wanted = cycle[first].astype(np.int64) * _STOPPAGES + stoppage[first]
    by_key = np.argsort(keys, kind="stable")
    place = np.minimum(np.searchsorted(keys[by_key], wanted), len(keys) - 1)
    found = by_key[place]
    found = np.where(keys[found] == wanted, found, -1).astype(np.int32)
    bound = np.repeat(found, np.diff(first, append=len(cycle)))
    if not has_stoppage:
        cycles, counts = np.unique(frames["cycle"], return_counts=True)
        bound[np.isin(cycle, cycles[counts > 1])] = -1
    return bound


def slot_of(side: NDArray[Any], unum: NDArray[Any]) -> NDArray[np.int64]:
    """Return the place on the player axis.

    0..10 are the left team's numbers 1..11, 11..21 the right team's; -1 is a coach.
    """
    slot: NDArray[np.int64] = unum.astype(np.int64) - 1 + np.where(side < 0, N_TEAM, 0)
    slot[(unum == 0) | (side == 0)] = -1
    return slot


def body_commands(commands: Columns, playmode: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return indices of the players' commands that would take a free body slot of their frame, in log order.

    A ``move`` in a play mode that does not allow it leaves the slot free, an invalid command never takes it. The
    arguments are those of ``first_body_commands``.
    """
    body = _IS_BODY.take(commands["kind"])
    body &= commands["valid"]
    body &= commands["frame"] >= 0
    body &= commands["unum"] > 0
    index = np.flatnonzero(body)
    may_move = MAY_MOVE[playmode[commands["frame"][index]]]
    taking: NDArray[np.int64] = index[(commands["kind"][index] != CommandKind.MOVE) | may_move]
    return taking


def first_body_commands(commands: Columns, playmode: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return indices of the commands that take the body slot: the first of each frame and player (``player.cpp``).

    Args:
        commands: with ``frame``, ``side``, ``unum``, ``kind``, ``valid``, in log order.
        playmode: (n_frames,) of the match.
    """
    index = body_commands(commands, playmode)
    slot = slot_of(commands["side"][index], commands["unum"][index])
    key = commands["frame"][index].astype(np.int64) * N_PLAYERS + slot
    first = np.full(len(playmode) * N_PLAYERS, -1, np.int64)
    first[key[::-1]] = index[::-1]  # of those with one key the last written stays: the first in the log
    return first[first >= 0]


def follows(frames: Columns) -> NDArray[np.bool_]:
    """Return whether the next frame is the next step of the simulator, shape (n_frames,); False for the last frame.

    At half time, and where a damaged log lost frames, the counters of the next frame speak of several cycles.
    """
    cycle, stoppage = np.diff(frames["cycle"]), np.diff(frames["stoppage"])
    made = np.zeros(len(frames["cycle"]), np.bool_)
    made[:-1] = (cycle == 1) | ((cycle == 0) & (stoppage == 1))
    return made


def plays_on(frames: Columns) -> NDArray[np.bool_]:
    """Return whether play_on goes on from a frame to the next step of the simulator, shape (n_frames,)."""
    play_on = frames["playmode"] == PlayMode.PLAY_ON
    goes_on: NDArray[np.bool_] = play_on & follows(frames)
    goes_on[:-1] &= play_on[1:]
    return goes_on


def executed_kind(frames: Columns, players: Columns) -> NDArray[np.uint8]:
    """Return the body command that the server executed on each frame, by the counters of the next one.

    Returns:
        (n_frames, 22) CommandKind ids, 0 for none; a frame without a direct successor has none. Where a kick and a
        two-leg dash were both executed it is the kick.
    """
    kinds: NDArray[np.uint8] = np.zeros(players["state"].shape, np.uint8)
    # Written last wins: kick goes above dash.
    for kind in sorted(BODY_KINDS, key=lambda kind: kind is CommandKind.KICK):
        counter = players[counter_name(kind)]
        rose = (counter[1:] > counter[:-1]) & (counter[:-1] >= 0)
        kinds[:-1][rose] = kind
    kinds[~follows(frames)] = 0
    return kinds


def executed_commands(
    players: Columns, frame: NDArray[Any], slot: NDArray[Any], kind: NDArray[Any]
) -> NDArray[np.bool_]:
    """Return whether the server executed commands: whether the counter of its kind rose until the next frame.

    Unlike `executed_kind` this asks about a command that was received. So it is taken as executed also where the next
    frame is not the next step of the simulator, and where the counter begins with a missing value.

    Args:
        players: ``columns.PLAYERS`` with the counters, (n_frames, 22).
        frame: (n,) the frame that each command was decided on, which has a successor.
        slot: (n,) see `slot_of`. kind: (n,) CommandKind ids of BODY_KINDS.
    """
    rose = np.zeros(len(frame), np.bool_)
    for one in np.unique(kind):
        of_kind = kind == one
        at, place = frame[of_kind], slot[of_kind]
        counter = players[counter_name(CommandKind(one))]
        rose[of_kind] = counter[at + 1, place] > np.maximum(counter[at, place], 0)
    return rose
