from __future__ import annotations

from math import log

import pytest
import torch

from teamclone.models.loss import (
    Balance,
    Loss,
    ParameterLoss,
    command_loss,
    issued,
    mixture_loss,
    point_loss,
    projected_parameters,
)
from teamclone.world.state import Target

TARGET = Target(
    kind=torch.tensor([0, 1, 2, 3]),
    parameters=torch.tensor([[50.0, -90.0], [45.0, 0.0], [100.0, 180.0], [-18.0, 0.0]]),
)


def test_parameters_take_the_places_of_table_two() -> None:
    assert projected_parameters(TARGET).tolist() == [
        pytest.approx(row)
        for row in ([0.5, -0.5, 0, 0, 0, 0], [0, 0, 0.25, 0, 0, 0], [0, 0, 0, 1, 1, 0], [0, 0, 0, 0, 0, -0.1])
    ]
    assert issued(TARGET.kind).int().tolist() == [
        [1, 1, 0, 0, 0, 0],
        [0, 0, 1, 0, 0, 0],
        [0, 0, 0, 1, 1, 0],
        [0, 0, 0, 0, 0, 1],
    ]


def test_the_papers_loss_by_hand() -> None:
    logits = torch.log(torch.tensor([[0.7, 0.1, 0.1, 0.1], [0.25, 0.25, 0.25, 0.25]]))
    predicted = torch.tensor([[0.5, 0.1, 0.2, 0.0, 0.0, 0.0], [0.0, 0.0, 0.25, 0.0, 0.0, -0.3]])
    target = TARGET.select(torch.arange(2))
    loss = point_loss(logits, predicted, target)
    # Row 0: dash direction off by .6, turn moment .2 where zero is asked; row 1: tackle direction -.3 likewise.
    mse = (0.6**2 + 0.2**2 + 0.3**2) / 12
    assert float(loss.cross_entropy) == pytest.approx(-(log(0.7) + log(0.25)) / 2)
    assert float(loss.parameters) == pytest.approx(mse)
    assert float(loss.total) == pytest.approx(-(log(0.7) + log(0.25)) / 2 + mse)


def test_masked_loss_looks_at_issued_parameters_only() -> None:
    predicted = torch.tensor([[0.5, 0.1, 0.2, 0.0, 0.0, 0.0], [0.0, 0.0, 0.35, 0.0, 0.0, -0.3]])
    target = TARGET.select(torch.arange(2))
    loss = point_loss(torch.zeros(2, 4), predicted, target, parameter_loss="masked")
    # Three parameters were issued: dash power exact, dash direction off by .6, turn moment by .1.
    assert float(loss.parameters) == pytest.approx((0.6**2 + 0.1**2) / 3)


def test_no_gradient_reaches_parameters_that_the_mask_hides() -> None:
    predicted = torch.full((4, 6), 0.9, requires_grad=True)
    point_loss(torch.zeros(4, 4), predicted, TARGET, parameter_loss="masked").total.backward()
    assert predicted.grad is not None
    assert torch.equal(predicted.grad != 0, issued(TARGET.kind))


@pytest.mark.parametrize("balance", [None, Balance(torch.tensor([0.5, 1.0, 2.0, 9.0]), torch.arange(4.0))])
@pytest.mark.parametrize("parameter_loss", ["paper", "masked"])
def test_losses_of_shares_add_up_to_that_of_the_batch(parameter_loss: ParameterLoss, balance: Balance | None) -> None:
    """Also where the shares differ in length and in how many parameters were issued, and where one is empty."""
    generator = torch.Generator().manual_seed(0)
    kind = torch.tensor([0, 0, 1, 3, 2, 1, 1])
    target = Target(kind, torch.rand(7, 2, generator=generator) * 90)
    logits = torch.randn(7, 4, generator=generator, requires_grad=True)
    projected = (torch.rand(7, 6, generator=generator) - 0.5).requires_grad_()

    def loss_of(part: slice) -> Loss:
        share = Target(kind[part], target.parameters[part])
        return point_loss(
            logits[part], projected[part], share, parameter_loss=parameter_loss, balance=balance, whole=kind
        )

    whole = point_loss(logits, projected, target, parameter_loss=parameter_loss, balance=balance)
    expected = torch.autograd.grad(whole.total, (logits, projected))
    shares = [loss_of(part) for part in (slice(0, 2), slice(2, 7), slice(7, 7))]
    for together, *parts in zip(whole, *shares, strict=True):
        assert float(sum(parts).detach()) == pytest.approx(float(together.detach()))
    got = torch.autograd.grad(sum(share.total for share in shares), (logits, projected))
    for one, other in zip(expected, got, strict=True):
        assert torch.allclose(one, other)


def test_the_mixtures_loss_by_hand() -> None:
    logits = torch.log(torch.tensor([[0.7, 0.1, 0.1, 0.1], [0.25, 0.25, 0.25, 0.25]]))
    target = TARGET.select(torch.arange(2))
    likelihood, to_targets = torch.tensor([-1.0, -3.0]), torch.tensor([0.0, -8.0])
    cross_entropy = -(log(0.7) + log(0.25)) / 2
    loss = mixture_loss(logits, likelihood, target, to_targets=to_targets, weight=0.5, target_weight=0.1)
    # The mean is over all commands: half of them turn.
    assert [float(part) for part in loss] == pytest.approx([cross_entropy + 0.5 * 2 + 0.1 * 4, cross_entropy, 2])
    for untaught in (
        mixture_loss(logits, likelihood, target, to_targets=to_targets),
        mixture_loss(logits, likelihood, target, target_weight=9.0),
    ):
        assert [float(part) for part in untaught] == pytest.approx([cross_entropy + 2, cross_entropy, 2])
    shares = [
        mixture_loss(
            logits[row : row + 1],
            likelihood[row : row + 1],
            Target(target.kind[row : row + 1], target.parameters[row : row + 1]),
            to_targets=to_targets[row : row + 1],
            weight=0.5,
            target_weight=0.1,
            whole=target.kind,
        )
        for row in range(2)
    ]
    for together, *parts in zip(loss, *shares, strict=True):
        assert float(sum(parts)) == pytest.approx(float(together))


def test_a_balanced_cross_entropy_by_hand() -> None:
    logits = torch.log(torch.tensor([[0.5, 0.2, 0.2, 0.1], [0.25, 0.25, 0.25, 0.25]]))
    balance = Balance(torch.tensor([0.5, 3.0, 1.0, 1.0]), torch.log(torch.tensor([1.0, 2.0, 1.0, 1.0])))
    loss = point_loss(logits, torch.zeros(2, 6), TARGET.select(torch.arange(2)), balance=balance)
    # Shifted, the first row is .5 .4 .2 .1 of 1.2, the second 1 2 1 1 of 5.
    assert float(loss.cross_entropy) == pytest.approx(-(0.5 * log(0.5 / 1.2) + 3 * log(2 / 5)) / 2)


@pytest.mark.parametrize("weighted", [True, False])
def test_with_prior_correction_the_best_logits_are_those_of_the_true_prior(weighted: bool) -> None:
    """Whether commands are weighed or drawn more often, as here by whole numbers."""
    factors = torch.tensor([1.0, 2.0, 4.0, 8.0])
    kind = torch.tensor([0] * 8 + [1] * 4 + [2] * 2 + [3])
    prior = kind.bincount() / len(kind)
    if weighted:
        balance = Balance(factors, torch.log(factors))
    else:
        kind = kind.repeat_interleave(factors[kind].long())
        balance = Balance(torch.ones(4), torch.log(factors))
    logits = torch.log(prior).expand(len(kind), 4).clone().requires_grad_()
    command_loss(logits, kind, balance=balance, of=len(kind)).backward()
    assert logits.grad is not None
    assert logits.grad.sum(0).tolist() == pytest.approx([0.0] * 4, abs=1e-6)
