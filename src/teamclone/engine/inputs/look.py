"""What one actor makes of a frame: its axes, who has the ball, who meets it where, and the lines."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.inputs.frame import COS, DEFENDERS, FAR_M, SIN, TO_BALL, Frame
from teamclone.engine.inputs.reach import NEVER_CYCLES, REACH_CYCLES, fill_times, own_cycles
from teamclone.planner.scene import AREA, BALL, FROZEN, OPPONENT, PRESENT, VX, VY, Array, X, Y, along, gap
from teamclone.rcss.players import N_PLAYERS
from teamclone.system.compiling import kernel

DOUBT_SHARE, DOUBT_M = 0.02, 0.5
"""An actor's error about the place of an opponent near the ball: a share of the distances, and its maximum."""
MEETINGS = 4
"""Meetings with the ball: of the actor, the first mate, the first opponent and the first of all."""
OWN, MATE, MATE_2, THEIRS, THEIRS_2, FIRST, MOMENTS = range(7)
"""Places of ``Look.moments``: cycles to the ball of the actor, the first two of each side, and the first of all."""


_MEETS = (OWN, MATE, THEIRS, FIRST)
"""The moments of the meetings."""


class Order(NamedTuple):
    """Players of one side, the nearest first.

    Attributes:
        rows: (11,) rows of the scene. number: of them that count.
    """

    rows: NDArray[np.int64]
    number: int


class Look(NamedTuple):
    """A frame as its actor sees it.

    Attributes:
        actor: row of the scene, 0..10. x, y: of it, metres. cos, sin: of its body direction.
        forward, aside: its velocity along and across the body; speed: its length; metres per cycle.
        to_me: (22,) metres from the actor. mates, opponents: on the field, the nearest to the actor first.
        mate_has_it: a mate can kick the ball now. gap: metres that the opponents lack to do so. held: they do not.
        path: (REACH_CYCLES + 1, 2) of the ball. steps: (22,) cycles to the ball, the actor's are moments[OWN].
        moments: (MOMENTS,). rank: mates that are at the ball before the actor.
        meetings: (MEETINGS, 2) metres. line: the offside line, x; limit: how far ahead a player goes, x.
    """

    actor: int
    x: float
    y: float
    cos: float
    sin: float
    forward: float
    aside: float
    speed: float
    to_me: Array
    mates: Order
    opponents: Order
    mate_has_it: bool
    gap: float
    held: bool
    path: Array
    steps: Array
    moments: Array
    rank: int
    meetings: Array
    line: float
    limit: float


@kernel
def nearest(scene: Array, distance: Array, side: tuple[int, int], actor: int) -> Order:
    """Return the players of one side on the field but for the actor, by their distance, (22,).

    Args:
        side: first row, and the row after the last.
    """
    rows, count = np.zeros(OPPONENT, np.int64), 0
    for row in range(side[0], side[1]):
        if scene[row, PRESENT] > 0 and row != actor:
            place = count
            while place > 0 and distance[rows[place - 1]] > distance[row]:
                rows[place] = rows[place - 1]
                place -= 1
            rows[place] = row
            count += 1
    return Order(rows, count)


@kernel
def _who_has_it(frame: Frame, to_me: Array, actor: int) -> tuple[bool, float]:
    """Return whether a mate can kick the ball now, and the metres that the opponents lack to do so."""
    scene, to_ball = frame.scene, frame.more[:, TO_BALL]
    mate_has_it, least = False, FAR_M
    for row in range(BALL):
        player = scene[row]
        if player[PRESENT] == 0 or player[FROZEN] > 0 or row == actor:
            continue
        if row < OPPONENT:
            mate_has_it |= to_ball[row] < player[AREA]
        else:
            doubt = min(DOUBT_SHARE * (to_me[row] + to_ball[actor]), DOUBT_M)
            least = min(least, to_ball[row] - player[AREA] - doubt)
    return mate_has_it, least


@kernel
def _first_two(scene: Array, steps: Array, side: tuple[int, int], actor: int) -> tuple[float, float]:
    """Return the least two cycles to the ball of one side but for the actor."""
    first = second = NEVER_CYCLES
    for row in range(side[0], side[1]):
        if scene[row, PRESENT] > 0 and row != actor:
            first, second = min(first, steps[row]), min(second, max(first, steps[row]))
    return first, second


@kernel
def _place_after(path: Array, cycles: float) -> tuple[float, float]:
    """Return where the ball is after so many cycles, at most REACH_CYCLES."""
    at = int(cycles + 0.5) if cycles < REACH_CYCLES else REACH_CYCLES
    return path[at, 0], path[at, 1]


@kernel
def _meet(frame: Frame, steps: Array, path: Array, actor: int) -> tuple[Array, Array, int]:
    """Return moments, meetings and rank of `Look`."""
    moments, meetings, rank = np.empty(MOMENTS), np.empty((MEETINGS, 2)), 0
    moments[OWN] = own_cycles(frame.scene, path, actor)
    moments[MATE], moments[MATE_2] = _first_two(frame.scene, steps, (0, OPPONENT), actor)
    moments[THEIRS], moments[THEIRS_2] = _first_two(frame.scene, steps, (OPPONENT, BALL), actor)
    moments[FIRST] = min(moments[OWN], moments[MATE], moments[THEIRS])
    for place in range(MEETINGS):
        meetings[place, 0], meetings[place, 1] = _place_after(path, moments[_MEETS[place]])
    for row in range(OPPONENT):
        rank += frame.scene[row, PRESENT] > 0 and row != actor and steps[row] < moments[OWN]
    return moments, meetings, rank


@kernel
def look(frame: Frame, actor: int) -> Look:
    """Return a frame as one of its players sees it; what is shared is added to the frame where it is not yet known."""
    scene, more = frame.scene, frame.more
    me, ball = scene[actor], scene[BALL]
    to_me = np.empty(N_PLAYERS)
    for row in range(N_PLAYERS):
        to_me[row] = gap(scene[row, X], scene[row, Y], me[X], me[Y])
    mate_has_it, least = _who_has_it(frame, to_me, actor)
    case = int(least < 0)
    path, steps = frame.path[case], frame.steps[case]
    if not frame.known[case]:
        fill_times(scene, case == 1, path, steps)
        frame.known[case] = True
    moments, meetings, rank = _meet(frame, steps, path, actor)
    cos, sin = more[actor, COS], more[actor, SIN]
    forward, aside = along(me[VX], me[VY], cos, sin)
    line = max(frame.lines[DEFENDERS], 0.0, ball[X] + ball[VX], meetings[MEETINGS - 1, 0])
    ahead = meetings[1, 0] if moments[MATE] < REACH_CYCLES else line
    return Look(
        actor,
        me[X],
        me[Y],
        cos,
        sin,
        forward,
        aside,
        math.hypot(forward, aside),
        to_me,
        nearest(scene, to_me, (0, OPPONENT), actor),
        nearest(scene, to_me, (OPPONENT, BALL), actor),
        mate_has_it,
        least,
        case == 1,
        path,
        steps,
        moments,
        rank,
        meetings,
        line,
        max(line, ahead),
    )


@kernel
def seen_from(view: Look, x: float, y: float) -> tuple[float, float]:
    """Return how far a place on the pitch is ahead of the actor, and how far to its right."""
    return along(x - view.x, y - view.y, view.cos, view.sin)


@kernel
def own_steps(view: Look, row: int) -> float:
    """Return the cycles to the ball of a player, of the actor as it judges itself."""
    return view.moments[OWN] if row == view.actor else view.steps[row]
