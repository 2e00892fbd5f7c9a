"""A match as the rows of a store: Arrow tables by name, made column by column."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from teamclone import __version__
from teamclone.dynamics.inverse.columns import recovered_commands
from teamclone.errors import UsageError
from teamclone.events.find import find_events
from teamclone.logs import Problem, Severity, columns
from teamclone.logs.columns import Source
from teamclone.logs.match import Columns, Match
from teamclone.rcss.players import N_PLAYERS, SLOT_SIDES, SLOT_UNUMS
from teamclone.rcss.playmodes import PlayMode
from teamclone.store import schema
from teamclone.store.schema import Table
from teamclone.system.files import digest

Tables = dict[str, pa.Table]
"""Arrow tables by the names of ``schema.MATCH_TABLES``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sources:
    """The hashes of the logs that a match was read from."""

    game_log: str | None
    command_log: str | None

    def cover(self, others: Sources) -> bool:
        """Return whether a store that has these sources would gain nothing from ``others``."""
        return self == others or others.command_log is None


def sources_of(match: Match) -> Sources:
    """Return the hashes of the logs that a match was read from."""
    return Sources(
        game_log=match.match_id if match.rcg_path is not None or match.log is None else None,
        command_log=digest(match.log.text) if match.log is not None else None,
    )


def tables_of(match: Match, *, recover: bool = True) -> Tables:
    """Return all rows of a match.

    Args:
        match: from its logs.
        recover: give a match without a command log the commands that its game log implies.
    """
    commands, problems = command_columns(match, recover=recover)
    made = {
        schema.FRAMES: frame_columns(match),
        schema.PLAYER_STATES: player_columns(match),
        schema.COMMANDS: commands,
        schema.PLAYER_TYPES: type_columns(match),
        schema.PARAMETERS: parameter_columns(match),
        schema.EVENTS: {**match.events, "text": list(match.event_texts)},
        schema.MATCH_EVENTS: event_columns(match),
        schema.PROBLEMS: problem_columns((*match.problems, *problems)),
    }
    tables = {table.name: arrow_table(table, values, match_id=match.match_id) for table, values in made.items()}
    tables[schema.MATCHES.name] = arrow_table(schema.MATCHES, match_columns(match, tables), match_id=match.match_id)
    return tables


def arrow_table(table: Table, values: dict[str, Any], *, match_id: str) -> pa.Table:
    """Return columns of one length (arrays or lists) as rows of a table.

    ``match_id`` is added, not-a-number made NULL. A zero byte in a text, which no SQL server keeps, becomes the
    replacement character.
    """
    wanted = schema.arrow_schema(table.fields)
    length = len(next(iter(values.values())))
    arrays = []
    for field in wanted:
        if field.name == schema.MATCH_ID.name:
            arrays.append(pa.repeat(pa.scalar(match_id, field.type), length))
        else:
            value = values[field.name]
            array = value if isinstance(value, pa.Array) else pa.array(_signed(value), field.type, from_pandas=True)
            arrays.append(_without_zeros(array) if field.type == pa.string() else array)
    return pa.Table.from_arrays(arrays, schema=wanted)


def _signed(value: Any) -> Any:
    """Return an unsigned array in the signed type that holds it in SQL; anything else as it is."""
    if isinstance(value, np.ndarray) and value.dtype.name in schema.SIGNED:
        return value.astype(schema.SIGNED[value.dtype.name])
    return value


def _without_zeros(texts: pa.Array) -> pa.Array:
    data = texts.buffers()[2]
    if data is None or np.frombuffer(data, np.uint8).all():
        return texts
    return pc.replace_substring(texts, "\0", "\ufffd")


def match_columns(match: Match, tables: Tables) -> dict[str, Any]:
    """Return the one row of ``matches``."""
    row: dict[str, Any] = {
        "started_at": started_at(match.rcg_path or match.rcl_path),
        "n_frames": tables["frames"].num_rows,
        "n_play_on_frames": int(np.count_nonzero(match.frames["playmode"] == PlayMode.PLAY_ON)),
        "n_commands": tables["commands"].num_rows,
        "n_events": tables["events"].num_rows,
        "n_problems": tables["problems"].num_rows,
        "complete": match.game.complete,
        "log_version": match.game.log_version,
        "server_version": match.game.server_version,
        "game_log": _name(match.rcg_path),
        "command_log": _name(match.rcl_path),
        "teamclone_version": __version__,
    }
    for side, team in (("left", match.left), ("right", match.right)):
        row[f"{side}_name"] = team.name
        row[f"{side}_score"] = team.score
        row[f"{side}_penalties_scored"] = team.penalties_scored
        row[f"{side}_penalties_missed"] = team.penalties_missed
    return {name: [value] for name, value in row.items()}


def frame_columns(match: Match) -> dict[str, Any]:
    """Return the columns of ``frames``: (n_frames,)."""
    return {"frame": np.arange(_n_frames(match), dtype=np.int32), **match.frames}


def player_columns(match: Match) -> dict[str, Any]:
    """Return the columns of ``player_states``.

    The (n_frames, 22) columns row by row, left 1..11 then right 1..11 of each frame.
    """
    n_frames = _n_frames(match)
    return {
        "frame": np.repeat(np.arange(n_frames, dtype=np.int32), N_PLAYERS),
        "side": np.tile(SLOT_SIDES, n_frames),
        "unum": np.tile(SLOT_UNUMS, n_frames),
        **{name: values.ravel() for name, values in match.players.items()},
    }


def event_columns(match: Match) -> dict[str, Any]:
    """Return the columns of ``match_events``: (n_events,)."""
    found = find_events(match.frames, match.players, match.game.server_params)
    return {"event": np.arange(len(found["kind"]), dtype=np.int32), **found}


def type_columns(match: Match) -> dict[str, Any]:
    """Return the columns of ``player_types``: (n_types,)."""
    types = match.game.player_types
    n_types = len(next(iter(types.values()))) if types else 0
    if not n_types:
        types = {name: np.empty(0) for name in schema.TYPE_FIELDS}
    return {"type": np.arange(n_types, dtype=np.uint8), **types}


def parameter_columns(match: Match) -> dict[str, Any]:
    """Return the columns of ``parameters``: those of the server, then those of the players, by name."""
    scopes = (("server", match.game.server_params), ("player", match.game.player_params))
    rows = [(scope, name, value) for scope, parameters in scopes for name, value in sorted(parameters.items())]
    return {
        "scope": [scope for scope, _, _ in rows],
        "name": [name for _, name, _ in rows],
        "value": [None if isinstance(value, str) else float(value) for _, _, value in rows],
        "text": [value if isinstance(value, str) else None for _, _, value in rows],
    }


def command_columns(match: Match, *, recover: bool) -> tuple[dict[str, Any], list[Problem]]:
    """Return the columns of ``commands``, (n_commands,), and problems: what a game log alone cannot give."""
    source, found, problems = Source.LOGGED, match.commands, []
    if recover and match.log is None:
        try:
            game = match.game
            found, gaps = recovered_commands(
                game.frames, game.players, types=game.player_types, params=game.server_params
            )
            source = Source.RECOVERED
            problems = [_gap(match, f"the game log alone does not give {gap}") for gap in gaps]
        except UsageError as error:
            problems = [_gap(match, f"no commands from the game log alone: {error}")]
        except Exception as error:  # a defect of the physics must not cost the match
            what = f"{type(error).__name__}: {error}"
            problems = [_gap(match, f"no commands from the game log alone ({what}); please report this file")]
    n_commands = len(found["cycle"])
    made: dict[str, Any] = {column.name: np.full(n_commands, np.nan, np.float32) for column in columns.INTERVALS}
    made |= found
    made["source"] = np.full(n_commands, source, np.int8)
    made["text"] = [""] * n_commands if source is Source.RECOVERED else command_texts(match)
    return made, problems


def _gap(match: Match, text: str) -> Problem:
    return Problem(code="not-recovered", severity=Severity.NOTE, text=text, path=match.rcg_path)


def problem_columns(problems: Iterable[Problem]) -> dict[str, Any]:
    """Return the columns of ``problems``: (n_problems,), by file and place."""
    problems = sorted(problems, key=_place)
    return {
        "code": [problem.code for problem in problems],
        "severity": [str(problem.severity) for problem in problems],
        "text": [problem.text for problem in problems],
        "file": [_name(problem.path) for problem in problems],
        "line": [problem.line for problem in problems],
        "byte": [problem.byte for problem in problems],
        "cycle": [problem.cycle for problem in problems],
    }


def _place(problem: Problem) -> tuple[Any, ...]:
    """Return a key that sorts problems by ``schema.PROBLEMS.order``."""
    places = (-1 if place is None else place for place in (problem.byte, problem.line))
    cycle = () if problem.cycle is None else (problem.cycle,)
    return (_name(problem.path) or "", *places, problem.code, problem.text, str(problem.severity), cycle)


def command_texts(match: Match) -> pa.Array:
    """Return the text of every command (n_commands,), gathered from the log without a Python string each."""
    if match.log is None:
        return pa.array([], pa.string())
    start = match.log.commands["text_start"].astype(np.int64)
    length = match.log.commands["text_stop"].astype(np.int64) - start
    offsets = np.zeros(len(start) + 1, np.int32)
    np.cumsum(length, out=offsets[1:])
    # Byte k of the joined text lies in the log at its command's start plus its distance from that command's offset.
    source = np.arange(offsets[-1]) + np.repeat(start - offsets[:-1], length)
    joined = np.frombuffer(match.log.text, np.uint8)[source]
    texts = pa.Array.from_buffers(pa.binary(), len(start), [None, pa.py_buffer(offsets), pa.py_buffer(joined)])
    try:
        return texts.cast(pa.string())
    except pa.ArrowInvalid:  # a client may send bytes that are no UTF-8
        return pa.array([text.decode("utf-8", "replace") for text in texts.to_pylist()], pa.string())


def started_at(path: Path | None) -> datetime | None:
    """Return the server's start from a log's name, ``20240718101530-A_2-vs-B_1.rcg``; None where it has none.

    Servers before 15.2 leave the seconds out.
    """
    found = re.match(r"(\d{12})(\d{2})?-", path.name) if path is not None else None
    if found is None:
        return None
    try:
        return datetime.strptime(found[1] + (found[2] or "00"), "%Y%m%d%H%M%S")
    except ValueError:  # digits that are no date
        return None


def numpy_columns(table: Table, rows: pa.Table) -> Columns:
    """Return rows (all columns or some) as NumPy columns, typed as in ``Match``: NULL is NaN, text an object array.

    The columns of ``player_states`` come back in the shape (n_frames, 22).
    """
    made: Columns = {}
    for field in table.select(rows.column_names):
        column = rows.column(field.name)
        if field.dtype in ("string", "timestamp"):
            values: NDArray[Any] = np.empty(rows.num_rows, object)
            values[:] = column.to_pylist()
        else:
            values = column.to_numpy()
            if values.dtype.name != field.numpy:
                values = values.astype(field.numpy)
        made[field.name] = values.reshape(-1, N_PLAYERS) if table is schema.PLAYER_STATES else values
    return made


def parameters(rows: pa.Table) -> dict[str, dict[str, float | str]]:
    """Return the table ``parameters`` of one match by scope and name."""
    found: dict[str, dict[str, float | str]] = {"server": {}, "player": {}}
    for row in rows.to_pylist():
        found[row["scope"]][row["name"]] = row["value"] if row["text"] is None else row["text"]
    return found


def _n_frames(match: Match) -> int:
    return len(match.frames["cycle"])


def _name(path: Path | None) -> str | None:
    """Return a file name that every writer takes: bytes that are no UTF-8 become the replacement character."""
    return None if path is None else path.name.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
