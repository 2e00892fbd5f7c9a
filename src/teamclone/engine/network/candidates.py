"""Candidates of a kick: where anybody might kick a ball, and what physics says of each. They know no team's rules.

A candidate is a velocity of the ball. Passes go to a team mate or a place around it and arrive with one of a few
speeds; shots and clearances are as hard as can be; runs put the ball where the actor is after some cycles of running;
the rest keep it close. `heads.candidates` scores them by the columns that `fill_candidates` gives.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.inputs.layout import GEOMETRY, MATES, OTHER, OTHERS
from teamclone.engine.network.constants import (
    AHEAD_M,
    CANDIDATE_DIRECTIONS,
    CLEARANCES,
    CLOSE_SHARES,
    LEAD_ANGLES,
    LEADS,
    LEADS_M,
    LEAST_GAIN,
    NEVER_CYCLES,
    PASS_ARRIVALS,
    PASSES_TO_EACH,
    RUN_CYCLES,
    SHOT_YS,
)
from teamclone.engine.network.layers import clamp
from teamclone.engine.network.spec import Floats
from teamclone.planner.scene import Array, roll
from teamclone.rcss import pitch
from teamclone.system.compiling import kernel

(_ME_X, _ME_Y, _COS, _SIN, _FORWARD, _ASIDE, _DECAY, _DASH_GAIN, _BALL_X, _BALL_Y, _BALL_VX, _BALL_VY, _GAIN, _AREA,
 _BALL_DECAY, _SPEED_MAX) = (
    GEOMETRY.index(name) for name in (
        "x", "y", "cos", "sin", "forward", "aside", "decay", "dash_gain", "ball_x", "ball_y", "ball_vx", "ball_vy",
        "kick_gain", "kick_area", "ball_decay", "ball_speed_max"))  # fmt: skip
_X, _Y, _VX, _VY, _THERE, _KEEPER = (OTHER.index(name) for name in ("x", "y", "vx", "vy", "there", "keeper"))
_WIDTH = len(OTHER)
_GOAL_X, _LINE_Y = pitch.HALF_LENGTH, pitch.HALF_WIDTH

PASS, SHOT, CLEAR, RUN, CLOSE, KINDS = range(6)
"""Kinds of candidates."""
TIMES = (1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 9.0, 12.0, 16.0, 21.0)
"""Cycles after the kick at which it is asked who is at the ball."""
PLAYER_SPEED = 0.95
"""Speed of a running player, metres per cycle."""
REACH_M = 1.1
"""Metres from which a player kicks the ball."""
REACT_CYCLES = 1.0
"""Cycles before a player runs."""
MOST_AHEAD = 10.0
"""Cycles to which leads of players are limited."""
MOST_M = 30.0
"""Metres to which distances to the nearest player are."""
_FAR_M = 1e3


class Others(NamedTuple):
    """The other players one cycle later, the team mates first.

    Attributes:
        x, y: (OTHERS,) metres; far away where there is none. columns: (OTHERS * len(OTHER),) now.
        line: the offside line, x. rolled: (len(TIMES),) metres that the ball rolls until then,
            per metre per cycle.
    """

    x: Array
    y: Array
    columns: Floats
    line: float
    rolled: Array


class Aim(NamedTuple):
    """A candidate: its kind, the ball's velocity, metres per cycle, where it goes, and to which team mate, else -1."""

    kind: int
    vx: float
    vy: float
    x: float
    y: float
    mate: int


class Race(NamedTuple):
    """Who is at the ball after a kick, in cycles.

    Attributes:
        cut: by how much the first opponent is late before the ball is where it is to go; less than 0 cuts it off.
        theirs, mates: the same of both sides as long as it rolls. their_time, mate_time: when they first have it.
    """

    cut: float
    theirs: float
    their_time: float
    mates: float
    mate_time: float


@kernel
def nearest(players: Others, first: int, last: int, x: float, y: float) -> float:
    """Return the metres from a place to the nearest of some players, at most MOST_M."""
    least = MOST_M * MOST_M
    for player in range(first, last):
        dx, dy = players.x[player] - x, players.y[player] - y
        least = min(least, dx * dx + dy * dy)
    return math.sqrt(least)


@kernel
def race(players: Others, aim: Aim, geometry: Floats, cycles: float) -> Race:
    """Return who is at the ball after a kick that is where it is to go after so many cycles."""
    ball_x, ball_y = float(geometry[_BALL_X]), float(geometry[_BALL_Y])
    cut, theirs, mates = MOST_AHEAD, MOST_AHEAD, MOST_AHEAD
    their_time, mate_time = NEVER_CYCLES, NEVER_CYCLES
    for index in range(len(TIMES)):
        time, rolled = TIMES[index], players.rolled[index]
        x, y = ball_x + aim.vx * rolled, ball_y + aim.vy * rolled
        late = max(nearest(players, MATES, OTHERS, x, y) - REACH_M, 0.0) / PLAYER_SPEED + REACT_CYCLES - time
        own = max(nearest(players, 0, MATES, x, y) - REACH_M, 0.0) / PLAYER_SPEED + REACT_CYCLES - time
        if index == 0 or time <= cycles:
            cut = min(cut, late)
        theirs, mates = min(theirs, late), min(mates, own)
        if late <= 0.0:
            their_time = min(their_time, time)
        if own <= 0.0:
            mate_time = min(mate_time, time)
    least = -MOST_AHEAD
    return Race(max(cut, least), max(theirs, least), their_time, max(mates, least), mate_time)


@kernel
def _put_receiver(players: Others, aim: Aim, cycles: float, columns: Floats) -> None:
    """Fill what is known of the team mate that a pass goes to, zeros for other kicks.

    Whether it is offside, and the goalkeeper; how far the place is from it; how near an opponent is to it; how late it
    is at the place.
    """
    columns[:] = 0
    if aim.mate < 0:
        return
    of = players.columns[aim.mate * _WIDTH : (aim.mate + 1) * _WIDTH]
    x, y = float(of[_X]), float(of[_Y])
    away = math.hypot(players.x[aim.mate] - aim.x, players.y[aim.mate] - aim.y)
    late = max(away - REACH_M, 0.0) / PLAYER_SPEED + REACT_CYCLES - cycles
    columns[0], columns[1] = 1.0 if x > players.line else 0.0, of[_KEEPER]
    columns[2], columns[3] = (aim.x - x) / 10, (aim.y - y) / 10
    columns[4] = nearest(players, MATES, OTHERS, x, y) / 10
    columns[5] = clamp(late, -MOST_AHEAD, MOST_AHEAD) / 5


@kernel
def describe(players: Others, aim: Aim, geometry: Floats, columns: Floats) -> None:
    """Fill (CANDIDATE_COLUMNS,) what is known of a candidate, all of the order of 1.

    The kind, one of KINDS; the ball's speed, the power of the kick and its direction from the body; the place where it
    goes, its direction on the pitch, how far that is, when and how fast it is there; how late the first opponent is
    before that, and either side as long as it rolls, and when the team has it; how near either side is to the place,
    how far the goal, how much nearer than now, and whether it is off the pitch; where the ball is one cycle later, seen
    from the actor, and how near an opponent is to it; then what `_put_receiver` says.
    """
    ball_x, ball_y, decay = float(geometry[_BALL_X]), float(geometry[_BALL_Y]), float(geometry[_BALL_DECAY])
    cos, sin = float(geometry[_COS]), float(geometry[_SIN])
    speed = math.sqrt(aim.vx * aim.vx + aim.vy * aim.vy + 1e-6)
    dx, dy = aim.vx - float(geometry[_BALL_VX]), aim.vy - float(geometry[_BALL_VY])
    added = math.sqrt(dx * dx + dy * dy + 1e-6)
    distance = math.hypot(aim.x - ball_x, aim.y - ball_y)
    left = max(1.0 - distance * (1.0 - decay) / speed, 0.05)
    cycles = max(math.log(left) / math.log(decay), 1.0)
    for kind in range(KINDS):
        columns[kind] = 1.0 if kind == aim.kind else 0.0
    out = columns[KINDS:]
    out[0], out[1] = speed / 3, min(added / max(float(geometry[_GAIN]), LEAST_GAIN) / 100, 2.0)
    out[2], out[3] = (dx * cos + dy * sin) / added, (dy * cos - dx * sin) / added
    out[4], out[5], out[6], out[7] = aim.x / _GOAL_X, aim.y / _LINE_Y, aim.vx / speed, aim.vy / speed
    out[8], out[9], out[10] = distance / 30, cycles / 20, speed * left / 3
    who = race(players, aim, geometry, cycles)
    out[11], out[12], out[13] = who.cut / 5, who.theirs / 5, who.mates / 5
    out[14], out[15] = (who.their_time - who.mate_time) / 10, who.mate_time / 10
    out[16], out[17] = (
        nearest(players, MATES, OTHERS, aim.x, aim.y) / 10,
        nearest(players, 0, MATES, aim.x, aim.y) / 10,
    )
    to_goal = math.hypot(_GOAL_X - aim.x, aim.y)
    out[18], out[19] = to_goal / 50, (math.hypot(_GOAL_X - ball_x, ball_y) - to_goal) / 20
    out[20] = 1.0 if abs(aim.y) > _LINE_Y or abs(aim.x) > _GOAL_X else 0.0
    # The ball one cycle later, seen from where the actor is then.
    x, y = ball_x + aim.vx - float(geometry[_ME_X]), ball_y + aim.vy - float(geometry[_ME_Y])
    ahead, aside = x * cos + y * sin - float(geometry[_FORWARD]), y * cos - x * sin - float(geometry[_ASIDE])
    area = max(float(geometry[_AREA]), 0.1)
    out[21] = min(math.hypot(ahead, aside) / area, 3.0)
    out[22], out[23] = clamp(ahead / area, -2.0, 2.0), clamp(aside / area, -2.0, 2.0)
    out[24] = min(nearest(players, MATES, OTHERS, ball_x + aim.vx, ball_y + aim.vy) / 5, 1.0)
    _put_receiver(players, aim, cycles, out[25:])


@kernel
def _others_of(geometry: Floats, others: Floats) -> Others:
    """Return the other players one cycle later."""
    x, y = np.full(OTHERS, _FAR_M), np.full(OTHERS, _FAR_M)
    first, second = -_GOAL_X, -_GOAL_X
    for player in range(OTHERS):
        of = others[player * _WIDTH : (player + 1) * _WIDTH]
        if not of[_THERE] > 0:
            continue
        at = float(of[_X])
        x[player], y[player] = at + of[_VX], float(of[_Y]) + of[_VY]
        if player >= MATES:
            first, second = max(first, at), max(second, min(first, at))
    rolled = np.empty(len(TIMES))
    for index in range(len(TIMES)):
        rolled[index] = roll(TIMES[index], float(geometry[_BALL_DECAY]))
    line = max(second, 0.0, float(geometry[_BALL_X]))
    return Others(x, y, others, line, rolled)


@kernel
def _towards(kind: int, x: float, y: float, arrival: float, mate: int, geometry: Floats) -> Aim:
    """Return the kick that is at a place with a speed, or as fast as can be."""
    dx, dy = x - float(geometry[_BALL_X]), y - float(geometry[_BALL_Y])
    distance = math.sqrt(dx * dx + dy * dy + 1e-6)
    speed = min(arrival + distance * (1.0 - float(geometry[_BALL_DECAY])), float(geometry[_SPEED_MAX]))
    return Aim(kind, speed * dx / distance, speed * dy / distance, x, y, mate)


@kernel
def _followed(kind: int, x: float, y: float, cycles: float, geometry: Floats) -> Aim:
    """Return the kick that is at a place after so many cycles, or as fast as can be."""
    rolled = roll(cycles, float(geometry[_BALL_DECAY]))
    vx, vy = (x - float(geometry[_BALL_X])) / rolled, (y - float(geometry[_BALL_Y])) / rolled
    factor = min(1.0, float(geometry[_SPEED_MAX]) / math.sqrt(vx * vx + vy * vy + 1e-6))
    return Aim(kind, vx * factor, vy * factor, x, y, -1)


@kernel
def run_m(cycles: float, geometry: Floats) -> float:
    """Return the metres that full dashes from the second cycle on carry the actor further than it coasts."""
    decay = float(geometry[_DECAY])
    return 100.0 * float(geometry[_DASH_GAIN]) / (1.0 - decay) * ((cycles - 1) - decay * roll(cycles - 1, decay))


@kernel
def beside_actor(ahead: float, aside: float, cycles: float, geometry: Floats) -> tuple[float, float]:
    """Return the place so many metres ahead, and to the right, of where the actor coasts in some cycles."""
    cos, sin = float(geometry[_COS]), float(geometry[_SIN])
    coasted = roll(cycles, float(geometry[_DECAY]))
    along, across = float(geometry[_FORWARD]) * coasted + ahead, float(geometry[_ASIDE]) * coasted + aside
    x, y = float(geometry[_ME_X]), float(geometry[_ME_Y])
    return x + along * cos - across * sin, y + along * sin + across * cos


@kernel
def _around_actor(metres: float, turn: int, cycles: float, geometry: Floats) -> tuple[float, float]:
    """Return a place some metres from where the actor coasts, in one of the directions around its body."""
    angle = 2 * math.pi * turn / CANDIDATE_DIRECTIONS
    return beside_actor(metres * math.cos(angle), metres * math.sin(angle), cycles, geometry)


@kernel
def _put(players: Others, aim: Aim, geometry: Floats, at: int, wanted: Floats, columns: NDArray[np.float32]) -> int:
    """Fill a candidate, and return the place of the next."""
    wanted[3 * at], wanted[3 * at + 1], wanted[3 * at + 2] = 1.0, aim.vx, aim.vy
    describe(players, aim, geometry, columns[at])
    return at + 1


@kernel
def fill_candidates(geometry: Floats, others: Floats, wanted: Floats, columns: NDArray[np.float32]) -> None:
    """Fill the candidates of a kick, and what is known of each.

    Args:
        geometry: (len(GEOMETRY),). others: (OTHERS * len(OTHER),).
        wanted: (3 * N_CANDIDATES,) of each 1, or 0 where there is no such team mate, and the ball's velocity.
        columns: (N_CANDIDATES, CANDIDATE_COLUMNS).
    """
    players = _others_of(geometry, others)
    ball_x, ball_y = float(geometry[_BALL_X]), float(geometry[_BALL_Y])
    top = float(geometry[_SPEED_MAX])
    wanted[:] = 0
    at = 0
    for mate in range(MATES):
        if not others[mate * _WIDTH + _THERE] > 0:
            columns[at : at + PASSES_TO_EACH] = 0
            at += PASSES_TO_EACH
            continue
        for lead in range(LEADS):
            x, y = players.x[mate], players.y[mate]
            if lead > 0:
                far, angle = (
                    LEADS_M[(lead - 1) // len(LEAD_ANGLES)],
                    math.radians(LEAD_ANGLES[(lead - 1) % len(LEAD_ANGLES)]),
                )
                x, y = x + far * math.cos(angle), y + far * math.sin(angle)
            for index in range(len(PASS_ARRIVALS)):
                aim = _towards(PASS, x, y, PASS_ARRIVALS[index], mate, geometry)
                at = _put(players, aim, geometry, at, wanted, columns)
    for index in range(len(SHOT_YS)):
        aim = _towards(SHOT, _GOAL_X, SHOT_YS[index], top, -1, geometry)
        at = _put(players, aim, geometry, at, wanted, columns)
    far = top * roll(NEVER_CYCLES, float(geometry[_BALL_DECAY]))
    for index in range(CLEARANCES):
        angle = 2 * math.pi * index / CLEARANCES
        aim = _towards(CLEAR, ball_x + far * math.cos(angle), ball_y + far * math.sin(angle), top, -1, geometry)
        at = _put(players, aim, geometry, at, wanted, columns)
    for index in range(len(RUN_CYCLES)):
        cycles = RUN_CYCLES[index]
        run = run_m(cycles, geometry)
        for turn in range(CANDIDATE_DIRECTIONS):
            x, y = _around_actor(run + AHEAD_M, turn, cycles, geometry)
            at = _put(players, _followed(RUN, x, y, cycles, geometry), geometry, at, wanted, columns)
    for index in range(len(CLOSE_SHARES)):
        for turn in range(CANDIDATE_DIRECTIONS):
            x, y = _around_actor(CLOSE_SHARES[index] * float(geometry[_AREA]), turn, 1.0, geometry)
            at = _put(players, _followed(CLOSE, x, y, 1.0, geometry), geometry, at, wanted, columns)
    _put(players, Aim(CLOSE, 0.0, 0.0, ball_x, ball_y, -1), geometry, at, wanted, columns)
