"""``Match``: one match as NumPy columns, and the problems of its files."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import UsageError, choose, place
from teamclone.logs import columns
from teamclone.rcss import player_types as types_of

Columns = dict[str, NDArray[Any]]
"""Arrays by column name, all of one length."""


class Severity(StrEnum):
    """How much a problem costs: ``note`` nothing, ``warning`` some records, ``error`` the rest of a file."""

    NOTE = "note"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Something odd in a file, with its place. ``code`` is stable and short, for programs: ``truncated``."""

    code: str
    severity: Severity
    text: str
    path: Path | None = None
    line: int | None = None
    byte: int | None = None
    cycle: int | None = None

    def __str__(self) -> str:
        return place(path=self.path, line=self.line, byte=self.byte, cycle=self.cycle) + self.text


@dataclass(frozen=True, slots=True, kw_only=True)
class Team:
    """A side of the match. ``name`` is None where no team connected."""

    name: str | None
    score: int
    penalties_scored: int = 0
    penalties_missed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class GameLog:
    """The content of a game log (.rcg), in any of its versions.

    Attributes:
        log_version: ``"1"`` .. ``"6"`` or ``"json-17"``, ``"json-18"``, ``"json-19"``.
        server_version: rcssserver's version where the log names it (JSON-19), else None.
        frames: the columns ``columns.FRAMES``, shape (n_frames,).
        players: the columns ``columns.PLAYERS``, shape (n_frames, 22).
        player_types: the columns of ``player_types.FIELDS``, float64, shape (n_types,); row = type id. Fields the
            log lacks hold the server's defaults.
        server_params, player_params: as the log lists them; numbers as float, booleans as 0.0 or 1.0, else text.
        complete: the log was closed by the server (has its last record).
    """

    log_version: str
    server_version: str | None = None
    left: Team
    right: Team
    frames: Columns = field(repr=False)
    players: Columns = field(repr=False)
    player_types: Columns = field(repr=False)
    server_params: dict[str, float | str] = field(repr=False)
    player_params: dict[str, float | str] = field(repr=False)
    complete: bool
    problems: tuple[Problem, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandLog:
    """The content of a command log (.rcl).

    Attributes:
        commands: the columns ``columns.COMMANDS`` plus ``text_start`` and ``text_stop`` (int64 offsets into ``text``).
        text: the decompressed log, which command texts are slices of.
        events: the columns ``columns.EVENTS``; ``event_texts`` their words: ``"goal_l_1"``.
        has_stoppage: the log stamps lines with the stoppage counter (servers 13 and later).
    """

    commands: Columns = field(repr=False)
    text: bytes = field(repr=False)
    events: Columns = field(repr=False)
    event_texts: tuple[str, ...] = field(repr=False)
    has_stoppage: bool
    problems: tuple[Problem, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Match:
    """One match: game log and command log bound together.

    Attributes:
        match_id: 16 hex digits, a hash of the decompressed game log (of the command log where there is no game log).
        rcg_path, rcl_path: the files it came from; None where there is none or it was a stream.
        game: the game log. Where only a command log was given it has no frames.
        log: the command log, or None.
        problems: of both logs and of their binding.
    """

    match_id: str
    rcg_path: Path | None
    rcl_path: Path | None
    game: GameLog
    log: CommandLog | None
    problems: tuple[Problem, ...] = field(default=())

    def __repr__(self) -> str:
        cycle, names = self.frames["cycle"], [team.name or "nobody" for team in (self.left, self.right)]
        score, cycles = f"{self.left.score}:{self.right.score}", int(cycle[-1]) if len(cycle) else 0
        return f"Match({names[0]} {score} {names[1]}, {cycles:,} cycles, {self.match_id})"

    @property
    def left(self) -> Team:
        """The left team, see ``GameLog.left``."""
        return self.game.left

    @property
    def right(self) -> Team:
        """The right team, see ``GameLog.right``."""
        return self.game.right

    @property
    def frames(self) -> Columns:
        """``columns.FRAMES``, shape (n_frames,)."""
        return self.game.frames

    @property
    def players(self) -> Columns:
        """``columns.PLAYERS``, shape (n_frames, 22)."""
        return self.game.players

    @property
    def commands(self) -> Columns:
        """``columns.COMMANDS``, shape (n_commands,); empty without a command log."""
        return self.log.commands if self.log is not None else empty_columns(columns.COMMANDS, 0)

    @property
    def events(self) -> Columns:
        """``columns.EVENTS``, shape (n_events,); empty without a command log."""
        return self.log.events if self.log is not None else empty_columns(columns.EVENTS, 0)

    @property
    def event_texts(self) -> tuple[str, ...]:
        """The words of the events, (n_events,); empty without a command log."""
        return self.log.event_texts if self.log is not None else ()

    def command_text(self, index: int) -> str:
        """Return the text of a command: the payload of ``say``, ``our 9`` of ``attentionto``; else empty.

        Raises:
            IndexError: there is no command ``index``.
        """
        if self.log is None:
            raise IndexError(index)
        start, stop = self.log.commands["text_start"][index], self.log.commands["text_stop"][index]
        return self.log.text[start:stop].decode("utf-8", "replace")


def side_named(match_id: str, left: str | None, right: str | None, *, team: str | None, side: str | None) -> int:
    """Return the side of a match that ``team`` or ``side`` names, 1 left or -1 right.

    Args:
        left, right: names of the teams, None for an empty side.

    Raises:
        UsageError: neither or both are named, or the team does not play.
    """
    sides = {"left": 1, "right": -1}
    if (team is None) == (side is None):
        raise UsageError(f"match {match_id}: name either a team ({left}, {right}) or a side")
    if side is not None:
        if side not in sides:
            raise UsageError(f"expected the side left or right, got {side!r}")
        return sides[side]
    names = [name for name in (left, right) if name]
    if team not in names:
        raise UsageError(f"match {match_id}: no team {team!r}; {choose(str(team), names)}")
    if left == right:
        raise UsageError(f"match {match_id}: both teams are called {team!r}; name a side instead")
    return 1 if team == left else -1


def empty_columns(spec: tuple[columns.Column, ...], *shape: int) -> Columns:
    """Return columns of a spec, filled with "not in this log".

    That is NaN, -1 of the counters, 255 of ``view_quality``, else 0.
    """
    made: Columns = {}
    for column in spec:
        dtype = np.dtype(column.dtype)
        fill: float = np.nan if dtype.kind == "f" else 0
        if column.name.startswith("count_"):
            fill = -1
        elif column.name == "view_quality":
            fill = 255
        made[column.name] = np.full(shape, fill, dtype)
    return made


def default_player_types(n_types: int) -> Columns:
    """Return ``n_types`` copies of the server's default type, float64."""
    return {name: np.full(n_types, value, np.float64) for name, value in types_of.DEFAULTS.items()}
