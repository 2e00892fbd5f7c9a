"""The command on real logs: info, ingest, matches, sql, validate, and their answers to bad input."""

from __future__ import annotations

import csv
import gzip
import io
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from command import called
from teamclone.logs import read_match
from teamclone.rcss.commands import CommandKind

WEBASE = "20261122113747-WEBase_1-vs-HELIOS_base_8"


def one_line(done: subprocess.CompletedProcess[str]) -> str:
    """The one line of an error."""
    (line,) = done.stderr.splitlines()
    assert line.startswith("teamclone: ")
    return line


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory, samples_dir: Path, fixtures_dir: Path) -> Path:
    """Two of the samples, a shoot-out and a match whose server was killed."""
    folder = tmp_path_factory.mktemp("logs")
    for path in sorted(samples_dir.glob("*WEBase*")):
        shutil.copy(path, folder)
    for name in ("penalties", "killed"):
        shutil.copytree(fixtures_dir / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def ingested(logs: Path) -> tuple[Path, dict[str, Any]]:
    """A store of them, and what ``ingest --json`` said."""
    store = logs.parent / "store"
    return store, json.loads(called("ingest", logs, "--store", store, "--json").stdout)


def test_ingest_reports(ingested: tuple[Path, dict[str, Any]], logs: Path) -> None:
    store, report = ingested
    assert report["matches"] == {"added": 4, "replaced": 0, "unchanged": 0}
    assert report["files"] == {"ok": 6, "partial": 2, "failed": 0}
    assert {row["outcome"] for row in report["status"] if "killed" in row["path"]} == {"partial"}
    again = called("ingest", logs, "--store", store).stdout
    assert "0 added, 0 replaced, 4 there before" in again
    assert "incomplete.rcg.gz: byte 1017410: compressed data ends early" in again


def test_matches(ingested: tuple[Path, dict[str, Any]]) -> None:
    table = called("matches", "--store", ingested[0]).stdout
    assert "4 matches" in table
    (line,) = [line for line in table.splitlines() if "1 : 8" in line]
    assert line.split()[:4] == [line.split()[0], "2026-11-22", "11:37:47", "WEBase"]
    assert "0 (0) : 0 (1)" in table
    rows = json.loads(called("matches", "--store", ingested[0], "--json").stdout)
    assert [row["left_name"] for row in rows] == ["HELIOS_base", "HELIOS_base", "WEBase", "HELIOS_base"]
    assert [row["complete"] for row in rows] == [True, True, True, False]


def test_sql_prints_tables_csv_and_json(
    ingested: tuple[Path, dict[str, Any]], samples_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = ingested[0]
    query = (
        "select game_log, name, count(*) as n, sum(arg0) as total, max(ball_x) as x from commands "
        "join matches using (match_id) join command_kinds on id = kind join frames using (match_id, frame) "
        f"where game_log like '{WEBASE}%' and unum > 0 and name in ('kick', 'tackle') group by all order by n desc"
    )
    match = read_match(samples_dir / f"{WEBASE}.rcg.xz")
    of_players = match.commands["kind"][(match.commands["unum"] > 0) & (match.commands["frame"] >= 0)]
    expected = [int((of_players == kind).sum()) for kind in (CommandKind.KICK, CommandKind.TACKLE)]
    as_json = json.loads(called("sql", query, "--store", store, "--json").stdout)
    assert [row["n"] for row in as_json] == expected
    monkeypatch.setattr("sys.stdin", io.StringIO(query))
    as_csv = list(csv.DictReader(io.StringIO(called("sql", "-", "--store", store, "--csv").stdout)))
    assert [int(row["n"]) for row in as_csv] == expected
    assert [row["name"] for row in as_csv] == ["kick", "tackle"]
    assert len(as_csv[0]["x"]) <= 8
    assert float(as_csv[0]["x"]) == as_json[0]["x"]
    table = called("sql", query, "--store", store).stdout
    assert table.split()[:5] == ["game_log", "name", "n", "total", "x"]
    assert str(expected[0]) in table


def test_sql_limits_tables_only(ingested: tuple[Path, dict[str, Any]]) -> None:
    store, query = ingested[0], "select frame from frames order by match_id, frame"
    table = called("sql", query, "--store", store)
    assert len(table.stdout.splitlines()) == 201
    assert "first 200 rows" in one_line(table)
    everything = called("sql", query, "--store", store, "--csv")
    assert everything.stderr == ""
    assert len(everything.stdout.splitlines()) == 1 + 2579 + 2509 + 772 + 312


def test_sql_json_is_strict(ingested: tuple[Path, dict[str, Any]]) -> None:
    query = (
        "select 'nan'::double as a, 'inf'::real as b, null as c, [1, null] as d, {'k': 1.5::decimal(3, 1)} as e, "
        "timestamp '2026-01-02 03:04:05' as f, 0.1::real as g, sum(1)::hugeint as h, true as i from range(3)"
    )
    done = called("sql", query, "--store", ingested[0], "--json")

    def refuse(word: str) -> None:
        raise AssertionError(word)

    assert json.loads(done.stdout, parse_constant=refuse) == [
        {
            "a": None,
            "b": None,
            "c": None,
            "d": [1, None],
            "e": {"k": 1.5},
            "f": "2026-01-02 03:04:05",
            "g": 0.1,
            "h": 3,
            "i": True,
        }
    ]
    assert json.loads(called("sql", "select 1 as a where false", "--store", ingested[0], "--json").stdout) == []


def test_bad_sql_is_wrong_usage(ingested: tuple[Path, dict[str, Any]]) -> None:
    store = ingested[0]
    assert '"cycle"' in one_line(called("sql", "select cycel from frames", "--store", store, code=2))
    assert "only reads" in one_line(called("sql", "drop view frames", "--store", store, code=2))
    assert "exclude" in one_line(called("sql", "select 1", "--store", store, "--csv", "--json", code=2))


@pytest.mark.parametrize("command", [("matches",), ("sql", "select 1"), ("validate",)])
def test_a_missing_store(command: tuple[str, ...], tmp_path: Path) -> None:
    line = one_line(called(*command, "--store", tmp_path / "none", code=1))
    assert "no such store" in line
    assert "teamclone ingest" in line


def test_info(logs: Path, samples_dir: Path, tmp_path: Path) -> None:
    (tmp_path / "empty.rcg").write_bytes(b"")
    done = called("info", logs, logs / "killed", samples_dir / f"{WEBASE}.rcl.xz", tmp_path, "--json", code=1)
    assert "empty.rcg: is empty" in one_line(done)
    found = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(found) == 5
    (killed,) = [match for match in found if "killed" in match["path"]]
    (shoot_out,) = [match for match in found if "penalties" in match["path"]]
    samples = [match for match in found if WEBASE in match["path"]]
    assert len(samples) == 2, "in the folder, and named by its command log"
    assert killed["complete"] is False
    assert {problem["code"] for problem in killed["problems"]} >= {"truncated", "incomplete"}
    truncated = next(problem for problem in killed["problems"] if problem["code"] == "truncated")
    assert (truncated["severity"], truncated["byte"]) == ("warning", 1017410)
    assert truncated["path"].endswith("incomplete.rcg.gz")
    assert shoot_out["right"] == {"name": "HELIOS_B", "score": 0, "penalties_scored": 1, "penalties_missed": 1}
    match = read_match(samples_dir / f"{WEBASE}.rcg.xz")
    of_players = match.commands["kind"][match.commands["unum"] > 0]
    for sample in samples:
        assert sample["path"].endswith(".rcg.xz")
        assert sample["log_version"] == "6"
        assert (sample["left"]["name"], sample["left"]["score"]) == ("WEBase", 1)
        assert (sample["right"]["name"], sample["right"]["score"]) == ("HELIOS_base", 8)
        assert (sample["frames"], sample["play_on_frames"]) == (2509, 1772)
        assert sample["problems"] == []
        assert sum(sample["commands"].values()) == len(of_players)
        for kind in (CommandKind.DASH, CommandKind.SAY, CommandKind.DONE):
            assert sample["commands"][kind.name.lower()] == (of_players == kind).sum()
        assert "change_player_type" not in sample["commands"]


def test_info_for_people(fixtures_dir: Path) -> None:
    text = called("info", fixtures_dir / "nan", fixtures_dir / "onesided").stdout
    assert "HELIOS_base 0 : 0 YuShan2024" in text
    assert "HELIOS_base 0 : 0 no team" in text
    assert "refused by the server's parser" in text
    assert "no right team connected" in text


def test_info_wants_files_that_exist(tmp_path: Path) -> None:
    assert "no such file" in one_line(called("info", tmp_path / "none.rcg", code=2))
    assert "no .rcg or .rcl file" in one_line(called("info", tmp_path, code=2))


def test_validate(ingested: tuple[Path, dict[str, Any]], fixtures_dir: Path) -> None:
    store = ingested[0]
    done = called("validate", store, fixtures_dir / "v6", "--jobs", 1)
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["ok"] * 5 + ["5"]
    odd = called(
        "validate",
        fixtures_dir / "v6",
        fixtures_dir / "killed",
        fixtures_dir / "converted",
        "--json",
        "--jobs",
        1,
        code=1,
    )
    verdicts = {Path(verdict["name"]).name: verdict for verdict in map(json.loads, odd.stdout.splitlines())}
    assert [name for name, verdict in verdicts.items() if not verdict["ok"]] == ["3.rcg.gz", "incomplete.rcg.gz"]
    # The league's converter to version 3 writes the ball's vx into vy: impossible speeds, which a rule finds.
    assert [finding["check"] for finding in verdicts["3.rcg.gz"]["findings"]] == ["ball-speed"]
    assert "nothing to validate" in one_line(called("validate", code=2))


def test_validate_physics(ingested: tuple[Path, dict[str, Any]], fixtures_dir: Path, tmp_path: Path) -> None:
    store, _ = ingested
    [log] = (fixtures_dir / "v6").glob("*.rcg.gz")
    done = called("validate", "--physics", "--store", store, log, "--jobs", 1)
    of_log, *of_store, _ = done.stdout.splitlines()
    assert "; physics of 149 cycles" in of_log
    assert len(of_store) == 4
    assert all("; physics " in line for line in of_store)
    old = called("validate", "--physics", fixtures_dir / "native-v3", "--jobs", 1)
    assert "physics not checked: expected a log that lists the server's parameters, got one without" in old.stdout
    edited = tmp_path / "edited.rcg"
    edited.write_bytes(gzip.decompress(log.read_bytes()).replace(b"(ball_decay 0.94)", b"(ball_decay 0.95)"))
    shutil.copy(log.with_name(log.name.replace(".rcg", ".rcl")), tmp_path / "edited.rcl.gz")
    assert called("validate", edited, "--jobs", 1).stdout.startswith("ok")
    done = called("validate", "--physics", "--json", edited, "--jobs", 1, code=1)
    [checked] = [json.loads(line) for line in done.stdout.splitlines()]
    assert checked["physics"]["cycles"] == 149
    assert checked["physics"]["left_out"] is None
    finding = checked["findings"][0]
    assert finding["check"] == "physics-position"
    assert "ball_decay is 0.94, not 0.95 as the header says" in finding["what"]


def test_validate_finds_a_damaged_store(ingested: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    store = Path(shutil.copytree(ingested[0], tmp_path / "store"))
    first, second, third, _ = sorted((store / "matches").iterdir())
    (first / "frames.parquet").write_bytes(b"PAR1")
    shutil.copy(second / "commands.parquet", third / "commands.parquet")
    done = called("validate", "--store", store, "--jobs", 1, code=1)
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["wrong", "ok", "wrong", "ok", "4"]
    assert "frames.parquet: cannot be read" in done.stdout
    assert "rows in commands" in done.stdout


def test_ingest_of_bad_files_fails_but_keeps_the_rest(tmp_path: Path, fixtures_dir: Path) -> None:
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "letter.rcg").write_text("Dear referee\n")
    shutil.copytree(fixtures_dir / "v6", tmp_path / "logs" / "v6")
    done = called("ingest", tmp_path / "logs", "--store", tmp_path / "store", "--jobs", 1, code=1)
    assert "letter.rcg: is no game log" in done.stdout
    assert "files: 2 ok, 0 partial, 1 failed" in done.stdout
    strict = called("ingest", tmp_path / "logs", "--store", tmp_path / "other", "--strict", "--jobs", 1, code=1)
    assert "letter.rcg: is no game log" in one_line(strict)
    (tmp_path / "store" / "store.json").write_text('{"kind": "teamclone store", "format": 99, "teamclone": "9.9"}')
    assert "format 99" in one_line(called("ingest", tmp_path / "logs", "--store", tmp_path / "store", code=1))


@pytest.mark.parametrize("name", ["info", "ingest", "matches", "sql", "validate"])
def test_every_option_is_documented(name: str) -> None:
    from typer.main import get_command

    from teamclone.cli.app import app
    from teamclone.store.checks import CHECKS

    page = (Path(__file__).resolve().parents[2] / "docs" / "reference" / "commands" / f"{name}.md").read_text()
    command = get_command(app).commands[name]  # type: ignore[attr-defined]
    for parameter in command.params:
        for option in parameter.opts:
            assert not option.startswith("--") or f"`{option}" in page, option
    if name == "validate":
        for check in CHECKS:
            assert f"| `{check.name}` | {check.about} |" in page
