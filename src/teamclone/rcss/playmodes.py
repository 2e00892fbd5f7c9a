"""Play modes: the ids of binary logs and monitor packets, and their names in text logs (rcssserver `types.h`)."""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class PlayMode(IntEnum):
    """A play mode; ``PlayMode.PLAY_ON.name.lower()`` is the server's string."""

    NULL = 0
    BEFORE_KICK_OFF = 1
    TIME_OVER = 2
    PLAY_ON = 3
    KICK_OFF_L = 4
    KICK_OFF_R = 5
    KICK_IN_L = 6
    KICK_IN_R = 7
    FREE_KICK_L = 8
    FREE_KICK_R = 9
    CORNER_KICK_L = 10
    CORNER_KICK_R = 11
    GOAL_KICK_L = 12
    GOAL_KICK_R = 13
    GOAL_L = 14
    GOAL_R = 15
    DROP_BALL = 16
    OFFSIDE_L = 17
    OFFSIDE_R = 18
    PENALTY_KICK_L = 19
    PENALTY_KICK_R = 20
    FIRST_HALF_OVER = 21
    PAUSE = 22
    HUMAN_JUDGE = 23
    FOUL_CHARGE_L = 24
    FOUL_CHARGE_R = 25
    FOUL_PUSH_L = 26
    FOUL_PUSH_R = 27
    FOUL_MULTIPLE_ATTACK_L = 28
    FOUL_MULTIPLE_ATTACK_R = 29
    FOUL_BALLOUT_L = 30
    FOUL_BALLOUT_R = 31
    BACK_PASS_L = 32
    BACK_PASS_R = 33
    FREE_KICK_FAULT_L = 34
    FREE_KICK_FAULT_R = 35
    CATCH_FAULT_L = 36
    CATCH_FAULT_R = 37
    INDIRECT_FREE_KICK_L = 38
    INDIRECT_FREE_KICK_R = 39
    PENALTY_SETUP_L = 40
    PENALTY_SETUP_R = 41
    PENALTY_READY_L = 42
    PENALTY_READY_R = 43
    PENALTY_TAKEN_L = 44
    PENALTY_TAKEN_R = 45
    PENALTY_MISS_L = 46
    PENALTY_MISS_R = 47
    PENALTY_SCORE_L = 48
    PENALTY_SCORE_R = 49
    ILLEGAL_DEFENSE_L = 50
    ILLEGAL_DEFENSE_R = 51


BY_NAME: dict[str, PlayMode] = {mode.name.lower(): mode for mode in PlayMode}
"""Server string to play mode."""


MOVE_MODES = (
    PlayMode.BEFORE_KICK_OFF,
    PlayMode.GOAL_L,
    PlayMode.GOAL_R,
    PlayMode.FREE_KICK_L,
    PlayMode.FREE_KICK_R,
)
"""Play modes in which the server takes a ``move``, in a free kick only from a goalkeeper that holds the ball.

In others it ignores it and the player's slot stays free (rcssserver `player.cpp`, move).
"""

MAY_MOVE = np.zeros(256, np.bool_)
"""(256,) whether a play mode is one of MOVE_MODES."""
MAY_MOVE[list(MOVE_MODES)] = True


class Situation(IntEnum):
    """The meaning of a play mode for the players, whichever team's it is."""

    OTHER = 0
    """No play: over, paused, or a penalty shoot-out, for which all but two players wait in the middle."""
    PLAY_ON = 1
    BEFORE_KICK_OFF = 2
    KICK_OFF = 3
    KICK_IN = 4
    FREE_KICK = 5
    INDIRECT_FREE_KICK = 6
    CORNER_KICK = 7
    GOAL_KICK = 8
    GOAL = 9
    """The clock stands until the kick-off."""
    FAULT = 10
    """A foul or an offside: the clock stands until the free kick."""


_FAULTS = (
    "OFFSIDE",
    "FOUL_CHARGE",
    "FOUL_PUSH",
    "FOUL_MULTIPLE_ATTACK",
    "FOUL_BALLOUT",
    "BACK_PASS",
    "FREE_KICK_FAULT",
    "CATCH_FAULT",
    "ILLEGAL_DEFENSE",
)


def _situation(mode: PlayMode) -> Situation:
    name = mode.name.removesuffix("_L").removesuffix("_R")
    return Situation.FAULT if name in _FAULTS else Situation.__members__.get(name, Situation.OTHER)


def _restarts(mode: PlayMode) -> int:
    if not mode.name.endswith(("_L", "_R")):
        return 0
    side = 1 if mode.name.endswith("_L") else -1
    return -side if _situation(mode) in (Situation.GOAL, Situation.FAULT) else side


_STOPPED = (PlayMode.NULL, PlayMode.TIME_OVER, PlayMode.FIRST_HALF_OVER, PlayMode.PAUSE, PlayMode.HUMAN_JUDGE)
_WITHOUT_KICKS = (Situation.BEFORE_KICK_OFF, Situation.GOAL, Situation.FAULT)

BALL_KICKED = np.zeros(256, np.bool_)
"""(256,) whether a kick moves the ball in a play mode (`player.cpp`, kick)."""
BALL_TACKLED = np.zeros(256, np.bool_)
"""(256,) whether a tackle does: as kicks, but for catch_fault, which the server's list of tackles leaves out."""
CLOCK_STANDS = np.zeros(256, np.bool_)
"""(256,) whether the server shows one cycle again and again in a play mode."""
SITUATION = np.zeros(256, np.uint8)
"""(256,) the Situation of each play mode by its id."""
RESTARTS = np.zeros(256, np.int8)
"""(256,) the team that restarts or will: 1 the left team, -1 the right one, 0 none.

Names of goals and faults are of the team that did it; the other one restarts.
"""
OTHER_SIDE = np.arange(256, dtype=np.uint8)
"""(256,) the same play mode with the teams' sides exchanged."""
for _mode in PlayMode:
    BALL_KICKED[_mode] = _situation(_mode) not in _WITHOUT_KICKS and _mode is not PlayMode.TIME_OVER
    BALL_TACKLED[_mode] = BALL_KICKED[_mode] or _mode in (PlayMode.CATCH_FAULT_L, PlayMode.CATCH_FAULT_R)
    CLOCK_STANDS[_mode] = _situation(_mode) in _WITHOUT_KICKS or _mode in _STOPPED
    SITUATION[_mode], RESTARTS[_mode] = _situation(_mode), _restarts(_mode)
    if RESTARTS[_mode]:
        OTHER_SIDE[_mode] = PlayMode[f"{_mode.name[:-1]}{'R' if _mode.name.endswith('_L') else 'L'}"]
