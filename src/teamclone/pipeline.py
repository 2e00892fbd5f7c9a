"""From one schedule to the report: play, store, dataset, train, evaluate. Finished stages that still fit are kept."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from teamclone.dataset.build import DatasetConfig, build_dataset, is_current
from teamclone.dataset.reader import open_dataset
from teamclone.errors import PlayError, UsageError
from teamclone.evaluation.evaluate import evaluate_and_save
from teamclone.play.record import Record
from teamclone.play.runner import PlayReport, play
from teamclone.play.schedule import Schedule, folder_of, read_schedule, schedule_of
from teamclone.play.server import find_server
from teamclone.report.page import fresh_evaluation, make_report
from teamclone.store import create_store
from teamclone.store.postgres.location import masked
from teamclone.system.settings import from_table, setting
from teamclone.training.config import Config, differences, load_config, preset_names
from teamclone.training.loop import Progress, train
from teamclone.training.run import BEST, LAST, Run, is_run, open_run

STORE, DATASET, RUN = "store", "dataset", "run"
"""Folders beside those that `play` makes."""


class Stage(StrEnum):
    """The stages in their order. Each match goes into the store as it ends, so playing and storing are one."""

    PLAY = "play"
    DATASET = "dataset"
    TRAIN = "train"
    EVALUATE = "evaluate"
    REPORT = "report"


@dataclass(frozen=True, slots=True, kw_only=True)
class StoreSettings:
    """``location``: a folder or ``postgresql://...``; empty for a folder beside the matches."""

    location: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainSettings:
    """A preset and changes to it: ``"train.epochs=10"``."""

    preset: str = setting("best", choices=tuple(preset_names()))
    set: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluateSettings:
    """Which weights to evaluate."""

    checkpoint: str = setting("best-loss", choices=(LAST, *BEST))


@dataclass(frozen=True, slots=True, kw_only=True)
class Pipeline:
    """A schedule with all its sections. Without a dataset it ends with the store, without training with the dataset."""

    schedule: Schedule
    store: str
    dataset: DatasetConfig | None
    train: Config | None
    checkpoint: str


@dataclass(frozen=True, slots=True, kw_only=True)
class StageResult:
    """The result of a stage: ``done`` is False where all of it was there already."""

    stage: Stage
    done: bool
    seconds: float
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Watch:
    """The callbacks of a pipeline: for the steps of a stage, records of matches, training, matches that are ended."""

    on_progress: Callable[[Stage, int, int], None] = lambda stage, done, total: None
    on_record: Callable[[Record], None] = lambda record: None
    on_training: Callable[[Progress], None] = lambda progress: None
    on_stop: Callable[[], None] = lambda: None

    def steps(self, stage: Stage) -> Callable[[int, int], None]:
        """Return a stage's callback, for the steps that are done and their number."""
        return lambda done, total: self.on_progress(stage, done, total)


def load_pipeline(path: Path) -> Pipeline:
    """Read a schedule with its sections ``store``, ``dataset``, ``train`` and ``evaluate``.

    Raises:
        UsageError: naming all mistakes, in one line.
    """
    table = read_schedule(path)
    problems: list[str] = []
    schedule = schedule_of(table, base=folder_of(path), problems=problems)
    store = from_table(StoreSettings, table.get("store", {}), "store", problems)
    before = len(problems)
    training = from_table(TrainSettings, table.get("train", {}), "train", problems)
    is_right = len(problems) == before
    evaluation = from_table(EvaluateSettings, table.get("evaluate", {}), "evaluate", problems)
    config = from_table(DatasetConfig, table["dataset"], "dataset", problems) if "dataset" in table else None
    trained = None
    if "train" in table and is_right:
        try:
            trained = load_config(training.preset, training.set, where="train.set")
        except UsageError as error:
            problems.append(str(error))
    for name, needs in (("train", "dataset"), ("evaluate", "train")):
        if name in table and needs not in table:
            problems.append(f"[{name}] needs [{needs}]")
    if config and trained and trained.model.commands != config.repertoire:
        wanted, got = (",".join(commands) for commands in (config.repertoire, trained.model.commands))
        problems.append(f'train.set: expected "model.commands={wanted}", as [dataset] has them, got {got}')
    if problems:
        raise UsageError(f"{path}: {'; '.join(dict.fromkeys(problems))}")
    location = store.location
    if location and "://" not in location:
        location = str(folder_of(path) / Path(location).expanduser())
    return Pipeline(
        schedule=schedule,
        store=location,
        dataset=config,
        train=trained,
        checkpoint=evaluation.checkpoint,
    )


def run_pipeline(
    pipeline: Pipeline,
    out: Path,
    *,
    executor: Executor | None = None,
    jobs: int | None = None,
    watch: Watch = Watch(),
) -> tuple[PlayReport, list[StageResult]]:
    """Do the missing work, stage by stage. Stopped or killed, the next call resumes it.

    Args:
        pipeline: the schedule with its sections, see `load_pipeline`.
        out: the folder for the matches, see `play.runner.play`; store, dataset and run lie beside them.
        executor: where matches are played and cleaned; None is this machine.
        jobs: how many at once, as in `play.runner.play`.
        watch: called during the work.

    Returns:
        The report on the matches, and the result of each stage that there was.

    Raises:
        PlayError: see `play.runner.play`; or no match at all is complete.
        TeamcloneError: a stage failed; the results of earlier stages stay.
    """
    results: list[StageResult] = []
    started = time.monotonic()

    def report_stage(stage: Stage, text: str, *, done: bool) -> None:
        nonlocal started
        now = time.monotonic()
        results.append(StageResult(stage=stage, done=done, seconds=now - started, text=text))
        started = now

    out = out.resolve()
    if executor is None:
        find_server(pipeline.schedule.fixtures[0].server)  # before anything is made
    store = create_store(pipeline.store or str(out / STORE))
    report = play(
        pipeline.schedule,
        out,
        store=store,
        executor=executor,
        jobs=jobs,
        on_progress=watch.steps(Stage.PLAY),
        on_record=watch.on_record,
        on_stop=watch.on_stop,
    )
    complete = len(report.records) - len(report.failed)
    text = f"{complete} matches in {masked(store.location)}, {len(report.failed)} failed"
    report_stage(Stage.PLAY, text, done=report.played > 0)
    if not complete:
        again = "; teamclone play with --retry-failed tries them again" if report.failed_before else ""
        raise PlayError(f"{out}: no match of the schedule is complete: {report.failed[0].trouble.text}{again}")  # type: ignore[union-attr]
    if pipeline.dataset is None:
        return report, results

    folder = out / DATASET
    current = is_current(folder, pipeline.dataset, store)
    if not current:
        build_dataset(
            pipeline.dataset,
            store=store,
            out=folder,
            executor=executor,
            jobs=jobs,
            replace=folder.exists(),
            on_progress=watch.steps(Stage.DATASET),
        )
    report_stage(Stage.DATASET, f"{open_dataset(folder).meta['n_samples']:,} samples in {folder}", done=not current)
    if pipeline.train is None:
        return report, results

    run, trained = _train(pipeline.train, folder, out / RUN, watch)
    report_stage(Stage.TRAIN, f"{len(run.history())} epochs in {run.path}", done=trained)
    evaluated = _evaluate(run, pipeline.checkpoint, watch)
    report_stage(Stage.EVALUATE, f"{run.path}/evaluation.json", done=evaluated)
    page, written = _report(run, watch, anew=evaluated)
    report_stage(Stage.REPORT, str(page), done=written)
    return report, results


def _train(config: Config, dataset_folder: Path, folder: Path, watch: Watch) -> tuple[Run, bool]:
    """Train, or resume; return the run, and whether there was anything to do."""
    dataset = open_dataset(dataset_folder)
    resume = False
    if is_run(folder):
        run = open_run(folder)
        if run.dataset_id != dataset.id or differences(run.config, config):
            names = (folder.with_name(f"{RUN}-before-{number}") for number in itertools.count(1))
            folder.rename(next(name for name in names if not name.exists()))
        elif len(run.history()) >= config.train.epochs:
            return run, False
        else:
            resume = True
    return train(config, dataset, folder, resume=resume, on_progress=watch.on_training), True


def _evaluate(run: Run, checkpoint: str, watch: Watch) -> bool:
    """Evaluate these weights; return whether there was anything to do."""
    evaluation = fresh_evaluation(run)
    if evaluation is not None and evaluation["run"]["checkpoint"] == checkpoint:
        return False
    evaluate_and_save(run, checkpoint=checkpoint, on_progress=watch.steps(Stage.EVALUATE))
    return True


def _report(run: Run, watch: Watch, *, anew: bool) -> tuple[Path, bool]:
    """Write the report unless one is younger than the evaluation.

    Returns its page, and whether there was anything to do.
    """
    page = run.path / "report.html"
    evaluated_ns = (run.path / "evaluation.json").stat().st_mtime_ns
    if not anew and page.exists() and page.stat().st_mtime_ns >= evaluated_ns:
        return page, False
    make_report(run, on_progress=lambda _, done, total: watch.on_progress(Stage.REPORT, done, total))
    return page, True
