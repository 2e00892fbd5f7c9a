"""Plans of many scenes by Numba, compiled once and kept on disk; most of it is what the inputs of networks compile.

`engine.inputs.project.plans` takes frames of single precision and plans near the ball alone; tests ask for more.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone import planner, rcss
from teamclone.planner.columns import PLAN
from teamclone.planner.plan import orders_of, plan_scene
from teamclone.planner.scene import Array
from teamclone.system import compiling
from teamclone.system.compiling import cached_kernel, version_of
from teamclone.world import channels


def _compiled() -> Any:
    version = version_of(planner, rcss, channels, compiling)

    @cached_kernel(nogil=True, error_model="numpy")
    def plan_all(
        scenes: Array, actors: NDArray[np.int64], orders: NDArray[np.int64], which: NDArray[np.int64], made: Array
    ) -> int:
        for index in range(len(actors)):
            plan_scene(scenes[index], actors[index], orders[which[index]], made[index])
        return version

    return plan_all


_plan_all = _compiled()


def plans_of(scenes: Array, actors: NDArray[np.int64], server: NDArray[np.floating]) -> Array:
    """Return (n, len(PLAN)) the plans of (n, ROWS, COLUMNS) scenes, which are completed in place.

    Args:
        server: (n, fields) as `server_params.FIELDS`.
    """
    made = np.zeros((len(actors), len(PLAN)))
    _plan_all(scenes, actors, *orders_of(server), made)
    return made
