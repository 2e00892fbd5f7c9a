"""Shots: to which of some places in the goal, and how hard."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from teamclone.planner.ball import NEVER_CYCLES, Path, ball_after, cycles_over, fastest_from
from teamclone.planner.players import SHOT, SHOT_GOALKEEPER, first_cycles, short_m
from teamclone.planner.scene import (
    ACTOR,
    BALL,
    BALL_DECAY,
    BALL_SPEED_MAX,
    CYCLES,
    FROZEN,
    GAIN,
    GOAL_X,
    GOAL_Y,
    GOALKEEPER,
    OPPONENT,
    PENALTY_X,
    PENALTY_Y,
    PRESENT,
    SERVER,
    Array,
    X,
    Y,
    along,
    direction,
    gap,
    gaussian,
    in_their_area,
    turned,
)
from teamclone.system.compiling import kernel

FROM_M = 30.0
PLACES, FASTER = 25, 0.3
"""In the goal, and the step in which speeds are tried."""
INSIDE_M, INSIDE_EACH_M, INSIDE_MOST_M = 0.6, 0.042, 1.5
"""How far within the posts: at least, per metre of distance, at most."""
SLOWEST, PAST_M = 1.5, 5.0
"""Speed of a shot at least, and how far behind the line it would roll."""
FAR_M, WIDE_Y = 8.0, 4.0
"""Of a ball so far away shots so far from the middle are worth less."""
LATE_DEG, GOALKEEPER_DEG = 1.0, 10.0
"""Shots so near to the goalkeeper are worth less: to one that is too late for them, and else."""
SEEN_X = PENALTY_X - 30.0
"""Opponents further back do not matter."""
LATE_CYCLES, OTHERS_LATE_CYCLES = 1, 2
"""A goalkeeper, and the others, that are more than so many cycles late do not even come near."""
NEAR_VALUE, ONE_KICK_VALUE = 100.0, 50.0
"""What is lost if one of them comes near, and if the shot takes several kicks."""
EQUAL = 0.001
"""Speeds that differ by less, in metres per cycle, are equal."""
BEFORE_LINE_M, BEYOND_M = 1.0, 1.5
"""A player between the posts and this near to the goal line aims so far beyond itself."""

Indices = NDArray[np.int64]


@kernel
def _mouth(scene: Array) -> tuple[float, Array]:
    """Return the x that shots are aimed at, and (PLACES,) the y of the places, both metres."""
    me, ball = scene[ACTOR], scene[BALL]
    posts = np.array([-GOAL_Y, GOAL_Y])
    away = np.hypot(GOAL_X - ball[X], posts - ball[Y])
    inside = np.minimum(INSIDE_MOST_M, INSIDE_M + INSIDE_EACH_M * away)
    on_line = me[X] > GOAL_X - BEFORE_LINE_M and abs(me[Y]) < GOAL_Y
    return me[X] + BEYOND_M if on_line else GOAL_X, np.linspace(posts[0] + inside[0], posts[1] - inside[1], PLACES)


@kernel
def _defenders(scene: Array) -> Indices:
    """Return the rows of the opponents that can save a shot."""
    opponents = scene[OPPONENT:BALL]
    up = (opponents[:, X] >= SEEN_X) & (np.abs(opponents[:, Y]) <= PENALTY_Y)
    return OPPONENT + np.flatnonzero(up & (opponents[:, FROZEN] == 0))


@kernel
def _goalkeeper_apart(scene: Array, angle: float) -> float:
    """Return the degrees between a direction from the ball and that to the goalkeeper, infinite without one."""
    ball, apart = scene[BALL], np.inf
    for player in scene[OPPONENT:BALL]:
        if player[GOALKEEPER] * player[PRESENT] > 0:
            apart = turned(angle - direction(player[X] - ball[X], player[Y] - ball[Y]))
    return apart


@kernel
def _defended(scene: Array, defenders: Indices, path: Path, cycles: int) -> tuple[bool, bool, bool]:
    """Return whether an opponent saves a shot, whether the goalkeeper comes near it, and whether another one does.

    Args:
        defenders: rows of the scene. cycles: after which the ball is in the goal.
    """
    me = scene[ACTOR]
    first = first_cycles(scene, defenders, path, SHOT.behind_m)
    for place, row in enumerate(defenders):
        if along(scene[row, X] - me[X], scene[row, Y] - me[Y], path.cos, path.sin)[0] < 0:
            first[place] = NEVER_CYCLES
    near, others_near = False, False
    for cycle in range(1, min(cycles, CYCLES)):
        at = ball_after(scene, path, cycle)
        hands = in_their_area(at[0], at[1])
        for row in defenders[first <= cycle]:
            player = scene[row]
            if hands and player[GOALKEEPER] > 0:
                near = near or short_m(player, at, cycle, SHOT_GOALKEEPER, LATE_CYCLES) <= 0
                saved = near and short_m(player, at, cycle, SHOT_GOALKEEPER, 0) <= 0
            else:
                others_near = others_near or short_m(player, at, cycle, SHOT, OTHERS_LATE_CYCLES) <= 0
                saved = others_near and short_m(player, at, cycle, SHOT, 0) <= 0
            if saved:
                return True, near, others_near
    return False, near, others_near


@kernel
def best_shot(scene: Array) -> tuple[float, float, float, float]:
    """Return where to and how fast, and the speed that one kick gives; a speed of 0 where there is no shot.

    The value of a place is at most that of a shot for which all are late. Places are looked at from the greatest such
    value on, until none can be better than what is found.
    """
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    if gap(GOAL_X, 0.0, me[X], me[Y]) > FROM_M:
        return 0.0, 0.0, 0.0, 0.0
    x, places = _mouth(scene)
    metres = np.hypot(x - ball[X], places - ball[Y])
    cos, sin = (x - ball[X]) / metres, (places - ball[Y]) / metres
    one_kick, by_place, beside = np.empty(PLACES), np.empty(PLACES), np.empty((PLACES, 2))
    for place in range(PLACES):
        one_kick[place] = fastest_from(scene, cos[place], sin[place], ball[GAIN])
        wide = max(0.0, abs(places[place]) - WIDE_Y) if metres[place] > FAR_M else 0.0
        by_place[place] = gaussian(wide, GOAL_Y - INSIDE_MOST_M)
        apart = _goalkeeper_apart(scene, direction(cos[place], sin[place]))
        beside[place] = 1.0 - gaussian(apart, GOALKEEPER_DEG), 1.0 - gaussian(apart, LATE_DEG)
    fastest, defenders = server[BALL_SPEED_MAX], _defenders(scene)
    slowest = np.maximum(np.maximum(one_kick, SLOWEST), (metres + PAST_M) * (1.0 - server[BALL_DECAY]))
    bound = (1.0 + ONE_KICK_VALUE * (slowest <= one_kick + EQUAL) + 2.0 * NEAR_VALUE) * by_place * beside[:, 1]
    values, speeds = np.zeros(PLACES), np.zeros(PLACES)
    for place in np.argsort(-bound, kind="mergesort"):
        if bound[place] < values.max():
            break
        steps = max(0, 1 + int((fastest - EQUAL - slowest[place]) / FASTER))
        for step in range(steps + 1):
            speed = slowest[place] + FASTER * step if step < steps else fastest
            cycles = cycles_over(metres[place], speed, server[BALL_DECAY])
            saved, near, others_near = _defended(scene, defenders, Path(speed, cos[place], sin[place]), cycles)
            if saved:
                continue
            value = 1.0 + ONE_KICK_VALUE * (speed <= one_kick[place] + EQUAL) + NEAR_VALUE * (2 - near - others_near)
            value *= by_place[place] * beside[place, int(not near)]
            if value > values[place]:
                values[place], speeds[place] = value, speed
            if not near and not others_near:  # no harder shot is worth more
                break
    best = np.argmax(values)
    return x, places[best], speeds[best], one_kick[best]
