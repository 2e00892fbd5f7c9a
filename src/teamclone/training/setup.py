"""What a training needs before its first epoch: device, run folder, model, batches and where to go on."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray

from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset
from teamclone.errors import DatasetError, RunError, UsageError
from teamclone.models.clone import Clone
from teamclone.models.heads.mixture import WITH_BALL
from teamclone.models.loss import Balance
from teamclone.training.batches import Batches
from teamclone.training.checkpoint import load_progress, load_weights
from teamclone.training.config import MAY_CHANGE, Config, TrainConfig, differences
from teamclone.training.group import Group, joined, local_rank
from teamclone.training.optimiser import Optimiser, optimiser_of
from teamclone.training.run import BASE, RESUME, Base, Run, create_run, locked, open_run, save_config

FIT_ROWS = 2**20
"""Training samples that the input normalisation is fitted on, evenly spread; more would not move it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """A training that is ready for its next epoch.

    Attributes:
        run: its folder. config: its settings. dataset: its samples. group: the processes that train together.
        device, precision: where and in what to compute.
        model, optimiser: as they are after epoch ``done``.
        batches: of the dataset for this model.
        rows, validation_rows: (n,) indices of the samples. kinds: (len(rows),) their commands.
        draws: (commands,) how often a sample of each command is drawn, None for once.
        balance: what the loss needs to know of it, None for nothing.
    """

    run: Run
    config: Config
    dataset: Dataset
    group: Group
    device: torch.device
    precision: Literal["fp32", "bf16"]
    model: Clone
    optimiser: Optimiser
    done: int
    batches: Batches
    rows: NDArray[np.int64]
    validation_rows: NDArray[np.int64]
    kinds: NDArray[np.uint8]
    draws: NDArray[np.float32] | None
    balance: Balance | None


def prepare(
    config: Config,
    dataset: Dataset,
    folder: Path,
    stack: ExitStack,
    *,
    resume: bool,
    base: Base | None,
    on_progress: Callable[[int, int], None],
) -> Setup:
    """Set up a training; ``stack`` holds its lock and its group of processes.

    Arguments and errors are those of `loop.train`.

    Args:
        on_progress: called with the samples whose inputs are made, and their number.
    """
    check_fits(config, dataset, adapting=base is not None)
    device, precision = _resources(config.train)
    group = stack.enter_context(joined(device))
    rows = dataset.split(Split.TRAIN)
    validation_rows = _validation_rows(config, dataset)
    if not len(rows):
        raise DatasetError(f"{dataset.path}: no training samples; make it again from more matches")

    def begin() -> Run:
        if resume:
            _check_resumable(config, dataset, open_run(folder))
        else:
            processes = group.size
            create_run(folder, config, dataset, device=device.type, precision=precision, processes=processes, base=base)
        stack.enter_context(locked(folder))
        if resume:
            save_config(folder, config)
        return open_run(folder)

    run = group.first(begin)
    torch.manual_seed(config.train.seed)
    model = Clone(config.model).to(device)
    optimiser = optimiser_of(config.train, model, precision=precision)
    for split_rows in (rows, validation_rows):
        dataset.need(model.inputs.channels, split_rows, history=model.inputs.history)
    batches = Batches(
        dataset,
        model,
        device,
        group,
        cache_bytes=config.data.cache_gb * 1e9,
        rows=np.concatenate([rows, validation_rows]),
        mirrored=rows if config.data.mirror else None,
        on_progress=on_progress,
    )
    kinds = dataset.samples["kind"].numpy()[rows]
    done = 0
    if run.checkpoint_path(RESUME).is_file():
        done = load_progress(run.checkpoint_path(RESUME), model, optimiser)
    elif BASE in run.environment:
        load_weights(run.checkpoint_path(BASE), model)
        model.head.temperature.fill_(1.0)  # that of the base suits other teams
    else:
        _fit(model, batches, rows, kinds)
    group.share_weights(model)
    draws, balance = balanced(config.train, np.bincount(kinds, minlength=len(dataset.commands)), device)
    return Setup(
        run=run,
        config=config,
        dataset=dataset,
        group=group,
        device=device,
        precision=precision,
        model=model,
        optimiser=optimiser,
        done=done,
        batches=batches,
        rows=rows,
        validation_rows=validation_rows,
        kinds=kinds,
        draws=draws,
        balance=balance,
    )


def check_fits(config: Config, dataset: Dataset, *, adapting: bool = False) -> None:
    """See that the model answers with what the dataset has, and knows what its situations are.

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
    if dataset.percepts and "age" not in getattr(config.model, "blocks", ()):
        raise UsageError(
            f"{dataset.path}: has situations as players believe them, of which a model without the block age knows "
            "nothing; take --preset tournament"
        )


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


def _fit(model: Clone, batches: Batches, rows: NDArray[np.int64], kinds: NDArray[np.uint8]) -> None:
    """Fit the normalisation to the training samples of these commands."""
    every = batches.columns(rows[:: max(1, len(rows) // FIT_ROWS)])
    model.fit(every, batches.columns(rows[np.isin(kinds, WITH_BALL)]))


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
