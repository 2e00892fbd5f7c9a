"""Scenes: all that a plan is made from, packed for the kernels into one array a sample. Angles are in degrees."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from teamclone.rcss import pitch
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.server_params import FIELDS, SERVER_FIELD
from teamclone.system.compiling import kernel
from teamclone.world.channels import CHANNEL, FLAG_GOALIE, FLAG_ON_FIELD, FLAG_TACKLING, TYPE_FIELD

Array = NDArray[np.float64]

OPPONENT, BALL, ACTOR, SERVER, ROWS = N_TEAM, N_PLAYERS, N_PLAYERS + 1, N_PLAYERS + 2, N_PLAYERS + 3
"""Rows: the team, from OPPONENT on the opponents, the ball, once more the player who acts, and the server's parameters.
A player who is not on the field is far away."""

(X, Y, VX, VY, BODY, STAMINA, EFFORT, RECOVERY, CAPACITY, PRESENT, GOALKEEPER, FROZEN, PAUSE, TOUCH, MARGIN, AREA,
 CATCH, DASH_RATE, DASH_ACCEL, DECAY, INERTIA, SPEED_MAX, STAMINA_INC, EXTRA, EFFORT_MIN, EFFORT_MAX, KICK_RATE,
 KICK_RAND, TOP, LAG, AWAY, RECEIVES, TURN) = range(33)  # fmt: skip
"""Columns of a player. FROZEN: is tackling; PAUSE: cycles for which it goes on with it, on average. TOUCH: metres
between the centres of player and ball that touch; MARGIN: by how much farther the player can kick it; AREA: both;
CATCH: metres to which a goalkeeper catches in its penalty area. DASH_ACCEL: metres per cycle that a dash at full power
adds; TOP: speed that such dashes lead to; LAG: by how many cycles a player that starts from rest is behind one at that
speed. AWAY: metres from the actor. RECEIVES: may get a pass. From TURN on: degrees that 0, 1, ... turns turn the
player."""
PAUSE_PART = 0.5
"""Of the server's tackle_cycles: PAUSE of a player that is tackling."""
TURNS = 8
"""Turns of which the degrees are kept."""
ROLL = TURN + TURNS
"""From here on: metres that a body covers in 0, 1, ... cycles per metre per cycle of its first velocity. The ball has
these, X to VY and DECAY."""
CYCLES = 50
"""Cycles of which ROLL is kept."""
COLUMNS = max(ROLL + CYCLES + 1, len(FIELDS))
GAIN, OFFSIDE = BODY, STAMINA
"""Columns of the ball alone: speed that a unit of the actor's kick power gives it; the offside line."""
FAR_AWAY_M = 1e6

(BALL_DECAY, BALL_SPEED_MAX, BALL_ACCEL_MAX, BALL_SIZE, BALL_RAND, PLAYER_RAND, MAX_POWER, MAX_DASH, TACKLE_DIST,
 TACKLE_WIDTH, TACKLE_EXPONENT, FOUL_EXPONENT, TACKLE_RATE, TACKLE_POWER, TACKLE_BACK_POWER, TACKLE_CYCLES,
 CATCH_LENGTH, CATCH_WIDTH, PLAYER_ACCEL_MAX) = (
    SERVER_FIELD[name] for name in (
        "ball_decay", "ball_speed_max", "ball_accel_max", "ball_size", "ball_rand", "player_rand", "maxpower",
        "max_dash_power", "tackle_dist", "tackle_width", "tackle_exponent", "foul_exponent", "tackle_power_rate",
        "max_tackle_power", "max_back_tackle_power", "tackle_cycles", "catchable_area_l", "catchable_area_w",
        "player_accel_max"))  # fmt: skip
"""Columns of the server."""

GOAL_X, GOAL_Y = pitch.HALF_LENGTH, pitch.GOAL_WIDTH / 2
LINE_Y = pitch.HALF_WIDTH
PENALTY_X, PENALTY_Y = pitch.HALF_LENGTH - pitch.PENALTY_AREA_LENGTH, pitch.PENALTY_AREA_WIDTH / 2

_CHANNELS = tuple(CHANNEL[name] for name in ("x", "y", "vx", "vy", "body", "stamina", "effort", "recovery", "capacity"))
"""Channels in the order of the columns X to CAPACITY."""
_FLAGS = CHANNEL["flags"]
_FIELDS = (
    (TOUCH, TYPE_FIELD["player_size"]),
    (MARGIN, TYPE_FIELD["kickable_margin"]),
    (DASH_RATE, TYPE_FIELD["dash_power_rate"]),
    (DECAY, TYPE_FIELD["player_decay"]),
    (INERTIA, TYPE_FIELD["inertia_moment"]),
    (SPEED_MAX, TYPE_FIELD["player_speed_max"]),
    (STAMINA_INC, TYPE_FIELD["stamina_inc_max"]),
    (EXTRA, TYPE_FIELD["extra_stamina"]),
    (EFFORT_MIN, TYPE_FIELD["effort_min"]),
    (EFFORT_MAX, TYPE_FIELD["effort_max"]),
    (KICK_RATE, TYPE_FIELD["kick_power_rate"]),
    (KICK_RAND, TYPE_FIELD["kick_rand"]),
)
"""Columns that are parameters of the player's type."""


@kernel
def _fill_player(player: Array, channels: Array, of_type: Array, server: Array) -> None:
    """Fill the row of a player, see `fill_scene`."""
    for column in range(len(_CHANNELS)):
        player[column] = channels[_CHANNELS[column]]
    # A mask that the log lacks is not a number, and no integer.
    flags = int(channels[_FLAGS]) if abs(channels[_FLAGS]) < 1e9 else 0
    player[PRESENT], player[GOALKEEPER] = (flags & FLAG_ON_FIELD) != 0, (flags & FLAG_GOALIE) != 0
    player[FROZEN] = (flags & FLAG_TACKLING) != 0
    if player[PRESENT] == 0:
        player[X], player[Y] = FAR_AWAY_M, FAR_AWAY_M
    for index in range(len(_FIELDS)):
        player[_FIELDS[index][0]] = of_type[_FIELDS[index][1]]
    player[PAUSE] = player[FROZEN] * math.trunc(PAUSE_PART * server[TACKLE_CYCLES])
    player[TOUCH] += server[BALL_SIZE]
    player[AREA] = player[TOUCH] + player[MARGIN]
    player[CATCH] = math.hypot(server[CATCH_LENGTH], server[CATCH_WIDTH] / 2)
    player[DASH_ACCEL] = min(server[MAX_DASH] * player[DASH_RATE] * player[EFFORT_MAX], server[PLAYER_ACCEL_MAX])
    player[TOP] = min(player[DASH_ACCEL] / (1.0 - player[DECAY]), player[SPEED_MAX])
    player[LAG] = player[DECAY] / (1.0 - player[DECAY])


@kernel
def fill_scene(ball: Array, players: Array, types: Array, server: Array, scene: Array) -> None:
    """Fill (ROWS, COLUMNS) what of a scene does not depend on the actor.

    Args:
        ball: (4,) metres, metres per cycle. players: (22, channels) as `PLAYER_CHANNELS` orders them.
        types: (22, fields) as `player_types.FIELDS`. server: (fields,) as `server_params.FIELDS`.
    """
    for column in range(4):
        scene[BALL, column] = ball[column]
    scene[BALL, DECAY] = server[BALL_DECAY]
    for column in range(len(server)):
        scene[SERVER, column] = server[column]
    for row in range(BALL):
        _fill_player(scene[row], players[row], types[row], scene[SERVER])


@kernel
def complete(scene: Array, actor: int) -> None:
    """Fill what depends on the actor, and the tables of turns and of rolling bodies."""
    for index in range(BALL + 1):
        body = scene[index]
        rolled, part = 0.0, 1.0
        for cycle in range(CYCLES + 1):
            body[ROLL + cycle] = rolled
            rolled += part
            part *= body[DECAY]
        if index == BALL:
            break
        speed, degrees = math.hypot(body[VX], body[VY]), 0.0
        for turn in range(TURNS):
            body[TURN + turn] = degrees
            degrees += most_turn(body, speed)
            speed *= body[DECAY]
        body[AWAY] = gap(body[X], body[Y], scene[actor, X], scene[actor, Y])
    scene[ACTOR] = scene[actor]


@kernel
def most_turn(player: Array, speed: float) -> float:
    """Return the degrees by which one turn turns a player with this speed (rcssserver `player.cpp`, turn)."""
    return 180.0 / (1.0 + player[INERTIA] * speed)


@kernel
def turned(degrees: float) -> float:
    """Return an angle in [-180, 180)."""
    return (degrees + 180.0) % 360.0 - 180.0


@kernel
def direction(x: float, y: float) -> float:
    """Return the direction of a vector in degrees."""
    return math.degrees(math.atan2(y, x))


@kernel
def gap(x: float, y: float, at_x: float, at_y: float) -> float:
    """Return the metres between two places."""
    return math.hypot(x - at_x, y - at_y)


@kernel
def along(x: float, y: float, cos: float, sin: float) -> tuple[float, float]:
    """Return how far a vector goes along a direction, and how far to its right."""
    return x * cos + y * sin, y * cos - x * sin


@kernel
def gaussian(value: float, width: float) -> float:
    """Return a Gaussian curve that is 1 at 0."""
    return math.exp(-0.5 * (value / width) ** 2)


@kernel
def in_their_area(x: float, y: float) -> bool:
    """Return whether a place is in the opponents' penalty area."""
    return x > PENALTY_X and abs(y) < PENALTY_Y


@kernel
def roll(cycles: float, decay: float) -> float:
    """Return the metres that a body covers per metre per cycle of its first velocity; `dynamics.formulas.roll`."""
    return (1.0 - decay**cycles) / (1.0 - decay)


@kernel
def inertia_point(body: Array, cycle: int) -> tuple[float, float]:
    """Return where a player, or the ball, is after so many cycles in which nothing moves it."""
    factor = body[ROLL + min(cycle, CYCLES)]
    return body[X] + body[VX] * factor, body[Y] + body[VY] * factor


@kernel
def at_rest(body: Array) -> tuple[float, float]:
    """Return where a body comes to rest."""
    return body[X] + body[VX] / (1.0 - body[DECAY]), body[Y] + body[VY] / (1.0 - body[DECAY])
