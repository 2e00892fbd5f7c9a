"""How many players there are. The player axis of every array has the left or own team's 11 first."""

from __future__ import annotations

N_TEAM = 11
"""Players of a team: uniform numbers 1 to 11."""
N_PLAYERS = 2 * N_TEAM
"""Players of a match."""
