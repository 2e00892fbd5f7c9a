"""From the columns of one match to samples: cleaning rules, binding, the modelled team's point of view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset import layout
from teamclone.logs.align import executed_kind, first_body_commands, slot_of
from teamclone.logs.columns import counter_name
from teamclone.logs.match import Columns
from teamclone.rcss import pitch, state_bits
from teamclone.rcss.commands import BODY_KINDS, CLONED, CommandKind
from teamclone.rcss.playmodes import SITUATION, PlayMode, Situation
from teamclone.rcss.reference_frame import rotate_angle, rotate_point
from teamclone.world import channels

N_TEAM = 11

FRAME_COLUMNS = ("cycle", "stoppage", "playmode", "left_score", "right_score", "ball_x", "ball_y", "ball_vx", "ball_vy")
PLAYER_COLUMNS = (
    "type",
    "state",
    "x",
    "y",
    "vx",
    "vy",
    "body",
    "neck",
    "view_width",
    "stamina",
    "effort",
    "recovery",
    "capacity",
    *(counter_name(kind) for kind in BODY_KINDS),
)
COMMAND_COLUMNS = ("frame", "side", "unum", "kind", "legs", "valid", "arg0", "arg1", "arg2", "arg3")
"""What cleaning needs of a match's tables."""

_FLAGS = (
    (channels.FLAG_ON_FIELD, state_bits.STAND),
    (channels.FLAG_GOALIE, state_bits.GOALIE),
    (channels.FLAG_TACKLING, state_bits.TACKLE | state_bits.TACKLE_FAULT),
    (channels.FLAG_CHARGED, state_bits.FOUL_CHARGED),
    (channels.FLAG_COLLIDED, state_bits.BALL_COLLIDE | state_bits.PLAYER_COLLIDE | state_bits.POST_COLLIDE),
    (channels.FLAG_YELLOW, state_bits.YELLOW_CARD),
)


class Commands(StrEnum):
    """Which commands become samples."""

    EXECUTED = "executed"
    """Those whose counter rose: what the player did."""
    RECEIVED = "received"
    """The first of each cycle, also where the server refused it: what the player wanted."""


class TurnZero(StrEnum):
    """What becomes of ``(turn 0)``, by which many agents say that they do nothing."""

    KEEP = "keep"
    DROP = "drop"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """A cleaning step: how many commands it was given and how many it let through."""

    name: str
    before: int
    after: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchSamples:
    """One match, cleaned.

    Attributes:
        frames: layout.FRAME_ARRAYS without ``match``, only frames that have a sample.
        samples: layout.SAMPLE_ARRAYS without ``split``; ``frame`` counts from this match's first kept frame.
        rules: every cleaning step in order.
        player_cycles: cycles x players of the team on the field, of those players and in those play modes that the
            samples are of; field players in play_on by default.
        idle: those of them without any body command, and ``frozen`` those among them after a tackle or foul.
    """

    frames: Columns
    samples: Columns
    rules: tuple[Rule, ...]
    player_cycles: int
    idle: int
    frozen: int


def clean_match(
    frames: Columns,
    players: Columns,
    commands: Columns,
    server_params: Mapping[str, float | str],
    *,
    side: int,
    keep: Commands = Commands.EXECUTED,
    turn_zero: TurnZero = TurnZero.KEEP,
    goalkeepers: bool = False,
    repertoire: tuple[str, ...] = CLONED,
) -> MatchSamples:
    """Cleans and binds the commands of one team in one match.

    Args:
        frames: FRAME_COLUMNS, (n_frames,). players: PLAYER_COLUMNS, (n_frames, 22). commands: COMMAND_COLUMNS,
            (n_commands,) in log order.
        server_params: ranges of the arguments; the server's defaults where one is missing.
        side: the modelled team's, 1 left or -1 right.
        goalkeepers: keep the goalkeeper's commands, too.
        repertoire: the commands to keep, some of REPERTOIRE. With catch the goalkeeper is modelled as everybody is;
            with move every play mode of a Situation is taken, not only play_on; with none a cycle without a body
            command is a sample.
    """
    everybody, anytime = "catch" in repertoire, "move" in repertoire
    kinds = [CommandKind[name.upper()] for name in repertoire if name != "none"]
    rules: list[Rule] = []

    def narrow(rows: NDArray[np.int64], mask: NDArray[np.bool_], name: str) -> NDArray[np.int64]:
        kept = rows[mask]
        rules.append(Rule(name=name, before=len(rows), after=len(kept)))
        return kept

    rows = np.arange(len(commands["kind"]))
    rows = narrow(rows, (commands["side"] == side) & (commands["unum"] > 0), "sent by a player of the team")
    rows = narrow(rows, np.isin(commands["kind"][rows], BODY_KINDS), "body commands")
    rows = narrow(rows, commands["valid"][rows], "parsed by the server (no NaN)")
    n_frames = len(frames["cycle"])
    frame = commands["frame"][rows]
    rows = narrow(rows, (frame >= 0) & (frame < n_frames - 1), "bound to a frame that has a successor")
    if anytime:
        in_play = SITUATION[frames["playmode"]] != Situation.OTHER
        rows = narrow(rows, in_play[commands["frame"][rows]], "in play_on or around a set play")
    else:
        in_play = frames["playmode"] == PlayMode.PLAY_ON
        rows = narrow(rows, in_play[commands["frame"][rows]], "in play_on")
    slots = slot_of(commands["side"], commands["unum"])
    goalie = (players["state"] & state_bits.GOALIE) != 0
    if not everybody:
        of_field = ~goalie[commands["frame"][rows], slots[rows]]
        rows = narrow(rows, of_field | goalkeepers, "of field players")
    first = first_body_commands(commands, frames["playmode"])
    rows = narrow(rows, np.isin(rows, first), "first of the cycle")
    has_command = np.zeros_like(goalie)
    has_command[commands["frame"][rows], slots[rows]] = True
    *names, last = (kind.name.lower() for kind in kinds)
    rows = narrow(rows, np.isin(commands["kind"][rows], kinds), f"{', '.join(names)} or {last}")
    executed = _executed(players, commands, rows, slots, kinds)
    if keep is Commands.EXECUTED:
        rows, executed = narrow(rows, executed, "executed by the server"), executed[executed]
    is_turn_zero = (commands["kind"][rows] == CommandKind.TURN) & (commands["arg0"][rows] == 0)
    if turn_zero is TurnZero.DROP:
        rows, executed = narrow(rows, ~is_turn_zero, "not (turn 0)"), executed[~is_turn_zero]
        is_turn_zero = is_turn_zero[~is_turn_zero]

    own = slice(0, N_TEAM) if side > 0 else slice(N_TEAM, 2 * N_TEAM)
    state = players["state"][:-1, own]
    due = in_play[:-1, None] & ((state & state_bits.STAND) != 0)
    if not everybody:
        due &= ~goalie[:-1, own]
    idle = due & ~has_command[:-1, own]
    frozen = idle & ((state & (state_bits.TACKLE | state_bits.TACKLE_FAULT | state_bits.FOUL_CHARGED)) != 0)

    kind_index = np.zeros(max(CommandKind) + 1, np.uint8)
    kind_index[kinds] = np.arange(len(kinds))
    samples: Columns = {
        "frame": commands["frame"][rows].astype(np.int64),
        "player": (commands["unum"][rows] - 1).astype(np.uint8),
        "kind": kind_index[commands["kind"][rows]],
        "parameters": _parameters({name: commands[name][rows] for name in COMMAND_COLUMNS}, server_params),
        "executed": executed,
        "turn_zero": is_turn_zero,
    }
    if "none" in repertoire and len(commands["kind"]):
        nothing = _nothing(frames, players)[:-1, own]
        frame, player = np.nonzero(idle & nothing)
        added = {"frame": frame, "player": player, "kind": np.full(len(frame), repertoire.index("none"))}
        samples = {
            name: np.concatenate(
                [values, added.get(name, np.zeros((len(frame), *values.shape[1:]))).astype(values.dtype)]
            )
            for name, values in samples.items()
        }
    order = np.lexsort((samples["player"], samples["frame"]))
    samples = {name: values[order] for name, values in samples.items()}
    kept, local = np.unique(samples["frame"], return_inverse=True)
    return MatchSamples(
        frames=_frames(frames, players, kept, side=side),
        samples={**samples, "frame": local.astype(np.int32)},
        rules=tuple(rules),
        player_cycles=int(due.sum()),
        idle=int(idle.sum()),
        frozen=int(frozen.sum()),
    )


def _nothing(frames: Columns, players: Columns) -> NDArray[np.bool_]:
    """(n_frames, 22) whether the counters say that a player did nothing: a log that lost commands says so of nobody."""
    nothing: NDArray[np.bool_] = executed_kind(frames, players) == 0
    nothing &= players[counter_name(CommandKind.DASH)] >= 0
    return nothing


def _executed(
    players: Columns,
    commands: Columns,
    rows: NDArray[np.int64],
    slots: NDArray[np.int64],
    kinds: Sequence[CommandKind],
) -> NDArray[np.bool_]:
    """Whether the counter of each command's kind rose between its frame and the next."""
    rose = np.zeros(len(rows), np.bool_)
    for kind in kinds:
        of_kind = commands["kind"][rows] == kind
        frame, slot = commands["frame"][rows][of_kind], slots[rows][of_kind]
        counter = players[counter_name(kind)]
        rose[of_kind] = counter[frame + 1, slot] > np.maximum(counter[frame, slot], 0)
    return rose


def _parameters(commands: Columns, server_params: Mapping[str, float | str]) -> NDArray[np.float32]:
    """Arguments as the server uses them (rcss.md 3.1), shape (n, 2): power, degrees, metres of a move, unused ones 0.

    A two-leg dash is given as its sum: the mean of both legs' power vectors, as a power and a direction.
    """

    def limit(name: str, default: float) -> float:
        value = server_params.get(name, default)
        return float(value) if isinstance(value, float) else default

    kind, legs = commands["kind"], commands["legs"]
    arg = [commands[f"arg{index}"].astype(np.float64) for index in range(4)]
    least, most = limit("min_dash_power", -100.0), limit("max_dash_power", 100.0)
    step = limit("dash_angle_step", 1.0)

    def dash(power: NDArray[np.float64], direction: NDArray[np.float64]) -> tuple[NDArray[Any], NDArray[Any]]:
        direction = np.clip(direction, -180.0, 180.0)
        return np.clip(power, least, most), np.rint(direction / step) * step if step > 0 else direction

    values = np.zeros((len(kind), 2))
    is_dash, is_legs = kind == CommandKind.DASH, legs > 0
    plain = is_dash & ~is_legs
    values[plain, 0], values[plain, 1] = dash(arg[0][plain], arg[1][plain])
    if is_legs.any():
        total = np.zeros(int(is_legs.sum()), np.complex128)
        for power, direction in ((arg[0], arg[1]), (arg[2], arg[3])):
            used, angle = dash(np.nan_to_num(power[is_legs]), np.nan_to_num(direction[is_legs]))
            total += used * np.exp(1j * np.radians(angle)) / 2
        values[is_legs, 0], values[is_legs, 1] = np.abs(total), np.degrees(np.angle(total))
    turn = kind == CommandKind.TURN
    values[turn, 0] = np.clip(arg[0][turn], limit("minmoment", -180.0), limit("maxmoment", 180.0))
    kick = kind == CommandKind.KICK
    values[kick, 0] = np.clip(arg[0][kick], limit("minpower", -100.0), limit("maxpower", 100.0))
    values[kick, 1] = np.clip(arg[1][kick], -180.0, 180.0)
    tackle = kind == CommandKind.TACKLE
    values[tackle, 0] = np.clip(arg[0][tackle], -180.0, 180.0)
    catch = kind == CommandKind.CATCH
    values[catch, 0] = np.clip(arg[0][catch], limit("min_catch_angle", -180.0), limit("max_catch_angle", 180.0))
    move = kind == CommandKind.MOVE
    values[move, 0] = np.clip(arg[0][move], -pitch.MAX_X, pitch.MAX_X)
    values[move, 1] = np.clip(arg[1][move], -pitch.MAX_Y, pitch.MAX_Y)
    return values.astype(np.float32)


def _frames(frames: Columns, players: Columns, kept: NDArray[np.int64], *, side: int) -> Columns:
    """layout.FRAME_ARRAYS (without ``match``) of some frames, as the team on ``side`` sees them."""
    axis = np.arange(2 * N_TEAM) if side > 0 else np.roll(np.arange(2 * N_TEAM), N_TEAM)
    turned = side < 0

    def seen(name: str) -> NDArray[Any]:
        column: NDArray[Any] = players[name][np.ix_(kept, axis)]
        return column

    ball = np.stack([frames[name][kept] for name in ("ball_x", "ball_y", "ball_vx", "ball_vy")], axis=-1)
    position = np.stack([seen("x"), seen("y")], axis=-1)
    values: dict[str, NDArray[Any]] = {name: seen(name) for name in channels.PLAYER_CHANNELS if name in players}
    if turned:
        ball, position = rotate_point(ball), rotate_point(position)
        values["vx"], values["vy"] = rotate_point(values["vx"]), rotate_point(values["vy"])
        values["body"] = rotate_angle(values["body"])
    state = seen("state")
    values["flags"] = sum(
        (np.where((state & bits) != 0, flag, 0) for flag, bits in _FLAGS), np.zeros(state.shape, np.int64)
    )
    executed = executed_kind(frames, players)
    last = np.concatenate([np.zeros_like(executed[:1]), executed[:-1]])
    values["last_command"] = last[np.ix_(kept, axis)]
    own, other = ("left_score", "right_score") if side > 0 else ("right_score", "left_score")
    return {
        "cycle": frames["cycle"][kept],
        "playmode": frames["playmode"][kept],
        "score": np.stack([np.clip(frames[name][kept], -128, 127) for name in (own, other)], axis=-1).astype(np.int8),
        # Adding zero turns the -0.0 of logs and of the rotation into 0.0.
        "ball": ball.astype(np.float32) + np.float32(0),
        "position": position.astype(np.float32) + np.float32(0),
        "measured": np.stack(
            [_stored(values[channel.name], layout.STEP[channel.name]) for channel in channels.MEASURED], axis=-1
        ),
        "categorical": np.stack([_code(values[channel.name]) for channel in channels.CATEGORICAL], axis=-1),
    }


def _stored(values: NDArray[Any], step: float) -> NDArray[np.int16]:
    """A channel as int16; NaN becomes layout.MISSING."""
    scaled = np.rint(values.astype(np.float64) / step)
    limited = np.clip(scaled, layout.MISSING + 1, 32767)
    return np.where(np.isnan(scaled), layout.MISSING, limited).astype(np.int16)


def _code(values: NDArray[Any]) -> NDArray[np.uint8]:
    """A channel as uint8; NaN and what no code can be become layout.NO_CODE."""
    known = (values >= 0) & (values < layout.NO_CODE)
    return np.where(known, values, layout.NO_CODE).astype(np.uint8)
