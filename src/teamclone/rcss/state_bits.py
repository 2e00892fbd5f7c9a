"""Bits of a player's ``state`` column (rcssserver `types.h`, PlayerState).

Bits about a command (KICK, CATCH, TACKLE and their faults) are set in the frame *after* the command.
"""

from __future__ import annotations

STAND = 0x1
"""Connected and on the field: the test for "this player exists"."""
KICK = 0x2
KICK_FAULT = 0x4
GOALIE = 0x8
CATCH = 0x10
CATCH_FAULT = 0x20
BALL_TO_PLAYER = 0x40
DISCARD = 0x100
BALL_COLLIDE = 0x400
PLAYER_COLLIDE = 0x800
TACKLE = 0x1000
TACKLE_FAULT = 0x2000
KICKS, CATCHES, TACKLES = KICK | KICK_FAULT, CATCH | CATCH_FAULT, TACKLE | TACKLE_FAULT
"""Both bits of a command: whether it was given at all, and by equality with the first one whether it succeeded."""
BACK_PASS = 0x4000
FREE_KICK_FAULT = 0x8000
POST_COLLIDE = 0x10000
FOUL_CHARGED = 0x20000
YELLOW_CARD = 0x40000
RED_CARD = 0x80000
ILLEGAL_DEFENSE = 0x100000
