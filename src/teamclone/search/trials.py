"""The trials of a search, and its folder.

OUT/search.json   format number, mode, dataset, settings that all trials share, and every trial
OUT/trials/NAME/  the run folder of a trial, see `training.run`
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from teamclone import __version__
from teamclone.errors import RunError, UsageError
from teamclone.system.documents import not_a_document, read_document, write_document
from teamclone.training.config import Config, config_from, replaced, to_table

FORMAT = 2
"""Raised whenever a reader of the old search.json would misread the new one."""


class Mode(StrEnum):
    """How a search chooses its trials; each value has a strategy in `search.strategies`."""

    BEAM = "beam"
    STUDY = "study"
    OPTIMISERS = "optimisers"


class Objective(StrEnum):
    """The figure on the validation matches that a search optimises; a trial's is that of its best epoch."""

    ACCURACY = "accuracy"
    CROSS_ENTROPY = "cross-entropy"

    @property
    def figure(self) -> str:
        """Its name in `Trial.figures`."""
        return self.value.replace("-", "_")

    @property
    def sign(self) -> int:
        """1 if more is better, else -1."""
        return 1 if self is Objective.ACCURACY else -1


class Status(StrEnum):
    """How far a trial is; ``pruned``: given up after an epoch that promised too little."""

    WAITING = "waiting"
    RUNNING = "running"
    FINISHED = "finished"
    PRUNED = "pruned"
    FAILED = "failed"


SETTLED = (Status.FINISHED, Status.PRUNED, Status.FAILED)


_NAME = re.compile(r"[0-9A-Za-z][\w.+-]{0,200}", re.ASCII)
"""What a trial may be called. It names a folder: one beside the others, whoever wrote search.json."""


@dataclass(slots=True, kw_only=True)
class Trial:
    """One training.

    Attributes:
        name: of its folder, a single part of a path.
        settings: where it differs from the settings that all share: ``{"model.hidden": [256, 128]}``.
        step: of a beam search, from 0.
        parent: the trial whose neighbour this one is, in a beam search.
        status: ``waiting`` also for one that was stopped and resumes with the search.
        figures: ``accuracy``, ``cross_entropy`` (nats) and ``loss`` on the validation matches after the best ``epoch``;
            ``epochs`` gone through and their ``seconds``; ``weights``, how many the network has.
        curve: the objective after each epoch.
        error: why it failed.
    """

    name: str
    settings: dict[str, Any]
    step: int = 0
    parent: str | None = None
    status: Status = Status.WAITING
    figures: dict[str, float] = field(default_factory=dict)
    curve: list[float] = field(default_factory=list)
    error: str | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not _NAME.fullmatch(self.name):
            raise ValueError(f"a trial is called {self.name!r}, expected letters, digits, '.', '-' and '_'")

    def begin(self, status: Status) -> None:
        """Reset the trial for an attempt; the worker sends earlier epochs again."""
        self.status, self.figures, self.curve, self.error = status, {}, [], None

    def add(self, record: dict[str, Any], weights: int, objective: Objective) -> None:
        """Take the record of an epoch; one that comes again replaces all from there on."""
        value = float(record[f"validation_{objective.figure}"])
        before = self.curve[: record["epoch"] - 1]
        if not before or value * objective.sign > max(past * objective.sign for past in before):
            best = {name: float(record[f"validation_{name}"]) for name in ("accuracy", "cross_entropy", "loss")}
            self.figures |= best | {"epoch": record["epoch"]}
        seconds = self.figures.get("seconds", 0.0) if before else 0.0
        self.curve = [*before, value]
        self.figures |= {"epochs": len(self.curve), "seconds": seconds + record["seconds"], "weights": weights}


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchConfig:
    """The settings of a search.

    Attributes:
        mode: see `Mode`.
        base: the settings that trials start from.
        held: settings that a study does not vary.
        objective: see `Objective`.
        beam: of a beam search, the number of architectures kept after each step.
        iterations: of a beam search, how many steps it takes after the first architectures.
        smallest: of a beam search, the least width of a layer; a power of two, as ``largest`` and all widths between.
        largest: of a beam search, the greatest.
        start: of a beam search, the first architectures; none for one layer of each width.
        trials: of a study, how many.
    """

    mode: Mode
    base: Config
    held: tuple[str, ...] = ()
    objective: Objective = Objective.ACCURACY
    beam: int = 3
    iterations: int = 5
    smallest: int = 32
    largest: int = 1024
    start: tuple[tuple[int, ...], ...] = ()
    trials: int = 30


OPTIONS = {
    Mode.BEAM: ("beam", "iterations", "smallest", "largest", "start"),
    Mode.STUDY: ("trials",),
    Mode.OPTIMISERS: (),
}
"""The options of each mode; no option belongs to two."""

MAY_GROW = ("iterations", "trials")
"""Options that may change when a search is resumed."""


def rank(trials: Sequence[Trial], objective: Objective) -> list[Trial]:
    """Sort trials, best first: finished, given up, failed, then the rest; of equals the smaller network."""
    order = (Status.FINISHED, Status.PRUNED, Status.FAILED, Status.RUNNING, Status.WAITING)

    def key(trial: Trial) -> tuple[Any, ...]:
        value = trial.figures.get(objective.figure, -np.inf * objective.sign)
        return order.index(trial.status), -objective.sign * value, trial.figures.get("weights", 0), trial.name

    return sorted(trials, key=key)


def config_of(trial: Trial, base: Config) -> Config:
    """Return the settings of a trial: those that all share, with its own in their places.

    Raises:
        UsageError: naming all that is wrong.
    """
    return replaced(base, trial.settings, where=f"trial {trial.name}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """A search in its folder.

    Attributes:
        path: its folder.
        config: its settings.
        dataset: ``id``, ``path`` and ``team`` of the dataset.
        trials: in the order in which they were proposed.
    """

    path: Path
    config: SearchConfig
    dataset: dict[str, str]
    trials: list[Trial]

    def ranked(self) -> list[Trial]:
        """Return the trials, best first, see `rank`."""
        return rank(self.trials, self.config.objective)

    def save(self) -> None:
        """Write OUT/search.json."""
        options = ("objective", "held", *OPTIONS[self.config.mode])
        document = {
            "format": FORMAT,
            "teamclone": __version__,
            "mode": self.config.mode,
            "dataset": self.dataset,
            "options": {name: getattr(self.config, name) for name in options},
            "settings": to_table(self.config.base),
            "trials": [asdict(trial) for trial in self.trials],
        }
        write_document(self.path / "search.json", document)


_SHAPE = {
    "mode": str,
    "dataset": {"id": str, "path": str, "team": str},
    "options": {
        "objective": str,
        "held": [str],
        **dict.fromkeys(("beam?", "iterations?", "smallest?", "largest?", "trials?"), int),
        "start?": [[int]],
    },
    "settings": dict,
    "trials": [
        {
            "name": str,
            "settings": dict,
            "step": int,
            "parent": (str, type(None)),
            "status": str,
            "figures": {"*": float},
            "curve": [float],
            "error": (str, type(None)),
        }
    ],
}
"""Of search.json."""


def open_search(path: Path | str) -> Search:
    """Open the folder of a search.

    Raises:
        RunError: it is missing, not a search, of another format number, or damaged.
    """
    folder = Path(path)
    document_path = folder / "search.json"
    document = read_document(
        document_path,
        what="a search",
        number=FORMAT,
        command="teamclone search",
        error=RunError,
        folder=folder,
        again="search again",
        shape=_SHAPE,
    )
    try:
        options = document["options"]
        options |= {"held": tuple(options["held"]), "objective": Objective(options["objective"])}
        if "start" in options:
            options["start"] = tuple(tuple(hidden) for hidden in options["start"])
        base = config_from(document["settings"], where=str(document_path))
        config = SearchConfig(mode=Mode(document["mode"]), base=base, **options)
        trials = [Trial(**trial | {"status": Status(trial["status"])}) for trial in document["trials"]]
        return Search(path=folder, config=config, dataset=document["dataset"], trials=trials)
    except (ValueError, TypeError, KeyError, UsageError) as error:
        what = "the description of a search"
        raise RunError(f"{not_a_document(document_path, what, error)}; begin a new one") from None
