"""The tables of a store: columns, types, units, meanings. What the logs define comes from ``logs.columns``.

Numbers that the logs hold unsigned are signed and wider in SQL, so that a difference of two columns cannot overflow and
every SQL server has the type. A value that the log does not hold (NaN) is NULL.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from teamclone.errors import StoreError, UsageError, choose
from teamclone.events import definitions
from teamclone.logs import columns
from teamclone.logs.columns import Column, Source
from teamclone.rcss import player_types
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.playmodes import PlayMode
from teamclone.system import documents

if TYPE_CHECKING:
    import pyarrow as pa

FORMAT = 4
"""Raised whenever a reader of the old tables would misread the new ones."""

SIGNED = {"uint8": "int16", "uint16": "int32", "uint32": "int64"}
"""NumPy's unsigned types and the type that holds them in SQL."""

SQL_NAMES = {
    "bool": "boolean",
    "int8": "tinyint",
    "int16": "smallint",
    "int32": "integer",
    "int64": "bigint",
    "float32": "real",
    "float64": "double",
    "string": "varchar",
    "timestamp": "timestamp",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One column of a table.

    Attributes:
        dtype: the stored type, a key of ``SQL_NAMES``.
        numpy: the NumPy type in which the store returns it, as in ``Match``.
    """

    name: str
    dtype: str
    numpy: str
    unit: str
    about: str

    @property
    def sql_type(self) -> str:
        """The column's type in DuckDB's SQL."""
        return SQL_NAMES[self.dtype]


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """One table.

    Attributes:
        key: the columns that identify a row.
        rows: given where they are fixed.
        order: SQL that sorts the rows of a match into the order in which a store returns them.
    """

    name: str
    about: str
    key: tuple[str, ...]
    fields: tuple[Field, ...]
    rows: tuple[tuple[int, str], ...] = ()
    order: str = "match_id"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the columns, in their order."""
        return tuple(field.name for field in self.fields)

    def select(self, names: Sequence[str] | None) -> tuple[Field, ...]:
        """Return the fields of these names, in their order; None for all.

        Raises:
            UsageError: a name is no column of this table.
        """
        if names is None:
            return self.fields
        by_name = {field.name: field for field in self.fields}
        for name in names:
            if name not in by_name:
                raise UsageError(unknown("column", name, self.names, where=f"table {self.name}"))
        return tuple(by_name[name] for name in names)


def unknown(what: str, name: str, known: tuple[str, ...], *, where: str) -> str:
    """Return the text of an error about a name that does not exist, with near matches."""
    return f"{where} has no {what} {name!r}; {choose(name, known)}"


def _field(name: str, dtype: str, unit: str, about: str) -> Field:
    return Field(name=name, dtype=dtype, numpy=dtype, unit=unit, about=about)


def _logged(specs: tuple[Column, ...]) -> tuple[Field, ...]:
    return tuple(
        Field(
            name=spec.name,
            dtype=SIGNED.get(spec.dtype, spec.dtype),
            numpy=spec.dtype,
            unit=spec.unit,
            about=spec.about,
        )
        for spec in specs
    )


MATCH_ID = _field("match_id", "string", "", "the match: 16 hex digits, a hash of its game log")

MATCHES = Table(
    name="matches",
    about="One row a match.",
    key=("match_id",),
    fields=(
        MATCH_ID,
        _field(
            "started_at", "timestamp", "", "local time of the server's start, from the file name; NULL if it has none"
        ),
        _field("left_name", "string", "", "name of the left team; NULL where none connected"),
        _field("right_name", "string", "", "name of the right team; NULL where none connected"),
        _field("left_score", "int16", "", "goals of the left team"),
        _field("right_score", "int16", "", "goals of the right team"),
        _field("left_penalties_scored", "int16", "", "penalties scored by the left team in the shoot-out"),
        _field("left_penalties_missed", "int16", "", "penalties missed by the left team in the shoot-out"),
        _field("right_penalties_scored", "int16", "", "penalties scored by the right team in the shoot-out"),
        _field("right_penalties_missed", "int16", "", "penalties missed by the right team in the shoot-out"),
        _field("n_frames", "int32", "", "rows of frames"),
        _field("n_play_on_frames", "int32", "", "frames in play mode play_on"),
        _field("n_commands", "int32", "", "rows of commands"),
        _field("n_events", "int32", "", "rows of events"),
        _field("n_problems", "int32", "", "rows of problems"),
        _field("complete", "bool", "", "the server closed the game log; false when it was killed or the file is cut"),
        _field("log_version", "string", "", "version of the game log: 1 to 6, json-17 to json-19; `none` without one"),
        _field("server_version", "string", "", "rcssserver's version where the log names it"),
        _field("game_log", "string", "", "file name of the game log; NULL if there was none"),
        _field("command_log", "string", "", "file name of the command log; NULL if there was none"),
        _field("teamclone_version", "string", "", "the version of teamclone that read the logs"),
    ),
)

FRAME = _field("frame", "int32", "", "index of the frame in its match, from 0")

FRAMES = Table(
    name="frames",
    about="One row a frame of the game log: clock, play mode, score, ball.",
    key=("match_id", "frame"),
    fields=(MATCH_ID, FRAME, *_logged(columns.FRAMES)),
    order="frame",
)

PLAYER_STATES = Table(
    name="player_states",
    about="One row a frame and player, 22 a frame, players off the field included (their state is 0).",
    key=("match_id", "frame", "side", "unum"),
    fields=(
        MATCH_ID,
        FRAME,
        _field("side", "int8", "", "1 left, -1 right"),
        Field(name="unum", dtype="int16", numpy="uint8", unit="", about="player's number, 1 to 11"),
        *_logged(columns.PLAYERS),
    ),
    order="frame, side desc, unum",
)

COMMANDS = Table(
    name="commands",
    about=(
        "One row a command that the server received, in the order of the command log. Of a match without one, the "
        "commands that the game log alone implies: those that the server executed of dash, turn, kick, tackle, catch, "
        "move and turn_neck; `line` then counts them."
    ),
    key=("match_id", "line", "side", "unum", "order"),
    fields=(
        MATCH_ID,
        *_logged(columns.COMMANDS),
        _field("source", "int8", "", "where it is known from, see the command_sources table"),
        *_logged(columns.INTERVALS),
        _field("text", "string", "", "its text besides numbers: the payload of say, `our 9` of attentionto"),
    ),
    order='line, side, unum, "order"',
)

TYPE_FIELDS = {
    "player_speed_max": ("m/cycle", "highest speed"),
    "stamina_inc_max": ("stamina/cycle", "stamina recovered a cycle at full recovery"),
    "player_decay": ("", "share of the velocity left after a cycle"),
    "inertia_moment": ("cycle/m", "how much speed hampers a turn"),
    "dash_power_rate": ("m/cycle²", "acceleration of one unit of dash power"),
    "player_size": ("m", "radius of the body"),
    "kickable_margin": ("m", "reach beyond the radii of body and ball"),
    "kick_rand": ("", "noise of a kick"),
    "extra_stamina": ("stamina", "stamina left when exhausted"),
    "effort_max": ("", "highest dash efficiency"),
    "effort_min": ("", "lowest dash efficiency"),
    "kick_power_rate": ("m/cycle²", "ball acceleration of one unit of kick power"),
    "foul_detect_probability": ("", "probability that the referee sees a foul of the player"),
    "catchable_area_l_stretch": ("", "how far a goalkeeper's reach stretches, as a factor"),
}
"""Unit and meaning of ``player_types.FIELDS``."""

PLAYER_TYPES = Table(
    name="player_types",
    about="One row a heterogeneous player type of a match. What an old log leaves out holds the server's default.",
    key=("match_id", "type"),
    fields=(
        MATCH_ID,
        Field(name="type", dtype="int16", numpy="uint8", unit="", about="id of the type; 0 is the default type"),
        *(_field(name, "float64", *TYPE_FIELDS[name]) for name in player_types.FIELDS),
    ),
    order="type",
)

PARAMETERS = Table(
    name="parameters",
    about="One row a parameter that the game log lists, under the name the server gives it.",
    key=("match_id", "scope", "name"),
    fields=(
        MATCH_ID,
        _field("scope", "string", "", "`server` for server_param, `player` for player_param"),
        _field("name", "string", "", "name of the parameter"),
        _field("value", "float64", "", "its number, 0 or 1 for a truth value; NULL for text"),
        _field("text", "string", "", "its text; NULL for a number"),
    ),
    order="scope desc, name",
)

EVENTS = Table(
    name="events",
    about="One row an announcement of the referee in the command log.",
    key=("match_id", "line"),
    fields=(MATCH_ID, *_logged(columns.EVENTS), _field("text", "string", "", "its words: `goal_l_1`, `kick_off_r`")),
    order="line",
)

MATCH_EVENTS = Table(
    name="match_events",
    about=(
        "One row an event of the match, found in the game log: passes, shots, tackles, set plays and so on. The page "
        "of `teamclone events` defines the kinds and their outcomes."
    ),
    key=("match_id", "event"),
    fields=(
        MATCH_ID,
        _field("event", "int32", "", "place among the events of its match, from 0, by frame"),
        *_logged(definitions.COLUMNS),
    ),
    order="event",
)

PROBLEMS = Table(
    name="problems",
    about="One row for each thing that was odd in the files of a match.",
    key=("match_id", "code", "file", "line", "byte"),
    fields=(
        MATCH_ID,
        _field("code", "string", "", "short name for programs: `truncated`"),
        _field("severity", "string", "", "`note` costs nothing, `warning` some records, `error` the rest of a file"),
        _field("text", "string", "", "the problem: the expected and the found value"),
        _field("file", "string", "", "file name; NULL where it concerns both files"),
        _field("line", "int32", "", "line of the decompressed file, from 1; NULL where unknown"),
        _field("byte", "int64", "byte", "offset in the decompressed file, from 0; NULL where unknown"),
        _field("cycle", "int32", "cycle", "server time; NULL where unknown"),
    ),
    # All columns: several problems may speak of one place.
    order="file nulls first, byte nulls first, line nulls first, code, text, severity, cycle nulls first",
)


def _names(name: str, about: str, members: tuple[tuple[int, str], ...]) -> Table:
    return Table(
        name=name,
        about=about,
        key=("id",),
        fields=(
            _field("id", "int16", "", "the number that other tables hold"),
            _field("name", "string", "", "the server's word"),
        ),
        rows=members,
    )


PLAYMODES = _names("playmodes", "The play modes.", tuple((int(mode), mode.name.lower()) for mode in PlayMode))
COMMAND_KINDS = _names(
    "command_kinds", "The kinds of commands.", tuple((int(kind), kind.name.lower()) for kind in CommandKind)
)
COMMAND_SOURCES = _names(
    "command_sources",
    "Where commands are known from: a command log, or the game log alone.",
    tuple((int(source), source.name.lower()) for source in Source),
)

MATCH_TABLES = (MATCHES, FRAMES, PLAYER_STATES, COMMANDS, PLAYER_TYPES, PARAMETERS, EVENTS, MATCH_EVENTS, PROBLEMS)
"""The tables that every match fills."""

TABLES = (*MATCH_TABLES, PLAYMODES, COMMAND_KINDS, COMMAND_SOURCES)

BY_NAME = {table.name: table for table in TABLES}


def table(name: str) -> Table:
    """Return the table of a name.

    Raises:
        UsageError: there is none; near matches are listed.
    """
    if name not in BY_NAME:
        raise UsageError(unknown("table", name, tuple(BY_NAME), where="the store"))
    return BY_NAME[name]


def check_format(number: object, version: object, *, where: str, place: str) -> None:
    """Raise unless a store has our format number.

    Args:
        version: the teamclone that wrote it.
        where: the store, for the message.
        place: the kind of place to ingest into instead: a folder, a schema.

    Raises:
        StoreError: the text names the numbers and the remedy.
    """
    newer = isinstance(number, int) and number > FORMAT
    documents.check_format(
        number,
        number=FORMAT,
        what="store",
        where=where,
        again="update teamclone" if newer else f"ingest the logs anew into another {place}",
        error=StoreError,
        writer=version,
    )


def arrow_schema(fields: tuple[Field, ...]) -> pa.Schema:
    """Return fields as an Arrow schema, with unit and meaning as metadata, so that a Parquet file explains itself."""
    import pyarrow as pa

    types = {
        "bool": pa.bool_(),
        "int8": pa.int8(),
        "int16": pa.int16(),
        "int32": pa.int32(),
        "int64": pa.int64(),
        "float32": pa.float32(),
        "float64": pa.float64(),
        "string": pa.string(),
        "timestamp": pa.timestamp("ms"),
    }
    return pa.schema(
        [
            pa.field(field.name, types[field.dtype], metadata={"unit": field.unit, "about": field.about})
            for field in fields
        ]
    )


def create_fixed(table: Table) -> str:
    """Return the SQL statement that defines a table whose rows are fixed."""
    rows = ", ".join(f"({number}, '{word}')" for number, word in table.rows)
    return f"create view {table.name} as select id::smallint as id, name from (values {rows}) as made(id, name)"


def markdown() -> str:
    """Return the page `docs/reference/data-model.md`; `docs/generate.py` writes it."""
    lines = [
        "# Data model",
        "",
        "<!-- Written by docs/generate.py from teamclone.store.schema. -->",
        "",
        "The tables of a store, for `teamclone sql` and for any reader of its Parquet files or of `store.duckdb`.",
        "[PostgreSQL](../howto/postgresql.md) has the differences in a database server.",
        "Positions are in metres in the [server's frame](../explanation/frame-of-reference.md): origin at the centre",
        "spot, +x towards the goal that the left team attacks, +y downwards on a monitor, angles in degrees from +x",
        "towards +y. Nothing is mirrored for the right team.",
        "A value that the log does not hold is NULL wherever a description has NaN; the NumPy readers return NaN.",
        f"This is format {FORMAT}.",
        "",
        "## On disk",
        "",
        "```",
        "STORE/store.json                          format number, version of teamclone",
        "STORE/matches/<match_id>/<table>.parquet  the rows of one match",
        "STORE/matches/<match_id>/meta.json        rows of each table, hashes of the sources, units",
        "STORE/files/<key>.json                    the status of each source file",
        "STORE/store.duckdb                        views over the Parquet files, for other programs",
        "```",
        "",
        "The Parquet files are the truth. A folder in `matches/` appears complete or not at all, so that a store can",
        "be read while matches are added. `store.duckdb` names the files by their full path: after moving a store, the",
        "next `teamclone ingest` makes it anew; `teamclone` itself never needs it.",
        "",
    ]
    for entry in TABLES:
        lines += [f"## {entry.name}", "", f"{entry.about} Key: {', '.join(f'`{name}`' for name in entry.key)}.", ""]
        lines += ["| column | type | unit | meaning |", "| --- | --- | --- | --- |"]
        lines += [f"| `{item.name}` | {item.sql_type} | {item.unit} | {item.about} |" for item in entry.fields]
        lines.append("")
        if entry.rows:
            lines += [", ".join(f"{number} `{word}`" if word else f"{number}" for number, word in entry.rows) + ".", ""]
    return "\n".join(lines)
