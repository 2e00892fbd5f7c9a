"""``predict_logs``: a clone's predictions for many matches, as one file."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from teamclone.errors import TeamcloneError, UsageError
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.evaluation.prediction_table import PredictionTable, predict_match
from teamclone.logs import read_match

if TYPE_CHECKING:
    from teamclone.models.clone import Clone

SUFFIXES = (".parquet", ".csv", ".jsonl")
"""Endings of a file of predictions; each is a format."""


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
        out: the file; its name ends in one of SUFFIXES.
        team: name of the team. side: "left" or "right", in its place.
        goalkeepers: predict goalkeepers of a model without catch, too.
        on_progress: called with the log, the rows done and the rows of this match.

    Returns:
        The outcome for each log, in their order.

    Raises:
        UsageError: the ending of ``out`` is unknown, or neither or both of team and side are named.
    """
    if out.suffix not in SUFFIXES:
        raise UsageError(f"{out}: expected a name that ends in {', '.join(SUFFIXES)}, got {out.suffix or 'no ending'}")
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


class _Writer(Protocol):
    def write_table(self, table: pa.Table) -> None: ...

    def close(self) -> None: ...


class _JsonLines:
    """One JSON object a row and line."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", encoding="utf-8")

    def write_table(self, table: pa.Table) -> None:
        for batch in table.to_batches(max_chunksize=4096):
            self._file.writelines(f"{json.dumps(row, ensure_ascii=False)}\n" for row in batch.to_pylist())

    def close(self) -> None:
        self._file.close()


@contextmanager
def writing(out: Path) -> Iterator[Callable[[pa.Table], None]]:
    """Return a function that appends a table to a file, which gets its name when all of it is there."""
    out.parent.mkdir(parents=True, exist_ok=True)
    temporary = out.with_name(f".{out.name}.part")
    temporary.unlink(missing_ok=True)  # it may be a link to anywhere
    writer: _Writer | None = None

    def write(table: pa.Table) -> None:
        nonlocal writer
        plain = table.cast(_plain(table.schema))
        if writer is None:
            writer = _writer(temporary, out.suffix, plain.schema)
        writer.write_table(plain)

    try:
        try:
            yield write
        finally:
            if writer is not None:
                writer.close()
        if writer is not None:
            temporary.replace(out)
    finally:
        temporary.unlink(missing_ok=True)


def _plain(schema: pa.Schema) -> pa.Schema:
    """Return a schema with words as words: a dictionary of words differs from match to match."""
    return pa.schema(
        [field.with_type(pa.string()) if pa.types.is_dictionary(field.type) else field for field in schema]
    )


def _writer(path: Path, suffix: str, schema: pa.Schema) -> Any:
    if suffix == ".parquet":
        return pyarrow.parquet.ParquetWriter(path, schema, compression="zstd")
    return pyarrow.csv.CSVWriter(path, schema) if suffix == ".csv" else _JsonLines(path)
