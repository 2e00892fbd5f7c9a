"""What is told of a match while it is played and afterwards: ports, holes, the record, output."""

from __future__ import annotations

import math
import os
import socket
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mutations import check_readers
from teamclone.errors import PlayError
from teamclone.logs import read_match
from teamclone.logs.match import Match
from teamclone.play.holes import count_holes
from teamclone.play.ports import DEFAULT_PORT, STEP, held_ports, is_free
from teamclone.play.record import FORMAT, Fault, Record, Side, Trouble, load_record, save_record
from teamclone.play.schedule import Fixture, Limits, ServerSpec, TeamSpec
from teamclone.play.server import (
    coach_connected,
    find_server,
    gave_up,
    last_words,
    met_taken_port,
    programs_of,
    server_report,
)
from teamclone.play.verdict import verdict
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.playmodes import PlayMode
from teamclone.rcss.state_bits import DISCARD


def test_ports_that_are_in_use_are_passed_over() -> None:
    with held_ports(any_block=True) as first:
        assert first is not None
        assert first > DEFAULT_PORT
        with held_ports(any_block=True) as second:
            assert second is not None
            assert second > first
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", first + 2))
        assert not is_free(first + 2)
        with held_ports(any_block=True) as third:
            assert third != first


def test_the_folder_of_the_ports_is_never_one_that_somebody_else_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    target = tmp_path / "target"
    target.mkdir()
    folder = tmp_path / f"teamclone-ports-{os.getuid()}"
    folder.symlink_to(target)
    with pytest.raises(PlayError, match="expected a folder of your own"), held_ports(any_block=True):
        pass
    assert list(target.iterdir()) == []
    folder.unlink()
    with held_ports(any_block=True):
        assert folder.stat().st_mode & 0o777 == 0o700
    somebody = os.getuid() + 1
    folder.rename(tmp_path / f"teamclone-ports-{somebody}")
    monkeypatch.setattr("os.getuid", lambda: somebody)
    with pytest.raises(PlayError, match="one of another user"), held_ports(any_block=True):
        pass


def test_a_link_among_the_ports_is_not_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    folder = tmp_path / f"teamclone-ports-{os.getuid()}"
    folder.mkdir()
    (folder / str(DEFAULT_PORT + STEP)).symlink_to(tmp_path / "created")
    with held_ports(any_block=True) as port:
        assert port is not None
        assert port > DEFAULT_PORT + STEP
    assert not (tmp_path / "created").exists()


def test_the_server_tells_whether_a_coach_came() -> None:
    came = "A new (v18) player (Red 1) connected.\nA new (v18) online coach (Red) connected.\n"
    assert coach_connected(came, "Red") is True
    assert coach_connected(f"{came}An online coach disconnected : (Blue)\n", "Blue") is False
    assert coach_connected(came, None) is False
    assert coach_connected("A new (v3) monitor connected\n", "Red") is None


def test_holes_clashes_and_missed_cycles_are_those_put_into_a_match(samples_dir: Path) -> None:
    match = read_match(sorted(samples_dir.glob("*.rcg*"))[0])
    assert match.log is not None
    before = count_holes(match)
    slot, commands = 4, match.commands
    played = np.flatnonzero(match.frames["playmode"] == PlayMode.PLAY_ON)
    frames = next(run for run in np.lib.stride_tricks.sliding_window_view(played, 40) if run[-1] - run[0] == 39)
    mine = (commands["side"] == 1) & (commands["unum"] == slot + 1)
    quiet, twice, silent = frames[:10], frames[10:15], frames[20:40]
    body = np.isin(commands["kind"], [CommandKind.DASH, CommandKind.TURN, CommandKind.KICK, CommandKind.TACKLE])
    dropped = mine & ((body & np.isin(commands["frame"], quiet)) | np.isin(commands["frame"], silent))
    doubled = np.flatnonzero(mine & body & np.isin(commands["frame"], twice))
    kept = np.sort(np.concatenate([np.flatnonzero(~dropped), doubled]))
    changed = {name: column[kept] for name, column in match.log.commands.items()}
    after = count_holes(replace(match, log=replace(match.log, commands=changed)))
    # Every one of these frames had exactly one body command of his.
    assert len(np.unique(commands["frame"][mine & body & np.isin(commands["frame"], frames)])) == len(frames)
    assert after.holes[slot] - before.holes[slot] == len(quiet) + len(silent)
    assert after.clashes[slot] - before.clashes[slot] == len(twice)
    assert after.missed[slot] - before.missed[slot] == len(silent)
    assert after.longest_silence[slot] == len(silent)
    others = np.arange(22) != slot
    assert np.array_equal(after.holes[others], before.holes[others])
    assert np.array_equal(after.clashes[others], before.clashes[others])


def record(trouble: Trouble | None = None) -> Record:
    side = Side(
        team="Red", name="Red", score=2, holes=(1,) * 11, clashes=(0,) * 11, missed=(0,) * 11, exits={"goalie": -9}
    )
    return Record(
        id="Red-vs-Blue-1",
        fingerprint="ab",
        attempt=2,
        left=side,
        right=Side(team="Blue"),
        trouble=trouble,
        logs=("a.rcg", "a.rcl"),
        ports=(6000, 6001, 6002),
    )


@pytest.mark.parametrize(
    "trouble", [None, Trouble(fault=Fault.CRASHED, text="gone", side="left", unums=(3, 4), cycle=12)]
)
def test_a_record_is_read_back_as_it_was_written(tmp_path: Path, trouble: Trouble | None) -> None:
    assert load_record(tmp_path) is None
    save_record(tmp_path, record(trouble))
    assert load_record(tmp_path) == record(trouble)
    assert record(trouble).complete == (trouble is None)


def test_a_damaged_or_foreign_record_is_told_with_its_path(tmp_path: Path) -> None:
    (tmp_path / "match.json").write_text("{")
    with pytest.raises(PlayError, match=r"match\.json: is damaged .* remove its folder"):
        load_record(tmp_path)
    (tmp_path / "match.json").write_text('{"format": 99}')
    with pytest.raises(
        PlayError, match=f"match record of format 99, this version reads {FORMAT}; choose another --out"
    ):
        load_record(tmp_path)


def test_a_record_of_any_shape_is_read_or_refused(tmp_path: Path) -> None:
    save_record(tmp_path, record(Trouble(fault=Fault.CRASHED, text="gone")))
    check_readers(tmp_path / "match.json", lambda: load_record(tmp_path))


def test_the_server_s_output_tells_version_seed_and_waits() -> None:
    output = (
        "rcssserver-16.0.0\n\nSimulator Random Seed: 123\nSomeone missed a cycle at 4\nSomeone missed a cycle at 5\n"
    )
    assert server_report(output) == {"version": "16.0.0", "random_seed": 123, "missed_cycles": 2}
    assert server_report("") == {"version": None, "random_seed": None, "missed_cycles": 0}
    assert gave_up("Waiting too long for clients! Exiting\n")
    assert met_taken_port("Error initializing sockets: port=6000. Address already in use\n")
    assert last_words("one\n two \n\n") == "two"
    assert last_words("cmd line args: 1: error: no parameter 'x'\n\nUsage: rcssserver\n").endswith("no parameter 'x'")


def test_no_server_on_the_path_says_what_to_install() -> None:
    with pytest.raises(PlayError, match="no-such-server: no such program on the PATH; install rcssserver"):
        find_server(ServerSpec(command="no-such-server"))


def test_the_programs_of_a_team_are_those_it_names_and_those_in_its_folder(tmp_path: Path) -> None:
    for name in ("bin/player", "player.conf", "conf/formation", "notes"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch(mode=0o755 if "bin" in name else 0o644)
    found = programs_of(tmp_path, [["sh", "./player.conf", "-x", "conf/formation"], ["./bin/player"]])
    assert {path.name for path in found} == {"sh", "player.conf", "formation", "player"}
    assert tmp_path / "notes" not in found


def played(samples_dir: Path, *, frames: int | None = None) -> Match:
    """A real match, or its beginning as a server leaves it that gave up."""
    match = read_match(sorted(samples_dir.glob("*.rcg*"))[0])
    if frames is None:
        return match
    cut = {name: column[:frames] for name, column in match.frames.items()}
    players = {name: column[:frames].copy() for name, column in match.players.items()}
    assert match.log is not None
    early = match.commands["frame"] < frames
    commands = {name: column[early] for name, column in match.log.commands.items()}
    game, log = replace(match.game, frames=cut, players=players), replace(match.log, commands=commands)
    return replace(match, game=game, log=log)


def silenced(match: Match, *, side: int, unum: int, since: int) -> Match:
    """Without what a player sent from a frame on."""
    assert match.log is not None
    commands = match.log.commands
    kept = ~((commands["side"] == side) & (commands["unum"] == unum) & (commands["frame"] >= since))
    return replace(match, log=replace(match.log, commands={name: column[kept] for name, column in commands.items()}))


FIXTURE = Fixture(
    id="Red-vs-Blue-1",
    left=TeamSpec(name="Red"),
    right=TeamSpec(name="Blue"),
    server=ServerSpec(),
    limits=Limits(),
    seed=0,
)


def judged(match: Match, *, gave_up: bool = False) -> tuple[str, int | None, tuple[int, ...]] | None:
    found = verdict(FIXTURE, match, count_holes(match), None, gave_up=gave_up)
    return found and (found.fault, found.side, found.unums)


@pytest.mark.parametrize("gave_up", [False, True])
def test_a_match_that_was_played_to_its_end_is_one(samples_dir: Path, gave_up: bool) -> None:
    assert judged(played(samples_dir), gave_up=gave_up) is None


def with_params(match: Match, **params: float) -> Match:
    return replace(match, game=replace(match.game, server_params=match.game.server_params | params))


@pytest.mark.parametrize(
    "params",
    [
        {"half_time": math.nan},
        {"half_time": math.inf},
        {"simulator_step": 0.0},
        {"simulator_step": math.nan},
        {"nr_normal_halfs": math.nan},
    ],
)
def test_a_log_that_gives_the_match_no_length_is_bad(samples_dir: Path, params: dict[str, float]) -> None:
    match = with_params(played(samples_dir), **params)
    found = verdict(FIXTURE, match, count_holes(match), None, gave_up=False)
    assert found is not None
    assert found.fault is Fault.BAD_LOGS
    ((name, value),) = params.items()
    assert "the game log gives the match no length" in str(found)
    assert f"{name} {value:g}" in str(found)


@pytest.mark.parametrize("half_time", [0.0, -1.0])
def test_without_a_length_of_halves_the_play_mode_says_whether_a_match_ended(
    samples_dir: Path, half_time: float
) -> None:
    assert judged(with_params(played(samples_dir), half_time=half_time)) is None
    early = with_params(played(samples_dir, frames=500), half_time=half_time)
    assert judged(early) == (Fault.BAD_LOGS, None, ())


def test_a_match_that_ends_early_is_none(samples_dir: Path) -> None:
    assert judged(played(samples_dir, frames=500)) == (Fault.BAD_LOGS, None, ())


def test_whom_a_server_waited_for_in_vain_is_not_who_was_sent_off(samples_dir: Path) -> None:
    match = played(samples_dir, frames=500)
    match.players["state"][200:, 4] = DISCARD
    match = silenced(silenced(match, side=1, unum=5, since=200), side=-1, unum=4, since=450)
    assert judged(match, gave_up=True) == (Fault.HUNG, 1, (4,))


def test_a_player_who_was_silent_for_long_counts_as_hung_though_the_match_ended(samples_dir: Path) -> None:
    match = silenced(played(samples_dir), side=1, unum=7, since=1700)
    assert judged(match) == (Fault.HUNG, 0, (7,))


def test_a_player_who_was_gone_shortly_before_the_end_is_noticed(samples_dir: Path) -> None:
    match = played(samples_dir)
    match.players["state"][-3:-1, 14] = 0
    assert judged(match) == (Fault.CRASHED, 1, (4,))
