"""`teamclone play` and `teamclone pipeline`: matches and schedules that come off, with servers and teams as processes.

The stand-in (tests/standin) speaks the protocol and writes the logs, its teams cannot play but crash and hang on
demand. They play on the real rcssserver, too: where one is on the PATH, tests with the marker ``rcssserver`` run.
"""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import datetime
from pathlib import Path

import pytest

from command import called, teamclone
from playing import (
    CLIENT,
    STANDIN,
    TEAM,
    both_servers,
    play,
    small_team,
    started,
    trouble_of,
    write_schedule,
)
from teamclone.errors import UsageError
from teamclone.logs import read_match
from teamclone.pipeline import load_pipeline
from teamclone.play.ports import held_ports
from teamclone.play.record import NAME
from teamclone.store import open_store

pytestmark = pytest.mark.usefixtures("nothing_stays")


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


def test_a_script_that_starts_no_coach_is_told_with_the_outcome(tmp_path: Path) -> None:
    script = f'sh -c "test $3 = 12 || exec {TEAM} --unum $3" start'
    teams = {"Red": f"start = '''{script}'''\nplayers = 2", "Blue": small_team()}
    done = called("play", write_schedule(tmp_path, [("Red", "Blue")], teams=teams), "--out", tmp_path / "out")
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
    done = called("play", schedule, "--out", tmp_path / "out", code=1)
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
        trouble = trouble_of(schedule, tmp_path / "out")
    assert trouble["fault"] == "no port"
    assert "teams without {port} in their commands need 6000" in trouble["text"]


def test_a_changed_schedule_is_not_mixed_with_what_was_played(tmp_path: Path) -> None:
    play(write_schedule(tmp_path, [("Red", "Blue")]), tmp_path / "out")
    play(write_schedule(tmp_path, [("Red", "Blue")], matches=2), tmp_path / "out")  # more matches are welcome
    done = called("play", write_schedule(tmp_path, [("Red", "Blue")], half_time=3), "--out", tmp_path / "out", code=2)
    assert "Red-vs-Blue-1: was played in" in done.stderr


def test_the_quick_case_needs_no_schedule(tmp_path: Path) -> None:
    red, blue = (TEAM.replace("{team}", name) for name in ("Red", "Blue"))
    server = ("--server", STANDIN / "rcssserver", "--set", "half_time=2", "--set", "kick_off_wait=5")
    done = called("play", "--left", red, "--right", blue, "-n", 2, *server, "--out", tmp_path / "out")
    assert "matches: 2 complete, 0 failed, 2 played now" in done.stdout
    assert "left : right" in done.stdout
    assert done.stderr.count("the servers of matches listen on all addresses of this machine") == 1
    for wrong in (("--left", red), (tmp_path / "schedule.toml", "--left", red), ()):
        called("play", *wrong, "--out", tmp_path / "out", code=2)


@both_servers
@pytest.mark.slow
def test_a_whole_schedule_runs_and_what_is_there_is_kept(tmp_path: Path, server: str) -> None:
    more = (
        "[[pairings]]\nleft = 'Green'\nright = 'Red'\n"
        "[dataset]\nteams = 'Red'\ntest = 0.2\nvalidation = 0.2\nunseen = 'Green'\n"
        "[train]\npreset = 'small'\nset = ['train.epochs=1', 'data.batches_per_epoch=2', 'data.batch_size=64']\n"
    )
    teams = {"Green": TEAM}
    schedule = write_schedule(tmp_path, [("Red", "Blue")], server=server, teams=teams, matches=3, more=more)
    out = tmp_path / "out"

    def stages() -> dict[str, bool]:
        answer = json.loads(called("pipeline", schedule, "--out", out, "-j", 2, "--json").stdout)
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
    done = called("pipeline", schedule, "--out", tmp_path / "out", code=2)
    assert words in done.stderr
    assert not (tmp_path / "out").exists()


def test_the_former_name_of_pipeline_still_works_and_says_so(tmp_path: Path) -> None:
    schedule = write_schedule(tmp_path, [("Red", "Blue")], more="[train]\npreset = 'small'\n")
    done = called("run", schedule, "--out", tmp_path / "out", code=2)
    former, mistake = done.stderr.splitlines()
    assert former == "teamclone: run is now called pipeline; call teamclone pipeline instead"
    assert "[train] needs [dataset]" in mistake
    commands = called("--help").stdout.split()
    assert "pipeline" in commands
    assert "run" not in commands


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
