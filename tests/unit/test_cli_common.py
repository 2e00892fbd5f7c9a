"""What commands print: words of others cannot steer the terminal."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from command import called
from teamclone.cli.common import fail, print_json, print_table, progress, visible

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
    called("ingest", tmp_path / "x.rcg", "--store", tmp_path / "store")
    for arguments in (
        *(("info", tmp_path), ("info", tmp_path, "--json"), ("validate", tmp_path)),
        *(("matches", "--store", tmp_path / "store"), ("matches", "--store", tmp_path / "store", "--json")),
        ("sql", "select left_name from matches", "--store", tmp_path / "store"),
        ("sql", "select left_name from matches", "--store", tmp_path / "store", "--json"),
    ):
        done = called(*arguments)
        assert not {*done.stdout, *done.stderr} & {*"\x1b\x07\x9b\u202e"}, arguments
        assert "title" in done.stdout or arguments[0] == "validate"


def test_without_a_terminal_there_is_no_bar_and_no_colour(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Notebooks and build servers ask for colour by a variable, and keep what is printed as it is."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    with progress("work") as bar:
        bar.advance(bar.add_task("", total=2))
    print_table(["team"], [["Red"]])
    printed = capsys.readouterr()
    assert printed.err == ""
    assert [line.strip() for line in printed.out.splitlines()] == ["team", "Red"]
