"""The training loop."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from teamclone.dataset.layout import Split
from teamclone.dataset.order import epoch_mirrored, epoch_order
from teamclone.dataset.reader import Dataset
from teamclone.errors import DatasetError, RunError, UsageError
from teamclone.models.answer import Answer
from teamclone.models.clone import Clone
from teamclone.models.heads.mixture import WITH_BALL, with_ball
from teamclone.models.loss import Balance, ParameterLoss
from teamclone.system.files import write_atomic
from teamclone.training.batches import Feed
from teamclone.training.calibration import Calibration
from teamclone.training.checkpoint import load_progress, load_weights, save_progress, save_weights
from teamclone.training.config import MAY_CHANGE, Config, TrainConfig, differences
from teamclone.training.group import joined, local_rank
from teamclone.training.optimiser import Optimiser, optimiser_of
from teamclone.training.run import BASE, BEST, RESUME, Base, Run, create_run, locked, open_run, save_config
from teamclone.training.scores import Scores

FIT_ROWS = 2**20
"""Training samples that the input normalisation is fitted on, evenly spread; more would not move it."""
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
    """Train a clone, from fresh weights or from those of ``base``; what a run folder holds is said in `run`.

    Every epoch ends with a checkpoint from which ``resume`` goes on exactly as if nothing had happened: weights,
    order of the samples and figures are a pure function of config and dataset (on one machine, with as many threads).
    Started by ``torchrun``, each process has a share of every batch; the result is the same but for rounding.

    Raises:
        UsageError: the machine lacks what the config asks for, or the dataset has other commands than the model.
        DatasetError: the dataset lacks training or validation samples, or a value that the inputs need.
        RunError: the folder holds a run already, or one that does not fit, or another process trains into it; or
            training diverged.
    """
    with ExitStack() as stack:
        check_commands(config, dataset, adapting=base is not None)
        commands = dataset.commands
        device, precision = _resources(config.train)
        group = stack.enter_context(joined(device))
        rows = dataset.split(Split.TRAIN)
        validation_rows = _validation_rows(config, dataset)
        if not len(rows):
            raise DatasetError(f"{dataset.path}: no training samples; make it again from more matches")

        def begin() -> Run:
            folder = Path(run_folder)
            if resume:
                _check_resumable(config, dataset, open_run(folder))
            else:
                create_run(
                    folder,
                    config,
                    dataset,
                    device=device.type,
                    precision=precision,
                    processes=group.size,
                    base=base,
                )
            stack.enter_context(locked(folder))
            if resume:
                save_config(folder, config)
            return open_run(folder)

        run = group.first(begin)
        torch.manual_seed(config.train.seed)
        model = Clone(config.model).to(device)
        optimiser = optimiser_of(config.train, model, precision=precision)
        for split_rows in (rows, validation_rows):
            dataset.need(model.inputs.channels, split_rows)
        feed = Feed(
            dataset,
            model,
            device,
            group,
            keep_bytes=config.data.keep_gb * 1e9,
            rows=np.concatenate([rows, validation_rows]),
            mirrored=rows if config.data.mirror else None,
            on_progress=lambda made, of: on_progress(Progress(0, config.train.epochs, made, of, None)),
        )
        done = 0
        if run.checkpoint_path(RESUME).is_file():
            done = load_progress(run.checkpoint_path(RESUME), model, optimiser)
        elif BASE in run.environment:
            load_weights(run.checkpoint_path(BASE), model)
            model.head.temperature.fill_(1.0)  # that of the base suits other teams
        else:
            model.inputs.fit(feed.columns(rows[:: max(1, len(rows) // FIT_ROWS)]))
        group.share_weights(model)
        answer_of = partial(answer, model, precision=precision)
        loss_of = partial(
            model.loss,
            parameter_loss=cast(ParameterLoss, config.train.parameter_loss),
            weight=config.train.parameter_weight,
            aim_weight=config.train.aim_weight,
        )
        kinds = dataset.samples["kind"].numpy()[rows]
        rows_with_ball = rows[np.isin(kinds, WITH_BALL)]
        draws, balance = balanced(config.train, np.bincount(kinds, minlength=len(commands)), device)
        batch_size = config.data.batch_size
        journal = stack.enter_context(Journal(run, done)) if group.rank == 0 else None
        began = time.monotonic()
        for epoch in range(done + 1, config.train.epochs + 1):
            epoch_began = time.monotonic()
            if epoch > done + 1 and config.train.max_minutes:
                pace = (epoch_began - began) / (epoch - done - 1)
                late = epoch_began + pace - began > 60 * config.train.max_minutes
                if group.first(partial(bool, late)):
                    break

            torch.manual_seed(_mixed(config.train.seed, epoch))
            chosen = epoch_order(
                len(rows),
                seed=config.train.seed,
                epoch=epoch - 1,
                slice_rows=config.data.batches_per_epoch * batch_size,
                draws=None if draws is None else draws[kinds],
                repeat=config.data.repeat,
            )
            order, mirrored = rows[chosen], None
            if config.data.mirror:
                mirrored = epoch_mirrored(len(order), seed=config.train.seed, epoch=epoch - 1, share=config.data.mirror)
            batches = math.ceil(len(order) / batch_size)
            scores = Scores(device, commands)
            model.train()
            kicks = _kick_order(config.train, rows_with_ball, epoch=epoch, batches=batches)
            kick_batches = feed.batches(kicks, config.train.kicks) if len(kicks) else iter(())
            for batch, (inputs, target, whole) in enumerate(feed.batches(order, batch_size, mirrored=mirrored), 1):
                for weights in optimiser.param_groups:
                    weights["lr"] = learning_rate(config.train, epoch=epoch, batch=batch, batches=batches)
                output = answer_of(inputs, kicks=with_ball(target))
                loss = loss_of(output, target, balance=balance, whole=whole)
                error = loss.total
                for kick_inputs, kick_target, whole_kicks in islice(kick_batches, 1):
                    with torch.autocast(device.type, torch.bfloat16, enabled=precision == "bf16"):
                        taught = model.kick_loss(kick_inputs, kick_target, of=len(whole_kicks))
                    error = error + config.train.parameter_weight * taught
                optimiser.zero_grad(set_to_none=True)
                error.backward()  # type: ignore[no-untyped-call]
                group.add_up_gradients(model)
                optimiser.step()
                with torch.no_grad():
                    scores.add(loss, output.point(), target, batch=len(whole))
                on_progress(Progress(epoch, config.train.epochs, batch, batches, None))
            record: dict[str, Any] = {"epoch": epoch, "samples": len(order)}
            record |= {f"train_{name}": value for name, value in scores.table(group).items()}
            record["samples_per_s"] = len(order) / (time.monotonic() - epoch_began)
            model.eval()
            scores, calibration = Scores(device, commands), Calibration(device, commands)
            with torch.no_grad():
                for inputs, target, whole in feed.batches(validation_rows, batch_size):
                    output = answer_of(inputs, kicks=with_ball(target))
                    scores.add(loss_of(output, target, whole=whole), output.point(), target, batch=len(whole))
                    if config.train.calibrate:
                        calibration.add(output.raw_logits, target.kind)
            record |= {f"validation_{name}": value for name, value in scores.table(group).items()}
            if config.train.calibrate:
                record["temperature"], gained = calibration.fit(group)
                model.head.temperature.fill_(record["temperature"])
                record["validation_cross_entropy"] -= gained
                record["validation_loss"] -= gained
            record["seconds"] = time.monotonic() - epoch_began
            if not (math.isfinite(record["train_loss"]) and math.isfinite(record["validation_loss"])):
                kept = f"the checkpoints of epoch {epoch - 1} are kept" if epoch > 1 else "nothing is kept"
                raise RunError(
                    f"{run.path}: the loss is not a number in epoch {epoch}; {kept}; try a smaller train.learning_rate"
                )
            if journal:
                journal.write(record, model, optimiser)
            on_progress(Progress(epoch, config.train.epochs, batches, batches, record))
    return run


def answer(model: Clone, inputs: Tensor, *, precision: Literal["fp32", "bf16"], kicks: Tensor | None = None) -> Answer:
    """Return the answer to normalised inputs, equal to `Clone.answer_inputs` but for rounding; ``kicks`` as there."""
    if precision == "bf16":
        with torch.autocast(inputs.device.type, torch.bfloat16):
            return model.answer_inputs(inputs, kicks=kicks)
    able = isinstance(model.trunk, nn.Sequential) and model.config.activation in ONEDNN_ACTIVATIONS
    if able and inputs.device.type == "cpu" and len(inputs) and not model.config.dropout:
        # oneDNN instead of MKL, which takes twice the time on AMD, where it leaves AVX-512 unused.
        hidden: Tensor = model.trunk(inputs.to_mkldnn()).to_dense()
        answered: Answer = model.head(hidden)
        return answered
    return model.answer_inputs(inputs, kicks=kicks)


def _kick_order(config: TrainConfig, rows: NDArray[np.int64], *, epoch: int, batches: int) -> NDArray[np.int64]:
    """The kicks and tackles to show beside the batches of an epoch, from ``rows`` with all of them: each as often."""
    wanted = batches * config.kicks
    if not wanted or not len(rows):
        return rows[:0]
    random = np.random.default_rng((config.seed, 3, epoch))
    return np.concatenate([random.permutation(rows) for _ in range(math.ceil(wanted / len(rows)))])[:wanted]


def check_commands(config: Config, dataset: Dataset, *, adapting: bool = False) -> None:
    """See that the model answers with what the dataset has.

    Raises:
        UsageError: it does not.
    """
    there, answers = dataset.commands, config.model.commands
    if answers != there:
        remedy = f"add --set model.commands={','.join(there)}"
        if adapting:
            remedy = "make the dataset with the options of that of the base"
        raise UsageError(
            f"{dataset.path}: has the commands {', '.join(there)}, the model is for {', '.join(answers)}; {remedy}"
        )


class Journal:
    """All that the epochs of a run leave in its folder, from epoch ``done`` + 1 on."""

    def __init__(self, run: Run, done: int) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self.run, self.history = run, run.history()[:done]
        write_atomic(run.metrics_path, "".join(json.dumps(record) + "\n" for record in self.history).encode())
        self.board = SummaryWriter(str(run.path / "tensorboard"), purge_step=done + 1)

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self.board.close()

    def write(self, record: dict[str, Any], model: Clone, optimiser: Optimiser) -> None:
        """Write an epoch. A kill before the last file repeats the epoch, which writes the same again."""
        epoch, run = record["epoch"], self.run
        with run.metrics_path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")
        for name, (figure, better) in BEST.items():
            before = [past[figure] for past in self.history if figure in past]
            if figure in record and all(better(float(record[figure]), float(value)) for value in before):
                save_weights(run.checkpoint_path(name), model, epoch=epoch)
        save_weights(run.checkpoint_path("last"), model, epoch=epoch)
        self.history.append(record)
        save_progress(run.checkpoint_path(RESUME), model, optimiser, epoch=epoch)
        for name, value in record.items():
            part, _, figure = name.partition("_")
            self.board.add_scalar(f"{part}/{figure}" if part in {"train", "validation"} else name, value, epoch)


def _check_resumable(config: Config, dataset: Dataset, run: Run) -> None:
    """See that this config and dataset are those of the run."""
    if dataset.id != run.dataset_id:
        raise RunError(
            f"{run.path}: was trained on dataset {run.dataset_id} ({run.dataset_path}), "
            f"{dataset.path} is {dataset.id}; give the same dataset or begin a new run"
        )
    # Over how many epochs the cosine falls decides on every learning rate.
    free = tuple(key for key in MAY_CHANGE if config.train.schedule == "constant" or key != "train.epochs")
    changed = [text for text in differences(run.config, config) if text.partition(":")[0] not in free]
    if changed:
        raise RunError(f"{run.path}: cannot resume with other settings ({'; '.join(changed)}); begin a new run")


def _resources(config: TrainConfig) -> tuple[torch.device, Literal["fp32", "bf16"]]:
    """The device and the precision to train in, with ``auto`` resolved for this machine."""
    if config.threads:
        torch.set_num_threads(config.threads)
    if config.device == "cuda" and not torch.cuda.is_available():
        raise UsageError("train.device = cuda, but PyTorch finds no CUDA device here; use cpu or auto")
    if config.device != "cpu" and torch.cuda.is_available():
        device = torch.device("cuda", local_rank() % torch.cuda.device_count())
        torch.cuda.set_device(device)
    else:
        device = torch.device("cpu")
    bfloat = config.precision == "bf16" or (config.precision == "auto" and has_fast_bfloat16(device))
    return device, "bf16" if bfloat else "fp32"


def has_fast_bfloat16(device: torch.device) -> bool:
    """Whether matrix products are faster in bfloat16: about three times on processors that have it, else slower."""
    if device.type == "cuda":
        return bool(torch.cuda.is_bf16_supported(including_emulation=False))
    able = torch.cpu.get_capabilities()
    return bool(able.get("avx512_bf16") or able.get("amx_bf16"))


def balanced(
    config: TrainConfig, counts: NDArray[np.integer], device: torch.device
) -> tuple[NDArray[np.float32] | None, Balance | None]:
    """How commands of unlike frequency are made up for.

    Args:
        counts: (commands,) training samples of each command.

    Returns:
        (commands,) how often a sample of each command is drawn, None for once; and what the loss needs to know, None
        for nothing.
    """
    if config.balance == "none":
        return None, None
    # Of a command that never comes nothing is known: 1.
    shares = counts / counts.sum()
    factors = np.where(counts > 0, shares, 1.0) ** -config.balance_strength
    factors = np.where(counts > 0, factors / (factors @ shares), 1.0)
    draws = None
    if config.balance == "oversample":
        draws = factors.astype(np.float32)
    elif config.balance == "undersample":
        draws = (factors / factors[counts > 0].max()).astype(np.float32)
    weight = torch.tensor(factors if config.balance == "weights" else np.ones_like(factors), dtype=torch.float32)
    shift = torch.tensor(np.log(factors) if config.prior_correction else np.zeros_like(factors), dtype=torch.float32)
    return draws, Balance(weight.to(device), shift.to(device))


def _validation_rows(config: Config, dataset: Dataset) -> NDArray[np.int64]:
    """The samples to validate on, always the same ones, spread over all validation matches."""
    rows = dataset.split(Split.VALIDATION)
    if not len(rows):
        raise DatasetError(
            f"{dataset.path}: no validation samples, so no checkpoint can be chosen; make it again from more matches"
        )
    wanted = config.data.validation_batches * config.data.batch_size
    if not wanted or wanted >= len(rows):
        return rows
    chosen = np.random.default_rng((config.train.seed, 2)).choice(len(rows), wanted, replace=False)
    return rows[np.sort(chosen)]


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
