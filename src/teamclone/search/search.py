"""Many trainings over one dataset, to find settings.

OUT/search.json   format number, mode, dataset, settings that all trials share, and every trial
OUT/trials/NAME/  the run folder of a trial, see `run`

What to try next, and whether to give a trial up, is a pure function of the trials so far, so that a search that was
stopped goes on as if nothing had happened.
"""

from __future__ import annotations

import json
import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, fields, replace
from enum import StrEnum
from itertools import pairwise
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from teamclone import __version__
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import RunError, TeamcloneError, UsageError
from teamclone.models.clone import Clone, parameter_count
from teamclone.models.config import ACTIVATIONS
from teamclone.system.files import write_atomic
from teamclone.system.workers import available_cpus, start_worker
from teamclone.training import loop
from teamclone.training.config import WITH_ADAM, Config, TrainConfig, config_from, differences, to_table
from teamclone.training.run import is_run, locked, open_run, save_config
from teamclone.training.setup import check_commands

FORMAT = 1
"""Raised whenever a reader of the old search.json would misread the new one."""

OPTIMISERS = ("adam", "rmsprop", "adagrad")
RATES = (1e-2, 1e-3, 1e-4)
"""What the paper compared."""

BATCH_FACTORS = (0.25, 0.5, 1, 2)
"""Batch sizes that a study tries, as multiples of that of the settings it starts from."""

PRUNE_TRIALS, PRUNE_EPOCHS = 5, 2
"""A study gives no trial up before so many were finished, nor in its first epochs, so many."""


class Mode(StrEnum):
    BEAM = "beam"
    STUDY = "study"
    OPTIMISERS = "optimisers"


class Objective(StrEnum):
    """The figure on the validation matches that a search looks for; of a trial that of its best epoch."""

    ACCURACY = "accuracy"
    CROSS_ENTROPY = "cross-entropy"

    @property
    def figure(self) -> str:
        """Its name in `Trial.figures`."""
        return self.value.replace("-", "_")

    @property
    def sign(self) -> int:
        """Times this more is better."""
        return 1 if self is Objective.ACCURACY else -1


class Status(StrEnum):
    WAITING = "waiting"
    RUNNING = "running"
    FINISHED = "finished"
    PRUNED = "pruned"
    FAILED = "failed"


SETTLED = (Status.FINISHED, Status.PRUNED, Status.FAILED)


@dataclass(slots=True, kw_only=True)
class Trial:
    """One training.

    Attributes:
        name: of its folder.
        settings: where it differs from the settings that all share: ``{"model.hidden": [256, 128]}``.
        step: of a beam search, from 0.
        parent: the trial whose neighbour this one is, in a beam search.
        status: ``waiting`` also for one that was stopped and goes on when the search does.
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

    def begin(self, status: Status) -> None:
        """Forget what an earlier attempt came to; its epochs are told again."""
        self.status, self.figures, self.curve, self.error = status, {}, [], None

    def add(self, record: dict[str, Any], weights: int, objective: Objective) -> None:
        """Take the record of an epoch; one that is told again replaces all from there on."""
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
    """What to search, and how.

    Attributes:
        mode: see `Mode`.
        base: the settings that trials start from.
        held: settings that a study leaves as ``base`` has them.
        objective: see `Objective`.
        beam: of a beam search, how many architectures each step goes on from.
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
"""Options that a mode has; no other mode has them."""
MAY_GROW = ("iterations", "trials")
"""Options that may be otherwise when a search goes on."""


class Plan(Protocol):
    """What to try."""

    def propose(self, trials: Sequence[Trial]) -> list[Trial]:
        """Trials to add now; none as long as the running ones decide, or at the end."""

    def prunes(self, trial: Trial, trials: Sequence[Trial]) -> bool:
        """Whether to give up a running trial after the epoch it has just finished."""


def rank(trials: Sequence[Trial], objective: Objective) -> list[Trial]:
    """Best first: finished ones, then those given up, then failed ones, then the rest; of equals the smaller net."""
    order = (Status.FINISHED, Status.PRUNED, Status.FAILED, Status.RUNNING, Status.WAITING)

    def key(trial: Trial) -> tuple[Any, ...]:
        value = trial.figures.get(objective.figure, -np.inf * objective.sign)
        return order.index(trial.status), -objective.sign * value, trial.figures.get("weights", 0), trial.name

    return sorted(trials, key=key)


def with_settings(config: Config, settings: dict[str, Any]) -> Config:
    """A config with single values replaced.

    Raises:
        UsageError: naming all that is wrong.
    """
    table = to_table(config)
    for key, value in settings.items():
        section, _, name = key.partition(".")
        table[section][name] = value
    return config_from(table, where="trial")


@dataclass(frozen=True)
class Beam:
    """The paper's iteration-bounded beam search on powers of two for the number of layers and of their units."""

    config: SearchConfig

    def __post_init__(self) -> None:
        config, problems = self.config, []
        bounds = {"smallest": config.smallest, "largest": config.largest}
        problems += [
            f"{name}: expected a power of two, got {width}" for name, width in bounds.items() if not _is_power(width)
        ]
        if config.smallest > config.largest:
            problems.append(f"smallest, {config.smallest}, is above largest, {config.largest}")
        problems += [
            f"start {_name(hidden)}: expected powers of two from {config.smallest} to {config.largest}"
            for hidden in config.start
            if not hidden or not self._fits(hidden)
        ]
        if "model.hidden" in config.held:
            problems.append("the beam search chooses model.hidden; say where it starts with --start")
        if problems:
            raise UsageError("; ".join(problems))

    def propose(self, trials: Sequence[Trial]) -> list[Trial]:
        if not trials:
            widths = [1 << bits for bits in range(self.config.largest.bit_length())]
            first = self.config.start or [(width,) for width in widths if width >= self.config.smallest]
            return [self._trial(hidden, step=0, parent=None) for hidden in dict.fromkeys(first)]
        if any(trial.status not in SETTLED for trial in trials):
            return []
        beams = self.beams(trials)
        step = len(beams)
        if step > self.config.iterations or any(before == after for before, after in pairwise(beams[-2:])):
            return []
        found: dict[tuple[int, ...], str] = {}
        known = {tuple(trial.settings["model.hidden"]) for trial in trials}
        for trial in beams[-1]:
            for hidden in self.neighbours(tuple(trial.settings["model.hidden"])):
                if hidden not in known:
                    found.setdefault(hidden, trial.name)
        return [self._trial(hidden, step=step, parent=parent) for hidden, parent in found.items()]

    def prunes(self, trial: Trial, trials: Sequence[Trial]) -> bool:
        return False

    def beams(self, trials: Sequence[Trial]) -> list[list[Trial]]:
        """The beam after each step, best first."""
        last = max((trial.step for trial in trials), default=-1)
        return [
            rank(
                [trial for trial in trials if trial.step <= step and trial.status is Status.FINISHED],
                self.config.objective,
            )[: self.config.beam]
            for step in range(last + 1)
        ]

    def neighbours(self, hidden: tuple[int, ...]) -> list[tuple[int, ...]]:
        """A layer more, as wide as the last or half of it; one layer doubled or halved; the last one dropped."""
        found = [(*hidden, hidden[-1]), (*hidden, hidden[-1] // 2)]
        for place, width in enumerate(hidden):
            found += [(*hidden[:place], other, *hidden[place + 1 :]) for other in (2 * width, width // 2)]
        found += [hidden[:-1]] if len(hidden) > 1 else []
        return [other for other in found if self._fits(other)]

    def _fits(self, hidden: tuple[int, ...]) -> bool:
        return all(self.config.smallest <= width <= self.config.largest and _is_power(width) for width in hidden)

    @staticmethod
    def _trial(hidden: tuple[int, ...], *, step: int, parent: str | None) -> Trial:
        return Trial(name=_name(hidden), settings={"model.hidden": list(hidden)}, step=step, parent=parent)


def _is_power(width: int) -> bool:
    return width > 0 and width & (width - 1) == 0


def _name(hidden: Sequence[int]) -> str:
    return "-".join(map(str, hidden))


@dataclass(frozen=True)
class Study:
    """Optuna's tree-structured Parzen estimator, with its median pruner.

    Optuna keeps nothing: its study is made anew from the trials whenever it is asked. Each proposal draws from a
    generator of its own, of ``train.seed`` and the trial's number.
    """

    config: SearchConfig

    def __post_init__(self) -> None:
        if not self.space():
            raise UsageError("--set holds every setting that the study varies; leave one of them out")

    def propose(self, trials: Sequence[Trial]) -> list[Trial]:
        if len(trials) >= self.config.trials:
            return []
        base, chosen = self.config.base, self._study(trials).ask(self.space()).params
        settings = dict(chosen)
        if "data.batch_size" in chosen:
            factor = base.data.batch_size / chosen["data.batch_size"]
            for name in ("batches_per_epoch", "validation_batches"):
                settings[f"data.{name}"] = int(getattr(base.data, name) * factor)
        if chosen.get("model.aims") == 0:
            settings["model.aim_hidden"] = []
            settings["train.aim_weight"] = 0.0
        return [Trial(name=f"{len(trials):04d}", settings=settings)]

    def prunes(self, trial: Trial, trials: Sequence[Trial]) -> bool:
        study = self._study(trials)
        return bool(study.pruner.prune(study, self._frozen(trial)))

    def space(self) -> dict[str, Any]:
        """What is varied: distributions by setting. Samples of an epoch and of validation stay as many."""
        from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

        base = self.config.base
        samples = [base.data.batch_size * n for n in (base.data.batches_per_epoch, base.data.validation_batches)]
        sizes = [int(factor * base.data.batch_size) for factor in BATCH_FACTORS]
        sizes = [size for size in sizes if size and not any(number % size for number in samples)]
        space: dict[str, Any] = {
            "train.learning_rate": FloatDistribution(1e-4, 1e-2, log=True),
            "data.batch_size": CategoricalDistribution(sizes),
            "model.dropout": FloatDistribution(0.0, 0.5, step=0.05),
            "model.activation": CategoricalDistribution(ACTIVATIONS),
        }
        if base.train.optimiser in WITH_ADAM:
            space["train.weight_decay"] = FloatDistribution(1e-5, 1e-1, log=True)
        if base.model.features == "relative":
            space["train.parameter_weight"] = FloatDistribution(1e-2, 1.0, log=True)
            if base.model.aims:
                space["model.aims"] = IntDistribution(0, 12, step=2)
        return {key: values for key, values in space.items() if key not in self.config.held}

    def _study(self, trials: Sequence[Trial]) -> Any:
        import optuna

        optuna.logging.set_verbosity(optuna.logging.WARNING)
        seed = np.random.SeedSequence((self.config.base.train.seed, len(trials))).generate_state(1)[0]
        study = optuna.create_study(
            direction="maximize" if self.config.objective.sign > 0 else "minimize",
            sampler=optuna.samplers.TPESampler(seed=int(seed)),
            pruner=optuna.pruners.MedianPruner(n_startup_trials=PRUNE_TRIALS, n_warmup_steps=PRUNE_EPOCHS + 1),
        )
        study.add_trials([self._frozen(trial) for trial in trials])
        return study

    def _frozen(self, trial: Trial) -> Any:
        from optuna.trial import TrialState, create_trial

        states = {
            Status.FINISHED: TrialState.COMPLETE,
            Status.PRUNED: TrialState.PRUNED,
            Status.FAILED: TrialState.FAIL,
        }
        state, space = states.get(trial.status, TrialState.RUNNING), self.space()
        return create_trial(
            state=state,
            value=trial.figures[self.config.objective.figure] if state == TrialState.COMPLETE else None,
            params={key: trial.settings[key] for key in space},
            distributions=space,
            intermediate_values=dict(enumerate(trial.curve, 1)),
        )


@dataclass(frozen=True)
class Optimisers:
    """The paper's comparison of three optimisers at three learning rates."""

    config: SearchConfig

    def __post_init__(self) -> None:
        chosen = [key for key in ("train.optimiser", "train.learning_rate") if key in self.config.held]
        if chosen:
            raise UsageError(f"the comparison of optimisers chooses {' and '.join(chosen)}; leave --set of it out")

    def propose(self, trials: Sequence[Trial]) -> list[Trial]:
        if trials:
            return []
        usual = TrainConfig()
        # Only Adam has them; it keeps those of the preset.
        without = {"train.betas": list(usual.betas), "train.weight_decay": usual.weight_decay}
        return [
            Trial(
                name=f"{optimiser}-{rate:g}",
                settings={"train.optimiser": optimiser, "train.learning_rate": rate}
                | (without if optimiser != "adam" else {}),
            )
            for optimiser in OPTIMISERS
            for rate in RATES
        ]

    def prunes(self, trial: Trial, trials: Sequence[Trial]) -> bool:
        return False


PLANS: dict[Mode, Callable[[SearchConfig], Plan]] = {
    Mode.BEAM: Beam,
    Mode.STUDY: Study,
    Mode.OPTIMISERS: Optimisers,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """A search in its folder.

    Attributes:
        path: its folder.
        config: what is searched.
        dataset: ``id``, ``path`` and ``team`` of the dataset.
        trials: in the order in which they were proposed.
    """

    path: Path
    config: SearchConfig
    dataset: dict[str, str]
    trials: list[Trial]

    def ranked(self) -> list[Trial]:
        """Best first, see `rank`."""
        return rank(self.trials, self.config.objective)

    def save(self) -> None:
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
        write_atomic(self.path / "search.json", (json.dumps(document, indent=1) + "\n").encode())


def open_search(path: Path | str) -> Search:
    """Open the folder of a search.

    Raises:
        RunError: it is missing, not a search, of another format number, or damaged.
    """
    folder = Path(path)
    document_path = folder / "search.json"
    if not document_path.is_file():
        what = "not a search, it has no search.json" if folder.exists() else "no such folder"
        raise RunError(f"{folder}: {what}; make one with `teamclone search`")
    try:
        document = json.loads(document_path.read_text(encoding="utf-8"))
        found = document["format"]
        if found == FORMAT:
            options = document["options"]
            options |= {"held": tuple(options["held"]), "objective": Objective(options["objective"])}
            if "start" in options:
                options["start"] = tuple(tuple(hidden) for hidden in options["start"])
            base = config_from(document["settings"], where=str(document_path))
            config = SearchConfig(mode=Mode(document["mode"]), base=base, **options)
            trials = [Trial(**trial | {"status": Status(trial["status"])}) for trial in document["trials"]]
            return Search(path=folder, config=config, dataset=document["dataset"], trials=trials)
    except (ValueError, TypeError, KeyError, UsageError) as error:
        raise RunError(f"{document_path}: not the description of a search ({error!r}); begin a new one") from None
    raise RunError(f"{folder}: search of format {found}, this version reads {FORMAT}; search again")


def search(
    config: SearchConfig,
    dataset: Dataset,
    out: Path | str,
    *,
    jobs: int = 1,
    on_progress: Callable[[Search], None] = lambda search: None,
) -> Search:
    """Search, or go on with a search; what its folder holds is said above.

    Args:
        jobs: processes that train at a time. Where ``train.threads`` is 0 they share the processors.
        on_progress: called whenever a trial begins, finishes an epoch, or ends.

    A trial that fails is noted and the others go on; it is tried again when the search is gone on with. Finished
    trials are kept, unfinished ones go on from their last epoch with what is left of ``train.max_minutes``.

    Raises:
        UsageError: options that do not go together, or a dataset of other commands than the model's.
        RunError: the folder holds something else, or a search that does not fit; or another process searches in it.
    """
    check_commands(config.base, dataset)
    plan, folder = PLANS[config.mode](config), Path(out)
    if not (folder / "search.json").exists() and folder.exists():
        left = {".lock", ".search.json.part"}  # by a process killed before it wrote anything
        if not folder.is_dir() or {entry.name for entry in folder.iterdir()} - left:
            raise RunError(f"{folder}: is no search and not an empty folder; choose another one")
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        state = _begin(config, dataset, folder)
        crew = [Worker(dataset.path) for _ in range(jobs)]
        try:
            _run(state, plan, crew, on_progress)
        finally:
            for worker in crew:
                worker.stop()
            for trial in state.trials:
                if trial.status is Status.RUNNING:
                    trial.status = Status.WAITING
            state.save()
    return state


def _begin(config: SearchConfig, dataset: Dataset, folder: Path) -> Search:
    """A new search, or the one in the folder with what is to be done again waiting."""
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


def _run(state: Search, plan: Plan, crew: list[Worker], on_progress: Callable[[Search], None]) -> None:
    """Give trials to workers until the plan has no more."""
    threads = state.config.base.train.threads or max(1, available_cpus() // len(crew))
    base = with_settings(state.config.base, {"train.threads": threads})
    while True:
        for worker in crew:
            if worker.trial is None and (trial := _next(state, plan)):
                trial.begin(Status.RUNNING)
                worker.give(trial, with_settings(base, trial.settings), state.path / "trials" / trial.name)
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
                    worker.answer(prune=not over and plan.prunes(trial, state.trials))
                case Ended(status, error):
                    trial.status, trial.error = status, error
                    state.save()
            on_progress(state)


def _next(state: Search, plan: Plan) -> Trial | None:
    """The next trial to run, proposed now if none is waiting."""
    waiting = [trial for trial in state.trials if trial.status is Status.WAITING]
    if not waiting:
        waiting = plan.propose(state.trials)
        state.trials.extend(waiting)
    return waiting[0] if waiting else None


class Task(NamedTuple):
    config: Config
    folder: Path


class Epoch(NamedTuple):
    """An epoch was finished; the worker waits to be told whether to give the trial up."""

    record: dict[str, Any]
    weights: int


class Ended(NamedTuple):
    status: Status
    error: str | None


class Worker:
    """A process that trains one trial at a time."""

    def __init__(self, dataset: Path) -> None:
        self.dataset = dataset
        self.trial: Trial | None = None
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(theirs, self.dataset), daemon=True)
        with _no_interrupts():
            self.process.start()
        theirs.close()

    def give(self, trial: Trial, config: Config, folder: Path) -> None:
        if not self.process.is_alive():
            self.stop()
            self._start()
        self.trial = trial
        self.connection.send(Task(config, folder))

    def take(self) -> tuple[Trial, Epoch | Ended]:
        """What the worker says of its trial, once there is something to take."""
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
        with suppress(OSError):  # a process that has just died is noticed by `take`
            self.connection.send(prune)

    def stop(self) -> None:
        """End the process; a training can be killed at any moment and goes on from its last epoch."""
        self.process.terminate()
        self.process.join()
        self.connection.close()


@contextmanager
def _no_interrupts() -> Iterator[None]:
    """Leave Ctrl-C to this process: what is started meanwhile never sees it, also while it still imports."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _PrunedError(Exception):
    """Leaves `loop.train`."""


def _work(connection: Connection[Any, Any], dataset_path: Path) -> None:
    """Train what comes in until the other end closes."""
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
        except (EOFError, BrokenPipeError):  # nobody is there to tell
            return
        except Exception as error:
            ended = Ended(Status.FAILED, f"{type(error).__name__}: {error}")
        connection.send(ended)


def _train(task: Task, dataset: Dataset, connection: Connection[Any, Any]) -> Ended:
    """Train a trial to its end, or go on with it."""
    config, folder = task
    weights = parameter_count(Clone(config.model))

    def tell(record: dict[str, Any]) -> None:
        connection.send(Epoch(record, weights))
        if connection.recv():
            raise _PrunedError

    def report(progress: loop.Progress) -> None:
        if progress.record is not None:
            tell(progress.record)

    resume, left = is_run(folder), config.train.max_minutes
    try:
        if resume:
            run = open_run(folder)
            history = run.history()
            for record in history:
                tell(record)
            # Another number of threads would round otherwise than in the epochs before.
            config = with_settings(config, {"train.threads": run.config.train.threads})
            minutes = [record["seconds"] / 60 for record in history]
            if left and minutes:
                left -= sum(minutes)
                if left < np.mean(minutes):
                    return Ended(Status.FINISHED, None)
        now = with_settings(config, {"train.max_minutes": left})
        loop.train(now, dataset, folder, resume=resume, on_progress=report)
    except _PrunedError:
        return Ended(Status.PRUNED, None)
    if now != config:
        save_config(folder, config)
    return Ended(Status.FINISHED, None)
