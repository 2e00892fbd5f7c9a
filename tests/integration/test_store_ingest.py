"""From files to a store: what is read, what is skipped, and what happens when things go wrong in the middle."""

from __future__ import annotations

import gzip
import json
import lzma
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pyarrow as pa
import pytest

from command import called
from disk import small_disk
from teamclone.errors import LogError, StoreError, UsageError
from teamclone.logs import LogPair, Match
from teamclone.logs.columns import Source
from teamclone.store import Store, convert, create_store, ingest, open_store
from teamclone.store import ingest as ingest_function
from teamclone.store.status import FileOutcome
from teamclone.system.workers import DIED

COMMAND = Path(sys.executable).with_name("teamclone")
PLAIN = "20261122113117-HELIOS_base_0-vs-WEBase_0"


@pytest.fixture
def logs(tmp_path: Path, fixtures_dir: Path) -> Path:
    """A folder with the two logs of one short match."""
    return Path(shutil.copytree(fixtures_dir / "v6", tmp_path / "logs"))


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return create_store(tmp_path / "store")


def tree(store: Store) -> dict[str, tuple[int, int]]:
    """Every file of a store but its lock, with size and time."""
    root = Path(store.location)
    return {
        str(path.relative_to(root)): (path.stat().st_size, path.stat().st_mtime_ns)
        for path in root.rglob("*")
        if path.is_file() and path.name != ".lock"
    }


def test_a_second_run_does_nothing(logs: Path, store: Store) -> None:
    first = ingest([logs], store)
    assert (first.added, first.unchanged) == (1, 0)
    assert [(Path(row.path).name, row.outcome, row.rows) for row in first.files] == [
        (f"{PLAIN}.rcg.gz", FileOutcome.OK, 199),
        (f"{PLAIN}.rcl.gz", FileOutcome.OK, 30511),
    ]
    before = tree(store)
    second = ingest([logs, logs / f"{PLAIN}.rcg.gz", logs / f"{PLAIN}.rcl.gz"], store)
    assert (second.added, second.replaced, second.unchanged) == (0, 0, 1)
    assert second.files == first.files
    assert tree(store) == before


def test_the_same_match_in_other_files_is_stored_once(logs: Path, store: Store, tmp_path: Path) -> None:
    ingest([logs], store)
    copy = tmp_path / "copy"
    copy.mkdir()
    (copy / "renamed.rcg.xz").write_bytes(
        lzma.compress(gzip.decompress((logs / f"{PLAIN}.rcg.gz").read_bytes()), preset=0)
    )
    (copy / "renamed.rcl").write_bytes(gzip.decompress((logs / f"{PLAIN}.rcl.gz").read_bytes()))
    report = ingest([copy], store)
    assert (report.added, report.replaced, report.unchanged) == (0, 0, 1)
    assert len(store.match_ids()) == 1
    assert len(store.files()) == 4


def test_a_touched_file_is_read_again_but_not_written(logs: Path, store: Store) -> None:
    ingest([logs], store)
    before = tree(store)
    os.utime(logs / f"{PLAIN}.rcg.gz", ns=(1, 1))
    report = ingest([logs], store)
    assert report.unchanged == 1
    changed = {name for name, stamp in tree(store).items() if before[name] != stamp}
    assert {name.split("/")[0] for name in changed} == {"files"}
    before = tree(store)
    ingest([logs], store)
    assert tree(store) == before


@pytest.mark.parametrize("seconds", [-86400, 0, 86400])
def test_clocks_may_be_set(logs: Path, store: Store, seconds: int) -> None:
    """A log that grew is read again, whether its time went back, stayed or went far ahead."""
    log = logs / f"{PLAIN}.rcg.gz"
    whole, before = log.read_bytes(), log.stat().st_mtime_ns
    log.write_bytes(whole[: len(whole) // 2])
    os.utime(log, ns=(before, before))
    assert ingest([logs], store).files[0].outcome is FileOutcome.PARTIAL
    log.write_bytes(whole)
    os.utime(log, ns=(before, before + seconds * 10**9))
    assert [status.outcome for status in ingest([logs], store).files] == [FileOutcome.OK] * 2
    assert store.matches()["complete"].to_pylist() == [True]
    assert ingest([logs], store).unchanged == 1


def test_a_command_log_that_comes_later_is_added(logs: Path, store: Store) -> None:
    commands = logs / f"{PLAIN}.rcl.gz"
    held = commands.rename(logs / "held")
    assert ingest([logs], store).added == 1
    assert store.sql("select distinct source from commands")["source"].to_pylist() == [int(Source.RECOVERED)]
    held.rename(commands)
    report = ingest([logs], store)
    assert (report.added, report.replaced) == (0, 1)
    assert store.matches()["n_commands"].to_pylist() == [30511]
    assert store.sql("select distinct source from commands")["source"].to_pylist() == [int(Source.LOGGED)]


def test_a_game_log_that_grows_replaces_its_match(logs: Path, store: Store) -> None:
    whole = (logs / f"{PLAIN}.rcg.gz").read_bytes()
    (logs / f"{PLAIN}.rcg.gz").write_bytes(whole[: len(whole) // 2])
    first = ingest([logs], store)
    assert first.files[0].outcome is FileOutcome.PARTIAL
    (old,) = store.match_ids()
    (logs / f"{PLAIN}.rcg.gz").write_bytes(whole)
    second = ingest([logs], store)
    assert {status.outcome for status in second.files} == {FileOutcome.OK}
    (new,) = store.match_ids()
    assert new != old


def test_one_bad_file_does_not_stop_the_others(logs: Path, store: Store) -> None:
    whole = gzip.decompress((logs / f"{PLAIN}.rcg.gz").read_bytes())
    bad = {
        "empty.rcg": b"",
        "empty.rcg.gz": b"",
        "garbage.rcg": bytes(range(255, -1, -1)) * 40,
        "foreign.rcg": b"%PDF-1.7\nnot a match\n",
        "of-else.rcg.gz": gzip.compress(b"a letter\n" * 99),
        "no-gzip.rcg.gz": b"\x1f\x8bnonsense",
        "header.rcg": whole[:2000],
    }
    for name, data in bad.items():
        folder = logs / name.replace(".", "-")
        folder.mkdir()
        (folder / name).write_bytes(data)
    report = ingest([logs], store, jobs=2)
    assert report.added == 1
    by_name = {Path(status.path).name: status for status in report.files}
    for name in bad:
        status = by_name[name]
        assert (status.outcome, status.match_id, status.rows) == (FileOutcome.FAILED, None, 0), name
        assert status.error is not None
        assert name in status.error
        assert "\n" not in status.error
    assert report.count(FileOutcome.FAILED) == len(bad)
    assert report.count(FileOutcome.OK) == 2


def test_a_bad_command_log_costs_only_the_commands(logs: Path, store: Store) -> None:
    (logs / f"{PLAIN}.rcl.gz").write_bytes(b"\x1f\x8bnonsense")
    report = ingest([logs], store)
    game, commands = report.files
    assert (game.rows, commands.rows, commands.outcome) == (199, 0, FileOutcome.FAILED)
    assert commands.error is not None
    assert f"{PLAIN}.rcl.gz" in commands.error
    assert store.matches()["n_frames"].to_pylist() == [199]
    assert ingest([logs], store).unchanged == 1


def test_a_match_that_cannot_be_stored_costs_no_other(
    logs: Path, store: Store, tmp_path: Path, fixtures_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (other,) = (fixtures_dir / "onesided").glob("*.rcg.gz")
    tables_of = convert.tables_of

    def fails(match: Match) -> convert.Tables:
        if match.rcg_path == other:
            raise pa.ArrowInvalid("value too large")
        return tables_of(match)

    monkeypatch.setattr(convert, "tables_of", fails)
    report = ingest([other, logs], store, jobs=1)
    assert (report.added, report.count(FileOutcome.OK), report.count(FileOutcome.FAILED)) == (1, 2, 2)
    errors = {row.error for row in report.files if row.outcome is FileOutcome.FAILED}
    assert errors == {f"{other}: could not be stored (ArrowInvalid: value too large); please report this file"}


def test_strict_stops_at_the_first(logs: Path, store: Store) -> None:
    (logs / "z").mkdir()
    (logs / "z" / "empty.rcg").write_bytes(b"")
    with pytest.raises(LogError, match=r"empty\.rcg"):
        ingest([logs], store, strict=True, jobs=1)
    assert len(store.match_ids()) == 1


def test_strict_keeps_partial_matches_out(fixtures_dir: Path, store: Store) -> None:
    with pytest.raises(LogError, match="incomplete"):
        ingest([fixtures_dir / "killed"], store, strict=True)
    assert store.match_ids() == []


@pytest.mark.parametrize("name", [b'it\'s "a" [b] *?', "ünï ⚽".encode(), b"\xff\xfe", b"-x"])
def test_hostile_names(logs: Path, tmp_path: Path, name: bytes) -> None:
    folder = logs.rename(tmp_path / os.fsdecode(name))
    for path in folder.iterdir():
        path.rename(folder / (os.fsdecode(name) + path.name[-7:]))
    try:
        name.decode()
        store = create_store(folder / "store")
    except UnicodeDecodeError:
        # SQL texts are UTF-8: the store itself needs a decodable path, its sources do not.
        store = create_store(tmp_path / "store")
    assert ingest([folder], store).added == 1
    assert ingest([folder], store).unchanged == 1
    (row,) = store.matches().to_pylist()
    assert row["game_log"] == name.decode("utf-8", "replace") + ".rcg.gz"


def test_nothing_to_read(store: Store, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for path in (tmp_path / "missing", tmp_path / "empty"):
        with pytest.raises(UsageError, match=path.name):
            ingest([path], store)


def test_a_dead_worker_costs_its_own_match(
    logs: Path, fixtures_dir: Path, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = sys.modules[ingest_function.__module__]
    run = module.run_tasks

    def one_dies(
        function: Callable[..., object], tasks: list[object], **options: object
    ) -> Iterator[tuple[object, object]]:
        yield tasks[0], DIED
        yield from run(function, tasks[1:], **options)

    monkeypatch.setattr(module, "run_tasks", one_dies)
    report = ingest([logs, fixtures_dir / "json"], store)
    assert report.added == 1
    failed = [status for status in report.files if status.outcome is FileOutcome.FAILED]
    assert len(failed) == 2
    assert all("was killed" in str(status.error) for status in failed)
    monkeypatch.undo()
    assert ingest([logs, fixtures_dir / "json"], store).added == 1


def test_a_defect_of_the_reader_costs_its_own_match(
    logs: Path, fixtures_dir: Path, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = sys.modules[ingest_function.__module__]
    read = module.read_pair

    def broken(pair: LogPair) -> object:
        if PLAIN in pair.path.name:
            raise IndexError("list index out of range")
        return read(pair)

    monkeypatch.setattr(module, "read_pair", broken)
    report = ingest([logs, fixtures_dir / "json"], store, jobs=1)
    assert (report.added, report.count(FileOutcome.FAILED)) == (1, 2)
    assert "IndexError" in str(report.files[-1].error) or "IndexError" in str(report.files[0].error)


def test_progress_is_told(logs: Path, fixtures_dir: Path, store: Store) -> None:
    calls: list[tuple[int, int]] = []
    ingest([logs], store)
    ingest([logs, fixtures_dir / "json"], store, on_progress=lambda done, total: calls.append((done, total)))
    assert calls == [(1, 2), (2, 2)]


# -- killed in the middle --------------------------------------------------------------------------------------------


def start(samples: Path, store: Path) -> subprocess.Popen[str]:
    """An ingest of the samples in its own process group, as a shell starts it."""
    return subprocess.Popen(
        [COMMAND, "ingest", samples, "--store", store, "--jobs", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_for(condition: Callable[[], object], what: str, seconds: float = 300) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"no {what} after {seconds} s"
        time.sleep(0.02)


def children(pid: int) -> list[int]:
    """Processes whose parent this is, and theirs."""
    found = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in map(int, task.read_text().split()):
            found += [child, *children(child)]
    return found


def workers(pid: int) -> list[int]:
    return [child for server in children(pid) for child in children(server)]


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def complete(samples: Path, root: Path) -> None:
    """Ingesting again gives all four matches, whole, and writes none that was there."""
    store = open_store(root)
    before = len(store.match_ids())
    report = ingest([samples], store, jobs=1)
    assert report.count(FileOutcome.OK) == 8
    assert (report.added, report.replaced, report.unchanged) == (4 - before, 0, before)
    assert len(store.match_ids()) == 4
    assert list((root / "unfinished").iterdir()) == []
    rows = store.sql(
        "select n_frames * 22 = (select count(*) from player_states p where p.match_id = m.match_id) as whole "
        "from matches m"
    ).to_pylist()
    assert len(rows) == 4
    assert all(row["whole"] for row in rows)


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="finds processes by /proc")
@pytest.mark.parametrize("how", ["kill", "interrupt", "kill a worker"])
def test_an_ingest_that_is_stopped_can_go_on(samples_dir: Path, tmp_path: Path, how: str) -> None:
    root, samples = tmp_path / "store", tmp_path / "samples"
    samples.mkdir()
    for path in sorted(samples_dir.glob("*.rc?.xz"))[:8]:
        shutil.copy(path, samples)
    process = start(samples, root)
    try:
        wait_for(lambda: any((root / "matches").glob("*/meta.json")), "match")
        helpers = children(process.pid)
        if how == "kill":
            process.kill()
        elif how == "interrupt":
            os.killpg(process.pid, signal.SIGINT)
        else:
            os.kill(workers(process.pid)[0], signal.SIGKILL)
        out, err = process.communicate(timeout=300)
    finally:
        process.kill()
    assert "Traceback" not in err
    if how == "kill a worker":
        assert process.returncode == 0, err
        assert "8 ok, 0 partial, 0 failed" in out
    else:
        assert process.returncode == (-signal.SIGKILL if how == "kill" else 130), err
    wait_for(lambda: not any(map(alive, helpers)), "end of the workers", 20)
    for path in (root / "matches").iterdir():
        assert json.loads((path / "meta.json").read_text())["match_id"] == path.name
    complete(samples, root)


def test_a_store_that_cannot_be_written(logs: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(StoreError, match="this is a file"):
        create_store(tmp_path / "file")
    with pytest.raises(StoreError, match="cannot be written"):
        create_store(tmp_path / "file" / "store")


def test_a_full_disk_costs_no_match(fixtures_dir: Path, tmp_path: Path) -> None:
    """Short of room for the second match, the first stays, and with room the ingest goes on."""
    logs = [fixtures_dir / "json", fixtures_dir / "v6"]
    for log in logs:
        called("ingest", log, "--store", tmp_path / "whole", "--jobs", "1")
    sizes = sorted(
        sum(path.stat().st_size for path in match.iterdir()) for match in (tmp_path / "whole" / "matches").iterdir()
    )
    with small_disk(tmp_path / "disk", kilobytes=(sizes[0] + sizes[1] // 2) // 1024 + 100) as disk:
        root = disk / "store"
        done = called("ingest", *logs, "--store", root, "--jobs", "1", code=1)
        assert done.stderr.startswith(f"teamclone: {root}: the disk is full; make room and ingest again"), done.stderr
        assert done.stderr.count("\n") == 1
        assert len(open_store(root).match_ids()) <= 1
        subprocess.run(["mount", "-o", "remount,size=64m", disk], check=True)
        ingest(logs, open_store(root), jobs=1)
        assert open_store(root).match_ids() == open_store(tmp_path / "whole").match_ids()
        assert list((root / "unfinished").iterdir()) == []


def test_a_store_on_a_read_only_disk(fixtures_dir: Path, tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", kilobytes=65536) as disk:
        root = disk / "store"
        assert ingest([fixtures_dir / "v6"], create_store(root), jobs=1).added == 1
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        done = called("ingest", fixtures_dir / "json", "--store", root, code=1)
        assert done.stderr.startswith(f"teamclone: {root}: cannot be written (Read-only file system)"), done.stderr
        assert "HELIOS_base" in called("matches", "--store", root).stdout
        called("dataset", "--store", root, "--team", "HELIOS_base", "--out", tmp_path / "ds", "--split", "rows")


def test_two_ingests_at_once(samples_dir: Path, tmp_path: Path) -> None:
    """The second says so and does no harm to the first."""
    root = tmp_path / "store"
    first = start(samples_dir, root)
    try:
        wait_for(lambda: first.poll() is not None or (root / ".lock").exists(), "lock")
        second = called("ingest", samples_dir, "--store", root, code=1)
        out, err = first.communicate(timeout=300)
    finally:
        first.kill()
    assert "another ingest is writing to this store" in second.stderr
    assert first.returncode == 0, err
    assert "12 ok, 0 partial, 0 failed" in out
