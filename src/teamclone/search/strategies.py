"""The choice of the next trials and of those to give up: pure functions of the trials so far."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from teamclone.engine.network.constants import ACTIVATIONS
from teamclone.errors import UsageError
from teamclone.models.config import EgocentricTrunkConfig, ModelConfig, of_targets
from teamclone.search.trials import (
    SETTLED,
    Mode,
    SearchConfig,
    Status,
    Trial,
    rank,
)
from teamclone.system.settings import table_of
from teamclone.training.config import WITH_ADAM, TrainConfig

OPTIMISERS = ("adam", "rmsprop", "adagrad")

RATES = (1e-2, 1e-3, 1e-4)
"""Learning rates that the paper compared."""

BATCH_FACTORS = (0.25, 0.5, 1, 2)
"""Batch sizes that a study tries, as multiples of that of the settings it starts from."""

PRUNE_TRIALS, PRUNE_EPOCHS = 5, 2
"""A study prunes only once PRUNE_TRIALS trials have finished, and no trial in its first PRUNE_EPOCHS epochs."""


class Strategy(Protocol):
    """The rule by which a search chooses its trials."""

    def propose(self, trials: Sequence[Trial]) -> list[Trial]:
        """Return trials to add now; none as long as the running ones decide, or at the end."""

    def prunes(self, trial: Trial, trials: Sequence[Trial]) -> bool:
        """Return whether to give up a running trial after the epoch it has just finished."""


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
            problems.append("the beam search chooses model.hidden; set its first architectures with --start")
        if problems:
            raise UsageError("; ".join(problems))

    def propose(self, trials: Sequence[Trial]) -> list[Trial]:
        """Return the first architectures, then, whenever all trials have ended, the untried neighbours of the beam."""
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
        """Return False: every trial is trained to its end."""
        return False

    def beams(self, trials: Sequence[Trial]) -> list[list[Trial]]:
        """Return the beam after each step, best first."""
        last = max((trial.step for trial in trials), default=-1)
        return [
            rank(
                [trial for trial in trials if trial.step <= step and trial.status is Status.FINISHED],
                self.config.objective,
            )[: self.config.beam]
            for step in range(last + 1)
        ]

    def neighbours(self, hidden: tuple[int, ...]) -> list[tuple[int, ...]]:
        """Return the neighbours of an architecture.

        A layer more, as wide as the last or half of it; one layer doubled or halved; the last one dropped.
        """
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
        """Return one trial with settings that Optuna chose; none once there are ``config.trials`` of them."""
        if len(trials) >= self.config.trials:
            return []
        base, chosen = self.config.base, self._study(trials).ask(self.space()).params
        settings = dict(chosen)
        if "data.batch_size" in chosen:
            factor = base.data.batch_size / chosen["data.batch_size"]
            for name in ("batches_per_epoch", "validation_batches"):
                settings[f"data.{name}"] = int(getattr(base.data, name) * factor)
        if chosen.get("model.target_points") == 0:
            settings |= {f"model.{name}": value for name, value in _without_targets(base.model).items()}
        return [Trial(name=f"{len(trials):04d}", settings=settings)]

    def prunes(self, trial: Trial, trials: Sequence[Trial]) -> bool:
        """Return whether Optuna's median pruner would give the trial up."""
        study = self._study(trials)
        return bool(study.pruner.prune(study, self._frozen(trial)))

    def space(self) -> dict[str, Any]:
        """Return the distributions by setting. The samples of an epoch and of validation stay as many."""
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
        if isinstance(base.model, EgocentricTrunkConfig):
            space["model.parameter_weight"] = FloatDistribution(1e-2, 1.0, log=True)
            if base.model.target_points:
                space["model.target_points"] = IntDistribution(0, 12, step=2)
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


def _without_targets(model: ModelConfig) -> dict[str, Any]:
    """Return the defaults of the settings that have no effect without target points, where ``model`` has others."""
    now, usual = table_of(model), table_of(type(model)())
    return {name: usual[name] for name in of_targets(type(model)) if now[name] != usual[name]}


@dataclass(frozen=True)
class Optimisers:
    """The paper's comparison of three optimisers at three learning rates."""

    config: SearchConfig

    def __post_init__(self) -> None:
        chosen = [key for key in ("train.optimiser", "train.learning_rate") if key in self.config.held]
        if chosen:
            raise UsageError(f"the comparison of optimisers chooses {' and '.join(chosen)}; leave --set of it out")

    def propose(self, trials: Sequence[Trial]) -> list[Trial]:
        """Return every pair of `OPTIMISERS` and `RATES` at first; none afterwards."""
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
        """Return False: every trial is trained to its end."""
        return False


STRATEGIES: dict[Mode, Callable[[SearchConfig], Strategy]] = {
    Mode.BEAM: Beam,
    Mode.STUDY: Study,
    Mode.OPTIMISERS: Optimisers,
}
