"""Cleaning and binding on a match made by hand: every expected value is arithmetic."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from teamclone.dataset import layout
from teamclone.dataset.clean import Commands, TurnZero, clean_match
from teamclone.logs import read_match
from teamclone.logs.align import executed_kind, first_body_commands, slot_of
from teamclone.logs.columns import COMMANDS, FRAMES, PLAYERS
from teamclone.logs.match import Columns, empty_columns
from teamclone.rcss import state_bits
from teamclone.rcss.commands import CLONED, REPERTOIRE, CommandKind
from teamclone.rcss.playmodes import SITUATION, PlayMode, Situation
from teamclone.world import channels


def made_match(n_frames: int = 6) -> tuple[Columns, Columns]:
    """Frames of play_on, both teams complete with goalkeepers 1, all counters 0."""
    frames = empty_columns(FRAMES, n_frames)
    frames["cycle"][:] = np.arange(1, n_frames + 1)
    frames["playmode"][:] = PlayMode.PLAY_ON
    for name in ("ball_x", "ball_y", "ball_vx", "ball_vy"):
        frames[name][:] = 1.5
    players = empty_columns(PLAYERS, n_frames, 22)
    for name, values in players.items():
        values[:] = 0 if name.startswith("count_") else values
    for name in ("x", "y", "vx", "vy", "body", "neck", "view_width", "stamina", "effort", "recovery", "capacity"):
        players[name][:] = 0
    players["state"][:] = state_bits.STAND
    players["state"][:, [0, 11]] |= state_bits.GOALIE
    return frames, players


def command(frame: int, unum: int, kind: CommandKind, *args: float, side: int = 1, **other: Any) -> dict[str, Any]:
    row = {"frame": frame, "side": side, "unum": unum, "kind": kind, "legs": 0, "valid": True}
    row |= {f"arg{index}": args[index] if index < len(args) else np.nan for index in range(4)}
    return row | other


def table(*rows: dict[str, Any]) -> Columns:
    made = empty_columns(COMMANDS, len(rows))
    for index, row in enumerate(rows):
        for name, value in row.items():
            made[name][index] = value
    return made


def execute(players: Columns, frame: int, slot: int, kind: CommandKind) -> None:
    """The server executed a command of this kind on ``frame``: the counter is higher from the next frame on."""
    players[f"count_{kind.name.lower()}"][frame + 1 :, slot] += 1


def rules(result: Any) -> dict[str, int]:
    return {rule.name: rule.before - rule.after for rule in result.rules}


def test_a_command_is_bound_to_its_own_frame_and_its_arguments_are_kept() -> None:
    frames, players = made_match()
    execute(players, 2, 6, CommandKind.KICK)
    result = clean_match(frames, players, table(command(2, 7, CommandKind.KICK, 61.5, -20.25)), {}, side=1)
    assert result.frames["cycle"].tolist() == [3]
    assert result.samples["frame"].tolist() == [0]
    assert result.samples["player"].tolist() == [6]
    assert result.samples["kind"].tolist() == [2]
    assert result.samples["parameters"].tolist() == [[61.5, -20.25]]
    assert result.samples["executed"].all()


def test_each_rule_drops_what_it_names() -> None:
    frames, players = made_match()
    frames["playmode"][4] = PlayMode.KICK_IN_L
    for frame, slot in ((0, 1), (1, 1), (1, 0)):
        execute(players, frame, slot, CommandKind.DASH)
    result = clean_match(
        frames,
        players,
        table(
            command(0, 2, CommandKind.DASH, 100.0, 0.0),
            command(0, 2, CommandKind.TURN, 30.0),  # second of the cycle
            command(0, 2, CommandKind.TURN_NECK, 30.0),  # no body command
            command(0, 3, CommandKind.DASH, 100.0, 0.0, side=-1),  # the other team
            command(0, 0, CommandKind.SAY),  # the coach
            command(1, 2, CommandKind.DASH, np.nan, valid=False),  # NaN
            command(1, 2, CommandKind.DASH, 50.0, 0.0),  # the first valid one counts
            command(1, 1, CommandKind.DASH, 50.0, 0.0),  # the goalkeeper
            command(1, 4, CommandKind.TURN, 10.0),  # refused: no counter rose
            command(4, 2, CommandKind.DASH, 50.0, 0.0),  # kick-in
            command(-1, 2, CommandKind.DASH, 50.0, 0.0),  # before kick-off
            command(5, 2, CommandKind.DASH, 50.0, 0.0),  # the last frame has no successor
        ),
        {},
        side=1,
    )
    assert result.samples["parameters"].tolist() == [[100.0, 0.0], [50.0, 0.0]]
    assert rules(result) == {
        "sent by a player of the team": 2,
        "body commands": 1,
        "parsed by the server (no NaN)": 1,
        "bound to a frame that has a successor": 2,
        "in play_on": 1,
        "of field players": 1,
        "first of the cycle": 1,
        "dash, turn, kick or tackle": 0,
        "executed by the server": 1,
    }


def test_the_goalkeepers_commands_may_be_kept() -> None:
    frames, players = made_match()
    for slot in (0, 1):
        execute(players, 1, slot, CommandKind.DASH)
    commands = table(
        command(1, 1, CommandKind.DASH, 30.0, 0.0),
        command(1, 2, CommandKind.DASH, 70.0, 0.0),
        command(2, 1, CommandKind.CATCH, 10.0),  # is no clone's command
    )
    field = clean_match(frames, players, commands, {}, side=1)
    both = clean_match(frames, players, commands, {}, side=1, goalkeepers=True)
    assert field.samples["player"].tolist() == [1]
    assert both.samples["player"].tolist() == [0, 1]
    assert both.samples["parameters"].tolist() == [[30.0, 0.0], [70.0, 0.0]]
    assert rules(both)["of field players"] == 0
    # Cycles without a command are those of field players, as ever.
    assert (both.player_cycles, both.idle, both.frozen) == (field.player_cycles, field.idle, field.frozen)


def test_received_commands_stay_with_their_mark() -> None:
    frames, players = made_match()
    execute(players, 1, 1, CommandKind.DASH)
    commands = table(command(1, 2, CommandKind.DASH, 1.0, 0.0), command(1, 3, CommandKind.TURN, 10.0))
    result = clean_match(frames, players, commands, {}, side=1, keep=Commands.RECEIVED)
    assert result.samples["executed"].tolist() == [True, False]


def test_a_move_in_play_leaves_the_slot_to_the_next_command() -> None:
    frames, players = made_match()
    execute(players, 1, 1, CommandKind.DASH)
    commands = table(command(1, 2, CommandKind.MOVE, 0.0, 0.0), command(1, 2, CommandKind.DASH, 70.0, 0.0))
    result = clean_match(frames, players, commands, {}, side=1)
    assert result.samples["parameters"].tolist() == [[70.0, 0.0]]


def test_turn_zero_is_marked_and_can_be_dropped() -> None:
    frames, players = made_match()
    for slot in (1, 2):
        execute(players, 1, slot, CommandKind.TURN)
    commands = table(command(1, 2, CommandKind.TURN, -0.0), command(1, 3, CommandKind.TURN, 0.5))
    kept = clean_match(frames, players, commands, {}, side=1)
    assert kept.samples["turn_zero"].tolist() == [True, False]
    dropped = clean_match(frames, players, commands, {}, side=1, turn_zero=TurnZero.DROP)
    assert dropped.samples["parameters"].tolist() == [[0.5, 0.0]]


@pytest.mark.parametrize(
    ("row", "params", "expected"),
    [
        (command(1, 2, CommandKind.DASH, 150.0, 181.0), {}, [100.0, 180.0]),
        (command(1, 2, CommandKind.DASH, -50.0, 0.0), {"min_dash_power": 0.0}, [0.0, 0.0]),
        (command(1, 2, CommandKind.DASH, 50.0, 44.0), {"dash_angle_step": 45.0}, [50.0, 45.0]),
        (command(1, 2, CommandKind.TURN, -270.0), {}, [-180.0, 0.0]),
        (command(1, 2, CommandKind.KICK, 1e9, -190.0), {}, [100.0, -180.0]),
        (command(1, 2, CommandKind.TACKLE, 200.0), {}, [180.0, 0.0]),
        # Both legs straight: their mean. Opposite legs: nothing is left. One leg: half its power.
        (command(1, 2, CommandKind.DASH, 60.0, 0.0, 100.0, 0.0, legs=3), {}, [80.0, 0.0]),
        (command(1, 2, CommandKind.DASH, 100.0, 0.0, 100.0, 90.0, legs=3), {}, [70.710678, 45.0]),
        (command(1, 2, CommandKind.DASH, 100.0, 30.0, legs=1), {}, [50.0, 30.0]),
        (command(1, 2, CommandKind.DASH, np.nan, np.nan, 40.0, -30.0, legs=2), {}, [20.0, -30.0]),
    ],
)
def test_arguments_are_clipped_as_the_server_clips_them(
    row: dict[str, Any], params: dict[str, float | str], expected: list[float]
) -> None:
    frames, players = made_match()
    execute(players, 1, 1, row["kind"])
    result = clean_match(frames, players, table(row), params, side=1)
    np.testing.assert_allclose(result.samples["parameters"], [expected], rtol=1e-6)


def test_the_right_team_is_turned_to_attack_plus_x_and_comes_first() -> None:
    frames, players = made_match()
    players["x"][:, 11:] = np.arange(11) + 1.0
    players["x"][:, :11] = -20.0
    players["vy"][:, 12] = 0.25
    players["body"][:, 12] = 90.0
    players["neck"][:, 12] = 15.0
    frames["left_score"][:], frames["right_score"][:] = 2, 5
    execute(players, 0, 12, CommandKind.DASH)
    execute(players, 1, 12, CommandKind.TURN)
    result = clean_match(frames, players, table(command(1, 2, CommandKind.TURN, 40.0, side=-1)), {}, side=-1)
    detail, code = (result.frames[name][0] for name in ("measured", "categorical"))
    assert result.samples["player"].tolist() == [1]
    assert result.samples["parameters"].tolist() == [[40.0, 0.0]]
    assert result.frames["position"][0, :11, 0].tolist() == [-1.0 * unum for unum in range(1, 12)]
    assert result.frames["position"][0, 11:, 0].tolist() == [20.0] * 11
    assert result.frames["ball"][0].tolist() == [-1.5] * 4
    assert result.frames["score"][0].tolist() == [5, 2]
    assert detail[1, layout.MEASURED_INDEX["body"]] == -9000
    assert detail[1, layout.MEASURED_INDEX["neck"]] == 1500
    assert detail[1, layout.MEASURED_INDEX["vy"]] == -2500
    assert code[1, layout.CATEGORICAL_INDEX["last_command"]] == CommandKind.DASH
    assert code[0, layout.CATEGORICAL_INDEX["flags"]] == channels.FLAG_ON_FIELD | channels.FLAG_GOALIE


def test_cycles_without_a_command_are_counted() -> None:
    frames, players = made_match(n_frames=3)
    players["state"][:, 5] = 0  # never connected
    players["state"][0, 3] |= state_bits.TACKLE
    execute(players, 0, 1, CommandKind.DASH)
    result = clean_match(frames, players, table(command(0, 2, CommandKind.DASH, 1.0, 0.0)), {}, side=1)
    # Two frames with a successor, ten field players, one of them absent.
    assert (result.player_cycles, result.idle, result.frozen) == (18, 17, 1)


def test_a_missing_value_is_stored_as_missing() -> None:
    frames, players = made_match()
    players["capacity"][:] = np.nan
    execute(players, 1, 1, CommandKind.DASH)
    result = clean_match(frames, players, table(command(1, 2, CommandKind.DASH, 1.0, 0.0)), {}, side=1)
    assert (result.frames["measured"][..., layout.MEASURED_INDEX["capacity"]] == layout.MISSING).all()


def test_set_plays_and_moves_where_they_are_asked_for() -> None:
    frames, players = made_match(8)
    frames["playmode"][:] = [
        PlayMode.KICK_OFF_L,
        PlayMode.PLAY_ON,
        PlayMode.GOAL_R,
        PlayMode.GOAL_R,
        PlayMode.OFFSIDE_L,
        PlayMode.PENALTY_READY_L,
        PlayMode.GOAL_KICK_L,
        PlayMode.TIME_OVER,
    ]
    # The clock stands after the goal: two frames of one cycle.
    frames["cycle"][3:], frames["stoppage"][3] = frames["cycle"][2:-1], 1
    executed = {0: "DASH", 1: "DASH", 2: "MOVE", 3: "TURN", 4: "TURN", 5: "TURN", 6: "TURN"}
    for frame, name in executed.items():
        execute(players, frame, 1, CommandKind[name])
    commands = table(
        command(0, 2, CommandKind.DASH, 60.0, 0.0),
        command(1, 2, CommandKind.MOVE, -9.0, 9.0),  # in play: ignored, leaves the slot
        command(1, 2, CommandKind.DASH, 70.0, 0.0),
        command(2, 2, CommandKind.MOVE, -15.0, 12.5),
        command(2, 2, CommandKind.TURN, 1.0),  # the slot is taken
        command(3, 2, CommandKind.TURN, 20.0),
        command(4, 2, CommandKind.TURN, 30.0),
        command(5, 2, CommandKind.TURN, 40.0),  # a penalty shoot-out
        command(6, 2, CommandKind.MOVE, -9.0, 9.0),  # before a goal kick: ignored, leaves the slot
        command(6, 2, CommandKind.TURN, 50.0),
    )
    in_play = clean_match(frames, players, commands, {}, side=1)
    assert in_play.samples["parameters"].tolist() == [[70.0, 0.0]]
    always = clean_match(frames, players, commands, {}, side=1, repertoire=(*CLONED, "move"))
    assert always.samples["kind"].tolist() == [0, 0, 4, 1, 1, 1]
    assert always.samples["parameters"].tolist() == [[60, 0], [70, 0], [-15, 12.5], [20, 0], [30, 0], [50, 0]]
    assert always.frames["playmode"].tolist() == [*frames["playmode"][:5], PlayMode.GOAL_KICK_L]
    assert always.frames["cycle"].tolist() == [1, 2, 3, 3, 4, 6]
    found = rules(always)
    assert (found["in play_on or around a set play"], found["first of the cycle"]) == (1, 3)
    # Ten field players in the six frames with a successor that are no penalty.
    assert (always.player_cycles, always.idle) == (60, 54)


def test_goalkeepers_catch_where_it_is_asked_for() -> None:
    frames, players = made_match()
    for frame, name in enumerate(("CATCH", "DASH")):
        execute(players, frame, 0, CommandKind[name])
    commands = table(command(0, 1, CommandKind.CATCH, 133.0), command(1, 1, CommandKind.DASH, 5.0, 0.0))
    params: dict[str, float | str] = {"min_catch_angle": -90.0, "max_catch_angle": 90.0}
    result = clean_match(frames, players, commands, params, side=1, repertoire=(*CLONED, "catch"))
    assert result.samples["kind"].tolist() == [4, 0]
    assert result.samples["parameters"].tolist() == [[90.0, 0.0], [5.0, 0.0]]
    assert "of field players" not in rules(result)
    assert result.player_cycles == 5 * 11


def test_places_of_a_move_are_the_movers_whichever_side_he_is_on() -> None:
    for side, slot in ((1, 4), (-1, 15)):
        frames, players = made_match()
        frames["playmode"][:] = PlayMode.GOAL_L
        execute(players, 0, slot, CommandKind.MOVE)
        players["x"][1:, slot], players["y"][1:, slot] = side * -20.0, side * 7.0  # as the server puts him
        commands = table(
            command(0, 5, CommandKind.MOVE, -20.0, 7.0, side=side), command(1, 5, CommandKind.TURN, side=side)
        )
        execute(players, 1, slot, CommandKind.TURN)
        result = clean_match(frames, players, commands, {}, side=side, repertoire=(*CLONED, "move"))
        assert result.samples["parameters"][0].tolist() == [-20.0, 7.0]
        assert result.frames["position"][1, 4].tolist() == [-20.0, 7.0]


def test_a_move_off_the_pitch_ends_where_the_server_clips_it() -> None:
    frames, players = made_match()
    frames["playmode"][:] = PlayMode.GOAL_L
    execute(players, 0, 1, CommandKind.MOVE)
    commands = table(command(0, 2, CommandKind.MOVE, -99.0, 99.0))
    result = clean_match(frames, players, commands, {}, side=1, repertoire=(*CLONED, "move"))
    assert result.samples["parameters"].tolist() == [[-57.5, 39.0]]


def test_cycles_without_a_command_are_samples_where_they_are_asked_for() -> None:
    frames, players = made_match(n_frames=3)
    players["state"][:, 5:11] = 0  # never connected
    players["state"][0, 3] |= state_bits.TACKLE
    execute(players, 0, 1, CommandKind.DASH)
    execute(players, 1, 2, CommandKind.DASH)  # whose command the log lost
    commands = table(
        command(0, 2, CommandKind.DASH, 1.0, 0.0), command(1, 2, CommandKind.TURN, 3.0)
    )  # the last refused
    result = clean_match(frames, players, commands, {}, side=1, repertoire=(*CLONED, "none"))
    by_row = list(zip(*(result.samples[name].tolist() for name in ("frame", "player", "kind")), strict=True))
    # Number 2 dashes and then has a command that was refused; 3 loses one; 4 and 5 give none, as 4 first cannot.
    assert by_row == [(0, 1, 0), (0, 2, 4), (0, 3, 4), (0, 4, 4), (1, 3, 4), (1, 4, 4)]
    assert not result.samples["parameters"][1:].any()
    assert result.samples["executed"].tolist() == [True] + [False] * 5
    assert (result.player_cycles, result.idle, result.frozen) == (8, 6, 1)


def test_without_a_command_log_nobody_is_known_to_do_nothing() -> None:
    frames, players = made_match()
    result = clean_match(frames, players, table(), {}, side=1, repertoire=(*CLONED, "none"))
    assert len(result.samples["kind"]) == len(result.frames["cycle"]) == 0


@pytest.fixture(scope="module")
def real(samples_dir: Any) -> Any:
    return read_match(next(samples_dir.glob("*-HELIOS_base_8-vs-WEBase_0.rcg.xz")))


def _agreement(match: Any, shift: int) -> float:
    """Share of first body commands in play_on whose kind the counters confirm, bound ``shift`` frames off."""
    commands, mode = match.commands, match.frames["playmode"]
    first = first_body_commands(commands, mode)
    frame: NDArray[np.int64] = commands["frame"][first].astype(np.int64) + shift
    slot = slot_of(commands["side"], commands["unum"])[first]
    inside = (frame >= 0) & (frame < len(mode) - 1)
    inside[inside] &= mode[frame[inside]] == PlayMode.PLAY_ON
    executed = executed_kind(match.frames, match.players)[frame[inside], slot[inside]]
    return float((executed == commands["kind"][first][inside]).mean())


def test_binding_agrees_with_the_counters_of_a_real_match_and_only_unshifted(real: Any) -> None:
    assert _agreement(real, 0) > 0.999
    assert _agreement(real, 1) < 0.9
    assert _agreement(real, -1) < 0.9


@pytest.mark.parametrize("side", [1, -1])
def test_a_real_match_beyond_play_on(real: Any, side: int) -> None:
    """Commands are executed also where the clock stands, but those of frozen players; a move leads where it says."""
    match = real.frames, real.players, real.commands, real.game.server_params
    result = clean_match(*match, side=side, keep=Commands.RECEIVED, repertoire=REPERTOIRE)
    kind, frame, player, executed = (result.samples[name] for name in ("kind", "frame", "player", "executed"))
    given = kind != REPERTOIRE.index("none")
    flags = result.frames["categorical"][frame, player, layout.CATEGORICAL_INDEX["flags"]]
    free = (flags & (channels.FLAG_TACKLING | channels.FLAG_CHARGED)) == 0
    play_on = result.frames["playmode"][frame] == PlayMode.PLAY_ON
    assert executed[given & free & ~play_on].all()
    assert executed[given & free].mean() > 0.9995
    stands = np.isin(SITUATION[result.frames["playmode"][frame]], [Situation.GOAL, Situation.FAULT])
    assert (given & free & stands).sum() > 1000
    moves = np.flatnonzero(kind == REPERTOIRE.index("move"))
    assert len(moves) > 20
    # Collisions push players apart by centimetres.
    after = result.frames["position"][frame[moves] + 1, player[moves]]
    assert np.abs(after - result.samples["parameters"][moves]).max() < 0.5
    # One of the two teams sends nothing where it has nothing to do, the other (turn 0).
    assert (~given).sum() == result.idle
    assert (result.idle > 1000) == (side < 0)


def test_a_real_match_keeps_the_world_through_the_dataset(real: Any) -> None:
    """What is stored of a frame is the log's frame, to the channels' resolution."""
    for side in (1, -1):
        result = clean_match(real.frames, real.players, real.commands, real.game.server_params, side=side)
        frame = np.searchsorted(real.frames["cycle"], result.frames["cycle"])
        own = slice(0, 11) if side > 0 else slice(11, 22)
        np.testing.assert_allclose(result.frames["position"][:, :11, 0], side * real.players["x"][frame, own])
        body = result.frames["measured"][:, :11, layout.MEASURED_INDEX["body"]] * 0.01
        difference = body - real.players["body"][frame, own] - (0 if side > 0 else 180)
        assert np.abs((difference + 180) % 360 - 180).max() < 0.0051
        size = sum(values.nbytes for values in (*result.frames.values(), *result.samples.values()))
        # A cycle of play_on; a full match has some 5000.
        assert size / len(frame) < 945
