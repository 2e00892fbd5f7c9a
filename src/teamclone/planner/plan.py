"""The plan of a player at the ball: all ways to play it, their values, and which one an agent of HELIOS Base takes.

A player that can score shoots; one with an opponent at the ball clears it towards the goal; else the best of passes,
dribbles and self passes that no opponent reaches in time is taken, if it is worth more than where the ball is, which is
held otherwise. Of a player that may tackle the ball the plan says where to.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from teamclone.planner import dribble, passes
from teamclone.planner.ball import fastest_from, kick_rate
from teamclone.planner.candidates import VALUE
from teamclone.planner.columns import CHOICES, MOST_VALUE_M, PLAN, UNDERWAY
from teamclone.planner.dribble import best_dribble
from teamclone.planner.field_evaluator import evaluate
from teamclone.planner.hold_ball import hold_ball, stays
from teamclone.planner.keep_dribble import underway
from teamclone.planner.kick_sequences import ORDER_FIELDS, Target, best_sequence, cut_off, kick_order
from teamclone.planner.passes import best_pass
from teamclone.planner.scene import (
    ACTOR,
    AREA,
    BALL,
    BODY,
    FROZEN,
    GAIN,
    GOAL_X,
    GOALKEEPER,
    OFFSIDE,
    OPPONENT,
    PRESENT,
    RECEIVES,
    SERVER,
    Array,
    X,
    Y,
    along,
    complete,
    direction,
    gap,
    turned,
)
from teamclone.planner.self_pass import best_self_pass
from teamclone.planner.shoot import best_shot
from teamclone.planner.tackle import best_tackle, can_tackle
from teamclone.system.compiling import kernel

_SHOT, _CLEAR, _PASS, _DRIBBLE, _SELF_PASS, _HOLD, _PREPARE, _TURN, _LEAVE = range(len(CHOICES))
_WAY = PLAN.index("shot_vx")
"""Where the velocities begin."""
_THERE, _VALUE, _KICKS = PLAN.index("shot_there"), PLAN.index("pass_value"), PLAN.index("pass_kicks")
_UNDERWAY, _TACKLE = PLAN.index("underway_dribble_m"), PLAN.index("tackle_there")
ENOUGH_SHOT, ENOUGH_PASS = 0.99, 0.96
"""Parts of the wanted speed that will do."""
FORWARD_X, FORWARD_DEG, FREE_M = 42.0, 110.0, 4.0
"""A player that faces so far away from this place, and has no opponent so near, turns towards it first."""
CLEAR_X, CLEAR_FROM_X, CLEAR_FROM_Y = 45.0, 36.0, 10.0
"""Where to the ball is cleared from the sides of the goal line."""


@kernel
def _clear(scene: Array) -> tuple[float, float]:
    """Return the velocity of a ball that is cleared towards the goal, or before it."""
    me, ball = scene[ACTOR], scene[BALL]
    goal_x = CLEAR_X if me[X] > CLEAR_FROM_X and abs(me[Y]) > CLEAR_FROM_Y else GOAL_X
    metres = max(gap(goal_x, 0.0, ball[X], ball[Y]), 1e-9)
    cos, sin = (goal_x - ball[X]) / metres, -ball[Y] / metres
    speed = fastest_from(scene, cos, sin, ball[GAIN])
    return speed * cos, speed * sin


@kernel
def _shoot(scene: Array, order: NDArray[np.int64]) -> tuple[bool, float, float]:
    """Return whether there is a shot, and the velocity of the ball after its first kick."""
    x, y, speed, one = best_shot(scene)
    if speed == 0:
        return False, 0.0, 0.0
    ball, enough = scene[BALL], ENOUGH_SHOT * speed
    if one > enough and not cut_off(scene, Target(x, y, one, one)):
        part = one / gap(x, y, ball[X], ball[Y])
        return True, part * (x - ball[X]), part * (y - ball[Y])
    reached, vx, vy = best_sequence(scene, order, Target(x, y, speed, enough))
    return reached > 0, vx, vy


@kernel
def _play(scene: Array, order: NDArray[np.int64], passed: Array) -> tuple[bool, float, float]:
    """Return whether a pass can be played, and the velocity of the ball after its first kick."""
    if passed[passes.KICKS] > 1:
        speed = passed[passes.SPEED]
        target = Target(passed[passes.TO_X], passed[passes.TO_Y], speed, ENOUGH_PASS * speed)
        reached, vx, vy = best_sequence(scene, order, target)
        return reached >= target.enough, vx, vy
    angle = math.radians(passed[passes.DIRECTION])
    cos, sin = math.cos(angle), math.sin(angle)
    speed = min(passed[passes.SPEED], fastest_from(scene, cos, sin, scene[BALL, GAIN]))
    return speed > 0, speed * cos, speed * sin


@kernel
def _free(scene: Array) -> bool:
    """Return whether no opponent is near."""
    me = scene[ACTOR]
    for opponent in range(OPPONENT, BALL):
        if gap(scene[opponent, X], scene[opponent, Y], me[X], me[Y]) < FREE_M:
            return False
    return True


@kernel
def _receivers(scene: Array, actor: int) -> None:
    """Fill GAIN and OFFSIDE of the ball, and which team mates may get a pass."""
    ball, me = scene[BALL], scene[ACTOR]
    aside = direction(ball[X] - me[X], ball[Y] - me[Y]) - me[BODY]
    ball[GAIN] = kick_rate(me, gap(ball[X], ball[Y], me[X], me[Y]), aside)
    first, second = 0.0, 0.0
    for opponent in range(OPPONENT, BALL):
        if scene[opponent, PRESENT] > 0:
            x = scene[opponent, X]
            first, second = max(first, x), max(second, min(first, x))
    ball[OFFSIDE] = max(second, ball[X])
    for mate in range(OPPONENT):
        player = scene[mate]
        back = player[GOALKEEPER] > 0 and player[X] < passes.GOALKEEPER_BACK_X
        free = mate != actor and player[FROZEN] == 0 and not back
        near = gap(player[X], player[Y], ball[X], ball[Y]) <= passes.FARTHEST_M
        player[RECEIVES] = free and near and player[X] <= ball[OFFSIDE]


@kernel
def _compare(values: Array, made: Array) -> int:
    """Fill by how much each value is beyond the best of the others, and return the index of the best."""
    best = len(values) - 1
    for index in range(len(values)):
        if values[index] > values[best]:
            best = index
    for index in range(len(values)):
        rest = -np.inf
        for other in range(len(values)):
            if other != index:
                rest = max(rest, values[other])
        made[index] = min(max(values[index] - rest, -MOST_VALUE_M), MOST_VALUE_M)
    return best


@kernel
def _plan_with_ball(scene: Array, actor: int, order: NDArray[np.int64], made: Array) -> None:
    """Fill the plan of a player that can kick the ball, see `plan_scene`."""
    me, ball = scene[ACTOR], scene[BALL]
    own_m = gap(ball[X], ball[Y], me[X], me[Y])
    contested, left = False, False
    for player in range(BALL):
        other = scene[player]
        away = gap(ball[X], ball[Y], other[X], other[Y])
        if player >= OPPONENT:
            contested |= away < other[AREA] and other[FROZEN] == 0
        elif player != actor:
            left |= away < min(other[AREA], own_m)

    made[0] = 1.0
    velocity, there = made[_WAY:], made[_THERE:]
    shoots, velocity[2 * _SHOT], velocity[2 * _SHOT + 1] = _shoot(scene, order)
    there[_SHOT], there[_CLEAR] = shoots, contested
    velocity[2 * _CLEAR], velocity[2 * _CLEAR + 1] = _clear(scene)
    passed, dribbled, ran = best_pass(scene), best_dribble(scene), best_self_pass(scene)
    if passed[passes.KICKS] > 0:
        plays, velocity[2 * _PASS], velocity[2 * _PASS + 1] = _play(scene, order, passed)
        there[_PASS] = plays
        made[_KICKS], made[_KICKS + 1] = passed[passes.KICKS], passed[passes.ARRIVES]
    for way, found in ((_DRIBBLE, dribbled), (_SELF_PASS, ran)):
        if found[VALUE] > -np.inf:
            angle = math.radians(found[dribble.DIRECTION])
            there[way] = 1.0
            velocity[2 * way] = found[dribble.SPEED] * math.cos(angle)
            velocity[2 * way + 1] = found[dribble.SPEED] * math.sin(angle)
    made[_UNDERWAY : _UNDERWAY + len(UNDERWAY)] = underway(scene)
    turns, velocity[2 * _HOLD], velocity[2 * _HOLD + 1] = hold_ball(scene)
    there[_HOLD] = not turns

    held = evaluate(scene, ball[X], ball[Y], True)
    values = np.array([passed[VALUE], dribbled[VALUE], ran[VALUE], held])
    best = _compare(values, made[_VALUE:])
    backward = abs(turned(direction(FORWARD_X - me[X], -me[Y]) - me[BODY])) >= FORWARD_DEG
    if left:
        choice = _LEAVE
    elif shoots:
        choice = _SHOT
    elif contested:
        choice = _CLEAR
    elif backward and _free(scene) and stays(scene, 0.2):
        choice = _TURN
    elif best == 0:
        choice = (_PREPARE if passed[passes.KICKS] > 1 else _PASS) if there[_PASS] else _HOLD
    elif best < len(values) - 1:
        choice = _DRIBBLE if best == 1 else _SELF_PASS
    else:
        choice = _TURN if turns else _HOLD
    made[1 + choice] = 1.0


@kernel
def plan_scene(scene: Array, actor: int, order: NDArray[np.int64], made: Array) -> None:
    """Fill PLAN of one scene.

    Args:
        scene: (ROWS, COLUMNS) see `planner.scene`. order: see `kick_order`. made: (len(PLAN),) zeros.
    """
    if scene[actor, PRESENT] == 0 or not np.isfinite(scene).all():  # whatever a log may hold
        return
    me, ball = scene[actor], scene[BALL]
    body = math.radians(me[BODY])
    ahead, aside = along(ball[X] - me[X], ball[Y] - me[Y], math.cos(body), math.sin(body))
    able, tackles = math.hypot(ahead, aside) <= me[AREA], can_tackle(scene[SERVER], ahead, aside)
    if not able and not tackles:
        return
    complete(scene, actor)
    if able:
        _receivers(scene, actor)
        _plan_with_ball(scene, actor, order, made)
    if tackles:
        made[_TACKLE], made[_TACKLE + 1] = 1.0, best_tackle(scene)
    if not np.isfinite(made).all():  # a player that no server makes: of a type, say, that never slows down
        made[:] = 0.0


_order = lru_cache(maxsize=64)(kick_order)


@lru_cache(maxsize=16)
def _orders(servers: tuple[tuple[float, ...], ...]) -> NDArray[np.int64]:
    """Return (len(servers), ...) the `kick_order` of each of these values of ORDER_FIELDS."""
    return np.stack([_order(server) for server in servers])


def orders_of(server: NDArray[np.floating]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return every different `kick_order` of some servers, and (n,) which of them each has.

    Args:
        server: (n, fields) as `server_params.FIELDS`.
    """
    fields = server[:, ORDER_FIELDS].astype(np.float64)
    if (fields == fields[:1]).all():  # sorting takes longer than all the rest of a single answer
        return _orders((tuple(fields[0].tolist()),)), np.zeros(len(server), np.int64)
    servers, which = np.unique(fields, axis=0, return_inverse=True)
    return _orders(tuple(map(tuple, servers.tolist()))), which.reshape(-1)
