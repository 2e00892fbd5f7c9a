"""The tables cover what the logs hold."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from teamclone.logs import Match, columns
from teamclone.rcss import player_types
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.playmodes import PlayMode
from teamclone.store import create_store, schema


@pytest.mark.parametrize(
    ("table", "specs"),
    [
        (schema.FRAMES, columns.FRAMES),
        (schema.PLAYER_STATES, columns.PLAYERS),
        (schema.COMMANDS, columns.COMMANDS),
        (schema.EVENTS, columns.EVENTS),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_all_that_a_log_holds_is_stored(table: schema.Table, specs: tuple[columns.Column, ...]) -> None:
    fields = {field.name: field for field in table.fields}
    for spec in specs:
        assert fields[spec.name].numpy == spec.dtype
        assert (fields[spec.name].unit, fields[spec.name].about) == (spec.unit, spec.about)


def test_all_is_documented() -> None:
    for table in schema.TABLES:
        assert table.about.endswith(".")
        assert set(table.key) <= set(table.names)
        assert len(set(table.names)) == len(table.names)
        for field in table.fields:
            assert field.about, f"{table.name}.{field.name}"
            assert field.dtype in schema.SQL_NAMES
            assert not field.dtype.startswith("uint")
    assert set(schema.TYPE_FIELDS) == set(player_types.FIELDS)


def test_ids_have_the_servers_words() -> None:
    assert dict(schema.PLAYMODES.rows)[PlayMode.PLAY_ON] == "play_on"
    assert dict(schema.COMMAND_KINDS.rows)[CommandKind.TURN_NECK] == "turn_neck"
    assert len(schema.PLAYMODES.rows) == len(PlayMode)


def test_a_parquet_file_explains_itself(tmp_path: Path, match: Match) -> None:
    create_store(tmp_path / "store").add(match)
    stored = pq.read_schema(tmp_path / "store" / "matches" / match.match_id / "player_states.parquet")
    metadata = stored.field("stamina").metadata
    assert metadata[b"unit"] == b"stamina"
    assert metadata[b"about"].startswith(b"stamina after")
    assert stored.field("count_dash").metadata[b"unit"] == b""
