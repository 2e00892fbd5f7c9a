"""A clone's predictions for a whole match, cycle by cycle, as one table."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import torch
from numpy.typing import NDArray
from torch import Tensor

from teamclone.dataset.clean import COMMAND_COLUMNS, Commands, clean_match, players_to_model
from teamclone.dynamics import formulas
from teamclone.errors import DatasetError, TeamcloneError
from teamclone.evaluation.answers import Answers, answers
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.evaluation.predictions import issued_parameters
from teamclone.logs.columns import INTERVALS, Source
from teamclone.percepts.believed import Believed, perceive
from teamclone.rcss.commands import parameters_of
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.playmodes import PlayMode
from teamclone.rcss.server_params import FIELDS
from teamclone.world.channels import CHANNEL, TYPE_FIELD
from teamclone.world.state import State, Target
from teamclone.world.view import view_columns
from teamclone.world.world import World

if TYPE_CHECKING:
    from teamclone.models.clone import Clone

_ROUNDING_M = 1e-3
"""How much further from the ball than a kick or tackle reaches they are still predicted."""


class PredictionTable:
    """Predictions for the players of a team, one row a player and frame, in the order of frames, then numbers.

    Columns: ``match_id``, ``frame`` (index into the log's frames), ``cycle``, ``stoppage``, ``playmode``, ``team``,
    ``side``, ``unum``; ``p_dash``, ... the probability of each command; ``likeliest``, the command with the greatest;
    ``dash_power``, ... the likeliest parameters of each command, if it were given, in power, degrees and metres, those
    of kicks and tackles null for players that cannot reach the ball; ``done``, the command that was given, null where
    none is known that the model knows; ``source``, whether a command log has it (``logged``) or the game log alone
    implies it (``recovered``); ``executed``, whether the server carried it out; ``done_dash_power``, ... its
    parameters; ``log_loss`` of the command, nats; ``parameter_log_loss``, -ln of the density of its parameters, null
    for a model that has none. On request ``dash_power_spread``, ... of the likeliest command: half of the draws of its
    parameters lie within this of the likeliest.
    """

    def __init__(self, table: pa.Table) -> None:
        self._table = table

    def __len__(self) -> int:
        return int(self._table.num_rows)

    def __repr__(self) -> str:
        return f"PredictionTable({len(self):,} rows: {', '.join(self._table.column_names)})"

    def to_arrow(self) -> pa.Table:
        """Return the table as ``pyarrow.Table``."""
        return self._table

    def to_pandas(self) -> Any:
        """Return the table as ``pandas.DataFrame``.

        Raises:
            TeamcloneError: pandas is not installed.
        """
        _needed("pandas")
        return self._table.to_pandas()

    def to_polars(self) -> Any:
        """Return the table as ``polars.DataFrame``.

        Raises:
            TeamcloneError: polars is not installed.
        """
        polars = _needed("polars")
        return polars.from_arrow(self._table)


def _needed(package: str) -> Any:
    from importlib import import_module

    try:
        return import_module(package)
    except ImportError:
        raise TeamcloneError(f"{package} is not installed; pip install 'teamclone[frames]'") from None


def predict_match(
    model: Clone,
    match: MatchColumns,
    *,
    side: int,
    unums: Collection[int] | None = None,
    goalkeepers: bool = False,
    draws: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
) -> PredictionTable:
    """Predict every command of a team in a match, also where none was given.

    Rows are for players on the field, in those play modes that the model's commands are of: play_on; with move also
    set plays. Goalkeepers are among them if the model knows catch, or where asked for.

    Args:
        model: the clone.
        match: its columns.
        side: of the team, 1 left or -1 right.
        unums: uniform numbers to predict, 1 to 11; None for all.
        goalkeepers: predict goalkeepers of a model without catch, too.
        draws: with how many draws the spread of the likeliest command's parameters is found; 0 leaves its columns out.
        on_progress: called with the rows done and their number.

    Raises:
        DatasetError: the log lacks what the model needs, or does not describe a player's type.
    """
    commands = model.config.commands
    due = players_to_model(match.frames, match.players, side=side, repertoire=commands, goalkeepers=goalkeepers)
    if unums is not None:
        due &= np.isin(np.arange(1, N_TEAM + 1), list(unums))
    frame, actor = np.nonzero(due)
    world = view_columns(match.frames, match.players, types=match.types, params=match.params, side=side)
    _check(match, world.players, world.ball, frame, model.inputs.channels)
    done = _done(match, frame, actor, side=side, commands=commands, goalkeepers=goalkeepers)
    near = near_the_ball(world, frame, actor)

    believed = _believed(match, world) if model.perceives else None

    def state_of(part: slice) -> State:
        if believed is None:
            return State.of(world, frame[part], actor[part], history=model.inputs.history)
        of_part = believed.select(frame[part], actor[part])
        return State.of(of_part, np.arange(len(of_part)), actor[part])

    def target_of(part: slice) -> Target:
        kind, arguments = torch.from_numpy(done.kind[part].clip(min=0)), torch.from_numpy(done.arguments[part])
        if match.source is Source.LOGGED:
            return Target(kind, arguments)
        return Target(kind, arguments, torch.from_numpy(done.interval[part]))

    def kicks_of(part: slice) -> Tensor:
        return torch.from_numpy(np.flatnonzero(near[part] | done.with_ball[part]))

    parameters = parameters_of(commands)
    probabilities = np.empty((len(frame), len(commands)), np.float32)
    likeliest = np.empty((len(frame), len(parameters)), np.float32)
    parameter_log_loss, spread = np.empty(len(frame), np.float32), np.empty_like(likeliest)
    found = answers(model, len(frame), state_of, target_of=target_of, kicks_of=kicks_of, draws=draws)
    for part, answer in found:
        probabilities[part], likeliest[part], parameter_log_loss[part], spread[part] = answer
        if on_progress is not None:
            on_progress(part.stop, len(frame))
    answer = Answers(probabilities, likeliest, parameter_log_loss, spread)
    table = _table(match, frame, actor, answer, done, asked=near | done.with_ball, side=side, commands=commands)
    if draws:
        for column, of in enumerate(parameters):
            table = table.append_column(f"{of.name}_spread", _or_null(spread[:, column]))
    return PredictionTable(table)


def _believed(match: MatchColumns, world: World) -> Believed:
    """Return a match as its players believe it."""
    _, memory = perceive(match.frames, match.players, types=match.types, params=match.params)
    return Believed(world=world, memory=memory)


def near_the_ball(world: World, frame: NDArray[np.int64], actor: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (n,) which players could kick or tackle the ball."""
    me = world.players[frame, actor]
    types = world.types[me[:, CHANNEL["type"]].astype(np.int64)]
    size, margin = (types[:, TYPE_FIELD[name]] for name in ("player_size", "kickable_margin"))
    reach = formulas.ball_reach(size, margin, server=dict(zip(FIELDS, world.server.tolist(), strict=True)))
    near: NDArray[np.bool_] = np.hypot(*(me[:, :2] - world.ball[frame, :2]).T) < reach + _ROUNDING_M
    return near


def _table(
    match: MatchColumns,
    frame: NDArray[np.int64],
    actor: NDArray[np.int64],
    answer: Answers,
    done: _Done,
    *,
    asked: NDArray[np.bool_],
    side: int,
    commands: tuple[str, ...],
) -> pa.Table:
    """Return the columns of `PredictionTable`; ``asked`` (n,): kicks and tackles were predicted there."""
    probabilities, likeliest, parameter_log_loss, spread = answer
    parameters = parameters_of(commands)
    unknown = done.kind < 0
    parameter_log_loss[unknown | np.isnan(done.issued).all(1)] = np.nan
    with np.errstate(divide="ignore"):
        log_loss = -np.log(np.take_along_axis(probabilities, done.kind.clip(min=0)[:, None], 1)[:, 0])
    for column, parameter in enumerate(parameters):
        if parameter.kind.name in {"KICK", "TACKLE"}:
            likeliest[~asked, column] = spread[~asked, column] = np.nan
    names = np.array(commands)
    team, cycle = match.left if side > 0 else match.right, match.frames
    columns: dict[str, Any] = {
        "match_id": _repeated(match.match_id, len(frame)),
        "frame": pa.array(frame.astype(np.int32)),
        "cycle": pa.array(cycle["cycle"][frame]),
        "stoppage": pa.array(cycle["stoppage"][frame]),
        "playmode": _words([mode.name.lower() for mode in PlayMode], cycle["playmode"][frame]),
        "team": _repeated(team or "", len(frame)),
        "side": _repeated("left" if side > 0 else "right", len(frame)),
        "unum": pa.array((actor + 1).astype(np.uint8)),
        **{f"p_{name}": pa.array(probabilities[:, index]) for index, name in enumerate(commands)},
        "likeliest": _words(names, probabilities.argmax(1)),
        **{of.name: _or_null(likeliest[:, index]) for index, of in enumerate(parameters)},
        "done": _words(names, done.kind),
        "source": _words([source.name.lower() for source in Source], np.where(unknown, -1, match.source)),
        "executed": pa.array(done.executed, mask=unknown),
        **{f"done_{of.name}": _or_null(done.issued[:, index]) for index, of in enumerate(parameters)},
        "log_loss": _or_null(np.where(unknown, np.nan, log_loss)),
        "parameter_log_loss": _or_null(parameter_log_loss),
    }
    return pa.table(columns)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Done:
    """The true commands of some rows.

    Attributes:
        kind: (n,) int64 index into the model's commands, -1 where the log has none of them.
        arguments: (n, 2) float32. interval: (n, 2, 2) float32, see `Target`. executed: (n,) bool.
        issued: (n, parameters) NaN for other commands' parameters and unknown ones.
        with_ball: (n,) bool, a kick or tackle.
    """

    kind: NDArray[np.int64]
    arguments: NDArray[np.float32]
    interval: NDArray[np.float32]
    executed: NDArray[np.bool_]
    issued: NDArray[np.float32]
    with_ball: NDArray[np.bool_]


def _done(
    match: MatchColumns,
    frame: NDArray[np.int64],
    actor: NDArray[np.int64],
    *,
    side: int,
    commands: tuple[str, ...],
    goalkeepers: bool,
) -> _Done:
    names = {*COMMAND_COLUMNS, *(column.name for column in INTERVALS if match.source is Source.RECOVERED)}
    cleaned = clean_match(
        match.frames,
        match.players,
        {name: values for name, values in match.commands.items() if name in names},
        match.params,
        side=side,
        keep=Commands.RECEIVED,
        goalkeepers=goalkeepers,
        repertoire=commands,
    )
    samples = cleaned.samples
    place = np.full((len(match.frames["cycle"]), N_TEAM), -1)
    place[frame, actor] = np.arange(len(frame))
    row = place[cleaned.kept[samples["frame"]], samples["player"]]
    # A command of a player that the log has off the field has no row.
    here = row >= 0
    row = row[here]
    kind, executed = np.full(len(frame), -1, np.int64), np.zeros(len(frame), np.bool_)
    arguments, interval = np.zeros((len(frame), 2), np.float32), np.zeros((len(frame), 2, 2), np.float32)
    kind[row], executed[row] = samples["kind"][here], samples["executed"][here]
    arguments[row], interval[row] = samples["parameters"][here], samples["interval"][here]
    issued = issued_parameters(kind, arguments, np.asarray(np.isfinite(interval).all(axis=2)), commands)
    with_ball = np.isin(kind, [commands.index(name) for name in ("kick", "tackle")])
    return _Done(
        kind=kind, arguments=arguments, interval=interval, executed=executed, issued=issued, with_ball=with_ball
    )


def _check(
    match: MatchColumns,
    players: NDArray[np.float32],
    ball: NDArray[np.float32],
    frame: NDArray[np.int64],
    channels: tuple[str, ...],
) -> None:
    """Raise unless the frames hold all that the model reads, and the types of all players.

    Raises:
        DatasetError: they do not.
    """
    frames = np.unique(frame)
    lacking = [
        f"ball_{name}" for index, name in enumerate(("x", "y", "vx", "vy")) if np.isnan(ball[frames, index]).any()
    ]
    lacking += [name for name in channels if np.isnan(players[frames][..., CHANNEL[name]]).any()]
    if lacking:
        raise DatasetError(
            f"match {match.match_id}: its log has no {', '.join(lacking)}, which the model needs; "
            "logs of version 3 and later have velocities, of version 5 and later all"
        )
    n_types = len(next(iter(match.types.values())))
    odd = np.argwhere(players[frames][..., CHANNEL["type"]] >= n_types)
    if len(odd):
        at, player = odd[0]
        raise DatasetError(
            f"match {match.match_id}: cycle {match.frames['cycle'][frames[at]]}: player {player % N_TEAM + 1} has type "
            f"{int(players[frames[at], player, CHANNEL['type']])}, the log describes types 0 to {n_types - 1}"
        )


def _words(words: Any, index: NDArray[Any]) -> pa.Array:
    """Return (n,) words as a dictionary-encoded column; null where the index is negative."""
    codes = pa.array(np.asarray(index, np.int32), mask=np.asarray(index) < 0)
    return pa.DictionaryArray.from_arrays(codes, pa.array([str(word) for word in words]))


def _repeated(word: str, n: int) -> pa.Array:
    return _words([word], np.zeros(n, np.int32))


def _or_null(values: NDArray[np.floating]) -> pa.Array:
    """Return a column with null for not-a-number."""
    return pa.array(values.astype(np.float32), mask=np.isnan(values))
