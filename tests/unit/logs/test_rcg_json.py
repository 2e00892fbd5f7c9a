"""Logs of servers 17 and 18 are made here from one of server 19, in the shape of the sources of 17.0.1 and 18.1.3."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import orjson
import pytest

from teamclone.errors import LogError
from teamclone.logs import Match
from teamclone.logs.columns import COUNTERS
from teamclone.logs.rcg_json import read_json

COUNTS = [kind.name.lower() for kind in COUNTERS]


@pytest.fixture(scope="module")
def data(rcg_of: Callable[[str], Path]) -> bytes:
    return gzip.decompress(rcg_of("json").read_bytes())


@pytest.fixture(scope="module")
def records(data: bytes) -> list[dict]:
    return orjson.loads(data)


def flat(records: list[dict], *, counters: list[str]) -> list[dict]:
    """The records in the shape of servers 17 and 18."""
    made = [{"type": "header", "version": records[0]["version"], "timestamp": records[1]["timestamp"]}]
    for record in records[2:]:
        ((kind, body),) = record.items()
        match kind:
            case "server_param" | "player_param":
                made.append({"type": kind, "params": body})
            case "player_type":
                params = {name: value for name, value in body.items() if name != "id"}
                made.append({"type": kind, "id": body["id"], "params": params})
            case "team":
                teams = [{"side": side, **body[side]} for side in "lr"]
                times = {name: value for name, value in body.items() if name not in "lr"}
                made.append({"type": kind, **times, "teams": teams})
            case "show":
                players = [
                    {name: value for name, value in player.items() if name not in COUNTS}
                    | {"count": {name: player[name] for name in counters}}
                    for player in body["players"]
                ]
                made.append({"type": kind, **body, "players": players})
            case _:
                made.append({"type": kind, **body})
    return made


def written(records: list[dict], *, first_line: bytes = b"") -> bytes:
    return first_line + b"[\n" + b",\n".join(map(orjson.dumps, records)) + b"\n]\n"


def assert_same_frames(found, expected, *, leave_out: tuple[str, ...] = ()) -> None:
    for side in ("frames", "players"):
        for name, values in getattr(expected, side).items():
            if name not in leave_out:
                np.testing.assert_array_equal(getattr(found, side)[name], values, err_msg=name)


def test_server_19(match_of: Callable[[str], Match], records: list[dict]):
    game = match_of("json").game
    assert (game.server_version, game.complete, game.problems) == ("19.0.0", True, ())
    shows = [record["show"] for record in records if "show" in record]
    assert game.frames["cycle"].tolist() == [show["time"] for show in shows]
    assert game.frames["stoppage"].tolist() == [show.get("stime", 0) for show in shows]
    assert game.server_params["auto_mode"] == 1.0
    assert game.server_params["game_log_dir"] == "/tmp/w/fx/json"
    assert game.player_types["player_decay"][1] == 0.442762
    player = shows[80]["players"][15]
    for key, name in (
        ("x", "x"),
        ("body", "body"),
        ("stamina", "stamina"),
        ("kick", "count_kick"),
        ("fnum", "attention_unum"),
    ):
        assert game.players[name][80, 15] == np.float32(player[key])
    assert np.isnan(game.players["focus_distance"]).all()


@pytest.mark.parametrize(
    ("first_line", "version", "counters"),
    [(b"ULG6\n", "json-17", COUNTS[:-1]), (b"JSON\n", "json-18", COUNTS)],
)
def test_servers_17_and_18(data: bytes, records: list[dict], first_line: bytes, version: str, counters: list[str]):
    game = read_json(written(flat(records, counters=counters), first_line=first_line))
    expected = read_json(data)
    assert (game.log_version, game.server_version, game.complete, game.problems) == (version, "19.0.0", True, ())
    assert (game.left, game.right) == (expected.left, expected.right)
    assert game.server_params == expected.server_params
    assert game.player_types["kick_rand"].tolist() == expected.player_types["kick_rand"].tolist()
    without = () if "change_focus" in counters else ("count_change_focus",)
    assert_same_frames(game, expected, leave_out=without)
    for name in without:
        assert (game.players[name] == -1).all()


@pytest.mark.parametrize("option", [None, orjson.OPT_INDENT_2])
def test_records_need_not_stand_one_on_a_line(data: bytes, records: list[dict], option: int | None):
    game = read_json(orjson.dumps(records, option=option))
    assert (game.complete, game.problems) == (True, ())
    assert_same_frames(game, read_json(data))


def test_penalties_and_a_missing_team(records: list[dict]):
    team = {
        "team": {
            "time": 1,
            "l": {"name": "A", "score": 2, "pen_score": 3, "pen_miss": 1},
            "r": {"name": None, "score": 1},
        }
    }
    show = next(record for record in records if "show" in record)
    game = read_json(written([team, show]))
    assert (game.left.name, game.left.score, game.left.penalties_scored, game.left.penalties_missed) == ("A", 2, 3, 1)
    assert (game.right.name, game.right.score) == (None, 1)
    assert game.frames["left_penalties_scored"].tolist() == [3]


def test_an_arm_that_points(records: list[dict]):
    show = orjson.loads(orjson.dumps(next(record for record in records if "show" in record)))
    show["show"]["players"][3] |= {"px": 1.5, "py": -2.5}
    players = read_json(written([show])).players
    assert players["pointto_x"][0, 3] == 1.5
    assert np.isnan(players["pointto_x"][0]).sum() == 21


@pytest.mark.parametrize(
    "damage",
    [
        b'{"show":{"time":1}}',
        b'{"show":{"time":"x","ball":{"x":0,"y":0,"vx":0,"vy":0},"players":[]}}',
        b'{"show":{"time":99999999999,"ball":{"x":0,"y":0,"vx":0,"vy":0},"players":[]}}',
        b'{"show":{"time":2,"ball":{"x":0,"y":0,"vx":0,"vy":0},"players":[{"side":"l","unum":12}]}}',
        b'{"show":{"time":2,"ball":{"x":0,"y":0,"vx":0,"vy":0},"players":[{"side":"l","unum":1,"x":"far"}]}}',
        b'{"playmode":{"time":1,"mode":[]}}',
        b'{"team":{"time":1,"l":3}}',
        b'{"player_type":{"id":0,"kick_rand":[]}}',
        b'{"future":{}}',
        b'{"show":nan}',
        b'"show"',
        b"17",
        b"{}",
    ],
)
def test_a_bad_record_is_left_out_and_named(data: bytes, damage: bytes):
    lines = data.splitlines(keepends=True)
    at = next(index for index, line in enumerate(lines) if line.startswith(b'{"show"')) + 5
    game = read_json(b"".join([*lines[:at], damage + b",\n", *lines[at:]]), path=Path("odd.rcg"))
    (problem,) = game.problems
    assert (problem.code, problem.line) == ("bad-record", at + 1)
    assert str(problem).startswith(f"odd.rcg: line {at + 1}: ")
    assert_same_frames(game, read_json(data))


def test_an_unknown_play_mode_is_not_the_one_before(records: list[dict]):
    show = next(record for record in records if "show" in record)
    modes = [{"playmode": {"time": 1, "mode": mode}} for mode in ("play_on", "golden_goal")]
    game = read_json(written([modes[0], show, modes[1], show]))
    assert game.frames["playmode"].tolist() == [3, 0]
    assert [(problem.code, problem.line) for problem in game.problems] == [("unknown-playmode", 4)]


def test_a_killed_server_leaves_the_end_off(data: bytes):
    end = data.rindex(b'{"show"')
    expected = read_json(data)
    for stop, n_frames in ((end, 128), (end + 300, 128), (data.index(b"\n", end), 129)):
        game = read_json(data[:stop])
        assert [problem.code for problem in game.problems] == ["truncated"]
        assert not game.complete
        assert len(game.frames["cycle"]) == n_frames
        for name, values in game.players.items():
            np.testing.assert_array_equal(values, expected.players[name][:n_frames])


@pytest.mark.parametrize("data", [b"[", b"[]", b"JSON\n[\n]", b'[\n{"version":"19.0.0"}\n]', b"[\x00\xff", b"[1,2,3]"])
def test_no_frame(data: bytes):
    with pytest.raises(LogError, match=r"^x\.rcg: holds no frame"):
        read_json(data, path=Path("x.rcg"))
