"""The kernels that the header gives to its users."""

from __future__ import annotations

from typing import Any

from numba import types

from teamclone.engine.inputs.frame import Frame, fill_frame
from teamclone.engine.inputs.paper import fill_paper
from teamclone.engine.inputs.project import Frames, fill_inputs
from teamclone.engine.network.answer import answer
from teamclone.engine.network.draw import likeliest, point_of, sample
from teamclone.engine.network.result import Answer, Mixture, view
from teamclone.engine.network.spec import fault
from teamclone.export.constants import named_type
from teamclone.export.translate import Entry
from teamclone.export.values import array_type
from teamclone.planner.plan import plan_scene


def _floats(rank: int) -> Any:
    return array_type(types.float32, rank)


def _doubles(rank: int) -> Any:
    return array_type(types.float64, rank)


def _integers(rank: int) -> Any:
    return array_type(types.int64, rank)


def _truths(rank: int) -> Any:
    return array_type(types.boolean, rank)


_FRAMES = named_type(Frames, [*map(_floats, (2, 3, 3, 2, 3, 4)), _truths(2), _integers(1), _floats(1)])
_FRAME = named_type(Frame, [*map(_doubles, (2, 2, 1, 3, 2)), _truths(1)])
_MIXTURE = named_type(Mixture, [_floats(1)] * 3)
_ANSWER = named_type(
    Answer,
    [*[_floats(1)] * 5, _MIXTURE, _floats(1), *[_MIXTURE] * 3, *[_floats(1)] * 2, *[_MIXTURE] * 2],
)
_SPEC, _OUT = _integers(1), _floats(1)

ENTRIES = (
    Entry(name="plan", kernel=plan_scene, arguments=(_doubles(2), types.int64, _integers(3), _doubles(1))),
    Entry(name="fill_frame", kernel=fill_frame, arguments=(_FRAME, _floats(1), _floats(2), _floats(2), _floats(1))),
    Entry(
        name="fill_inputs",
        kernel=fill_inputs,
        arguments=(_FRAMES, types.int64, _FRAME, types.int64, _integers(3), _integers(1), _floats(1)),
    ),
    Entry(
        name="fill_paper", kernel=fill_paper, arguments=(_FRAMES, types.int64, types.int64, _integers(1), _floats(1))
    ),
    Entry(name="fill_answer", kernel=answer, arguments=(_floats(1), _SPEC, _floats(1), types.boolean, _OUT)),
    Entry(name="view_of", kernel=view, arguments=(_SPEC, _OUT)),
    Entry(name="likeliest_of", kernel=likeliest, arguments=(_ANSWER,)),
    Entry(name="point_of", kernel=point_of, arguments=(_SPEC, _ANSWER, types.int64, _doubles(1))),
    Entry(name="sample_of", kernel=sample, arguments=(_SPEC, _OUT, _doubles(1), _doubles(1))),
    Entry(name="fault_of", kernel=fault, arguments=(_SPEC, _integers(1), types.int64)),
)
"""A new one needs its kernel and the Numba types of its arguments: `values.array_type` gives those of arrays."""
MEMORY_BYTES = 1 << 20
"""Scratch memory that is surely enough for any of them."""
