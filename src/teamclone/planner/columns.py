"""The columns of a plan, see `plan.plan`. Free of Numba, so that settings and layouts can name them."""

from __future__ import annotations

WAYS = ("shot", "clear", "pass", "dribble", "self_pass", "hold")
"""Ways to kick."""
CHOICES = (*WAYS, "prepare", "turn", "leave")
"""What is chosen: a way; the first kick of several; no kick but a turn; to leave it to a team mate that is nearer."""
KICK_OF = {**{name: name for name in WAYS}, "prepare": "pass"}
"""The way of each choice that kicks."""
VALUED = ("pass", "dribble", "self_pass", "hold")
"""Ways that are compared by the value of where they bring the ball."""
UNDERWAY = "dribble_m", "dribble_dashes", "self_pass_m", "self_pass_dashes", "turn_m", "turn_dashes"
"""See `keep_dribble.underway`."""
PLAN = (
    "able",
    *(f"choose_{name}" for name in CHOICES),
    *(f"{name}_there" for name in WAYS),
    *(f"{name}_value" for name in VALUED),
    "pass_kicks",
    "pass_cycles",
    *(f"underway_{name}" for name in UNDERWAY),
    "tackle_there",
    "tackle_degrees",
    *(f"{name}_{axis}" for name in WAYS for axis in ("vx", "vy")),
)
"""Columns of a plan; all 0 but for a player that can kick the ball, and ``tackle_`` for one that can tackle it. Values
are metres beyond the best of the others, at most MOST_VALUE_M; velocities those of the ball after the kick, metres per
cycle on the pitch; degrees are from the body."""
MOST_VALUE_M = 20.0
