"""``Logged``: the columns of a match as `Bodies` and `Commands`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.bodies import Bodies, Commands
from teamclone.logs.align import executed_kind, first_body_commands, follows, slot_of
from teamclone.logs.columns import counter_name
from teamclone.logs.match import Columns, Match
from teamclone.rcss import state_bits
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS

_MEANT = ("on", "true")
"""Words of a tackle that means a foul."""
_TAKING_LEGS = (CommandKind.TURN, CommandKind.MOVE, CommandKind.TACKLE, CommandKind.DASH)
"""Commands that take both legs (`player.cpp`, `leg.cpp`)."""
RESOLUTION = 1e-4
"""Metres by which text logs round places and velocities."""
_COLLIDED = state_bits.BALL_COLLIDE | state_bits.PLAYER_COLLIDE | state_bits.POST_COLLIDE


def bodies_of(frames: Columns, players: Columns) -> Bodies:
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
            _left(frames, (state & state_bits.TACKLES) != 0, again=rose(players, CommandKind.TACKLE)),
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Logged:
    """What the logs of a match know of each cycle and of what was done in it.

    Attributes:
        frames, players: the columns of the game log, (n_frames,) and (n_frames, 22).
        bodies: of all frames. commands: those that the server executed on each; none on a frame without a direct
            successor. The counters of the next frame say which, the command log with which numbers; NaN if it does not.
        succeeded: (n_frames, 22) bool, which tackles and catches succeeded.
        trainer: (n_frames,) bool, where a trainer acted.
    """

    frames: Columns
    players: Columns
    bodies: Bodies
    commands: Commands
    succeeded: NDArray[np.bool_]
    trainer: NDArray[np.bool_]

    @classmethod
    def of(cls, match: Match) -> Logged:
        """Return what the logs of a match know; without a command log no numbers of commands are known."""
        return cls.of_columns(match.frames, match.players, match.commands, match.command_text)

    @classmethod
    def of_columns(cls, frames: Columns, players: Columns, log: Columns, text: Callable[[int], str]) -> Logged:
        """Return what the columns of a match know.

        Args:
            frames, players, log: ``columns.FRAMES``, ``PLAYERS`` and ``COMMANDS``.
            text: gives the text of a command by its index; asked for tackles alone.
        """
        bodies = bodies_of(frames, players)
        kind = executed_kind(frames, players)
        first = first_body_commands(log, frames["playmode"])
        # A frozen player's commands are ignored, but for legs that dash.
        first = first[bodies.frozen[_place(log, first)] == 0]
        numbers = np.full((*kind.shape, 2), np.nan)
        taken = first[kind[_place(log, first)] == log["kind"][first]]
        numbers[_place(log, taken)] = np.stack([log["arg0"][taken], log["arg1"][taken]], axis=-1)
        tackles = taken[log["kind"][taken] == CommandKind.TACKLE]
        foul = np.zeros(kind.shape, np.bool_)
        foul[_place(log, tackles)] = [text(int(index)) in _MEANT for index in tackles]
        state = np.zeros_like(players["state"])
        state[:-1] = players["state"][1:]
        succeeded = (kind == CommandKind.TACKLE) & ((state & state_bits.TACKLES) == state_bits.TACKLE)
        succeeded |= (kind == CommandKind.CATCH) & ((state & state_bits.CATCHES) == state_bits.CATCH)
        trainer = np.zeros(len(kind), np.bool_)
        acts = (log["side"] == 0) & (log["kind"] != CommandKind.DONE) & (log["frame"] >= 0)
        trainer[log["frame"][acts]] = True
        return cls(
            frames=frames,
            players=players,
            bodies=bodies,
            commands=Commands(
                kind=kind,
                numbers=numbers,
                legs=_legs(frames, players, log, first),
                foul=foul,
                turn_neck=_necks(frames, players, log),
            ),
            succeeded=succeeded,
            trainer=trainer,
        )

    @property
    def unknown(self) -> NDArray[np.bool_]:
        """(n_frames, 22) where a body command was executed whose numbers no log knows."""
        dashed = rose(self.players, CommandKind.DASH) & follows(self.frames)[:, None]
        unknown: NDArray[np.bool_] = dashed & np.isnan(self.commands.legs[..., 0]).all(axis=-1)
        unknown |= (self.commands.kind > CommandKind.DASH) & np.isnan(self.commands.numbers[..., 0])
        return unknown


def _place(log: Columns, index: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return frame and slot of some commands."""
    return log["frame"][index].astype(np.int64), slot_of(log["side"][index], log["unum"][index])


def rose(players: Columns, kind: CommandKind) -> NDArray[np.bool_]:
    """Return (n_frames, 22) whether a counter rose until the next frame."""
    counter = players[counter_name(kind)]
    rose = np.zeros(counter.shape, np.bool_)
    rose[:-1] = (counter[1:] > counter[:-1]) & (counter[:-1] >= 0)
    return rose


def _legs(frames: Columns, players: Columns, log: Columns, accepted: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (n_frames, 22, 2, 2) power and direction of both legs where the player dashed.

    Of several two-leg dashes the first of each leg counts. A plain dash, a turn, a move or a tackle takes both legs,
    if it is among the ``accepted`` commands.
    """
    legs = np.full((*players["state"].shape, 2, 2), np.nan)
    dashed = rose(players, CommandKind.DASH) & follows(frames)[:, None]
    plain = accepted[(log["kind"][accepted] == CommandKind.DASH) & (log["legs"][accepted] == 0)]
    plain = plain[dashed[_place(log, plain)]]
    legs[_place(log, plain)] = np.stack([log["arg0"][plain], log["arg1"][plain]], axis=-1)[:, None, :]
    of_player = (log["frame"] >= 0) & (log["unum"] > 0) & log["valid"]
    with_legs = of_player & (log["legs"] > 0)
    if not with_legs.any():
        return legs
    taking = with_legs.copy()
    taking[accepted] |= np.isin(log["kind"][accepted], _TAKING_LEGS)
    free: dict[tuple[int, int], int] = {}
    for index in np.flatnonzero(taking):
        frame, slot = (int(part[0]) for part in _place(log, np.array([index])))
        left, taken = free.get((frame, slot), 3), int(log["legs"][index]) or 3
        for leg in (0, 1):
            if with_legs[index] and left & taken & (1 << leg) and dashed[frame, slot]:
                legs[frame, slot, leg] = log[f"arg{2 * leg}"][index], log[f"arg{2 * leg + 1}"][index]
        free[frame, slot] = left & ~taken
    return legs


def _necks(frames: Columns, players: Columns, log: Columns) -> NDArray[np.float64]:
    """Return (n_frames, 22) the moments of executed turns of the neck, the first of each cycle; 0 none, NaN unknown."""
    moments = np.full(players["state"].shape, np.nan)
    index = np.flatnonzero(
        (log["kind"] == CommandKind.TURN_NECK) & log["valid"] & (log["frame"] >= 0) & (log["unum"] > 0)
    )[::-1]  # of several the last written stays: the first in the log
    moments[_place(log, index)] = log["arg0"][index]
    return np.where(rose(players, CommandKind.TURN_NECK) & follows(frames)[:, None], moments, 0.0)
