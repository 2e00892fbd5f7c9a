"""Play modes: the ids of binary logs and monitor packets, and their names in text logs (rcssserver `types.h`)."""

from __future__ import annotations

from enum import IntEnum


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
