"""Each rule finds the fault it is for, and real matches break none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pytest

from teamclone.logs import Match
from teamclone.rcss.commands import CommandKind
from teamclone.store import convert
from teamclone.store.checks import CHECKS, check_match
from teamclone.store.convert import Tables

FRAME = 20


@pytest.fixture(scope="module")
def tables(match: Match) -> Tables:
    return convert.tables_of(match)


def change(tables: Tables, table: str, column: str, row: int, value: Any) -> Tables:
    """The tables with one value replaced."""
    rows = tables[table]
    mask = np.arange(rows.num_rows) == (row % rows.num_rows)
    kind = rows.schema.field(column).type
    values = pc.replace_with_mask(rows[column].combine_chunks(), pa.array(mask), pa.array([value], kind))
    index = rows.column_names.index(column)
    return tables | {table: rows.set_column(index, rows.schema.field(column), values)}


def player(slot: int) -> int:
    return FRAME * 22 + slot


def command_of(tables: Tables, kind: CommandKind) -> int:
    return tables["commands"]["kind"].to_pylist().index(kind)


FAULTS: dict[str, Callable[[Tables], Tables]] = {
    "frame-numbers": lambda t: t | {"frames": t["frames"].slice(1), "commands": t["commands"].slice(0, 0)},
    "time-order": lambda t: change(t, "frames", "cycle", FRAME, 1) | {"commands": t["commands"].slice(0, 0)},
    "playmode": lambda t: change(t, "frames", "playmode", FRAME, 99),
    "score": lambda t: change(t, "frames", "left_score", FRAME, 1),
    "final-score": lambda t: change(t, "matches", "right_score", 0, 3),
    "ball-position": lambda t: change(t, "frames", "ball_x", FRAME, None),
    "ball-speed": lambda t: change(t, "frames", "ball_vx", FRAME, 3.2),
    "players-per-frame": lambda t: t | {"player_states": t["player_states"].slice(1)},
    "player-position": lambda t: change(t, "player_states", "x", player(3), -60.0),
    "player-speed": lambda t: change(t, "player_states", "vy", player(3), 1.5),
    "body": lambda t: change(t, "player_states", "body", player(3), 181.0),
    "neck": lambda t: change(t, "player_states", "neck", player(3), -91.0),
    "stamina": lambda t: change(t, "player_states", "stamina", player(3), 8001.0),
    "capacity": lambda t: change(t, "player_states", "capacity", player(3), 140000.0),
    "effort": lambda t: change(t, "player_states", "effort", player(3), 1.1),
    "player-type": lambda t: change(t, "player_states", "type", player(3), 18),
    "counters": lambda t: change(t, "player_states", "count_say", player(3), 9999),
    "command-order": lambda t: change(t, "commands", "line", 50, 999_999),
    "command-sender": lambda t: change(t, "commands", "unum", 50, 12),
    "command-kind": lambda t: change(t, "commands", "kind", 50, 250),
    "command-frame": lambda t: change(t, "commands", "frame", -1, 10**6),
    "command-numbers": lambda t: change(t, "commands", "arg0", command_of(t, CommandKind.TURN), None),
}


def test_real_matches_break_no_rule(any_match: Match) -> None:
    assert [str(finding) for finding in check_match(convert.tables_of(any_match))] == []


def test_there_is_a_fault_for_every_rule() -> None:
    assert list(FAULTS) == [check.name for check in CHECKS]


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_found(tables: Tables, name: str) -> None:
    findings = {finding.check.name: finding for finding in check_match(FAULTS[name](tables))}
    assert list(findings) == [name]
    assert findings[name].rows >= 1
    text = str(findings[name])
    assert text.startswith(name)
    assert findings[name].check.about in text
    assert "\n" not in text


def test_a_finding_says_where(tables: Tables) -> None:
    (finding,) = check_match(FAULTS["body"](tables))
    assert finding.cycle == tables["frames"]["cycle"][FRAME].as_py()
    assert finding.what == "left 4 has body 181.0"
    assert finding.rows == 1


def test_players_off_the_field_may_be_anywhere(tables: Tables) -> None:
    away = change(tables, "player_states", "state", player(3), 0)
    assert check_match(change(away, "player_states", "x", player(3), -60.0)) == []


def test_a_move_of_the_trainer_has_no_numbers_of_a_player(tables: Tables) -> None:
    """It names what it moves first, ``(move (ball) -20 20)``, and its arguments are not read."""
    row = command_of(tables, CommandKind.DASH)
    for column, value in (("side", 0), ("unum", 0), ("kind", int(CommandKind.MOVE)), ("arg0", None), ("arg1", None)):
        tables = change(tables, "commands", column, row, value)
    assert "command-numbers" not in {finding.check.name for finding in check_match(tables)}
