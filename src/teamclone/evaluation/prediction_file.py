"""``predict_logs``: a clone's predictions for many matches, as one file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from teamclone.errors import TeamcloneError, UsageError
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.evaluation.prediction_table import PredictionTable, predict_match
from teamclone.logs import read_match
from teamclone.system.tables import check_suffix, writing

if TYPE_CHECKING:
    from teamclone.models.clone import Clone


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictedMatch:
    """The outcome for one log.

    Attributes:
        path: the game log. match_id: of the match, None where the log could not be read.
        rows: predictions. known: those of them of which the log has the command.
        log_loss: mean over ``known``, nats; None without any.
        error: why there are no predictions; None where there are.
    """

    path: Path
    match_id: str | None = None
    rows: int = 0
    known: int = 0
    log_loss: float | None = None
    error: str | None = None


def predict_logs(
    model: Clone,
    logs: Sequence[Path],
    out: Path,
    *,
    team: str | None = None,
    side: str | None = None,
    goalkeepers: bool = False,
    on_progress: Callable[[Path, int, int], None] | None = None,
) -> list[PredictedMatch]:
    """Predict a team's commands in matches and write them into one file, match after match.

    Memory holds one match at a time. A log that cannot be predicted does not stop the others. The file appears when it
    is whole, and not at all where no match could be predicted.

    Args:
        model: the clone.
        logs: game logs; command logs are found beside them.
        out: the file; its name ends in one of ``tables.SUFFIXES``.
        team: name of the team. side: "left" or "right", in its place.
        goalkeepers: predict goalkeepers of a model without catch, too.
        on_progress: called with the log, the rows done and the rows of this match.

    Returns:
        The outcome for each log, in their order.

    Raises:
        UsageError: the ending of ``out`` is unknown, or neither or both of team and side are named.
    """
    check_suffix(out)
    if (team is None) == (side is None):
        raise UsageError("name either a team or a side")

    def progress_of(path: Path) -> Callable[[int, int], None] | None:
        return None if on_progress is None else lambda done, total: on_progress(path, done, total)

    results = []
    with writing(out) as write:
        for path in logs:
            match_id = None
            try:
                match = MatchColumns.of(read_match(path))
                match_id = match.match_id
                table = predict_match(
                    model,
                    match,
                    side=match.side_of(team, side),
                    goalkeepers=goalkeepers,
                    on_progress=progress_of(path),
                )
            except (TeamcloneError, OSError) as error:
                results.append(PredictedMatch(path=path, match_id=match_id, error=str(error)))
                continue
            write(table.to_arrow())
            results.append(_summary(path, match_id, table))
    return results


def _summary(path: Path, match_id: str, table: PredictionTable) -> PredictedMatch:
    losses = table.to_arrow()["log_loss"].drop_null().to_numpy()
    return PredictedMatch(
        path=path,
        match_id=match_id,
        rows=len(table),
        known=len(losses),
        log_loss=float(np.mean(losses, dtype=np.float64)) if len(losses) else None,
    )
