"""Processes that train the trials of a search, one trial at a time each.

They are no tasks of `system.workers`: a process keeps its dataset open from trial to trial, reports every epoch, and
learns in return whether to give the trial up.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import TeamcloneError
from teamclone.models.clone import Clone, parameter_count
from teamclone.search.trials import (
    Status,
    Trial,
)
from teamclone.system.workers import process_context, start_worker
from teamclone.training import loop
from teamclone.training.config import Config
from teamclone.training.run import is_run, open_run, save_config


class Task(NamedTuple):
    """A trial to train: its settings and the folder of its run, which may hold an earlier attempt to resume."""

    config: Config
    folder: Path


class Epoch(NamedTuple):
    """An epoch was finished; the worker waits for `Worker.answer`, whether to give the trial up."""

    record: dict[str, Any]
    weights: int


class Ended(NamedTuple):
    """The end of a trial; ``error`` is None unless it failed."""

    status: Status
    error: str | None


class Worker:
    """A process that trains one trial at a time."""

    def __init__(self, dataset: Path) -> None:
        self.dataset = dataset
        self.trial: Trial | None = None
        self._start()

    def _start(self) -> None:
        context = process_context(__name__)
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(theirs, self.dataset), daemon=True)
        with _no_interrupts():
            self.process.start()
        theirs.close()

    def give(self, trial: Trial, config: Config, folder: Path) -> None:
        """Send a trial to the process, which is started anew if it died; `take` then returns its messages."""
        if not self.process.is_alive():
            self.stop()
            self._start()
        self.trial = trial
        self.connection.send(Task(config, folder))

    def take(self) -> tuple[Trial, Epoch | Ended]:
        """Return the worker's next message and its trial; waits for it."""
        trial = self.trial
        assert trial is not None
        try:
            message: Epoch | Ended = self.connection.recv()
        except (EOFError, OSError):
            self.process.join()
            text = f"its process ended with exit code {self.process.exitcode}; perhaps the machine is short of memory"
            message = Ended(Status.FAILED, text)
        if isinstance(message, Ended):
            self.trial = None
        return trial, message

    def answer(self, *, prune: bool) -> None:
        """Reply to an `Epoch`: whether to give the trial up."""
        with suppress(OSError):  # a process that has just died is noticed by `take`
            self.connection.send(prune)

    def stop(self) -> None:
        """End the process; a training can be killed at any moment and goes on from its last epoch."""
        self.process.terminate()
        self.process.join()
        self.connection.close()


@contextmanager
def _no_interrupts() -> Iterator[None]:
    """Leave Ctrl-C to this process: one that is started meanwhile never gets it, even while it imports."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _PrunedError(Exception):
    """Raised inside `loop.train` to leave it."""


def _work(connection: Connection[Any, Any], dataset_path: Path) -> None:
    """Train the trials that arrive until the other end closes."""
    start_worker()
    dataset = open_dataset(dataset_path)
    while True:
        try:
            task = connection.recv()
        except EOFError:
            return
        try:
            ended = _train(task, dataset, connection)
        except TeamcloneError as error:
            ended = Ended(Status.FAILED, str(error))
        except (EOFError, BrokenPipeError):  # the other end is gone
            return
        except Exception as error:
            ended = Ended(Status.FAILED, f"{type(error).__name__}: {error}")
        connection.send(ended)


def _train(task: Task, dataset: Dataset, connection: Connection[Any, Any]) -> Ended:
    """Train a trial to its end, or go on with it."""
    config, folder = task
    weights = parameter_count(Clone(config.model))

    def send(record: dict[str, Any]) -> None:
        connection.send(Epoch(record, weights))
        if connection.recv():
            raise _PrunedError

    def report(progress: loop.Progress) -> None:
        if progress.record is not None:
            send(progress.record)

    resume, left = is_run(folder), config.train.max_minutes
    try:
        if resume:
            run = open_run(folder)
            history = run.history()
            for record in history:
                send(record)
            # Another number of threads would round otherwise than in the epochs before.
            config = replace(config, train=replace(config.train, threads=run.config.train.threads))
            minutes = [record["seconds"] / 60 for record in history]
            if left and minutes:
                left -= sum(minutes)
                if left < np.mean(minutes):
                    return Ended(Status.FINISHED, None)
        now = replace(config, train=replace(config.train, max_minutes=left))
        loop.train(now, dataset, folder, resume=resume, on_progress=report)
    except _PrunedError:
        return Ended(Status.PRUNED, None)
    if now != config:
        save_config(folder, config)
    return Ended(Status.FINISHED, None)
