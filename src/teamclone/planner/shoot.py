"""Shots: to which of some places in the goal, and how hard."""

from __future__ import annotations

import math

from teamclone.planner.constants import BALL_DECAY, BALL_SPEED_MAX
from teamclone.planner.passes import BEHIND_M
from teamclone.planner.players import (
    AREA,
    BALL,
    GAIN,
    GOAL_X,
    GOAL_Y,
    HARDLY,
    KEEPER,
    ME,
    OPPONENT,
    PENALTY_X,
    PENALTY_Y,
    TACKLING,
    THERE,
    TOP,
    Array,
    X,
    Y,
    bell,
    coasted,
    cycles_over,
    direction,
    fastest,
    in_their_box,
    kernel,
    reach_of,
    rolled,
    steps,
    turned,
)

SAVED, KEEPER_LATE, OTHERS_LATE = -1, 1, 2
FROM_M = 30.0
PLACES, FASTER = 25, 0.3
"""In the goal, and the step in which speeds are tried."""
INSIDE_M, INSIDE_EACH_M, INSIDE_MOST_M = 0.6, 0.042, 1.5
"""How far within the posts: at least, per metre of distance, at most."""
SLOWEST, PAST_M = 1.5, 5.0
"""Speed of a shot at least, and how far behind the line it would roll."""
FAR_M, WIDE_Y = 8.0, 4.0
"""Of a ball so far away shots so far from the middle are worth less."""
KEEPER_LATE_DEG, KEEPER_DEG = 1.0, 10.0
"""Shots so near to the keeper are worth less: if he is too late for them, and else."""
SEEN_X = PENALTY_X - 30.0
SEEN_NOISE = 0.02
"""Of a keeper's distance: by how much nearer he may be."""


@kernel
def _saved(scene: Array, angle: float, speed: float, last: int) -> int:
    """SAVED where an opponent has the ball before the goal; else KEEPER_LATE if the keeper cannot even nearly, and
    OTHERS_LATE if none of the others can."""
    me, ball = scene[ME], scene[BALL]
    keeper_late, others_late = True, True
    cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if player[TACKLING] > 0 or player[X] < SEEN_X or abs(player[Y]) > PENALTY_Y:
            continue
        if abs(turned(angle - direction(player[X] - me[X], player[Y] - me[Y]))) > 90.0:
            continue
        away_x, away_y = player[X] - ball[0], player[Y] - ball[1]
        if away_x * cos + away_y * sin < BEHIND_M:
            continue
        first = max(1, int(abs(away_y * cos - away_x * sin) / player[TOP]))
        for cycle in range(first, last):
            way_m = rolled(speed, cycle)
            x, y = ball[0] + way_m * cos, ball[1] + way_m * sin
            from_x, from_y = coasted(player, cycle)
            metres = math.hypot(x - from_x, y - from_y)
            if player[KEEPER] > 0:
                if x > GOAL_X:
                    break
                box = in_their_box(x, y)
                reach = reach_of(player, x, y)
                if box:
                    metres -= SEEN_NOISE * math.hypot(player[X] - me[X], player[Y] - me[Y])
                if metres - reach - 0.15 < HARDLY:
                    return SAVED
                left = (metres - 0.9 * reach) * 0.999 if cycle > 1 else metres
                needed = steps(player, (x - from_x, y - from_y), left, reach + 0.1)
                if needed <= (cycle if box else cycle - 2):
                    return SAVED
                if box and needed <= cycle + 1:
                    keeper_late = False
            else:
                if metres - player[AREA] < HARDLY:
                    return SAVED
                left = metres - 0.8 * player[AREA] if cycle > 1 else metres
                needed = steps(player, (x - from_x, y - from_y), left, player[AREA])
                if needed <= cycle - 1:
                    return SAVED
                if needed <= cycle + 1:
                    others_late = False
    return KEEPER_LATE * keeper_late + OTHERS_LATE * others_late


@kernel
def best_shot(scene: Array) -> tuple[float, float, float, float]:
    """Where to and how fast, and the speed that one kick gives; a speed of 0 where there is no shot."""
    me, ball = scene[ME], scene[BALL]
    if math.hypot(GOAL_X - me[X], me[Y]) > FROM_M:
        return 0.0, 0.0, 0.0, 0.0
    goal_x, low, high = GOAL_X, -GOAL_Y, GOAL_Y
    low += min(INSIDE_MOST_M, INSIDE_M + INSIDE_EACH_M * math.hypot(goal_x - ball[0], low - ball[1]))
    high -= min(INSIDE_MOST_M, INSIDE_M + INSIDE_EACH_M * math.hypot(goal_x - ball[0], high - ball[1]))
    if me[X] > GOAL_X - 1.0 and abs(me[Y]) < GOAL_Y:
        goal_x = me[X] + 1.5
    keeper_at = 0.0
    keeper = -1
    for opponent in range(OPPONENT, BALL):
        if scene[opponent, KEEPER] > 0 and scene[opponent, THERE] > 0:
            keeper = opponent
            keeper_at = direction(scene[opponent, X] - ball[0], scene[opponent, Y] - ball[1])
    best, best_y, best_speed, best_one = 0.0, 0.0, 0.0, 0.0
    for place in range(PLACES):
        y = low + (high - low) / (PLACES - 1) * place
        metres = math.hypot(goal_x - ball[0], y - ball[1])
        angle = direction(goal_x - ball[0], y - ball[1])
        one = fastest((goal_x - ball[0]) / metres, (y - ball[1]) / metres, scene[BALL, GAIN], ball[2], ball[3])
        speed = max((metres + PAST_M) * (1.0 - BALL_DECAY), one, SLOWEST)
        last = False
        while not last:
            if speed > BALL_SPEED_MAX - 0.001:
                speed, last = BALL_SPEED_MAX, True
            cycles = cycles_over(metres, speed)
            late = KEEPER_LATE + OTHERS_LATE if cycles <= 1 else _saved(scene, angle, speed, cycles)
            if late != SAVED:
                value = 1.0 + 50.0 * (speed <= one + 0.001) + 100.0 * ((late & 1) + (late >> 1))
                if keeper >= 0:
                    width = KEEPER_LATE_DEG if late & KEEPER_LATE else KEEPER_DEG
                    value *= 1.0 - bell(turned(angle - keeper_at), width)
                if metres > FAR_M:
                    value *= bell(max(0.0, abs(y) - WIDE_Y), GOAL_Y - INSIDE_MOST_M)
                if value > best:
                    best, best_y, best_speed, best_one = value, y, speed, one
                last |= late == KEEPER_LATE + OTHERS_LATE
            speed += FASTER
    return goal_x, best_y, best_speed, best_one
