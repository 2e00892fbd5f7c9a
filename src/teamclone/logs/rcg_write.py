"""Writes game logs as the server does: text versions 4, 5 and 6 (rcssserver `serializermonitor.cpp`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO, Literal

import numpy as np

from teamclone.errors import UsageError
from teamclone.logs import columns
from teamclone.logs.assemble import SCORES
from teamclone.logs.match import Columns, GameLog, Match
from teamclone.rcss import player_types
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.playmodes import PlayMode

TextVersion = Literal[4, 5, 6]

_UNUMS = tuple((side, unum) for side in "lr" for unum in range(1, N_TEAM + 1))
_MOTION = ("x", "y", "vx", "vy", "body", "neck")
_POINTTO = ("pointto_x", "pointto_y")
_FOCUS = ("focus_distance", "focus_direction")
_STAMINA = ("stamina", "effort", "recovery", "capacity")


def write_text(log: Match | GameLog, file: BinaryIO, *, version: TextVersion = 6) -> None:
    """Write a game log as text. Reading it back gives the same columns, at 6 significant digits as the server prints.

    Columns that the version has no place for are left out: the capacity before 5, the focus before 6, and in all of
    them the stoppage counter, which a reader counts anew.

    Raises:
        UsageError: the log lacks columns that the version writes for every player, as older versions do.
    """
    game = log.game if isinstance(log, Match) else log
    written = _columns_of(version)
    _require(game.players, written, version=version)
    file.write(f"ULG{version}\n".encode())
    for line in (*_header(game), *_records(game, written), *_tail(game)):
        file.write(line.encode())


def _columns_of(version: TextVersion) -> tuple[str, ...]:
    """Return the columns that the version writes for every player; arm and attention are there only while used."""
    counters = [columns.counter_name(kind) for kind in columns.COUNTERS]
    if version < 6:
        counters.remove(columns.counter_name(CommandKind.CHANGE_FOCUS))
    young = (*(("capacity",) if version < 5 else ()), *(_FOCUS if version < 6 else ()))
    names = ("type", "state", *_MOTION, "view_quality", "view_width", *_FOCUS, *_STAMINA, *counters)
    return tuple(name for name in names if name not in young)


def _require(players: Columns, names: tuple[str, ...], *, version: TextVersion) -> None:
    def lacks(name: str) -> bool:
        values = players[name]
        if values.dtype.kind == "f":
            return bool(np.isnan(values).any())
        missing = {"view_quality": values == 255}.get(name, values < 0)
        return bool(missing.any())

    if lacking := [name for name in names if lacks(name)]:
        raise UsageError(
            f"cannot write text version {version}: the log lacks {', '.join(lacking)}; try a lower version"
        )


def _header(game: GameLog) -> Iterator[str]:
    yield f"(server_param {_parameters(game.server_params)})\n"
    yield f"(player_param {_parameters(game.player_params)})\n"
    for row in range(len(game.player_types[player_types.FIELDS[0]])):
        fields = {"id": float(row)} | {name: float(game.player_types[name][row]) for name in player_types.FIELDS}
        yield f"(player_type {_parameters(fields)})\n"


def _parameters(values: Mapping[str, float | str]) -> str:
    return "".join(
        f'({name} "{value}")' if isinstance(value, str) else f"({name} {_number(value)})"
        for name, value in values.items()
    )


def _number(value: float) -> str:
    """Format whole numbers in full, like the server's integers; the rest like a C++ stream."""
    return f"{value:.0f}" if value.is_integer() else f"{value:g}"


def _records(game: GameLog, written: tuple[str, ...]) -> Iterator[str]:
    frames, players = game.frames, game.players
    mode, scores = int(PlayMode.NULL), None
    for frame, cycle in enumerate(frames["cycle"].tolist()):
        if frames["playmode"][frame] != mode:
            mode = int(frames["playmode"][frame])
            yield f"(playmode {cycle} {PlayMode(mode).name.lower()})\n"
        now = tuple(int(frames[name][frame]) for name in SCORES)
        if now != scores:
            scores = now
            yield _team_line(game, cycle, scores)
        ball = " ".join(f"{frames[name][frame]:g}" for name in ("ball_x", "ball_y", "ball_vx", "ball_vy"))
        yield f"(show {cycle} ((b) {ball}){''.join(_players(players, frame, written))})\n"


def _players(players: Columns, frame: int, written: tuple[str, ...]) -> Iterator[str]:
    names = (*written, *_POINTTO, "attention_side", "attention_unum")
    at = {name: players[name][frame].tolist() for name in names}
    for row, (side, unum) in enumerate(_UNUMS):
        player = {name: values[row] for name, values in at.items()}
        yield f" (({side} {unum}) {' '.join(_player(player, written))})"


def _player(player: Mapping[str, Any], written: tuple[str, ...]) -> Iterator[str]:
    def numbers(*names: str) -> str:
        return " ".join(f"{player[name]:g}" for name in names)

    state = player["state"]
    yield f"{player['type']} {f'{state:#x}' if state else '0'} {numbers(*_MOTION)}"
    if not math.isnan(player["pointto_x"]):
        yield numbers(*_POINTTO)
    yield f"(v {'h' if player['view_quality'] else 'l'} {numbers('view_width')})"
    if _FOCUS[0] in written:
        yield f"(fp {numbers(*_FOCUS)})"
    yield f"(s {numbers(*(name for name in _STAMINA if name in written))})"
    if player["attention_unum"]:
        yield f"(f {'l' if player['attention_side'] > 0 else 'r'} {player['attention_unum']})"
    yield f"(c {' '.join(str(player[name]) for name in written if name.startswith('count_'))})"


def _team_line(game: GameLog, cycle: int, scores: tuple[int, ...]) -> str:
    shown = scores if any(scores[2:]) else scores[:2]
    return f"(team {cycle} {game.left.name or 'null'} {game.right.name or 'null'} {' '.join(map(str, shown))})\n"


def _tail(game: GameLog) -> Iterator[str]:
    """Return the server's last line of a log. The date of the match is not in our columns."""
    if not game.complete or not len(game.frames["cycle"]):
        return
    cycle = int(game.frames["cycle"][-1])
    left, right = ("null" if team.name is None else f"{team.name}_{team.score}" for team in (game.left, game.right))
    yield f'(msg {cycle} 1 "(result 000000000000 {left}-vs-{right})")\n'
    penalties = [count for team in (game.left, game.right) for count in (team.penalties_scored, team.penalties_missed)]
    yield _team_line(game, cycle, (game.left.score, game.right.score, *penalties))
