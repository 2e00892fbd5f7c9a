"""Logs to a PostgreSQL store and on to a dataset, as users do it, with servers and ingests that stop on the way."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from command import TEAMCLONE, called, teamclone
from postgres import DATABASE, ENCODED, PASSWORD, Server, start_server
from teamclone.dataset.build import DatasetConfig, SplitBy, build_dataset
from teamclone.logs import read_match
from teamclone.store import Store, create_store, ingest, open_store, schema
from teamclone.store.postgres.location import Location
from teamclone.store.status import FileOutcome

N_MATCHES = 2


@pytest.fixture
def url(postgres: Server) -> str:
    return postgres.new_url()


@pytest.fixture(scope="module")
def samples(samples_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two real matches with their command logs."""
    folder = tmp_path_factory.mktemp("samples")
    for path in sorted(samples_dir.glob("*.rc?.xz"))[: 2 * N_MATCHES]:
        shutil.copy(path, folder)
    return folder


@pytest.fixture(scope="module")
def small(fixtures_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two short matches with their command logs."""
    folder = tmp_path_factory.mktemp("small")
    for name in ("json", "v6"):
        shutil.copytree(fixtures_dir / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def reference(samples: Path, tmp_path_factory: pytest.TempPathFactory) -> Store:
    """The same matches in a folder."""
    store = create_store(tmp_path_factory.mktemp("reference") / "store")
    assert ingest([samples], store, jobs=1).added == N_MATCHES
    return store


def start(*arguments: object) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [TEAMCLONE, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def wait_for(condition: Callable[[], object], what: str, seconds: float = 300) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"no {what} after {seconds} s"
        time.sleep(0.05)


def copies_commands(server: Server, name: str) -> bool:
    """Whether an ingest is in the middle of a match: its session copies the largest table."""
    return bool(server.sql(f'select 1 from pg_stat_activity where query like \'COPY "{name}"%"commands"%\''))


def same(store: Store, reference: Store) -> None:
    """Every row of every match, and nothing twice."""
    assert store.match_ids() == reference.match_ids()
    for match_id in reference.match_ids():
        for table in schema.MATCH_TABLES:
            found, wanted = (place.read_table(match_id, table.name) for place in (store, reference))
            assert found.equals(wanted), (match_id, table.name)
    assert [status.to_json() for status in store.files()] == [status.to_json() for status in reference.files()]


def test_every_command_takes_the_url(url: str, fixtures_dir: Path, tmp_path: Path) -> None:
    logs = fixtures_dir / "v6"
    reference = create_store(tmp_path / "reference")
    assert ingest([logs], reference, jobs=1).added == 1
    shown: list[str] = []

    def run(*arguments: object, code: int = 0) -> str:
        done = called(*arguments, "--store", url, code=code)
        shown.extend((done.stdout, done.stderr))
        return done.stdout

    report = json.loads(run("ingest", logs, "--json"))
    assert report["matches"] == {"added": 1, "replaced": 0, "unchanged": 0}
    assert "1 there before" in run("ingest", logs)
    assert json.loads(run("matches", "--json")) == json.loads(
        called("matches", "--json", "--store", reference.location).stdout
    )
    query = "select count(*) as n, max(stamina) as best, sum(count_dash) as dashes from player_states"
    (row,) = json.loads(run("sql", query, "--json"))
    (wanted,) = reference.sql(query).to_pylist()
    assert row == {**wanted, "dashes": int(wanted["dashes"])}
    assert run("validate").startswith("ok ")
    run("dataset", "--team", "HELIOS_base", "--out", tmp_path / "dataset")
    run("sql", "drop table frames", code=2)
    run("sql", "select * from framez", code=2)
    run("matches", "--nonsense", code=2)
    assert not [text for text in shown if PASSWORD in text or ENCODED in text]


def test_a_dataset_is_the_same_from_either_store(url: str, small: Path, tmp_path: Path) -> None:
    reference = create_store(tmp_path / "reference")
    for store in (reference, create_store(url)):
        assert ingest([small], store, jobs=1).added == N_MATCHES
    same(open_store(url), reference)
    config = DatasetConfig(teams=("HELIOS_base",), split=SplitBy.ROWS)
    for name, store, jobs in (("parquet", reference, 1), ("postgresql", open_store(url), 2)):
        build_dataset(config, store=store, out=tmp_path / name, jobs=jobs)
    files = {path.relative_to(tmp_path / "parquet") for path in (tmp_path / "parquet").rglob("*") if path.is_file()}
    assert {path.suffix for path in files} >= {".npy", ".json"}
    assert files == {
        path.relative_to(tmp_path / "postgresql") for path in (tmp_path / "postgresql").rglob("*") if path.is_file()
    }
    assert [
        str(path)
        for path in sorted(files)
        if (tmp_path / "parquet" / path).read_bytes() != (tmp_path / "postgresql" / path).read_bytes()
    ] == []
    ids = {json.loads((tmp_path / name / "dataset.json").read_text())["id"] for name in ("parquet", "postgresql")}
    assert len(ids) == 1


def test_two_ingests_at_once(url: str, small: Path, tmp_path: Path) -> None:
    reference = create_store(tmp_path / "reference")
    ingest([small], reference, jobs=1)
    both = [start("ingest", small, "--store", url, "--jobs", 1, "--json") for _ in range(2)]
    reports = []
    for process in both:
        out, err = process.communicate(timeout=300)
        assert process.returncode == 0, err
        reports.append(json.loads(out))
    for report in reports:  # what came in since its start, by whomever
        assert report["matches"]["added"] + report["matches"]["unchanged"] == N_MATCHES
        assert report["files"] == {"ok": 2 * N_MATCHES, "partial": 0, "failed": 0}
    same(open_store(url), reference)


def test_an_ingest_that_is_killed_leaves_nothing_half(
    postgres: Server, url: str, samples: Path, reference: Store
) -> None:
    create_store(url)
    name = Location.parse(url).schema
    process = start("ingest", samples, "--store", url, "--jobs", "1")
    try:
        wait_for(lambda: copies_commands(postgres, name), "copy of commands")
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate(timeout=300)
    store = open_store(url)
    before = store.match_ids()
    assert len(before) < N_MATCHES
    for match_id in before:
        assert store.read_table(match_id, "commands").num_rows == store.matches()["n_commands"].to_pylist()[0]
    (in_all,) = postgres.sql(f"select count(distinct match_id) from {name}.commands", database=DATABASE)
    assert int(in_all) == len(before)
    report = ingest([samples], store, jobs=1)
    assert (report.added, report.unchanged) == (N_MATCHES - len(before), len(before))
    same(store, reference)


@pytest.fixture
def own_server() -> Iterator[Server]:
    """One that may be stopped while others work."""
    server = start_server()
    yield server
    server.throw_away()


def test_a_server_may_restart_in_the_middle(own_server: Server, samples: Path, reference: Store) -> None:
    url = own_server.new_url()
    name = Location.parse(url).schema
    create_store(url)
    process = start("ingest", samples, "--store", url, "--jobs", "2", "--json")
    try:
        wait_for(lambda: copies_commands(own_server, name), "copy of commands")
        own_server.restart(away_s=0.5)
        out, err = process.communicate(timeout=300)
    finally:
        process.kill()
        process.communicate()
    assert process.returncode == 0, err
    assert json.loads(out)["files"] == {"ok": 2 * N_MATCHES, "partial": 0, "failed": 0}
    same(open_store(url), reference)


def test_reading_while_matches_come_and_go(url: str, fixtures_dir: Path) -> None:
    """A match is seen whole or not at all: its frames and player states always agree."""
    (path,) = (fixtures_dir / "v6").glob("*.rcg.gz")
    match = read_match(path)
    store = create_store(url)
    wrong: list[object] = []
    seen: set[int] = set()
    stop = threading.Event()

    def read() -> None:
        reader = open_store(url)
        while not stop.is_set():
            rows = reader.sql(
                "select n_frames * 22 = (select count(*) from player_states p where p.match_id = m.match_id) as whole "
                "from matches m"
            ).to_pylist()
            seen.add(len(rows))
            wrong.extend(row for row in rows if not row["whole"])

    thread = threading.Thread(target=read)
    thread.start()
    try:
        # The reader is a thread: how often it is given its turn is not ours to say.
        for _ in range(60):
            store.add(match)
            store.remove(match.match_id)
            if seen == {0, 1}:
                break
    finally:
        stop.set()
        thread.join()
    assert not wrong
    assert seen == {0, 1}


def test_bad_files_have_their_status(url: str, fixtures_dir: Path, tmp_path: Path) -> None:
    logs = Path(shutil.copytree(fixtures_dir / "killed", tmp_path / "logs"))
    (logs / "empty.rcg").write_bytes(b"")
    store = create_store(url)
    first = ingest([logs], store, jobs=1)
    assert {first.count(outcome) for outcome in (FileOutcome.PARTIAL, FileOutcome.FAILED)} == {1, 2}
    assert tuple(store.files()) == first.files
    assert ingest([logs], open_store(url), jobs=1).files == first.files


def test_a_missing_driver_is_told(url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "adbc_driver_postgresql").mkdir()
    (tmp_path / "adbc_driver_postgresql" / "__init__.py").write_text(
        "raise ModuleNotFoundError('gone', name='adbc_driver_postgresql')"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    done = teamclone("matches", "--store", url, code=1)
    assert done.stderr == "teamclone: this needs adbc_driver_postgresql: pip install 'teamclone[postgresql]'\n"
