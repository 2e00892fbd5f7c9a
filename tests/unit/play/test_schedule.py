"""From a schedule's TOML to matches to play, and every mistake in it at once."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from teamclone.errors import UsageError
from teamclone.play.schedule import (
    Fixture,
    Limits,
    ServerSpec,
    TeamSpec,
    filled_in,
    load_schedule,
    option_words,
    quick_schedule,
    schedule_from,
)

TEAMS = {
    "Red": {"command": "red --port {port}"},
    "Blue": {"player": "p {unum} {port}", "goalie": "g {port}", "coach": "c {olcoach_port}"},
    "Old": {"start": "./start"},
}


def fixtures_of(folder: Path, *pairings: dict[str, Any], **sections: Any) -> tuple[Fixture, ...]:
    table = {"teams": TEAMS, "pairings": list(pairings), **sections}
    return schedule_from(table, where="schedule", base=folder).fixtures


def test_every_left_team_meets_every_right_one_and_numbers_go_on(tmp_path: Path) -> None:
    made = fixtures_of(
        tmp_path,
        {"left": ["Red", "Blue"], "right": "Old", "matches": 2},
        {"left": "Red", "right": "Blue", "swap": True},
        {"left": "Red", "right": "Old"},
    )
    assert [fixture.id for fixture in made] == [
        "Red-vs-Old-1",
        "Red-vs-Old-2",
        "Blue-vs-Old-1",
        "Blue-vs-Old-2",
        "Red-vs-Blue-1",
        "Blue-vs-Red-1",
        "Red-vs-Old-3",
    ]
    assert [fixture.seed for fixture in made] == [0, 1, 0, 1, 0, 0, 2]


def test_a_pairing_that_is_added_leaves_the_other_matches_as_they_were(tmp_path: Path) -> None:
    one = fixtures_of(tmp_path, {"left": "Red", "right": "Blue"})
    more = fixtures_of(tmp_path, {"left": "Old", "right": "Blue"}, {"left": "Red", "right": "Blue", "matches": 2})
    assert one[0] == more[1]


def test_the_paper_s_options_are_the_default_and_may_be_changed(tmp_path: Path) -> None:
    [fixture] = fixtures_of(
        tmp_path, {"left": "Red", "right": "Blue"}, server={"options": {"half_time": 5, "synch_mode": False}}
    )
    words = list(option_words(fixture.server.options))
    assert "server::fullstate_l=on" in words
    assert "server::fullstate_r=on" in words
    assert "server::synch_mode=off" in words
    assert "server::half_time=5" in words
    assert fixture.server.most_cycles == 100
    assert not fixture.server.synch


def test_a_team_is_started_as_its_kind_says(tmp_path: Path) -> None:
    [fixture] = fixtures_of(tmp_path, {"left": "Blue", "right": "Old"})
    blue, old = fixture.left.clients(), fixture.right.clients()
    assert [label for label, _ in blue] == ["goalie", *(f"player-{unum}" for unum in range(2, 12)), "coach"]
    assert blue[0][1] == ["g", "{port}"]
    assert blue[4][1] == ["p", "5", "{port}"]
    assert old[0][1] == ["./start", "{host}", "{folder}", "1"]
    assert old[-1] == ("coach", ["./start", "{host}", "{folder}", "12"])
    assert fixture.left.takes_port
    assert not fixture.right.takes_port
    assert not fixture.takes_port


def test_placeholders_are_filled_in_and_no_shell_reads_them() -> None:
    assert filled_in(["-h{host}:{port}", "$HOME;{unum}"], {"host": "h", "port": 1, "unum": 2}) == ["-hh:1", "$HOME;2"]


def test_a_fixture_survives_json(tmp_path: Path) -> None:
    [fixture] = fixtures_of(tmp_path, {"left": "Blue", "right": "Red"})
    assert Fixture.from_json(fixture.to_json()) == fixture
    assert Fixture.from_json(fixture.to_json()).fingerprint == fixture.fingerprint


def test_the_fingerprint_tells_what_was_asked_for_but_not_how_long_one_waits(tmp_path: Path) -> None:
    pairing = {"left": "Blue", "right": "Red"}
    [base] = fixtures_of(tmp_path, pairing)
    [patient] = fixtures_of(tmp_path, pairing, limits={"connect_s": 5})
    [other] = fixtures_of(tmp_path, pairing, server={"options": {"half_time": 5}})
    [seeded] = fixtures_of(tmp_path, pairing, play={"seed": 4})
    assert base.fingerprint == patient.fingerprint
    assert len({base.fingerprint, other.fingerprint, seeded.fingerprint}) == 3


def test_every_mistake_is_told_at_once(tmp_path: Path) -> None:
    table = {
        "teams": {
            "Red": {"command": "red", "start": "./start"},
            "Blue": {"player": "p 'x", "coach": "c -p {olcoach-port}", "foldr": "x"},
            "Gray": {"command": "gray {prot}", "folder": "nowhere"},
            "Odd name": {"command": "sh -c 'unfinished"},
        },
        "pairings": [{"left": "Red", "right": "Blu", "matches": 0}, {"left": "Red", "right": "Red"}, {}],
        "server": {"options": {"port": 7000, "half_time": [1]}},
        "limits": {"connect_s": -1, "match_s": "long"},
        "play": {"attempts": 0},
        "severs": {},
    }
    with pytest.raises(UsageError) as caught:
        schedule_from(table, where="my schedule", base=tmp_path)
    text = str(caught.value)
    assert "\n" not in text
    for part in (
        "my schedule: ",
        "no section 'severs'; did you mean server?",
        "teams.Red: needs one of command (the whole team), start (the league's script) and player, got command and",
        "no setting teams.Blue.foldr; did you mean folder?",
        "teams.Blue: player needs goalie",
        "No closing quotation; teams.Blue: coach: no {olcoach-port}; did you mean olcoach_port",
        "teams.Gray: command: no {prot}; did you mean port?",
        f"{tmp_path / 'nowhere'}: no such folder",
        "teams.Odd name: a name is made of",
        "No closing quotation",
        "pairings 1: no team 'Blu'; did you mean Blue?",
        "pairings 1.matches: expected at least 1, got 0",
        "pairings 2: Red against itself",
        "pairings 3: needs left and right",
        "server.options.port: is set by teamclone",
        "server.options.half_time: expected a number, got [1]",
        "limits.connect_s: expected a number above 0, got -1",
        "limits.match_s: expected a number, got 'long'",
        "play.attempts: expected at least 1, got 0",
    ):
        assert part in text, part


def test_folders_are_relative_to_the_schedule(tmp_path: Path) -> None:
    (tmp_path / "red").mkdir()
    path = tmp_path / "schedule.toml"
    path.write_text(
        "[teams.Red]\nfolder = 'red'\ncommand = 'r {port}'\n[teams.Blue]\ncommand = 'b {port}'\n"
        "[[pairings]]\nleft = 'Red'\nright = 'Blue'\n"
    )
    [fixture] = load_schedule(path).fixtures
    assert fixture.left.folder == str(tmp_path / "red")
    assert fixture.right.folder == str(tmp_path)


def test_what_is_not_toml_is_told_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "schedule.toml"
    path.write_text("[teams\n")
    with pytest.raises(UsageError, match=r"schedule\.toml: is not TOML: .*line 1"):
        load_schedule(path)


def test_the_quick_case_takes_commands_and_folders_with_a_start_script(tmp_path: Path) -> None:
    (tmp_path / "league").mkdir()
    (tmp_path / "league" / "start").touch()
    made = quick_schedule("red -p {port}", str(tmp_path / "league"), matches=2, server="srv", options={"half_time": 3})
    assert [fixture.id for fixture in made.fixtures] == ["left-vs-league-1", "left-vs-league-2"]
    assert made.fixtures[0].right.start == "./start"
    assert made.fixtures[0].server.command == "srv"
    assert made.fixtures[0].server.options["server::half_time"] == 3


def test_the_quick_case_tells_two_copies_of_a_team_apart(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name / "team").mkdir(parents=True)
        (tmp_path / name / "team" / "start").touch()
    folders = [str(tmp_path / name / "team") for name in ("a", "b")]
    [fixture] = quick_schedule(*folders, matches=1, server="srv", options={}).fixtures
    assert fixture.id == "team-vs-team-2-1"
    assert fixture.right.folder == folders[1]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"teams": {**TEAMS, "Red": {"command": " "}}}, "teams.Red: needs one of command"),
        ({"teams": {**TEAMS, "Red": {"command": "r\0"}}}, "teams.Red: commands and variables cannot hold a NUL byte"),
        (
            {"teams": {**TEAMS, "Red": {"command": "r", "folder": "~nobody-of-this-name/x"}}},
            "teams.Red.folder: ~nobody",
        ),
        ({"teams": {**TEAMS, "Red": {"command": "r", "environment": {"A=B": "c"}}}}, "no variable can be called 'A=B'"),
        ({"teams": {**TEAMS, "Red": {"command": "r", "environment": {"A": "{unum}"}}}}, "environment.A: no {unum}"),
        ({"limits": {"connect_s": math.inf}}, "limits.connect_s: expected a finite number, got inf"),
        ({"limits": {"stall_s": 0}}, "limits.stall_s: expected a number above 0, got 0"),
        ({"server": {"options": {"half_time": "2"}}}, "server.options.half_time: expected a number, got '2'"),
        ({"server": {"options": {"half_time": -1}}}, "server.options.half_time: expected a number, got -1"),
        ({"server": {"options": {"wind_dir": math.inf}}}, "server.options.wind_dir: expected a number, a word"),
        ({"server": {"options": {"landmark_file": "a b"}}}, "server.options.landmark_file: expected a number, a word"),
        ({"server": {"options": {"game_log_version": 3}}}, "a log of version 3 does not hold enough"),
        ({"pairings": [{"left": "Red", "right": "Blue", "matches": 10**9}]}, "more than 100000 matches"),
        (
            {
                "teams": {
                    "a": {"command": "r"},
                    "b-vs-c": {"command": "r"},
                    "a-vs-b": {"command": "r"},
                    "c": {"command": "r"},
                },
                "pairings": [{"left": "a", "right": "b-vs-c"}, {"left": "a-vs-b", "right": "c"}],
            },
            "a-vs-b-vs-c-1: names two matches",
        ),
    ],
)
def test_what_would_fail_later_is_told_before(tmp_path: Path, changes: dict[str, Any], words: str) -> None:
    table = {"teams": TEAMS, "pairings": [{"left": "Red", "right": "Blue"}], **changes}
    with pytest.raises(UsageError) as caught:
        schedule_from(table, where="schedule", base=tmp_path)
    assert words in str(caught.value)


def test_switches_may_be_words_and_shell_variables_are_no_placeholders(tmp_path: Path) -> None:
    teams = {**TEAMS, "Red": {"command": "sh -c 'r ${HOME} {port}'"}}
    table = {
        "teams": teams,
        "pairings": [{"left": "Red", "right": "Blue"}],
        "server": {"options": {"synch_mode": "Off"}},
    }
    [fixture] = schedule_from(table, where="schedule", base=tmp_path).fixtures
    assert fixture.server.options["server::synch_mode"] is False
    assert filled_in(fixture.left.clients()[0][1], {"port": 7}) == ["sh", "-c", "r ${HOME} 7"]


def test_the_same_schedule_is_the_same_wherever_it_is_called_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("schedules", "elsewhere"):
        (tmp_path / name).mkdir()
    (tmp_path / "schedules" / "schedule.toml").write_text(
        "[teams.Red]\ncommand = 'r'\n[teams.Blue]\ncommand = 'b'\n[[pairings]]\nleft = 'Red'\nright = 'Blue'\n"
    )
    found = []
    for folder, path in (("schedules", "schedule.toml"), ("elsewhere", "../schedules/schedule.toml")):
        monkeypatch.chdir(tmp_path / folder)
        found.append(load_schedule(Path(path)).fixtures[0])
    assert found[0] == found[1]


def test_a_folder_without_a_start_script_is_no_team(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="has no script called start"):
        quick_schedule("red", str(tmp_path), matches=1, server="srv", options={})


def test_all_mistakes_of_the_quick_case_are_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        quick_schedule(str(tmp_path), str(tmp_path), matches=1, server="srv", options={"port": 1})
    for part in ("--left /", "--right /", "server.options.port: is set by teamclone"):
        assert part in str(caught.value)


def test_a_team_may_have_fewer_players_and_then_needs_no_goalkeeper(tmp_path: Path) -> None:
    teams = {
        "Three": {"player": "p {unum} {port}", "coach": "c", "players": 3},
        "League": {"start": "./start", "players": 2},
        "Red": TEAMS["Red"],
    }
    table = {"teams": teams, "pairings": [{"left": "Three", "right": ["League", "Red"]}]}
    first, second = schedule_from(table, where="schedule", base=tmp_path).fixtures
    assert [label for label, _ in first.left.clients()] == ["player-1", "player-2", "player-3", "coach"]
    assert first.left.clients()[0][1] == ["p", "1", "{port}"]
    assert [label for label, _ in first.right.clients()] == ["goalie", "player-2", "coach"]
    assert not first.whole_teams
    assert not second.whole_teams
    for players in (0, 12):
        table["teams"] = {**teams, "Three": {**teams["Three"], "players": players}}
        with pytest.raises(UsageError, match=r"teams\.Three\.players: expected at "):
            schedule_from(table, where="schedule", base=tmp_path)


def test_matches_of_whole_teams_keep_the_fingerprint_by_which_earlier_versions_know_them() -> None:
    red, blue = TeamSpec(name="Red"), TeamSpec(name="Blue")
    fixture = Fixture(id="Red-vs-Blue-1", left=red, right=blue, server=ServerSpec(), limits=Limits(), seed=0)
    assert fixture.fingerprint == "f6b956948799d9d1"
    assert replace(fixture, left=replace(red, players=5)).fingerprint != fixture.fingerprint


def test_the_wait_before_a_kick_off_is_that_of_the_server() -> None:
    synch = {"server::synch_mode": True}
    assert ServerSpec(options=synch).kick_off_wait_s == 5
    assert ServerSpec(options={**synch, "server::kick_off_wait": 10}).kick_off_wait_s == 0.5
    assert ServerSpec(options={"server::kick_off_wait": 10}).kick_off_wait_s == 1
