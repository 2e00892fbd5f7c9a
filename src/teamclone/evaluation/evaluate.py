"""``evaluate``: the quality of a run on the splits of a dataset, the numbers behind tables, figures and report."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray

from teamclone import __version__
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import DatasetError, RunError
from teamclone.evaluation import baselines as rules
from teamclone.evaluation import bootstrap
from teamclone.evaluation.answers import BATCH
from teamclone.evaluation.characterise import characterise
from teamclone.evaluation.describe import describe, unseen_numbers
from teamclone.evaluation.predict import predict, truth
from teamclone.models.clone import model_id, parameter_count
from teamclone.system.documents import read_document, write_document

if TYPE_CHECKING:
    from teamclone.training.run import Run

FORMAT = 3
"""Of evaluation.json; raised whenever a reader of the old one would misread the new one."""

SPLITS = (Split.TEST, Split.UNSEEN, Split.VALIDATION)

Progress = Callable[[int, int], None]
"""Called with rows done and rows in all."""


def evaluate(
    run: Run,
    *,
    dataset: Dataset | Path | str | None = None,
    checkpoint: str = "best-loss",
    seed: int = 0,
    on_progress: Progress | None = None,
) -> dict[str, Any]:
    """Return everything the report needs to know about a run; JSON types only, undefined figures are None.

    Args:
        run: a finished or interrupted training run.
        dataset: another dataset than the run's own: all its splits are evaluated, and matches that the run was trained
            on are named, as are those of the run that it was adapted from.
        checkpoint: which weights.
        seed: of the bootstrap and of the sample of positions.
        on_progress: called with rows done and rows in all.

    Raises:
        DatasetError: the dataset is missing, has nothing to evaluate, or other commands than the model.
        RunError: the run or checkpoint cannot be read.
    """
    data, own = _datasets(run, dataset)
    foreign = own is None or data.id != own.id
    rows = _rows(data, (*SPLITS, Split.TRAIN) if foreign else SPLITS)
    model = run.load_model(checkpoint)
    trained_on = own if own is not None else data
    todo = sum(map(len, rows.values())) + len(trained_on.split(Split.TRAIN))
    done = 0

    def on_batch(count: int) -> None:
        nonlocal done
        done += count
        if on_progress is not None:
            on_progress(done, todo)

    counted = count_training(trained_on, on_batch=on_batch)
    known = {match["match_id"] for match in _used(trained_on, Split.TRAIN)} if foreign and own is not None else set()
    of_base = set((run.environment.get("base") or {}).get("trained_on") or ())
    known |= of_base & {match["match_id"] for split in rows for match in _used(data, split)}
    trained_numbers = _players(trained_on, trained_on.split(Split.TRAIN))
    sections = {}
    for split, index in rows.items():
        predictions = predict(model, data, index, on_batch=on_batch)
        section = describe(predictions, baselines=counted, matches=data.matches, seed=seed)
        section["unseen_numbers"] = unseen_numbers(predictions, players=_players(data, index), trained=trained_numbers)
        sections[split.name.lower()] = section
    return {
        "format": FORMAT,
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "versions": {"teamclone": __version__, "torch": torch.__version__, "numpy": np.__version__},
        "run": {
            "path": str(run.path),
            "checkpoint": checkpoint,
            "model_id": model_id(model),
            "weights": parameter_count(model),
            "base": run.environment.get("base"),
        },
        "dataset": {
            **_about(data),
            "own": not foreign,
            "baselines_counted_on": str(trained_on.path),
            "trained_on_before": sorted({match["match_id"] for match in data.matches} & known),
        },
        "seed": seed,
        "resamples": bootstrap.N_RESAMPLES,
        "splits": sections,
        "data": characterise(data, seed=seed),
    }


def _datasets(run: Run, dataset: Dataset | Path | str | None) -> tuple[Dataset, Dataset | None]:
    """Return the dataset to evaluate on, and the run's own; that is None where it is gone and another is given."""
    own = _own_dataset(run, needed=dataset is None)
    if dataset is None:
        assert own is not None
        data = own
    else:
        data = dataset if isinstance(dataset, Dataset) else open_dataset(dataset)
    if data.commands != run.config.model.commands:
        raise DatasetError(
            f"{data.path}: has the commands {', '.join(data.commands)}, the model answers with "
            f"{', '.join(run.config.model.commands)}; make the dataset with the options of that of the run"
        )
    return data, own


def _rows(data: Dataset, splits: tuple[Split, ...]) -> dict[Split, NDArray[np.int64]]:
    """Return the rows of the splits that have any."""
    rows = {split: index for split in splits if len(index := data.split(split))}
    if not rows:
        names = ", ".join(split.name.lower() for split in splits)
        raise DatasetError(f"{data.path}: no samples in {names}; build the dataset from more matches")
    return rows


def _about(data: Dataset) -> dict[str, Any]:
    """Return the document's description of a dataset."""
    return {
        "path": str(data.path),
        "id": data.id,
        "team": data.meta["team"],
        "teams": data.meta.get("teams", [data.meta["team"]]),
        "matches": data.matches,
        "recovered": data.meta.get("recovered", 0),
        "cleaning": _without_matches(data.meta.get("cleaning")),
        "options": data.meta.get("options"),
    }


def count_training(dataset: Dataset, *, on_batch: Callable[[int], None] | None = None) -> rules.Baselines:
    """Count the training split of a dataset for the baselines."""
    counter = rules.Counter.empty(dataset.commands)
    rows = dataset.split(Split.TRAIN)
    for start in range(0, len(rows), 32 * BATCH):
        part = rows[start : start + 32 * BATCH]
        kind, issued, last = truth(dataset, part)
        counter.add(kind=kind, last=last, issued=issued)
        if on_batch is not None:
            on_batch(len(part))
    return counter.finish()


def _players(dataset: Dataset, rows: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return (n,) the players that gave the commands: 0..10 for the numbers 1..11."""
    players: NDArray[np.uint8] = dataset.samples["player"].numpy()[rows]
    return players


def _without_matches(cleaning: dict[str, Any] | None) -> dict[str, Any] | None:
    """Return the cleaning report over all matches."""
    return None if cleaning is None else {key: value for key, value in cleaning.items() if key != "matches"}


def _own_dataset(run: Run, *, needed: bool) -> Dataset | None:
    """Return the dataset the run was trained on; None when it is gone and another is given."""
    try:
        return open_dataset(run.dataset_path)
    except DatasetError as error:
        if needed:
            raise DatasetError(f"{error}, or name another dataset with --data") from None
        return None


def _used(dataset: Dataset, split: Split) -> list[dict[str, Any]]:
    """Return the matches that have samples in a split."""
    used = np.unique(dataset.match(dataset.split(split)).numpy())
    return [dataset.matches[index] for index in used]


def evaluate_and_save(
    run: Run,
    *,
    dataset: Dataset | Path | str | None = None,
    checkpoint: str = "best-loss",
    seed: int = 0,
    on_progress: Progress | None = None,
) -> tuple[dict[str, Any], Path]:
    """Evaluate a run and write the result into it; arguments and errors are those of `evaluate`.

    Returns:
        The evaluation and its file.
    """
    evaluation = evaluate(run, dataset=dataset, checkpoint=checkpoint, seed=seed, on_progress=on_progress)
    return evaluation, save_evaluation(run, evaluation)


def evaluation_path(run: Run, evaluation: dict[str, Any]) -> Path:
    """Return the path of an evaluation: RUN/evaluation.json, or a file named after another dataset."""
    if evaluation["dataset"]["own"]:
        return Path(run.path) / "evaluation.json"
    return Path(run.path) / f"evaluation-{Path(evaluation['dataset']['path']).name}.json"


def save_evaluation(run: Run, evaluation: dict[str, Any]) -> Path:
    """Write an evaluation into its run, whole or not at all; return its file."""
    path = evaluation_path(run, evaluation)
    write_document(path, evaluation)
    return path


def load_evaluation(path: Path | str) -> dict[str, Any]:
    """Read an evaluation back; raises as `read_document`."""
    return read_document(
        Path(path), what="an evaluation", number=FORMAT, command="teamclone evaluate", error=RunError, shape=_SHAPE
    )


_SHAPE = {
    "run": {"path": str, "checkpoint": str, "model_id": str},
    "dataset": {"path": str, "id": str, "own": bool},
    "splits": dict,
}
"""Of evaluation.json, what says whether it is current."""
