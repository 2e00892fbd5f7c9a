"""Commands that change places as soon as the server reads them: moves and catches (rcssserver `player.cpp`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.dynamics.bodies import BALL, Bodies, Commands, radii
from teamclone.dynamics.contacts import BOUNCE, collide
from teamclone.dynamics.rules import Rules
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.playmodes import MAY_MOVE, PlayMode

_MAY_CATCH = np.isin(np.arange(256), (PlayMode.PLAY_ON, PlayMode.PENALTY_TAKEN_L, PlayMode.PENALTY_TAKEN_R))


@dataclass(frozen=True, slots=True, kw_only=True)
class Caught:
    """What the catches of n cycles do.

    Attributes:
        tried: (n, 22) bool, who may not catch again for a while.
        by: (n,) whose catch succeeds, -1 nobody's.
        x, y: (n,) acceleration of a ball that a goalkeeper reaches and does not hold.
    """

    tried: NDArray[np.bool_]
    by: NDArray[np.intp]
    x: NDArray[np.float64]
    y: NDArray[np.float64]


def receive(
    bodies: Bodies,
    commands: Commands,
    rules: Rules,
    *,
    rng: np.random.Generator | None = None,
    succeeded: NDArray[np.bool_] | None = None,
) -> tuple[Bodies, Caught]:
    """Return bodies after the moves and successful catches of n cycles, and what the catches do.

    Bodies that then overlap collide at once. In which order the server reads the commands of a cycle is random. Here
    these come before all others.

    Args:
        rng: draws whether catches succeed; None for the likelier.
        succeeded: (n, 22) whether they do, where that is known.
    """
    moves = (commands.kind == CommandKind.MOVE) & bodies.on_field & MAY_MOVE[bodies.mode][:, None]
    caught = _catch(bodies, commands, rules, rng=rng, succeeded=succeeded)
    cycles = np.flatnonzero(caught.by >= 0)
    rows = np.union1d(cycles, np.flatnonzero(moves.any(axis=-1)))
    if not len(rows):
        return bodies, caught
    x, y, vx, vy, body, mode = (getattr(bodies, name).copy() for name in ("x", "y", "vx", "vy", "body", "mode"))
    at = np.nonzero(moves)
    turned = np.where(at[1] < N_TEAM, 1.0, -1.0)
    x[at], y[at] = (turned * commands.numbers[..., axis][at] for axis in (0, 1))
    keeper = cycles, caught.by[cycles]
    ball, radius = (cycles, np.full(len(cycles), BALL)), radii(bodies, rules)
    angle = np.arctan2(y[ball] - y[keeper], x[ball] - x[keeper])
    reach = radius[keeper] + radius[ball]
    x[keeper], y[keeper] = x[ball] - reach * np.cos(angle), y[ball] - reach * np.sin(angle)
    body[keeper] = formulas.degrees(angle)
    for velocity in (vx, vy):
        velocity[keeper] = velocity[ball] = 0.0
    if rules.referee:
        mode[cycles] = np.where(keeper[1] < N_TEAM, PlayMode.FREE_KICK_L, PlayMode.FREE_KICK_R)
    some_x, some_y = x[rows], y[rows]
    touched = collide(some_x, some_y, radius[rows], ball_stays=mode[rows] != PlayMode.PLAY_ON, rng=rng)
    x[rows], y[rows] = some_x, some_y
    for velocity in (vx, vy):
        velocity[rows] *= np.where(touched, BOUNCE, 1.0)
    return replace(bodies, x=x, y=y, vx=vx, vy=vy, body=body, mode=mode), caught


def hold(bodies: Bodies, caught: Caught, rules: Rules) -> Bodies:
    """Return bodies at the end of a cycle with the balls that were caught in front of their goalkeepers.

    Those who tried are banned from catching for some cycles.
    """
    if not caught.tried.any():
        return bodies
    x, y, vx, vy = (getattr(bodies, name).copy() for name in ("x", "y", "vx", "vy"))
    # Without a referee nobody takes notice of the catch, and the ball lies free.
    cycles = np.flatnonzero((caught.by >= 0) & rules.referee)
    keeper = cycles, caught.by[cycles]
    angle = np.radians(bodies.body[keeper])
    reach = rules.types["player_size"][bodies.type[keeper]] + rules.server["ball_size"]
    x[cycles, BALL], y[cycles, BALL] = x[keeper] + reach * np.cos(angle), y[keeper] + reach * np.sin(angle)
    vx[cycles, BALL] = vy[cycles, BALL] = 0.0
    banned = np.where(caught.tried, int(rules.server["catch_ban_cycle"]) - 1, bodies.banned)
    return replace(bodies, x=x, y=y, vx=vx, vy=vy, banned=banned)


def _catch(
    bodies: Bodies,
    commands: Commands,
    rules: Rules,
    *,
    rng: np.random.Generator | None,
    succeeded: NDArray[np.bool_] | None,
) -> Caught:
    """Return what the catches do."""
    server = rules.server
    tried = (commands.kind == CommandKind.CATCH) & bodies.on_field & bodies.goalie & (bodies.banned == 0)
    tried &= _MAY_CATCH[bodies.mode][:, None]
    at = np.nonzero(tried)
    direction = np.clip(commands.numbers[..., 0][at], server["min_catch_angle"], server["max_catch_angle"])
    angle = np.radians(bodies.body[at] + direction)
    dx, dy = bodies.x[at[0], BALL] - bodies.x[at], bodies.y[at[0], BALL] - bodies.y[at]
    chance = formulas.catch_chance(
        dx * np.cos(angle) + dy * np.sin(angle),
        dy * np.cos(angle) - dx * np.sin(angle),
        rules.types["catchable_area_l_stretch"][bodies.type[at]],
        server=server,
    )
    drawn = rng.random(len(chance)) if rng is not None else np.full(len(chance), 0.5)
    success = drawn < chance if succeeded is None else succeeded[at]
    by = np.full(len(bodies), -1, np.intp)
    by[at[0][success]] = at[1][success]
    # A ball that is reached and not held turns around, along the direction of the catch.
    along = bodies.vx[at[0], BALL] * np.cos(angle) + bodies.vy[at[0], BALL] * np.sin(angle)
    along = np.where(np.isnan(chance) | success | (not rules.catches_fail), 0.0, along)
    if not rules.catches_fail:
        tried[at] = success
    x, y = np.zeros(len(bodies)), np.zeros(len(bodies))
    np.add.at(x, at[0], -2.0 * along * np.cos(angle))
    np.add.at(y, at[0], -2.0 * along * np.sin(angle))
    return Caught(tried=tried, by=by, x=x, y=y)
