"""A clone's predictions for a match as channels of a replay page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import DatasetError, UsageError
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.rcss.commands import parameters_of
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.replay.payload import Channel, Coding

if TYPE_CHECKING:
    import pyarrow as pa

    from teamclone.evaluation.prediction_table import PredictionTable
    from teamclone.training.run import Run

DRAWS = 15
"""Draws of which the spread of parameters is the median."""
LEAST_PROBABILITY = 0.02
"""Parameters of commands less probable than this are left out."""

_PROBABILITY = Coding(step=0.004, order=0)
_LOSS = Coding(step=0.01, order=0)
_PARAMETER = Coding(step=1, order=0)
_SPREAD = Coding(step=0.5, order=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Predictions:
    """Predictions for one or both teams.

    Attributes:
        commands: what is predicted. run: name of the run. team: that its clone learned from.
        of: the teams that are predicted. channels: by player and frame; NaN where nothing is predicted.
        notes: what could not be predicted, and why, a line each.
    """

    commands: tuple[str, ...] = ()
    run: str = ""
    team: str = ""
    of: tuple[str, ...] = ()
    channels: tuple[Channel, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def about(self) -> dict[str, Any]:
        """What the page must know beside the channels."""
        parameters = [
            {
                "name": of.name,
                "command": of.kind.name.lower(),
                "argument": of.argument,
                "unit": of.unit,
                "angle": of.angle,
            }
            for of in parameters_of(self.commands)
        ]
        return {
            "run": self.run,
            "team": self.team,
            "of": list(self.of),
            "commands": list(self.commands),
            "parameters": parameters,
        }


@dataclass(slots=True)
class _Grids:
    """Arrays (n_frames, 22) by channel name."""

    n_frames: int
    by_name: dict[str, NDArray[np.float32]] = field(default_factory=dict)

    def put(self, name: str, at: tuple[NDArray[Any], NDArray[Any]], values: NDArray[Any]) -> None:
        if name not in self.by_name:
            self.by_name[name] = np.full((self.n_frames, N_PLAYERS), np.nan, np.float32)
        self.by_name[name][at] = values


def predicted(
    run: Run,
    match: MatchColumns,
    *,
    teams: Sequence[str] = (),
    checkpoint: str = "best-loss",
    made: Mapping[int, PredictionTable] | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> Predictions:
    """Return what the clone of a run predicts for teams of a match.

    What cannot be predicted becomes a note, since the match can be shown all the same.

    Args:
        run: the run. match: its columns.
        teams: names of teams, or ``left`` and ``right``; empty for those that the clone learned from.
        checkpoint: which weights.
        made: tables by side that `predict_match` has made with DRAWS draws; others are made.
        on_progress: called with the rows done and their number, for each team anew.

    Raises:
        RunError: there is no such checkpoint.
        UsageError: a team that was named does not play.
    """
    from teamclone.evaluation.prediction_table import predict_match

    names = {1: match.left, -1: match.right}
    learned = [side for side, name in names.items() if name in run.team.split(" + ")]
    sides = [_side_of(match, name) for name in teams] or learned
    if not sides:
        playing = " and ".join(name for name in names.values() if name) or "nobody"
        note = (
            f"No predictions: the clone of {run.path.name} learned from {run.team}, and {playing} play here. "
            "Name a team with --team to see what the clone expects of it."
        )
        return Predictions(notes=(note,))
    model = run.load_model(checkpoint).eval()
    commands: tuple[str, ...] = tuple(model.config.commands)
    grids, of, notes = _Grids(len(match.frames["cycle"])), [], []
    for side in dict.fromkeys(sides):
        name = names[side] or ""
        try:
            table = (made or {}).get(side)
            if table is None:
                table = predict_match(model, match, side=side, draws=DRAWS, on_progress=on_progress)
        except (DatasetError, UsageError) as error:
            notes.append(f"No predictions for {name}: {error}")
            continue
        _fill(grids, table.to_arrow(), side=side, commands=commands)
        of.append("left" if side > 0 else "right")
        if side not in learned:
            notes.append(f"The clone learned from {run.team}; what it expects of {name} is a guess.")
    return Predictions(
        commands=commands if of else (),
        run=run.path.name,
        team=run.team,
        of=tuple(of),
        channels=tuple(Channel(name=name, coding=_coding(name), values=grid) for name, grid in grids.by_name.items()),
        notes=tuple(notes),
    )


def _side_of(match: MatchColumns, name: str) -> int:
    if name in ("left", "right") and name not in (match.left, match.right):
        return match.side_of(None, name)
    return match.side_of(name, None)


def _coding(name: str) -> Coding:
    if name == "loss":
        return _LOSS
    if name.startswith("p_"):
        return _PROBABILITY
    return _SPREAD if name.endswith("_spread") else _PARAMETER


def _fill(grids: _Grids, table: pa.Table, *, side: int, commands: tuple[str, ...]) -> None:
    """Write the rows of a team's predictions into the grids."""

    def column(name: str) -> NDArray[Any]:
        values: NDArray[Any] = table[name].to_numpy()
        return values

    at = column("frame"), column("unum").astype(np.int64) - 1 + (0 if side > 0 else N_TEAM)
    probability = {name: column(f"p_{name}") for name in commands}
    for name in commands:
        grids.put(f"p_{name}", at, probability[name])
    grids.put("loss", at, column("log_loss"))
    # What the predictions are compared with: the command among those that the model knows, an index into them.
    done = np.full(len(table), np.nan)
    words = table["done"].to_pylist()
    for index, name in enumerate(commands):
        done[[word == name for word in words]] = index
    grids.put("answered", at, done)
    for parameter in parameters_of(commands):
        likely = probability[parameter.kind.name.lower()] >= LEAST_PROBABILITY
        grids.put(parameter.name, at, np.where(likely, column(parameter.name), np.nan))
        grids.put(f"{parameter.name}_spread", at, column(f"{parameter.name}_spread"))
