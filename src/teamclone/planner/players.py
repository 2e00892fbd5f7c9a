"""Players as they are thought of while planning, and how soon they can be somewhere.

Compiled, as all of the planning; angles are in degrees.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from teamclone.planner.constants import BALL_DECAY, BALL_SIZE, BALL_SPEED_MAX, TURN_MARGIN_DEG
from teamclone.rcss import pitch
from teamclone.world.channels import CHANNEL, FLAG_GOALIE, FLAG_ON_FIELD, FLAG_TACKLING, TYPE_FIELD

Array = NDArray[np.float64]

kernel: Any = njit(nogil=True, error_model="numpy")
"""None of these is cached: `plan.plans` keeps all of them together, since the cache does not see who calls whom."""

(X, Y, VX, VY, BODY, STAMINA, EFFORT, RECOVERY, CAPACITY, THERE, KEEPER, TACKLING, SIZE, MARGIN, AREA, DASH_RATE, PUSH,
 DECAY, INERTIA, LIMIT, INCOME, EXTRA, EFFORT_MIN, EFFORT_MAX, KICK_RATE, KICK_RAND, TOP, RECEIVES,
 WAY) = range(29)  # fmt: skip
"""Columns of a player. SIZE: metres between the centres of player and ball that touch; MARGIN: by how much more he can
kick it; AREA: both. PUSH: metres per cycle that a dash at full power adds; LIMIT: of his speed; TOP: the speed that he
reaches. INCOME: stamina of a cycle; EXTRA: what is left when all is spent. RECEIVES: whether he may get a pass. From
WAY on: metres that 1, 2, ... dashes at full power cover from rest."""
RUN = 50
"""Dashes of which the way is kept."""
COLUMNS = WAY + RUN
OPPONENT, BALL, ME, ROWS = 11, 22, 23, 24
"""Rows of a scene: the team, from here on the opponents, the ball, and once more who has it. Who is not there is far
away."""
GAIN, OFFSIDE = BODY, STAMINA
"""Columns of the ball: speed that a unit of his kick power gives it; the offside line."""
NOWHERE_M = 1e6
BALL_PUSH_MAX, PLAYER_PUSH_MAX, BALL_RAND, PLAYER_RAND = 2.7, 1.0, 0.05, 0.1
"""rcssserver `serverparam.cpp`: ball_accel_max, player_accel_max, ball_rand, player_rand."""
TACKLE_M, TACKLE_WIDTH_M = 2.0, 1.25
"""The same: tackle_dist, tackle_width."""
TACKLE_EXPONENT, FOUL_EXPONENT = 6.0, 10.0
"""The same: tackle_exponent, foul_exponent."""
CATCH_M = math.hypot(1.2, 0.5)
"""From the keeper's centre to a far corner of what he can catch."""
PENALTY_X, PENALTY_Y = pitch.HALF_LENGTH - pitch.PENALTY_AREA_LENGTH, pitch.PENALTY_AREA_WIDTH / 2
GOAL_X, GOAL_Y = pitch.HALF_LENGTH, pitch.GOAL_WIDTH / 2
NEVER = 1000
HARDLY = 0.001
"""Metres that count as nothing."""


_CHANNELS = np.array(
    [CHANNEL[name] for name in ("x", "y", "vx", "vy", "body", "stamina", "effort", "recovery", "capacity")]
)
_FLAGS = CHANNEL["flags"]
_BALL = X, Y, VX, VY
_FIELDS = (
    (SIZE, "player_size"),
    (MARGIN, "kickable_margin"),
    (DASH_RATE, "dash_power_rate"),
    (DECAY, "player_decay"),
    (INERTIA, "inertia_moment"),
    (LIMIT, "player_speed_max"),
    (INCOME, "stamina_inc_max"),
    (EXTRA, "extra_stamina"),
    (EFFORT_MIN, "effort_min"),
    (EFFORT_MAX, "effort_max"),
    (KICK_RATE, "kick_power_rate"),
    (KICK_RAND, "kick_rand"),
)


def described(ball: Array, players: Array, types: Array) -> Array:
    """(batch, ROWS, COLUMNS) scenes of the ball, players and types of a `State`, but for what hangs on the actor."""
    made = np.zeros((len(ball), ROWS, COLUMNS))
    made[:, BALL, : len(_BALL)] = ball
    team = made[:, :BALL]
    team[..., :THERE] = players[..., _CHANNELS]
    with np.errstate(invalid="ignore"):
        flags = players[..., _FLAGS].astype(np.int64)
    for column, flag in ((THERE, FLAG_ON_FIELD), (KEEPER, FLAG_GOALIE), (TACKLING, FLAG_TACKLING)):
        team[..., column] = (flags & flag) != 0
    team[team[..., THERE] == 0, :VX] = NOWHERE_M
    for column, name in _FIELDS:
        team[..., column] = types[..., TYPE_FIELD[name]]
    team[..., SIZE] += BALL_SIZE
    team[..., AREA] = team[..., SIZE] + team[..., MARGIN]
    team[..., PUSH] = np.minimum(100.0 * team[..., DASH_RATE] * team[..., EFFORT_MAX], PLAYER_PUSH_MAX)
    return made


@kernel
def turned(degrees: float) -> float:
    """The same angle in [-180, 180)."""
    return (degrees + 180.0) % 360.0 - 180.0


@kernel
def direction(x: float, y: float) -> float:
    return math.degrees(math.atan2(y, x))


@kernel
def prepare(player: Array) -> None:
    """Fill TOP and WAY."""
    speed, covered = 0.0, 0.0
    for count in range(RUN):
        speed += min(player[PUSH], player[LIMIT] - speed)
        covered += speed
        player[WAY + count] = covered
        speed *= player[DECAY]
    player[TOP] = min(player[PUSH] / (1.0 - player[DECAY]), player[LIMIT])


@kernel
def dashes(player: Array, metres: float) -> int:
    """How many dashes cover so much."""
    if metres <= HARDLY:
        return 0
    if metres - HARDLY > player[WAY + RUN - 1]:
        return RUN + math.ceil((metres - player[WAY + RUN - 1]) / player[TOP])
    return int(np.searchsorted(player[WAY:], metres - HARDLY)) + 1


@kernel
def most_turn(player: Array, speed: float) -> float:
    """Degrees that he turns in a cycle while he moves so fast (rcssserver `player.cpp`, turn)."""
    return 180.0 / (1.0 + player[INERTIA] * speed)


@kernel
def turns(player: Array, toward: float, metres: float, near_m: float) -> int:
    """How many turns until he faces a place so far away, in this direction, to within what ``near_m`` leaves."""
    return turns_over(player, abs(turned(toward - player[BODY])), metres, near_m)


@kernel
def turns_over(player: Array, left: float, metres: float, near_m: float) -> int:
    """The same over so many degrees."""
    margin = 180.0
    if near_m < metres:
        margin = max(TURN_MARGIN_DEG, math.degrees(math.asin(near_m / metres)))
    speed = math.hypot(player[VX], player[VY])
    count = 0
    while left > margin and count < RUN:
        left -= most_turn(player, speed)
        speed *= player[DECAY]
        count += 1
    return count


@kernel
def steps(player: Array, way_xy: tuple[float, float], dash_m: float, near_m: float) -> int:
    """Cycles that turns and then dashes over ``dash_m`` take; who turns sees the ball a cycle late.

    Args:
        way_xy: to the place from where he is then. near_m: as of `turns`.
    """
    toward, metres = direction(way_xy[0], way_xy[1]), math.hypot(way_xy[0], way_xy[1])
    count = turns(player, toward, metres, near_m)
    if count:
        count += 1
    return count + dashes(player, dash_m)


@kernel
def coasted(player: Array, cycles: float) -> tuple[float, float]:
    """Where he is after so many cycles without a dash."""
    part = (1.0 - player[DECAY] ** cycles) / (1.0 - player[DECAY])
    return player[X] + player[VX] * part, player[Y] + player[VY] * part


@kernel
def at_rest(player: Array) -> tuple[float, float]:
    return player[X] + player[VX] / (1.0 - player[DECAY]), player[Y] + player[VY] / (1.0 - player[DECAY])


@kernel
def in_their_box(x: float, y: float) -> bool:
    return x > PENALTY_X and abs(y) < PENALTY_Y


@kernel
def reach_of(player: Array, x: float, y: float) -> float:
    """How far from his centre he has a ball in a place: who keeps the goal catches it in his box."""
    return CATCH_M if player[KEEPER] > 0 and in_their_box(x, y) else player[AREA]


@kernel
def beside(player: Array, from_xy: tuple[float, float], x: float, y: float) -> tuple[float, float]:
    """How far a place is ahead of him, and aside, seen from where he is then."""
    body = math.radians(player[BODY])
    cos, sin = math.cos(body), math.sin(body)
    away_x, away_y = x - from_xy[0], y - from_xy[1]
    return away_x * cos + away_y * sin, away_y * cos - away_x * sin


@kernel
def tackle_chance(ahead: float, aside: float, exponent: float) -> float:
    """Of a tackle at a ball there, 0 and less where it cannot succeed; `physics.tackle_failure` has the same."""
    if ahead <= 0:
        return 0.0
    return 1.0 - ((ahead / TACKLE_M) ** exponent + (abs(aside) / TACKLE_WIDTH_M) ** exponent)


@kernel
def bell(value: float, width: float) -> float:
    return math.exp(-0.5 * (value / width) ** 2)


@kernel
def gap(x: float, y: float, at_x: float, at_y: float) -> float:
    """Metres between two places."""
    return math.hypot(x - at_x, y - at_y)


@kernel
def rolled(speed: float, cycles: float) -> float:
    """Metres of a ball with this speed."""
    return speed * (1.0 - BALL_DECAY**cycles) / (1.0 - BALL_DECAY)


@kernel
def speed_over(metres: float, cycles: float) -> float:
    """With which a ball rolls so far in so many cycles."""
    return metres * (1.0 - BALL_DECAY) / (1.0 - BALL_DECAY**cycles)


@kernel
def cycles_over(metres: float, speed: float) -> int:
    """Whole cycles after which a ball with this speed has rolled so far."""
    left = 1.0 - metres * (1.0 - BALL_DECAY) / speed
    return NEVER if left <= 0 else math.ceil(math.log(left) / math.log(BALL_DECAY))


@kernel
def kick_rate(player: Array, metres: float, aside: float) -> float:
    """Speed that a unit of power gives a ball so far from the player's centre, so many degrees off his body."""
    off = abs(turned(aside)) / 180.0
    return player[KICK_RATE] * (1.0 - 0.25 * off - 0.25 * (metres - player[SIZE]) / player[MARGIN])


@kernel
def fastest(cos: float, sin: float, gain: float, vx: float, vy: float) -> float:
    """The greatest speed in a direction that one kick gives a ball with this velocity; 0 if it cannot go there."""
    most = min(100.0 * gain, BALL_PUSH_MAX)
    along = vx * cos + vy * sin
    rest = most * most - (vx * vx + vy * vy - along * along)
    if rest < 0:
        return 0.0
    half = math.sqrt(rest)
    if along + half > BALL_SPEED_MAX:
        return 0.0 if along - half > BALL_SPEED_MAX else BALL_SPEED_MAX
    return max(0.0, along + half)
