"""The time in which each player can have the ball, by the physics of the next cycles.

The simple model that agents of the league use of each other: coast, as many turns as the angle needs, then dashes at
full power. The actor may also dash sideways, which is the quicker way when the ball is close.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.planner.motion import dash_rate
from teamclone.planner.scene import (
    AREA,
    BALL,
    BALL_DECAY,
    BODY,
    COLUMNS,
    DASH_RATE,
    DECAY,
    EFFORT_MAX,
    INERTIA,
    OPPONENT,
    PRESENT,
    ROWS,
    SERVER,
    VX,
    VY,
    Array,
    X,
    Y,
    fill_scene,
)
from teamclone.rcss.players import N_PLAYERS
from teamclone.system.compiling import kernel

REACH_CYCLES = 40
"""Cycles for which reaching the ball is looked at; beyond it the rest of the way counts at full speed."""
NEVER_CYCLES = 100.0
"""Cycles to the ball of a player off the field, and the maximum for all players."""
MATE_RESERVE_M = 0.2
"""By how much agents of the league take a team mate's reach of the ball to be shorter, so as not to wait for it."""
TURN_MARGIN_DEG = 15.0
"""A player dashes without a turn if the target is at most so far off the body."""
BACKWARD_M = 10.0
"""A target nearer than this may lie behind a player, which then runs backwards instead of turning."""


@kernel
def fill_path(scene: Array, held: bool, path: Array) -> None:
    """Fill (REACH_CYCLES + 1, 2) the ball's place after 0, 1, ... cycles if no player touches it.

    Args:
        held: the ball is under an opponent's control and is taken to stay.
    """
    ball = scene[BALL]
    vx, vy = (0.0, 0.0) if held else (ball[VX], ball[VY])
    x, y, decay = ball[X], ball[Y], scene[SERVER, BALL_DECAY]
    for cycle in range(REACH_CYCLES + 1):
        path[cycle, 0], path[cycle, 1] = x, y
        x, y = x + vx, y + vy
        vx, vy = vx * decay, vy * decay


@kernel
def turns_needed(off: float, metres: float, area: float, within: tuple[float, float]) -> int:
    """Return the turns until a player that is ``off`` radians off a target passes it within ``area``.

    Args:
        within: radians that one turn and two turns reach.
    """
    margin = max(math.asin(min(area / metres, 1.0)), math.radians(TURN_MARGIN_DEG))
    need = off - margin
    return int(need > 0) + int(need > within[0]) + int(need > within[1])


@kernel
def cycles_to_ball(scene: Array, path: Array, row: int, reserve: float, slides: bool) -> float:
    """Return the cycles after which a player can have the ball, at most NEVER_CYCLES; 0 if it can kick it now.

    Args:
        path: see `fill_path`. row: of the player in the scene.
        reserve: metres by which its reach is shorter. slides: it dashes sideways, too.
    """
    player = scene[row]
    if player[PRESENT] == 0:
        return NEVER_CYCLES
    decay, area = player[DECAY], player[AREA] - reserve
    speed, body = math.hypot(player[VX], player[VY]), math.radians(player[BODY])
    cos, sin = math.cos(body), math.sin(body)
    first = math.pi / (1.0 + player[INERTIA] * speed)
    within = first, first + math.pi / (1.0 + player[INERTIA] * speed * decay)
    top = 100.0 * player[DASH_RATE] * player[EFFORT_MAX] / (1.0 - decay)
    # Metres that the player coasts, and that as many dashes cover from rest, after 0, 1, ... cycles.
    coasted, part = 0.0, 1.0
    run = np.empty(REACH_CYCLES + 1)
    left = metres = 0.0
    for cycle in range(REACH_CYCLES + 1):
        run[cycle] = top * (cycle - decay * coasted)
        x = path[cycle, 0] - player[X] - player[VX] * coasted
        y = path[cycle, 1] - player[Y] - player[VY] * coasted
        coasted, part = coasted + part, part * decay
        metres = math.sqrt(x * x + y * y + 1e-9)
        if metres <= area:
            return float(cycle)
        left = metres - area
        if run[cycle] < left:  # even without a turn
            continue
        off = math.acos(min(max((x * cos + y * sin) / metres, -1.0), 1.0))
        if slides and run[cycle] * dash_rate(scene[SERVER], math.degrees(off)) >= left:
            return float(cycle)
        facing = math.pi - off if metres < BACKWARD_M and off > math.pi / 2 else off
        if run[max(cycle - turns_needed(facing, metres, area, within), 0)] >= left:
            return float(cycle)
    late = REACH_CYCLES + max(left - run[REACH_CYCLES], 0.0) / top
    # A type that no server makes may give any number, or none.
    return max(late, float(REACH_CYCLES)) if late < NEVER_CYCLES else NEVER_CYCLES


@kernel
def fill_times(scene: Array, held: bool, path: Array, steps: Array) -> None:
    """Fill the path of the ball, and (22,) the cycles in which each player can have it, a team mate with its reserve.

    NEVER_CYCLES for a player off the field.
    """
    fill_path(scene, held, path)
    for row in range(N_PLAYERS):
        steps[row] = cycles_to_ball(scene, path, row, MATE_RESERVE_M if row < OPPONENT else 0.0, False)


@kernel
def own_cycles(scene: Array, path: Array, actor: int) -> float:
    """Return `cycles_to_ball` of the actor itself."""
    return cycles_to_ball(scene, path, actor, 0.0, True)


class Reach(NamedTuple):
    """The times in which players can have the ball, each as the actor judges it.

    Attributes:
        steps: (n, 22) cycles, 0 for a player that can kick it now, NEVER_CYCLES for one off the field.
        ball: (n, REACH_CYCLES + 1, 2) the ball's place after 0, 1, ... cycles if no player touches it.
    """

    steps: Array
    ball: Array


@kernel
def _reach_all(
    parts: tuple[Array, Array, Array, Array],
    actor: NDArray[np.int64],
    held: NDArray[np.bool_],
    made: Reach,
) -> None:
    ball, players, types, server = parts
    scene = np.zeros((ROWS, COLUMNS))
    for index in range(len(actor)):
        fill_scene(ball[index], players[index], types[index], server[index], scene)
        fill_times(scene, held[index], made.ball[index], made.steps[index])
        made.steps[index, actor[index]] = own_cycles(scene, made.ball[index], actor[index])


def reach_ball(
    ball: NDArray[np.floating],
    players: NDArray[np.floating],
    types: NDArray[np.floating],
    server: NDArray[np.floating],
    *,
    actor: NDArray[np.int64],
    held: NDArray[np.bool_],
) -> Reach:
    """Return when each player can have the ball by turning towards it and dashing with full power.

    Args:
        ball: (n, 4). players: (n, 22, channels). types: (n, 22, fields). server: (n, fields); see `world.state.State`.
        actor: (n,) 0..10. held: (n,) the ball is under an opponent's control and is taken to stay.
    """
    n = len(actor)
    made = Reach(np.empty((n, N_PLAYERS)), np.empty((n, REACH_CYCLES + 1, 2)))
    parts = tuple(np.ascontiguousarray(part, np.float64) for part in (ball, players, types, server))
    _reach_all(parts, actor, held, made)
    return made
