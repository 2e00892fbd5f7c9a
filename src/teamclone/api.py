"""What ``import teamclone`` offers beside the packages' functions: a clone ready to predict, the events of a match."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING

from teamclone.errors import UsageError
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.evaluation.prediction_table import PredictionTable, predict_match
from teamclone.events.table import MatchEvents
from teamclone.logs import Match, read_match
from teamclone.percepts.table import MatchPercepts
from teamclone.store.events import read_events
from teamclone.training.run import Run, open_run

if TYPE_CHECKING:
    from teamclone.engine.clone import CompiledClone
    from teamclone.models.clone import Clone
    from teamclone.store import Store


class LoadedClone:
    """The clone of a run with weights of one of its checkpoints; `load` makes it.

    Attributes:
        run: the run it comes from. model: the PyTorch module.
    """

    def __init__(self, run: Run, model: Clone) -> None:
        self.run, self.model = run, model

    def __repr__(self) -> str:
        return f"LoadedClone({self.run.path}, {self.model.config.family}, of {self.run.team})"

    @property
    def commands(self) -> tuple[str, ...]:
        """The commands that the clone predicts."""
        return tuple(self.model.config.commands)

    def compiled(self) -> CompiledClone:
        """Return the clone as compiled kernels, which answer a single situation a hundred times as fast as PyTorch."""
        from teamclone.engine.clone import CompiledClone
        from teamclone.models.packing import pack

        return CompiledClone(pack(self.model))

    def predict(
        self,
        match: Match | Path | str,
        *,
        team: str | None = None,
        side: str | None = None,
        store: Store | None = None,
        unums: Collection[int] | None = None,
        goalkeepers: bool = False,
        on_progress: Callable[[int, int], None] | None = None,
    ) -> PredictionTable:
        """Predict every command of a team in a match: a row for each of its players on the field and cycle in play.

        Args:
            match: a match; the path of its game log, beside which the command log is found; or, with ``store``, the id
                of a match of it. Without a command log the columns of the true commands are null.
            team: name of the team, the modelled one or any other. side: "left" or "right", in its place.
            store: where ``match`` is an id.
            unums: uniform numbers to predict, 1 to 11; None for all.
            goalkeepers: predict goalkeepers even if the clone does not know catch.
            on_progress: called with the rows done and their number.

        Raises:
            UsageError: the team does not play in the match, or neither a team nor a side is named.
            LogError: the log cannot be read.
            StoreError: the store has no such match.
            DatasetError: the log lacks what the model needs.
        """
        columns = _columns(match, store)
        return predict_match(
            self.model,
            columns,
            side=columns.side_of(team, side),
            unums=unums,
            goalkeepers=goalkeepers,
            on_progress=on_progress,
        )


def load(run: Path | str, *, checkpoint: str = "best-loss") -> LoadedClone:
    """Load the clone of a run folder.

    Args:
        run: folder made by ``train``.
        checkpoint: which weights: best-loss, best-accuracy, last, ...

    Raises:
        RunError: there is no such run or checkpoint, or it is of another format.
    """
    opened = open_run(Path(run))
    return LoadedClone(opened, opened.load_model(checkpoint).eval())


def match_events(match: Match | Path | str, *, store: Store | None = None) -> MatchEvents:
    """Find what happened in a match: passes, shots, tackles, set plays and so on.

    Args:
        match: a match; the path of its game log; or, with ``store``, the id of a match of it.
        store: where ``match`` is an id.

    Raises:
        LogError: the log cannot be read, or has no frame.
        StoreError: the store has no such match.
    """
    if store is None:
        return MatchEvents.of(match if isinstance(match, Match) else read_match(match))
    row = MatchColumns.row_of(store, _id(match))
    return MatchEvents(
        match_id=row["match_id"],
        left=row["left_name"],
        right=row["right_name"],
        columns=read_events(store, row["match_id"]),
    )


def match_percepts(match: Match | Path | str) -> MatchPercepts:
    """Work out what each player of a match saw, and where it believes ball and other players to be.

    Args:
        match: a match, or the path of its game log.

    Raises:
        LogError: the log cannot be read, has no frame, or does not show where players look.
    """
    return MatchPercepts.of(match if isinstance(match, Match) else read_match(match))


def _columns(match: Match | Path | str, store: Store | None) -> MatchColumns:
    if store is None:
        return MatchColumns.of(match if isinstance(match, Match) else read_match(match))
    return MatchColumns.of_store(store, _id(match))


def _id(match: Match | Path | str) -> str:
    if isinstance(match, Match):
        raise UsageError("expected the id of a match of the store, got a match; leave out the store")
    return str(match)
