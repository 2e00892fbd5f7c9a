from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import pytest
import torch
from tests.situations import put, resting, situations
from torch import Tensor

from teamclone.engine.inputs.layout import BLOCKS, GEOMETRY, MATES, NEAREST_OPPONENTS, PAST_FRAMES, RIVALS, TACKLE, WAY
from teamclone.models.inputs.egocentric import CLIP, EgocentricFeatures
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.playmodes import PlayMode
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.world.channels import (
    CHANNEL,
    FLAG_CHARGED,
    FLAG_COLLIDED,
    FLAG_GOALIE,
    FLAG_ON_FIELD,
    FLAG_TACKLING,
    FLAG_YELLOW,
    TYPE_FIELD,
)
from teamclone.world.mirror import mirror_state
from teamclone.world.state import State

SEEN = tuple(block for block in BLOCKS if block != "plan")
"""All but what is planned, which has tests of its own."""
PARTS = ("core", *SEEN, "geometry")
PLAYER = 11
"""Columns of one player in mates, opponents and rivals."""


@cache
def whole() -> EgocentricFeatures:
    """The inputs of all these blocks. Made where a test asks: the first ones of a process may have to be compiled."""
    return EgocentricFeatures(SEEN)


def part(projected: Tensor, name: str) -> Tensor:
    """(batch, columns) of one block."""
    if name == "geometry":
        return projected[:, whole().n_inputs :]
    inputs = whole().names[: whole().n_inputs]
    return projected[:, [i for i, column in enumerate(inputs) if column.rpartition("_")[0] == name]]


def seen(state: State, name: str) -> list[float]:
    """A block of the only situation."""
    return part(whole().project(state), name)[0].tolist()


def geometry(state: State) -> dict[str, float]:
    return dict(zip(GEOMETRY, seen(state, "geometry"), strict=True))


def copied(state: State) -> State:
    return State._make(tensor.clone() for tensor in state)


def polar(forward: float, aside: float) -> list[float]:
    distance = math.hypot(forward, aside)
    return [forward / 20, aside / 20, math.log(distance + 0.1), forward / distance, aside / distance]


def test_names_are_the_columns_and_unique() -> None:
    for blocks in (BLOCKS, (), ("past",), ("rivals", "self")):
        features = EgocentricFeatures(blocks)
        projected = features.project(situations(3, history=features.history))
        assert projected.shape == (3, len(features.names))
        assert len(set(features.names)) == len(features.names)
        assert features.names[features.n_inputs :] == (*GEOMETRY, *((*TACKLE, *WAY) if "plan" in blocks else ()))
        assert {name.rpartition("_")[0] for name in features.names[: features.n_inputs]} == {"core", *blocks}


def test_blocks_keep_their_columns_whatever_else_there_is() -> None:
    """In the order of BLOCKS, however they are asked for."""
    everything = whole().project(situations(5, history=PAST_FRAMES))
    some = EgocentricFeatures(("opponents", "self", "past"))
    assert some.blocks == ("self", "opponents", "past")
    projected = some.project(situations(5, history=PAST_FRAMES))
    assert torch.equal(projected, torch.cat([part(everything, name) for name in ("core", *some.blocks, "geometry")], 1))


def test_columns_finds_blocks() -> None:
    state = situations(2, history=PAST_FRAMES)
    projected = whole().project(state)
    places = whole().columns(("reach", "self"))
    expected = torch.cat([part(projected, name) for name in ("core", "self", "reach")], 1)
    assert torch.equal(projected[:, places], expected)
    assert whole().columns(()) == list(range(part(projected, "core").shape[1]))


def test_inputs_are_normalised_and_limited_and_geometry_stays() -> None:
    features = EgocentricFeatures(("self", "ball"))
    projected = features.project(situations(400))
    features.fit(projected.split(150))
    inputs = features.normalise(projected)
    assert torch.equal(inputs[:, features.n_inputs :], projected[:, features.n_inputs :])
    means, sided = inputs[:, : features.n_inputs].mean(0), features.signs[: features.n_inputs] < 0
    assert means[~sided].abs().max() < 1e-4
    assert means[sided].abs().max() > 1e-2, "what changes its sign in the mirror is not shifted"
    strange = projected.clone()
    strange[0, 0], strange[1, 0] = 1e6, -1e6
    limited = features.normalise(strange)
    assert limited[:2, 0].tolist() == [CLIP, -CLIP]
    assert torch.equal(features(situations(400)), inputs)


# What each block says, by hand.


def standing() -> State:
    """One situation: number 1 acts, at (10, -5), facing +y, moving (0.1, 0.4); the ball 2 m before him, 1 m aside."""
    state = resting(history=PAST_FRAMES)
    put(state, 0, x=10, y=-5, vx=0.1, vy=0.4, body=90, stamina=2450)
    state.ball[0] = torch.tensor([9.0, -3.0, -0.5, 0.25])
    return state


def test_self() -> None:
    got = seen(standing(), "self")
    # Body; speed; along and across the body; stamina by three measures, effort, recovery, capacity; three flags.
    speed = math.hypot(0.1, 0.4)
    expected = [0, 1, speed, 0.4, -0.1, 2450 / 8000, 0.5, -1, 1, 1, 1, 0, 0, 0]
    assert got == pytest.approx(expected, abs=1e-6)
    state = standing()
    state.players[0, 0, CHANNEL["flags"]] = FLAG_ON_FIELD | FLAG_TACKLING | FLAG_COLLIDED | FLAG_YELLOW
    assert seen(state, "self")[-3:] == [1, 0, 1]


def test_role_last_and_view() -> None:
    state = standing()
    state.players[0, 0, CHANNEL["last_command"]] = int(CommandKind.TURN)
    put(state, 0, neck=-30, view_width=60)
    put(state, 4, last_command=int(CommandKind.KICK))
    assert seen(state, "role") == [1] + [0] * 10
    assert seen(state, "last") == [0, 0, 1, 0, 0, 0, 0, 1, 0]
    assert seen(state, "view") == pytest.approx([math.cos(math.pi / 6), -0.5, 1 / 3])


def test_mode() -> None:
    state = standing()
    assert seen(state, "mode") == [0, 1] + [0] * 20
    state.mode[:], state.mode_cycles[:] = PlayMode.KICK_OFF_L, 5
    put(state, 0, flags=FLAG_ON_FIELD | FLAG_GOALIE)
    assert seen(state, "mode") == pytest.approx([0, 0, 0, 1, 0] + [0] * 14 + [0.5, 0.05, 1])
    # The last two kinds are goals and faults; the modelled team scored, so the others restart.
    state.mode[:], state.mode_cycles[:] = PlayMode.GOAL_L, 300
    assert seen(state, "mode")[15:] == [0, 1, 0, 0, 1, 1, 1]
    state.mode[:] = PlayMode.FOUL_CHARGE_R
    assert seen(state, "mode")[15:19] == [0, 0, 1, 0]
    state.mode[:] = PlayMode.PENALTY_TAKEN_R
    assert seen(state, "mode")[:3] == [1, 0, 0]


def test_own_kick_is_not_that_of_a_team_mate() -> None:
    state = standing()
    state.players[0, 0, CHANNEL["last_command"]] = int(CommandKind.KICK)
    put(state, 15, last_command=int(CommandKind.KICK))
    assert seen(state, "last")[-2:] == [0, 1]


def test_ball() -> None:
    got = seen(standing(), "ball")
    # He faces +y, so forward is y and aside is -x: the ball is at (2, 1), moves (.25, .5), he himself (.4, -.1).
    ahead = (2 + 0.25 - 0.4, 1 + 0.5 + 0.1)
    turn = math.degrees(math.atan2(ahead[1], ahead[0]))
    assert got[:10] == pytest.approx([*polar(2, 1), *polar(*ahead)], abs=1e-5)
    assert got[10:13] == pytest.approx([0.25, 0.5, math.hypot(0.25, 0.5)], abs=1e-6)
    # Out of reach by 1.15 m and then by 1.35; a tackle cannot reach 2 m; the turn is far from none.
    assert turn > 10
    assert got[13:] == pytest.approx([2, 0, 2, 1 - (1 + 0.8**6), 1, 1], abs=1e-5)


def test_ball_at_the_feet() -> None:
    state = standing()
    state.ball[0] = torch.tensor([10.0, -5.0 + 0.985, 0.1, 0.4])
    got = seen(state, "ball")
    assert got[13:] == pytest.approx([-0.4, 1, -0.2, 1 - (0.985 / 2) ** 6, 0, 0], abs=1e-4)


def test_reach_and_core() -> None:
    state = resting(history=PAST_FRAMES)
    put(state, 0, x=0)
    put(state, 3, x=-10, y=0)
    put(state, 14, x=30, y=0, body=180)
    state.ball[0, :2] = torch.tensor([10.0, 0.0])
    got, scene = seen(state, "reach"), seen(state, "core")
    # 10 m less 1.085 take the actor 10 dashes (1 m each less 2/3); the mate 20 m less .885: 20; the opponent 20 m less
    # 1.085: 20. Only to within six are differences told.
    own, mate, opponent = 10, 20, 20
    assert got[0] == 1
    assert got[1:5] == pytest.approx([-1, -1, (mate - opponent) / 6, -1])
    assert got[5:8] == [0, 0, 0]
    assert got[8] == 1
    for place in range(4):
        assert got[9 + 5 * place : 14 + 5 * place] == pytest.approx(polar(10, 0), abs=1e-5)
    # Actor, ball, its velocity, four meetings; six times; three lines: nobody is behind the ball but one opponent.
    assert scene[:4] == pytest.approx([0, 0, 10 / 52.5, 0])
    assert scene[4:6] == [0, 0]
    assert scene[14:20] == pytest.approx([own / 20, mate / 20, 2, opponent / 20, 2, own / 20])
    assert scene[20:] == pytest.approx([10 / 52.5, 10 / 52.5, 0])


def test_lines() -> None:
    state = resting(history=PAST_FRAMES)
    put(state, 0, x=20, y=5)
    state.ball[0] = torch.tensor([12.0, 0.0, 1.0, 0.0])
    for opponent, x in ((11, 50.0), (12, 31.0), (13, 29.0), (14, -10.0)):
        put(state, opponent, x=x, y=20)
    for mate, x in ((1, -48.0), (2, -20.0), (3, 4.0)):
        put(state, mate, x=x, y=-20)
    got = seen(state, "lines")
    # The last opponent but one is at 31, beyond ball and meetings; our last but one at -20.
    limit = geometry(state)["line_x"]
    assert limit == pytest.approx(31)
    expected = [(31 - 20) / 20, 2, 3, -40 / 20, -1, 2, (12 - 20 - 10) / 5 if 12 - 20 - 10 > -5 else -1]
    assert got == pytest.approx(expected, abs=1e-5)


def test_lines_follow_the_ball() -> None:
    state = resting(history=PAST_FRAMES)
    put(state, 0, x=-30)
    state.ball[0] = torch.tensor([25.0, 0.0, 2.0, 0.0])
    for opponent in (11, 12):
        put(state, opponent, x=10, y=30)
    # In the next cycle the ball is at 27; where somebody first has it is further on.
    line = seen(state, "core")[20] * 52.5
    assert line > 27
    assert line == pytest.approx(52.5 * max(seen(state, "core")[6 + 2 * place] for place in (3,)), abs=1e-4)
    # Never behind the middle.
    state.ball[0] = torch.tensor([-30.0, 0.0, 0.0, 0.0])
    put(state, 11, x=-20)
    put(state, 12, x=-20)
    assert seen(state, "core")[20] == 0


def test_a_team_mate_who_meets_the_ball_further_on_moves_the_limit() -> None:
    state = resting(history=PAST_FRAMES)
    state.ball[0] = torch.tensor([0.0, 0.0, 1.0, 0.0])
    put(state, 14, x=4, y=4, body=-90)
    put(state, 3, x=1, y=-9, body=60)
    put(state, 0, x=-30, y=30)
    scene = seen(state, "core")
    mate, opponent, line, limit = (52.5 * scene[place] for place in (8, 10, 20, 21))
    assert line == pytest.approx(opponent, abs=1e-4)
    assert limit == pytest.approx(mate, abs=1e-4)
    assert limit > line + 1
    put(state, 0, x=limit - 0.25)
    assert seen(state, "lines")[1:3] == pytest.approx([max(-2, line - limit + 0.25), 0.25], abs=1e-4)
    assert geometry(state)["line_x"] == pytest.approx(limit, abs=1e-4)


def test_the_nearest_come_first() -> None:
    state = standing()
    put(state, 7, x=10, y=1, vx=0.3, body=-90)
    put(state, 2, x=13, y=-5, vy=-0.2, body=90)
    put(state, 18, x=10, y=-15)
    got = seen(state, "mates")
    first, second, rest = got[:PLAYER], got[PLAYER : 2 * PLAYER], got[2 * PLAYER :]
    assert len(got) == MATES * PLAYER
    # Number 3 is 3 m to the left of one who faces +y, number 8 6 m ahead; the ball is at (9, -3).
    assert first[:9] == pytest.approx([*polar(0, -3), -0.2, 0, 1, 0], abs=1e-5)
    assert first[10] == pytest.approx(math.hypot(4, 2) / 20)
    assert second[:9] == pytest.approx([*polar(6, 0), 0, -0.3, -1, 0], abs=1e-5)
    assert set(rest) == {0}
    got = seen(state, "opponents")
    assert len(got) == NEAREST_OPPONENTS * PLAYER
    assert got[:5] == pytest.approx(polar(-10, 0), abs=1e-5)
    assert seen(state, "rivals") == got[:PLAYER] + [0.0] * (RIVALS - 1) * PLAYER
    values = geometry(state)
    mates = [(values[f"mate_{mate}_x"], values[f"mate_{mate}_y"]) for mate in range(MATES)]
    assert mates == [(13, -5), (10, 1)] + [(10, -5)] * (MATES - 2)


def test_a_team_mate_at_the_other_end_of_the_pitch_is_still_there() -> None:
    """Further away than NEVER, which is a time."""
    state = resting(history=PAST_FRAMES)
    put(state, 0, x=52, y=30)
    for mate in range(1, 11):
        put(state, mate, x=-52, y=-3 * mate)
    got = seen(state, "mates")
    assert got[:5] == pytest.approx(polar(-104, -33), abs=1e-4)
    assert got[-PLAYER : -PLAYER + 5] == pytest.approx(polar(-104, -60), abs=1e-4)
    assert geometry(state)["mate_0_x"] == -52


def test_rivals_are_near_the_ball_and_opponents_near_the_actor() -> None:
    state = standing()
    state.ball[0, :2] = torch.tensor([-30.0, 20.0])
    put(state, 12, x=-28, y=20)
    put(state, 20, x=12, y=-5)
    assert seen(state, "rivals")[:5] == pytest.approx(polar(25, 38), abs=1e-5)
    assert seen(state, "opponents")[:5] == pytest.approx(polar(0, -2), abs=1e-5)


def test_geometry() -> None:
    state = standing()
    state.types[0, 0, TYPE_FIELD["inertia_moment"]] = 6
    state.types[0, 0, TYPE_FIELD["player_decay"]] = 0.5
    put(state, 0, effort=0.9, recovery=0.8)
    state.ball[0] = torch.tensor([10.0, -4.0, 0.2, 0.4])
    speed = math.hypot(0.1, 0.4)
    got = geometry(state)
    expected = {
        "x": 10, "y": -5, "coast_x": 10.2, "coast_y": -4.2, "cos": 0, "sin": 1, "forward": 0.4, "aside": -0.1,
        "turn_factor": 1 + 6 * speed, "decay": 0.5, "dash_gain": 0.0054, "income": 36, "near_m": 1,
        "ball_x": 10, "ball_y": -4, "ball_vx": 0.2, "ball_vy": 0.4,
        "kick_gain": 0.027 * (1 - 0.25 * 0.615 / 0.7),
        # The ball is then at (10.2, -3.6), he at (10.1, -4.6): 0.1 to the left. He has it now, so meets it now.
        "turn_to_ball": math.atan2(-0.1, 1.0), "turn_to_meet": 0,
    }  # fmt: skip
    assert {name: got[name] for name in expected} == pytest.approx(expected, abs=1e-5)
    state.ball[0] = torch.tensor([-30.0, -5.0, 0.0, 0.0])
    assert geometry(state)["near_m"] == pytest.approx(4)


def test_turn_to_meet_is_seen_from_where_he_rolls_out_to() -> None:
    state = resting(history=PAST_FRAMES)
    put(state, 0, x=0, y=0, vy=0.3)
    state.ball[0, :2] = torch.tensor([10.0, 0.0])
    steps = seen(state, "core")[14] * 20
    rolled = 0.3 * (1 - 0.4**steps) / 0.6
    assert geometry(state)["turn_to_meet"] == pytest.approx(math.atan2(-rolled, 10), abs=1e-6)


def test_past() -> None:
    state = resting(history=PAST_FRAMES)
    put(state, 0, x=10, y=-5, body=90, stamina=7000)
    state.ball[0] = torch.tensor([0.0, 0.0, 0.0, 0.0])
    then = state.past_players[0, 1, 0]
    for name, value in (("x", 9.0), ("y", -7.0), ("vx", 0.1), ("vy", 0.4), ("body", 60.0), ("stamina", 7050.0)):
        then[CHANNEL[name]] = value
    then[CHANNEL["last_command"]] = int(CommandKind.DASH)
    state.past_ball[0, 1] = torch.tensor([10.0, 5.0, 0.5, 0.25])
    got = torch.tensor(seen(state, "past")).view(PAST_FRAMES, -1)
    assert (got == 0).all()
    state.past_known[0, 1] = True
    got = torch.tensor(seen(state, "past")).view(PAST_FRAMES, -1)
    assert (got[[0, 2]] == 0).all()
    # Two frames back he was 2 m behind and 1 m to the right; the ball then 10 m before where he is now.
    expected = [-2, 1, 0.4, -0.1, 0.5, 0, 0.25, -0.5, math.cos(math.pi / 6), 0.5, -0.5]
    expected += [0, 1, 0, 0, 0, 0, 0, 0, 0, 1]
    assert got[1].tolist() == pytest.approx(expected, abs=1e-5)


def test_a_past_that_is_not_there_is_told() -> None:
    with pytest.raises(ValueError, match=r"expected a state with 3 frames before it, got 1; ask for them: .*history="):
        whole().project(situations(2, history=1))
    more = whole().project(situations(2, history=PAST_FRAMES + 2))
    assert torch.equal(more, whole().project(situations(2, history=PAST_FRAMES)))


# What the inputs do not hang on.


def reordered(state: State, order: Tensor) -> State:
    """The same with the players in another order; the actor wherever he then is."""
    place = torch.argsort(order)
    return state._replace(
        players=state.players[:, order],
        types=state.types[:, order],
        past_players=state.past_players[:, :, order],
        actor=place[state.actor],
    )


def test_players_are_known_by_no_number_but_by_role() -> None:
    """However each team is numbered, all but ``role`` is the same bit for bit."""
    state = situations(300, history=PAST_FRAMES)
    before = whole().project(state)
    generator = torch.Generator().manual_seed(0)
    for _ in range(3):
        order = torch.cat([torch.randperm(11, generator=generator), 11 + torch.randperm(11, generator=generator)])
        after = whole().project(reordered(state, order))
        for name in PARTS:
            assert torch.equal(part(before, name), part(after, name)) == (name != "role"), name


def moved(state: State, *, degrees: float, by: tuple[float, float]) -> State:
    """All of it turned about the centre, then shifted."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = torch.tensor([[cos, sin], [-sin, cos]], dtype=state.ball.dtype)
    state = copied(state)
    for balls in (state.ball, state.past_ball):
        balls[..., :2] = balls[..., :2] @ turn + torch.tensor(by)
        balls[..., 2:] = balls[..., 2:] @ turn
    for players in (state.players, state.past_players):
        for pair, shift in ((("x", "y"), by), (("vx", "vy"), (0.0, 0.0))):
            places = [CHANNEL[name] for name in pair]
            players[..., places] = players[..., places] @ turn + torch.tensor(shift)
        body = players[..., CHANNEL["body"]] + degrees
        players[..., CHANNEL["body"]] = torch.remainder(body + 180, 360) - 180
    return state


@pytest.mark.parametrize(("degrees", "by"), [(0, (3.0, -7.0)), (90, (0.0, 0.0)), (-137, (5.5, 2.25))])
def test_what_is_relative_does_not_see_where_on_the_pitch(degrees: float, by: tuple[float, float]) -> None:
    state = situations(200, history=PAST_FRAMES, dtype=torch.float64)
    before, after = (whole().project(each) for each in (state, moved(state, degrees=degrees, by=by)))
    for name in ("role", "type", "last", "view", "ball", "reach", "mates", "opponents", "rivals", "past", "age"):
        # A place on the pitch has single precision, some micrometres; a direction to the ball makes degrees of them.
        assert torch.allclose(part(before, name), part(after, name), atol=1e-4), name
    # Of himself all but the two of the body direction.
    assert torch.allclose(part(before, "self")[:, 2:], part(after, "self")[:, 2:], atol=1e-6)
    for name in ("turn_factor", "decay", "dash_gain", "income", "near_m", "kick_gain", "forward", "aside"):
        place = len(whole().names) - len(GEOMETRY) + GEOMETRY.index(name)
        assert torch.allclose(before[:, place], after[:, place], atol=1e-5), name
    for name in ("core", "lines"):
        assert not torch.allclose(part(before, name), part(after, name), atol=1e-3)


def test_left_and_right_are_alike() -> None:
    """Of a situation mirrored about the long axis every column is the same, or has the other sign, in all rows."""
    state = situations(300, history=PAST_FRAMES, dtype=torch.float64)
    mirrored = copied(state)
    for balls in (mirrored.ball, mirrored.past_ball):
        balls[..., [1, 3]] *= -1
    for players in (mirrored.players, mirrored.past_players):
        players[..., [CHANNEL[name] for name in ("y", "vy", "body", "neck")]] *= -1
    before, after = whole().project(state), whole().project(mirrored)
    same = torch.isclose(before, after, atol=1e-9).all(0)
    flipped = torch.isclose(before, -after, atol=1e-9).all(0)
    assert [name for name, good in zip(whole().names, same | flipped, strict=True) if not good] == []
    sides = {name for name, is_flipped in zip(whole().names, flipped & ~same, strict=True) if is_flipped}
    assert {"y", "sin", "aside", "turn_to_ball", "turn_to_meet", "mate_3_y", "self_1", "self_4", "ball_1"} <= sides
    assert not {"x", "cos", "forward", "line_x", "power", "mate_3_x", "self_0", "self_3", "ball_0"} & sides
    # Of columns that are zero, such as those of turns in a past without any, both hold.
    assert torch.where(whole().signs < 0, flipped, same).all()


def test_signs_of_blocks_hang_on_nothing_else() -> None:
    """Neither on what other blocks there are nor on what was drawn before."""
    signs = dict(zip(whole().names, whole().signs.tolist(), strict=True))
    for seed, blocks in enumerate((("self",), ("view", "past"), ("opponents", "rivals", "mates"))):
        torch.manual_seed(seed)
        some = EgocentricFeatures(blocks)
        assert dict(zip(some.names, some.signs.tolist(), strict=True)) == {name: signs[name] for name in some.names}


def test_normalised_inputs_are_mirrored_by_their_signs() -> None:
    """Also where the samples lean to one side, and where inputs are limited."""
    features = EgocentricFeatures(("self", "ball", "mates"))
    state = situations(60)
    features.fit([features.project(state)[:20]])
    features.normalisation.std[: features.n_inputs] *= 0.1
    mirrored = features(mirror_state(state, torch.arange(22)))
    torch.testing.assert_close(mirrored, features(state) * features.signs, atol=1e-3, rtol=1e-3)


def test_channels_are_those_that_the_blocks_look_at() -> None:
    for blocks in ((), ("self", "mates", "past"), ("view",), ("age",)):
        features = EgocentricFeatures(blocks)
        state = situations(5, history=features.history)
        before = features.project(state)
        unread = [CHANNEL[name] for name in CHANNEL if name not in features.channels]
        for players in (state.players, state.past_players):
            players[..., unread] = math.nan
        assert torch.equal(features.project(state), before)
        assert ("neck" in features.channels) == ("view_width" in features.channels) == ("view" in blocks)
        assert ("age" in features.channels) == ("age" in blocks)


MEETING = {"core", "reach", "geometry", "lines", "mates", "opponents", "rivals"}
"""Blocks that hang on times to the ball, which hang on where everybody is."""
NEAREST = MEETING | {"age"}
"""Blocks that hang on who is the nearest, too."""


def of_server(state: State, name: str) -> Tensor:
    """(frames,) a parameter of the server, to change in place."""
    return state.server[:, SERVER_FIELD[name]]


def renumbered(state: State, one: int, other: int) -> None:
    """Exchange two team mates in all that is known of players; the actor ``one`` is then ``other``."""
    for players in (state.players, state.types, state.past_players.transpose(1, 2)):
        players[:, [one, other]] = players[:, [other, one]]
    state.actor[state.actor == one] = other


@pytest.mark.parametrize(
    ("what", "change", "must", "may"),
    [
        ("neck", lambda s: s.players[:, 2, CHANNEL["neck"]].add_(9), {"view"}, set()),
        ("view width", lambda s: s.players[:, 2, CHANNEL["view_width"]].fill_(111), {"view"}, set()),
        ("capacity", lambda s: s.players[:, 2, CHANNEL["capacity"]].add_(999), {"self"}, set()),
        ("stamina", lambda s: s.players[:, 2, CHANNEL["stamina"]].add_(50), {"self", "past"}, set()),
        ("effort", lambda s: s.players[:, 2, CHANNEL["effort"]].sub_(0.1), {"self", "geometry"}, set()),
        ("recovery", lambda s: s.players[:, 2, CHANNEL["recovery"]].sub_(0.1), {"self", "geometry"}, set()),
        ("own command", lambda s: s.players[:, 2, CHANNEL["last_command"]].fill_(CommandKind.MOVE), {"last"}, set()),
        ("charged", lambda s: s.players[:, 2, CHANNEL["flags"]].add_(FLAG_CHARGED), {"self"}, set()),
        ("card", lambda s: s.players[:, 2, CHANNEL["flags"]].add_(FLAG_YELLOW), set(), set()),
        ("kick rand", lambda s: s.types[:, 2, TYPE_FIELD["kick_rand"]].add_(0.1), {"type"}, set()),
        ("extra stamina", lambda s: s.types[:, 2, TYPE_FIELD["extra_stamina"]].add_(5), {"type"}, set()),
        ("income", lambda s: s.types[:, 2, TYPE_FIELD["stamina_inc_max"]].add_(5), {"type", "geometry"}, set()),
        ("kick power", lambda s: s.types[:, 2, TYPE_FIELD["kick_power_rate"]].add_(0.01), {"geometry"}, set()),
        ("others' neck", lambda s: s.players[:, 3:, CHANNEL["neck"]].add_(9), set(), set()),
        ("others' stamina", lambda s: s.players[:, 3:, CHANNEL["stamina"]].sub_(9), set(), set()),
        ("a mate's kick", lambda s: s.players[:, 5, CHANNEL["last_command"]].fill_(CommandKind.KICK), {"last"}, set()),
        ("a mate's body", lambda s: s.players[:, 5, CHANNEL["body"]].add_(31), {"mates"}, MEETING),
        ("mates' place", lambda s: s.players[:, 3:11, CHANNEL["x"]].add_(0.5), {"mates", "geometry"}, NEAREST),
        ("opponents' body", lambda s: s.players[:, 11:, CHANNEL["body"]].add_(31), {"opponents", "rivals"}, MEETING),
        ("opponents' place", lambda s: s.players[:, 11:, CHANNEL["y"]].add_(0.5), {"opponents", "rivals"}, NEAREST),
        ("ball", lambda s: s.ball[:, 0].add_(0.5), {"ball"} | MEETING, set()),
        ("ball's age", lambda s: s.players[:, 2, CHANNEL["age"]].add_(3), {"age"}, set()),
        ("a mate's age", lambda s: s.players[:, 5, CHANNEL["age"]].add_(3), {"age"}, set()),
        ("an opponent's age", lambda s: s.players[:, 15, CHANNEL["age"]].add_(3), {"age"}, set()),
        ("past ball", lambda s: s.past_ball[:, 2].add_(0.5), {"past"}, set()),
        ("own past", lambda s: s.past_players[:, 1, 2, CHANNEL["vx"]].add_(0.1), {"past"}, set()),
        ("play mode", lambda s: s.mode.fill_(PlayMode.KICK_IN_R), {"mode"}, set()),
        ("its cycles", lambda s: s.mode_cycles.add_(3), {"mode"}, set()),
        ("goalkeeper", lambda s: s.players[:, 2, CHANNEL["flags"]].add_(FLAG_GOALIE), {"mode"}, set()),
        ("others' past", lambda s: s.past_players[:, :, 3:, CHANNEL["x"]].add_(0.5), set(), set()),
        ("actor", lambda s: s.actor.fill_(3), {*PARTS} - {"mode"}, set()),
        ("unum", lambda s: renumbered(s, 2, 3), {"role"}, set()),
        ("ball size", lambda s: of_server(s, "ball_size").mul_(0.97), {"ball", "reach", "geometry"}, MEETING),
        ("ball decay", lambda s: of_server(s, "ball_decay").mul_(0.97), MEETING, set()),
        ("ball speed", lambda s: of_server(s, "ball_speed_max").mul_(0.97), {"geometry"}, set()),
        ("most stamina", lambda s: of_server(s, "stamina_max").mul_(0.97), {"self"}, set()),
        ("most capacity", lambda s: of_server(s, "stamina_capacity").mul_(0.97), {"self"}, set()),
        ("effort rises", lambda s: of_server(s, "effort_inc_thr").mul_(0.97), {"self"}, set()),
        ("stamina tires", lambda s: of_server(s, "recover_dec_thr").fill_(4900 / 8000), {"self"}, set()),
        ("tackle", lambda s: of_server(s, "tackle_dist").mul_(0.97), {"ball"}, set()),
        ("tackle back", lambda s: of_server(s, "tackle_back_dist").add_(0.5), {"ball"}, set()),
        ("tackle width", lambda s: of_server(s, "tackle_width").mul_(0.97), {"ball"}, set()),
        ("player noise", lambda s: of_server(s, "player_rand").mul_(0.97), set(), set()),
        ("half time", lambda s: of_server(s, "half_time").mul_(0.97), set(), set()),
    ],
)  # fmt: skip
def test_each_value_moves_its_own_blocks_only(
    what: str, change: Callable[[State], object], must: set[str], may: set[str]
) -> None:
    state = situations(100, history=PAST_FRAMES)
    state.actor[:] = 2
    state.players[:, 2, CHANNEL["stamina"]] = 4900
    state.players[:, [2, 5], CHANNEL["last_command"]] = int(CommandKind.DASH)
    changed = copied(state)
    change(changed)
    before, after = whole().project(state), whole().project(changed)
    different = {name for name in PARTS if not torch.equal(part(before, name), part(after, name))}
    assert different >= must, what
    assert different <= must | may, what


def test_ages_are_those_of_the_ball_of_the_nearest_and_of_all() -> None:
    state = standing()
    state.players[0, :, CHANNEL["flags"]] = FLAG_ON_FIELD
    state.players[0, 11:, CHANNEL["flags"]] = 0
    state.players[0, 1:11, CHANNEL["x"]] = torch.arange(10.0)  # number 11 is the nearest
    state.players[0, :11, CHANNEL["age"]] = torch.arange(11.0)
    state.players[0, 0, CHANNEL["age"]] = 7.0  # of the ball
    seen = part(whole().project(state), "age")[0].expm1()
    assert seen[:5].tolist() == pytest.approx([7.0, 10.0, 9.0, 8.0, 7.0], rel=1e-5)
    assert float(seen[5].log1p()) == pytest.approx(float(torch.arange(1.0, 11.0).log1p().mean()), rel=1e-5)
    assert seen[6:].tolist() == [0.0] * 7


def test_one_who_tackles_does_not_hold_the_ball() -> None:
    state = standing()
    put(state, 13, x=9, y=-3.5)
    # Half a metre from the ball, a reach of 1.085, doubt of 2 % of the ways: 1.8 m to him, 2.2 m to the ball.
    doubt = 0.02 * (math.hypot(1, 1.5) + math.hypot(1, 2))
    assert seen(state, "reach")[5:9] == pytest.approx([0, 0, 1, 0.5 - 1.085 - doubt], abs=1e-5)
    # The ball is taken to stay with him.
    assert seen(state, "core")[6:8] == pytest.approx([9 / 52.5, -3 / 34], abs=1e-5)
    state.players[0, 13, CHANNEL["flags"]] = FLAG_ON_FIELD | FLAG_TACKLING
    assert seen(state, "reach")[5:9] == [0, 0, 0, 1]
    put(state, 6, x=9, y=-3.5)
    assert seen(state, "reach")[6] == 1


# Strange situations.


def everybody_in_one_place(state: State) -> None:
    state.players[..., [CHANNEL["x"], CHANNEL["y"]]] = 0
    state.ball[:] = 0


def nobody_there(state: State) -> None:
    state.players[..., CHANNEL["flags"]] = 0


def exhausted(state: State) -> None:
    for name, value in (("stamina", 0.0), ("capacity", 0.0), ("effort", 0.4), ("recovery", 0.5)):
        state.players[..., CHANNEL[name]] = value


def far_out(state: State) -> None:
    state.ball[:] = torch.tensor([57.5, 39.0, 3.0, 3.0])
    state.players[..., CHANNEL["x"]], state.players[..., CHANNEL["y"]] = -57.5, -39.0


def lacking(state: State) -> None:
    """Logs of old servers know no last command; the channel is then read as none."""
    state.players[..., CHANNEL["last_command"]] = math.nan


def alone(state: State) -> None:
    flags = torch.zeros_like(state.players[..., 0])
    state.players[..., CHANNEL["flags"]] = flags.scatter(1, state.actor[:, None], float(FLAG_ON_FIELD))


@pytest.mark.parametrize(
    "strange", [everybody_in_one_place, nobody_there, exhausted, far_out, lacking, alone], ids=lambda f: f.__name__
)
def test_inputs_are_numbers_in_strange_situations(strange: Callable[[State], None]) -> None:
    state = situations(30, history=PAST_FRAMES)
    strange(state)
    assert whole().project(state).isfinite().all()


def test_those_off_the_field_are_seen_nowhere() -> None:
    """Whatever stands in their place."""
    state = situations(50, history=PAST_FRAMES)
    gone = torch.tensor([1, 4, 9, 12, 17, 21])
    state.actor[:] = 2
    state.players[:, gone, CHANNEL["flags"]] = 0
    state.players[:, gone, CHANNEL["last_command"]] = 0
    other = copied(state)
    other.players[:, gone, : CHANNEL["flags"]] = 3.0
    assert torch.equal(whole().project(state), whole().project(other))
