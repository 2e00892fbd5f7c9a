"""Tackles: to which of some directions."""

from __future__ import annotations

import math

from teamclone.planner.ball import NEVER_CYCLES, Path, cycles_over
from teamclone.planner.players import (
    HARDLY_M,
    TACKLE,
    first_cycle,
    intercept,
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
    kernel,
    roll,
    turned,
)

DIRECTIONS = 40
"""Evenly around the body; the first one is straight back."""
BEHIND_CYCLES = 10
"""Cycles after which an opponent behind the ball may come, too."""
SHOT_M = 20.0
"""How near to the goal a tackle may be a shot."""
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
    last, soonest = min(CYCLES, out) - 1, NEVER_CYCLES
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if player[PRESENT] == 0:
            continue
        first = first_cycle(scene, player, path, TACKLE.behind_m)
        if first == NEVER_CYCLES:
            first = BEHIND_CYCLES
        cycle = intercept(scene, player, path, (first, last), TACKLE)
        if cycle < soonest:
            soonest, last = cycle, cycle - 1
    return soonest


@kernel
def _value(scene: Array, vx: float, vy: float) -> float:
    """Return the value of a ball with this velocity: highest in the goal, else away from the own one, to the side, and
    late with an opponent."""
    ball, server = scene[BALL], scene[SERVER]
    speed = max(math.hypot(vx, vy), 1e-9)
    cos, sin = vx / speed, vy / speed
    end_x = ball[X] + vx / (1.0 - server[BALL_DECAY])
    fast = gaussian(speed, 0.5 * server[BALL_SPEED_MAX])
    if end_x > GOAL_X and gap(GOAL_X, 0.0, ball[X], ball[Y]) < SHOT_M:
        y = ball[Y] + vy / vx * (GOAL_X - ball[X])
        if abs(y) < GOAL_Y:
            return 1e6 * (1.0 - fast) * gaussian(y, 2.0 * GOAL_Y)
    if end_x < -GOAL_X:
        y = ball[Y] + vy / vx * (-GOAL_X - ball[X])
        if abs(y) < GOAL_Y + 1.0:
            return 1e4 * (fast - gaussian(abs(y) - GOAL_Y, GOAL_Y))
    cycles = _opponents_after(scene, Path(speed, cos, sin))
    way_m = min(speed * roll(cycles, server[BALL_DECAY]), _edge_m(ball[X], ball[Y], cos, sin))
    off = turned(direction(-GOAL_X - ball[X], -ball[Y]) - direction(vx, vy))
    to_line = max(0.0, LINE_Y - 0.1 - abs(ball[Y] + way_m * sin))
    aside = gaussian(to_line + 0.1, LINE_M) if to_line > 0 else 1.0
    return 1e4 * (1.0 - gaussian(off, GOAL_DEG)) * aside * (1.0 - gaussian(cycles, LATE_CYCLES))


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
def best_tackle(scene: Array) -> float:
    """Return the degrees from the body of the tackle of the greatest value."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    off = direction(ball[X] - me[X], ball[Y] - me[Y]) - me[BODY]
    best, chosen = -math.inf, 0.0
    for index in range(DIRECTIONS):
        degrees = 360.0 / DIRECTIONS * index - 180.0
        added, angle = tackle_speed(server, degrees, off), math.radians(me[BODY] + degrees)
        vx, vy = ball[VX] + added * math.cos(angle), ball[VY] + added * math.sin(angle)
        over = max(1.0, math.hypot(vx, vy) / server[BALL_SPEED_MAX])
        value = _value(scene, vx / over, vy / over)
        if value > best:
            best, chosen = value, degrees
    return chosen
