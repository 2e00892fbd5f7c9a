"""The kernels that fill the columns of the blocks, see `layout.WIDTH`. Each returns the place after its last column."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.inputs.frame import AGE, COS, FLAGS, LAST_LINE, NECK, SIN, TO_BALL, VIEW_WIDTH, Frame, whole
from teamclone.engine.inputs.layout import (
    AGED_MATES,
    COMMANDS,
    MATES,
    MODES,
    NEAREST_OPPONENTS,
    OTHER,
    PLAYER,
    RIVALS,
    SIDED_SITUATION,
    TACKLE,
    TYPE_PARAMETERS,
)
from teamclone.engine.inputs.look import (
    MATE,
    MEETINGS,
    MOMENTS,
    OWN,
    THEIRS,
    Look,
    Order,
    nearest,
    own_steps,
    seen_from,
)
from teamclone.engine.inputs.reach import REACH_CYCLES
from teamclone.planner.ball import kick_rate
from teamclone.planner.columns import CHOICES, MOST_VALUE_M, PLAN, UNDERWAY, VALUED, WAYS
from teamclone.planner.scene import (
    AREA,
    BALL,
    BALL_DECAY,
    BALL_SPEED_MAX,
    BODY,
    CAPACITY,
    DASH_RATE,
    DECAY,
    EFFORT,
    GOALKEEPER,
    INERTIA,
    MARGIN,
    OPPONENT,
    RECOVERY,
    SERVER,
    STAMINA,
    STAMINA_INC,
    TACKLE_DIST,
    TACKLE_EXPONENT,
    TACKLE_WIDTH,
    TOUCH,
    VX,
    VY,
    Array,
    X,
    Y,
    along,
    gap,
    roll,
)
from teamclone.rcss import pitch
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.player_types import RANGES
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.playmodes import RESTARTS, SITUATION
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.system.compiling import kernel
from teamclone.world.channels import CHANNEL, FLAG_CHARGED, FLAG_COLLIDED, FLAG_GOALIE, FLAG_TACKLING, TYPE_FIELD

Out = NDArray[np.float32]

NEAR_M = 1.0
NEAR_SHARE = 0.1
"""A player takes itself to be in its place within this many metres, or this share of the distance to the ball."""
RECOVER_BAND, EFFORT_BAND = 100.0, 800.0
"""Stamina around the thresholds of recovery and effort within which the block ``self`` is finer."""
SLACK_M = 0.01
"""Metres by which a ball may be farther away than any tackle or kick reaches and is looked at still."""
SURELY_M = 0.055
"""Metres within its reach at which a ball is surely kickable."""

_STAMINA_MAX, _CAPACITY, _RECOVER_THR, _EFFORT_THR, _TACKLE_BACK = (
    SERVER_FIELD[name]
    for name in ("stamina_max", "stamina_capacity", "recover_dec_thr", "effort_inc_thr", "tackle_back_dist")
)
_TYPE_FIELDS = tuple(TYPE_FIELD[name] for name in TYPE_PARAMETERS)
_TYPE_MIDDLE, _TYPE_HALF = (
    np.array([(RANGES[name][1] + sign * RANGES[name][0]) / 2 if name in RANGES else 1.0 for name in TYPE_FIELD])
    for sign in (1, -1)
)
"""(fields,) of each parameter of a type the middle and half of the range that the server draws from."""
_MODE_COLUMN = np.where(
    SITUATION < SIDED_SITUATION, SITUATION, 2 * SITUATION - SIDED_SITUATION + (RESTARTS < 0)
).astype(np.int64)
"""(256,) the MODES column of a play mode: a Situation without a side, or one and the side that restarts, own first."""
_STATES = (FLAG_TACKLING, FLAG_CHARGED, FLAG_COLLIDED)
_KICK = int(CommandKind.KICK)
_X, _Y, _VX, _VY, _BODY, _STAMINA, _LAST = (
    CHANNEL[name] for name in ("x", "y", "vx", "vy", "body", "stamina", "last_command")
)
_THERE, _VALUE, _KICKS, _UNDERWAY, _TACKLE, _WAY = (
    PLAN.index(name)
    for name in ("shot_there", "pass_value", "pass_kicks", "underway_dribble_m", "tackle_there", "shot_vx")
)


@kernel
def clamp(value: float, low: float, high: float) -> float:
    """Return a value between two bounds; one that is not a number stays so."""
    return low if value < low else (high if value > high else value)


@kernel
def one_if(holds: bool) -> float:
    """Return 1 if something holds, else 0."""
    return 1.0 if holds else 0.0


@kernel
def put(out: Out, at: int, values: tuple[float, ...]) -> int:
    """Write values from a place on, and return the place after them."""
    for index in range(len(values)):
        out[at + index] = values[index]
    return at + len(values)


@kernel
def put_polar(out: Out, at: int, place: tuple[float, float]) -> int:
    """Write a relative place: both coordinates in 20 m, log distance, cosine and sine."""
    x, y = place
    distance = math.sqrt(x * x + y * y + 1e-8)
    return put(out, at, (x / 20, y / 20, math.log(distance + 0.1), x / distance, y / distance))


@kernel
def put_on_pitch(out: Out, at: int, x: float, y: float) -> int:
    """Write a place on the pitch, in halves of its length and width."""
    return put(out, at, (x / pitch.HALF_LENGTH, y / pitch.HALF_WIDTH))


@kernel
def put_one_hot(out: Out, at: int, which: int, count: int) -> int:
    """Write a 1 at one of ``count`` places, 0 at the others."""
    for index in range(count):
        out[at + index] = index == which
    return at + count


@kernel
def put_core(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write positions on the pitch, the time to meet the ball, and the lines."""
    ball = frame.scene[BALL]
    at = put_on_pitch(out, at, view.x, view.y)
    at = put_on_pitch(out, at, ball[X], ball[Y])
    at = put(out, at, (ball[VX], ball[VY]))
    for meeting in range(MEETINGS):
        at = put_on_pitch(out, at, view.meetings[meeting, 0], view.meetings[meeting, 1])
    for moment in range(MOMENTS):
        out[at + moment] = min(view.moments[moment], REACH_CYCLES) / 20
    lines = view.line, view.limit, frame.lines[LAST_LINE]
    for index in range(len(lines)):
        out[at + MOMENTS + index] = lines[index] / pitch.HALF_LENGTH
    return at + MOMENTS + len(lines)


@kernel
def put_self(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write the actor's body, motion, stamina and whether it is frozen or has collided."""
    me, server, flags = frame.scene[view.actor], frame.scene[SERVER], int(frame.more[view.actor, FLAGS])
    stamina, most = me[STAMINA], server[_STAMINA_MAX]
    at = put(out, at, (view.cos, view.sin, view.speed, view.forward, view.aside))
    stamina_columns = (
        stamina / most,
        clamp(stamina - server[_RECOVER_THR] * most, -RECOVER_BAND, RECOVER_BAND) / RECOVER_BAND,
        clamp(stamina - server[_EFFORT_THR] * most, -EFFORT_BAND, EFFORT_BAND) / EFFORT_BAND,
        me[EFFORT],
        me[RECOVERY],
        me[CAPACITY] / max(server[_CAPACITY], 1.0),
    )
    at = put(out, at, stamina_columns)
    for index in range(len(_STATES)):
        out[at + index] = (flags & _STATES[index]) != 0
    return at + len(_STATES)


@kernel
def put_role(view: Look, out: Out, at: int) -> int:
    """Write the actor's uniform number, one-hot."""
    return put_one_hot(out, at, view.actor, N_TEAM)


@kernel
def projected(of_type: Array, field: int) -> float:
    """Return a parameter of a type, projected onto [-1, 1] by the range that the server draws from."""
    return (of_type[field] - _TYPE_MIDDLE[field]) / _TYPE_HALF[field]


@kernel
def put_type(of_type: Array, out: Out, at: int) -> int:
    """Write the parameters of the actor's type, see `projected`."""
    for index in range(len(_TYPE_FIELDS)):
        out[at + index] = projected(of_type, _TYPE_FIELDS[index])
    return at + len(_TYPE_FIELDS)


@kernel
def put_last(kinds: Array, actor: int, out: Out, at: int) -> int:
    """Write the actor's last command, one-hot, and whether a team mate or an opponent kicked.

    Args:
        kinds: (22,) last commands.
    """
    at = put_one_hot(out, at, min(max(whole(kinds[actor]), 0), COMMANDS - 1), COMMANDS)
    mate = opponent = False
    for row in range(BALL):
        kicked = row != actor and whole(kinds[row]) == _KICK
        if row < OPPONENT:
            mate |= kicked
        else:
            opponent |= kicked
    return put(out, at, (one_if(mate), one_if(opponent)))


@kernel
def put_view(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write the view direction relative to the body, and the view width."""
    neck = math.radians(frame.more[view.actor, NECK])
    return put(out, at, (math.cos(neck), math.sin(neck), frame.more[view.actor, VIEW_WIDTH] / 180))


@kernel
def tackle_success(server: Array, forward: float, aside: float) -> float:
    """Return the probability of a tackle, at least -1; 1 - `dynamics.formulas.tackle_failure`."""
    reach = server[TACKLE_DIST] if forward > 0 else server[_TACKLE_BACK]
    along_part = (abs(forward) / reach) ** server[TACKLE_EXPONENT] if reach > 0 else 2.0
    return 1.0 - min(along_part + (abs(aside) / server[TACKLE_WIDTH]) ** server[TACKLE_EXPONENT], 2.0)


@kernel
def put_ball(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write the ball in the actor's axes, now and in the next cycle."""
    ball, area = frame.scene[BALL], frame.scene[view.actor, AREA]
    now = seen_from(view, ball[X], ball[Y])
    seen_next = seen_from(view, ball[X] + ball[VX], ball[Y] + ball[VY])
    ahead = seen_next[0] - view.forward, seen_next[1] - view.aside
    velocity = along(ball[VX], ball[VY], view.cos, view.sin)
    lacks, lacks_next = math.hypot(now[0], now[1]) - area, math.hypot(ahead[0], ahead[1]) - area
    turn = math.degrees(math.atan2(ahead[1], ahead[0]))
    at = put_polar(out, at, now)
    at = put_polar(out, at, ahead)
    at = put(out, at, (velocity[0], velocity[1], math.hypot(velocity[0], velocity[1])))
    columns = (
        clamp(lacks, -0.5, 0.5) * 4,
        one_if(lacks <= -SURELY_M),
        clamp(lacks_next, -1.0, 1.0) * 2,
        tackle_success(frame.scene[SERVER], now[0], now[1]),
        clamp(turn / 10, -1.0, 1.0),
        clamp(turn, -2.0, 2.0) / 2,
    )
    return put(out, at, columns)


@kernel
def put_reach(view: Look, out: Out, at: int) -> int:
    """Write the control of the ball, the times in which players can have it, and the places."""
    own, mate, opponent = view.moments[OWN], view.moments[MATE], view.moments[THEIRS]
    out[at] = min(own, 6.0) / 6
    margins = own - mate, own - opponent, mate - opponent, min(own, mate) - opponent
    for index in range(len(margins)):
        out[at + 1 + index] = clamp(margins[index], -6.0, 6.0) / 6
    has = view.rank / 5, one_if(view.mate_has_it), one_if(view.held), clamp(view.gap, -1.0, 1.0)
    at = put(out, at + 1 + len(margins), has)
    for meeting in range(MEETINGS):
        at = put_polar(out, at, seen_from(view, view.meetings[meeting, 0], view.meetings[meeting, 1]))
    return at


@kernel
def put_lines(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write how far the actor is from the offside line, the limit of a run, the own last line and the ball."""
    x, ball_x, last = view.x, frame.scene[BALL, X], frame.lines[LAST_LINE]
    columns = (
        (view.line - x) / 20,
        clamp(view.line - x, -2.0, 2.0),
        clamp(view.limit - x, -3.0, 3.0),
        (last - x) / 20,
        clamp(last - x, -1.0, 1.0),
        clamp(ball_x - last - 20, -2.0, 2.0),
        clamp(ball_x - x - 10, -5.0, 5.0) / 5,
    )
    return put(out, at, columns)


@kernel
def put_plan(planned: Array, out: Out, at: int) -> int:
    """Write the plan with the ball, see `planner.columns.PLAN`; zeros for an actor that cannot kick it."""
    first = 1 + len(CHOICES) + len(WAYS)
    for index in range(first):
        out[at + index] = planned[index]
    at += first
    for index in range(len(VALUED)):
        value = planned[_VALUE + index]
        out[at + index], out[at + len(VALUED) + index] = value / MOST_VALUE_M, clamp(value, -1.0, 1.0)
    at = put(out, at + 2 * len(VALUED), (planned[_KICKS] / 3, planned[_KICKS + 1] / 20))
    for index in range(len(UNDERWAY) // 2):
        metres, dashes = planned[_UNDERWAY + 2 * index], planned[_UNDERWAY + 2 * index + 1]
        # A miss of centimetres was meant, one of more was not.
        at = put(out, at, (metres, min(metres * 5, 1.0), dashes / 20))
    return at


@kernel
def put_ways(planned: Array, out: Out, at: int) -> int:
    """Write TACKLE and WAY."""
    for index in range(len(TACKLE)):
        out[at + index] = planned[_TACKLE + index]
    at += len(TACKLE)
    for index in range(len(WAYS)):
        way = _WAY + 2 * index
        at = put(out, at, (planned[_THERE + index], planned[way], planned[way + 1]))
    return at


@kernel
def player_columns(frame: Frame, view: Look, row: int, out: Out, at: int) -> int:
    """Write another player in the actor's axes: place, velocity, facing, cycles to the ball, metres to it."""
    player, more = frame.scene[row], frame.more[row]
    at = put_polar(out, at, seen_from(view, player[X], player[Y]))
    vx, vy = along(player[VX], player[VY], view.cos, view.sin)
    cos, sin = along(more[COS], more[SIN], view.cos, view.sin)
    steps = min(own_steps(view, row), REACH_CYCLES) / 20
    return put(out, at, (vx, vy, cos, sin, steps, min(more[TO_BALL], 60.0) / 20))


@kernel
def put_players(frame: Frame, view: Look, order: Order, most: int, out: Out, at: int) -> int:
    """Write the first players of an order; zeros where there are fewer than ``most``."""
    end = at + most * PLAYER
    for index in range(min(order.number, most)):
        at = player_columns(frame, view, order.rows[index], out, at)
    for place in range(at, end):
        out[place] = 0.0
    return end


@kernel
def put_mates(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write all team mates, the nearest first."""
    return put_players(frame, view, view.mates, MATES, out, at)


@kernel
def put_opponents(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write the nearest opponents."""
    return put_players(frame, view, view.opponents, NEAREST_OPPONENTS, out, at)


@kernel
def put_rivals(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write the opponents nearest to the ball."""
    order = nearest(frame.scene, frame.more[:, TO_BALL], (OPPONENT, BALL), view.actor)
    return put_players(frame, view, order, RIVALS, out, at)


@kernel
def put_past(
    view: Look, body: float, stamina: float, ball: Array, players: Array, known: bool, out: Out, at: int
) -> int:
    """Write the actor and the ball in a frame before, from the actor's present axes; zeros if it is not known.

    Args:
        body, stamina: of the actor now; degrees.
        ball: (4,). players: (22, channels), of that frame.
    """
    begin, then = at, players[view.actor]
    at = put(out, at, seen_from(view, then[_X], then[_Y]))
    at = put(out, at, along(then[_VX], then[_VY], view.cos, view.sin))
    x, y = seen_from(view, ball[0], ball[1])
    at = put(out, at, (x / 20, y / 20))
    at = put(out, at, along(ball[2], ball[3], view.cos, view.sin))
    turned = math.radians(body - then[_BODY])
    at = put(out, at, (math.cos(turned), math.sin(turned), (stamina - then[_STAMINA]) / 100))
    at = put_last(players[:, _LAST], view.actor, out, at)
    out[at] = 1.0
    if not known:
        for place in range(begin, at + 1):
            out[place] = 0.0
    return at + 1


@kernel
def put_mode(flags: int, mode: int, cycles: float, out: Out, at: int) -> int:
    """Write the play mode one-hot, how long it has lasted, whether the actor is the goalkeeper."""
    at = put_one_hot(out, at, _MODE_COLUMN[mode], MODES)
    return put(out, at, (min(cycles, 10.0) / 10, min(cycles, 100.0) / 100, one_if((flags & FLAG_GOALIE) != 0)))


@kernel
def _put_ages(frame: Frame, order: Order, count: int, out: Out, at: int) -> int:
    """Write how long ago the first ``count`` of an order were seen, 0 where there are fewer; then the mean of all."""
    total = 0.0
    for place in range(max(count, order.number)):
        age = math.log1p(frame.more[order.rows[place], AGE]) if place < order.number else 0.0
        total += age
        if place < count:
            out[at + place] = age
    return put(out, at + count, (total / max(order.number, 1),))


@kernel
def put_age(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write how long ago the actor saw the ball, team mates and opponents, the logarithm of one more cycle."""
    at = put(out, at, (math.log1p(frame.more[view.actor, AGE]),))
    at = _put_ages(frame, view.mates, AGED_MATES, out, at)
    return _put_ages(frame, view.opponents, NEAREST_OPPONENTS, out, at)


@kernel
def _kick_gain(frame: Frame, view: Look) -> float:
    """Return the speed that a unit of kick power gives the ball where a kick reaches it.

    Beyond the reach of a kick, or in a collision, the formula means nothing.
    """
    me, ball = frame.scene[view.actor], frame.scene[BALL]
    x, y = ball[X] - view.x, ball[Y] - view.y
    metres = clamp(math.hypot(x, y), me[TOUCH] - 0.2 * me[MARGIN], me[TOUCH] + me[MARGIN])
    return kick_rate(me, metres, math.degrees(math.atan2(y, x)) - me[BODY])


@kernel
def put_geometry(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write GEOMETRY."""
    scene = frame.scene
    me, ball, server = scene[view.actor], scene[BALL], scene[SERVER]
    coasted = roll(min(view.moments[OWN], REACH_CYCLES), me[DECAY])
    to_ball = along(ball[X] + ball[VX] - view.x - me[VX], ball[Y] + ball[VY] - view.y - me[VY], view.cos, view.sin)
    meet_x, meet_y = view.meetings[0, 0] - view.x, view.meetings[0, 1] - view.y
    to_meet = along(meet_x - me[VX] * coasted, meet_y - me[VY] * coasted, view.cos, view.sin)
    columns = (
        view.x,
        view.y,
        view.x + me[VX] / (1.0 - me[DECAY]),
        view.y + me[VY] / (1.0 - me[DECAY]),
        view.cos,
        view.sin,
        view.forward,
        view.aside,
        1.0 + me[INERTIA] * view.speed,
        me[DECAY],
        me[EFFORT] * me[DASH_RATE],
        me[RECOVERY] * me[STAMINA_INC],
        view.limit,
        max(NEAR_SHARE * frame.more[view.actor, TO_BALL], NEAR_M),
        ball[X],
        ball[Y],
        ball[VX],
        ball[VY],
        _kick_gain(frame, view),
        math.atan2(to_ball[1], to_ball[0]),
        math.atan2(to_meet[1], to_meet[0]),
        me[AREA],
        me[MARGIN],
        server[BALL_DECAY],
        server[BALL_SPEED_MAX],
    )
    at = put(out, at, columns)
    for index in range(MATES):
        row = view.mates.rows[index] if index < view.mates.number else view.actor
        at = put(out, at, (scene[row, X], scene[row, Y]))
    return at


@kernel
def put_other(frame: Frame, row: int, out: Out, at: int) -> int:
    """Write OTHER of a player."""
    player, more = frame.scene[row], frame.more[row]
    columns = player[X], player[Y], player[VX], player[VY], more[COS], more[SIN], 1.0, player[GOALKEEPER]
    return put(out, at, columns)


@kernel
def _put_side(frame: Frame, order: Order, most: int, out: Out, at: int) -> int:
    end = at + most * len(OTHER)
    for index in range(order.number):
        at = put_other(frame, order.rows[index], out, at)
    for place in range(at, end):
        out[place] = 0.0
    return end


@kernel
def put_others(frame: Frame, view: Look, out: Out, at: int) -> int:
    """Write OTHER of all OTHERS; zeros where one is missing."""
    at = _put_side(frame, view.mates, MATES, out, at)
    return _put_side(frame, view.opponents, N_TEAM, out, at)


@kernel
def near_the_ball(frame: Frame, actor: int) -> bool:
    """Return whether an actor may reach the ball with a kick or a tackle."""
    me, ball, server = frame.scene[actor], frame.scene[BALL], frame.scene[SERVER]
    reach = max(math.hypot(server[TACKLE_DIST], server[TACKLE_WIDTH]), me[AREA])
    return gap(ball[X], ball[Y], me[X], me[Y]) < reach + SLACK_M
