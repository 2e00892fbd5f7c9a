"""A run folder: everything about one training, enough to resume, evaluate and export it.

RUN/config.toml                  all settings
RUN/environment.json             format number, dataset, versions, machine
RUN/line_up.json                 of a dataset with set plays: the team's places at kick-offs, whom it gives which types
RUN/metrics.jsonl                one line per epoch
RUN/tensorboard/                 the same for TensorBoard
RUN/checkpoints/NAME.safetensors weights: last, best-loss, best-accuracy, best-recall-<command>, best-parameters
RUN/checkpoints/resume.safetensors  weights and optimiser after the last finished epoch
RUN/checkpoints/base.safetensors    of an adapted run: the weights it began with
"""

from __future__ import annotations

import errno
import json
import os
import platform
import shutil
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import torch

from teamclone import __version__
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import DatasetError, RunError, UsageError
from teamclone.models.clone import Clone
from teamclone.rcss.commands import REPERTOIRE
from teamclone.system.documents import misfit, read_document, write_document
from teamclone.system.files import held, write_atomic
from teamclone.system.machine import processor
from teamclone.training.checkpoint import load_weights, save_weights
from teamclone.training.config import Config, config_from, to_toml
from teamclone.training.line_up import line_up_of, save_line_up

FORMAT = 5
"""Raised whenever a reader of the old folder would misread the new one."""

RESUME = "resume"
"""The checkpoint that holds the optimiser too; not a model to load."""

LAST = "last"
"""The checkpoint of the last finished epoch."""

BASE = "base"
"""The checkpoint from which an adapted run begins, its own copy; a model to load as any other."""

_BASE = {"path": str, "checkpoint": str, "model_id": str, "team": str, "trained_on": ([str], type(None))}
_ENVIRONMENT = {
    "dataset": {"path": str, "id": str, "team": str},
    **dict.fromkeys(("created?", "teamclone?", "torch?", "numpy?", "processor?"), str),
    f"{BASE}?": _BASE,
}
_RECORD = {"epoch": int, "*": float}
"""Of metrics.jsonl."""


BEST: dict[str, tuple[str, Callable[[float, float], bool]]] = {
    "best-loss": ("validation_loss", float.__lt__),
    "best-accuracy": ("validation_accuracy", float.__gt__),
    "best-parameters": ("validation_parameter_mae", float.__lt__),
    **{f"best-recall-{name}": (f"validation_recall_{name}", float.__gt__) for name in REPERTOIRE},
}
"""Checkpoints by the figure that they are best in, and what is better; of equals the first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Best:
    """Which epoch a checkpoint is of: that with the best ``value`` of a ``figure`` of the history."""

    checkpoint: str
    figure: str
    epoch: int
    value: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Base:
    """What an adapted run begins with.

    Attributes:
        model: weights and input normalisation.
        origin: where they are from, ``base`` of ``environment.json``.
    """

    model: Clone
    origin: dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run that has been opened.

    Attributes:
        path: its folder.
        config: its settings.
        environment: ``environment.json``.
    """

    path: Path
    config: Config
    environment: dict[str, Any]

    @property
    def dataset_path(self) -> Path:
        """Where the dataset lay that it was trained on."""
        return Path(self.environment["dataset"]["path"])

    @property
    def dataset_id(self) -> str:
        """`Dataset.id` of that dataset."""
        return str(self.environment["dataset"]["id"])

    @property
    def team(self) -> str:
        """The team or teams of that dataset."""
        return str(self.environment["dataset"]["team"])

    @property
    def metrics_path(self) -> Path:
        """The file of `history`."""
        return self.path / "metrics.jsonl"

    def checkpoint_path(self, name: str) -> Path:
        """Where a checkpoint lies or would lie."""
        return self.path / "checkpoints" / f"{name}.safetensors"

    def checkpoints(self) -> list[str]:
        """Names of the checkpoints whose weights can be loaded."""
        found = (path.stem for path in (self.path / "checkpoints").glob("[!.]*.safetensors"))
        return sorted(name for name in found if name != RESUME)

    def learned_from(self, *splits: Split) -> set[str] | None:
        """Return the ids of the matches that have rows in these splits, and of its base's; None where one is gone."""
        try:
            dataset = open_dataset(self.dataset_path)
        except DatasetError:
            return None
        before = self.environment[BASE]["trained_on"] if BASE in self.environment else []
        if before is None or dataset.id != self.dataset_id:
            return None
        rows = (dataset.match(dataset.split(split)).numpy() for split in splits)
        used = {index for of_split in rows for index in np.unique(of_split).tolist()}
        return {*before, *(dataset.matches[index]["match_id"] for index in used)}

    def history(self) -> list[dict[str, Any]]:
        """One record per finished epoch.

        ``epoch`` (from 1), ``samples`` trained on in it, ``samples_per_s``, ``seconds`` (with validation), and the
        figures of `metrics.RunningMetrics.table` under ``train_`` and ``validation_``: ``validation_accuracy``.

        Raises:
            RunError: a record is none.
        """
        if not self.metrics_path.is_file():
            return []
        records = []
        for number, line in enumerate(self.metrics_path.read_bytes().splitlines(), 1):
            try:
                record = json.loads(line)
            except (ValueError, RecursionError):  # cut off by a kill in the midst of writing; resuming writes it again
                break
            if problem := misfit(record, _RECORD):
                raise RunError(f"{self.metrics_path}: line {number}: {problem}; remove the line and resume the run")
            records.append(record)
        return records

    def best(self) -> list[Best]:
        """The best epoch by each figure that ever had a value."""
        found: list[Best] = []
        history = self.history()
        for checkpoint, (figure, better) in BEST.items():
            best: Best | None = None
            for record in history:
                if figure not in record:
                    continue
                value = float(record[figure])
                if best is None or better(value, best.value):
                    best = Best(checkpoint=checkpoint, figure=figure, epoch=record["epoch"], value=value)
            found += [best] if best else []
        return found

    def load_model(self, checkpoint: str = "best-loss") -> Clone:
        """The trained network, ready to predict.

        Raises:
            RunError: there is no such checkpoint, or it is damaged.
        """
        if checkpoint not in self.checkpoints():
            there = ", ".join(self.checkpoints()) or "none yet: no epoch was finished"
            raise RunError(f"{self.path}: no checkpoint {checkpoint!r}; there are {there}")
        model = Clone(self.config.model)
        load_weights(self.checkpoint_path(checkpoint), model)
        return model.eval()


def open_run(path: Path | str) -> Run:
    """Open a run folder.

    Raises:
        RunError: it is missing, not a run, of another format number, or damaged.
    """
    folder = Path(path)
    environment_path, config_path = folder / "environment.json", folder / "config.toml"
    environment = read_document(
        environment_path,
        what="a run",
        number=FORMAT,
        command="teamclone train",
        error=RunError,
        folder=folder,
        again="train again",
        shape=_ENVIRONMENT,
    )
    if not config_path.is_file():
        raise RunError(f"{folder}: not a run, it has no config.toml; make one with `teamclone train`")
    try:
        config = config_from(tomllib.loads(config_path.read_text(encoding="utf-8")), where=str(config_path))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RunError(f"{config_path}: not TOML ({error})") from None
    except UsageError as error:
        raise RunError(str(error)) from None
    return Run(path=folder.resolve(), config=config, environment=environment)


def is_run(path: Path) -> bool:
    """Whether a training was begun in this folder."""
    return (path / "environment.json").is_file()


def create_run(
    path: Path,
    config: Config,
    dataset: Dataset,
    *,
    device: str,
    precision: str,
    processes: int = 1,
    base: Base | None = None,
) -> Run:
    """Begin a run folder; ``device`` and ``precision`` are what ``auto`` came to on this machine.

    Raises:
        RunError: the folder holds something already.
    """
    if is_run(path):
        raise RunError(f"{path}: already holds a run; add --resume to go on with it, or choose another folder")
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise RunError(f"{path}: is not an empty folder; choose another one")
    resources = {"device": device, "precision": precision, "processes": processes}
    origin = {"base": base.origin} if base else {}
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        (temporary / "checkpoints").mkdir(parents=True)
        save_config(temporary, config)
        write_document(temporary / "environment.json", _environment(dataset) | resources | origin)
        if (line_up := line_up_of(dataset)) is not None:
            save_line_up(temporary, line_up)
        if base:
            save_weights(temporary / "checkpoints" / f"{BASE}.safetensors", base.model, epoch=0)
        try:
            temporary.rename(path)
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
            raise RunError(f"{path}: another process has just begun a run there; choose another folder") from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return open_run(path)


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a run folder for this process; the system lets go of it when the process ends, however it ends.

    Raises:
        RunError: another process holds it.
    """
    lock = path / ".lock"
    lock.touch()
    with held(lock, busy=RunError(f"{path}: another process is training into it; wait for its end")):
        yield


def save_config(path: Path, config: Config) -> None:
    """Write the settings of a run into its folder."""
    write_atomic(path / "config.toml", to_toml(config).encode())


def _environment(dataset: Dataset) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "dataset": {"path": str(dataset.path), "id": dataset.id, "team": dataset.meta["team"]},
        "teamclone": __version__,
        "python": platform.python_version(),
        "torch": torch.__version__,
        "numpy": np.__version__,
        "platform": platform.platform(),
        "processor": processor(),
        "threads": torch.get_num_threads(),
        "cuda": torch.cuda.get_device_name() if torch.cuda.is_available() else None,
    }
