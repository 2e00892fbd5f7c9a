"""From the columns of one match to samples: cleaning rules, binding, the modelled team's point of view."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset import layout
from teamclone.dynamics.commands import used_arguments
from teamclone.logs import columns
from teamclone.logs.align import executed_commands, executed_kind, first_body_commands, follows, slot_of
from teamclone.logs.columns import counter_name
from teamclone.logs.match import Columns
from teamclone.percepts.believed import Believed
from teamclone.percepts.memory import Memory
from teamclone.rcss import state_bits
from teamclone.rcss.commands import BODY_KINDS, CLONED, CommandKind
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import SITUATION, PlayMode, Situation
from teamclone.world import channels
from teamclone.world.view import view_columns
from teamclone.world.world import World

_MEASURED = slice(len(channels.POSITION), len(channels.POSITION) + len(channels.MEASURED))
_CATEGORICAL = slice(_MEASURED.stop, None)
"""Channels of ``World.players``."""

COMMAND_COLUMNS = ("frame", "side", "unum", "kind", "legs", "valid", "arg0", "arg1", "arg2", "arg3")
"""Columns of a match's commands that cleaning needs; of its frames and players it needs those of `world.view`.

With those of `columns.INTERVALS` the samples know how well their arguments are known.
"""


_FARTHEST = 1e6
"""No place, velocity, angle or stamina is greater."""


class Commands(StrEnum):
    """Which commands become samples."""

    EXECUTED = "executed"
    """Commands whose counter rose: what the server executed."""
    RECEIVED = "received"
    """The first command of each cycle, also where the server refused it: what the player intended."""


class TurnZero(StrEnum):
    """The treatment of ``(turn 0)``, which many agents send for doing nothing."""

    KEEP = "keep"
    DROP = "drop"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """A cleaning step: the number of commands before and after it."""

    name: str
    before: int
    after: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchSamples:
    """One match, cleaned.

    Attributes:
        frames: layout.FRAME_ARRAYS without ``match``, only frames that have a sample.
        kept: (n,) which frames of the match these are, one several times where samples have frames of their own.
        samples: layout.SAMPLE_ARRAYS without ``split``; ``frame`` counts from this match's first kept frame.
        rules: every cleaning step in order.
        player_cycles: cycles x players of the team on the field, of those players and in those play modes that the
            samples are of; field players in play_on by default.
        idle: those of them without any body command, and ``frozen`` those among them after a tackle or foul.
        odd_frames: frames in play that were left out, see `whole_frames`.
    """

    frames: Columns
    kept: NDArray[np.int64]
    samples: Columns
    rules: tuple[Rule, ...]
    player_cycles: int
    idle: int
    frozen: int
    odd_frames: int


def clean_match(
    frames: Columns,
    players: Columns,
    commands: Columns,
    server_params: Mapping[str, float | str],
    *,
    side: int,
    n_types: int | None = None,
    keep: Commands = Commands.EXECUTED,
    turn_zero: TurnZero = TurnZero.KEEP,
    goalkeepers: bool = False,
    repertoire: tuple[str, ...] = CLONED,
    memory: Memory | None = None,
) -> MatchSamples:
    """Clean and bind the commands of one team in one match.

    Args:
        frames: ``view.FRAME_COLUMNS``, (n_frames,). players: ``view.PLAYER_COLUMNS``, (n_frames, 22).
        commands: COMMAND_COLUMNS, (n_commands,) in log order; of recovered commands ``columns.INTERVALS``, too.
        server_params: ranges of the arguments; the server's defaults where one is missing.
        side: the modelled team's, 1 left or -1 right.
        n_types: how many player types the match describes; None for any.
        goalkeepers: keep the goalkeeper's commands, too.
        repertoire: the commands to keep, some of REPERTOIRE. With catch goalkeepers are modelled like other players;
            with move every play mode of a Situation is taken, not only play_on; with none a cycle without a body
            command is a sample.
        memory: what the players believe: each sample then has a frame of its own, as its player believes it.
    """
    everyone = "catch" in repertoire
    in_play, whole = frames_in_play(frames, repertoire), whole_frames(frames, players, n_types=n_types)
    odd_frames = int((in_play & ~whole).sum())
    in_play &= whole
    where = "in play_on or around a set play" if "move" in repertoire else "in play_on"
    goalie = (players["state"] & state_bits.GOALIE) != 0
    slots = slot_of(commands["side"], commands["unum"])
    of_field = None if everyone or goalkeepers else ~goalie
    chain = _Chain(commands)
    _bind(chain, frames, slots, side=side, in_play=in_play, where=where, of_field=of_field, everyone=everyone)
    has_command = np.zeros_like(goalie)
    has_command[commands["frame"][chain.rows], slots[chain.rows]] = True
    kinds = [CommandKind[name.upper()] for name in repertoire if name != "none"]
    *names, last = (kind.name.lower() for kind in kinds)
    chain.keep(np.isin(chain.column("kind"), kinds), f"{', '.join(names)} or {last}")
    executed = executed_commands(players, chain.column("frame"), slots[chain.rows], chain.column("kind"))
    if keep is Commands.EXECUTED:
        executed = executed[chain.keep(executed, "executed by the server")]
    is_turn_zero = (chain.column("kind") == CommandKind.TURN) & (chain.column("arg0") == 0)
    if turn_zero is TurnZero.DROP:
        others = chain.keep(~is_turn_zero, "not (turn 0)")
        executed, is_turn_zero = executed[others], is_turn_zero[others]

    own = slice(0, N_TEAM) if side > 0 else slice(N_TEAM, N_PLAYERS)
    state = players["state"][:-1, own]
    due = (players_to_model(frames, players, side=side, repertoire=repertoire) & whole[:, None])[:-1]
    idle = due & ~has_command[:-1, own]
    frozen = idle & ((state & (state_bits.TACKLES | state_bits.FOUL_CHARGED)) != 0)

    samples = _samples(chain, kinds, server_params) | {"executed": executed, "turn_zero": is_turn_zero}
    if "none" in repertoire and len(commands["kind"]):
        nothing = idle & _nothing(frames, players)[:-1, own]
        samples = _with_none(samples, nothing, kind=repertoire.index("none"))
    order = np.lexsort((samples["player"], samples["frame"]))
    samples = {name: values[order] for name, values in samples.items()}
    world = view_columns(frames, players, params=server_params, side=side)
    if memory is None:
        kept, local = np.unique(samples["frame"], return_inverse=True)
        world = world.select(kept)
    else:
        kept, local = samples["frame"], np.arange(len(samples["frame"]))
        world = Believed(world=world, memory=memory).select(kept, samples["player"].astype(np.int64))
    return MatchSamples(
        frames=_frames(world, frames["playmode"][kept]),
        kept=kept,
        samples={**samples, "frame": local.astype(np.int32)},
        rules=tuple(chain.rules),
        player_cycles=int(due.sum()),
        idle=int(idle.sum()),
        frozen=int(frozen.sum()),
        odd_frames=odd_frames,
    )


def whole_frames(frames: Columns, players: Columns, *, n_types: int | None) -> NDArray[np.bool_]:
    """Return (n_frames,) whether ball and players on the field have all their numbers, as numbers that can be.

    A number that no frame of the log has, such as velocities in old versions, is not missed. Every player, on the field
    or not, must have one of the ``n_types`` player types that the match describes; None for any.
    """
    on_field = (players["state"] & state_bits.STAND) != 0
    odd = np.zeros(len(frames["cycle"]), np.bool_)
    names = ("x", "y", *(channel.name for channel in channels.MEASURED))
    for values, there in (
        *((frames[f"ball_{name}"], None) for name in ("x", "y", "vx", "vy")),
        *((players[name], on_field) for name in names),
    ):
        lacking = np.isnan(values)
        wrong = np.abs(values) > _FARTHEST
        if not lacking.all():
            wrong |= lacking
        odd |= wrong if there is None else (wrong & there).any(axis=1)
    if n_types is not None:
        odd |= (players["type"] >= n_types).any(axis=1)
    return ~odd


def frames_in_play(frames: Columns, repertoire: tuple[str, ...]) -> NDArray[np.bool_]:
    """Return (n_frames,) where a model of these commands applies: in play_on; with move in every Situation."""
    if "move" in repertoire:
        in_play: NDArray[np.bool_] = SITUATION[frames["playmode"]] != Situation.OTHER
        return in_play
    return np.asarray(frames["playmode"] == PlayMode.PLAY_ON)


def players_to_model(
    frames: Columns, players: Columns, *, side: int, repertoire: tuple[str, ...], goalkeepers: bool = False
) -> NDArray[np.bool_]:
    """Return (n_frames, 11) for which players of a team, and when, a model of these commands applies.

    Players on the field in `frames_in_play`; goalkeepers among them with catch, or where ``goalkeepers`` asks for them.
    """
    own = slice(0, N_TEAM) if side > 0 else slice(N_TEAM, N_PLAYERS)
    state = players["state"][:, own]
    due: NDArray[np.bool_] = frames_in_play(frames, repertoire)[:, None] & ((state & state_bits.STAND) != 0)
    if "catch" not in repertoire and not goalkeepers:
        due &= (state & state_bits.GOALIE) == 0
    return due


class _Chain:
    """Commands that the cleaning steps so far have kept, and the counts of each step.

    Attributes:
        rows: (n,) indices into the match's commands. rules: every step in order.
    """

    def __init__(self, commands: Columns) -> None:
        self.commands, self.rows = commands, np.arange(len(commands["kind"]))
        self.rules: list[Rule] = []

    def column(self, name: str) -> NDArray[Any]:
        """Return (n,) a column of the commands that are left."""
        values: NDArray[Any] = self.commands[name][self.rows]
        return values

    def keep(self, mask: NDArray[np.bool_], name: str) -> NDArray[np.bool_]:
        """Keep the commands that ``mask`` (n,) names, as the step ``name``; return the mask."""
        kept = self.rows[mask]
        self.rules.append(Rule(name=name, before=len(self.rows), after=len(kept)))
        self.rows = kept
        return mask


def _bind(
    chain: _Chain,
    frames: Columns,
    slots: NDArray[np.int64],
    *,
    side: int,
    in_play: NDArray[np.bool_],
    where: str,
    of_field: NDArray[np.bool_] | None,
    everyone: bool,
) -> None:
    """Keep the commands that took a body slot of a frame in play.

    Args:
        in_play: (n_frames,); ``where`` is its name in the report. of_field: (n_frames, 22) the modelled players; None
            for all.
    """
    chain.keep((chain.column("side") == side) & (chain.column("unum") > 0), "sent by a player of the team")
    chain.keep(np.isin(chain.column("kind"), BODY_KINDS), "body commands")
    chain.keep(chain.column("valid"), "parsed by the server (no NaN)")
    frame = chain.column("frame")
    chain.keep((frame >= 0) & (frame < len(frames["cycle"]) - 1), "bound to a frame that has a successor")
    chain.keep(in_play[chain.column("frame")], where)
    if not everyone:
        every = np.ones(len(chain.rows), np.bool_)
        chain.keep(
            every if of_field is None else of_field[chain.column("frame"), slots[chain.rows]], "of field players"
        )
    chain.keep(np.isin(chain.rows, first_body_commands(chain.commands, frames["playmode"])), "first of the cycle")


def _samples(chain: _Chain, kinds: list[CommandKind], server_params: Mapping[str, float | str]) -> Columns:
    """Return layout.SAMPLE_ARRAYS of the commands that are left, but for ``executed``, ``turn_zero`` and ``split``."""
    kind_index = np.zeros(max(CommandKind) + 1, np.uint8)
    kind_index[kinds] = np.arange(len(kinds))
    arguments = used_arguments({name: chain.column(name) for name in COMMAND_COLUMNS}, server_params)
    return {
        "frame": chain.column("frame").astype(np.int64),
        "player": (chain.column("unum") - 1).astype(np.uint8),
        "kind": kind_index[chain.column("kind")],
        "parameters": np.nan_to_num(arguments),
        "interval": _intervals(chain, arguments),
    }


def _intervals(chain: _Chain, arguments: NDArray[np.float32]) -> NDArray[np.float16]:
    """Return (n, 2, 2) `layout.SAMPLE_ARRAYS` ``interval`` of the arguments (n, 2), NaN where they are not known."""
    ends = np.zeros((*arguments.shape, 2), np.float16)
    if columns.INTERVALS[0].name in chain.commands:
        for index in range(2):
            low, high = chain.column(f"low{index}"), chain.column(f"high{index}")
            # What a team often does may be likelier than all of the interval, which knows the noise alone.
            ends[:, index, 0] = np.nan_to_num(np.minimum(low - arguments[:, index], 0))
            ends[:, index, 1] = np.nan_to_num(np.maximum(high - arguments[:, index], 0))
    ends[np.isnan(arguments)] = -np.inf, np.inf
    return ends


def _with_none(samples: Columns, nothing: NDArray[np.bool_], *, kind: int) -> Columns:
    """Return samples with those of ``none`` added: one for each (frame, player) of ``nothing``."""
    frame, player = np.nonzero(nothing)
    added = {"frame": frame, "player": player, "kind": np.full(len(frame), kind)}
    return {
        name: np.concatenate([values, added.get(name, np.zeros((len(frame), *values.shape[1:]))).astype(values.dtype)])
        for name, values in samples.items()
    }


def _nothing(frames: Columns, players: Columns) -> NDArray[np.bool_]:
    """Return (n_frames, 22) whether the counters show that a player issued no command.

    A log that lost commands shows it of no player, nor does a frame without a direct successor.
    """
    nothing: NDArray[np.bool_] = (executed_kind(frames, players) == 0) & follows(frames)[:, None]
    nothing &= players[counter_name(CommandKind.DASH)] >= 0
    return nothing


def as_stored(players: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return ``World.players`` as a dataset's reader gives them: measured channels in whole `layout.STEP`.

    A model was fitted to such numbers, and is evaluated on them.
    """
    made = players.copy()
    stored = _stored(players[..., _MEASURED], np.array(list(layout.STEP.values())))
    measured = stored.astype(np.float32) * layout.STEPS
    made[..., _MEASURED] = np.where(stored == layout.MISSING, np.float32(np.nan), measured)
    codes = _code(players[..., _CATEGORICAL])
    made[..., _CATEGORICAL] = np.where(codes == layout.NO_CODE, np.float32(np.nan), codes)
    return made


def _frames(world: World, playmode: NDArray[np.uint8]) -> Columns:
    """Return layout.FRAME_ARRAYS (without ``match``) of frames as a team sees them."""
    measured, categorical = world.players[..., _MEASURED], world.players[..., _CATEGORICAL]
    return {
        "cycle": world.cycle,
        "playmode": playmode,
        "mode_cycles": world.mode_cycles,
        "score": np.clip(world.score, -128, 127).astype(np.int8),
        "ball": world.ball,
        "position": world.players[..., : _MEASURED.start],
        "measured": _stored(measured, np.array(list(layout.STEP.values()))),
        "categorical": _code(categorical),
    }


def _stored(values: NDArray[Any], steps: NDArray[np.float64]) -> NDArray[np.int16]:
    """Return measured channels as int16; NaN becomes layout.MISSING."""
    scaled = np.rint(values.astype(np.float64) / steps)
    limited = np.clip(scaled, layout.MISSING + 1, 32767)
    return np.where(np.isnan(scaled), layout.MISSING, limited).astype(np.int16)


def _code(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Return a channel as uint8; NaN and values that are no code become layout.NO_CODE."""
    known = (values >= 0) & (values < layout.NO_CODE)
    return np.where(known, values, layout.NO_CODE).astype(np.uint8)
