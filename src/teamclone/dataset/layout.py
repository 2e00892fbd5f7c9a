"""A dataset on disk: every frame once, samples that point into the frames, all as memory-mapped .npy arrays.

    DS/dataset.json           format number, team, options, matches with their split, cleaning report; ``commands``,
                              some of REPERTOIRE, where they are others than CLONED
    DS/frames/<name>.npy      FRAME_ARRAYS, shape (n_frames, ...), matches in order
    DS/samples/<name>.npy     SAMPLE_ARRAYS, shape (n_samples, ...), ordered by frame, then player
    DS/player_types.npy       (n_matches, n_types, n_fields) float32, fields as `player_types.FIELDS`

The modelled team attacks +x and holds the places 0..10 of the player axis (its numbers 1..11), its opponent 11..21.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

FORMAT = 2
"""Raised whenever a reader of the old layout would misread the new one."""


class Split(IntEnum):
    """What a sample is for; the value of the ``split`` array."""

    TRAIN = 0
    VALIDATION = 1
    TEST = 2
    UNSEEN = 3
    """Matches against opponents that no training match has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Array:
    """One array: ``shape`` is that of one row."""

    name: str
    dtype: str
    shape: tuple[int, ...]
    about: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One channel of ``detail``: stored as int16, value = stored * ``step``; not-a-number is stored as -32768."""

    name: str
    step: float
    unit: str
    about: str


MISSING = -32768
"""A channel's value that the log does not hold."""

DETAIL_CHANNELS = (
    Channel(name="vx", step=1e-4, unit="m/cycle", about="velocity after decay"),
    Channel(name="vy", step=1e-4, unit="m/cycle", about="velocity after decay"),
    Channel(name="body", step=1e-2, unit="deg", about="body direction, 0 = towards the opponent's goal"),
    Channel(name="neck", step=1e-2, unit="deg", about="neck direction relative to the body"),
    Channel(name="view_width", step=1e-2, unit="deg", about="opening of the view cone"),
    Channel(name="stamina", step=0.25, unit="stamina", about="stamina"),
    Channel(name="effort", step=1e-4, unit="", about="dash efficiency"),
    Channel(name="recovery", step=1e-4, unit="", about="stamina recovery rate"),
    Channel(name="capacity", step=4.0, unit="stamina", about="stamina left to recover"),
)
"""What is measured of each player beside his position."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Code:
    """One channel of ``code``: stored as uint8; not-a-number is stored as 255."""

    name: str
    about: str


NO_CODE = 255
"""A code that the log does not hold."""

CODE_CHANNELS = (
    Code(name="type", about="heterogeneous player type"),
    Code(name="flags", about="bit mask of FLAG_*"),
    Code(
        name="last_command",
        about="command kind id that the server executed between the previous frame and this one; 0 none",
    ),
)
"""What is counted or named of each player."""

FLAG_ON_FIELD = 1
FLAG_GOALIE = 2
FLAG_TACKLING = 4
"""Frozen after a tackle."""
FLAG_CHARGED = 8
"""Frozen after a foul against him."""
FLAG_COLLIDED = 16
"""Touched the ball, a player or a post in the last cycle."""
FLAG_YELLOW = 32

FRAME_ARRAYS = (
    Array(name="match", dtype="int32", shape=(), about="index into the dataset's list of matches"),
    Array(name="cycle", dtype="int32", shape=(), about="server time of the frame"),
    Array(name="playmode", dtype="uint8", shape=(), about="play mode id as logged, from the left team's point of view"),
    Array(name="score", dtype="int8", shape=(2,), about="goals of the modelled team and of its opponent"),
    Array(name="ball", dtype="float32", shape=(4,), about="x, y in m, vx, vy in m/cycle"),
    Array(name="position", dtype="float32", shape=(22, 2), about="x, y of every player in m"),
    Array(name="detail", dtype="int16", shape=(22, len(DETAIL_CHANNELS)), about="DETAIL_CHANNELS of every player"),
    Array(name="code", dtype="uint8", shape=(22, len(CODE_CHANNELS)), about="CODE_CHANNELS of every player"),
)

SAMPLE_ARRAYS = (
    Array(name="frame", dtype="int32", shape=(), about="index of the frame the command was decided on"),
    Array(name="player", dtype="uint8", shape=(), about="place of the acting player, 0..10 = number 1..11"),
    Array(
        name="kind",
        dtype="uint8",
        shape=(),
        about="index into the dataset's commands: 0 dash, 1 turn, 2 kick, 3 tackle",
    ),
    Array(
        name="parameters",
        dtype="float32",
        shape=(2,),
        about="the command's arguments as the server uses them (clipped), power, degrees, metres; unused ones 0",
    ),
    Array(name="executed", dtype="bool", shape=(), about="the server executed it: the player's counter rose"),
    Array(name="turn_zero", dtype="bool", shape=(), about='a (turn 0), which means "nothing to do"'),
    Array(name="split", dtype="uint8", shape=(), about="Split"),
)

DETAIL = {channel.name: index for index, channel in enumerate(DETAIL_CHANNELS)}
CODE = {channel.name: index for index, channel in enumerate(CODE_CHANNELS)}
PLAYER_CHANNELS = ("x", "y", *DETAIL, *CODE)
"""The channels of ``State.players``, in SI units and degrees: position, then DETAIL_CHANNELS, then CODE_CHANNELS."""

STEPS = np.array([channel.step for channel in DETAIL_CHANNELS], np.float32)


def bytes_per_row(arrays: tuple[Array, ...]) -> int:
    """Size of one row over all arrays."""
    return sum(np.dtype(array.dtype).itemsize * int(np.prod(array.shape)) for array in arrays)
