"""The plan of who is at the ball: all ways to go on, what each is worth, and which an agent of HELIOS Base takes.

Who can score shoots; who has an opponent at the ball hits it towards the goal; else the best of passes, dribbles and
runs that no opponent reaches in time is taken, if it is worth more than where the ball is, which is held otherwise.
Of who may tackle the ball the plan says where to.
This and all numbers are as agents of HELIOS Base and its library librcsc act (Akiyama et al.,
github.com/helios-base), from their public sources and the logs; the code is our own.
"""

from __future__ import annotations

import math
import zlib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from teamclone.planner import dribble as dribbles
from teamclone.planner import passes
from teamclone.planner.dribble import best_dribble, best_going_on, best_run, underway
from teamclone.planner.field_evaluator import worth
from teamclone.planner.hold_ball import hold, stays
from teamclone.planner.kick_table import Wish, paths, several_kicks
from teamclone.planner.passes import (
    CYCLES,
    DIRECTION,
    FARTHEST_M,
    KEEPER_BACK_X,
    KICKS,
    SPEED,
    VALUE,
    best_pass,
)
from teamclone.planner.players import (
    AREA,
    BALL,
    BODY,
    GAIN,
    GOAL_X,
    KEEPER,
    ME,
    OFFSIDE,
    OPPONENT,
    RECEIVES,
    TACKLE_M,
    TACKLE_WIDTH_M,
    TACKLING,
    THERE,
    Array,
    X,
    Y,
    described,
    direction,
    fastest,
    gap,
    kernel,
    kick_rate,
    prepare,
    turned,
)
from teamclone.planner.shoot import best_shot
from teamclone.planner.tackle import best_tackle, can_tackle
from teamclone.rcss import pitch, server_params
from teamclone.system.compiling import tell_when_compiled
from teamclone.world.channels import CHANNEL
from teamclone.world.state import State

WAYS = ("shot", "clear", "pass", "dribble", "run", "hold")
"""Ways to kick."""
CHOICES = (*WAYS, "prepare", "turn", "dash", "leave")
"""What is taken: a way; the first kick of several; no kick but a turn or a dash; to leave it to a team mate who is
nearer."""
KICK_OF = {**{name: name for name in WAYS}, "prepare": "pass"}
"""The way of each choice that kicks."""
_SHOT, _CLEAR, _PASS, _DRIBBLE, _RUN, _HOLD, _PREPARE, _TURN, _DASH, _LEAVE = range(len(CHOICES))
WORTHS = ("pass", "dribble", "run", "dash", "hold")
"""What is compared."""
UNDERWAY = "dribble_m", "dribble_dashes", "run_m", "run_dashes", "turn_m", "turn_dashes"
"""As of `dribbles.underway`."""
PLAN = (
    "able",
    *(f"choose_{name}" for name in CHOICES),
    *(f"{name}_there" for name in WAYS),
    *(f"{name}_worth" for name in WORTHS),
    "pass_kicks",
    "pass_cycles",
    *(f"underway_{name}" for name in UNDERWAY),
    "tackle_there",
    "tackle_degrees",
    *(f"{name}_{axis}" for name in WAYS for axis in ("vx", "vy")),
)
"""What `plans` gives; all 0 but for who can kick the ball, and ``tackle_`` for who can tackle it, 0 for others. WORTHS
are metres beyond the best of the others, at most FAR_M; velocities those of the ball after the kick, metres per cycle
on the pitch; degrees are from his body."""
FAR_M = 20.0
NEAR_BALL_M = math.hypot(TACKLE_M, TACKLE_WIDTH_M)
"""More than any player reaches, and farther than any tackle."""
_WAY = PLAN.index("shot_vx")
"""Where the velocities begin."""
_THERE, _WORTH, _UNDERWAY = PLAN.index("shot_there"), PLAN.index("pass_worth"), PLAN.index("underway_dribble_m")
_TACKLE = PLAN.index("tackle_there")
ENOUGH_SHOT, ENOUGH_PASS = 0.99, 0.96
"""Parts of the wanted speed that will do."""
FORWARD_X, FORWARD_DEG, FREE_M = 42.0, 110.0, 4.0
"""Who faces so far away from this place, and has no opponent so near, turns towards it first."""
CLEAR_X, CLEAR_FROM_X, CLEAR_FROM_Y = 45.0, 36.0, 10.0
"""Where to the ball is hit from the sides of the goal line."""


@kernel
def _clear(scene: Array) -> tuple[float, float]:
    """Velocity of a ball that is hit towards the goal, or before it."""
    me, ball = scene[ME], scene[BALL]
    goal_x = CLEAR_X if me[X] > CLEAR_FROM_X and abs(me[Y]) > CLEAR_FROM_Y else GOAL_X
    metres = max(math.hypot(goal_x - ball[0], ball[1]), 1e-9)
    cos, sin = (goal_x - ball[0]) / metres, -ball[1] / metres
    speed = fastest(cos, sin, scene[BALL, GAIN], ball[2], ball[3])
    return speed * cos, speed * sin


@kernel
def _shoot(scene: Array, order: NDArray[np.int64]) -> tuple[bool, float, float]:
    """Whether there is a shot, and the velocity of the ball after its first kick."""
    x, y, speed, one = best_shot(scene)
    if speed == 0:
        return False, 0.0, 0.0
    if one > ENOUGH_SHOT * speed:
        enough = ENOUGH_SHOT * one - 1e-4
        reached, vx, vy = several_kicks(scene, order, Wish(x, y, one, enough), 1)
        if reached >= enough:
            return True, vx, vy
    reached, vx, vy = several_kicks(scene, order, Wish(x, y, speed, ENOUGH_SHOT * speed), 3)
    return reached > 0, vx, vy


@kernel
def _play(scene: Array, order: NDArray[np.int64], passed: Array) -> tuple[bool, float, float]:
    """Whether a pass can be played, and the velocity of the ball after its first kick."""
    angle = math.radians(passed[DIRECTION])
    cos, sin = math.cos(angle), math.sin(angle)
    if passed[KICKS] > 1:
        wish = Wish(passed[passes.TO_X], passed[passes.TO_Y], passed[SPEED], ENOUGH_PASS * passed[SPEED])
        reached, vx, vy = several_kicks(scene, order, wish, 3)
        return reached >= wish.enough, vx, vy
    speed = min(passed[SPEED], fastest(cos, sin, scene[BALL, GAIN], scene[BALL, 2], scene[BALL, 3]))
    return speed > 0, speed * cos, speed * sin


@kernel
def _free(scene: Array) -> bool:
    """Whether he may turn: nobody is near."""
    for opponent in range(OPPONENT, BALL):
        if gap(scene[opponent, X], scene[opponent, Y], scene[ME, X], scene[ME, Y]) < FREE_M:
            return False
    return True


@kernel
def _complete(scene: Array, actor: int) -> None:
    """Fill what of a scene follows from who can kick the ball."""
    ball, me = scene[BALL], scene[ME]
    own_m = gap(ball[0], ball[1], me[X], me[Y])
    ball[GAIN] = kick_rate(me, own_m, direction(ball[0] - me[X], ball[1] - me[Y]) - me[BODY])
    first, second = 0.0, 0.0
    for player in range(OPPONENT, BALL):
        if scene[player, THERE] > 0:
            x = scene[player, X]
            first, second = max(first, x), max(second, min(first, x))
    ball[OFFSIDE] = max(second, ball[0])
    for mate in range(OPPONENT):
        player = scene[mate]
        back = player[KEEPER] > 0 and player[X] < KEEPER_BACK_X
        away = gap(player[X], player[Y], ball[0], ball[1])
        there = mate != actor and player[TACKLING] == 0 and not back
        player[RECEIVES] = there and player[X] <= ball[OFFSIDE] and away <= FARTHEST_M


@kernel
def _plan_with_ball(scene: Array, actor: int, order: NDArray[np.int64], made: Array) -> None:
    """As of `plan`, for who can kick the ball."""
    me, ball = scene[ME], scene[BALL]
    own_m = gap(ball[0], ball[1], me[X], me[Y])
    contested, left = False, False
    for player in range(BALL):
        other = scene[player]
        away = gap(ball[0], ball[1], other[X], other[Y])
        if player >= OPPONENT:
            contested |= away < other[AREA] and other[TACKLING] == 0
        elif player != actor:
            left |= away < min(other[AREA], own_m)

    made[0] = 1.0
    velocity, there = made[_WAY:], made[_THERE:]
    shoots, velocity[2 * _SHOT], velocity[2 * _SHOT + 1] = _shoot(scene, order)
    there[_SHOT], there[_CLEAR] = shoots, contested
    velocity[2 * _CLEAR], velocity[2 * _CLEAR + 1] = _clear(scene)
    passed, dribbled, ran = best_pass(scene), best_dribble(scene), best_run(scene)
    if passed[KICKS] > 0:
        plays, velocity[2 * _PASS], velocity[2 * _PASS + 1] = _play(scene, order, passed)
        there[_PASS] = plays
        made[_WORTH + len(WORTHS)] = passed[KICKS]
        made[_WORTH + len(WORTHS) + 1] = passed[CYCLES]
    for way, found in ((_DRIBBLE, dribbled), (_RUN, ran)):
        if found[VALUE] > -np.inf:
            angle = math.radians(found[dribbles.DIRECTION])
            there[way] = 1.0
            velocity[2 * way] = found[dribbles.SPEED] * math.cos(angle)
            velocity[2 * way + 1] = found[dribbles.SPEED] * math.sin(angle)
    made[_UNDERWAY : _UNDERWAY + len(UNDERWAY)] = underway(scene)
    turns, velocity[2 * _HOLD], velocity[2 * _HOLD + 1] = hold(scene)
    there[_HOLD] = not turns

    worths = np.array(
        [
            passed[VALUE],
            dribbled[VALUE],
            ran[VALUE],
            best_going_on(scene),
            worth(scene, ball[0], ball[1], True),
        ]
    )
    best = len(worths) - 1
    for index in range(len(worths)):
        if worths[index] > worths[best]:
            best = index
    for index in range(len(worths)):
        rest = -np.inf
        for other in range(len(worths)):
            if other != index:
                rest = max(rest, worths[other])
        made[_WORTH + index] = min(max(worths[index] - rest, -FAR_M), FAR_M)

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
        choice = (_PREPARE if passed[KICKS] > 1 else _PASS) if there[_PASS] else _HOLD
    elif best < 3:
        choice = _DRIBBLE if best == 1 else _RUN
    elif best == 3:
        choice = _DASH
    else:
        choice = _TURN if turns else _HOLD
    made[1 + choice] = 1.0


@kernel
def plan(scene: Array, actor: int, order: NDArray[np.int64], made: Array) -> None:
    """Fill PLAN of one scene.

    Args:
        scene: (ROWS, COLUMNS) as of `described`. order: as of `paths`. made: (len(PLAN),) zeros.
    """
    if scene[actor, THERE] == 0 or not np.isfinite(scene).all():  # whatever a log may hold
        return
    me, ball = scene[actor], scene[BALL]
    able = gap(ball[0], ball[1], me[X], me[Y]) <= me[AREA]
    tackles = can_tackle(me, ball)
    if not able and not tackles:
        return
    for player in range(BALL):
        prepare(scene[player])
    scene[ME] = me
    if able:
        _complete(scene, actor)
        _plan_with_ball(scene, actor, order, made)
    if tackles:
        made[_TACKLE], made[_TACKLE + 1] = 1.0, best_tackle(scene)
    if not np.isfinite(made).all():  # a player whom no server makes: of a type, say, that never slows down
        made[:] = 0.0


def _compiled() -> Any:
    """A kernel that plans on many scenes."""
    # Numba keeps what it compiled as long as the file of this function stays the same. It hangs on all of these.
    elsewhere = (Path(str(module.__file__)) for module in (pitch, server_params))
    sources = (*sorted(Path(__file__).parent.glob("*.py")), *elsewhere)
    version = zlib.crc32(b"".join(path.read_bytes() for path in sources))

    @njit(cache=True, nogil=True, error_model="numpy")
    def plan_all(scenes: Array, actors: NDArray[np.int64], order: NDArray[np.int64], made: Array) -> int:
        for index in range(len(actors)):
            plan(scenes[index], actors[index], order, made[index])
        return version

    return plan_all


_plan_all = _compiled()
_order = cache(paths)


tell_when_compiled({_plan_all: "compiling the plans with the ball, once (half a minute)"})


@torch.library.custom_op("teamclone::plan", mutates_args=())
def _plans(ball: Tensor, players: Tensor, types: Tensor, actor: Tensor) -> Tensor:
    """What `plans` does, as an operation of PyTorch: it can be a part of what is exported."""
    each = torch.arange(len(actor), device=ball.device)
    place = players[each, actor][:, [CHANNEL["x"], CHANNEL["y"]]]
    near = torch.nonzero((ball[:, :2] - place).norm(dim=1) < NEAR_BALL_M).squeeze(1)
    made = np.zeros((len(near), len(PLAN)))
    if len(near):
        parts = (part.index_select(0, near).cpu().numpy() for part in (ball, players, types, actor))
        near_ball, near_players, near_types, actors = parts
        _plan_all(described(near_ball, near_players, near_types), actors, _order(), made)
    return ball.new_zeros(len(each), len(PLAN)).index_copy(0, near, torch.from_numpy(made).to(ball))


@_plans.register_fake
def _(ball: Tensor, players: Tensor, types: Tensor, actor: Tensor) -> Tensor:
    return ball.new_empty(ball.shape[0], len(PLAN))


def plans(state: State) -> Tensor:
    """(batch, len(PLAN)), on the device of the state and of its type; of who is far from the ball nothing is asked."""
    each = state.each()
    made: Tensor = _plans(each.ball, each.players, each.types, each.actor)
    return made
