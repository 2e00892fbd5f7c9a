"""Going on with the ball: a few dashes with it just ahead, a long run after it, or on without a kick."""

from __future__ import annotations

import math

import numpy as np

from teamclone.planner.constants import BALL_DECAY, BALL_SPEED_MAX, NEAR_M, TURN_MARGIN_DEG
from teamclone.planner.field_evaluator import worth
from teamclone.planner.passes import TACKLED_CYCLES
from teamclone.planner.players import (
    AREA,
    BALL,
    BALL_PUSH_MAX,
    BALL_RAND,
    BODY,
    CAPACITY,
    DASH_RATE,
    DECAY,
    EXTRA,
    GAIN,
    GOAL_X,
    HARDLY,
    MARGIN,
    ME,
    OPPONENT,
    PLAYER_PUSH_MAX,
    PLAYER_RAND,
    PUSH,
    SIZE,
    TACKLING,
    TOP,
    VX,
    VY,
    Array,
    X,
    Y,
    coasted,
    dashes,
    direction,
    fastest,
    gap,
    kernel,
    most_turn,
    reach_of,
    rolled,
    speed_over,
    steps,
    turned,
)
from teamclone.planner.stamina import FORCE, LEFT, LOW, push_of, rest, spare, tired
from teamclone.rcss import pitch

TURNS, DASHES, AHEAD = 16, (2, 4), 0.2
"""Directions of a dribble around the body, its dashes, and the part of the margin by which the ball is then ahead."""
FACED_DEG, MOST_TURNS = 10.0, 2
OWN_GOAL_X, OWN_GOAL_Y, BACK_X, WIDEST_DEG = -36.0, 20.0, 16.0, (45.0, 100.0)
"""Near the own goal, and behind an x, dribbles go no further round from +x than this."""
DRIBBLE_RESERVE, RUN_RESERVE = 300.0, 350.0
"""Stamina that is left beyond what lets recovery fall."""
SEEN_M = 20.0
"""Opponents further away do not hinder a dribble."""
PAST_M = -4.0
"""Nor do those so far behind the ball."""
OFF_M = 0.1
"""A ball is kicked past himself by so much at least."""
RUN_STEP_DEG, RUNS, LEAST_RUN = 6.0, 60, 5
RUN_X, RUN_DASHES = (-20.0, 0.0, 10.0, 20.0), (6, 7, 13, 15, 20)
"""Most dashes of a run where the ball's x is less than each, and beyond."""
RUN_FORWARD_X, RUN_WIDEST_DEG = 41.0, 85.0
RUN_INSIDE_M = 2.5, 3.0
OWN_GOAL_M = 18.0
STRIDE_DASHES = 10
"""Runs with more dashes come in steps of two."""
ON_DASHES, ON_INSIDE_M, LEAST_PUSH, PUSH_STEP = 20, 0.5, 0.3, 0.05
FAR_OFF_M = 1.0
VALUE, SPEED, DIRECTION = range(3)
"""Columns of what is found: what it is worth, speed of the ball and where it goes."""
MID_X, UP_X, THEIR_X = 0.0, 30.0, 27.0
"""Behind these dribblers, and runners, think that opponents are a cycle later."""
IN_THE_WAY_M = 0.8
"""Opponents so far ahead of the ball of a run are a cycle later, too."""
SEEN_NOISE = 0.01
"""Of an opponent's distance: by how much nearer he may be."""


@kernel
def _none() -> Array:
    found = np.zeros(3)
    found[VALUE] = -np.inf
    return found


@kernel
def _hindered(scene: Array, x: float, y: float, cycles: int) -> bool:
    """Whether an opponent has the ball at the end of a dribble."""
    me, ball = scene[ME], scene[BALL]
    angle = math.radians(direction(x - ball[0], y - ball[1]))
    cos, sin = math.cos(angle), math.sin(angle)
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if math.hypot(player[X] - me[X], player[Y] - me[Y]) > SEEN_M:
            continue
        if (player[X] - ball[0]) * cos + (player[Y] - ball[1]) * sin < PAST_M:
            continue
        reach = reach_of(player, x, y)
        from_x, from_y = coasted(player, cycles)
        metres = math.hypot(x - from_x, y - from_y)
        if metres - reach < HARDLY:
            return True
        needed = steps(player, (x - from_x, y - from_y), metres - 0.5 * reach - 0.2, reach)
        allowance = -TACKLED_CYCLES if player[TACKLING] > 0 else (x < UP_X) + (x < MID_X)
        if needed - allowance <= cycles:
            return True
    return False


@kernel
def best_dribble(scene: Array) -> Array:
    """The free dribble that is worth most; VALUE is minus infinity where there is none."""
    me, ball, gain = scene[ME], scene[BALL], scene[BALL, GAIN]
    best = _none()
    next_x, next_y = me[X] + me[VX], me[Y] + me[VY]
    for turn in range(TURNS):
        angle = turned(me[BODY] + 360.0 / TURNS * turn)
        if me[X] < BACK_X and abs(angle) > WIDEST_DEG[1]:
            continue
        if me[X] < OWN_GOAL_X and abs(me[Y]) < OWN_GOAL_Y and abs(angle) > WIDEST_DEG[0]:
            continue
        left = abs(turned(360.0 / TURNS * turn))
        speed = math.hypot(me[VX], me[VY]) * me[DECAY]
        turns_first = 0
        while left > FACED_DEG and turns_first <= MOST_TURNS:
            left = max(0.0, left - most_turn(me, speed))
            speed *= me[DECAY]
            turns_first += 1
        if turns_first > MOST_TURNS:
            continue
        angle += -left if turn < TURNS // 2 else left
        cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        x, y, vx, vy = next_x, next_y, me[VX] * me[DECAY], me[VY] * me[DECAY]
        state = tired(me)
        rest(me, state)
        for _ in range(turns_first):
            x, y, vx, vy = x + vx, y + vy, vx * me[DECAY], vy * me[DECAY]
            rest(me, state)
        for dash in range(1, DASHES[1] + 1):
            push = push_of(me, state, min(max(0.0, state[LEFT] - LOW - DRIBBLE_RESERVE), 100.0))
            vx, vy = vx + push * cos, vy + push * sin
            x, y, vx, vy = x + vx, y + vy, vx * me[DECAY], vy * me[DECAY]
            if dash < DASHES[0]:
                continue
            ahead = me[SIZE] + AHEAD * me[MARGIN]
            to_x, to_y = x + ahead * cos, y + ahead * sin
            if abs(to_x) > GOAL_X - 1.0 or abs(to_y) > pitch.HALF_WIDTH - 1.0:
                continue
            cycles = 1 + turns_first + dash
            metres = math.hypot(to_x - ball[0], to_y - ball[1])
            if metres < HARDLY:
                continue
            wanted = speed_over(metres, cycles)
            ball_x, ball_y = wanted * (to_x - ball[0]) / metres, wanted * (to_y - ball[1]) / metres
            push = math.hypot(ball_x - ball[2], ball_y - ball[3])
            if push > min(100.0 * gain, BALL_PUSH_MAX) or wanted > BALL_SPEED_MAX:
                continue
            if math.hypot(ball[0] + ball_x - next_x, ball[1] + ball_y - next_y) < me[SIZE] + OFF_M:
                continue
            value = worth(scene, to_x, to_y, True)
            if value <= best[VALUE] or _hindered(scene, to_x, to_y, cycles):
                continue
            best[VALUE], best[SPEED], best[DIRECTION] = value, wanted, direction(ball_x, ball_y)
    return best


@kernel
def _overtaken(scene: Array, x: float, y: float, speed: float, cycles: int) -> bool:
    """Whether an opponent has the ball of a run, in the next cycle or at its end."""
    me, ball = scene[ME], scene[BALL]
    angle = math.radians(direction(x - ball[0], y - ball[1]))
    cos, sin = math.cos(angle), math.sin(angle)
    next_x, next_y = ball[0] + speed * cos, ball[1] + speed * sin
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        reach = reach_of(player, next_x, next_y)
        at_x, at_y = player[X] + player[VX], player[Y] + player[VY]
        if math.hypot(next_x - at_x, next_y - at_y) < reach + 0.1:
            return True
        body = math.radians(player[BODY])
        push = player[PUSH]
        if math.hypot(next_x - at_x - push * math.cos(body), next_y - at_y - push * math.sin(body)) < reach:
            return True
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        along = (player[X] - ball[0]) * cos + (player[Y] - ball[1]) * sin
        if along < PAST_M:
            continue
        reach = reach_of(player, x, y)
        from_x, from_y = coasted(player, cycles)
        metres = math.hypot(x - from_x, y - from_y)
        if metres > player[TOP] * cycles + reach:
            continue
        if metres - reach < HARDLY:
            return True
        left = metres - reach - 0.2 - SEEN_NOISE * math.hypot(player[X] - me[X], player[Y] - me[Y])
        needed = steps(player, (x - from_x, y - from_y), left, reach)
        allowance = 0
        if along > IN_THE_WAY_M:
            allowance = 1 + (-TACKLED_CYCLES if player[TACKLING] > 0 else (x < THEIR_X))
        if needed - allowance <= cycles:
            return True
    return False


@kernel
def best_run(scene: Array) -> Array:
    """The safe run that is worth most; VALUE is minus infinity where there is none."""
    me, ball, gain = scene[ME], scene[BALL], scene[BALL, GAIN]
    best = _none()
    most = RUN_DASHES[0]
    for part in range(len(RUN_X)):
        if ball[0] >= RUN_X[part]:
            most = RUN_DASHES[part + 1]
    one_turn = most_turn(me, math.hypot(me[VX], me[VY]) * me[DECAY])
    places = np.empty((most, 2))
    for run in range(RUNS):
        off = turned(RUN_STEP_DEG * run)
        if abs(off) > one_turn:
            continue
        angle = turned(me[BODY] + off)
        if ball[0] < RUN_FORWARD_X and abs(angle) > RUN_WIDEST_DEG:
            continue
        turns_first = 1 if run else 0
        cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        x, y, vx, vy = me[X] + me[VX], me[Y] + me[VY], me[VX] * me[DECAY], me[VY] * me[DECAY]
        state = tired(me)
        rest(me, state)
        if turns_first:
            x, y, vx, vy = x + vx, y + vy, vx * me[DECAY], vy * me[DECAY]
            rest(me, state)
        count = 0
        while count < most and (me[CAPACITY] <= 0 or state[LEFT] >= LOW + RUN_RESERVE):
            kept = -me[EXTRA] if me[CAPACITY] <= 0 else LOW + RUN_RESERVE
            push = push_of(me, state, min(100.0, state[LEFT] - kept))
            vx, vy = vx + push * cos, vy + push * sin
            x, y = x + vx, y + vy
            if x > GOAL_X - RUN_INSIDE_M[0] or (abs(y) > pitch.HALF_WIDTH - RUN_INSIDE_M[1] and y * angle > 0):
                break
            vx, vy = vx * me[DECAY], vy * me[DECAY]
            places[count, 0], places[count, 1] = x, y
            count += 1
        while count >= LEAST_RUN:
            to_x, to_y = places[count - 1, 0], places[count - 1, 1]
            cycles = 1 + turns_first + count
            count -= 1 if count <= STRIDE_DASHES else 2
            value = worth(scene, to_x, to_y, True)
            if value <= best[VALUE] or math.hypot(to_x + GOAL_X, to_y) < OWN_GOAL_M:
                continue
            metres = math.hypot(to_x - ball[0], to_y - ball[1])
            speed = speed_over(metres, cycles)
            ball_x, ball_y = (to_x - ball[0]) / metres, (to_y - ball[1]) / metres
            if fastest(ball_x, ball_y, gain, ball[2], ball[3]) < speed:
                continue
            off_x = ball[0] + speed * ball_x - me[X] - me[VX]
            off_y = ball[1] + speed * ball_y - me[Y] - me[VY]
            if math.hypot(off_x, off_y) < me[SIZE] + OFF_M:
                continue
            if _overtaken(scene, to_x, to_y, speed, cycles):
                continue
            best[VALUE], best[SPEED], best[DIRECTION] = value, speed, direction(ball_x, ball_y)
    return best


@kernel
def opponents_first(scene: Array) -> int:
    """Cycles until an opponent can have the ball, if nobody kicks it; `physics.reach_ball` has the same for all."""
    ball = scene[BALL]
    speed, angle = math.hypot(ball[2], ball[3]), math.atan2(ball[3], ball[2])
    for cycle in range(ON_DASHES):
        metres = rolled(speed, cycle)
        x, y = ball[0] + metres * math.cos(angle), ball[1] + metres * math.sin(angle)
        for opponent in range(OPPONENT, BALL):
            player = scene[opponent]
            from_x, from_y = coasted(player, cycle)
            away = math.hypot(x - from_x, y - from_y)
            if away <= player[AREA]:
                return cycle
            off = abs(turned(direction(x - from_x, y - from_y) - player[BODY]))
            if away < NEAR_M and off > 90.0:
                off = 180.0 - off
            left = off - max(TURN_MARGIN_DEG, math.degrees(math.asin(player[AREA] / away)))
            count = 0
            slower = math.hypot(player[VX], player[VY])
            while left > 0 and count <= cycle:
                left -= most_turn(player, slower)
                slower *= player[DECAY]
                count += 1
            if count + dashes(player, away - player[AREA]) <= cycle:
                return cycle
    return ON_DASHES


@kernel
def best_going_on(scene: Array) -> float:
    """What dashes straight on are worth that keep the ball in reach without a kick; minus infinity where none do."""
    me, ball = scene[ME], scene[BALL]
    best = -np.inf
    cos, sin = math.cos(math.radians(me[BODY])), math.sin(math.radians(me[BODY]))
    x, y, vx, vy = me[X], me[Y], me[VX], me[VY]
    ball_x, ball_y, ball_vx, ball_vy = ball[0], ball[1], ball[2], ball[3]
    state = tired(me)
    for dash in range(1, min(ON_DASHES, opponents_first(scene) - 1) + 1):
        ball_x, ball_y = ball_x + ball_vx, ball_y + ball_vy
        if abs(ball_x) > GOAL_X - ON_INSIDE_M or abs(ball_y) > pitch.HALF_WIDTH - ON_INSIDE_M:
            break
        x, y = x + vx, y + vy
        along = (ball_x - x) * cos + (ball_y - y) * sin
        aside = (ball_y - y) * cos - (ball_x - x) * sin
        if along < -me[AREA] or abs(aside) > me[AREA]:
            break
        doubt = min(0.1, math.hypot(x - me[X], y - me[Y]) * PLAYER_RAND)
        doubt += min(0.1, math.hypot(ball_x - ball[0], ball_y - ball[1]) * BALL_RAND)
        near, far = me[SIZE] + 0.2 - 0.1 * dash, me[AREA] - doubt - 0.15
        rate = me[DASH_RATE] * state[FORCE]
        most = min(rate * min(100.0, spare(me, state, 1.0)), PLAYER_PUSH_MAX)
        push = most
        least = min(LEAST_PUSH, most - 0.001)
        done = False
        while push > least:
            away = math.hypot(along - push, aside)
            if near < away < far:
                done = True
                break
            push -= PUSH_STEP
        if not done:
            break
        x, y, vx, vy = x + push * cos, y + push * sin, vx + push * cos, vy + push * sin
        vx, vy = vx * me[DECAY], vy * me[DECAY]
        push_of(me, state, push / rate)
        ball_vx, ball_vy = ball_vx * BALL_DECAY, ball_vy * BALL_DECAY
        best = max(best, worth(scene, ball_x, ball_y, True))
    return best


@kernel
def _missed(scene: Array, off: float, turns_first: int, run: bool) -> tuple[float, int]:
    """The least distance between the ball as it rolls and where a run or a dribble has it after turns and dashes, and
    after how many dashes.

    Args:
        off: direction of the dashes from the body.
    """
    me, ball = scene[ME], scene[BALL]
    most = RUN_DASHES[-1] if run else DASHES[1]
    ahead = 0.0 if run else me[SIZE] + AHEAD * me[MARGIN]
    cos, sin = math.cos(math.radians(me[BODY] + off)), math.sin(math.radians(me[BODY] + off))
    x, y, vx, vy = me[X], me[Y], me[VX], me[VY]
    state = tired(me)
    for _ in range(turns_first):
        x, y, vx, vy = x + vx, y + vy, vx * me[DECAY], vy * me[DECAY]
        rest(me, state)
    best, when = FAR_OFF_M, 0
    for dash in range(1, most + 1):
        push = push_of(me, state, min(spare(me, state, RUN_RESERVE if run else DRIBBLE_RESERVE), 100.0))
        vx, vy = vx + push * cos, vy + push * sin
        x, y, vx, vy = x + vx, y + vy, vx * me[DECAY], vy * me[DECAY]
        way = rolled(1.0, turns_first + dash)
        away = gap(ball[0] + ball[2] * way, ball[1] + ball[3] * way, x + ahead * cos, y + ahead * sin)
        if away < best:
            best, when = away, dash
    return best, when


@kernel
def underway(scene: Array) -> Array:
    """Whether the ball rolls as if he had kicked it before, for a dribble or a run that he is about to go on with.

    By how many metres it misses where it would be then, at most FAR_OFF_M, and after how many dashes: (6,) of a dribble
    and of a run straight on, and of the nearer of both after a turn.
    """
    me = scene[ME]
    found = np.zeros(6)
    found[0], found[1] = _missed(scene, 0.0, 0, False)
    found[2], found[3] = _missed(scene, 0.0, 0, True)
    found[4] = FAR_OFF_M
    one_turn = most_turn(me, math.hypot(me[VX], me[VY]))
    for run in (False, True):
        step, count = (RUN_STEP_DEG, RUNS) if run else (360.0 / TURNS, TURNS)
        for turn in range(1, count):
            off = turned(step * turn)
            if abs(off) > one_turn:
                continue
            away, dash = _missed(scene, off, 1, run)
            if away < found[4] and (dash >= LEAST_RUN or not run):
                found[4], found[5] = away, dash
    return found
