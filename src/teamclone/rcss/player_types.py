"""Parameters of heterogeneous player types (rcssserver `heteroplayer.cpp`), as text logs name them."""

from __future__ import annotations

DEFAULTS: dict[str, float] = {
    "player_speed_max": 1.05,
    "stamina_inc_max": 45.0,
    "player_decay": 0.4,
    "inertia_moment": 5.0,
    "dash_power_rate": 0.006,
    "player_size": 0.3,
    "kickable_margin": 0.7,
    "kick_rand": 0.1,
    "extra_stamina": 50.0,
    "effort_max": 1.0,
    "effort_min": 0.6,
    "kick_power_rate": 0.027,
    "foul_detect_probability": 0.5,
    "catchable_area_l_stretch": 1.0,
}
"""Type 0 on a server with default parameters; also the values that older logs leave out."""

FIELDS = tuple(DEFAULTS)
"""The order of a type's parameters wherever they stand in an array."""

GROUPS: dict[str, tuple[str, ...]] = {
    "movement": ("dash_power_rate", "player_decay", "inertia_moment"),
    "kick": ("kickable_margin", "kick_rand"),
    "stamina": ("stamina_inc_max", "extra_stamina", "effort_max"),
}
"""The eight parameters that vary freely between types, by their effect. effort_min is effort_max - 0.4."""

RANGES: dict[str, tuple[float, float]] = {
    "dash_power_rate": (0.0048, 0.0068),
    "player_decay": (0.3, 0.5),
    "inertia_moment": (2.5, 7.5),
    "kickable_margin": (0.6, 0.8),
    "kick_rand": (0.0, 0.2),
    "stamina_inc_max": (40.2, 52.2),
    "extra_stamina": (50.0, 100.0),
    "effort_max": (0.8, 1.0),
}
"""The ranges from which the server draws with default player parameters; they project a type onto [-1, 1]."""
