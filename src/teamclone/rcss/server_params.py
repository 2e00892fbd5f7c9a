"""Parameters of the server that enter the computations of a cycle, with their defaults (rcssserver `serverparam.cpp`).

A log names those of its match, and every computation takes them from there: `number` and `vector` give the default of
a version only where a log leaves one out. Datasets hold them in the order of `FIELDS`: after a change here raise
`dataset.layout.FORMAT`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

DEFAULTS: dict[str, float] = {
    # The ball.
    "ball_size": 0.085,
    "ball_decay": 0.94,
    "ball_rand": 0.05,
    "ball_speed_max": 3.0,
    "ball_accel_max": 2.7,
    # Players, beside their type (`player_types`).
    "player_rand": 0.1,
    "player_accel_max": 1.0,
    "kick_rand": 0.1,
    # Stamina.
    "stamina_max": 8000.0,
    "stamina_capacity": 130600.0,
    "recover_dec_thr": 0.3,
    "recover_dec": 0.002,
    "recover_min": 0.5,
    "effort_dec_thr": 0.3,
    "effort_dec": 0.005,
    "effort_inc_thr": 0.6,
    "effort_inc": 0.01,
    # Arguments of commands.
    "min_dash_power": 0.0,
    "max_dash_power": 100.0,
    "min_dash_angle": -180.0,
    "max_dash_angle": 180.0,
    "dash_angle_step": 1.0,
    "side_dash_rate": 0.4,
    "back_dash_rate": 0.7,
    "minmoment": -180.0,
    "maxmoment": 180.0,
    "minpower": -100.0,
    "maxpower": 100.0,
    "min_catch_angle": -90.0,
    "max_catch_angle": 90.0,
    # Tackles and catches.
    "tackle_dist": 2.0,
    "tackle_back_dist": 0.0,
    "tackle_width": 1.25,
    "tackle_exponent": 6.0,
    "foul_exponent": 10.0,
    "tackle_cycles": 10.0,
    "tackle_power_rate": 0.027,
    "max_tackle_power": 100.0,
    "max_back_tackle_power": 0.0,
    "tackle_rand_factor": 2.0,
    "catchable_area_l": 1.2,
    "catchable_area_w": 1.0,
    "catch_probability": 1.0,
    "catch_ban_cycle": 5.0,
    # Time.
    "half_time": 300.0,
    "nr_normal_halfs": 2.0,
    "extra_half_time": 100.0,
    "nr_extra_halfs": 2.0,
    "simulator_step": 100.0,
}
"""Defaults of version 19."""

_BEFORE: tuple[tuple[int, dict[str, float]], ...] = (
    (
        14,
        {
            "tackle_rand_factor": 1.0,
            "dash_angle_step": 90.0,
            "side_dash_rate": 0.25,
            "back_dash_rate": 0.5,
            "stamina_capacity": 148600.0,
        },
    ),
    (16, {"dash_angle_step": 45.0}),
    (17, {"back_dash_rate": 0.6, "min_catch_angle": -180.0, "max_catch_angle": 180.0, "min_dash_power": -100.0}),
)
"""Defaults of servers before a version, where they differ; the oldest first."""

OLDEST = 16
"""The version whose defaults are used for all before it. A log without a parameter is most likely that old."""

FURTHER: dict[str, float] = {
    "foul_cycles": 5.0,
    "maxneckang": 90.0,
    "minneckang": -90.0,
    "maxneckmoment": 180.0,
    "minneckmoment": -180.0,
    "quantize_step": 0.1,
    "slowness_on_top_for_left_team": 1.0,
    "slowness_on_top_for_right_team": 1.0,
    "team_actuator_noise": 0.0,
    "wind_rand": 0.0,
}
"""Defaults of parameters that no dataset and no model has: of the step of a cycle (`dynamics`), of what players see
(`percepts`)."""

_NEW_IN = (
    ("dist_noise_rate", 19),
    ("max_catch_angle", 17),
    ("illegal_defense_number", 16),
    ("red_card_probability", 15),
    ("tackle_rand_factor", 14),
    ("stamina_capacity", 13),
)
"""Parameters that the server lists from a version on; 18 has none of its own, and computes as 17 does."""

FIELDS = tuple(DEFAULTS)
"""The order of the parameters wherever they stand in an array, ``World.server``."""
SERVER_FIELD = {name: index for index, name in enumerate(FIELDS)}
"""Index of a parameter there."""

SERVER_DEFAULTS = np.array(list(DEFAULTS.values()))
"""(len(FIELDS),) float64, DEFAULTS in the order of `FIELDS`."""


def default(name: str, *, version: int | None = None) -> float:
    """Return the default of a parameter in a version of the server, the newest if None."""
    for before, values in _BEFORE:
        if version is not None and version < before and name in values:
            return values[name]
    return DEFAULTS[name] if name in DEFAULTS else FURTHER[name]


def version(params: Mapping[str, float | str]) -> int:
    """Return the version of the server whose rules a match was played by, as far as its parameters show it.

    17 stands for 18, too. `OLDEST` where the log lists none of the parameters that tell versions apart.
    """
    return next((since for name, since in _NEW_IN if name in params), OLDEST)


def number(params: Mapping[str, float | str], name: str, *, version: int | None = None) -> float:
    """Return a parameter of a match: the number in its log, else the default of its server's version."""
    value = params.get(name)
    return float(value) if isinstance(value, int | float) else default(name, version=version)


def vector(params: Mapping[str, float | str], *, version: int | None = None) -> NDArray[np.float64]:
    """Return (len(FIELDS),) all of FIELDS of a match, each by `number`."""
    return np.array([number(params, name, version=version) for name in FIELDS])


def half_cycles(params: Mapping[str, float | str], *, version: int | None = None) -> float:
    """Return the cycles of half a match; infinite or NaN where the parameters give it no end."""
    half_s, step_ms = (np.float64(number(params, name, version=version)) for name in ("half_time", "simulator_step"))
    with np.errstate(all="ignore"):
        return float(half_s * 1000.0 / step_ms)
