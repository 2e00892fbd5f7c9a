"""From the columns of a match to `Bodies` and `Commands`: what a log knows of each cycle and of what was done in it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.bodies import Bodies, Commands
from teamclone.logs.align import executed_kind, first_body_commands, follows, slot_of
from teamclone.logs.columns import counter_name
from teamclone.logs.match import Columns, Match
from teamclone.rcss import state_bits
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS

_FROZEN = state_bits.TACKLE | state_bits.TACKLE_FAULT
_CATCHES = state_bits.CATCH | state_bits.CATCH_FAULT
_TAKING_LEGS = (CommandKind.TURN, CommandKind.MOVE, CommandKind.TACKLE, CommandKind.DASH)
"""Commands that take both legs (`player.cpp`, `leg.cpp`)."""
_COLLIDED = state_bits.BALL_COLLIDE | state_bits.PLAYER_COLLIDE | state_bits.POST_COLLIDE


def logged_bodies(frames: Columns, players: Columns) -> Bodies:
    """Return ball and players of all frames of a match.

    Cycles of being frozen are counted ahead: up to the last frame of the bits of a tackle or foul.
    """

    def bodies(name: str) -> NDArray[np.float64]:
        return np.column_stack([players[name], frames[f"ball_{name}"]]).astype(np.float64)

    state = players["state"]
    touched = np.zeros((len(state), N_PLAYERS + 1), np.bool_)
    touched[:, :N_PLAYERS] = (state & _COLLIDED) != 0
    touched[:, N_PLAYERS] = ((state & state_bits.BALL_COLLIDE) != 0).any(axis=-1)
    return Bodies(
        x=bodies("x"),
        y=bodies("y"),
        vx=bodies("vx"),
        vy=bodies("vy"),
        **{
            name: players[name].astype(np.float64)
            for name in ("body", "neck", "stamina", "effort", "recovery", "capacity")
        },
        type=players["type"].astype(np.int64),
        on_field=(state & state_bits.STAND) != 0,
        goalie=(state & state_bits.GOALIE) != 0,
        frozen=np.maximum(
            _left(frames, (state & _FROZEN) != 0, again=_rose(players, CommandKind.TACKLE)),
            _left(frames, (state & state_bits.FOUL_CHARGED) != 0),
        ),
        banned=np.zeros(state.shape, np.int64),
        touched=touched,
        mode=frames["playmode"].astype(np.uint8),
    )


def _left(frames: Columns, bit: NDArray[np.bool_], *, again: NDArray[np.bool_] | None = None) -> NDArray[np.int64]:
    """Return (n_frames, 22) how many more frames in a row have a bit: in the last of them the player is free again.

    Args:
        again: (n_frames, 22) where a row begins anew in the next frame.
    """
    left = np.zeros(bit.shape, np.int64)
    goes_on = bit[:-1] & bit[1:] & follows(frames)[:-1, None]
    if again is not None:
        goes_on &= ~again[:-1]
    for frame in np.flatnonzero(goes_on.any(axis=-1))[::-1]:
        left[frame] = np.where(goes_on[frame], left[frame + 1] + 1, 0)
    return left


def logged_commands(match: Match) -> tuple[Commands, NDArray[np.bool_]]:
    """Return the commands of a match that the server executed, and which tackles and catches succeeded.

    The counters of the next frame say which were executed, the command log says with which numbers. A frame without a
    direct successor has none.

    Returns:
        commands of n_frames cycles; (n_frames, 22) bool, success.
    """
    frames, players, log = match.frames, match.players, match.commands
    kind = executed_kind(frames, players)
    dashed = _rose(players, CommandKind.DASH) & follows(frames)[:, None]
    numbers = np.full((*kind.shape, 2), np.nan)
    legs = np.full((*kind.shape, 2, 2), np.nan)
    foul = np.zeros(kind.shape, np.bool_)
    bodies = logged_bodies(frames, players)
    first = first_body_commands(log, frames["playmode"])
    # A frozen player's commands are ignored, but for legs that dash.
    free = bodies.frozen[log["frame"][first], slot_of(log["side"][first], log["unum"][first])] == 0
    first = first[free]
    at = log["frame"][first], slot_of(log["side"][first], log["unum"][first])
    taken = kind[at] == log["kind"][first]
    first, at = first[taken], (at[0][taken], at[1][taken])
    numbers[at] = np.stack([log["arg0"][first], log["arg1"][first]], axis=-1)
    tackles = log["kind"][first] == CommandKind.TACKLE
    foul[at[0][tackles], at[1][tackles]] = [match.command_text(index) in ("on", "true") for index in first[tackles]]
    plain = (log["kind"][first] == CommandKind.DASH) & (log["legs"][first] == 0)
    legs[at[0][plain], at[1][plain]] = numbers[at[0][plain], at[1][plain]][:, None, :]
    _put_legs(legs, log, dashed, first)
    state = np.zeros_like(players["state"])
    state[:-1] = players["state"][1:]
    succeeded = (kind == CommandKind.TACKLE) & ((state & _FROZEN) == state_bits.TACKLE)
    succeeded |= (kind == CommandKind.CATCH) & ((state & _CATCHES) == state_bits.CATCH)
    return (
        Commands(kind=kind, numbers=numbers, legs=legs, foul=foul, turn_neck=_necks(match)),
        succeeded,
    )


def _rose(players: Columns, kind: CommandKind) -> NDArray[np.bool_]:
    """Return (n_frames, 22) whether a counter rose until the next frame."""
    counter = players[counter_name(kind)]
    rose = np.zeros(counter.shape, np.bool_)
    rose[:-1] = (counter[1:] > counter[:-1]) & (counter[:-1] >= 0)
    return rose


def _put_legs(legs: NDArray[np.float64], log: Columns, dashed: NDArray[np.bool_], accepted: NDArray[np.int64]) -> None:
    """Write two-leg dashes into ``legs`` (n_frames, 22, 2, 2): the first of each leg, where the player dashed.

    A plain dash, a turn, a move or a tackle before it takes both legs, where it is among the ``accepted`` commands.
    """
    with_legs = log["valid"] & (log["legs"] > 0) & (log["frame"] >= 0) & (log["unum"] > 0)
    if not with_legs.any():
        return
    is_accepted = np.zeros(len(with_legs), np.bool_)
    is_accepted[accepted] = True
    slots = slot_of(log["side"], log["unum"])
    keys = log["frame"].astype(np.int64) * N_PLAYERS + slots
    busy = log["valid"] & (np.isin(log["kind"], _TAKING_LEGS) | with_legs) & np.isin(keys, keys[with_legs])
    free: dict[int, int] = {}
    for index in np.flatnonzero(busy):
        frame, slot = log["frame"][index], slots[index]
        if not dashed[frame, slot] or not (with_legs[index] or is_accepted[index]):
            continue
        left = free.setdefault(keys[index], 3)
        taken = int(log["legs"][index]) or 3
        for leg in (0, 1):
            if left & taken & (1 << leg) and log["legs"][index]:
                legs[frame, slot, leg] = log[f"arg{2 * leg}"][index], log[f"arg{2 * leg + 1}"][index]
        free[keys[index]] = left & ~taken


def _necks(match: Match) -> NDArray[np.float64]:
    """Return (n_frames, 22) the moments of executed turns of the neck, the first of each cycle; 0 none."""
    log = match.commands
    moments = np.zeros(match.players["state"].shape)
    index = np.flatnonzero(
        (log["kind"] == CommandKind.TURN_NECK) & log["valid"] & (log["frame"] >= 0) & (log["unum"] > 0)
    )[::-1]  # of several the last written stays: the first in the log
    moments[log["frame"][index], slot_of(log["side"][index], log["unum"][index])] = log["arg0"][index]
    return np.where(_rose(match.players, CommandKind.TURN_NECK) & follows(match.frames)[:, None], moments, 0.0)
