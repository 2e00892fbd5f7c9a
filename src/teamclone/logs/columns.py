"""The columns of a match: their names, types, units and meanings. Store, docs and tests read them from here."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from teamclone.rcss.commands import CommandKind


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column: ``dtype`` is NumPy's name, ``unit`` is empty for counts and codes."""

    name: str
    dtype: str
    unit: str
    about: str


def column(name: str, dtype: str, unit: str, about: str) -> Column:
    """Return a column, for tables of them."""
    return Column(name=name, dtype=dtype, unit=unit, about=about)


FRAMES = (
    column("cycle", "int32", "cycle", "server time of the frame; repeats while the clock is stopped"),
    column("stoppage", "int32", "cycle", "frames since the clock stopped; 0 while it runs"),
    column("playmode", "uint8", "", "play mode id, see the playmodes table"),
    column("left_score", "int16", "", "goals of the left team"),
    column("right_score", "int16", "", "goals of the right team"),
    column("left_penalties_scored", "int16", "", "penalties scored by the left team in the shoot-out"),
    column("left_penalties_missed", "int16", "", "penalties missed by the left team in the shoot-out"),
    column("right_penalties_scored", "int16", "", "penalties scored by the right team in the shoot-out"),
    column("right_penalties_missed", "int16", "", "penalties missed by the right team in the shoot-out"),
    column("ball_x", "float32", "m", "ball position, +x towards the goal that the left team attacks"),
    column("ball_y", "float32", "m", "ball position, +y downwards on a monitor"),
    column("ball_vx", "float32", "m/cycle", "ball velocity after decay; NaN in log versions 1 and 2"),
    column("ball_vy", "float32", "m/cycle", "ball velocity after decay; NaN in log versions 1 and 2"),
)
"""One value a frame: shape (n_frames,)."""

COUNTERS = (
    CommandKind.KICK,
    CommandKind.DASH,
    CommandKind.TURN,
    CommandKind.CATCH,
    CommandKind.MOVE,
    CommandKind.TURN_NECK,
    CommandKind.CHANGE_VIEW,
    CommandKind.SAY,
    CommandKind.TACKLE,
    CommandKind.POINTTO,
    CommandKind.ATTENTIONTO,
    CommandKind.CHANGE_FOCUS,
)
"""Commands whose executions the server counts, in the order of a text log."""


def counter_name(kind: CommandKind) -> str:
    """Return the column that counts the executed commands of a kind: ``count_dash``."""
    return f"count_{kind.name.lower()}"


PLAYERS = (
    column("type", "uint8", "", "heterogeneous player type now in use"),
    column("state", "uint32", "", "bit mask, see teamclone.rcss.state_bits; 0 when not on the field"),
    column("x", "float32", "m", "position"),
    column("y", "float32", "m", "position"),
    column("vx", "float32", "m/cycle", "velocity after decay; NaN in log versions 1 and 2"),
    column("vy", "float32", "m/cycle", "velocity after decay; NaN in log versions 1 and 2"),
    column("body", "float32", "deg", "body direction, 0 = +x, positive towards +y"),
    column("neck", "float32", "deg", "neck direction relative to the body; NaN in log versions 1 and 2"),
    column("pointto_x", "float32", "m", "point the arm points at; NaN while it rests or where the version lacks it"),
    column("pointto_y", "float32", "m", "point the arm points at; NaN while it rests or where the version lacks it"),
    column("view_quality", "uint8", "", "1 high, 0 low; 255 where the version lacks it"),
    column("view_width", "float32", "deg", "opening of the view cone; NaN where the version lacks it"),
    column("focus_distance", "float32", "m", "distance of the vision focus point; NaN before text version 6"),
    column(
        "focus_direction", "float32", "deg", "direction of the focus point from the neck; NaN before text version 6"
    ),
    column("stamina", "float32", "stamina", "stamina after this cycle's recovery; NaN where the version lacks it"),
    column("effort", "float32", "", "dash efficiency; NaN where the version lacks it"),
    column("recovery", "float32", "", "stamina recovery rate; NaN where the version lacks it"),
    column("capacity", "float32", "stamina", "stamina left to recover; NaN before text version 5"),
    column("attention_side", "int8", "", "side of the player listened to: 1 left, -1 right, 0 none"),
    column("attention_unum", "uint8", "", "number of the player listened to; 0 none"),
    *(
        column(
            counter_name(kind),
            "int32",
            "",
            f"{kind.name.lower()} commands executed since the match began; -1 where the version lacks it",
        )
        for kind in COUNTERS
    ),
)
"""One value a frame and player: shape (n_frames, 22), left 1..11 then right 1..11."""

COMMANDS = (
    column("frame", "int32", "", "index of the frame the command acts on; -1 where the game log has none"),
    column("cycle", "int32", "cycle", "server time at which the command was received"),
    column("stoppage", "int32", "cycle", "stoppage counter at which the command was received"),
    column("line", "int32", "", "line of the command log, from 1"),
    column("order", "int32", "", "place among the commands of its sender in this cycle, from 0"),
    column("side", "int8", "", "sender's side: 1 left, -1 right, 0 trainer"),
    column("unum", "uint8", "", "sender's number; 0 for a coach or the trainer"),
    column("kind", "uint8", "", "command kind id, see the command_kinds table"),
    column("legs", "uint8", "", "two-leg dash: 1 left leg, 2 right leg, 3 both; 0 for every other command"),
    column(
        "valid", "bool", "", "false where the server's parser refuses it (NaN, unknown word, or after such an error)"
    ),
    column("arg0", "float32", "", "first number (power, moment, direction); of a two-leg dash the left leg's power"),
    column("arg1", "float32", "", "second number; of a two-leg dash the left leg's direction"),
    column("arg2", "float32", "", "third number; of a two-leg dash the right leg's power"),
    column("arg3", "float32", "", "fourth number; of a two-leg dash the right leg's direction"),
)
"""One value a received command: shape (n_commands,). The text of a command is ``Match.command_text``."""

INTERVALS = (
    column("low0", "float32", "", "of recovered commands the ends of the 90 % interval of `arg0`; else NaN"),
    column("high0", "float32", "", "its upper end"),
    column("low1", "float32", "", "so too of `arg1`"),
    column("high1", "float32", "", "its upper end"),
)
"""How well the numbers of a recovered command are known, see `dynamics.inverse`: shape (n_commands,)."""


class Source(IntEnum):
    """Where a command is known from. Ids are stable."""

    LOGGED = 0
    """A command log."""
    RECOVERED = 1
    """The game log alone, by what the command did."""


EVENTS = (
    column("cycle", "int32", "cycle", "server time of the announcement"),
    column("stoppage", "int32", "cycle", "stoppage counter of the announcement"),
    column("line", "int32", "", "line of the command log, from 1"),
)
"""One value an announcement of the referee: shape (n_events,). Its words are ``Match.event_texts``."""
