"""Optimisers: Adam and others of PyTorch, Muon for matrices."""

from __future__ import annotations

from typing import Any, Literal

import torch
from torch import Tensor, nn

from teamclone.training.config import TrainConfig

MOMENTUM = 0.95
ADAM_STEP = 0.2
"""Mean size of a step of Adam, in learning rates."""
NEWTON_SCHULZ = 3.4445, -4.7750, 2.0315
"""Coefficients of the polynomial that brings singular values near 1 soonest (Jordan 2024)."""


class Orthogonal(torch.optim.Optimizer):
    """Muon (Jordan 2024): each step of a matrix is made orthogonal.

    So it goes equally far in directions of few and of many samples. Steps are scaled to the size of
    Adam's (Liu et al. 2025, "Muon is scalable for LLM training"), so that one learning rate serves both. PyTorch's own
    always computes in bfloat16, which is far slower on a processor without it.

    Args:
        dtype: to compute in.
    """

    def __init__(self, matrices: list[nn.Parameter], *, lr: float, weight_decay: float, dtype: torch.dtype) -> None:
        self.dtype = dtype
        super().__init__(matrices, {"lr": lr, "weight_decay": weight_decay})

    @torch.no_grad()
    def step(self, closure: None = None) -> None:  # type: ignore[override]
        """Move the matrices one step; ``closure`` is ignored."""
        for group in self.param_groups:
            for weights in group["params"]:
                if weights.grad is None:
                    continue
                state = self.state[weights]
                if not state:
                    state["momentum"] = torch.zeros_like(weights)
                momentum = state["momentum"].lerp_(weights.grad, 1 - MOMENTUM)
                step = orthogonal(weights.grad.lerp(momentum, MOMENTUM), self.dtype)  # Nesterov's
                weights.mul_(1 - group["lr"] * group["weight_decay"])
                weights.add_(step, alpha=-group["lr"] * ADAM_STEP * max(weights.shape) ** 0.5)


def orthogonal(matrix: Tensor, dtype: torch.dtype) -> Tensor:
    """Return about U V' of the singular value decomposition U S V' of a matrix.

    Five steps of Newton and Schulz, see NEWTON_SCHULZ.
    """
    wide = matrix.shape[0] <= matrix.shape[1]
    of = matrix if wide else matrix.T
    of = (of / of.norm().clamp(min=1e-7)).to(dtype)
    first, second, third = NEWTON_SCHULZ
    for _ in range(5):
        square = of @ of.T
        of = torch.addmm(of, torch.addmm(square, square, square, beta=second, alpha=third), of, beta=first)
    of = of.to(matrix.dtype)
    return of if wide else of.T


class Muon:
    """`Orthogonal` for the matrices of the hidden layers, Adam for all other weights."""

    def __init__(self, config: TrainConfig, model: nn.Module, *, dtype: torch.dtype) -> None:
        hidden: list[nn.Parameter] = []
        others: list[nn.Parameter] = []
        for name, weights in model.named_parameters():
            (hidden if name.startswith("trunk.") and weights.ndim == 2 else others).append(weights)
        matrices = Orthogonal(hidden, lr=config.learning_rate, weight_decay=config.weight_decay, dtype=dtype)
        self.parts: tuple[torch.optim.Optimizer, ...] = (matrices, _adam(config, others))

    @property
    def param_groups(self) -> list[dict[str, Any]]:
        """The parameter groups of both optimisers, matrices first."""
        return [group for part in self.parts for group in part.param_groups]

    def zero_grad(self, *, set_to_none: bool = True) -> None:
        """Clear the gradients of all weights."""
        for part in self.parts:
            part.zero_grad(set_to_none=set_to_none)

    def step(self) -> None:
        """Move all weights one step."""
        for part in self.parts:
            part.step()

    def state_dict(self) -> dict[str, Any]:
        """Return the state in the layout of a PyTorch optimiser, matrices first."""
        matrices, adam = (part.state_dict()["state"] for part in self.parts)
        return {
            "state": matrices | {self._first_of_adam + index: state for index, state in adam.items()},
            "param_groups": self.param_groups,
        }

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Restore a state that `state_dict` returned."""
        first = self._first_of_adam
        states = (
            {index: state for index, state in saved["state"].items() if index < first},
            {index - first: state for index, state in saved["state"].items() if index >= first},
        )
        for part, state in zip(self.parts, states, strict=True):
            part.load_state_dict({"state": state, "param_groups": part.state_dict()["param_groups"]})

    @property
    def _first_of_adam(self) -> int:
        return sum(len(group["params"]) for group in self.parts[0].param_groups)


Optimiser = torch.optim.Optimizer | Muon

_STATES: dict[type[torch.optim.Optimizer], tuple[str, ...]] = {
    torch.optim.Adam: ("exp_avg", "exp_avg_sq"),
    torch.optim.AdamW: ("exp_avg", "exp_avg_sq"),
    torch.optim.RMSprop: ("square_avg",),
    torch.optim.Adagrad: ("sum",),
    Orthogonal: ("momentum",),
}
"""What an optimiser keeps of each weight, in the weight's shape."""


def state_shapes(optimiser: Optimiser) -> list[dict[str, torch.Size]]:
    """Return the names and shapes of the state that belongs to each weight, in the order of the parameter groups."""
    if isinstance(optimiser, Muon):
        return [shapes for part in optimiser.parts for shapes in state_shapes(part)]
    steps = {} if isinstance(optimiser, Orthogonal) else {"step": torch.Size()}
    weights = [weight for group in optimiser.param_groups for weight in group["params"]]
    return [steps | dict.fromkeys(_STATES[type(optimiser)], weight.shape) for weight in weights]


def optimiser_of(config: TrainConfig, model: nn.Module, *, precision: Literal["fp32", "bf16"] = "fp32") -> Optimiser:
    """Return the optimiser that a config asks for, of all weights of a model."""
    if config.optimiser == "muon":
        return Muon(config, model, dtype=torch.bfloat16 if precision == "bf16" else torch.float32)
    if config.optimiser == "adam":
        return _adam(config, [*model.parameters()])
    if config.optimiser == "rmsprop":
        return torch.optim.RMSprop(model.parameters(), lr=config.learning_rate, eps=config.epsilon)
    return torch.optim.Adagrad(model.parameters(), lr=config.learning_rate, eps=config.epsilon)


def _adam(config: TrainConfig, weights: list[nn.Parameter]) -> torch.optim.Optimizer:
    settings: dict[str, Any] = {
        "lr": config.learning_rate,
        "betas": (config.betas[0], config.betas[1]),
        "eps": config.epsilon,
        "fused": True,
    }
    if config.weight_decay:
        return torch.optim.AdamW(weights, weight_decay=config.weight_decay, **settings)
    return torch.optim.Adam(weights, **settings)
