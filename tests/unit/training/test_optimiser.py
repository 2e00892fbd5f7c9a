"""Which optimiser moves which weights, and how."""

from __future__ import annotations

from copy import deepcopy

import pytest
import torch
from torch import nn

from teamclone.models.clone import Clone
from teamclone.training.config import load_config
from teamclone.training.optimiser import Muon, optimiser_of


def clone(*settings: str) -> tuple[Clone, Muon]:
    config = load_config("paper", ["train.optimiser=muon", *settings])
    torch.manual_seed(0)
    model = Clone(config.model)
    stepper = optimiser_of(config.train, model)
    assert isinstance(stepper, Muon)
    return model, stepper


def learn(model: Clone, stepper: Muon) -> None:
    stepper.zero_grad()
    hidden = model.trunk(torch.linspace(-1, 1, 50 * 119).reshape(50, 119).sin())
    answer = model.head(hidden)
    (answer.raw_logits.square().sum() + answer.projected.square().sum()).backward()
    stepper.step()


@pytest.mark.parametrize("members", [1, 2])
def test_muon_has_the_matrices_of_the_hidden_layers_and_adam_all_else(members: int) -> None:
    model, stepper = clone(f"model.ensemble_size={members}")
    muon, adam = ({id(of) for group in part.param_groups for of in group["params"]} for part in stepper.parts)
    for name, weights in model.named_parameters():
        hidden = name.startswith("trunk.") and name.endswith(".weight")
        assert (id(weights) in muon, id(weights) in adam) == (hidden, not hidden), name


def test_a_step_of_muon_goes_as_far_in_all_directions() -> None:
    model, stepper = clone("train.learning_rate=0.01")
    layer = model.trunk[2]
    assert isinstance(layer, nn.Linear)
    before = layer.weight.detach().clone()
    across, _, along = torch.linalg.svd(torch.randn_like(before), full_matrices=False)
    layer.weight.grad = across @ torch.diag(torch.logspace(1.5, 0.0, len(along))) @ along
    stepper.step()
    moved = torch.linalg.svdvals(layer.weight.detach() - before)
    assert moved[0] < 2 * moved[-1]
    # As far as Adam goes: 0.2 of the learning rate on average (Liu et al. 2025).
    assert (layer.weight.detach() - before).square().mean().sqrt().item() == pytest.approx(0.002, rel=0.2)


def test_a_changed_learning_rate_is_that_of_both() -> None:
    model, stepper = clone()
    before = {name: weights.detach().clone() for name, weights in model.named_parameters()}
    for group in stepper.param_groups:
        group["lr"] = 0.0
    learn(model, stepper)
    assert all(torch.equal(weights, before[name]) for name, weights in model.named_parameters())
    for group in stepper.param_groups:
        group["lr"] = 0.001
    learn(model, stepper)
    assert not any(torch.equal(weights, before[name]) for name, weights in model.named_parameters())


def test_muon_goes_on_from_what_it_saved() -> None:
    model, stepper = clone()
    learn(model, stepper)
    other, other_stepper = clone()
    other.load_state_dict(model.state_dict())
    other_stepper.load_state_dict(deepcopy(stepper.state_dict()))
    learn(model, stepper)
    learn(other, other_stepper)
    for name, weights in model.state_dict().items():
        assert torch.equal(weights, other.state_dict()[name]), name
