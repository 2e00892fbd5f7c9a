"""What play modes mean, whose they are, and the same with the sides exchanged."""

from __future__ import annotations

import numpy as np
import pytest

from teamclone.rcss.playmodes import OTHER_SIDE, RESTARTS, SITUATION, PlayMode, Situation


@pytest.mark.parametrize(
    ("mode", "situation", "restarts", "other"),
    [
        (PlayMode.PLAY_ON, Situation.PLAY_ON, 0, PlayMode.PLAY_ON),
        (PlayMode.BEFORE_KICK_OFF, Situation.BEFORE_KICK_OFF, 0, PlayMode.BEFORE_KICK_OFF),
        (PlayMode.KICK_IN_L, Situation.KICK_IN, 1, PlayMode.KICK_IN_R),
        (PlayMode.INDIRECT_FREE_KICK_R, Situation.INDIRECT_FREE_KICK, -1, PlayMode.INDIRECT_FREE_KICK_L),
        # Named after who did it: the other side restarts.
        (PlayMode.GOAL_L, Situation.GOAL, -1, PlayMode.GOAL_R),
        (PlayMode.OFFSIDE_R, Situation.FAULT, 1, PlayMode.OFFSIDE_L),
        (PlayMode.FREE_KICK_FAULT_L, Situation.FAULT, -1, PlayMode.FREE_KICK_FAULT_R),
        (PlayMode.PENALTY_TAKEN_L, Situation.OTHER, 1, PlayMode.PENALTY_TAKEN_R),
        (PlayMode.TIME_OVER, Situation.OTHER, 0, PlayMode.TIME_OVER),
    ],
)
def test_a_mode_by_hand(mode: PlayMode, situation: Situation, restarts: int, other: PlayMode) -> None:
    assert (SITUATION[mode], RESTARTS[mode], OTHER_SIDE[mode]) == (situation, restarts, other)


def test_sides_are_exchanged_both_ways_and_with_them_who_restarts() -> None:
    np.testing.assert_array_equal(OTHER_SIDE[OTHER_SIDE], np.arange(256))
    np.testing.assert_array_equal(RESTARTS[OTHER_SIDE], -RESTARTS)
    np.testing.assert_array_equal(SITUATION[OTHER_SIDE], SITUATION)
    assert {mode.name for mode in PlayMode if RESTARTS[mode]} == {
        m.name for m in PlayMode if m.name[-2:] in ("_L", "_R")
    }
    assert set(SITUATION.tolist()) == set(Situation)
