"""A clone as a team: on the stand-in for rcssserver, and on the real one where there is one."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np
import pytest

import teamclone as tc
from command import TEAMCLONE, called, teamclone
from playing import STANDIN, both_servers, write_schedule
from teamclone.dataset.build import DatasetConfig
from teamclone.logs import read_match
from teamclone.logs.match import Match
from teamclone.play.holes import count_holes
from teamclone.protocol.client import MonitorClient
from teamclone.rcss import state_bits
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.players import N_TEAM
from teamclone.store import create_store
from teamclone.training.config import load_config
from teamclone.training.line_up import LineUp, read_line_up

pytestmark = pytest.mark.usefixtures("nothing_stays")

SETTINGS = (
    *("model.blocks=self,role,ball,mode", "model.kick_blocks=self,ball,mode", "model.target_points=2"),
    *("model.target_hidden=8", "model.parameter_hidden=16", "model.kick_hidden=8", "model.hidden=[16]"),
    *("data.batch_size=128", "data.batches_per_epoch=4", "data.validation_batches=4", "train.epochs=1"),
    *("train.threads=1", "train.precision=fp32", "train.device=cpu"),
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, samples_dir: Path) -> Path:
    """A clone that was hardly trained."""
    folder = tmp_path_factory.mktemp("cloned")
    store = create_store(folder / "store")
    for log in sorted(samples_dir.glob("*.rcg.xz"))[:4]:
        store.add(read_match(log))
    config = DatasetConfig(teams=("HELIOS_base",), goalkeepers=True, set_plays=True, idle=True)
    tc.build_dataset(config, store=store, out=folder / "ds", jobs=1)
    return tc.train(load_config("play", SETTINGS), tc.open_dataset(folder / "ds"), folder / "run").path


def command(run: Path, *more: str) -> str:
    options = ("--port", "{port}", "--coach-port", "{olcoach_port}", "--name", "{team}", *more)
    return " ".join([str(TEAMCLONE), "live", "team", str(run), *options])


def played(tmp_path: Path, server: str, run: Path, *, half_time: int) -> tuple[Match, Path]:
    """A match of a clone with the likeliest commands, on the left, against one that draws."""
    schedule = write_schedule(
        tmp_path,
        [("Clone", "Drawn")],
        server=server,
        teams={"Clone": command(run, "--deterministic", "--json"), "Drawn": command(run, "--seed", "1")},
        half_time=half_time,
        limits="connect_s = 120",
    )
    # The coaches need a moment, however busy the machine is.
    schedule.write_text(schedule.read_text().replace("kick_off_wait = 5", "kick_off_wait = 100"))
    teamclone("play", schedule, "--out", tmp_path / "out", "--jobs", "1")
    (folder,) = (tmp_path / "out" / "matches").iterdir()
    (log,) = folder.glob("*.rcg.gz")
    return read_match(log), folder


@both_servers
def test_a_clone_plays_a_match(tmp_path: Path, server: str, run: Path) -> None:
    match, folder = played(tmp_path, server, run, half_time=10)
    game, line_up = match.game, read_line_up(run)
    assert game.frames["cycle"][-1] == 200
    assert (game.left.name, game.right.name) == ("Clone", "Drawn")
    reached = count_holes(match)
    assert not reached.holes.any()
    assert not reached.clashes.any()
    assert not reached.missed.any()
    state = game.players["state"][0]
    keepers = np.flatnonzero(state & state_bits.GOALIE)
    assert keepers.tolist() == [line_up.goalkeeper - 1, line_up.goalkeeper - 1 + N_TEAM]
    # Both stand where the original stands at its and at the other's kick-off.
    for places, sign, begin in ((line_up.own_kick_off, 1, 0), (line_up.other_kick_off, -1, N_TEAM)):
        stood = sign * np.stack([game.players[axis][0, begin : begin + N_TEAM] for axis in "xy"], axis=1)
        assert np.abs(stood - places).max() < 2
    types = np.stack([game.player_types[name] for name in FIELDS], axis=1)
    wanted = line_up.types(types)
    for begin in (0, N_TEAM):
        assert game.players["type"][0, begin : begin + N_TEAM].tolist() == wanted.tolist()
    summary = json.loads((folder / "output" / "left-team.txt").read_text())
    assert summary["missed"] == 0
    assert summary["over"]
    assert summary["types"]
    assert set(summary["answer_ms"]) == {"p50", "p99", "p99.9", "max"}
    assert len(set(wanted.tolist())) == N_TEAM


def test_a_clone_of_play_on_alone_is_refused_with_what_to_do(
    tmp_path: Path, run: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    settings = [*SETTINGS, "model.blocks=self,role,ball", "model.kick_blocks=self,ball"]
    store = tc.open_store(run.parent / "store")
    tc.build_dataset(DatasetConfig(teams=("HELIOS_base",)), store=store, out=tmp_path / "ds", jobs=1)
    tc.train(load_config("best", settings), tc.open_dataset(tmp_path / "ds"), tmp_path / "run")
    done = called("live", "team", tmp_path / "run", code=2)
    assert "knows no catch and no move" in done.stderr
    assert "--preset play" in done.stderr


def test_where_no_server_is_it_says_so(run: Path) -> None:
    done = called("live", "team", run, "--port", "1", "--connect-s", "1", code=1)
    assert re.search(r"no server answers at 127\.0\.0\.1:1 after 1 s", done.stderr)


@pytest.mark.parametrize("name", ["A B", "(x)", "x" * 16])
def test_names_that_no_server_takes_are_refused(run: Path, name: str) -> None:
    done = called("live", "team", run, "--name", name, code=2)
    assert "1 to 15 letters" in done.stderr


class Standin:
    """The stand-in for the server, alone, on a port of its own."""

    def __init__(self, folder: Path, port: int, faults: Mapping[str, str], **options: object) -> None:
        words = [f"server::{name}={value}" for name, value in options.items()]
        ports = [f"server::{name}={port + place}" for place, name in enumerate(("port", "coach_port", "olcoach_port"))]
        logs = [f"server::{kind}_log_dir={folder}" for kind in ("game", "text")]
        self.port = port
        self.output = folder / "server.txt"
        with self.output.open("w") as output:
            self.process = subprocess.Popen(
                [sys.executable, STANDIN / "server.py", *ports, *logs, *words],
                env={"RCSS_CONF_DIR": str(folder / "conf"), "PATH": "/usr/bin:/bin", **faults},
                stdout=output,
                stderr=subprocess.DEVNULL,
            )

    def wait_for_words(self, words: str) -> None:
        """Waits until the server has said something."""
        end = time.monotonic() + 120
        while words not in self.output.read_text():
            assert time.monotonic() < end, f"the server never said {words!r}"
            time.sleep(0.05)

    def end(self) -> None:
        self.process.send_signal(signal.SIGINT)
        self.process.wait(10)


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return min(int(probe.getsockname()[1]), 65000)


@contextmanager
def alone(run: Path, port: int, *more: str) -> Iterator[subprocess.Popen[str]]:
    """The clone's team, started by itself."""
    words = [TEAMCLONE, "live", "team", run, "--port", port, "--deterministic", *more]
    with subprocess.Popen([*map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as team:
        try:
            yield team
        finally:
            team.kill()


@pytest.fixture
def standin(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Standin]:
    """A server that kicks off 15 s after it began, with whoever is there, and plays for minutes."""
    options = {"synch_mode": "on", "auto_mode": "on", "connect_wait": 300, "half_time": 3000}
    faults = getattr(request, "param", {})
    if "NO_FULL_STATE" not in faults:
        options["fullstate_l"] = "on"
    server = Standin(tmp_path, free_port(), faults, **options)
    yield server
    server.process.kill()
    server.process.wait()


def wait_for_play(server: Standin) -> None:
    """Waits until the whole team has been in play for some cycles."""
    whole, end = None, time.monotonic() + 120
    with closing(MonitorClient(server.port)) as monitor:
        while time.monotonic() < end:
            show = monitor.latest()
            if show is not None and show.begun and len(show.present[0]) == N_TEAM:
                whole = whole or show.cycle
                if show.cycle > whole + 20:
                    return
            time.sleep(0.02)
    raise AssertionError("the match did not begin")


def test_a_server_that_goes_away_is_said_in_one_line(standin: Standin, run: Path) -> None:
    with alone(run, standin.port) as team:
        wait_for_play(standin)
        standin.process.kill()
        out, err = team.communicate(timeout=60)
    assert team.returncode == 1
    assert re.fullmatch(r"teamclone: the server at \S+ has gone, after cycle \d+; see its output for the reason\n", err)
    assert "cycles answered" in out


def test_ctrl_c_says_bye(standin: Standin, tmp_path: Path, run: Path) -> None:
    with alone(run, standin.port) as team:
        wait_for_play(standin)
        team.send_signal(signal.SIGINT)
        _, err = team.communicate(timeout=60)
    assert team.returncode == 130
    assert "Traceback" not in err
    for unum in range(1, N_TEAM + 1):
        standin.wait_for_words(f"A player disconnected : (HELIOS_base {unum})")
    standin.end()
    (log,) = tmp_path.glob("*.rcl")
    left = re.findall(r"Recv HELIOS_base_(\d+): \(bye\)", log.read_text())
    assert sorted(map(int, left)) == list(range(1, N_TEAM + 1))


@pytest.mark.parametrize("standin", [{"STANDIN_DROP_AT": "20"}], indirect=True)
def test_a_player_whose_connection_is_lost_comes_back(standin: Standin, tmp_path: Path, run: Path) -> None:
    with alone(run, standin.port, "--json") as team:
        standin.wait_for_words("A new (reconnect) player")
        wait_for_play(standin)
        standin.end()
        out, _ = team.communicate(timeout=60)
    assert json.loads(out)["returned"] == 1
    (log,) = tmp_path.glob("*.rcl")
    assert "Recv HELIOS_base_5: (reconnect HELIOS_base 5)" in log.read_text()


@pytest.mark.parametrize("standin", [{"NO_FULL_STATE": "1"}], indirect=True)
def test_without_full_state_it_says_what_the_server_needs(standin: Standin, run: Path) -> None:
    with alone(run, standin.port) as team:
        _, err = team.communicate(timeout=120)
    assert team.returncode == 1
    assert "server::fullstate_l=on" in err


def test_preferences_find_the_types_that_a_team_gives() -> None:
    draw = np.random.default_rng(0)
    types = draw.uniform(0.1, 1.0, (18, len(FIELDS)))
    line_up = LineUp(
        team="Red",
        goalkeeper=1,
        own_kick_off=np.zeros((N_TEAM, 2)),
        other_kick_off=np.zeros((N_TEAM, 2)),
        preferred=np.zeros((N_TEAM, 9)),
        spread=np.ones((N_TEAM, 9)),
        matches=1,
    )
    assert len(set(line_up.types(types).tolist())) == N_TEAM
    with pytest.raises(ValueError, match="at least 11"):
        line_up.types(types[:10])
