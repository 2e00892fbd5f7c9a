"""`teamclone play` and `teamclone pipeline` with servers and teams as processes: a stand-in, and the real server.

The stand-in (tests/standin) speaks the protocol and writes the logs, its teams cannot play but crash and hang on
demand. They play on the real rcssserver, too: where one is on the PATH, tests with the marker ``rcssserver`` run.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import socket
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

import psutil
import pytest

from command import teamclone
from disk import small_disk
from playing import CLIENT, STANDIN, TEAM, started, strays, write_schedule
from teamclone.errors import UsageError
from teamclone.logs import read_match
from teamclone.pipeline import load_pipeline
from teamclone.play.ports import held_ports
from teamclone.play.record import NAME
from teamclone.play.runner import _attempt
from teamclone.play.schedule import load_schedule
from teamclone.play.supervisor import Order
from teamclone.store import open_store

REAL = shutil.which("rcssserver")
SERVERS = [
    pytest.param(str(STANDIN / "rcssserver"), id="standin"),
    pytest.param(
        REAL,
        id="real",
        marks=[
            pytest.mark.rcssserver,
            pytest.mark.skipif(REAL is None, reason="there is no rcssserver on the PATH"),
        ],
    ),
]
both_servers = pytest.mark.parametrize("server", SERVERS)


@pytest.fixture(autouse=True)
def _nothing_stays(tmp_path: Path) -> Iterator[None]:
    """Whatever happens in a test, no process of its matches outlives it."""
    yield
    assert strays(tmp_path) == []


def play(schedule: Path, out: Path, *options: object, code: int = 0) -> dict[str, Any]:
    done = teamclone("play", schedule, "--out", out, "--json", *options, code=code)
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def one(schedule: Path, out: Path, *options: object) -> dict[str, Any]:
    """The trouble of a match that fails."""
    answer = play(schedule, out, *options, code=1)
    [record] = answer["records"]
    trouble: dict[str, Any] = record["trouble"]
    return trouble


@both_servers
def test_a_match_is_whole_with_its_logs_and_all_that_is_known_of_it(tmp_path: Path, server: str) -> None:
    out = tmp_path / "out"
    schedule = write_schedule(
        tmp_path, [("Red", "Blue")], server=server, teams={"Red": f"{TEAM} --olcoach-port {{olcoach_port}}"}
    )
    answer = play(schedule, out, "--ingest", tmp_path / "store")
    assert (answer["matches"], answer["complete"], answer["failed"], answer["played"]) == (1, 1, 0, 1)
    home = out / "matches" / "Red-vs-Blue-1"
    record = json.loads((home / NAME).read_text())
    assert record == answer["records"][0]
    assert record["outcome"] == "complete"
    assert (record["left"]["name"], record["right"]["name"]) == ("Red", "Blue")
    assert record["cycles"] == 40
    assert record["server"]["version"] == "19.0.0"
    assert record["server"]["random_seed"] > 0
    assert record["server"]["options"]["server::synch_mode"] is True
    assert record["server"]["files"].keys() == {server}
    assert len(record["left"]["files"][str(STANDIN / "team")]) == 64
    assert f"server::port={record['ports'][0]}" in record["commands"]["server"]
    for side in ("left", "right"):
        assert record[side]["holes"] == [0] * 11
        assert record[side]["clashes"] == [0] * 11
        assert record[side]["missed"] == [0] * 11
    match = read_match(home / record["logs"][0])
    assert match.rcl_path == home / record["logs"][1]
    assert match.game.complete
    assert match.problems == ()
    assert match.game.server_params["fullstate_l"] == 1
    assert open_store(str(tmp_path / "store")).match_ids() == [match.match_id]
    assert (home / "output" / "server.txt").read_text().startswith("rcssserver-19.0.0")
    assert {path.name for path in home.iterdir()} == {NAME, "output", *record["logs"]}
    assert {path.name for path in out.iterdir()} == {"matches", "failed", ".lock"}

    again = play(schedule, out)
    assert again["played"] == 0
    assert again["records"] == answer["records"]


def test_holes_and_clashes_are_counted_for_each_player(tmp_path: Path) -> None:
    teams = {"Red": f"{TEAM} --hole-every 4", "Blue": f"{TEAM} --clash-every 5"}
    [record] = play(write_schedule(tmp_path, [("Red", "Blue")], teams=teams), tmp_path / "out")["records"]
    assert all(8 <= count <= 10 for count in record["left"]["holes"])
    assert record["left"]["clashes"] == [0] * 11
    assert all(6 <= count <= 8 for count in record["right"]["clashes"])
    assert record["right"]["holes"] == [0] * 11


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
    trouble = one(schedule, tmp_path / "out")
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
    trouble = one(schedule, tmp_path / "out")
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
    trouble = one(write_schedule(tmp_path, [("Red", "Blue")], limits=limits), tmp_path / "out")
    assert (trouble["fault"], trouble["side"]) == (fault, None)
    assert words in trouble["text"]


def test_a_match_over_its_time_is_ended(tmp_path: Path) -> None:
    schedule = write_schedule(tmp_path, [("Red", "Blue")], half_time=300, limits="match_s = 4")
    assert one(schedule, tmp_path / "out")["fault"] == "took too long"


@both_servers
def test_a_wrong_option_stops_all_in_the_server_s_words_and_costs_no_attempt(tmp_path: Path, server: str) -> None:
    out = tmp_path / "out"
    schedule = write_schedule(tmp_path, [("Red", "Blue")], server=server, matches=9, attempts=3)
    right = schedule.read_text()
    schedule.write_text(right.replace("kick_off_wait", "kick_of_wait"))
    done = teamclone("play", schedule, "--out", out, "-j", 1, code=1)
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
    done = teamclone("play", schedule, "--out", out, code=1)
    assert "the server ended with code 127: libX.so.18: cannot open shared object file" in done.stderr
    assert not list((out / "failed").iterdir())
    server.write_text("#!/bin/sh\nkill -9 $$\n")
    records = play(schedule, out, code=1)["records"]
    assert [record["trouble"]["fault"] for record in records] == ["server died"] * 2


def small_team(coach: str = "", *, players: int = 2, player: str = CLIENT) -> str:
    """The table of a team of one process for each client."""
    return f"player = '''{player}'''\nplayers = {players}\n" + (f"coach = '''{coach}'''" if coach else "")


@both_servers
def test_fewer_than_eleven_play_a_match_from_its_beginning_to_its_end(tmp_path: Path, server: str) -> None:
    teams = {"Red": small_team(CLIENT, players=1), "Blue": f"players = 4\ncommand = '''{TEAM} --players 4'''"}
    [record] = play(write_schedule(tmp_path, [("Red", "Blue")], server=server, teams=teams), tmp_path / "out")[
        "records"
    ]
    assert (record["outcome"], record["cycles"]) == ("complete", 40)
    assert (record["left"]["coach"], record["right"]["coach"]) == (True, False)
    assert record["right"]["missed"] == [0] * 11
    match = read_match(tmp_path / "out" / "matches" / "Red-vs-Blue-1" / record["logs"][0])
    assert match.game.complete
    there = (match.players["state"][0] != 0).reshape(2, -1)
    assert there.sum(1).tolist() == [1, 4]


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
    trouble = one(schedule, tmp_path / "out")
    assert (trouble["fault"], trouble["side"]) == ("never connected", "right")
    assert trouble["text"] == f"Blue: the coach never connected, it {how}: it printed nothing"


def test_a_script_that_starts_no_coach_is_told_with_the_outcome(tmp_path: Path) -> None:
    script = f'sh -c "test $3 = 12 || exec {TEAM} --unum $3" start'
    teams = {"Red": f"start = '''{script}'''\nplayers = 2", "Blue": small_team()}
    done = teamclone("play", write_schedule(tmp_path, [("Red", "Blue")], teams=teams), "--out", tmp_path / "out")
    assert "1 of 1: Red-vs-Blue-1: Red 0 : 0 Blue, " in done.stderr
    assert ", without the coach of Red\n" in done.stderr


def test_a_match_that_waits_for_the_default_ports_holds_no_slot_and_does_not_count_it(tmp_path: Path) -> None:
    old = f"players = 2\ncommand = '''{TEAM.replace('{port}', '6000')} --players 2'''"
    teams, out = {"Old": old, "Red": small_team(), "Blue": small_team()}, tmp_path / "out"
    schedule = write_schedule(tmp_path, [("Old", "Red"), ("Red", "Blue")], teams=teams)
    with held_default_ports():
        process = started(schedule, out, "-j", "1")
        deadline = time.monotonic() + 300
        while not (out / "matches" / "Red-vs-Blue-1").exists():
            assert process.poll() is None
            assert time.monotonic() < deadline, "the match that needs no default port does not end"
            time.sleep(0.1)
        released = time.time()
    assert process.wait(300) == 0
    names = ("Old-vs-Red-1", "Red-vs-Blue-1")
    waited, free = (json.loads((out / "matches" / name / NAME).read_text()) for name in names)
    assert waited["ports"] == [6000, 6001, 6002]
    assert free["ports"] != waited["ports"]
    assert datetime.fromisoformat(waited["started"]).timestamp() >= int(released)


@contextmanager
def held_default_ports() -> Iterator[None]:
    """Hold the default ports as another match does, once those that have them give them back."""
    with ExitStack() as stack:
        while True:
            try:
                stack.enter_context(held_ports(any_block=False))
                break
            except BlockingIOError:
                time.sleep(0.1)
        yield


def test_without_a_server_nothing_is_begun(tmp_path: Path) -> None:
    schedule = write_schedule(tmp_path, [("Red", "Blue")], server="no-such-server")
    done = teamclone("play", schedule, "--out", tmp_path / "out", code=1)
    assert "no-such-server: no such program on the PATH; install rcssserver" in done.stderr
    assert not (tmp_path / "out").exists()


@both_servers
def test_league_scripts_share_the_default_port_one_match_after_the_other(tmp_path: Path, server: str) -> None:
    script = f"start = '{STANDIN}/start'\nenvironment = {{ TEAM_NAME = '{{team}}' }}"
    schedule = write_schedule(tmp_path, [("Red", "Blue")], server=server, teams={"Red": script}, matches=2)
    records = play(schedule, tmp_path / "out", "-j", 2)["records"]
    assert [record["ports"] for record in records] == [[6000, 6001, 6002]] * 2
    assert all(record["outcome"] == "complete" for record in records)
    assert all(len(record["commands"]) == 1 + 12 + 1 for record in records)


def test_a_default_port_that_a_stranger_has_is_told(tmp_path: Path) -> None:
    script = f"start = '{STANDIN}/start'"
    schedule = write_schedule(tmp_path, [("Red", "Blue")], teams={"Red": script})
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        try:
            stranger.bind(("", 6001))
        except OSError:
            pytest.skip("port 6001 is in use on this machine")
        trouble = one(schedule, tmp_path / "out")
    assert trouble["fault"] == "no port"
    assert "teams without {port} in their commands need 6000" in trouble["text"]


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
    schedule = write_schedule(tmp_path, [("Red", "Blue")], attempts=3, teams={"Blue": f"{TEAM} --crash-at 5"})
    [record] = play(schedule, out, code=1)["records"]
    assert record["attempt"] == 3
    assert sorted(path.name for path in (out / "failed" / "Red-vs-Blue-1").iterdir()) == ["1", "2", "3"]
    done = teamclone("play", schedule, "--out", out, code=1)
    assert "0 played now" in done.stdout
    assert "1 failed in an earlier call and was not tried again; with --retry-failed the same" in done.stdout
    assert "listen on all addresses" not in done.stderr
    done = teamclone("pipeline", schedule, "--out", out, code=1)
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


def test_a_changed_schedule_is_not_mixed_with_what_was_played(tmp_path: Path) -> None:
    play(write_schedule(tmp_path, [("Red", "Blue")]), tmp_path / "out")
    play(write_schedule(tmp_path, [("Red", "Blue")], matches=2), tmp_path / "out")  # more matches are welcome
    done = teamclone(
        "play", write_schedule(tmp_path, [("Red", "Blue")], half_time=3), "--out", tmp_path / "out", code=2
    )
    assert "Red-vs-Blue-1: was played in" in done.stderr


def test_the_quick_case_needs_no_schedule(tmp_path: Path) -> None:
    red, blue = (TEAM.replace("{team}", name) for name in ("Red", "Blue"))
    server = ("--server", STANDIN / "rcssserver", "--set", "half_time=2", "--set", "kick_off_wait=5")
    done = teamclone("play", "--left", red, "--right", blue, "-n", 2, *server, "--out", tmp_path / "out")
    assert "matches: 2 complete, 0 failed, 2 played now" in done.stdout
    assert "left : right" in done.stdout
    assert done.stderr.count("the servers of matches listen on all addresses of this machine") == 1
    for wrong in (("--left", red), (tmp_path / "schedule.toml", "--left", red), ()):
        teamclone("play", *wrong, "--out", tmp_path / "out", code=2)


def test_another_process_is_not_disturbed(tmp_path: Path) -> None:
    schedule = write_schedule(tmp_path, [("Red", "Blue")], half_time=300)
    errors = tmp_path / "errors"
    with errors.open("wb") as file:
        first = started(schedule, tmp_path / "out", stderr=file)
    wait_for_match(tmp_path / "out")
    done = teamclone("play", schedule, "--out", tmp_path / "out", code=1)
    assert "another process plays into it" in done.stderr
    first.send_signal(signal.SIGINT)
    assert first.wait(300) == 130
    ending, interrupted = errors.read_text().splitlines()[-2:]
    assert ending == "teamclone: ending the matches that are being played; those that are over stay"
    assert interrupted == "teamclone: interrupted, 0 of 1 matches are over; the same command plays the others"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_whoever_ends_it_ends_its_processes(tmp_path: Path, number: signal.Signals) -> None:
    schedule = write_schedule(
        tmp_path, [("Red", "Blue"), ("Blue", "Red")], half_time=300, teams={"Red": f"{TEAM} --fork"}
    )
    process = started(schedule, tmp_path / "out", "-j", "2")
    wait_for_match(tmp_path / "out", number=2)
    process.send_signal(number)
    assert process.wait(300) == (130 if number == signal.SIGINT else -number)
    deadline = time.monotonic() + 300
    while strays(tmp_path) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert strays(tmp_path) == []
    assert not list((tmp_path / "out" / "matches").iterdir())
    assert not list((tmp_path / "out" / "failed").iterdir())


def test_a_killed_supervisor_costs_an_attempt(tmp_path: Path) -> None:
    out = tmp_path / "out"
    schedule = write_schedule(tmp_path, [("Red", "Blue")], attempts=2, half_time=60, teams={"Red": f"{TEAM} --fork"})
    process = started(schedule, out)
    wait_for_match(out)
    [supervisor] = [
        child for child in psutil.Process(process.pid).children() if "teamclone.play.supervisor" in child.cmdline()
    ]
    supervisor.kill()
    assert process.wait(300) == 0
    record = json.loads((out / "matches" / "Red-vs-Blue-1" / NAME).read_text())
    assert (record["outcome"], record["attempt"]) == ("complete", 2)
    failed = json.loads((out / "failed" / "Red-vs-Blue-1" / "1" / NAME).read_text())
    assert failed["trouble"]["fault"] == "supervisor died"


def test_a_full_disk_stops_all_and_nothing_is_lost(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", kilobytes=34_000) as disk:
        out = disk / "out"
        assert play(write_schedule(tmp_path, [("Red", "Blue")]), out)["complete"] == 1
        schedule = write_schedule(tmp_path, [("Red", "Blue")], matches=2)
        (disk / "ballast").write_bytes(bytes(8_000_000))
        done = teamclone("play", schedule, "--out", out, code=1)
        assert "make room and give the command again" in done.stderr
        (disk / "ballast").unlink()
        answer = play(schedule, out)
        assert (answer["complete"], answer["played"]) == (2, 1)


TROUBLED = {"Crash": f"{TEAM} --crash-at 10", "Never": f"{TEAM} --never-connect"}
SIX = [("Red", "Blue"), ("Blue", "Red"), ("Red", "Green"), ("Crash", "Red"), ("Blue", "Never"), ("Green", "Crash")]


def check_six(out: Path, store: Path, answer: dict[str, Any]) -> None:
    """Six pairings twice: six matches come off, four have a team that crashes, two one that never comes."""
    assert len(answer["records"]) == 12
    faults = [
        record["trouble"] and (record["trouble"]["fault"], record["trouble"]["side"]) for record in answer["records"]
    ]
    expected = [None] * 6 + [("crashed", "left")] * 2 + [("never connected", "right")] * 2 + [("crashed", "right")] * 2
    assert faults == expected
    whole = sorted(path.name for path in (out / "matches").iterdir())
    assert whole == sorted(record["id"] for record in answer["records"][:6])
    ids = {read_match(next((out / "matches" / name).glob("*.rcg*"))).match_id for name in whole}
    assert set(open_store(str(store)).match_ids()) == ids
    assert not (out / ".playing").exists()


@both_servers
@pytest.mark.slow
def test_six_pairings_with_trouble_end_in_twelve_outcomes(tmp_path: Path, server: str) -> None:
    schedule = write_schedule(
        tmp_path, SIX, server=server, matches=2, teams=TROUBLED, limits="connect_s = 6", attempts=2
    )
    answer = play(schedule, tmp_path / "out", "-j", 2, "--ingest", tmp_path / "store", code=1)
    check_six(tmp_path / "out", tmp_path / "store", answer)


@both_servers
@pytest.mark.slow
def test_the_same_after_five_kills_at_random(tmp_path: Path, server: str) -> None:
    schedule = write_schedule(
        tmp_path, SIX, server=server, matches=2, teams=TROUBLED, limits="connect_s = 6", attempts=2
    )
    out, store, chance = tmp_path / "out", tmp_path / "store", random.Random(5)
    for _ in range(5):
        process = started(schedule, out, "-j", "2", "--ingest", str(store))
        time.sleep(chance.uniform(1, 8))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    answer = play(schedule, out, "-j", 2, "--ingest", store, code=1)
    check_six(out, store, answer)


@both_servers
@pytest.mark.slow
def test_a_whole_schedule_runs_and_what_is_there_is_kept(tmp_path: Path, server: str) -> None:
    more = (
        "[dataset]\nteams = 'Red'\ntest = 0.2\nvalidation = 0.2\nunseen = 'Green'\n"
        "[train]\npreset = 'small'\nset = ['train.epochs=1', 'data.batches_per_epoch=2', 'data.batch_size=64']\n"
    )
    pairings = [("Red", "Blue"), ("Green", "Red")]
    schedule = write_schedule(tmp_path, pairings, server=server, matches=3, more=more)
    out = tmp_path / "out"

    def stages() -> dict[str, bool]:
        answer = json.loads(teamclone("pipeline", schedule, "--out", out, "-j", 2, "--json").stdout)
        return {stage["stage"]: stage["done"] for stage in answer["stages"]}

    assert stages() == dict.fromkeys(("play", "dataset", "train", "evaluate", "report"), True)
    assert "<html" in (out / "run" / "report.html").read_text()
    assert stages() == dict.fromkeys(("play", "dataset", "train", "evaluate", "report"), False)
    text = schedule.read_text()
    schedule.write_text(text.replace("train.epochs=1", "train.epochs=2"))
    assert stages() == {"play": False, "dataset": False, "train": True, "evaluate": True, "report": True}
    assert (out / "run-before-1").is_dir()
    schedule.write_text(schedule.read_text().replace("unseen = 'Green'\n", ""))
    assert stages() == {"play": False, "dataset": True, "train": True, "evaluate": True, "report": True}


def test_mistakes_in_the_later_sections_are_told_before_anything_is_played(tmp_path: Path) -> None:
    for more, words in (
        ("[dataset]\ntest = 2.0\nsplit = 'row'\n", "dataset.split: no 'row'; did you mean rows?"),
        ("[dataset]\ntest = 2.0\n", "dataset.teams: expected a value, got none"),
        ("[train]\npreset = 'small'\n", "[train] needs [dataset]"),
        ("[[dataset]]\nteams = 'Red'\n", "dataset: expected a table"),
        ("[teams.Green]\nname = 'Red'\ncommand = 'r'\n", "teams.Green.name: a team is called"),
        (
            "[dataset]\nteams = 'Red'\n[train]\nset = ['train.epoch=1', 'x']\n[evaluate]\ncheckpoint = 'best'\n[x]\n",
            "schedule.toml: no section 'x'; choose from play, server, limits, teams, pairings, store, dataset, train, "
            "evaluate; evaluate.checkpoint: no 'best'; did you mean best-loss?; train.set: expected KEY=VALUE, got 'x';"
            " no setting 'train.epoch'; did you mean train.epochs",
        ),
        ("[dataset]\nteams = 'Red'\n[train]\npreset = 'smal'\n", "train.preset: no 'smal'; did you mean small?"),
        ("[store]\nplace = 'x'\n", "no setting store.place"),
        (
            "[dataset]\nteams = 'Red'\ngoalkeepers = true\ntrain_goalkeepers = true\n",
            "leave out dataset.train_goalkeepers",
        ),
        (
            "[dataset]\nteams = 'Red'\nidle = true\n[train]\npreset = 'small'\n",
            'train.set: expected "model.commands=dash,turn,kick,tackle,none", as [dataset] has them',
        ),
    ):
        schedule = write_schedule(tmp_path, [("Red", "Blue")], more=more)
        with pytest.raises(UsageError) as caught:
            load_pipeline(schedule)
        assert words in str(caught.value)
        assert "--" not in str(caught.value)
    done = teamclone("pipeline", schedule, "--out", tmp_path / "out", code=2)
    assert words in done.stderr
    assert not (tmp_path / "out").exists()


def test_the_former_name_of_pipeline_still_works_and_says_so(tmp_path: Path) -> None:
    schedule = write_schedule(tmp_path, [("Red", "Blue")], more="[train]\npreset = 'small'\n")
    done = teamclone("run", schedule, "--out", tmp_path / "out", code=2)
    former, mistake = done.stderr.splitlines()
    assert former == "teamclone: run is now called pipeline; call teamclone pipeline instead"
    assert "[train] needs [dataset]" in mistake
    commands = teamclone("--help").stdout.split()
    assert "pipeline" in commands
    assert "run" not in commands


def wait_for_match(out: Path, *, number: int = 1, glob: str = ".playing/*/*/output/right-team.txt") -> None:
    """Until so many matches are being played, with all that belongs to them."""
    deadline = time.monotonic() + 300
    while len(list(out.glob(glob))) < number:
        assert time.monotonic() < deadline, "the matches do not begin"
        time.sleep(0.05)
    time.sleep(1)


@both_servers
def test_a_folder_may_be_called_as_one_likes(tmp_path: Path, server: str) -> None:
    schedule = write_schedule(tmp_path, [("Red", "Blue")], server=server)
    assert play(schedule, tmp_path / "it's = a: folder")["complete"] == 1


def test_a_server_that_waits_for_clients_after_the_end_has_played_the_match(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Clients may stop answering when all is over; the server then says that it waited too long."""
    monkeypatch.setenv("STANDIN_WAIT_MS", "200")
    schedule = write_schedule(tmp_path, [("Red", "Blue")], teams={"Red": f"{TEAM} --hang-at 40"})
    schedule.write_text(schedule.read_text().replace("game_over_wait = 5", "game_over_wait = 100"))
    [record] = play(schedule, tmp_path / "out")["records"]
    assert record["outcome"] == "complete"
    assert record["server"]["missed_cycles"] > 20


def test_a_match_without_its_record_is_played_again_once(tmp_path: Path) -> None:
    schedule, out = write_schedule(tmp_path, [("Red", "Blue")]), tmp_path / "out"
    play(schedule, out)
    (out / "matches" / "Red-vs-Blue-1" / NAME).unlink()
    assert play(schedule, out)["played"] == 1
    assert play(schedule, out)["played"] == 0


def test_a_module_in_the_current_folder_is_not_taken_for_python_s_own(tmp_path: Path) -> None:
    (tmp_path / "platform.py").write_text("raise SystemExit('not me')")
    schedule = write_schedule(tmp_path, [("Red", "Blue")])
    done = teamclone("play", schedule, "--out", tmp_path / "out", cwd=tmp_path)
    assert "1 complete" in done.stdout


def test_a_long_command_is_a_command(tmp_path: Path) -> None:
    red = f"sh -c 'true /{'x' * 300}; exec {TEAM}'".replace("'", '"')
    assert play(write_schedule(tmp_path, [("Red", "Blue")], teams={"Red": red}), tmp_path / "out")["complete"] == 1


def test_the_server_s_cycle_may_be_another(tmp_path: Path) -> None:
    """What a match's length should be is what its own log says, not what we think."""
    schedule = write_schedule(tmp_path, [("Red", "Blue")])
    schedule.write_text(schedule.read_text().replace("half_time = 2,", "half_time = 1, nr_normal_halfs = 4,"))
    [record] = play(schedule, tmp_path / "out")["records"]
    assert record["cycles"] == 40


def test_ctrl_c_does_not_wait_for_a_supervisor_that_is_stuck(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("teamclone.play.runner._END_S", 1.0)
    out = tmp_path / "out"
    fixture = load_schedule(write_schedule(tmp_path, [("Red", "Blue")], half_time=300)).fixtures[0]
    folder, wanted = out / "match", out / "wanted"
    folder.mkdir(parents=True)
    wanted.touch()
    order = Order(fixture=fixture, folder=folder, server=STANDIN / "rcssserver", attempt=1)
    with ThreadPoolExecutor(1) as pool:
        asked = pool.submit(_attempt, order, wanted)
        wait_for_match(out, glob="match/output/right-team.txt")
        [supervisor] = [
            child for child in psutil.Process().children() if "teamclone.play.supervisor" in child.cmdline()
        ]
        supervisor.suspend()
        wanted.unlink()
        with pytest.raises(UsageError, match="no longer wanted"):
            asked.result(300)
