"""Search for settings by many trainings over one dataset.

The next trial follows from the trials so far alone, so that a search that was stopped resumes without a difference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from importlib import import_module
from multiprocessing.connection import wait
from pathlib import Path

from teamclone.dataset.reader import Dataset
from teamclone.errors import RunError
from teamclone.search.strategies import STRATEGIES, Strategy
from teamclone.search.trials import (
    MAY_GROW,
    Mode,
    Search,
    SearchConfig,
    Status,
    Trial,
    config_of,
    open_search,
)
from teamclone.search.worker import Ended, Epoch, Worker
from teamclone.system.workers import available_cpus
from teamclone.training.config import differences
from teamclone.training.run import locked
from teamclone.training.setup import check_fits


def search(
    config: SearchConfig,
    dataset: Dataset,
    out: Path | str,
    *,
    jobs: int = 1,
    on_progress: Callable[[Search], None] = lambda search: None,
) -> Search:
    """Begin or resume a search, and draw its figure; `trials` describes the folder.

    Args:
        config: what to vary, and the settings that all trials share.
        dataset: the dataset that all trials train on.
        out: folder of the search; it may hold one that was stopped.
        jobs: processes that train at a time. Where ``train.threads`` is 0 they share the processors.
        on_progress: called whenever a trial begins, finishes an epoch, or ends.

    A trial that fails is noted and the others go on; it is tried again when the search is resumed. Finished
    trials are kept, unfinished ones go on from their last epoch with the rest of ``train.max_minutes``.

    Raises:
        UsageError: options that do not go together, or a dataset of other commands than the model's.
        RunError: the folder holds something else, or a search that does not fit; or another process searches in it.
    """
    check_fits(config.base, dataset)
    # Without them hours of training would end in an error.
    for module in ("matplotlib", *(("optuna",) if config.mode is Mode.STUDY else ())):
        import_module(module)
    strategy, folder = STRATEGIES[config.mode](config), Path(out)
    if not (folder / "search.json").exists() and folder.exists():
        left = {".lock", ".search.json.part"}  # by a process killed before it wrote anything
        if not folder.is_dir() or {entry.name for entry in folder.iterdir()} - left:
            raise RunError(f"{folder}: is no search and not an empty folder; choose another one")
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        state = _begin(config, dataset, folder)
        crew = [Worker(dataset.path) for _ in range(jobs)]
        try:
            _run(state, strategy, crew, on_progress)
        finally:
            for worker in crew:
                worker.stop()
            for trial in state.trials:
                if trial.status is Status.RUNNING:
                    trial.status = Status.WAITING
            state.save()
        if any(trial.figures for trial in state.trials):
            from teamclone.search.figure import write_figure

            write_figure(state)
    return state


def _begin(config: SearchConfig, dataset: Dataset, folder: Path) -> Search:
    """Return a new search, or the one in the folder, with unfinished and failed trials waiting."""
    of = {"id": dataset.id, "path": str(dataset.path), "team": str(dataset.meta["team"])}
    if not (folder / "search.json").exists():
        return Search(path=folder, config=config, dataset=of, trials=[])
    found = open_search(folder)
    if found.dataset["id"] != dataset.id:
        raise RunError(
            f"{folder}: was begun on dataset {found.dataset['id']} ({found.dataset['path']}), {dataset.path} is "
            f"{dataset.id}; give the same dataset or begin a new search"
        )
    pairs = {
        item.name: (getattr(found.config, item.name), getattr(config, item.name))
        for item in fields(SearchConfig)
        if item.name not in ("base", *MAY_GROW)
    }
    changed = [f"{name}: {before} became {after}" for name, (before, after) in pairs.items() if before != after]
    changed += differences(found.config.base, config.base)
    if changed:
        raise RunError(f"{folder}: cannot go on with other settings ({'; '.join(changed)}); begin a new search")
    for trial in found.trials:
        if trial.status in (Status.RUNNING, Status.FAILED):
            trial.begin(Status.WAITING)
    return replace(found, config=config, dataset=of)


def _run(state: Search, strategy: Strategy, crew: list[Worker], on_progress: Callable[[Search], None]) -> None:
    """Give trials to workers until the strategy has no more."""
    threads = state.config.base.train.threads or max(1, available_cpus() // len(crew))
    base = replace(state.config.base, train=replace(state.config.base.train, threads=threads))
    while True:
        for worker in crew:
            if worker.trial is None and (trial := _next(state, strategy)):
                trial.begin(Status.RUNNING)
                worker.give(trial, config_of(trial, base), _folder_of(trial, state.path))
                state.save()
                on_progress(state)
        busy = [worker for worker in crew if worker.trial]
        if not busy:
            return
        ready = wait([worker.connection for worker in busy])
        for worker in (worker for worker in busy if worker.connection in ready):
            trial, message = worker.take()
            match message:
                case Epoch(record, weights):
                    trial.add(record, weights, state.config.objective)
                    over = record["epoch"] == state.config.base.train.epochs
                    worker.answer(prune=not over and strategy.prunes(trial, state.trials))
                case Ended(status, error):
                    trial.status, trial.error = status, error
                    state.save()
            on_progress(state)


def _folder_of(trial: Trial, path: Path) -> Path:
    """Return the run folder of a trial.

    Raises:
        RunError: it, or the folder of all trials, is a link; the training would write where that points.
    """
    folder = path / "trials" / trial.name
    for each in (folder.parent, folder):
        if each.is_symlink():
            raise RunError(f"{each}: is a link, and training would write where it points; remove it")
    return folder


def _next(state: Search, strategy: Strategy) -> Trial | None:
    """Return the next trial to run, proposed now if none is waiting."""
    waiting = [trial for trial in state.trials if trial.status is Status.WAITING]
    if not waiting:
        waiting = strategy.propose(state.trials)
        state.trials.extend(waiting)
    return waiting[0] if waiting else None
