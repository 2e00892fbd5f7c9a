"""What every store must do, whatever keeps its rows."""

from __future__ import annotations

import dataclasses
import os
import re
from pathlib import Path

import numpy as np
import pytest

from teamclone.errors import StoreError, UsageError
from teamclone.logs import Match, columns, read_match
from teamclone.rcss import player_types
from teamclone.rcss.playmodes import PlayMode
from teamclone.store import Store, convert, schema
from teamclone.store.status import FileOutcome, FileStatus
from teamclone.store.store import Added


def assert_same(read: np.ndarray, logged: np.ndarray, name: str) -> None:
    assert read.dtype == logged.dtype, name
    assert read.shape == logged.shape, name
    np.testing.assert_array_equal(read, logged, err_msg=name)


def test_a_match_comes_back_as_it_was(store: Store, any_match: Match) -> None:
    assert store.add(any_match) is Added.ADDED
    assert store.match_ids() == [any_match.match_id]
    for table, logged, specs in (
        ("frames", any_match.frames, columns.FRAMES),
        ("player_states", any_match.players, columns.PLAYERS),
        ("commands", any_match.commands, columns.COMMANDS),
        ("events", any_match.events, columns.EVENTS),
    ):
        read = store.read_match_columns(any_match.match_id, table)
        for spec in specs:
            assert_same(read[spec.name], logged[spec.name], f"{table}.{spec.name}")
    types = store.read_match_columns(any_match.match_id, "player_types")
    for name in player_types.FIELDS:
        assert_same(types[name], any_match.game.player_types[name], name)
    assert store.read_parameters(any_match.match_id) == {
        "server": any_match.game.server_params,
        "player": any_match.game.player_params,
    }


def test_tables_come_back_in_their_order(store: Store, any_match: Match) -> None:
    tables = convert.tables_of(any_match)
    store.add(dataclasses.replace(any_match, match_id="0" * 16))  # another one between the rows
    store.add(any_match)
    for name, rows in tables.items():
        assert store.read_table(any_match.match_id, name).equals(rows), name
        wanted = rows.column_names[::-2]
        assert store.read_table(any_match.match_id, name, columns=wanted).equals(rows.select(wanted)), name


def test_texts_come_back(store: Store, any_match: Match) -> None:
    store.add(any_match)
    texts = store.read_match_columns(any_match.match_id, "commands", columns=["text"])["text"]
    assert list(texts) == [any_match.command_text(index) for index in range(len(any_match.commands["cycle"]))]
    events = store.read_match_columns(any_match.match_id, "events", columns=["text"])["text"]
    assert tuple(events) == any_match.event_texts


def test_bytes_that_are_no_text_are_replaced(store: Store, match: Match) -> None:
    log = match.log
    assert log is not None
    first = int(np.flatnonzero(log.commands["text_stop"] - log.commands["text_start"] > 3)[0])
    start = int(log.commands["text_start"][first])
    odd = dataclasses.replace(log, text=log.text[:start] + b"\xff\xfe" + log.text[start + 2 :])
    store.add(dataclasses.replace(match, log=odd))
    texts = store.read_match_columns(match.match_id, "commands", columns=["text"])["text"]
    assert texts[first].startswith("\ufffd\ufffd")
    assert texts[first + 1] == match.command_text(first + 1)


def test_zero_bytes_are_replaced(store: Store, match: Match) -> None:
    game = dataclasses.replace(match.game, server_params={"a\0": 1.0, "b": "\0"})
    store.add(dataclasses.replace(match, game=game))
    assert store.read_parameters(match.match_id)["server"] == {"a\ufffd": 1.0, "b": "\ufffd"}


def test_player_columns_name_their_players(store: Store, match: Match) -> None:
    store.add(match)
    read = store.read_match_columns(match.match_id, "player_states", columns=["unum", "side", "frame"])
    assert list(read) == ["unum", "side", "frame"]
    assert read["unum"].shape == (len(match.frames["cycle"]), 22)
    assert read["unum"][0].tolist() == [*range(1, 12), *range(1, 12)]
    assert read["side"][-1].tolist() == [1] * 11 + [-1] * 11
    assert (read["frame"] == np.arange(len(match.frames["cycle"]))[:, None]).all()


def test_the_row_of_a_match(store: Store, match: Match) -> None:
    store.add(match)
    (row,) = store.matches().to_pylist()
    assert row["match_id"] == match.match_id
    assert str(row["started_at"]) == "2026-11-22 11:31:17"
    assert (row["left_name"], row["left_score"]) == ("HELIOS_base", 0)
    assert (row["right_name"], row["right_score"]) == ("WEBase", 0)
    assert row["n_frames"] == 199
    assert row["n_play_on_frames"] == np.count_nonzero(match.frames["playmode"] == PlayMode.PLAY_ON)
    assert row["n_commands"] == len(match.commands["cycle"])
    assert row["complete"] is True
    assert row["log_version"] == "6"
    assert row["game_log"] == "20261122113117-HELIOS_base_0-vs-WEBase_0.rcg.gz"


def test_penalties_and_absent_teams(store: Store, fixtures_dir: Path) -> None:
    for folder in ("penalties", "onesided"):
        store.add(read_match(next((fixtures_dir / folder).glob("*.rcg.gz"))))
    shoot_out, onesided = store.matches().to_pylist()
    assert (shoot_out["left_penalties_scored"], shoot_out["right_penalties_scored"]) == (0, 1)
    assert onesided["right_name"] is None


def test_a_command_log_alone(store: Store, fixtures_dir: Path, tmp_path: Path) -> None:
    (path,) = (fixtures_dir / "v6").glob("*.rcl.gz")
    alone = tmp_path / path.name
    alone.write_bytes(path.read_bytes())
    match = read_match(alone)
    store.add(match)
    (row,) = store.matches().to_pylist()
    assert (row["n_frames"], row["game_log"], row["log_version"]) == (0, None, "none")
    assert row["n_commands"] == len(match.commands["cycle"]) > 0
    assert store.read_match_columns(match.match_id, "player_states", columns=["x"])["x"].shape == (0, 22)


def test_sql_sees_what_numpy_sees(store: Store, match: Match) -> None:
    store.add(match)
    (row,) = store.sql(
        "select count(*) as n, sum(count_dash) as dashes, count(pointto_x) as pointing, max(x) as x "
        "from player_states join frames using (match_id, frame) "
        "join playmodes on playmodes.id = playmode where playmodes.name = 'play_on'"
    ).to_pylist()
    playing = match.frames["playmode"] == PlayMode.PLAY_ON
    assert row["n"] == playing.sum() * 22
    assert int(row["dashes"]) == match.players["count_dash"][playing].sum()
    assert row["pointing"] == np.isfinite(match.players["pointto_x"][playing]).sum()
    assert row["x"] == match.players["x"][playing].max()


def test_differences_cannot_overflow(store: Store, match: Match) -> None:
    store.add(match)
    assert store.sql("select min(unum - 11) as d, min(state - 100000) as e from player_states").to_pylist() == [
        {"d": -10, "e": int(match.players["state"].min()) - 100000}
    ]


TYPES = {
    "float": "real",
    "tinyint": "smallint",
    "double precision": "double",
    "text": "varchar",
    "timestamp without time zone": "timestamp",
}
"""Other names of a type, and the next larger one where a server lacks the type."""


@pytest.mark.parametrize("filled", [False, True], ids=["empty", "filled"])
def test_every_table_has_its_columns(store: Store, match: Match, filled: bool) -> None:
    if filled:
        store.add(match)
    for table in schema.TABLES:
        described = store.sql(
            "select column_name, data_type from information_schema.columns "
            f"where table_schema = current_schema() and table_name = '{table.name}' order by ordinal_position"
        ).to_pylist()
        assert [
            (row["column_name"], TYPES.get(row["data_type"].lower(), row["data_type"].lower())) for row in described
        ] == [(field.name, TYPES.get(field.sql_type, field.sql_type)) for field in table.fields]
        n_rows = store.sql(f"select count(*) as n from {table.name}").to_pylist()[0]["n"]
        assert (n_rows > 0) == (filled or bool(table.rows)) or table.name == "problems"


def test_keys_identify_rows(store: Store, any_match: Match) -> None:
    store.add(any_match)
    for table in schema.TABLES:
        if table is schema.PROBLEMS:  # several may speak of one place
            continue
        key = ", ".join(f'"{name}"' for name in table.key)
        assert store.sql(f"select {key} from {table.name} group by {key} having count(*) > 1").num_rows == 0, table.name


@pytest.mark.parametrize(
    ("query", "part"),
    [
        ("select nothing from frames", "nothing"),
        ("select * from framez", "framez"),
        ("select 1 from", "syntax error"),
        ("selec 1", "syntax error|SELEC"),
        ("", "one SQL statement, got 0"),
        ("-- nothing", "one SQL statement, got 0"),
        ("select 1; select 2", "one SQL statement, got"),
        ("select 1; drop table frames", "one SQL statement, got"),
        ("drop view frames", "only reads"),
        ("create table t as select 1", "only reads"),
        ("insert into frames select * from frames", "only reads"),
        ("copy frames to 'stolen.csv'", "only reads"),
        ("explain analyze copy (select 1) to 'stolen.csv'", "only reads"),
        ("attach 'other.db'", "only reads"),
        ("select 1) to 'stolen.csv' --", "syntax error"),
        ("select cast(name as int) from playmodes", "Could not convert|invalid input syntax"),
        ("select * from match", "match"),
    ],
)
def test_bad_queries_are_told_in_one_line(
    store: Store, query: str, part: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    match = "local variables stay unseen"
    assert match
    with pytest.raises(UsageError) as caught:
        store.sql(query)
    assert re.search(part, str(caught.value))
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "stolen.csv").exists()


@pytest.mark.parametrize(
    "query", ["select 1 as n;", " select 1 as n ; \n", "/* a */ select 1 as n -- b", "(select 1 as n)"]
)
def test_one_statement_in_any_form(store: Store, query: str) -> None:
    assert store.sql(query).to_pylist() == [{"n": 1}]
    assert store.sql(query.replace("1", "0.5")).to_pylist() == [{"n": 0.5}]


def test_rows_come_batch_by_batch_and_may_be_left(store: Store, match: Match) -> None:
    store.add(match)
    rows = store.stream("select * from player_states")
    first = next(iter(rows.batches))
    assert 0 < first.num_rows <= len(match.frames["cycle"]) * 22
    del rows
    assert store.match_ids() == [match.match_id]


def test_unknown_names_list_near_ones(store: Store, match: Match) -> None:
    store.add(match)
    with pytest.raises(UsageError, match="did you mean frames"):
        store.read_table(match.match_id, "frame")
    with pytest.raises(UsageError, match="did you mean ball_x"):
        store.read_match_columns(match.match_id, "frames", columns=["ballx"])
    with pytest.raises(StoreError, match=f"did you mean {match.match_id}"):
        store.read_table(match.match_id[:-1], "frames")


def test_adding_again_changes_nothing(store: Store, match: Match) -> None:
    assert store.add(match) is Added.ADDED
    assert store.add(match) is Added.UNCHANGED
    assert store.match_ids() == [match.match_id]


def test_commands_that_come_later_complete_a_match(store: Store, match: Match) -> None:
    alone = dataclasses.replace(match, log=None, rcl_path=None)
    assert store.add(alone) is Added.ADDED
    executed = store.matches()["n_commands"].to_pylist()[0]
    assert 0 < executed < len(match.commands["cycle"])
    assert store.add(match) is Added.REPLACED
    assert store.matches()["n_commands"].to_pylist() == [len(match.commands["cycle"])]
    assert store.add(alone) is Added.UNCHANGED
    assert store.matches()["n_commands"].to_pylist() == [len(match.commands["cycle"])]


def test_without_a_command_log_the_game_log_gives_commands(store: Store, match: Match) -> None:
    store.add(match)
    alone = dataclasses.replace(match, match_id="0" * 16, log=None, rcl_path=None)
    store.add(alone)
    logged, recovered = (
        store.sql(
            "select c.frame, c.side, c.unum, k.name as kind, c.arg0, c.low0, c.high0 from commands c "
            "join command_kinds k on c.kind = k.id join command_sources s on c.source = s.id "
            f"where s.name = '{source}' and match_id = '{match_id}' and k.name in ('dash', 'turn', 'kick') "
            "and unum > 0 order by c.line"
        )
        for source, match_id in (("logged", match.match_id), ("recovered", alone.match_id))
    )
    assert recovered.num_rows > 0.6 * logged.num_rows  # the others have no frame, or were not executed
    keys = ("frame", "side", "unum", "kind")
    sent = set(zip(*(logged[name].to_pylist() for name in keys), strict=True))
    assert sent.issuperset(zip(*(recovered[name].to_pylist() for name in keys), strict=True))
    assert logged["low0"].null_count == logged["high0"].null_count == logged.num_rows
    assert recovered["arg0"].null_count < 0.01 * recovered.num_rows
    assert recovered["low0"].null_count == recovered["arg0"].null_count
    assert [row["n_problems"] for row in store.matches().to_pylist()] == [len(alone.problems), len(match.problems)]


def test_what_a_game_log_cannot_give_is_a_note(store: Store, fixtures_dir: Path) -> None:
    (log,) = (fixtures_dir / "native-v2").glob("*.rcg*")
    match = dataclasses.replace(read_match(log), log=None, rcl_path=None)
    store.add(match)
    found = store.read_table(match.match_id, "problems").to_pylist()
    notes = [row["text"] for row in found if row["code"] == "not-recovered"]
    assert notes
    assert all(note.startswith("the game log alone does not give ") for note in notes)
    assert {row["severity"] for row in found if row["code"] == "not-recovered"} == {"note"}


def test_a_defect_of_the_physics_costs_no_match(store: Store, match: Match, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*arguments: object, **options: object) -> None:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(convert, "recovered_commands", fails)
    alone = dataclasses.replace(match, log=None, rcl_path=None)
    assert store.add(alone) is Added.ADDED
    assert store.matches()["n_commands"].to_pylist() == [0]
    texts = store.read_table(match.match_id, "problems")["text"].to_pylist()
    assert any("ZeroDivisionError: by zero" in text for text in texts)


def test_removing(store: Store, match: Match) -> None:
    store.add(match)
    store.remove(match.match_id)
    store.remove(match.match_id)
    assert store.match_ids() == []
    assert store.sql("select * from frames").num_rows == 0
    assert store.add(match) is Added.ADDED


def test_the_status_of_files_is_kept(store: Store) -> None:
    odd = os.fsdecode(b"/logs/\xff 'quoted' \\u0041 \\\\ \n\"name\".rcg")
    statuses = [
        FileStatus(
            path=path,
            outcome=FileOutcome.FAILED,
            rows=0,
            match_id=None,
            error=f"{path}: nothing",
            size=3,
            mtime_ns=1_800_000_000_123_456_789,
            content=None,
        )
        for path in ("/logs/a.rcg", odd)
    ]
    store.save_files(statuses)
    store.save_files([dataclasses.replace(statuses[0], outcome=FileOutcome.OK)])
    assert store.files() == sorted(
        [dataclasses.replace(statuses[0], outcome=FileOutcome.OK), statuses[1]], key=lambda status: status.path
    )


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("20240718101530-A_2-vs-B_1.rcg.gz", "2024-07-18 10:15:30"),
        ("202407181015-A_2-vs-B_1.rcg", "2024-07-18 10:15:00"),
        ("20249918101530-A_2-vs-B_1.rcg", "None"),
        ("incomplete.rcg", "None"),
    ],
)
def test_the_start_is_told_by_the_name(name: str, expected: str) -> None:
    assert str(convert.started_at(Path("logs") / name)) == expected
