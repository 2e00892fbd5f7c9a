"""Checkpoints: weights, and the one file from which a run goes on. Each is written whole or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import safetensors.torch
import torch
from safetensors import SafetensorError, safe_open
from torch import nn

from teamclone.errors import RunError
from teamclone.system.files import write_atomic
from teamclone.training.optimiser import Optimiser, state_shapes


def save_weights(path: Path, model: nn.Module, *, epoch: int) -> None:
    """Write weights and normalisation of a model as safetensors; ``epoch`` counts the finished ones."""
    tensors = {name: tensor.contiguous().cpu() for name, tensor in model.state_dict().items()}
    write_atomic(path, safetensors.torch.save(tensors, metadata={"epoch": str(epoch)}))


def load_weights(path: Path, model: nn.Module) -> int:
    """Put weights into a model of equal shape; return their epoch.

    Raises:
        RunError: the file is damaged or of another model.
    """
    tensors, epoch = _read(path)
    _put(path, model, tensors)
    return epoch


def save_progress(path: Path, model: nn.Module, optimiser: Optimiser, *, epoch: int) -> None:
    """Write all that the next epoch depends on beside config and dataset."""
    tensors = {f"model.{name}": tensor.contiguous().cpu() for name, tensor in model.state_dict().items()}
    for index, state in optimiser.state_dict()["state"].items():
        tensors |= {f"optimiser.{index}.{name}": value.contiguous().cpu() for name, value in state.items()}
    write_atomic(path, safetensors.torch.save(tensors, metadata={"epoch": str(epoch)}))


def load_progress(path: Path, model: nn.Module, optimiser: Optimiser) -> int:
    """Bring model and optimiser to the state of `save_progress`; return the number of finished epochs.

    Raises:
        RunError: the file is damaged, or of another model or optimiser.
    """
    tensors, epoch = _read(path)
    weights: dict[str, torch.Tensor] = {}
    states: dict[int, dict[str, Any]] = {}
    for key, tensor in tensors.items():
        owner, _, name = key.partition(".")
        if owner == "model":
            weights[name] = tensor
        else:
            index, _, name = name.partition(".")
            states.setdefault(int(index) if index.isdecimal() else -1, {})[name] = tensor
    _check_states(path, states, state_shapes(optimiser))
    _put(path, model, weights)
    optimiser.load_state_dict({"state": states, "param_groups": optimiser.state_dict()["param_groups"]})
    return epoch


def _check_states(path: Path, states: dict[int, dict[str, Any]], shapes: list[dict[str, torch.Size]]) -> None:
    """See that each state is of a weight and has its shape: fused optimisers read and write by the weight's alone."""
    for index, state in states.items():
        expected = shapes[index] if 0 <= index < len(shapes) else {}
        found = {name: tensor.shape for name, tensor in state.items()}
        if found != expected or not all(tensor.is_floating_point() for tensor in state.values()):
            raise RunError(
                f"{path}: of another optimiser than that of config.toml (state {index}: expected "
                f"{_words(expected)}, got {_words(found)}); begin a new run"
            )


def _words(shapes: dict[str, torch.Size]) -> str:
    return ", ".join(f"{name} {tuple(shape)}" for name, shape in sorted(shapes.items())) or "none"


def _read(path: Path) -> tuple[dict[str, torch.Tensor], int]:
    try:
        with safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            return {key: file.get_tensor(key) for key in file.keys()}, int(metadata["epoch"])  # noqa: SIM118 - no dict
    except FileNotFoundError:
        raise RunError(f"{path}: no such checkpoint") from None
    except (SafetensorError, KeyError, ValueError) as error:
        raise RunError(f"{path}: not a checkpoint of teamclone ({error})") from None


def _put(path: Path, model: nn.Module, tensors: dict[str, torch.Tensor]) -> None:
    try:
        model.load_state_dict(tensors)
    except RuntimeError as error:
        raise RunError(f"{path}: of another model than that of config.toml ({' '.join(str(error).split())})") from None
