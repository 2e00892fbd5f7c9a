"""What commands print: words of others cannot steer the terminal."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from command import teamclone
from teamclone.cli.common import fail, print_json, print_table, visible

EVIL = "\x1b]0;title\x07\x1b[2JRed\x9b31m\u202eder"
SHOWN = r"\u001b]0;title\u0007\u001b[2JRed\u009b31m\u202eder"


def test_control_characters_are_shown_and_not_obeyed(capsys: pytest.CaptureFixture[str]) -> None:
    assert visible(EVIL) == SHOWN
    assert visible("Grün\t東京\nzwei") == "Grün\t東京\nzwei"
    print_table(["team"], [[EVIL]], title=EVIL)
    print_json({"team": EVIL})
    with pytest.raises(SystemExit):
        fail(EVIL, code=1)
    printed = capsys.readouterr()
    assert not {*printed.out, *printed.err} & {*"\x1b\x07\x9b\u202e"}
    assert printed.out.count(SHOWN) == 3
    assert json.loads(printed.out[printed.out.index("{") :]) == {"team": EVIL}


def test_a_log_with_an_evil_team(tmp_path: Path, fixtures_dir: Path) -> None:
    import gzip

    [log] = (fixtures_dir / "v6").glob("*.rcg.gz")
    name = "\x1b]0;title\x07Evil"
    (tmp_path / "x.rcg").write_bytes(gzip.decompress(log.read_bytes()).replace(b"HELIOS_base", name.encode()))
    shutil.copy(tmp_path / "x.rcg", tmp_path / f"{EVIL}.rcg")
    teamclone("ingest", tmp_path / "x.rcg", "--store", tmp_path / "store")
    for arguments in (
        *(("info", tmp_path), ("info", tmp_path, "--json"), ("validate", tmp_path)),
        *(("matches", "--store", tmp_path / "store"), ("matches", "--store", tmp_path / "store", "--json")),
        ("sql", "select left_name from matches", "--store", tmp_path / "store"),
        ("sql", "select left_name from matches", "--store", tmp_path / "store", "--json"),
    ):
        done = teamclone(*arguments)
        assert not {*done.stdout, *done.stderr} & {*"\x1b\x07\x9b\u202e"}, arguments
        assert "title" in done.stdout or arguments[0] == "validate"
