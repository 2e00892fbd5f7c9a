"""Each fixture folder reads as its README says, and the samples obey the alignment rule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from teamclone.logs import Match, read_match
from teamclone.logs.align import executed_kind, first_body_commands, slot_of
from teamclone.logs.columns import FRAMES, PLAYERS
from teamclone.logs.match import Columns
from teamclone.rcss import pitch, state_bits
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.playmodes import PlayMode

MatchOf = Callable[[str], Match]

FACTS = {
    # folder: log version, left, right, score, first and last cycle, frames, commands
    "v6": ("6", "HELIOS_base", "WEBase", (0, 0), (1, 200), 199, 30511),
    "native-v5": ("5", "HELIOS_base", "WEBase", (0, 0), (1, 100), 99, 19512),
    "native-v4": ("4", "HELIOS_base", "WEBase", (0, 0), (1, 100), 99, 19520),
    "native-v3": ("3", "HELIOS_base", "WEBase", (0, 0), (1, 100), 99, 19510),
    "native-v2": ("2", "HELIOS_base", "WEBase", (0, 0), (1, 100), 129, 22809),
    "native-v1": ("1", "HELIOS_base", "WEBase", (0, 0), (1, 100), 99, 19620),
    "json": ("json-19", "HELIOS_base", "WEBase", (0, 0), (1, 100), 129, 22429),
    "crash": ("6", "HELIOS_base", "CYRUS2024", (0, 0), (1, 200), 199, 17169),
    "nan": ("6", "HELIOS_base", "YuShan2024", (0, 0), (1, 21), 21, 6793),
    "realtime": ("6", "HELIOS_base", "WEBase", (1, 0), (1, 300), 379, 29264),
    "penalties": ("6", "HELIOS_base", "HELIOS_B", (0, 0), (1, 775), 772, 73660),
    "oddname": ("6", "A_1-b_2_11", "WEBase", (0, 0), (1, 100), 99, 19543),
    "goalie3": ("6", "GK_three", "WEBase", (0, 0), (1, 200), 199, 30430),
    "onesided": ("6", "HELIOS_base", None, (0, 0), (1, 100), 99, 6544),
    "killed": ("6", "HELIOS_base", "WEBase", (1, 0), (1, 262), 312, 31409),
}

PLAY_MODES = {
    "v6": ["kick_off_l", "play_on", "free_kick_r", "play_on", "time_over"],
    "native-v2": ["kick_off_l", "play_on", "free_kick_fault_r", "free_kick_l", "play_on", "time_over"],
    "json": ["kick_off_l", "play_on", "foul_charge_l", "free_kick_r", "play_on", "time_over"],
    "onesided": ["kick_off_l", "play_on", "kick_off_r", "time_over"],
    "killed": ["kick_off_l", "play_on", "kick_in_l", "play_on", "goal_l", "kick_off_r", "play_on"],
}

PROBLEMS = {
    "crash": {"disconnected"},
    "nan": {"refused-command"},
    "onesided": {"no-team"},
    "killed": {"truncated", "incomplete"},
}


def on_field(match: Match) -> np.ndarray:
    return (match.players["state"] & state_bits.STAND) != 0


def modes_of(match: Match) -> list[str]:
    mode = match.frames["playmode"]
    first = np.r_[True, mode[1:] != mode[:-1]]
    return [PlayMode(value).name.lower() for value in mode[first]]


@pytest.mark.parametrize("name", FACTS)
def test_what_a_fixture_holds(match_of: MatchOf, name: str):
    match = match_of(name)
    version, left, right, score, cycles, n_frames, n_commands = FACTS[name]
    assert match.game.log_version == version
    assert (match.left.name, match.right.name) == (left, right)
    assert (match.left.score, match.right.score) == score
    cycle = match.frames["cycle"]
    assert (cycle[0], cycle[-1]) == cycles
    assert (len(cycle), len(match.commands["kind"])) == (n_frames, n_commands)
    assert {problem.code for problem in match.problems} == PROBLEMS.get(name, set())
    assert match.game.complete == (name != "killed")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("realtime", "HELIOS_base 1:0 WEBase, 300 cycles"),
        ("onesided", "HELIOS_base 0:0 nobody, 100 cycles"),
    ],
)
def test_a_match_says_what_it_is_in_one_line(match_of: MatchOf, name: str, text: str):
    match = match_of(name)
    assert repr(match) == f"Match({text}, {match.match_id})"
    assert len(repr(match.game)) < 1000
    assert len(repr(match.log)) < 1000


def test_a_match_without_frames_says_so(match_of: MatchOf):
    match = match_of("realtime")
    none = {name: values[:0] for name, values in match.frames.items()}
    empty = replace(match, game=replace(match.game, frames=none))
    assert repr(empty) == f"Match(HELIOS_base 1:0 WEBase, 0 cycles, {match.match_id})"


@pytest.mark.parametrize("name", FACTS)
def test_columns_are_as_documented(match_of: MatchOf, name: str):
    match = match_of(name)
    n_frames = len(match.frames["cycle"])
    for spec, found, shape in ((FRAMES, match.frames, (n_frames,)), (PLAYERS, match.players, (n_frames, 22))):
        assert {column.name: column.dtype for column in spec} == {name: str(v.dtype) for name, v in found.items()}
        assert {values.shape for values in found.values()} == {shape}


@pytest.mark.parametrize("name", FACTS)
def test_everybody_stands_where_the_server_lets_him(match_of: MatchOf, name: str):
    match = match_of(name)
    there = on_field(match)
    assert (np.abs(match.players["x"][there]) <= pitch.MAX_X + 0.01).all()
    assert (np.abs(match.players["y"][there]) <= pitch.MAX_Y + 0.01).all()
    assert (np.abs(match.players["body"]) <= 180.01).all()
    assert (match.frames["ball_x"][0], match.frames["ball_y"][0]) == (0, 0)


@pytest.mark.parametrize("name", PLAY_MODES)
def test_play_modes_in_their_order(match_of: MatchOf, name: str):
    assert modes_of(match_of(name)) == PLAY_MODES[name]


def test_the_clock_stops_after_a_goal(match_of: MatchOf):
    for name in ("realtime", "killed"):
        frames = match_of(name).frames
        goal = frames["playmode"] == PlayMode.GOAL_L
        # The whistle came while the command was processed: the first frame still shows the old mode.
        assert len(set(frames["cycle"][goal])) == 1
        assert frames["stoppage"][goal].tolist() == list(range(51 - goal.sum(), 51))
        assert set(frames["left_score"][: np.flatnonzero(goal)[0]]) == {0}
        assert frames["left_score"][-1] == 1


def test_crash_ends_with_one_team(match_of: MatchOf):
    there = on_field(match_of("crash"))
    assert (there[0].sum(), there[-1].sum()) == (22, 11)
    assert not there[26:, 11:].any()
    (problem,) = match_of("crash").problems
    assert (problem.cycle, "CYRUS2024" in problem.text) == (26, True)


def test_nan_commands_are_refused_with_all_behind_them(match_of: MatchOf):
    match = match_of("nan")
    commands = match.commands
    refused = ~commands["valid"]
    assert refused.sum() == 453
    assert set(commands["side"][refused]) == {-1}
    dash = refused & (commands["kind"] == CommandKind.DASH)
    assert dash.sum() == 105
    assert "453" in str(match.problems[0])
    assert "(dash -nan)" in str(match.problems[0])
    # Nobody of that team ever moved by a dash that was not understood.
    lines = match.log.text.splitlines()
    assert all(b"-nan" in lines[line - 1] for line in commands["line"][dash])


def test_penalties(match_of: MatchOf):
    match = match_of("penalties")
    assert (match.left.penalties_scored, match.left.penalties_missed) == (0, 2)
    assert (match.right.penalties_scored, match.right.penalties_missed) == (1, 1)
    frames = match.frames
    assert frames["right_penalties_scored"].tolist() == [0] * 771 + [1]
    assert frames["left_penalties_missed"][np.searchsorted(frames["cycle"], [352, 353, 641, 642])].tolist() == [
        0,
        1,
        1,
        2,
    ]


def test_goalkeeper_is_known_by_his_flag(match_of: MatchOf):
    goalie = (match_of("goalie3").players["state"] & state_bits.GOALIE) != 0
    assert np.flatnonzero(goalie.all(axis=0)).tolist() == np.flatnonzero(goalie.any(axis=0)).tolist() == [2, 11]


def test_onesided(match_of: MatchOf):
    match = match_of("onesided")
    assert not match.players["state"][:, 11:].any()
    # Where the server puts those who never connect.
    assert match.players["x"][0, 11:].tolist() == [3.0 * unum for unum in range(1, 12)]
    assert set(match.commands["side"]) == {1}


def test_oddname_is_told_from_its_numbers(match_of: MatchOf):
    commands = match_of("oddname").commands
    left = commands["side"] == 1
    assert set(commands["unum"][left]) - {0} == set(range(1, 12))
    assert left.sum() > 5000


def test_killed_keeps_what_was_written(match_of: MatchOf):
    problems = [problem for problem in match_of("killed").problems if problem.code == "truncated"]
    assert {problem.path.name for problem in problems} == {"incomplete.rcg.gz", "incomplete.rcl.gz"}
    assert any(problem.cycle == 263 for problem in problems)


LACKING = {
    "3": {"capacity", "focus_distance", "focus_direction", "attention_side", "attention_unum"}
    | {"pointto_x", "pointto_y", "count_tackle", "count_pointto", "count_attentionto", "count_change_focus"},
    "4": {"capacity", "focus_distance", "focus_direction", "count_change_focus"},
    "5": {"focus_distance", "focus_direction", "count_change_focus"},
    "json": set(),
}
RESOLUTION = {"3": 0.6 / 65536, "4": 0.0, "5": 0.0, "json": 0.0}
"""Half a step of the fixed point numbers; the text numbers are the same characters."""


@pytest.mark.parametrize("version", LACKING)
def test_a_converted_log_gives_the_same_columns(match_of: MatchOf, version: str):
    original, converted = match_of("v6"), match_of(f"converted/{version}")
    assert converted.game.log_version == {"json": "json-19"}.get(version, version)
    assert (converted.left, converted.right, converted.game.complete) == (original.left, original.right, True)
    step = RESOLUTION[version]
    # The converter writes ball_vx a second time in the place of ball_vy in version 3.
    same(original.frames, converted.frames, step=step, leave_out={"ball_vy"} if version == "3" else set())
    same(original.players, converted.players, step=step, leave_out=LACKING[version])
    for name in LACKING[version]:
        values = converted.players[name]
        missing = -1 if name.startswith("count_") else 0
        assert np.isnan(values).all() if values.dtype.kind == "f" else (values == missing).all()


def same(original: Columns, converted: Columns, *, step: float, leave_out: set[str]) -> None:
    for name in original.keys() - leave_out:
        # Version 3 holds directions in radians.
        tolerance = np.degrees(step) if name in {"body", "neck", "view_width"} else step
        np.testing.assert_allclose(converted[name], original[name], rtol=0, atol=tolerance, err_msg=name)


@pytest.mark.parametrize("version", LACKING)
def test_a_converted_log_gives_the_same_parameters(match_of: MatchOf, version: str):
    original, converted = match_of("v6").game, match_of(f"converted/{version}").game
    # The converter cuts the last digit of a type, and leaves out of version 3 what is younger.
    young = {"kick_power_rate", "foul_detect_probability", "catchable_area_l_stretch"} if version == "3" else set()
    for name in original.player_types.keys() - young:
        np.testing.assert_allclose(converted.player_types[name], original.player_types[name], atol=2e-5, err_msg=name)
    for ours, theirs in (
        (original.server_params, converted.server_params),
        (original.player_params, converted.player_params),
    ):
        assert len(theirs) >= (20 if version == "3" else len(ours))
        for name, value in theirs.items():
            assert value == (pytest.approx(ours[name], abs=2e-5) if isinstance(value, float) else ours[name]), name


def test_converted_version_3_says_which_parameters_it_does_not_know(match_of: MatchOf):
    match = match_of("converted/3")
    assert "unset-parameters" in {problem.code for problem in match.problems}
    assert set(match.game.player_types["kick_power_rate"]) == {0.027}


def executed_share(match: Match) -> tuple[float, int]:
    """How often the counters name the first body command that was received, over play_on; and of how many."""
    frames, commands = match.frames, match.commands
    index = first_body_commands(commands, frames["playmode"])
    frame, slot = commands["frame"][index], slot_of(commands["side"][index], commands["unum"][index])
    # At half time the next frame also shows what was commanded without a frame.
    followed = np.append(np.diff(frames["cycle"]) <= 1, False)
    use = (frames["playmode"][frame] == PlayMode.PLAY_ON) & followed[frame]
    same = executed_kind(match.frames, match.players)[frame, slot] == commands["kind"][index]
    return float(same[use].mean()), int(use.sum())


@pytest.mark.parametrize(
    ("name", "least"), [("v6", 1.0), ("native-v3", 0.999), ("native-v4", 0.999), ("json", 0.995), ("realtime", 0.995)]
)
def test_fixtures_obey_the_alignment_rule(match_of: MatchOf, name: str, least: float):
    share, n = executed_share(match_of(name))
    assert share >= least
    assert n > 1000


@pytest.mark.parametrize("index", range(6))
def test_samples_obey_the_alignment_rule(samples_dir: Path, index: int):
    path = sorted(samples_dir.glob("*.rcg.xz"))[index]
    match = read_match(path)
    share, n = executed_share(match)
    assert share >= 0.995
    assert n > 30_000
    assert not match.problems
    # The file name carries teams and score.
    expected = path.name.split("-", 1)[1].removesuffix(".rcg.xz")
    assert f"{match.left.name}_{match.left.score}-vs-{match.right.name}_{match.right.score}" == expected
