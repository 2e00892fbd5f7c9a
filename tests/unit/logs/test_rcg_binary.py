from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from teamclone.errors import LogError
from teamclone.logs import Match
from teamclone.logs.align import first_body_commands, slot_of
from teamclone.logs.rcg_binary import (
    _PLAYER_PARAMETERS,
    _SERVER_PARAMETERS,
    _SHORT_SHOWINFO_T2,
    _SHOWINFO_T,
    read_binary,
)
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.playmodes import PlayMode

MatchOf = Callable[[str], Match]


@pytest.fixture(params=["native-v1", "native-v2", "native-v3"])
def data(request: pytest.FixtureRequest, rcg_of: Callable[[str], Path]) -> bytes:
    return gzip.decompress(rcg_of(request.param).read_bytes())


def test_structs_have_the_padding_of_the_server():
    assert (_SHOWINFO_T.itemsize, _SHORT_SHOWINFO_T2.itemsize) == (316, 1428)
    assert (_SERVER_PARAMETERS.dtype.itemsize, _PLAYER_PARAMETERS.dtype.itemsize) == (396, 132)
    offsets = {name: field[1] for name, field in _SERVER_PARAMETERS.dtype.fields.items()}
    expected = {"ball_size": 104, "maxpower": 148, "catch_probability": 216, "half_time": 254, "simulator_step": 256}
    assert {name: offsets[name] for name in expected} == expected


@pytest.mark.parametrize("name", ["native-v1", "native-v2", "native-v3"])
def test_the_command_log_explains_the_bodies(match_of: MatchOf, name: str):
    """After a dash the body points where it did, after most turns it does not: frames and commands fit together."""
    match = match_of(name)
    frames, commands = match.frames, match.commands
    index = first_body_commands(commands, frames["playmode"])
    frame, slot = commands["frame"][index], slot_of(commands["side"][index], commands["unum"][index])
    use = (frames["playmode"][frame] == PlayMode.PLAY_ON) & np.append(np.diff(frames["cycle"]) == 1, False)[frame]
    index, frame, slot = index[use], frame[use], slot[use]
    body = match.players["body"]
    moved = np.abs(body[frame + 1, slot] - body[frame, slot])
    dash = commands["kind"][index] == CommandKind.DASH
    turn = (commands["kind"][index] == CommandKind.TURN) & (np.abs(commands["arg0"][index]) > 20)
    assert dash.sum() > 700
    assert turn.sum() > 90
    assert (moved[dash] < 1e-3).mean() > 0.99
    assert (moved[turn] > 2).mean() > 0.95


@pytest.mark.parametrize(("name", "step"), [("native-v1", 1 / 16), ("native-v2", 1 / 16), ("native-v3", 2e-5)])
def test_nobody_runs_faster_than_he_can(match_of: MatchOf, name: str, step: float):
    match = match_of(name)
    steady = (match.frames["playmode"][1:] == PlayMode.PLAY_ON) & (np.diff(match.frames["cycle"]) == 1)
    # Collisions push apart those who overlap, on top of player_speed_max.
    way = np.hypot(np.diff(match.players["x"], axis=0), np.diff(match.players["y"], axis=0))[steady]
    assert np.quantile(way, 0.999) < 1.05 + 2 * step
    assert way.max() < 2


@pytest.mark.parametrize("name", ["native-v1", "native-v2"])
def test_what_coarse_logs_lack(match_of: MatchOf, name: str):
    players = match_of(name).players
    assert not (match_of(name).frames["ball_x"] * 16 % 1).any()
    there = {"type", "state", "x", "y", "body", "attention_side", "attention_unum"}
    for column, values in players.items():
        if column in there:
            continue
        missing = {"view_quality": 255}.get(column, -1)
        assert np.isnan(values).all() if values.dtype.kind == "f" else (values == missing).all(), column
    assert not players["type"].any()


def test_version_3_integrates_its_velocities(match_of: MatchOf):
    """The ball of a cycle moves by its decayed velocity over the decay (rcssserver ``object.cpp``)."""
    match = match_of("native-v3")
    frames = match.frames
    decay = match.game.server_params["ball_decay"]
    free = (frames["playmode"][1:] == PlayMode.PLAY_ON) & (np.diff(frames["cycle"]) == 1)
    error = np.abs(np.diff(frames["ball_x"]) - frames["ball_vx"][1:] / decay)[free]
    assert decay == pytest.approx(0.94, abs=2e-5)
    assert np.median(error) < 5e-5
    assert match.game.server_params["half_time"] == 5
    assert match.game.player_params["player_types"] == 18
    assert match.game.player_params["kickable_margin_delta_max"] == pytest.approx(0.1, abs=2e-5)
    assert match.game.player_types["inertia_moment"][0] == 5
    assert len(set(match.game.player_types["player_decay"])) == 18
    assert not match.game.problems


def test_view_is_in_degrees(match_of: MatchOf):
    players = match_of("native-v3").players
    assert set(np.unique(players["view_width"].round(2))) == {60, 120, 180}
    assert set(np.unique(players["view_quality"])) == {1}
    assert players["stamina"].max() == 8000


def test_state_keeps_its_sixteenth_bit(data: bytes):
    """The field is a signed int16: FREE_KICK_FAULT must not become a negative number."""
    patched = bytearray(data)
    show = {2: 4 + 2, 3: None}.get(data[3]) if data[:3] == b"ULG" else data.index(b"\x00\x01\x04\x00HEL") + 2
    if show is None:
        show = data.index(b"\x00\x06HELIOS_base") + 2 + 36 + 2
        place, at = show + 16, (0, 0)
    else:
        place, at = show + 38 + 12, (0, 0)
    patched[place : place + 2] = b"\x80\x09"
    assert read_binary(bytes(patched)).players["state"][at] == 0x8009


def test_an_unknown_play_mode_is_not_the_one_before(data: bytes):
    mode = data.index(b"\x00\x05\x04") + 2 if data[:4] == b"ULG\x03" else data.index(b"\x04\x00HELIOS")
    game = read_binary(data[:mode] + b"\x63" + data[mode + 1 :])
    assert game.frames["playmode"][0] == PlayMode.NULL
    assert [problem.code for problem in game.problems] == ["unknown-playmode"]


def test_an_unknown_record_ends_the_reading(data: bytes):
    if data[:3] == b"ULG":
        game = read_binary(data + b"\x00\x63garbage")
        assert [(problem.code, problem.byte) for problem in game.problems] == [("bad-record", len(data))]
    else:
        odd = b"\x00\x63" + bytes(2050)
        game = read_binary(data[: 2052 * 3] + odd + data[2052 * 3 :])
        assert [(problem.code, problem.byte) for problem in game.problems] == [("bad-record", 2052 * 3)]
    assert len(game.frames["cycle"]) == len(read_binary(data).frames["cycle"])


@pytest.mark.parametrize(
    "content",
    [b"", b"\x00", b"\x00\x09", b"\x00\x00" * 2000, b"ULG\x02", b"ULG\x03\x00\x01", b"ULG\x07", b"PK\x03\x04"],
)
def test_not_a_binary_log(content: bytes):
    with pytest.raises(LogError, match=r"^x\.rcg: "):
        read_binary(content, path=Path("x.rcg"))


def test_garbage_that_begins_like_version_1_is_no_match():
    with pytest.raises(LogError, match="team's name would be"):
        read_binary(b"\0\1" + bytes(range(256)) * 40)
