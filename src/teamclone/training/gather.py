"""The paper's inputs straight from the arrays of a dataset, in one compiled pass.

`Dataset.state` gathers every channel of every player, most of which these inputs do not ask for. The arithmetic here is
that of `inputs.paper.PaperFeatures`, in the same order, so that the same bits come out; a test holds them together.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray
from torch import Tensor

from teamclone.dataset.layout import CATEGORICAL_INDEX, MEASURED_INDEX, MISSING, STEPS
from teamclone.dataset.reader import Dataset
from teamclone.engine.inputs.paper import BODY_LIMIT_DEG
from teamclone.errors import DatasetError
from teamclone.models.inputs.paper import PaperFeatures, TypeParameters, logged_ball_speed_max
from teamclone.rcss import pitch
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.players import N_PLAYERS
from teamclone.system.compiling import cached_kernel
from teamclone.world.channels import TYPE_FIELD

_VX, _VY, _BODY = (MEASURED_INDEX[name] for name in ("vx", "vy", "body"))
_TYPE = CATEGORICAL_INDEX["type"]
_VELOCITY_STEP, _BODY_STEP = STEPS[_VX], STEPS[_BODY]
_MAX_X, _MAX_Y, _BODY_LIMIT = (np.float32(limit) for limit in (pitch.MAX_X, pitch.MAX_Y, BODY_LIMIT_DEG))
_NAN = np.float32(math.nan)

_X, _Y, _BODY_AT, _VX_AT, _VY_AT, _OWN = range(4, 4 + 6 * N_PLAYERS, N_PLAYERS)
"""First columns of what `PaperFeatures` has of all players, behind the ball's four, and then of the actor."""

_FAR, _NEAR = 16, 4
"""How many samples ahead a sample's own entries and those of its frame are prefetched.

A random frame lies in no cache, and waiting for it takes three times as long as all arithmetic.
"""
_DETAIL_LINES, _POSITION_LINES, _CODE_LINES = 7, 3, 2
"""Cache lines of 64 bytes of a frame's ``measured``, ``position`` and ``categorical``."""


class Gather:
    """`PaperFeatures` of samples, on the processor, with the normalisation at the time of construction."""

    def __init__(self, dataset: Dataset, features: PaperFeatures) -> None:
        frames, samples, kinds = dataset.frames, dataset.samples, dataset.player_types.numpy()
        self.path = dataset.path
        self.n_columns = len(features.names)
        self.arguments: tuple[Any, ...] = (
            *(samples[name].numpy() for name in ("frame", "player")),
            *(frames[name].numpy() for name in ("match", "ball", "position", "measured", "categorical")),
            kinds.reshape(-1, len(FIELDS)),
            kinds.shape[1],
            (kinds[..., TYPE_FIELD["player_speed_max"]] * kinds[..., TYPE_FIELD["player_decay"]]).reshape(-1),
            logged_ball_speed_max(dataset.server_params.to(torch.float32)).numpy(),
            *_type_parameters(features.own_type),
            *_type_parameters(features.all_types),
            features.normalisation.mean.cpu().numpy(),
            features.normalisation.std.cpu().numpy(),
        )

    def __call__(self, rows: NDArray[np.int64]) -> Tensor:
        """Return (len(rows), columns) float32, normalised.

        Raises:
            DatasetError: an index in the arrays points at nothing.
        """
        inputs = torch.empty(len(rows), self.n_columns)
        done: int = _gather(rows, inputs.numpy(), *self.arguments)
        if done < len(rows):
            raise DatasetError(
                f"{self.path}: sample {rows[done]} points at nothing; make the dataset again with `teamclone dataset`"
            )
        return inputs


def _type_parameters(parameters: TypeParameters | None) -> tuple[NDArray[Any], ...]:
    """Return field, middle and half range of the type parameters that are among the inputs."""
    if parameters is None:
        return np.empty(0, np.int64), np.empty(0, np.float32), np.empty(0, np.float32)
    middle, half_range = (part.cpu().numpy()[:, 0] for part in (parameters.middle, parameters.half_range))
    return parameters.places.cpu().numpy(), middle.copy(), half_range.copy()


def _prefetch_code(typing_context: Any, array: Any, index: Any) -> Any:
    """Prefetch the cache line of the array's element ``index``, counted flat; it neither waits nor fails."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        element = builder.gep(context.make_array(array)(context, builder, arguments[0]).data, [arguments[1]])
        address = builder.bitcast(element, ir.IntType(8).as_pointer())
        flag = ir.IntType(32)
        prefetch = builder.module.declare_intrinsic(
            "llvm.prefetch", [address.type], ir.FunctionType(ir.VoidType(), [address.type, flag, flag, flag])
        )
        builder.call(prefetch, [address, flag(0), flag(3), flag(1)])  # to read, into the nearest cache, data
        return context.get_dummy_value()

    return types.void(array, index), generate


_prefetch: Any = intrinsic(_prefetch_code)


@cached_kernel(nogil=True, error_model="numpy")
def _gather(
    rows: NDArray[np.int64],
    out: NDArray[np.float32],
    sample_frame: NDArray[np.int32],
    sample_player: NDArray[np.uint8],
    frame_match: NDArray[np.int32],
    ball: NDArray[np.float32],
    position: NDArray[np.float32],
    measured: NDArray[np.int16],
    categorical: NDArray[np.uint8],
    parameters: NDArray[np.float32],
    types_per_match: int,
    speed: NDArray[np.float32],
    ball_speed: NDArray[np.float32],
    own_field: NDArray[np.int64],
    own_middle: NDArray[np.float32],
    own_half: NDArray[np.float32],
    all_field: NDArray[np.int64],
    all_middle: NDArray[np.float32],
    all_half: NDArray[np.float32],
    mean: NDArray[np.float32],
    std: NDArray[np.float32],
) -> int:
    """Fill ``out``, (len(rows), columns); return the number of rows before the first that points at nothing."""
    n_samples, n_frames = len(sample_frame), len(frame_match)
    place = np.empty(N_PLAYERS, np.int64)
    value, bound = np.empty_like(mean), np.ones_like(mean)
    bound[0], bound[1] = _MAX_X, _MAX_Y
    bound[_X:_Y], bound[_Y:_BODY_AT], bound[_BODY_AT:_VX_AT] = _MAX_X, _MAX_Y, _BODY_LIMIT
    bound[_OWN], bound[_OWN + 1], bound[_OWN + 2] = _MAX_X, _MAX_Y, _BODY_LIMIT
    for index in range(len(rows)):
        if index + _FAR < len(rows) and 0 <= rows[index + _FAR] < n_samples:
            _prefetch(sample_frame, rows[index + _FAR])
            _prefetch(sample_player, rows[index + _FAR])
        if index + _NEAR < len(rows) and 0 <= rows[index + _NEAR] < n_samples:
            frame = np.int64(sample_frame[rows[index + _NEAR]])
            _prefetch(frame_match, frame)
            _prefetch(ball, frame * 4)
            for line in range(_POSITION_LINES):
                _prefetch(position, frame * 2 * N_PLAYERS + line * 16)
            for line in range(_DETAIL_LINES):
                _prefetch(measured, frame * measured.shape[1] * measured.shape[2] + line * 32)
            for line in range(_CODE_LINES):
                _prefetch(categorical, frame * categorical.shape[1] * categorical.shape[2] + line * 64)

        row = rows[index]
        if row < 0 or row >= n_samples:
            return index
        frame, actor = np.int64(sample_frame[row]), sample_player[row]
        if frame < 0 or frame >= n_frames or actor >= N_PLAYERS:
            return index
        first = np.int64(frame_match[frame]) * types_per_match
        if first < 0 or first >= len(speed):
            return index
        value[:4] = ball[frame]
        bound[2] = bound[3] = ball_speed[frame_match[frame]]
        for player in range(N_PLAYERS):
            channels = measured[frame, player]
            if categorical[frame, player, _TYPE] >= types_per_match:
                return index
            kind = first + np.int64(categorical[frame, player, _TYPE])
            place[player] = kind
            vx, vy, body = channels[_VX], channels[_VY], channels[_BODY]
            value[_X + player] = position[frame, player, 0]
            value[_Y + player] = position[frame, player, 1]
            value[_BODY_AT + player] = _NAN if body == MISSING else np.float32(body) * _BODY_STEP
            value[_VX_AT + player] = _NAN if vx == MISSING else np.float32(vx) * _VELOCITY_STEP
            value[_VY_AT + player] = _NAN if vy == MISSING else np.float32(vy) * _VELOCITY_STEP
            bound[_VX_AT + player] = speed[kind]
            bound[_VY_AT + player] = speed[kind]
        for channel in range(5):
            value[_OWN + channel] = value[_X + N_PLAYERS * channel + actor]
        bound[_OWN + 3] = speed[place[actor]]
        bound[_OWN + 4] = speed[place[actor]]
        column = _OWN + 5
        for field in range(len(own_field)):
            value[column] = (parameters[place[actor], own_field[field]] - own_middle[field]) / own_half[field]
            column += 1
        for field in range(len(all_field)):
            for player in range(N_PLAYERS):
                value[column] = (parameters[place[player], all_field[field]] - all_middle[field]) / all_half[field]
                column += 1
        for column in range(len(mean)):
            out[index, column] = (value[column] / bound[column] - mean[column]) / std[column]
    return len(rows)
