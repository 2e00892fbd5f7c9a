"""``recover``: the commands of a match from its game log alone.

Counters say which commands the server executed, and what ball and players did says with which numbers: each effect is
worked out backwards, up to the noise that the server added to it.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.dynamics.bodies import BALL
from teamclone.dynamics.contacts import BOUNCE
from teamclone.dynamics.inverse.dash import dashes
from teamclone.dynamics.inverse.observed import At, Observed, observe
from teamclone.dynamics.inverse.push import Pushes, kicks, tackles
from teamclone.dynamics.inverse.recovered import Basis, Recovered
from teamclone.dynamics.inverse.turn import neck_turns, turns
from teamclone.dynamics.logged import RESOLUTION, rose
from teamclone.dynamics.rules import Rules
from teamclone.logs.align import executed_kind, follows
from teamclone.logs.columns import counter_name
from teamclone.logs.match import Columns
from teamclone.rcss import pitch, state_bits
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import BALL_KICKED, BALL_TACKLED

_APART = 0.35
"""Metres by which a collision puts a player away from where it moved to, but for crowds."""


def recover(frames: Columns, players: Columns, rules: Rules) -> Recovered:
    """Return the commands that the server executed in a match.

    Args:
        frames: ``columns.FRAMES``, (n_frames,). players: ``columns.PLAYERS``, (n_frames, 22).
        rules: of the match.

    Raises:
        IndexError: a player has a type that the rules do not list.
    """
    observed = observe(frames, players, rules)
    goes_on = follows(frames)
    # What is done in the pause after a half that ends while the clock stands is counted in the next frame, too.
    goes_on[:-1] &= ~(rules.ends_half(frames["cycle"][:-1]) & (np.diff(frames["cycle"]) > 0))
    kind = np.where(goes_on[:, None], _kinds(frames, players), 0).astype(np.uint8)
    dashed = rose(players, CommandKind.DASH) & goes_on[:, None]
    necks = rose(players, CommandKind.TURN_NECK) & goes_on[:, None]
    beside = dashed & (kind != CommandKind.DASH) & rules.legs
    parts = [
        _dashes(observed, np.nonzero((kind == CommandKind.DASH) | beside)),
        _turns(observed, np.nonzero(kind == CommandKind.TURN)),
        *_pushes(observed, players, kind),
        _catches(observed, np.nonzero(kind == CommandKind.CATCH)),
        _moves(observed, np.nonzero(kind == CommandKind.MOVE)),
        _necks(observed, np.nonzero(necks)),
    ]
    made = {
        item.name: np.concatenate([getattr(part, item.name) for part in parts])
        for item in fields(Recovered)
        if item.name != "gaps"
    }
    after = np.where(made["kind"] == CommandKind.TURN_NECK, 2, made["kind"] == CommandKind.DASH)
    order = np.argsort((made["frame"].astype(np.int64) * N_PLAYERS + made["slot"]) * 3 + after)
    return Recovered(**{name: values[order] for name, values in made.items()}, gaps=_gaps(players, rules))


def _kinds(frames: Columns, players: Columns) -> NDArray[np.uint8]:
    """Return (n_frames, 22) executed body commands, see `executed_kind`; by the state where the log does not count."""
    kind = executed_kind(frames, players)
    state, known = players["state"], follows(frames)[:-1, None]
    after = state[1:]
    begun = ((after & state_bits.TACKLES) != 0) & ((state[:-1] & state_bits.TACKLES) == 0)
    by_state = {
        CommandKind.TACKLE: begun,
        CommandKind.CATCH: (after & state_bits.CATCHES) == state_bits.CATCH,
        CommandKind.KICK: (after & state_bits.KICKS) == state_bits.KICK,
    }
    for one, did in by_state.items():
        uncounted = (players[counter_name(one)] < 0).all()
        kind[:-1][did & known & uncounted] = one
    return kind


def _gaps(players: Columns, rules: Rules) -> tuple[str, ...]:
    """Return what the log cannot give, a line each."""
    if not len(players["state"]):
        return ()

    def lacks(name: str) -> bool:
        values = players[name]
        return bool((values < 0).all() if name.startswith("count_") else np.isnan(values).all())

    found = []
    if lacks("count_dash"):
        found.append(
            "dashes, turns and moves: the log does not count commands; kicks, tackles and catches by the states"
        )
    elif lacks("count_tackle"):
        found.append("a tackle as soon as the last one ends: the log does not count tackles; others by the states")
    if lacks("vx"):
        found.append("numbers of commands: the log has no velocities")
    elif lacks("stamina"):
        found.append("powers of dashes but from their movement: the log has no stamina")
    elif lacks("capacity") and rules.server["stamina_capacity"] >= 0:
        found.append("powers of dashes of players that are fresh, or have no capacity left: the log has no capacity")
    return tuple(found)


def _part(
    at: At,
    kind: CommandKind,
    numbers: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    basis: NDArray[np.uint8],
    *,
    turned: NDArray[np.float64] | None = None,
) -> Recovered:
    """Return commands of one kind.

    Args:
        numbers: value, low and high, each (m,) or (m, 1) of a command with one number, else (m, 2).
    """

    def both(values: NDArray[np.float64]) -> NDArray[np.float64]:
        padded = np.full((len(at[0]), 2), np.nan)
        table = values if values.ndim == 2 else values[:, None]
        padded[:, : table.shape[1]] = table
        return padded

    value, low, high = map(both, numbers)
    return Recovered(
        frame=at[0].astype(np.int32),
        slot=at[1].astype(np.int8),
        kind=np.full(len(at[0]), kind, np.uint8),
        value=value,
        low=low,
        high=high,
        basis=basis.astype(np.uint8),
        turned=np.zeros(len(at[0])) if turned is None else turned,
    )


def _dashes(observed: Observed, at: At) -> Recovered:
    made = dashes(observed, at)
    basis = np.select(
        [np.isnan(made.value[:, 1]), made.turned != 0, made.bounded, observed.contact[at]],
        [Basis.HIDDEN, Basis.LEGS, Basis.BOUND, Basis.CONTACT],
        Basis.MOVEMENT,
    )
    return _part(at, CommandKind.DASH, (made.value, made.low, made.high), basis, turned=made.turned)


def _turns(observed: Observed, at: At) -> Recovered:
    value, low, high = turns(observed, at)
    basis = np.where(np.isnan(value), Basis.HIDDEN, Basis.MOVEMENT)
    return _part(at, CommandKind.TURN, (value, low, high), basis)


def _necks(observed: Observed, at: At) -> Recovered:
    value, low, high = neck_turns(observed, at)
    basis = np.where(high - low > 1.0, Basis.BOUND, Basis.MOVEMENT)
    return _part(at, CommandKind.TURN_NECK, (value, low, high), basis)


def _pushes(observed: Observed, players: Columns, kind: NDArray[np.uint8]) -> tuple[Recovered, Recovered]:
    """Return kicks and tackles."""
    mode = observed.before.mode[:, None]
    after = np.zeros_like(players["state"])
    after[:-1] = players["state"][1:]
    kicked = (kind == CommandKind.KICK) & BALL_KICKED[mode]
    tackled = (kind == CommandKind.TACKLE) & ((after & state_bits.TACKLES) == state_bits.TACKLE) & BALL_TACKLED[mode]
    caught = kind == CommandKind.CATCH
    shared = ((kicked | tackled | caught).sum(axis=-1) > 1)[:, None]
    seen = ~np.isnan(observed.vx[:, BALL:] + observed.vy[:, BALL:] + observed.before.vy[:, BALL:])

    def part(one: CommandKind, pushed: NDArray[np.bool_], made: Pushes, ranges: list[float]) -> Recovered:
        at = np.nonzero(kind == one)
        numbers = [
            np.tile(np.array(side), (len(at[0]), 1)) for side in (np.nan * np.array(ranges), -np.array(ranges), ranges)
        ]
        basis = np.where((pushed & shared)[at], Basis.SHARED, Basis.HIDDEN)
        alone = (pushed & ~shared & seen)[at]
        for values, found in zip(numbers, (made.value, made.low, made.high), strict=True):
            values[alone] = found
        contact = observed.contact[at[0][alone], BALL]
        basis[alone] = np.select(
            [np.isnan(made.value[:, 0]), made.bounded, contact],
            [Basis.HIDDEN, Basis.BOUND, Basis.CONTACT],
            Basis.MOVEMENT,
        )
        return _part(at, one, (numbers[0], numbers[1], numbers[2]), basis)

    made = kicks(observed, np.nonzero(kicked & ~shared & seen)), tackles(observed, np.nonzero(tackled & ~shared & seen))
    power = observed.rules.server["maxpower"]
    return (
        part(CommandKind.KICK, kicked, made[0], [power, 180.0]),
        part(CommandKind.TACKLE, tackled, made[1], [180.0]),
    )


def _catches(observed: Observed, at: At) -> Recovered:
    """Return catches: towards the ball, and all directions in which the ball is within reach."""
    before, server = observed.before, observed.rules.server
    ball = at[0], np.full(len(at[0]), BALL)
    dx, dy = before.x[ball] - before.x[at], before.y[ball] - before.y[at]
    towards = formulas.degrees(np.arctan2(dy, dx) - np.radians(before.body[at]))
    distance = np.hypot(dx, dy)
    aside = np.minimum(0.5 * server["catchable_area_w"] / np.maximum(distance, 1e-9), 1.0)
    half = np.degrees(np.arcsin(aside))
    limits = server["min_catch_angle"], server["max_catch_angle"]
    value = np.clip(towards, *limits)
    ends = [np.clip(towards + side * half, *limits) for side in (-1.0, 1.0)]
    return _part(at, CommandKind.CATCH, (value, ends[0], ends[1]), np.full(len(value), Basis.BOUND))


def _moves(observed: Observed, at: At) -> Recovered:
    """Return moves: the place that the player's movement in the cycle began from."""
    before = observed.before
    after = at[0] + 1, at[1]
    contact = observed.contact[at]
    faster = np.where(contact, 1.0 / BOUNCE, 1.0) / observed.of(at, "player_decay")
    # The server turns the places of the right team.
    side = np.where(at[1] < N_TEAM, 1.0, -1.0)
    value = side[:, None] * np.stack(
        [before.x[after] - before.vx[after] * faster, before.y[after] - before.vy[after] * faster], axis=-1
    )
    blur = np.where(contact, _APART, RESOLUTION + 0.5 * RESOLUTION * np.abs(faster))[:, None]
    basis = np.where(contact, Basis.CONTACT, Basis.MOVEMENT)
    basis[np.isnan(value[:, 0])] = Basis.HIDDEN
    edge = np.array([pitch.MAX_X, pitch.MAX_Y])
    low, high = (np.where(np.isnan(value), -side_of * edge, value - side_of * blur) for side_of in (1.0, -1.0))
    return _part(at, CommandKind.MOVE, (value, low, high), basis)
