"""Queries that must return no row: impossible facts of a match, whatever its teams did.

Every query selects ``cycle`` and ``what`` (a text) of each row that is wrong, over the tables of one match. Limits that
are parameters of the server are taken from the match; where its log does not list them they are not checked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from teamclone.errors import TeamcloneError
from teamclone.logs.columns import COUNTERS, Source, counter_name
from teamclone.rcss import pitch, state_bits
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.store import schema

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One rule; ``about`` is the rule in words."""

    name: str
    about: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Query(Check):
    """A rule as a query that gives the rows which break it."""

    sql: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A rule that a match breaks: in how many rows, and the first of them."""

    check: Check
    rows: int
    cycle: int | None
    what: str

    def __str__(self) -> str:
        where = "" if self.cycle is None else f"cycle {self.cycle}: "
        more = "" if self.rows == 1 else f" (and {self.rows - 1} more)"
        return f"{self.check.name}: {where}{self.what}; {self.check.about}{more}"


# Logs before version 3 hold positions in sixteenths of a metre.
_SLACK = 0.07
_ON_FIELD = f"(state & {state_bits.STAND}) <> 0"
_PLAYER = "concat(case side when 1 then 'left ' else 'right ' end, unum)"
_SENDER = "concat(case side when 1 then 'left ' when -1 then 'right ' else 'trainer ' end, unum)"


def _parameter(name: str) -> str:
    return f"(select any_value(value) from parameters where scope = 'server' and name = '{name}')"


def _states(condition: str, shown: str) -> str:
    """Select the players on the field with ``condition``; ``shown`` is an SQL text."""
    return (
        f"select cycle, concat({_PLAYER}, ' has ', {shown}) as what "
        f"from player_states join frames using (match_id, frame) where {_ON_FIELD} and ({condition}) order by frame"
    )


def _commands(condition: str, shown: str) -> str:
    return (
        f"select cycle, concat('line ', line, ': ', {_SENDER}, ' ', {shown}) as what "
        f"from commands where {condition} order by line"
    )


_FALLING = " or ".join(f"{name} < lag({name}) over player" for name in (counter_name(kind) for kind in COUNTERS))
_NUMBERS = {
    CommandKind.DASH: 1,
    CommandKind.TURN: 1,
    CommandKind.TURN_NECK: 1,
    CommandKind.KICK: 2,
    CommandKind.MOVE: 2,
}

CHECKS = (
    Query(
        name="frame-numbers",
        about="frames are numbered 0, 1, 2, ...",
        sql="select cycle, concat('frame ', frame) as what from frames "
        "qualify frame <> row_number() over (order by frame) - 1 order by frame",
    ),
    Query(
        name="time-order",
        about="(cycle, stoppage) grows from frame to frame",
        sql="select cycle, concat('stoppage ', stoppage, ' at frame ', frame) as what from frames "
        "qualify (cycle, stoppage) <= lag((cycle, stoppage)) over (order by frame) order by frame",
    ),
    Query(
        name="playmode",
        about="every play mode is one of the server's",
        sql="select cycle, concat('play mode ', playmode) as what from frames "
        "where playmode not in (select id from playmodes where id > 0) order by frame",
    ),
    Query(
        name="score",
        about="no score falls",
        sql="select cycle, concat(left_score, ' : ', right_score) as what from frames "
        "window clock as (order by frame) "
        "qualify left_score < lag(left_score) over clock or right_score < lag(right_score) over clock order by frame",
    ),
    Query(
        name="final-score",
        about="the match has the score of its last frame",
        sql="select f.cycle, concat('match ', m.left_score, ' : ', m.right_score, ', frame ', f.left_score, ' : ', "
        "f.right_score) as what from matches m join frames f using (match_id) where f.frame = m.n_frames - 1 "
        "and (f.left_score, f.right_score) <> (m.left_score, m.right_score)",
    ),
    Query(
        name="ball-position",
        about="the ball is somewhere near the pitch",
        sql="select cycle, concat('ball at ', ball_x, ', ', ball_y) as what from frames where "
        f"not coalesce(abs(ball_x) <= {pitch.LENGTH} and abs(ball_y) <= {pitch.WIDTH}, false) order by frame",
    ),
    Query(
        name="ball-speed",
        about="the ball is no faster than ball_speed_max",
        sql="select cycle, concat('ball velocity ', ball_vx, ', ', ball_vy) as what from frames where "
        f"sqrt(ball_vx ** 2 + ball_vy ** 2) > {_parameter('ball_speed_max')} + {_SLACK} order by frame",
    ),
    Query(
        name="players-per-frame",
        about=f"every frame has players 1 to {N_TEAM} of both sides",
        sql="select f.cycle, concat(count(p.frame), ' players in frame ', f.frame) as what "
        "from frames f left join player_states p on p.frame = f.frame and abs(p.side) = 1 "
        f"and p.unum between 1 and {N_TEAM} "
        "group by f.frame, f.cycle "
        f"having count(p.frame) <> {N_PLAYERS} or count(distinct p.side * p.unum) <> {N_PLAYERS} "
        "order by f.frame",
    ),
    Query(
        name="player-position",
        about=f"players on the field are within {pitch.MAX_X} m and {pitch.MAX_Y} m of the centre",
        sql=_states(
            f"not coalesce(abs(x) <= {pitch.MAX_X + _SLACK} and abs(y) <= {pitch.MAX_Y + _SLACK}, false)",
            "'position ', x, ', ', y",
        ),
    ),
    Query(
        name="player-speed",
        about="no player is faster than its type allows",
        sql=f"select cycle, concat({_PLAYER}, ' has velocity ', vx, ', ', vy) as what from player_states "
        "join frames using (match_id, frame) join player_types using (match_id, type) "
        f"where {_ON_FIELD} and sqrt(vx ** 2 + vy ** 2) > player_speed_max + {_SLACK} order by frame",
    ),
    Query(
        name="body",
        about="body directions are within ±180 degrees",
        sql=_states("not coalesce(abs(body) <= 180.01, false)", "'body ', body"),
    ),
    Query(
        name="neck",
        about="neck directions are within minneckang and maxneckang",
        sql=_states(
            f"neck < {_parameter('minneckang')} - 0.01 or neck > {_parameter('maxneckang')} + 0.01", "'neck ', neck"
        ),
    ),
    Query(
        name="stamina",
        about="stamina is within 0 and stamina_max",
        sql=_states(f"stamina < 0 or stamina > {_parameter('stamina_max')} + {_SLACK}", "'stamina ', stamina"),
    ),
    Query(
        name="capacity",
        about="stamina capacity is at most stamina_capacity",
        sql=_states(
            f"{_parameter('stamina_capacity')} >= 0 and capacity > {_parameter('stamina_capacity')} + 1",
            "'capacity ', capacity",
        ),
    ),
    Query(
        name="effort",
        about="effort and recovery are within 0 and 1",
        sql=_states(
            "effort not between 0 and 1 or recovery not between 0 and 1", "'effort ', effort, ', recovery ', recovery"
        ),
    ),
    Query(
        name="player-type",
        about="every player's type is listed by the log",
        sql=_states(
            "exists (from player_types) and type not in (select type from player_types)", "'type ', player_states.type"
        ),
    ),
    Query(
        name="counters",
        about="counts of executed commands never fall",
        sql=f"select cycle, concat({_PLAYER}, ' counts fewer commands than a frame before') as what "
        f"from player_states join frames using (match_id, frame) "
        f"window player as (partition by side, unum order by frame) qualify {_FALLING} order by frame",
    ),
    Query(
        name="command-order",
        about="commands and their lines are in the order of time",
        sql="select cycle, concat('line ', line) as what from (select *, row_number() over () as place from commands) "
        "window log as (order by place) "
        "qualify cycle < lag(cycle) over log or line < lag(line) over log order by place",
    ),
    Query(
        name="command-sender",
        about="commands come from a side's players or coach, or from the trainer",
        sql=_commands(
            f"side not in (1, 0, -1) or unum not between 0 and {N_TEAM} or (side = 0 and unum <> 0)", "'sent a command'"
        ),
    ),
    Query(
        name="command-kind",
        about="every command kind is known",
        sql=_commands("kind not in (select id from command_kinds)", "'has kind ', kind"),
    ),
    Query(
        name="command-frame",
        about="a command's frame is of the command's cycle",
        sql="select c.cycle, concat('line ', c.line, ': frame ', c.frame) as what from commands c "
        "left join frames f on f.frame = c.frame "
        "where c.frame <> -1 and f.cycle is distinct from c.cycle order by c.line",
    ),
    Query(
        name="command-numbers",
        about="logged commands of players that the server takes have their numbers",
        sql=_commands(
            f"valid and unum > 0 and legs = 0 and source = {int(Source.LOGGED)} and ("
            + " or ".join(
                f"(kind = {int(kind)} and ({' or '.join(f'arg{place} is null' for place in range(count))}))"
                for kind, count in _NUMBERS.items()
            )
            + ")",
            "'lacks a number'",
        ),
    ),
)


def check_match(tables: Mapping[str, pa.Table]) -> list[Finding]:
    """Return the rules that the tables of one match break. The tables are those of ``convert.tables_of``."""
    import duckdb

    findings = []
    with duckdb.connect(config={"python_enable_replacements": "false"}) as connection:
        for name, rows in tables.items():
            connection.register(name, rows)
        for table in schema.TABLES:
            if table.rows:
                connection.execute(schema.create_fixed(table))
        for check in CHECKS:
            try:
                found = connection.execute(f"select count(*), first(cycle), first(what) from ({check.sql})").fetchone()
            except duckdb.Error as error:
                raise TeamcloneError(f"check {check.name} cannot be computed: {error}") from error
            if found is not None and found[0]:
                findings.append(Finding(check=check, rows=found[0], cycle=found[1], what=found[2]))
    return findings
