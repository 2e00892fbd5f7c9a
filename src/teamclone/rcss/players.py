"""Numbers of players. The player axis of every array has the left or own team's 11 first."""

from __future__ import annotations

import numpy as np

N_TEAM = 11
"""Players of a team: uniform numbers 1 to 11."""
N_PLAYERS = 2 * N_TEAM
"""Players of a match."""
TEAM_SLOTS = (slice(0, N_TEAM), slice(N_TEAM, N_PLAYERS))
"""Places of the first and of the second team on the player axis."""
SLOT_SIDES = np.repeat(np.array([1, -1], np.int8), N_TEAM)
"""(22,) side of each place on the player axis of a match: 1 left, -1 right."""
SLOT_UNUMS = np.tile(np.arange(1, N_TEAM + 1, dtype=np.uint8), 2)
"""(22,) uniform number of each place on the player axis."""
