"""`teamclone play` with teams and servers that do not start, crash, hang or stay: it tells who did."""

from __future__ import annotations

from pathlib import Path

import pytest

from command import called
from playing import (
    CLIENT,
    TEAM,
    both_servers,
    play,
    small_team,
    strays,
    trouble_of,
    write_schedule,
)
from teamclone.play.record import NAME

pytestmark = pytest.mark.usefixtures("nothing_stays")


@both_servers
def test_a_team_that_crashes_is_told_with_its_players(tmp_path: Path, server: str) -> None:
    teams = {"All": f"{TEAM} --crash-at 12", "One": f"{TEAM} --crash-at 12 --crash-unum 7"}
    schedule = write_schedule(tmp_path, [("Red", "All"), ("Red", "One")], server=server, half_time=30, teams=teams)
    records = play(schedule, tmp_path / "out", code=1)["records"]
    for record, unums in zip(records, (list(range(1, 12)), [7]), strict=True):
        trouble = record["trouble"]
        assert (trouble["fault"], trouble["side"]) == ("crashed", "right")
        assert trouble["unums"] == unums
        assert trouble["cycle"] >= 12
        [attempt] = (tmp_path / "out" / "failed" / record["id"]).iterdir()
        assert {path.suffix for path in attempt.glob("*rc*")} == {".failed"}
    assert not list((tmp_path / "out" / "matches").iterdir())


@both_servers
def test_a_team_that_never_comes_is_given_up(tmp_path: Path, server: str) -> None:
    schedule = write_schedule(
        tmp_path, [("Late", "Red")], server=server, limits="connect_s = 1", teams={"Late": f"{TEAM} --never-connect"}
    )
    trouble = trouble_of(schedule, tmp_path / "out")
    assert (trouble["fault"], trouble["side"], trouble["cycle"]) == ("never connected", "left", 0)
    assert "Late: 0 of 11 players connected within 1 s" in trouble["text"]


def test_a_team_that_does_not_start_is_told_with_its_last_words(tmp_path: Path) -> None:
    teams = {
        "Nothing": "./no-such-program",
        "Library": 'sh -c "echo wrong library; exit 127"',
        "Killed": 'sh -c "kill -SEGV $$"',
    }
    schedule = write_schedule(tmp_path, [("Red", name) for name in teams], teams=teams)
    records = play(schedule, tmp_path / "out", code=1)["records"]
    for record, words in zip(
        records,
        (
            "No such file or directory",
            "team ended with code 127 before the kick-off: wrong library",
            "team was ended by SIGSEGV before the kick-off",
        ),
        strict=True,
    ):
        assert (record["trouble"]["fault"], record["trouble"]["side"]) == ("team did not start", "right")
        assert words in record["trouble"]["text"]


@both_servers
def test_a_client_that_hangs_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, server: str) -> None:
    """In synchronous mode the server gives up on it, and the command log says who it was."""
    monkeypatch.setenv("STANDIN_WAIT_MS", "200")
    schedule = write_schedule(
        tmp_path, [("Red", "Blue")], server=server, half_time=20, teams={"Red": f"{TEAM} --hang-at 30"}
    )
    trouble = trouble_of(schedule, tmp_path / "out")
    assert (trouble["fault"], trouble["side"]) == ("hung", "left")
    assert trouble["unums"] == list(range(1, 12))


@pytest.mark.parametrize(
    ("told", "fault", "words"),
    [
        (("STANDIN_DIE_AT", ""), "server died", "the server was ended by SIGSEGV before the end"),
        (("STANDIN_EXIT_EARLY_AT", ""), "logs not whole", "the game log ends at cycle 15 of 40"),
        (("STANDIN_HANG_AT", "stall_s = 3"), "server stalled", "nothing from the server for 3 s"),
    ],
)
def test_a_server_that_ends_or_stalls_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: tuple[str, str], fault: str, words: str
) -> None:
    variable, limits = told
    monkeypatch.setenv(variable, "15")
    trouble = trouble_of(write_schedule(tmp_path, [("Red", "Blue")], limits=limits), tmp_path / "out")
    assert (trouble["fault"], trouble["side"]) == (fault, None)
    assert words in trouble["text"]


def test_a_match_over_its_time_is_ended(tmp_path: Path) -> None:
    schedule = write_schedule(tmp_path, [("Red", "Blue")], half_time=300, limits="match_s = 4")
    assert trouble_of(schedule, tmp_path / "out")["fault"] == "took too long"


@both_servers
def test_a_wrong_option_stops_all_in_the_server_s_words_and_costs_no_attempt(tmp_path: Path, server: str) -> None:
    out = tmp_path / "out"
    schedule = write_schedule(tmp_path, [("Red", "Blue")], server=server, matches=9, attempts=3)
    right = schedule.read_text()
    schedule.write_text(right.replace("kick_off_wait", "kick_of_wait"))
    done = called("play", schedule, "--out", out, "-j", 1, code=1)
    assert "server did not start on " in done.stderr
    assert "kick_of_wait" in done.stderr
    assert "mend the server or its options and give the command again, matches played stay" in done.stderr
    assert "of 9: " not in done.stderr
    assert not list((out / "failed").iterdir())
    schedule.write_text(right.replace("matches = 9", "matches = 1"))
    assert play(schedule, out)["complete"] == 1


def test_a_server_without_its_libraries_stops_all_and_one_that_is_killed_costs_an_attempt(tmp_path: Path) -> None:
    server = tmp_path / "server"
    server.write_text("#!/bin/sh\necho libX.so.18: cannot open shared object file; exit 127\n")
    server.chmod(0o755)
    schedule, out = write_schedule(tmp_path, [("Red", "Blue")], server=str(server), matches=2), tmp_path / "out"
    done = called("play", schedule, "--out", out, code=1)
    assert "the server ended with code 127: libX.so.18: cannot open shared object file" in done.stderr
    assert not list((out / "failed").iterdir())
    server.write_text("#!/bin/sh\nkill -9 $$\n")
    records = play(schedule, out, code=1)["records"]
    assert [record["trouble"]["fault"] for record in records] == ["server died"] * 2


def test_who_of_fewer_than_eleven_crashes_or_never_comes_is_told(tmp_path: Path) -> None:
    teams = {
        "Red": small_team(),
        "Crash": f"players = 2\ncommand = '''{TEAM} --players 2 --crash-at 12'''",
        "Late": small_team(player=f"{CLIENT} --never-connect", players=3),
    }
    pairings = [("Red", "Crash"), ("Late", "Red")]
    schedule = write_schedule(tmp_path, pairings, teams=teams, half_time=30, limits="connect_s = 6")
    crash, late = (record["trouble"] for record in play(schedule, tmp_path / "out", code=1)["records"])
    assert (crash["fault"], crash["side"], crash["unums"]) == ("crashed", "right", [1, 2])
    assert crash["text"].startswith("Crash: the whole team is gone")
    assert late["fault"] == "never connected"
    assert "Late: 0 of 3 players connected within 6 s" in late["text"]


@both_servers
@pytest.mark.parametrize(
    ("coach", "how"),
    [(CLIENT.replace("{team}", "Stranger"), "still runs"), ("true", "ended with code 0")],
    ids=["refused", "ends well"],
)
def test_a_coach_that_never_connects_fails_the_match(tmp_path: Path, server: str, coach: str, how: str) -> None:
    teams = {"Red": small_team(CLIENT, players=1), "Blue": small_team(coach, players=1)}
    schedule = write_schedule(tmp_path, [("Red", "Blue")], server=server, teams=teams, limits="connect_s = 8")
    trouble = trouble_of(schedule, tmp_path / "out")
    assert (trouble["fault"], trouble["side"]) == ("never connected", "right")
    assert trouble["text"] == f"Blue: the coach never connected, it {how}: it printed nothing"


def test_nothing_stays_of_teams_with_bad_habits(tmp_path: Path) -> None:
    habits = {
        "Stays": "--refuse-to-die",
        "Forks": "--fork",
        "Parent": "--leave-children",
        "Daemon": "--refuse-to-die --fork",
    }
    teams = {"Crash": f"{TEAM} --crash-at 10", **{name: f"{TEAM} {habit}" for name, habit in habits.items()}}
    pairings = [(name, other) for name in habits for other in ("Blue", "Crash")]
    schedule = write_schedule(tmp_path, pairings, teams=teams, half_time=10)
    answer = play(schedule, tmp_path / "out", "-j", 4, code=1)
    faults = [record["trouble"] and record["trouble"]["fault"] for record in answer["records"]]
    assert faults == [None, "crashed"] * len(habits)
    assert strays(tmp_path) == []


def test_a_match_is_tried_again_and_failures_are_remembered(tmp_path: Path) -> None:
    out = tmp_path / "out"
    schedule = write_schedule(tmp_path, [("Red", "Blue")], attempts=2, teams={"Blue": f"{TEAM} --crash-at 5"})
    [record] = play(schedule, out, code=1)["records"]
    assert record["attempt"] == 2
    assert sorted(path.name for path in (out / "failed" / "Red-vs-Blue-1").iterdir()) == ["1", "2"]
    done = called("play", schedule, "--out", out, code=1)
    assert "0 played now" in done.stdout
    assert "1 failed in an earlier call and was not tried again; with --retry-failed the same" in done.stdout
    assert "listen on all addresses" not in done.stderr
    done = called("pipeline", schedule, "--out", out, code=1)
    assert "no match of the schedule is complete: Blue: the whole team is gone" in done.stderr
    assert "; teamclone play with --retry-failed tries them again" in done.stderr
    assert play(schedule, out, "--retry-failed", code=1)["played"] == 1


def test_a_match_that_comes_off_at_the_second_attempt_counts(tmp_path: Path) -> None:
    once = f"sh -c 'if mkdir {tmp_path}/once 2>/dev/null; then exit 1; fi; exec {TEAM}'".replace("'", '"')
    [record] = play(write_schedule(tmp_path, [("Red", "Blue")], attempts=2, teams={"Red": once}), tmp_path / "out")[
        "records"
    ]
    assert (record["outcome"], record["attempt"]) == ("complete", 2)
    assert (tmp_path / "out" / "failed" / "Red-vs-Blue-1" / "1" / NAME).is_file()
