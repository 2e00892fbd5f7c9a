"""What tells player types apart: their parameters, what follows from them, and their ranks in a match."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.rcss.player_types import FIELDS
from teamclone.world.channels import TYPE_FIELD

_FULL_POWER = 100.0


def ranks(types: NDArray[np.floating[Any]], traits: Sequence[str]) -> NDArray[np.float64]:
    """Return (n_types, n_traits) the ranks of the types of a match by each trait, 0 the least and 1 the greatest.

    Args:
        types: (n_types, len(FIELDS)). traits: parameters of `player_types.FIELDS`; ``acceleration`` and ``top_speed``,
            which are of a dash with full power.
    """
    from scipy.stats import rankdata

    of = {name: types[:, TYPE_FIELD[name]].astype(np.float64) for name in FIELDS}
    of["acceleration"] = _FULL_POWER * of["dash_power_rate"] * of["effort_max"]
    of["top_speed"] = np.minimum(of["acceleration"] / (1 - of["player_decay"]), of["player_speed_max"])
    found: NDArray[np.float64] = (rankdata(np.stack([of[name] for name in traits], 1), axis=0) - 1) / max(
        len(types) - 1, 1
    )
    return found
