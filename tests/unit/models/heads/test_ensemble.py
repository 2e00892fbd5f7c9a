from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from tests.synthetic import make_dataset

from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.models.clone import Clone, parameter_count
from teamclone.models.config import EgocentricConfig, ModelConfig, PaperConfig

PAPER = PaperConfig(hidden=(16, 8), parameter_weight=0.5)
MIXTURE = EgocentricConfig(
    blocks=("self", "ball"),
    kick_blocks=("ball", "mates"),
    target_points=2,
    target_hidden=(8,),
    parameter_hidden=(8,),
    kick_hidden=(8,),
    hidden=(16, 8),
    kick_attention=0,
    kick_dropout=0.0,
    target_weight=0.0,
    parameter_weight=0.5,
)
CONFIGS = pytest.mark.parametrize("config", [PAPER, MIXTURE])


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return open_dataset(make_dataset(tmp_path_factory.mktemp("data") / "ds", frames_per_match=5))


def ensemble(config: ModelConfig, members: int) -> tuple[Clone, list[Clone]]:
    """An ensemble, and each of its members as a clone of its own."""
    torch.manual_seed(0)
    together = Clone(replace(config, ensemble_size=members))
    alone = []
    for index in range(members):
        model = Clone(config)
        model.trunk.load_state_dict(together.trunk.members[index].state_dict())
        model.head.load_state_dict(together.head.members[index].state_dict())
        alone.append(model.eval())
    return together.eval(), alone


@CONFIGS
def test_probabilities_are_the_mean_of_different_members(dataset: Dataset, config: ModelConfig) -> None:
    together, alone = ensemble(config, 3)
    assert parameter_count(together) == 3 * parameter_count(alone[0])
    state = dataset.state(np.arange(40))
    answers = [model.predict(state)[0] for model in alone]
    assert not torch.allclose(answers[0], answers[1], atol=1e-3)
    assert torch.allclose(together.predict(state)[0], torch.stack(answers).mean(0), atol=1e-6)


@CONFIGS
def test_equal_members_answer_as_one_of_them(dataset: Dataset, config: ModelConfig) -> None:
    together, alone = ensemble(config, 2)
    for part in (together.trunk, together.head):
        part.members[1].load_state_dict(part.members[0].state_dict())
    state = dataset.state(np.arange(40))
    for one, other in zip(together.predict(state), alone[0].predict(state), strict=True):
        assert torch.allclose(one, other, atol=1e-4)


def test_the_papers_parameters_are_the_middle_one_of_three(dataset: Dataset) -> None:
    together, alone = ensemble(PAPER, 3)
    state = dataset.state(np.arange(40))
    powers = torch.stack([model.predict(state)[1][:, 0] for model in alone])
    assert torch.allclose(together.predict(state)[1][:, 0], powers.median(0).values, atol=1e-3)


def test_the_likelihood_of_parameters_is_the_mean_over_members(dataset: Dataset) -> None:
    together, alone = ensemble(MIXTURE, 3)
    rows = np.arange(200)
    state, target = dataset.state(rows), dataset.target(rows)
    likelihood = together.answer(state).log_likelihood(target)
    each = torch.stack([model.answer(state).log_likelihood(target) for model in alone])
    # Of a dash power and direction are averaged apart; a turn has one parameter, a kick's two share their components.
    once = target.kind != 0
    assert torch.allclose(likelihood[once], (each.logsumexp(0) - np.log(3))[once], atol=1e-4)


@CONFIGS
def test_each_member_learns_as_if_alone(dataset: Dataset, config: ModelConfig) -> None:
    together, alone = ensemble(config, 2)
    rows = np.arange(64)
    state, target = dataset.state(rows), dataset.target(rows)
    loss = together.train().loss(together.answer(state), target)
    loss.total.backward()
    totals = []
    for index, model in enumerate(alone):
        single = model.train().loss(model.answer(state), target)
        single.total.backward()
        totals.append(single.total.item())
        mine = (*together.trunk.members[index].parameters(), *together.head.members[index].parameters())
        theirs = (*model.trunk.parameters(), *model.head.parameters())
        for one, other in zip(mine, theirs, strict=True):
            assert torch.allclose(2 * one.grad, other.grad, rtol=1e-4, atol=1e-6)
    assert loss.total.item() == pytest.approx(np.mean(totals), rel=1e-5)


@CONFIGS
def test_the_error_of_the_answer_is_below_that_of_the_members(dataset: Dataset, config: ModelConfig) -> None:
    together, _ = ensemble(config, 4)
    state, target = dataset.state(np.arange(200)), dataset.target(np.arange(200))
    probability = together.predict(state)[0].gather(1, target.kind[:, None])
    with torch.no_grad():
        answer = together.loss(together.answer(state), target)
        members = together.train().loss(together.answer(state), target)
    assert float(answer.cross_entropy) == pytest.approx(float(-probability.log().mean()), rel=1e-5)
    assert answer.cross_entropy < members.cross_entropy


@CONFIGS
def test_one_temperature_for_all(dataset: Dataset, config: ModelConfig) -> None:
    together, _ = ensemble(config, 2)
    state = dataset.state(np.arange(40))
    before = together(state).logits
    together.head.temperature.fill_(2.0)
    assert torch.allclose(together(state).logits, before / 2)
    assert torch.allclose(together.answer(state).raw_logits, before)
