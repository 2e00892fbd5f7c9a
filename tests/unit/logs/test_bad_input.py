"""Whatever the bytes: a match with what was readable, or one ``LogError`` that names the file. Nothing else."""

from __future__ import annotations

import bz2
import gzip
import lzma
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamclone.errors import LogError, UsageError
from teamclone.logs import Match, find_matches, read_match
from teamclone.logs.match import GameLog
from teamclone.logs.rcl import read_commands
from teamclone.logs.read import read_game
from teamclone.store.convert import tables_of

HERE = Path("some.rcg")


FORMATS = ("v6", "native-v5", "native-v4", "native-v3", "native-v2", "native-v1", "json")
N_FRAMES = 2


@pytest.fixture(scope="module")
def short(rcg_of: Callable[[str], Path]) -> Callable[[str], bytes]:
    """The first two frames of a real log with one of its player types, without its parameters."""

    @cache
    def cut(name: str) -> bytes:
        data = gzip.decompress(rcg_of(name).read_bytes())
        if data.startswith((b"ULG4", b"ULG5", b"ULG6", b"[")):
            lines = data.splitlines(keepends=True)
            shows = [index for index, line in enumerate(lines) if line.startswith((b"(show", b'{"show'))]
            head = [
                line
                for line in lines[: shows[0]]
                if not re.search(rb"_param |_param\"|player_type.*id.{1,2}[1-9]", line)
            ]
            kept = head + lines[shows[0] : shows[0] + N_FRAMES] + lines[shows[-1] + 1 :]
            # Two players say as much of a JSON log as 22 do.
            return b"".join(re.sub(rb"(unum.:2,.*?}).*]}}", rb"\1]}}", line) for line in kept)
        if data.startswith(b"ULG\x02"):
            return data[: 4 + N_FRAMES * 318]
        if data.startswith(b"ULG\x03"):
            mode = data.index(b"\x00\x05\x04\x00\x06HELIOS")
            return data[:4] + data[mode : mode + 3 + 38 + N_FRAMES * 1430]
        return data[: (1 + N_FRAMES) * 2052]

    return cut


def attempt(data: bytes) -> GameLog | None:
    try:
        return read_game(data, path=HERE)
    except LogError as error:
        refusal = str(error)
    assert refusal.startswith("some.rcg: ")
    assert "\n" not in refusal
    return None


@pytest.mark.parametrize("name", FORMATS)
def test_truncated_at_every_byte(short: Callable[[str], bytes], name: str):
    data = short(name)
    whole = read_game(data, path=HERE)
    assert len(whole.frames["cycle"]) == N_FRAMES
    assert not whole.problems
    most = 0
    for stop in range(len(data) + 1):
        game = attempt(data[:stop])
        if game is None:
            # What was kept once is not lost again by a longer file.
            assert most == 0
            continue
        n_frames = len(game.frames["cycle"])
        assert most <= n_frames <= N_FRAMES
        most = n_frames
        assert game.problems or not game.complete or n_frames == N_FRAMES
        for side in ("frames", "players"):
            for column, values in getattr(game, side).items():
                assert np.array_equal(values, getattr(whole, side)[column][:n_frames], equal_nan=True), column
    assert most == N_FRAMES


def test_a_command_log_truncated_at_every_byte(match_of: Callable[[str], Match]):
    lines = match_of("v6").log.text.splitlines(keepends=True)
    data = b"".join(lines[:3] + lines[9000:9012])
    whole = read_commands(data, left="HELIOS_base", right="WEBase", path=HERE)
    assert not whole.problems
    refused = -1
    for stop in range(len(data)):
        try:
            log = read_commands(data[:stop], left="HELIOS_base", right="WEBase", path=HERE)
        except LogError:
            refused = stop
            continue
        n_commands = int((log.commands["line"] < log.text.count(b"\n") + 1).sum())
        for column in ("cycle", "side", "unum", "kind", "arg0"):
            np.testing.assert_array_equal(log.commands[column][:n_commands], whole.commands[column][:n_commands])
    assert refused < len(b"0,20\t")


@pytest.mark.parametrize("pack", [gzip.compress, lzma.compress])
def test_a_packed_log_truncated_at_every_byte(
    short: Callable[[str], bytes], tmp_path: Path, pack: Callable[[bytes], bytes]
):
    data = short("v6")
    packed = pack(data)
    path = tmp_path / "cut.rcg.gz"
    n_read = 0
    refusals: list[tuple[int, str]] = []
    for stop in range(0, len(packed), 3):
        path.write_bytes(packed[:stop])
        try:
            match = read_match(path)
        except LogError as error:
            refusals.append((n_read, str(error)))
            continue
        n_read += 1
        assert "truncated" in {problem.code for problem in match.problems}
        assert len(match.frames["cycle"]) <= N_FRAMES
    assert n_read > 10
    # Once a frame could be read, no longer file is refused.
    assert all(before == 0 and text.startswith(str(path)) for before, text in refusals)


@pytest.mark.parametrize("name", FORMATS)
@settings(max_examples=80, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_damaged_bytes(short: Callable[[str], bytes], name: str, seed: int):
    rng = np.random.default_rng(seed)
    data = bytearray(short(name))
    for _ in range(rng.integers(1, 6)):
        at = int(rng.integers(len(data)))
        match rng.integers(3):
            case 0:
                data[at] = rng.integers(256)
            case 1:
                del data[at : at + int(rng.integers(1, 40))]
            case _:
                data[at:at] = rng.choice(
                    [b"\n", b"(", b")", b"nan", b"-", b"1e400", b"99999999999999999999", b"\x00", b'"']
                )
    game = attempt(bytes(data))
    if game is not None:
        assert len(game.frames["cycle"]) >= 1
        assert game.players["x"].shape == (len(game.frames["cycle"]), 22)


@settings(max_examples=200, deadline=None)
@given(
    start=st.sampled_from(
        [b"", b"ULG4\n", b"ULG6\n", b"ULG6\n[\n", b"JSON\n[", b"[\n", b"ULG\x02", b"ULG\x03", b"\x00\x01"]
    ),
    rest=st.binary(max_size=200),
)
def test_garbage(start: bytes, rest: bytes):
    attempt(start + rest)


FOREIGN = {
    "empty": b"",
    "picture": b"\x89PNG\r\n\x1a\n" + bytes(100),
    "page": b"<!doctype html><title>404</title>",
    "words": b"The quick brown fox\n" * 10,
    "array": b"[1, 2, 3]",
    "zeros": bytes(5000),
    "header": b"ULG6\n",
    "parameters": b"ULG6\n(server_param (goal_width 14.02))\n(playmode 1 kick_off_l)\n",
    "packed page": gzip.compress(b"<!doctype html>"),
    "packed nothing": gzip.compress(b""),
    "packing cut": gzip.compress(b"ULG6\n")[:12],
}


@pytest.mark.parametrize("content", FOREIGN.values(), ids=FOREIGN.keys())
def test_foreign_files_are_refused_in_one_line(tmp_path: Path, content: bytes):
    path = tmp_path / "foreign.rcg"
    path.write_bytes(content)
    with pytest.raises(LogError) as caught:
        read_match(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_the_files_of_macos_beside_logs_are_passed_over(rcg_of: Callable[[str], Path], tmp_path: Path):
    log = rcg_of("v6")
    (tmp_path / log.name).write_bytes(log.read_bytes())
    (tmp_path / f"._{log.name}").write_bytes(b"\0\5\x16\7")
    assert [pair.path.name for pair in find_matches([tmp_path])] == [log.name]


def test_missing_files_and_folders(tmp_path: Path):
    for path in (tmp_path / "none.rcg", tmp_path):
        with pytest.raises(LogError) as caught:
            read_match(path)
        assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("packing", ["", ".gz", ".xz", ".zst", ".bz2"])
def test_packings_and_streams(rcg_of: Callable[[str], Path], tmp_path: Path, packing: str):
    import zstandard

    data = gzip.decompress(rcg_of("onesided").read_bytes())
    packs = {"": bytes, ".gz": gzip.compress, ".xz": lzma.compress, ".zst": zstandard.compress, ".bz2": bz2.compress}
    pack = packs[packing]
    path = tmp_path / f"x.rcg{packing}"
    path.write_bytes(pack(data))
    with path.open("rb") as stream:
        from_stream = read_match(stream)
    assert read_match(path).match_id == from_stream.match_id
    assert len(from_stream.frames["cycle"]) == 99


def test_a_lone_command_log(rcg_of: Callable[[str], Path], tmp_path: Path):
    rcl = rcg_of("v6").with_name(rcg_of("v6").name.replace(".rcg", ".rcl"))
    path = tmp_path / "lone.rcl.gz"
    path.write_bytes(rcl.read_bytes())
    match = read_match(path)
    assert (match.rcg_path, match.rcl_path) == (None, path)
    assert "no-game-log" in {problem.code for problem in match.problems}
    assert len(match.commands["kind"]) == 30511
    assert (match.commands["frame"] == -1).all()
    assert match.players["x"].shape == (0, 22)


def test_a_lone_command_log_has_the_goals_that_the_referee_announced(tmp_path: Path):
    lines = ["0,0\tRecv Alpha_1: (dash 10)", "0,0\tRecv Beta_1: (dash 10)"]
    lines += [f"{cycle},0\t(referee goal_{goal})" for cycle, goal in ((2, "r_1"), (5, "l_1"), (8, "r_2"))]
    path = tmp_path / "lone.rcl"
    path.write_text("\n".join([*lines, ""]))
    match = read_match(path)
    assert (match.left.score, match.right.score) == (1, 2)


NEVER_BEGAN = b"ULG5\n(server_param (half_time 300))\n(player_param (player_types 18))\n(team 1 Alpha null 0 0)\n"


def test_a_server_that_was_closed_before_the_match_began(tmp_path: Path):
    """A whole log without a frame is no damage, and its commands are kept; a log that breaks off there is."""
    path = tmp_path / "x.rcg"
    path.write_bytes(NEVER_BEGAN + b'(msg 0 1 "(result 202001010000 Alpha_0-vs-null)")\n')
    (tmp_path / "x.rcl").write_text("0,0\tRecv Alpha_1: (move -10 0)\n")
    match = read_match(path)
    assert (match.rcg_path, match.left.name, match.right.name) == (path, "Alpha", None)
    assert [(problem.code, str(problem.severity)) for problem in match.problems] == [("never-began", "note")]
    assert match.game.complete
    assert match.players["x"].shape == (0, 22)
    assert match.commands["frame"].tolist() == [-1]
    tables = tables_of(match)
    assert (tables["frames"].num_rows, tables["commands"].num_rows) == (0, 1)
    (tmp_path / "x.rcl").unlink()
    assert tables_of(read_match(path))["commands"].num_rows == 0
    path.write_bytes(NEVER_BEGAN)
    with pytest.raises(LogError, match="holds no frame"):
        read_match(path)


def test_archives_are_to_be_unpacked(rcg_of: Callable[[str], Path], tmp_path: Path, caplog: pytest.LogCaptureFixture):
    import tarfile

    with tarfile.open(tmp_path / "games.rcg.tar.gz", "w:gz") as archive:
        archive.add(rcg_of("v6"), arcname="one.rcg.gz")
    with pytest.raises(LogError, match=r"is a tar archive: unpack it \(tar xf\)"):
        read_match(tmp_path / "games.rcg.tar.gz")
    (tmp_path / "one.rcg").write_bytes(b"PK\x03\x04")
    with pytest.raises(LogError, match=r"is a zip archive, no game log: unpack it \(unzip\)"):
        read_match(tmp_path / "one.rcg")
    (tmp_path / "one.rcg").unlink()
    with pytest.raises(UsageError, match=r"no .rcg or .rcl file under .*; unpack games.rcg.tar.gz first"):
        find_matches([tmp_path])
    assert not caplog.messages
    (tmp_path / "other.rcg").touch()
    (tmp_path / "other.zip").touch()
    assert [pair.path.name for pair in find_matches([tmp_path])] == ["other.rcg"]
    (line,) = caplog.messages
    assert line.startswith(f"{tmp_path / 'games.rcg.tar.gz'} and 1 more: an archive, passed over")


def test_a_lone_game_log(rcg_of: Callable[[str], Path], tmp_path: Path):
    path = tmp_path / "lone.rcg.gz"
    path.write_bytes(rcg_of("v6").read_bytes())
    match = read_match(path)
    assert [problem.code for problem in match.problems] == ["no-command-log"]
    assert len(match.commands["kind"]) == 0


@pytest.mark.parametrize(
    ("what", "by"),
    [
        (rb"\(team 1 HELIOS_base WEBase 0 0\)", b"(team 1 HELIOS_base WEBase " + b"9" * 5000 + b" 0)"),
        (rb"\(playmode 1 \w+\)", b"(playmode " + b"9" * 5000 + b" nonsense)"),
        (rb"\(playmode 1 \w+\)", b"(playmode 99999999999 nonsense)"),
    ],
)
def test_numbers_beyond_any_column_are_limited(rcg_of: Callable[[str], Path], tmp_path: Path, what: bytes, by: bytes):
    data, changed = re.subn(what, by, gzip.decompress(rcg_of("v6").read_bytes()), count=1)
    assert changed
    path = tmp_path / "long.rcg"
    path.write_bytes(data)
    match = read_match(path)
    assert len(match.frames["cycle"]) == 199
    assert {problem.cycle for problem in match.problems} <= {None, 2**31 - 1}
    assert tables_of(match)["problems"].num_rows == len(match.problems)


@pytest.mark.parametrize("score", [b"32768", b"99999", b"-1", b"9" * 5000])
@pytest.mark.parametrize("name", ["v6", "json"])
def test_a_score_that_no_match_has_is_no_score(rcg_of: Callable[[str], Path], tmp_path: Path, name: str, score: bytes):
    """The score before it stays, so do the names."""
    data = gzip.decompress(rcg_of(name).read_bytes())
    patterns = {"v6": rb"(\(team 1 HELIOS_base \w+) 0 0\)", "json": rb'("l":{"name":"HELIOS_base","score":)0}'}
    ends = {"v6": rb"\1 %b 0)" % score, "json": rb"\g<1>%b}" % score}
    data, changed = re.subn(patterns[name], ends[name], data, count=1)
    assert changed
    path = tmp_path / "score.rcg"
    path.write_bytes(data)
    match = read_match(path)
    assert (match.left.name, match.left.score) == ("HELIOS_base", 0)
    assert not match.frames["left_score"].any()
    assert [problem.code for problem in match.problems if problem.line] == [
        "bad-record" if name == "json" else "odd-line"
    ]


def test_a_json_log_whose_team_is_called_by_a_number(rcg_of: Callable[[str], Path], tmp_path: Path):
    data = gzip.decompress(rcg_of("json").read_bytes()).replace(b'"name":"HELIOS_base"', b'"name":5')
    path = tmp_path / "number.rcg"
    path.write_bytes(data)
    match = read_match(path)
    assert match.left.name is None
    assert any("a team is called 5, expected a text" in problem.text for problem in match.problems)


def test_a_command_log_of_which_most_was_refused_is_kept(rcg_of: Callable[[str], Path]):
    match = read_match(rcg_of("refused"))
    assert match.problems == ()
    assert len(match.commands["kind"]) == 180


# The last one is of a match between the same teams.
@pytest.mark.parametrize("other", ["goalie3", "crash", "native-v5"])
def test_the_command_log_of_another_match_is_left_out(rcg_of: Callable[[str], Path], other: str):
    rcl = next(rcg_of(other).parent.glob("*.rcl.gz"))
    match = read_match(rcg_of("v6"), partner=rcl)
    problem = next(problem for problem in match.problems if problem.code == "mismatched")
    assert str(problem).startswith(str(rcl))
    assert match.log is None
