"""Shots: to which of some places in the goal, and how hard."""

from __future__ import annotations

from teamclone.planner.ball import NEVER_CYCLES, Path, ball_after, cycles_over, fastest_from
from teamclone.planner.players import SHOT, SHOT_GOALKEEPER, arrival, first_cycle
from teamclone.planner.scene import (
    ACTOR,
    BALL,
    BALL_DECAY,
    BALL_SPEED_MAX,
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
    kernel,
    turned,
)

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


@kernel
def _lateness(scene: Array, path: Path, last: int) -> tuple[int, int]:
    """Return by how many cycles the goalkeeper and the others miss a shot that is in the goal after ``last``.

    The least of them all; 0 or less if one saves it.
    """
    me = scene[ACTOR]
    goalkeeper, others = NEVER_CYCLES, NEVER_CYCLES
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        ahead, _ = along(player[X] - me[X], player[Y] - me[Y], path.cos, path.sin)
        if player[FROZEN] > 0 or player[X] < SEEN_X or abs(player[Y]) > PENALTY_Y or ahead < 0:
            continue
        catches = player[GOALKEEPER] > 0
        for cycle in range(first_cycle(scene, player, path, SHOT.behind_m), last):
            place = ball_after(scene, path, cycle)
            if catches and in_their_area(place[0], place[1]):
                goalkeeper = min(goalkeeper, arrival(scene, player, place, cycle, SHOT_GOALKEEPER) - cycle)
            else:
                others = min(others, arrival(scene, player, place, cycle, SHOT) - cycle)
            if goalkeeper <= 0 or others <= 0:
                return goalkeeper, others
    return goalkeeper, others


@kernel
def best_shot(scene: Array) -> tuple[float, float, float, float]:
    """Return where to and how fast, and the speed that one kick gives; a speed of 0 where there is no shot."""
    me, ball, server = scene[ACTOR], scene[BALL], scene[SERVER]
    if gap(GOAL_X, 0.0, me[X], me[Y]) > FROM_M:
        return 0.0, 0.0, 0.0, 0.0
    goal_x, low, high = GOAL_X, -GOAL_Y, GOAL_Y
    low += min(INSIDE_MOST_M, INSIDE_M + INSIDE_EACH_M * gap(goal_x, low, ball[X], ball[Y]))
    high -= min(INSIDE_MOST_M, INSIDE_M + INSIDE_EACH_M * gap(goal_x, high, ball[X], ball[Y]))
    if me[X] > GOAL_X - 1.0 and abs(me[Y]) < GOAL_Y:
        goal_x = me[X] + 1.5
    goalkeeper_at, guarded = 0.0, False
    for opponent in range(OPPONENT, BALL):
        player = scene[opponent]
        if player[GOALKEEPER] > 0 and player[PRESENT] > 0:
            guarded, goalkeeper_at = True, direction(player[X] - ball[X], player[Y] - ball[Y])
    best, best_y, best_speed, best_one = 0.0, 0.0, 0.0, 0.0
    fastest = server[BALL_SPEED_MAX]
    for index in range(PLACES):
        y = low + (high - low) / (PLACES - 1) * index
        metres, angle = gap(goal_x, y, ball[X], ball[Y]), direction(goal_x - ball[X], y - ball[Y])
        cos, sin = (goal_x - ball[X]) / metres, (y - ball[Y]) / metres
        one = fastest_from(scene, cos, sin, ball[GAIN])
        speed = max((metres + PAST_M) * (1.0 - server[BALL_DECAY]), one, SLOWEST)
        last = False
        while not last:
            if speed > fastest - 0.001:
                speed, last = fastest, True
            cycles = cycles_over(metres, speed, server[BALL_DECAY])
            goalkeeper, others = _lateness(scene, Path(speed, cos, sin), cycles)
            if goalkeeper > 0 and others > 0:
                late, others_late = goalkeeper > LATE_CYCLES, others > OTHERS_LATE_CYCLES
                value = 1.0 + ONE_KICK_VALUE * (speed <= one + 0.001) + NEAR_VALUE * (late + others_late)
                if guarded:
                    value *= 1.0 - gaussian(turned(angle - goalkeeper_at), LATE_DEG if late else GOALKEEPER_DEG)
                if metres > FAR_M:
                    value *= gaussian(max(0.0, abs(y) - WIDE_Y), GOAL_Y - INSIDE_MOST_M)
                if value > best:
                    best, best_y, best_speed, best_one = value, y, speed, one
                last |= late and others_late
            speed += FASTER
    return goal_x, best_y, best_speed, best_one
