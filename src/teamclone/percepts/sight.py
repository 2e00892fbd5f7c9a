"""What each player of a match was sent by the server's visual messages, worked out from the game log."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone import rcss
from teamclone.logs.align import follows
from teamclone.logs.match import Columns
from teamclone.percepts import vision
from teamclone.percepts.vision import VISIBLE_DISTANCE_M, in_cone, shown_change, shown_direction, shown_distance
from teamclone.rcss import state_bits
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.server_params import number
from teamclone.system import compiling
from teamclone.system.compiling import cached_kernel, version_of

N_OBJECTS = N_PLAYERS + 1
BALL = N_PLAYERS
"""Place of the ball among the objects; the players come first, in the order of the log."""

HIDDEN, NEAR, SEEN = range(3)
"""Not shown; shown by place alone, since near though outside of the view cone; shown in the view cone."""

PLAYER_COLUMNS = (
    "state",
    "x",
    "y",
    "vx",
    "vy",
    "body",
    "neck",
    "view_width",
    "focus_distance",
    "focus_direction",
)
FRAME_COLUMNS = ("cycle", "stoppage", "ball_x", "ball_y", "ball_vx", "ball_vy")
"""Columns of a match that sight needs."""

INTERVAL_DEG = 60.0
"""View width for each cycle between two visual messages: narrow 60 comes every cycle, wide 180 every third one."""

X, Y, VX, VY, BODY, SIGHT, VIEW_WIDTH, FOCUS_X, FOCUS_Y, THERE, COLUMNS = range(11)
"""Columns of `objects_of`: place and velocity; of players the body direction, degrees, and in radians the line of sight
and the view width; their focus point; whether it is on the field."""
_FARTHEST = 1e6
"""No place and no velocity of a log that can be is greater."""


class Sight(NamedTuple):
    """Visual messages of all players of a match.

    Attributes:
        received: (n_frames, 22) bool, whether the player got a visual message of the frame; ``sure``: whether that is
            known, see `messages`.
        what: (n_frames, 22, N_OBJECTS) uint8 HIDDEN, NEAR or SEEN; HIDDEN without a message.
        distance: (n_frames, 22, N_OBJECTS) float32, metres, and
        direction: degrees from the line of sight, as the message tells them; NaN where HIDDEN.
        change: (n_frames, 22, N_OBJECTS, 2) float32, metres and degrees per cycle, as a message tells them that tells
            number and velocity, see `vision.detail_chance`; NaN unless SEEN.
    """

    received: NDArray[np.bool_]
    sure: NDArray[np.bool_]
    what: NDArray[np.uint8]
    distance: NDArray[np.float32]
    direction: NDArray[np.float32]
    change: NDArray[np.float32]


def sight(frames: Columns, players: Columns, params: Mapping[str, float | str]) -> Sight:
    """Return what the players of a match were sent.

    It is exact for clients of version 18 and later in the mode ``(synch_see)`` without ``(gaussian_see)``, which most
    teams use.

    Args:
        frames: FRAME_COLUMNS, (n_frames,). players: PLAYER_COLUMNS, (n_frames, 22).
        params: the server's parameters as the log lists them.
    """
    n = len(frames["ball_x"])
    objects = objects_of(frames, players)
    there = objects[:, :BALL, THERE] > 0
    received, sure = messages(players["view_width"], there, follows(frames))
    shape = (n, N_PLAYERS, N_OBJECTS)
    made = Sight(
        received=received,
        sure=sure,
        what=np.zeros(shape, np.uint8),
        distance=np.full(shape, np.nan, np.float32),
        direction=np.full(shape, np.nan, np.float32),
        change=np.full((*shape, 2), np.nan, np.float32),
    )
    _see(objects, number(params, "quantize_step"), made)
    return made


def objects_of(frames: Columns, players: Columns) -> NDArray[np.float64]:
    """Return (n_frames, N_OBJECTS, COLUMNS) of players and ball what percepts follow from.

    What has a place or a velocity that cannot be is not there, and has zeros: a player would believe it for long.
    """
    made = np.zeros((len(frames["ball_x"]), N_OBJECTS, COLUMNS))
    for place, name in ((X, "x"), (Y, "y"), (VX, "vx"), (VY, "vy")):
        made[:, :BALL, place] = players[name]
        made[:, BALL, place] = frames[f"ball_{name}"]
    looking = np.radians(players["body"].astype(np.float64) + players["neck"])
    to_focus = np.nan_to_num(players["focus_distance"].astype(np.float64))
    focus = looking + np.radians(np.nan_to_num(players["focus_direction"].astype(np.float64)))
    made[:, :BALL, BODY] = players["body"]
    made[:, :BALL, SIGHT] = looking
    made[:, :BALL, VIEW_WIDTH] = np.radians(players["view_width"].astype(np.float64))
    made[:, :BALL, FOCUS_X] = players["x"] + to_focus * np.cos(focus)
    made[:, :BALL, FOCUS_Y] = players["y"] + to_focus * np.sin(focus)
    made[:, :BALL, THERE] = (players["state"] & state_bits.STAND) != 0
    made[:, BALL, THERE] = 1
    made[~(np.abs(made[..., : BODY + 1]) < _FARTHEST).all(axis=-1)] = 0
    return made


def messages(
    view_width: NDArray[Any], there: NDArray[np.bool_], followed: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which frames a player got a visual message of, and of which frames that is known, (n_frames, 22) each.

    The server counts the cycles since the last message, and sends one as soon as they are as many as the view width
    asks for. A log does not show the count where it begins, nor after cycles that it lacks, as between two halves:
    there a message is taken as due. The truth is known again from the first cycle in which the player looks narrowly,
    when there is one in any case.

    Args:
        view_width: (n_frames, 22) degrees. there: (n_frames, 22) whether the player is on the field.
        followed: (n_frames - 1,) whether the next frame of the log is that of the next cycle.
    """
    wanted = np.rint(np.nan_to_num(view_width.astype(np.float64), nan=INTERVAL_DEG) / INTERVAL_DEG)
    received, sure = np.zeros(there.shape, np.bool_), np.zeros(there.shape, np.bool_)
    waited = np.full(there.shape[1], np.max(wanted, initial=1))
    known = np.zeros(there.shape[1], np.bool_)
    for frame in range(len(there)):
        if frame and not followed[frame - 1]:
            waited[:], known[:] = wanted[frame], False
        waited += there[frame]
        received[frame] = there[frame] & (waited >= wanted[frame])
        known |= there[frame] & (wanted[frame] <= 1)
        sure[frame] = known
        waited[received[frame]] = 0
    return received, sure


def _compiled() -> Any:
    """Return a kernel that fills in what is shown."""
    version = version_of(vision, rcss, compiling)

    @cached_kernel(nogil=True, error_model="numpy")
    def see(objects: NDArray[np.float64], step: float, sight: Sight) -> int:
        for frame in range(objects.shape[0]):
            for player in range(N_PLAYERS):
                if not sight.received[frame, player]:
                    continue
                me = objects[frame, player]
                for other in range(N_OBJECTS):
                    it = objects[frame, other]
                    if other == player or it[THERE] == 0:
                        continue
                    x, y = it[X] - me[X], it[Y] - me[Y]
                    metres, angle = math.hypot(x, y), shown_direction(x, y, me[SIGHT])
                    seen = in_cone(angle, me[VIEW_WIDTH])
                    if not seen and metres > VISIBLE_DISTANCE_M:
                        continue
                    to_focus = math.hypot(it[X] - me[FOCUS_X], it[Y] - me[FOCUS_Y])
                    shown = shown_distance(metres, to_focus, step)
                    sight.what[frame, player, other] = SEEN if seen else NEAR
                    sight.distance[frame, player, other] = shown
                    sight.direction[frame, player, other] = round(math.degrees(angle))
                    if seen and metres > 0:
                        motion = it[VX] - me[VX], it[VY] - me[VY]
                        away, aside = shown_change((x, y), motion, metres, shown)
                        sight.change[frame, player, other, 0], sight.change[frame, player, other, 1] = away, aside
        return version

    return see


_see = _compiled()
