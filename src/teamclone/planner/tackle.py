"""Tackles: to which of some directions."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.ball import NEVER_CYCLES, Path, ball_after, cycles_over
from teamclone.planner.players import (
    HARDLY_M,
    TACKLE,
    first_cycles,
    short_m,
    tackle_chance,
)
from teamclone.planner.scene import (
    ACTOR,
    BALL,
    BALL_DECAY,
    BALL_SPEED_MAX,
    BODY,
    CYCLES,
    FOUL_EXPONENT,
    GOAL_X,
    GOAL_Y,
    LINE_Y,
    OPPONENT,
    PRESENT,
    SERVER,
    TACKLE_BACK_POWER,
    TACKLE_POWER,
    TACKLE_RATE,
    VX,
    VY,
    Array,
    X,
    Y,
    direction,
    gap,
    gaussian,
    roll,
    turned,
)
from teamclone.system.compiling import kernel

DIRECTIONS = 40
"""Evenly around the body; the first one is straight back."""
BEHIND_CYCLES = 10
"""Cycles after which an opponent behind the ball may come, too."""
SHOT_M, OWN_POST_M = 20.0, 1.0
"""How near to the goal a tackle may be a shot; how far outside the own posts the ball counts as going in."""
GOAL_VALUE, VALUE = 1e6, 1e4
"""Of a ball in the goal, and of any other, at most."""
AT_LINE_M = 0.1
"""A ball so near to the side line is as good as out."""
GOAL_DEG, LINE_M, LATE_CYCLES = 40.0, 0.7 * LINE_Y, 30.0
"""Widths of the Gaussians by which it is worse to hit the ball towards the own goal, worse towards the middle, and
worse to where opponents soon are."""


@kernel
def _edge_m(x: float, y: float, cos: float, sin: float) -> float:
    """Return the metres from a place to the edge of the pitch, in a direction."""
    to_x = (math.copysign(GOAL_X, cos) - x) / cos if cos != 0 else math.inf
    to_y = (math.copysign(LINE_Y, sin) - y) / sin if sin != 0 else math.inf
    return min(to_x, to_y)


@kernel
def _opponents_after(scene: Array, path: Path) -> int:
    """Return the cycles until the first opponent has the ball, NEVER_CYCLES if none has it before it is out."""
    ball = scene[BALL]
    out = cycles_over(_edge_m(ball[X], ball[Y], path.cos, path.sin), path.speed, scene[SERVER, BALL_DECAY])
    rows = OPPONENT + np.flatnonzero(scene[OPPONENT:BALL, PRESENT])
    first = first_cycles(scene, rows, path, TACKLE.behind_m)
    first[first == NEVER_CYCLES] = BEHIND_CYCLES
    for cycle in range(1, min(CYCLES, out)):
        place = ball_after(scene, path, cycle)
        for row in rows[first <= cycle]:
            if short_m(scene[row], place, cycle, TACKLE, 0) <= 0:
                return cycle
    return NEVER_CYCLES


@kernel
def _goal_value(scene: Array, path: Path) -> float:
    """Return the value of a ball that rolls into a goal: positive in theirs, the less the harder in the own one.

    Minus infinity of a ball that does not.
    """
    ball, server = scene[BALL], scene[SERVER]
    theirs = path.cos > 0
    line_x = GOAL_X if theirs else -GOAL_X
    metres = (line_x - ball[X]) / path.cos
    y = ball[Y] + metres * path.sin
    mouth = GOAL_Y if theirs else GOAL_Y + OWN_POST_M
    rolls_in = metres * (1.0 - server[BALL_DECAY]) < path.speed and abs(y) < mouth
    if not rolls_in or (theirs and gap(line_x, 0.0, ball[X], ball[Y]) >= SHOT_M):
        return -math.inf
    slow = gaussian(path.speed, 0.5 * server[BALL_SPEED_MAX])
    if theirs:
        return GOAL_VALUE * (1.0 - slow) * gaussian(y, 2.0 * GOAL_Y)
    return VALUE * (slow - gaussian(abs(y) - GOAL_Y, GOAL_Y))


@kernel
def _away_value(scene: Array, path: Path) -> float:
    """Return the value of a direction by how far it is off the own goal's, the most that `_clear_value` can be."""
    ball = scene[BALL]
    off = turned(direction(-GOAL_X - ball[X], -ball[Y]) - direction(path.cos, path.sin))
    return VALUE * (1.0 - gaussian(off, GOAL_DEG))


@kernel
def _clear_value(scene: Array, path: Path) -> float:
    """Return the value of a ball that rolls into no goal: away from the own one, to the side, late with an opponent."""
    ball = scene[BALL]
    cycles = _opponents_after(scene, path)
    rolled = path.speed * roll(cycles, scene[SERVER, BALL_DECAY])
    y = ball[Y] + path.sin * min(rolled, _edge_m(ball[X], ball[Y], path.cos, path.sin))
    inside = LINE_Y - abs(y)
    sideways = 1.0 if inside <= AT_LINE_M else gaussian(inside, LINE_M)
    return _away_value(scene, path) * sideways * (1.0 - gaussian(cycles, LATE_CYCLES))


@kernel
def can_tackle(server: Array, ahead: float, aside: float) -> bool:
    """Return whether a tackle or a foul may succeed at a ball so far ahead of the player and aside."""
    return tackle_chance(server, ahead, aside, server[FOUL_EXPONENT]) > HARDLY_M


@kernel
def tackle_speed(server: Array, degrees: float, off: float) -> float:
    """Return the metres per cycle that a tackle adds to the ball's velocity; `dynamics.formulas.tackle_power`.

    Args:
        degrees: direction of the tackle from the body. off: degrees between the body and the ball.
    """
    back = server[TACKLE_BACK_POWER]
    power = back + (server[TACKLE_POWER] - back) * (1.0 - abs(degrees) / 180.0)
    return power * server[TACKLE_RATE] * (1.0 - 0.5 * abs(turned(off)) / 180.0)


@kernel
def _tackled(scene: Array, degrees: float) -> Path:
    """Return how the ball leaves a tackle in a direction from the body."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    off = direction(ball[X] - me[X], ball[Y] - me[Y]) - me[BODY]
    added, angle = tackle_speed(server, degrees, off), math.radians(me[BODY] + degrees)
    vx, vy = ball[VX] + added * math.cos(angle), ball[VY] + added * math.sin(angle)
    speed = max(math.hypot(vx, vy), 1e-9)
    return Path(min(speed, server[BALL_SPEED_MAX]), vx / speed, vy / speed)


@kernel
def best_tackle(scene: Array) -> float:
    """Return the degrees from the body of the tackle of the greatest value.

    When opponents have the ball is only found out for directions that may be better than the best so far.
    """
    degrees = 360.0 / DIRECTIONS * np.arange(DIRECTIONS) - 180.0
    values, bounds = np.empty(DIRECTIONS), np.full(DIRECTIONS, -np.inf)
    for index in range(DIRECTIONS):
        path = _tackled(scene, degrees[index])
        values[index] = _goal_value(scene, path)
        if values[index] == -np.inf:
            bounds[index] = _away_value(scene, path)
    for index in np.argsort(-bounds, kind="mergesort"):
        if bounds[index] < values.max() or bounds[index] == -np.inf:
            break
        values[index] = _clear_value(scene, _tackled(scene, degrees[index]))
    return float(degrees[np.argmax(values)])
