"""Events as tables and files, and the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import teamclone as tc
from teamclone.cli.app import app
from teamclone.errors import LogError, UsageError
from teamclone.events.definitions import COLUMNS, EventKind
from teamclone.events.table import events_of_logs
from teamclone.logs import find_matches


@pytest.fixture(scope="module")
def log(samples_dir: Path) -> Path:
    return min(samples_dir.glob("*.rcg.xz"))


@pytest.fixture(scope="module")
def events(log: Path) -> tc.MatchEvents:
    return tc.match_events(log)


def invoked(*arguments: object) -> tuple[str, str, int]:
    """Output, errors and exit code of the command."""
    done = CliRunner().invoke(app, ["events", *(str(one) for one in arguments)])
    return done.stdout, done.stderr, done.exit_code


def test_the_table(events: tc.MatchEvents) -> None:
    table = events.to_arrow()
    assert table.column_names == ["match_id", "team", *(one.name for one in COLUMNS)]
    assert table.num_rows == len(events) == sum(events.counts().values()) > 300
    side = events.columns["side"]
    teams = table["team"].to_pylist()
    assert {(int(one), team) for one, team in zip(side, teams, strict=True)} == {
        (1, "HELIOS_base"),
        (-1, "WEBase"),
        (0, None),
    }
    assert table["speed"].null_count == np.isnan(events.columns["speed"]).sum() > 0
    assert repr(events) == f"MatchEvents(HELIOS_base - WEBase, {len(events)} events, {events.match_id})"


def test_some_of_them(events: tc.MatchEvents) -> None:
    some = events.select(kinds=[EventKind.SHOT, EventKind.GOAL], teams=["HELIOS_base"])
    assert set(some.counts()) == {"shot", "goal"}
    assert set(some.columns["side"]) == {1}
    assert len(events.select()) == len(events)
    assert len(events.select(teams=["Nobody"])) == 0


def test_a_match_may_be_read_already(log: Path, events: tc.MatchEvents) -> None:
    again = tc.match_events(tc.read_match(log))
    assert again.to_arrow().equals(events.to_arrow())


def test_a_store_gives_the_same(log: Path, events: tc.MatchEvents, tmp_path: Path) -> None:
    store = tc.create_store(tmp_path / "store")
    store.add(tc.read_match(log))
    again = tc.match_events(events.match_id, store=store)
    assert again.to_arrow().equals(events.to_arrow())
    assert again.statistics() == events.statistics()
    with pytest.raises(tc.TeamcloneError, match="no match 'ffff"):
        tc.match_events("ffff", store=store)
    with pytest.raises(UsageError, match="leave out the store"):
        tc.match_events(tc.read_match(log), store=store)
    counted = store.sql("select kind, count(*) as n from match_events group by kind").to_pylist()
    assert {row["kind"]: row["n"] for row in counted} == events.counts()


@pytest.mark.parametrize("suffix", [".parquet", ".csv", ".jsonl"])
def test_a_file_of_two_matches(samples_dir: Path, tmp_path: Path, suffix: str) -> None:
    logs = sorted(samples_dir.glob("*.rcg.xz"))[:2]
    out = tmp_path / "new" / f"events{suffix}"
    stdout, stderr, code = invoked(*logs, "--out", out, "--kind", "shot", "--kind", "pass")
    assert (stderr, code) == ("", 0)
    assert f"Wrote {out}" in stdout
    if suffix == ".parquet":
        rows = pq.read_table(out).to_pylist()
    elif suffix == ".csv":
        rows = pyarrow.csv.read_csv(out).to_pylist()
    else:
        rows = [json.loads(line) for line in out.read_text().splitlines()]
    found = [tc.match_events(path).select(kinds=[EventKind.SHOT, EventKind.PASS]) for path in logs]
    assert [row["match_id"] for row in rows] == [one.match_id for one in found for _ in range(len(one))]
    for name in ("kind", "outcome", "frame", "other_unum"):
        assert [row[name] or "" for row in rows] == [
            value or "" for one in found for value in one.columns[name].tolist()
        ]
    assert list(out.parent.iterdir()) == [out]


def test_the_command_prints_statistics(log: Path, events: tc.MatchEvents) -> None:
    stdout, _, code = invoked(log)
    assert code == 0
    lines = {line[:26].strip(): line[26:].split() for line in stdout.splitlines()}
    found = events.statistics()
    assert lines[events.match_id] == ["HELIOS_base", "WEBase"]
    assert lines["passes completed"] == [str(found.left.passes_completed), str(found.right.passes_completed)]
    assert lines["possession"] == [f"{found.left.possession:.1%}", f"{found.right.possession:.1%}"]
    assert "WEBase" not in invoked(log, "--team", "HELIOS_base")[0]


def test_the_command_prints_json(log: Path, events: tc.MatchEvents) -> None:
    answer = json.loads(invoked(log, "--json")[0])
    found = events.statistics()
    assert answer == {
        "out": None,
        "matches": [
            {
                **{"path": str(log), "match_id": events.match_id, "error": None, "events": events.counts()},
                "teams": [
                    {"name": "HELIOS_base", "side": "left", **found.left.to_json()},
                    {"name": "WEBase", "side": "right", **found.right.to_json()},
                ],
            }
        ],
    }


def test_a_bad_log_does_not_stop_the_others(log: Path, tmp_path: Path) -> None:
    bad, out = tmp_path / "bad.rcg", tmp_path / "events.csv"
    bad.write_bytes(b"no log")
    stdout, stderr, code = invoked(bad, log, "--out", out)
    assert code == 1
    assert "possession" in stdout
    assert stderr.count("\n") == 1
    assert str(bad) in stderr
    assert pyarrow.csv.read_csv(out).num_rows > 300
    missing = invoked(bad, "--out", tmp_path / "none.csv", "--json")
    assert missing[2] == 1
    answer = json.loads(missing[0])
    assert answer["out"] is None
    assert answer["matches"][0]["error"] == missing[1].removeprefix("teamclone: ").rstrip()
    assert not (tmp_path / "none.csv").exists()


def test_a_command_log_alone_has_no_events(log: Path, tmp_path: Path) -> None:
    alone = tmp_path / "alone.rcl.xz"
    alone.write_bytes(log.with_name(log.name.replace(".rcg", ".rcl")).read_bytes())
    [found] = events_of_logs(find_matches([alone]))
    assert found.events is None
    assert "name its game log" in str(found.error)
    with pytest.raises(LogError, match="name its game log"):
        tc.match_events(alone)


def test_wrong_usage(log: Path, tmp_path: Path) -> None:
    for arguments, text in (
        (("--kind", "passs"), "--kind 'passs' is unknown, choose one of: goal, shot, pass"),
        (("--out", tmp_path / "events.xls"), "expected a name that ends in .parquet, .csv, .jsonl, got .xls"),
        (
            ("--team", "HELIOS", "--out", tmp_path / "events.csv"),
            "no team 'HELIOS' plays in these matches; did you mean HELIOS_base",
        ),
    ):
        done = CliRunner().invoke(app, ["events", str(log), *map(str, arguments)])
        assert text in str(done.exception)
        assert isinstance(done.exception, UsageError)
    assert list(tmp_path.iterdir()) == []
