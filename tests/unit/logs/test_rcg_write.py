from __future__ import annotations

import gzip
import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from teamclone.errors import UsageError
from teamclone.logs import Match, Team
from teamclone.logs.assemble import stoppage_of
from teamclone.logs.columns import FRAMES, PLAYERS
from teamclone.logs.match import GameLog, default_player_types, empty_columns
from teamclone.logs.rcg_text import read_text
from teamclone.logs.rcg_write import TextVersion, write_text
from teamclone.rcss import player_types
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.playmodes import PlayMode

VERSIONS: tuple[TextVersion, ...] = (4, 5, 6)
YOUNGER: dict[int, set[str]] = {
    4: {"capacity", "focus_distance", "focus_direction", "count_change_focus"},
    5: {"focus_distance", "focus_direction", "count_change_focus"},
    6: set(),
}
"""Columns that a version does not hold."""


def text_of(log: Match | GameLog, *, version: TextVersion) -> bytes:
    file = io.BytesIO()
    write_text(log, file, version=version)
    return file.getvalue()


@pytest.mark.parametrize(
    ("name", "version"),
    [("v6", 6), ("native-v5", 5), ("native-v4", 4), ("penalties", 6), ("onesided", 6), ("realtime", 6)],
)
def test_writes_the_bytes_of_the_server(
    match_of: Callable[[str], Match], rcg_of: Callable[[str], Path], name: str, version: TextVersion
):
    """Only what is no column differs: the youngest parameters of the types, and the date of the result."""
    original = gzip.decompress(rcg_of(name).read_bytes()).splitlines()
    written = text_of(match_of(name), version=version).splitlines()
    assert len(written) == len(original)
    for ours, theirs in zip(written, original, strict=True):
        if ours.startswith(b"(player_type "):
            assert set(ours.strip(b")").split(b")(")) <= set(theirs.strip(b")").split(b")("))
        elif not ours.startswith(b"(msg "):
            assert ours == theirs


@st.composite
def game_logs(draw: st.DrawFn) -> GameLog:
    """Logs whose numbers have the six digits that a text log holds."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n_frames = draw(st.integers(1, 4))
    frames, players = empty_columns(FRAMES, n_frames), empty_columns(PLAYERS, n_frames, N_PLAYERS)

    def numbers(shape: tuple[int, ...]) -> np.ndarray:
        scale = 10.0 ** rng.integers(-6, 6, shape)
        special = rng.choice([0.0, -0.0, 1.0, -1e-5, 130600.0, 99.9999], shape)
        values = np.where(rng.random(shape) < 0.2, special, rng.uniform(-1, 1, shape) * scale)
        return np.vectorize(lambda value: float(f"{value:g}"), otypes=[np.float64])(values)

    frames["cycle"][:] = np.sort(rng.integers(0, 3, n_frames))
    frames["stoppage"][:] = stoppage_of(frames["cycle"])
    modes = st.sampled_from([mode for mode in PlayMode if mode != PlayMode.NULL])
    frames["playmode"][:] = draw(st.lists(modes, min_size=n_frames, max_size=n_frames))
    for column in FRAMES:
        if column.dtype == "float32":
            frames[column.name][:] = numbers((n_frames,))
        elif column.dtype == "int16":
            frames[column.name][:] = rng.integers(0, 30, n_frames) * draw(st.booleans())
    for column in PLAYERS:
        shape = (n_frames, N_PLAYERS)
        if column.dtype == "float32":
            players[column.name][:] = numbers(shape)
        else:
            high = {"uint8": 255, "uint32": 2**21, "int32": 2**31 - 1}.get(column.dtype, 2)
            players[column.name][:] = rng.integers(0, high, shape)
    players["view_quality"][:] = rng.integers(0, 2, (n_frames, N_PLAYERS))
    players["attention_unum"][:] = rng.integers(0, 12, (n_frames, N_PLAYERS))
    players["attention_side"][:] = np.where(
        players["attention_unum"] > 0, rng.choice([-1, 1], (n_frames, N_PLAYERS)), 0
    )
    rests = rng.random((n_frames, N_PLAYERS)) < 0.5
    players["pointto_x"][rests] = players["pointto_y"][rests] = np.nan
    names = st.from_regex(r"[A-Za-z0-9_+.:<-]{1,15}", fullmatch=True).filter(lambda name: name != "null")
    teams = [
        Team(
            name=draw(st.none() | names),
            score=int(frames[f"{side}_score"][-1]),
            penalties_scored=int(frames[f"{side}_penalties_scored"][-1]),
            penalties_missed=int(frames[f"{side}_penalties_missed"][-1]),
        )
        for side in ("left", "right")
    ]
    texts = st.text(st.characters(min_codepoint=32, max_codepoint=126, exclude_characters='"'), max_size=8)
    values = st.integers(-(2**31), 2**31 - 1).map(float) | st.floats(-100, 100).map(lambda value: float(f"{value:g}"))
    parameters = st.dictionaries(st.from_regex(r"[a-z][a-z_]{0,8}", fullmatch=True), values | texts, max_size=4)
    types = default_player_types(draw(st.integers(0, 3)))
    for name in player_types.FIELDS:
        types[name][:] = np.abs(numbers(types[name].shape))
    return GameLog(
        log_version="6",
        left=teams[0],
        right=teams[1],
        frames=frames,
        players=players,
        player_types=types,
        server_params=draw(parameters),
        player_params=draw(parameters),
        complete=draw(st.booleans()),
    )


@pytest.mark.parametrize("version", VERSIONS)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(game=game_logs())
def test_what_is_written_is_read_again(game: GameLog, version: TextVersion):
    found = read_text(text_of(game, version=version))
    assert found.log_version == str(version)
    assert (found.left, found.right, found.complete, found.problems) == (game.left, game.right, game.complete, ())
    assert (found.server_params, found.player_params) == (game.server_params, game.player_params)
    empty = empty_columns(PLAYERS, *game.players["x"].shape)
    for name, values in game.frames.items():
        np.testing.assert_array_equal(found.frames[name], values, err_msg=name)
    for name, values in game.players.items():
        expected = empty[name] if name in YOUNGER[version] else values
        np.testing.assert_array_equal(found.players[name], expected, err_msg=name)
    for name, values in game.player_types.items():
        np.testing.assert_array_equal(found.player_types[name], values, err_msg=name)


@pytest.mark.parametrize(("name", "version"), [("native-v1", 4), ("native-v3", 4), ("native-v4", 5), ("json", 6)])
def test_a_log_is_not_written_younger_than_it_is(match_of: Callable[[str], Match], name: str, version: TextVersion):
    missing = {"native-v1": "vx", "native-v3": "count_tackle", "native-v4": "capacity", "json": "focus_distance"}[name]
    with pytest.raises(UsageError, match=missing):
        text_of(match_of(name), version=version)


def test_a_json_log_becomes_text(match_of: Callable[[str], Match]):
    original = match_of("json")
    found = read_text(text_of(original, version=5))
    for name in original.players.keys() - YOUNGER[5]:
        np.testing.assert_array_equal(found.players[name], original.players[name], err_msg=name)
