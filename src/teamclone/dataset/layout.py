"""A dataset on disk: every frame once, samples that point into the frames, all as memory-mapped .npy arrays.

    DS/dataset.json           format number, team, options, matches with their split and the source of their commands,
                              cleaning report; ``commands``, some of REPERTOIRE, where they are others than CLONED
    DS/frames/<name>.npy      FRAME_ARRAYS, shape (n_frames, ...), matches in order
    DS/samples/<name>.npy     SAMPLE_ARRAYS, shape (n_samples, ...), ordered by frame, then player
    DS/player_types.npy       (n_matches, n_types, n_fields) float32, fields as `player_types.FIELDS`
    DS/server_params.npy      (n_matches, n_fields) float64, fields as `server_params.FIELDS`

The modelled team attacks +x and holds the places 0..10 of the player axis (its numbers 1..11), its opponent 11..21.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from teamclone.rcss.players import N_TEAM
from teamclone.world.channels import CATEGORICAL, MEASURED

FORMAT = 5
"""Raised whenever a reader of the old layout would misread the new one."""


class Split(IntEnum):
    """The use of a sample; the value of the ``split`` array."""

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


MISSING = -32768
"""A measured channel's value that the log does not hold."""
NO_CODE = 255
"""A categorical channel's value that the log does not hold."""
STEP = {
    "vx": 1e-4,
    "vy": 1e-4,
    "body": 1e-2,
    "neck": 1e-2,
    "view_width": 1e-2,
    "stamina": 0.25,
    "effort": 1e-4,
    "recovery": 1e-4,
    "capacity": 4.0,
}
"""Resolution of each measured channel: stored as int16, value = stored * step; NaN is stored as MISSING."""

FRAME_ARRAYS = (
    Array(name="match", dtype="int32", shape=(), about="index into the dataset's list of matches"),
    Array(name="cycle", dtype="int32", shape=(), about="server time of the frame"),
    Array(name="playmode", dtype="uint8", shape=(), about="play mode id as logged, from the left team's point of view"),
    Array(name="mode_cycles", dtype="int32", shape=(), about="frames since the play mode began, 0 in its first"),
    Array(name="score", dtype="int8", shape=(2,), about="goals of the modelled team and of its opponent"),
    Array(name="ball", dtype="float32", shape=(4,), about="x, y in m, vx, vy in m/cycle"),
    Array(name="position", dtype="float32", shape=(22, 2), about="x, y of every player in m"),
    Array(name="measured", dtype="int16", shape=(22, len(MEASURED)), about="MEASURED channels of every player"),
    Array(
        name="categorical", dtype="uint8", shape=(22, len(CATEGORICAL)), about="CATEGORICAL channels of every player"
    ),
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
    Array(
        name="interval",
        dtype="float16",
        shape=(2, 2),
        about="of each argument the ends of its 90 % interval less the argument: 0 of logged commands, infinite "
        "where nothing is known of it",
    ),
    Array(name="executed", dtype="bool", shape=(), about="the server executed it: the player's counter rose"),
    Array(name="turn_zero", dtype="bool", shape=(), about='a (turn 0), which means "nothing to do"'),
    Array(name="split", dtype="uint8", shape=(), about="Split"),
)


def index_stops(*, n_matches: int, n_types: int, n_frames: int, n_commands: int) -> dict[str, int]:
    """Return the number above all values of each array that is an index: readers gather without a check."""
    return {
        "frames/match": n_matches,
        "frames/categorical type": n_types,
        "samples/frame": n_frames,
        "samples/player": N_TEAM,
        "samples/kind": n_commands,
        "samples/split": len(Split),
    }


MEASURED_INDEX = {channel.name: index for index, channel in enumerate(MEASURED)}
CATEGORICAL_INDEX = {channel.name: index for index, channel in enumerate(CATEGORICAL)}
STEPS = np.array([STEP[channel.name] for channel in MEASURED], np.float32)
