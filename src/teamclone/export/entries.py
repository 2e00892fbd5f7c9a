"""The kernels that the header gives to its users."""

from __future__ import annotations

from numba import types

from teamclone.export.translate import Entry
from teamclone.export.values import array_type
from teamclone.planner import plan

_FLOATS, _TABLE = array_type(types.float64, 1), array_type(types.float64, 2)
_ORDER = array_type(types.int64, 3, readonly=True)

ENTRIES = (Entry(name="plan", kernel=plan.plan_scene, arguments=(_TABLE, types.int64, _ORDER, _FLOATS)),)
"""A new one needs its kernel and the Numba types of its arguments: `values.array_type` gives those of arrays."""
MEMORY_BYTES = 1 << 20
"""Scratch memory that is surely enough for any of them."""
