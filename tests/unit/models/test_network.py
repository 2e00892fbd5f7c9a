from __future__ import annotations

from itertools import pairwise

import pytest
import torch

from teamclone.models.config import ACTIVATIONS, ModelConfig
from teamclone.models.network import Clone, parameter_count
from teamclone.models.state import CHANNEL, State, Target
from teamclone.rcss.player_types import FIELDS


@pytest.fixture(autouse=True)
def _seeded() -> None:
    torch.manual_seed(0)


def random_state(batch: int) -> State:
    return State.now(
        ball=torch.randn(batch, 4),
        players=torch.randn(batch, 22, len(CHANNEL)) * 20,
        types=torch.rand(batch, 22, len(FIELDS)) + 0.5,
        actor=torch.randint(0, 11, (batch,)),
    )


def test_the_papers_architecture() -> None:
    def layers(*widths: int) -> int:
        return sum((a + 1) * b for a, b in pairwise(widths))

    heads = 129 * (4 + 6)
    assert parameter_count(Clone(ModelConfig())) == layers(119, 512, 256, 128) + heads
    assert parameter_count(Clone(ModelConfig(own_type=True))) == layers(127, 512, 256, 128) + heads
    assert parameter_count(Clone(ModelConfig(hidden=(32,)))) == layers(119, 32) + 33 * 10


def test_answers_are_probabilities_and_bounded_parameters() -> None:
    model = Clone(ModelConfig())
    with torch.no_grad():
        model.head.parameter.weight.mul_(1000)
    probabilities, parameters = model.predict(random_state(50))
    assert probabilities.shape == (50, 4)
    assert probabilities.sum(1).tolist() == pytest.approx([1] * 50)
    limits = torch.tensor([100.0, 180.0, 180.0, 100.0, 180.0, 180.0])
    assert parameters.abs().amax(0).tolist() == pytest.approx(limits.tolist())


def test_rows_do_not_depend_on_each_other() -> None:
    model = Clone(ModelConfig())
    state = random_state(17)
    whole = model.predict(state)
    for row in (0, 16):
        alone = model.predict(State(*(tensor[row : row + 1] for tensor in state)))
        for one, all_ in zip(alone, whole, strict=True):
            assert torch.allclose(one[0], all_[row], atol=1e-2, rtol=1e-3)


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_every_activation_changes_the_answer(activation: str) -> None:
    state = random_state(4)
    answers = []
    for name in ("relu", activation):
        torch.manual_seed(0)
        answers.append(Clone(ModelConfig(activation=name)).predict(state)[0])
    assert torch.equal(*answers) == (activation == "relu")


def test_overfits_sixty_four_samples() -> None:
    model = Clone(ModelConfig())
    state = random_state(64)
    kind = torch.randint(0, 4, (64,))
    limits = torch.tensor([[100.0, 180.0], [180.0, 0.0], [100.0, 180.0], [180.0, 0.0]])
    target = Target(kind=kind, parameters=(torch.rand(64, 2) * 1.6 - 0.8) * limits[kind])
    model.inputs.fit([model.inputs.project(state)])
    optimiser = torch.optim.Adam(model.parameters(), lr=1e-3)
    for _ in range(200):
        loss = model.head.loss(model.output(state), target)
        optimiser.zero_grad()
        loss.total.backward()
        optimiser.step()
    prediction = model(state)
    assert torch.equal(prediction.logits.argmax(1), kind)
    assert loss.parameters.item() < 1e-3
