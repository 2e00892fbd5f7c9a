"""What servers say to players and coaches, and what these say: read, refused, written."""

from __future__ import annotations

import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamclone.protocol import agent
from teamclone.protocol.agent import MEASURED, Sense, Welcome
from teamclone.protocol.parameters import Parameters
from teamclone.rcss.commands import BODY_KINDS, CommandKind
from teamclone.rcss.playmodes import PlayMode

STATE = (
    b"(fullstate 57 (pmode play_on) (vmode high normal) (count 1 40 12 0 1 55 3 0 0) (arm (movable 0) (expires 0) "
    b"(target 0 0) (count 0)) (score 2 1) ((b) -8.89 -0.0017 5.4e-14 -0.0016) ((p l 1 g 4) -49.8 0.1 0 0 12.5 -30 "
    b"(focus_point 0 0) (stamina 8000 1 1 130600)) ((p r 11 7) -9.61407 0.0367 0.1333 0.0127 -20.3 0 3.5 0.785401 "
    b"(focus_point 0 0) (stamina 7968.37 0.908883 1 130552) k y))\0"
)
SENSE = (
    b"(sense_body 57 (view_mode high normal) (stamina 8000 1 1 130600) (speed 0.4 -3) (head_angle 5) (kick 1) "
    b"(dash 40) (turn 12) (say 0) (turn_neck 55) (catch 2) (move 3) (change_view 3) (change_focus 0) "
    b"(arm (movable 0) (expires 0) (target 0 0) (count 0)) "
    b"(focus (target none) (count 0)) (tackle (expires 4) (count 6)) (collision (ball)) "
    b"(foul (charged 0) (card none)) (focus_point 0 0))\0"
)


def test_a_full_state_is_read() -> None:
    state = agent.full_state_of(STATE)
    assert state is not None
    assert (state.cycle, state.playmode, state.scores) == (57, PlayMode.PLAY_ON, (2, 1))
    np.testing.assert_array_equal(state.ball, [-8.89, -0.0017, 5.4e-14, -0.0016])
    assert np.flatnonzero(state.present).tolist() == [0, 21]
    assert np.flatnonzero(state.goalie).tolist() == [0]
    assert state.type[[0, 21]].tolist() == [4, 7]
    assert state.measured[:, 21].tolist() == [-9.61407, 0.0367, 0.1333, 0.0127, -20.3, 0, 7968.37, 0.908883, 1, 130552]
    assert (state.doing[21], state.cards[21], state.doing[0]) == (agent.KICKED, b"y", b"")


def test_older_versions_lack_the_focus_and_the_capacity() -> None:
    old = STATE.replace(b" (focus_point 0 0)", b"").replace(b" 130600)", b")").replace(b" 130552)", b")")
    state, new = agent.full_state_of(old), agent.full_state_of(STATE)
    assert state is not None
    assert new is not None
    assert np.isnan(state.measured[MEASURED.index("capacity"), [0, 21]]).all()
    np.testing.assert_array_equal(state.measured[:-1], new.measured[:-1])


def test_a_goalkeeper_that_holds_the_ball_has_a_free_kick() -> None:
    state = agent.full_state_of(STATE.replace(b"play_on", b"goalie_catch_ball_r"))
    assert state is not None
    assert (state.playmode, state.held) == (PlayMode.FREE_KICK_R, -1)


def test_what_a_player_feels_is_read() -> None:
    counts = {"kick": 1, "dash": 40, "turn": 12, "tackle": 6, "catch": 2, "move": 3}
    in_order = tuple(counts[kind.name.lower()] for kind in BODY_KINDS)
    assert agent.sense_of(SENSE) == Sense(cycle=57, counts=in_order, frozen=4, collided=True)
    calm = agent.sense_of(SENSE.replace(b"(collision (ball))", b"(collision none)"))
    assert calm is not None
    assert not calm.collided


def test_answers_of_the_server_are_told_apart() -> None:
    assert agent.welcome_of(b"(init r 3 before_kick_off)\0") == Welcome(
        side=-1, unum=3, playmode=PlayMode.BEFORE_KICK_OFF
    )
    assert agent.welcome_of(b"(reconnect l goal_r)\0") == Welcome(side=1, unum=0, playmode=PlayMode.GOAL_R)
    assert agent.welcome_of(b"(init l ok)\0") is None
    assert agent.welcome_of(b"(init l 12 play_on)\0") is None
    assert agent.coach_side_of(b"(init l ok)\0") == 1
    assert agent.coach_side_of(b"(init r 3 before_kick_off)\0") is None
    assert agent.refusal_of(b"(error no_more_team)\0") == "no_more_team"
    assert agent.changed_type_of(b"(ok change_player_type 4 17)\0") == (4, 17)
    assert agent.asks_to_think(b"(think)\0")
    assert not agent.asks_to_think(b"(thinking)\0")


def test_parameters_are_read() -> None:
    found = Parameters()
    for text in (
        b'(server_param (half_time 300)(synch_mode 1)(landmark_file "~/.x"))',
        b"(player_param (player_types 18))",
        b"(player_type (id 3)(player_decay 0.4))",
    ):
        assert found.take(text)
    assert found.server == {"half_time": 300.0, "synch_mode": 1.0, "landmark_file": "~/.x"}
    for text in (
        b"(player_type (id 300)(player_decay 0.4))",
        b"(player_type (id 4)(player_decay nan))",
        b"(server_param (half_time 200)(synch_m",
    ):
        assert not found.take(text)
    assert found.types == {3: {"player_decay": 0.4}}


def test_requests_are_as_the_server_reads_them() -> None:
    assert agent.init("Red", 19, goalie=True) == b"(init Red (version 19) (goalie))\0"
    assert agent.reconnect("Red", 7) == b"(reconnect Red 7)\0"
    assert agent.change_player_type(3, 12) == b"(change_player_type 3 12)\0"
    words = [agent.command(CommandKind.DASH, (80, -15.25)), agent.command(CommandKind.TURN, (0,)), agent.DONE]
    assert agent.commands(words) == b"(dash 80.0000 -15.2500)(turn 0.0000)(done)\0"
    with pytest.raises(ValueError, match="nan"):
        agent.command(CommandKind.TURN, (float("nan"),))


READERS = (
    agent.full_state_of,
    agent.sense_of,
    agent.welcome_of,
    agent.coach_side_of,
    agent.refusal_of,
    agent.changed_type_of,
    lambda data: Parameters().take(agent.text_of(data)),
    agent.asks_to_think,
)


@given(st.binary(max_size=300))
def test_garbage_is_nothing(data: bytes) -> None:
    for read in READERS:
        assert not read(b"(" + data)


def test_damaged_messages_are_nothing_or_whole() -> None:
    draw = random.Random(0)
    for _ in range(3000):
        data = bytearray(draw.choice((STATE, SENSE)))
        for _ in range(draw.randint(1, 4)):
            at = draw.randrange(len(data))
            data[at : at + draw.randint(0, 3)] = draw.choice((b"", b"(", b")", b"9e99", b"-", b"nan", b"\0", b" 1"))
        state = agent.full_state_of(bytes(data))
        if state is not None:
            there = state.measured[:, state.present]
            assert np.isfinite(there[:-1]).all()
        agent.sense_of(bytes(data))


@pytest.mark.parametrize("read", READERS)
def test_a_giant_costs_no_more_than_its_length(read: object) -> None:
    for text in (b"(fullstate 1 " + b"(pmode " * 300_000, b"(sense_body 1 " + b"(kick 1" * 300_000, b"(" * 2_000_000):
        assert not read(text)  # type: ignore[operator]


def test_a_cut_message_is_nothing() -> None:
    for end in range(len(STATE) - 1):
        assert agent.full_state_of(STATE[:end]) is None
