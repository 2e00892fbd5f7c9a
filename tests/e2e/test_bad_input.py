"""Wrong usage and bad files: one clear line, exit code 1 or 2, never a traceback."""

from __future__ import annotations

import gzip
import json
import shutil
from pathlib import Path

import pytest

from command import called, teamclone


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, fixtures_dir: Path) -> Path:
    folder = tmp_path_factory.mktemp("bad") / "store"
    called("ingest", fixtures_dir / "v6", "--store", folder)
    return folder


def one_line(stderr: str) -> str:
    lines = stderr.strip().splitlines()
    assert len(lines) == 1, stderr
    assert lines[0].startswith("teamclone: ")
    return lines[0]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        pytest.param(b"", "is empty", id="empty"),
        pytest.param(b"\x00\xff" * 500, "no game log", id="bytes"),
        pytest.param(b"\x00\x01" + bytes(range(256)) * 40, "team's name", id="bytes like version 1"),
        pytest.param(b"PK\x03\x04 a zip archive", "no game log", id="zip"),
        pytest.param(b"ULG6\n", "no frame", id="only a header"),
        pytest.param(b"ULG6\n(show 1 ((b) 0 0 0 0))\n", "22 players", id="no players"),
        pytest.param(gzip.compress(b"hello, this is something else\n"), "no game log", id="gz of something else"),
        pytest.param(gzip.compress(b""), "empty after decompression", id="gz of nothing"),
        pytest.param(b"\x1f\x8b\x08 broken gzip", "damaged", id="broken gz"),
        pytest.param(b"[1, 2", "frame", id="json of something else"),
    ],
)
def test_files_that_are_no_logs(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "bad log.rcg"
    path.write_bytes(content)
    line = one_line(called("info", path, code=1).stderr)
    assert "bad log.rcg" in line
    assert words in line


def test_the_installed_command_says_the_same(tmp_path: Path) -> None:
    (tmp_path / "bad.rcg").touch()
    for name, code in (("bad.rcg", 1), ("nowhere.rcg", 2)):
        told = one_line(teamclone("info", name, cwd=tmp_path, code=code).stderr)
        assert told == one_line(called("info", name, cwd=tmp_path, code=code).stderr)


def test_a_folder_of_good_and_bad_files_keeps_the_good_ones(tmp_path: Path, fixtures_dir: Path) -> None:
    logs = tmp_path / "logs"
    shutil.copytree(fixtures_dir / "v6", logs)
    (logs / "garbage.rcg").write_bytes(b"\x00garbage" * 100)
    done = called("ingest", logs, "--store", tmp_path / "store", code=1)
    assert "garbage.rcg" in done.stdout + done.stderr
    rows = called("sql", "select count(*) n from matches", "--store", tmp_path / "store", "--json").stdout
    assert json.loads(rows) == [{"n": 1}]


def test_a_command_log_alone_and_a_game_log_alone(tmp_path: Path, fixtures_dir: Path) -> None:
    (rcl,) = (fixtures_dir / "v6").glob("*.rcl.gz")
    (rcg,) = (fixtures_dir / "v6").glob("*.rcg.gz")
    for source, code in ((rcl, "no-game-log"), (rcg, "no-command-log")):
        copy = tmp_path / code / source.name
        copy.parent.mkdir()
        shutil.copy(source, copy)
        match = json.loads(called("info", copy, "--json").stdout)
        assert code in {problem["code"] for problem in match["problems"]}
    alone = json.loads(called("info", tmp_path / "no-game-log" / rcl.name, "--json").stdout)
    assert alone["left"]["name"] == "HELIOS_base"
    assert alone["commands"]["dash"] > 0
    assert alone["frames"] == 0


def test_partners_of_different_matches_are_told_apart(tmp_path: Path, fixtures_dir: Path) -> None:
    (rcg,) = (fixtures_dir / "v6").glob("*.rcg.gz")
    (rcl,) = (fixtures_dir / "penalties").glob("*.rcl.gz")
    (same_teams,) = (fixtures_dir / "native-v5").glob("*.rcl.gz")
    for index, other in enumerate((rcl, same_teams)):
        folder = tmp_path / str(index)
        folder.mkdir()
        shutil.copy(rcg, folder / "match.rcg.gz")
        shutil.copy(other, folder / "match.rcl.gz")
        match = json.loads(called("info", folder / "match.rcg.gz", "--json").stdout)
        assert "mismatched" in {problem["code"] for problem in match["problems"]}
        assert match["frames"] > 0


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("info", "nowhere.rcg"), "nowhere.rcg"),
        (("ingest", "nowhere", "--store", "s"), "nowhere"),
        (("sql", "select 1", "--store", "nowhere"), "nowhere"),
        (("dataset", "--store", "nowhere", "--team", "A", "--out", "x"), "nowhere"),
        (("train", "nowhere", "--out", "run"), "nowhere"),
        (("evaluate", "nowhere"), "nowhere"),
        (("report", "nowhere"), "nowhere"),
        (("bench", "nowhere"), "nowhere"),
    ],
)
def test_paths_that_do_not_exist(tmp_path: Path, args: tuple[str, ...], words: str) -> None:
    code = 2 if args[0] in {"info", "ingest"} else 1
    assert words in one_line(called(*args, cwd=tmp_path, code=code).stderr)


def test_a_team_that_does_not_occur(store: Path, tmp_path: Path) -> None:
    done = called("dataset", "--store", store, "--team", "HELIOS_bse", "--out", tmp_path / "x", code=2)
    assert "did you mean HELIOS_base?" in one_line(done.stderr)
    assert not (tmp_path / "x").exists()


def test_an_unseen_opponent_that_does_not_occur(store: Path, tmp_path: Path) -> None:
    options = ("--team", "HELIOS_base", "--unseen", "Nobody", "--out", tmp_path / "x")
    assert "WEBase" in one_line(called("dataset", "--store", store, *options, code=2).stderr)


@pytest.mark.parametrize("option", ["--split", "--commands", "--turn-zero"])
def test_a_choice_that_does_not_exist(store: Path, tmp_path: Path, option: str) -> None:
    options = ("--team", "HELIOS_base", option, "maybe", "--out", tmp_path / "x")
    assert "choose one of" in one_line(called("dataset", "--store", store, *options, code=2).stderr)


def test_a_wrong_query(store: Path) -> None:
    line = one_line(called("sql", "select cyle from frames", "--store", store, code=2).stderr)
    assert "cyle" in line


def test_a_query_that_would_change_the_store(store: Path) -> None:
    called("sql", "drop view frames", "--store", store, code=2)
    called("sql", "copy (select 1) to 'stolen.csv'", "--store", store, code=2)


def test_a_store_of_another_format(store: Path, tmp_path: Path) -> None:
    copy = tmp_path / "store"
    shutil.copytree(store, copy)
    document = json.loads((copy / "store.json").read_text())
    (copy / "store.json").write_text(json.dumps(document | {"format": 99}))
    assert "99" in one_line(called("matches", "--store", copy, code=1).stderr)


@pytest.fixture(scope="module")
def dataset(store: Path) -> Path:
    out = store.with_name("dataset")
    called("dataset", "--store", store, "--team", "HELIOS_base", "--split", "rows", "--out", out)
    return out


def test_a_dataset_of_another_format(dataset: Path, tmp_path: Path) -> None:
    copy = tmp_path / "dataset"
    shutil.copytree(dataset, copy)
    document = json.loads((copy / "dataset.json").read_text())
    (copy / "dataset.json").write_text(json.dumps(document | {"format": 99}))
    assert "99" in one_line(called("train", copy, "--out", tmp_path / "run", code=1).stderr)


def test_a_dataset_is_not_overwritten(dataset: Path, store: Path) -> None:
    options = ("--team", "HELIOS_base", "--split", "rows", "--out", dataset)
    assert "already exists" in one_line(called("dataset", "--store", store, *options, code=1).stderr)
    called("dataset", "--store", store, *options, "--replace")


def test_unknown_settings_are_listed_at_once(dataset: Path, tmp_path: Path) -> None:
    options = ("--set", "train.learnin_rate=1", "--set", "train.epochs=many", "--out", tmp_path / "run")
    line = one_line(called("train", dataset, *options, code=2).stderr)
    assert "learning_rate" in line
    assert "epochs" in line


def test_a_dataset_without_validation_matches_says_so(store: Path, tmp_path: Path) -> None:
    out = tmp_path / "one match"
    called("dataset", "--store", store, "--team", "HELIOS_base", "--out", out)
    assert "validation" in one_line(called("train", out, "--out", tmp_path / "run", code=1).stderr)


def test_a_match_with_nan_commands_loses_only_those(fixtures_dir: Path, tmp_path: Path) -> None:
    called("ingest", fixtures_dir / "nan", "--store", tmp_path / "store")
    query = "select count(*) n from commands where kind = 1 and not valid"
    rows = called("sql", query, "--store", tmp_path / "store", "--json").stdout
    assert json.loads(rows)[0]["n"] > 100
