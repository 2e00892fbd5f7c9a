"""`teamclone play` that is interrupted, killed or without room on the disk: nothing stays, and it goes on."""

from __future__ import annotations

import json
import os
import random
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import psutil
import pytest

from command import called
from disk import small_disk
from playing import (
    STANDIN,
    TEAM,
    both_servers,
    play,
    started,
    strays,
    wait_for_match,
    write_schedule,
)
from teamclone.errors import UsageError
from teamclone.logs import read_match
from teamclone.play.record import NAME
from teamclone.play.runner import _attempt
from teamclone.play.schedule import load_schedule
from teamclone.play.supervisor import Order
from teamclone.store import open_store

pytestmark = pytest.mark.usefixtures("nothing_stays")


def test_another_process_is_not_disturbed(tmp_path: Path) -> None:
    schedule = write_schedule(tmp_path, [("Red", "Blue")], half_time=300)
    errors = tmp_path / "errors"
    with errors.open("wb") as file:
        first = started(schedule, tmp_path / "out", stderr=file)
    wait_for_match(tmp_path / "out")
    done = called("play", schedule, "--out", tmp_path / "out", code=1)
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
        done = called("play", schedule, "--out", out, code=1)
        assert "make room and give the command again" in done.stderr
        (disk / "ballast").unlink()
        answer = play(schedule, out)
        assert (answer["complete"], answer["played"]) == (2, 1)


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


TROUBLED = {"Crash": f"{TEAM} --crash-at 10", "Never": f"{TEAM} --never-connect"}
SIX = [("Red", "Blue"), ("Blue", "Red"), ("Red", "Green"), ("Crash", "Red"), ("Blue", "Never"), ("Green", "Crash")]


def check_six(out: Path, store: Path, answer: dict[str, Any], *, matches: int) -> None:
    """Of six pairings three come off, two have a team that crashes, one has one that never comes."""
    assert len(answer["records"]) == 6 * matches
    faults = [
        record["trouble"] and (record["trouble"]["fault"], record["trouble"]["side"]) for record in answer["records"]
    ]
    expected = [*[None] * 3, ("crashed", "left"), ("never connected", "right"), ("crashed", "right")]
    assert faults == [fault for fault in expected for _ in range(matches)]
    whole = sorted(path.name for path in (out / "matches").iterdir())
    assert whole == sorted(record["id"] for record in answer["records"][: 3 * matches])
    ids = {read_match(next((out / "matches" / name).glob("*.rcg*"))).match_id for name in whole}
    assert set(open_store(str(store)).match_ids()) == ids
    assert not (out / ".playing").exists()


@both_servers
@pytest.mark.slow
def test_six_pairings_with_trouble_end_in_twelve_outcomes(tmp_path: Path, server: str) -> None:
    schedule = write_schedule(tmp_path, SIX, server=server, matches=2, teams=TROUBLED, limits="connect_s = 6")
    answer = play(schedule, tmp_path / "out", "-j", 3, "--ingest", tmp_path / "store", code=1)
    check_six(tmp_path / "out", tmp_path / "store", answer, matches=2)


@both_servers
@pytest.mark.slow
def test_the_same_after_kills_at_random(tmp_path: Path, server: str, kills: int) -> None:
    schedule = write_schedule(tmp_path, SIX, server=server, teams=TROUBLED, limits="connect_s = 6", attempts=2)
    out, store, chance = tmp_path / "out", tmp_path / "store", random.Random(5)
    for _ in range(kills):
        process = started(schedule, out, "-j", "2", "--ingest", str(store))
        time.sleep(chance.uniform(2, 8))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    answer = play(schedule, out, "-j", 2, "--ingest", store, code=1)
    check_six(out, store, answer, matches=1)
