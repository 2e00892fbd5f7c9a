"""Ingest and dataset on a real Dask cluster: a scheduler and workers, each a process of its own."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest

from command import TEAMCLONE, called
from playing import strays, write_schedule
from teamclone.errors import UsageError
from teamclone.play.runner import _play_match, _Task
from teamclone.play.schedule import load_schedule
from teamclone.store import create_store, ingest, open_store
from teamclone.system.cluster import executor_of

DASK = TEAMCLONE.with_name("dask")
QUIET = subprocess.DEVNULL


@dataclass(kw_only=True)
class Cluster:
    """A scheduler with workers of one thread each."""

    folder: Path
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._file = self.folder / "scheduler.json"
        self.scheduler = subprocess.Popen(
            [DASK, "scheduler", "--host=127.0.0.1", "--port=0", "--no-dashboard", f"--scheduler-file={self._file}"],
            cwd=self.folder,
            stdout=QUIET,
            stderr=QUIET,
        )

    @cached_property
    def address(self) -> str:
        def written() -> bool:
            with suppress(FileNotFoundError, ValueError):
                return bool(json.loads(self._file.read_text())["address"])
            return False

        wait_for(written, "scheduler")
        return str(json.loads(self._file.read_text())["address"])

    def add_worker(self) -> None:
        self.workers.append(
            subprocess.Popen(
                [DASK, "worker", self.address, "--nthreads=1", "--no-nanny", "--no-dashboard", "--local-directory=."],
                cwd=self.folder,
                stdout=QUIET,
                stderr=QUIET,
            )
        )

    def end(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[Cluster]:
    """A scheduler without workers."""
    (tmp_path / "cluster").mkdir()
    made = Cluster(folder=tmp_path / "cluster")
    try:
        yield made
    finally:
        made.end()


@pytest.fixture
def cluster(scheduler: Cluster) -> Cluster:
    """A scheduler with two workers."""
    scheduler.add_worker()
    scheduler.add_worker()
    return scheduler


def wait_for(condition: Callable[[], object], what: str, seconds: float = 300) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"no {what} after {seconds} s"
        time.sleep(0.02)


def start(*args: object) -> subprocess.Popen[str]:
    return subprocess.Popen([TEAMCLONE, *map(str, args)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def some(samples: Path, folder: Path, *, n: int) -> Path:
    """A folder with the first of the sample matches."""
    folder.mkdir()
    for path in sorted(samples.glob("*.rc?.xz"))[: 2 * n]:
        shutil.copy(path, folder)
    return folder


def content(folder: Path, *, without: tuple[str, ...] = (".lock", "store.duckdb")) -> dict[str, bytes]:
    """Every file of a store or dataset; the database of a store holds the path of the store."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name not in without
    }


def test_a_cluster_gives_what_one_machine_gives(cluster: Cluster, samples_dir: Path, tmp_path: Path) -> None:
    logs = some(samples_dir, tmp_path / "logs", n=3)
    on_cluster = ("--scheduler", cluster.address)
    here, there = tmp_path / "here", tmp_path / "there"
    called("ingest", "logs", "--store", here, "--jobs", "1", cwd=tmp_path)
    # A relative path: the workers are in another folder.
    done = called("ingest", "logs", "--store", "there", *on_cluster, cwd=tmp_path)
    assert "files: 6 ok, 0 partial, 0 failed" in done.stdout
    assert "matches: 3 added, 0 replaced, 0 there before" in done.stdout
    assert content(there) == content(here)
    assert "3 there before" in called("ingest", logs, "--store", there, *on_cluster).stdout

    make = ("dataset", "--team", "HELIOS_base", "--store")
    called(*make, here, "--out", tmp_path / "ds", "--jobs", "1")
    called(*make, "there", "--out", "ds there", *on_cluster, cwd=tmp_path)
    assert content(tmp_path / "ds there") == content(tmp_path / "ds")


def test_a_killed_worker_costs_no_match(cluster: Cluster, samples_dir: Path, tmp_path: Path) -> None:
    root, logs = tmp_path / "store", some(samples_dir, tmp_path / "logs", n=4)
    process = start("ingest", logs, "--store", root, "--scheduler", cluster.address)
    try:
        wait_for(lambda: process.poll() is not None or any((root / "matches").glob("*/meta.json")), "match")
        cluster.workers[0].kill()
        out, err = process.communicate(timeout=300)
    finally:
        process.kill()
    assert process.returncode == 0, err
    assert "files: 8 ok, 0 partial, 0 failed" in out
    assert "matches: 4 added, 0 replaced, 0 there before" in out
    assert list((root / "unfinished").iterdir()) == []
    called("ingest", logs, "--store", tmp_path / "here")
    assert content(root) == content(tmp_path / "here")


def test_a_lost_scheduler_is_one_line_and_costs_no_match(cluster: Cluster, samples_dir: Path, tmp_path: Path) -> None:
    root, logs = tmp_path / "store", some(samples_dir, tmp_path / "logs", n=4)
    process = start("ingest", logs, "--store", root, "--scheduler", cluster.address)
    try:
        wait_for(lambda: process.poll() is not None or any((root / "matches").glob("*/meta.json")), "match")
        cluster.scheduler.send_signal(signal.SIGKILL)
        _, err = process.communicate(timeout=300)
    finally:
        process.kill()
    assert process.returncode == 1, err
    assert err.startswith("teamclone: the connection to the workers was lost"), err
    assert err.count("\n") == 1, err
    before = len(open_store(root).match_ids())
    assert before >= 1
    done = called("ingest", logs, "--store", root)
    assert "files: 8 ok, 0 partial, 0 failed" in done.stdout
    assert f"matches: {4 - before} added, 0 replaced, {before} there before" in done.stdout


def test_nobody_answers(scheduler: Cluster, fixtures_dir: Path, tmp_path: Path) -> None:
    run = ("ingest", fixtures_dir / "v6", "--store", tmp_path / "store", "--scheduler")
    started = [
        (start(*run, address), f"teamclone: {address}: {text}")
        for address, text in (
            ("tcp://127.0.0.1:9", "no Dask scheduler answers"),
            (scheduler.address, f"has no workers; start some with `dask worker {scheduler.address}`"),
        )
    ]
    for process, text in started:
        _, err = process.communicate(timeout=300)
        assert process.returncode == 1
        assert err.startswith(text), err
        assert err.count("\n") == 1, err
    assert "expected the address of a Dask scheduler, tcp://host:port" in called(*run, "cluster7", code=2).stderr
    assert "--jobs" in called(*run, scheduler.address, "--jobs", "2", code=2).stderr


def test_a_worker_that_does_not_see_the_logs(fixtures_dir: Path, tmp_path: Path) -> None:
    logs = Path(shutil.copytree(fixtures_dir / "v6", tmp_path / "logs"))

    class Elsewhere(Executor):
        """A machine without the logs."""

        def submit(self, function: Callable[..., Any], /, *args: Any, **options: Any) -> Future[Any]:
            future: Future[Any] = Future()
            hidden = logs.rename(tmp_path / "hidden")
            future.set_result(function(*args, **options))
            hidden.rename(logs)
            return future

    store = create_store(tmp_path / "store")
    with pytest.raises(UsageError, match=r"\.rcg\.gz: the worker on .* does not see this file"):
        ingest([logs], store, executor=Elsewhere())
    assert store.files() == []
    assert ingest([logs], store).added == 1


def test_matches_are_played_on_a_cluster_and_a_killed_worker_costs_none(cluster: Cluster, tmp_path: Path) -> None:
    out, pairings = tmp_path / "out", [("Red", "Blue"), ("Blue", "Red")]
    schedule = write_schedule(tmp_path, pairings, half_time=30, attempts=1)
    process = start(
        "play", schedule, "--out", out, "--scheduler", cluster.address, "--ingest", tmp_path / "store", "--json"
    )
    try:
        wait_for(lambda: len(list(out.glob(".playing/*/*/output/right-team.txt"))) == 2, "match on each worker")
        cluster.workers[0].kill()
        text, err = process.communicate(timeout=300)
    finally:
        process.kill()
    assert process.returncode == 0, err
    assert json.loads(text)["complete"] == 2
    assert len(open_store(tmp_path / "store").match_ids()) == 2
    assert strays(tmp_path) == []


def test_ctrl_c_ends_the_matches_on_a_cluster(cluster: Cluster, tmp_path: Path) -> None:
    out = tmp_path / "out"
    schedule = write_schedule(tmp_path, [("Red", "Blue"), ("Blue", "Red")], half_time=300)
    process = start("play", schedule, "--out", out, "--scheduler", cluster.address)
    try:
        wait_for(lambda: len(list(out.glob(".playing/*/*/output/right-team.txt"))) == 2, "match on each worker")
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=300)
    finally:
        process.kill()
    assert process.returncode == 130, err
    wait_for(lambda: strays(tmp_path) == [], "end of the matches")
    assert list((out / "matches").iterdir()) == []


def test_a_folder_that_workers_do_not_see_is_told(cluster: Cluster, tmp_path: Path) -> None:
    """The workers' view of the folder is taken away by asking for the match without it."""
    task = _Task(
        fixture=load_schedule(write_schedule(tmp_path, [("Red", "Blue")])).fixtures[0],
        attempts=1,
        out=tmp_path / "elsewhere",
        wanted=tmp_path / "elsewhere" / "wanted",
    )
    with executor_of(cluster.address) as executor:
        assert executor is not None
        with pytest.raises(UsageError, match=r"elsewhere: the worker on .* does not see this folder"):
            executor.submit(_play_match, task).result(300)
