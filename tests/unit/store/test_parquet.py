"""What is particular to the store in a folder: its layout, formats, moves, and writes that break."""

from __future__ import annotations

import dataclasses
import errno
import json
import shutil
import threading
from pathlib import Path
from typing import Any

import duckdb
import pyarrow.parquet as pq
import pytest

from teamclone.errors import StoreError, UsageError
from teamclone.logs import Match
from teamclone.store import create_store, is_store, open_store, parquet, schema


@pytest.fixture
def filled(tmp_path: Path, match: Match) -> Path:
    """The folder of a store with one match."""
    store = create_store(tmp_path / "filled")
    with store.writing():
        store.add(match)
    return tmp_path / "filled"


def set_marker(root: Path, **changes: Any) -> None:
    marker = json.loads((root / "store.json").read_text())
    (root / "store.json").write_text(json.dumps(marker | changes))


@pytest.mark.parametrize("verb", [open_store, create_store])
@pytest.mark.parametrize(
    ("number", "remedy"), [(schema.FORMAT + 1, "update teamclone"), (0, "ingest the logs anew"), ("x", "ingest")]
)
def test_other_formats_are_refused(filled: Path, verb: Any, number: object, remedy: str) -> None:
    set_marker(filled, format=number, teamclone="9.8")
    assert is_store(filled)
    with pytest.raises(StoreError) as caught:
        verb(filled)
    for part in (f"format {number}", "teamclone 9.8", f"this version reads {schema.FORMAT}", remedy, str(filled)):
        assert part in str(caught.value)


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"kind": "other", "format": 1}', "\x00\xff"])
def test_foreign_markers_are_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "store.json").write_text(content)
    for verb in (open_store, create_store):
        with pytest.raises(StoreError, match=r"store\.json"):
            verb(tmp_path)


def test_what_is_no_store(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "thesis.tex").write_text("x")
    for path, opened, created in (
        (tmp_path / "missing", "no such store", None),
        (tmp_path / "file", "this is a file", "this is a file"),
        (tmp_path / "folder", "holds no store", "holds other things"),
        (tmp_path, "holds no store", "holds other things"),
    ):
        assert not is_store(path)
        with pytest.raises(StoreError, match=opened):
            open_store(path)
        if created is not None:
            with pytest.raises(StoreError, match=created):
                create_store(path)


def test_creating_twice_opens(filled: Path, match: Match) -> None:
    assert create_store(filled).match_ids() == [match.match_id]


@pytest.mark.parametrize("name", ["it's [new] *?", "ünïcode folder", "-dash", "a%b"])
def test_a_store_may_be_moved_anywhere(filled: Path, match: Match, name: str) -> None:
    moved = filled.rename(filled.parent / name)
    store = open_store(moved)
    n_frames = len(match.frames["cycle"])
    assert store.sql("select count(*) as n from frames").to_pylist() == [{"n": n_frames}]
    assert store.matches().num_rows == 1
    with store.writing():
        pass
    with duckdb.connect(str(moved / "store.duckdb"), read_only=True) as other:
        assert other.execute("select count(*) from frames join playmodes on id = playmode").fetchone() == (n_frames,)


def test_one_writer_at_a_time(filled: Path) -> None:
    store = open_store(filled)
    with store.writing(), pytest.raises(StoreError, match="another ingest"), store.writing():
        pass
    with store.writing():
        pass


def test_the_database_is_left_alone_when_it_is_right(filled: Path, match: Match) -> None:
    def stamp() -> int:
        return (filled / "store.duckdb").stat().st_mtime_ns

    before, store = stamp(), open_store(filled)
    with store.writing():
        pass
    assert stamp() == before
    store.remove(match.match_id)
    with store.writing():
        pass
    assert stamp() != before


def test_an_empty_store_has_a_database(tmp_path: Path) -> None:
    with create_store(tmp_path / "store").writing():
        pass
    with duckdb.connect(str(tmp_path / "store" / "store.duckdb"), read_only=True) as other:
        assert other.execute("select * from player_states").fetchall() == []


def test_a_read_only_store_can_be_asked(filled: Path) -> None:
    for path in (filled, *filled.rglob("*")):
        path.chmod(0o555 if path.is_dir() else 0o444)
    try:
        assert open_store(filled).sql("select * from matches").num_rows == 1
    finally:
        for path in (filled, *filled.rglob("*")):
            path.chmod(0o755)


@pytest.mark.parametrize(
    "query",
    [
        "select * from read_text('{secret}')",
        "select * from read_csv('{secret}')",
        "select * from glob('{folder}/*')",
        "select * from '{secret}'",
        "select * from read_text('{store}/matches/../store.json')",
    ],
)
def test_a_query_reads_no_other_file(filled: Path, tmp_path: Path, query: str) -> None:
    secret = tmp_path / "secret.csv"
    secret.write_text("a\n1\n")
    with pytest.raises(UsageError):
        open_store(filled).sql(query.format(secret=secret, folder=tmp_path, store=filled))


def test_a_planted_link_costs_nobody_anything(filled: Path, match: Match, tmp_path: Path) -> None:
    """A store may be somebody else's: what its links and status rows point at is left alone."""
    victim = tmp_path / "victim"
    (victim / "sub").mkdir(parents=True)
    (victim / "diary").write_text("precious")
    store = open_store(filled)
    (filled / "unfinished" / "link").symlink_to(victim)
    with store.writing():
        pass
    assert (victim / "diary").read_text() == "precious"
    assert not list((filled / "unfinished").iterdir())
    (filled / "unfinished").rmdir()
    (filled / "unfinished").symlink_to(victim)
    with pytest.raises(StoreError, match="unfinished: is a link"), store.writing():
        pass
    assert sorted(path.name for path in victim.iterdir()) == ["diary", "sub"]


@pytest.mark.parametrize("match_id", ["/etc", "../..", "..", "", "0" * 15, "0" * 16 + "/x"])
def test_a_status_row_of_no_match_is_left_out(filled: Path, match_id: str) -> None:
    row = {"path": "/a.rcg", "outcome": "ok", "rows": 1, "error": None, "size": 1, "mtime_ns": 1, "content": "0"}
    (filled / "files" / "planted.json").write_text(json.dumps(row | {"match_id": match_id}))
    assert all(status.path != "/a.rcg" for status in open_store(filled).files())
    (filled / "files" / "planted.json").write_text(json.dumps(row | {"match_id": "0" * 16}))
    assert any(status.path == "/a.rcg" for status in open_store(filled).files())


@pytest.mark.parametrize("table", ["matches", "events", "commands"])
def test_a_truncated_file_is_named_whatever_is_asked(filled: Path, table: str) -> None:
    [path] = (filled / "matches").glob(f"*/{table}.parquet")
    path.write_bytes(path.read_bytes()[:-20])
    store = open_store(filled)
    for ask in (store.matches, lambda: store.sql(f"select * from {table}")):
        with pytest.raises(StoreError, match="cannot be read") as error:
            ask()
        assert str(path) in str(error.value)
        assert "\n" not in str(error.value)


def test_leftovers_of_a_killed_ingest_go(filled: Path) -> None:
    left = filled / "unfinished" / "0123456789abcdef-xyz"
    left.mkdir()
    (left / "frames.parquet").write_bytes(b"PAR1")
    store = open_store(filled)
    assert store.sql("select count(*) from frames").num_rows == 1
    with store.writing():
        assert not left.exists()


def test_a_writer_cut_off_puts_all_of_its_match_there_or_nothing(
    tmp_path: Path, match: Match, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its ingest ended, and another is throwing away what it takes for left over, when the last file is written."""
    store = create_store(tmp_path / "store")
    write = parquet._write_match

    def write_as_another_tidies(folder: Path, *arguments: Any, **options: Any) -> None:
        write(folder, *arguments, **options)
        with monkeypatch.context() as halfway:
            halfway.setattr(parquet.shutil, "rmtree", emptied)
            store._tidy()

    def emptied(folder: Path, **_: object) -> None:
        for file in [*folder.rglob("*.*")]:
            if file.is_file():
                file.unlink()

    monkeypatch.setattr(parquet, "_write_match", write_as_another_tidies)
    with pytest.raises(StoreError):
        store.add(match)
    assert store.match_ids() == []
    monkeypatch.undo()
    with store.writing():
        store.add(match)
    assert store.match_ids() == [match.match_id]
    assert list((tmp_path / "store" / "unfinished").iterdir()) == []


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
@pytest.mark.parametrize("nth", [0, 3, 7])
def test_a_full_disk_leaves_no_half_match(
    tmp_path: Path, match: Match, monkeypatch: pytest.MonkeyPatch, number: int, nth: int
) -> None:
    store = create_store(tmp_path / "store")
    write, calls = pq.write_table, iter(range(100))

    def full(*args: Any, **options: Any) -> None:
        if next(calls) == nth:
            raise OSError(number, "No space left on device")
        write(*args, **options)

    monkeypatch.setattr(pq, "write_table", full)
    with pytest.raises(StoreError, match="disk is full") as caught:
        store.add(match)
    assert "\n" not in str(caught.value)
    assert store.match_ids() == []
    assert list((tmp_path / "store" / "unfinished").iterdir()) == []
    monkeypatch.undo()
    store.add(match)
    assert store.match_ids() == [match.match_id]


def test_damaged_files_are_named(filled: Path, match: Match) -> None:
    store = open_store(filled)
    folder = filled / "matches" / match.match_id
    data = (folder / "frames.parquet").read_bytes()
    (folder / "frames.parquet").write_bytes(data[: len(data) // 2])
    with pytest.raises(StoreError, match=r"frames\.parquet: cannot be read .*ingest the match again"):
        store.read_table(match.match_id, "frames")
    (folder / "frames.parquet").unlink()
    with pytest.raises(StoreError, match=r"frames\.parquet: is missing"):
        store.read_table(match.match_id, "frames")
    pq.write_table(store.read_table(match.match_id, "events"), folder / "frames.parquet")
    with pytest.raises(StoreError, match=r"frames\.parquet: cannot be read .*FieldRef"):
        store.read_table(match.match_id, "frames")


def test_reading_while_matches_come_and_go(filled: Path, match: Match) -> None:
    """A match is seen whole or not at all: its frames and player states always agree."""
    seen: set[int] = set()
    wrong: list[object] = []
    stop = threading.Event()

    def read() -> None:
        while not stop.is_set():
            rows = open_store(filled).sql(
                "select n_frames, n_frames * 22 = (select count(*) from player_states p where p.match_id = m.match_id) "
                "as whole from matches m"
            )
            seen.add(rows.num_rows)
            wrong.extend(row for row in rows.to_pylist() if not row["whole"])

    reader = threading.Thread(target=read)
    reader.start()
    try:
        writer = open_store(filled)
        for number in range(12):
            writer.add(dataclasses.replace(match, match_id=f"{number:016x}"))
    finally:
        stop.set()
        reader.join()
    assert not wrong
    assert max(seen) > 1


def test_folders_beside_the_matches_do_no_harm(filled: Path, match: Match) -> None:
    shutil.copytree(filled / "matches" / match.match_id, filled / "backup" / match.match_id)
    assert open_store(filled).match_ids() == [match.match_id]
