"""The training loop."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from teamclone.dataset.order import epoch_mirrored, epoch_order
from teamclone.dataset.reader import Dataset
from teamclone.errors import RunError
from teamclone.models.answer import Answer
from teamclone.models.clone import Clone
from teamclone.models.config import EgocentricConfig
from teamclone.models.heads.mixture import WITH_BALL, with_ball
from teamclone.training.batches import Batch
from teamclone.training.calibration import Calibration
from teamclone.training.config import Config, TrainConfig
from teamclone.training.logger import RunLogger
from teamclone.training.metrics import RunningMetrics
from teamclone.training.run import Base, Run
from teamclone.training.setup import Setup, prepare

WARM_UP = 200
"""Batches over which the cosine schedule rises."""
ONEDNN_ACTIVATIONS = ("relu", "gelu")
"""Those that PyTorch can take through oneDNN in single precision, forth and back."""


class Progress(NamedTuple):
    """Where training is: ``epoch`` from 1, ``batch`` finished in it; ``record`` once the epoch is finished.

    In epoch 0 the inputs are made: ``batch`` of ``batches`` samples are.
    """

    epoch: int
    epochs: int
    batch: int
    batches: int
    record: dict[str, Any] | None


def train(
    config: Config,
    dataset: Dataset,
    run_folder: Path | str,
    *,
    resume: bool = False,
    base: Base | None = None,
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> Run:
    """Train a clone, from fresh weights or from those of ``base``; see `run` for what a run folder holds.

    Every epoch ends with a checkpoint from which ``resume`` goes on exactly as if nothing had happened: weights,
    order of the samples and figures are a pure function of config and dataset (on one machine, with as many threads).
    Started by ``torchrun``, each process has a share of every batch; the result is the same but for rounding.

    Raises:
        UsageError: the machine lacks what the config asks for, or the dataset has other commands than the model.
        DatasetError: the dataset lacks training or validation samples, or a value that the inputs need.
        RunError: the folder holds a run already, or one that does not fit, or another process trains into it; or
            training diverged.
    """
    epochs = config.train.epochs
    with ExitStack() as stack:
        setup = prepare(
            config,
            dataset,
            Path(run_folder),
            stack,
            resume=resume,
            base=base,
            on_progress=lambda made, of: on_progress(Progress(0, epochs, made, of, None)),
        )
        logger = stack.enter_context(RunLogger(setup.run, setup.done)) if setup.group.rank == 0 else None
        began = time.monotonic()
        for epoch in range(setup.done + 1, epochs + 1):
            epoch_began = time.monotonic()
            late = _ends_late(config.train, done=epoch - setup.done - 1, seconds=epoch_began - began)
            if setup.group.first(partial(bool, late)):
                break
            record, batches = _train_epoch(setup, epoch, on_progress)
            record["samples_per_s"] = record["samples"] / (time.monotonic() - epoch_began)
            record |= _validate(setup)
            record["seconds"] = time.monotonic() - epoch_began
            if not (math.isfinite(record["train_loss"]) and math.isfinite(record["validation_loss"])):
                raise _diverged(setup.run, epoch)
            if logger:
                logger.write(record, setup.model, setup.optimiser)
            on_progress(Progress(epoch, epochs, batches, batches, record))
    return setup.run


def _train_epoch(setup: Setup, epoch: int, on_progress: Callable[[Progress], None]) -> tuple[dict[str, Any], int]:
    """Go through the batches of an epoch; return its record so far and the number of its batches."""
    config, model, optimiser = setup.config, setup.model, setup.optimiser
    torch.manual_seed(_mixed(config.train.seed, epoch))
    order, mirrored = _epoch_rows(setup, epoch)
    batches = math.ceil(len(order) / config.data.batch_size)
    metrics = RunningMetrics(setup.device, setup.dataset.commands)
    model.train()
    kicks = _extra_kicks(setup, epoch=epoch, batches=batches)
    every = enumerate(setup.batches.batches(order, config.data.batch_size, mirrored=mirrored), 1)
    for batch, (inputs, target, whole) in every:
        for weights in optimiser.param_groups:
            weights["lr"] = learning_rate(config.train, epoch=epoch, batch=batch, batches=batches)
        answered = answer(model, inputs, precision=setup.precision, kick_rows=with_ball(target))
        loss = model.loss(answered, target, balance=setup.balance, whole=whole)
        error = loss.total
        for kick_inputs, kick_target, whole_kicks in islice(kicks, 1):
            with torch.autocast(setup.device.type, torch.bfloat16, enabled=setup.precision == "bf16"):
                error = error + model.kick_loss(kick_inputs, kick_target, of=len(whole_kicks))
        optimiser.zero_grad(set_to_none=True)
        error.backward()  # type: ignore[no-untyped-call]
        setup.group.add_up_gradients(model)
        optimiser.step()
        with torch.no_grad():
            metrics.add(loss, answered.point(), target, batch=len(whole))
        on_progress(Progress(epoch, config.train.epochs, batch, batches, None))
    record: dict[str, Any] = {"epoch": epoch, "samples": len(order)}
    record |= {f"train_{name}": value for name, value in metrics.table(setup.group).items()}
    return record, batches


@torch.no_grad()
def _validate(setup: Setup) -> dict[str, Any]:
    """Measure the model on the validation samples, and calibrate it on them if the settings ask for that."""
    config, model, commands = setup.config, setup.model, setup.dataset.commands
    model.eval()
    metrics, calibration = RunningMetrics(setup.device, commands), Calibration(setup.device, commands)
    for inputs, target, whole in setup.batches.batches(setup.validation_rows, config.data.batch_size):
        answered = answer(model, inputs, precision=setup.precision, kick_rows=with_ball(target))
        loss = model.loss(answered, target, whole=whole)
        metrics.add(loss, answered.point(), target, batch=len(whole))
        if config.train.calibrate:
            calibration.add(answered.raw_logits, target.kind)
    record = {f"validation_{name}": value for name, value in metrics.table(setup.group).items()}
    if config.train.calibrate:
        record["temperature"], gained = calibration.fit(setup.group)
        model.head.temperature.fill_(record["temperature"])
        record["validation_cross_entropy"] -= gained
        record["validation_loss"] -= gained
    return record


def answer(
    model: Clone, inputs: Tensor, *, precision: Literal["fp32", "bf16"], kick_rows: Tensor | None = None
) -> Answer:
    """Return the answer to normalised inputs, that of `Clone.answer_inputs` but for rounding."""
    if precision == "bf16":
        with torch.autocast(inputs.device.type, torch.bfloat16):
            return model.answer_inputs(inputs, kick_rows=kick_rows)
    able = isinstance(model.trunk, nn.Sequential) and model.config.activation in ONEDNN_ACTIVATIONS
    if able and inputs.device.type == "cpu" and len(inputs) and not model.config.dropout:
        # oneDNN instead of MKL, which takes twice the time on AMD, where it leaves AVX-512 unused.
        hidden: Tensor = model.trunk(inputs.to_mkldnn()).to_dense()
        answered: Answer = model.head(hidden)
        return answered
    return model.answer_inputs(inputs, kick_rows=kick_rows)


def _epoch_rows(setup: Setup, epoch: int) -> tuple[NDArray[np.int64], NDArray[np.bool_] | None]:
    """Return the samples of an epoch in their order, and which of them to mirror, None for none."""
    data, seed = setup.config.data, setup.config.train.seed
    chosen = epoch_order(
        len(setup.rows),
        seed=seed,
        epoch=epoch - 1,
        slice_rows=data.batches_per_epoch * data.batch_size,
        draws=None if setup.draws is None else setup.draws[setup.kinds],
        repeat=data.repeat,
    )
    order = setup.rows[chosen]
    if not data.mirror:
        return order, None
    return order, epoch_mirrored(len(order), seed=seed, epoch=epoch - 1, share=data.mirror)


def _extra_kicks(setup: Setup, *, epoch: int, batches: int) -> Iterator[Batch]:
    """Give the kicks and tackles to show beside the batches of an epoch; each sample comes as often as any other."""
    seed, model = setup.config.train.seed, setup.config.model
    each = model.extra_kicks if isinstance(model, EgocentricConfig) else 0
    rows = setup.rows[np.isin(setup.kinds, WITH_BALL)]
    wanted = batches * each
    if not wanted or not len(rows):
        return iter(())
    random = np.random.default_rng((seed, 3, epoch))
    order = np.concatenate([random.permutation(rows) for _ in range(math.ceil(wanted / len(rows)))])[:wanted]
    return setup.batches.batches(order, each)


def _ends_late(config: TrainConfig, *, done: int, seconds: float) -> bool:
    """Return whether one more epoch as long as those done would end after ``max_minutes``."""
    return bool(done and config.max_minutes and seconds + seconds / done > 60 * config.max_minutes)


def _diverged(run: Run, epoch: int) -> RunError:
    kept = f"the checkpoints of epoch {epoch - 1} are kept" if epoch > 1 else "nothing is kept"
    return RunError(f"{run.path}: the loss is not a number in epoch {epoch}; {kept}; try a smaller train.learning_rate")


def learning_rate(config: TrainConfig, *, epoch: int, batch: int, batches: int) -> float:
    """The learning rate of a batch, counted from 1 as ``epoch`` is."""
    if config.schedule == "constant":
        return config.learning_rate
    done = (epoch - 1 + (batch - 1) / batches) / config.epochs
    warm = min(1.0, ((epoch - 1) * batches + batch) / WARM_UP)
    return config.learning_rate * warm * 0.5 * (1.0 + math.cos(math.pi * done))


def _mixed(seed: int, epoch: int) -> int:
    """A seed for one epoch of a run."""
    return int(np.random.SeedSequence((seed, epoch)).generate_state(1)[0])
