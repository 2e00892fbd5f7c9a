from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest
import torch
from tests.situations import situations
from torch import Tensor

from teamclone.engine.inputs.layout import BLOCKS
from teamclone.engine.network.constants import ACTIVATIONS
from teamclone.models.answer import Answer
from teamclone.models.clone import LEAST_KICK_DEVIATION, Clone, EgocentricTrunk, Trunks, parameter_count
from teamclone.models.config import EgocentricConfig, EgocentricPointConfig, ModelConfig, PaperConfig
from teamclone.models.heads.mixture import with_ball
from teamclone.models.loss import Balance, Loss
from teamclone.rcss.commands import CLONED_KINDS, PARAMETERS, CommandKind
from teamclone.rcss.player_types import FIELDS
from teamclone.training.config import load_config
from teamclone.world.channels import CHANNEL
from teamclone.world.state import State, Target


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
    assert parameter_count(Clone(PaperConfig())) == layers(119, 512, 256, 128) + heads
    assert parameter_count(Clone(PaperConfig(own_type=True))) == layers(127, 512, 256, 128) + heads
    assert parameter_count(Clone(PaperConfig(hidden=(32,)))) == layers(119, 32) + 33 * 10


def test_answers_are_probabilities_and_bounded_parameters() -> None:
    model = Clone(PaperConfig())
    with torch.no_grad():
        model.head.parameter.weight.mul_(1000)
    probabilities, parameters = model.predict(random_state(50))
    assert probabilities.shape == (50, 4)
    assert probabilities.sum(1).tolist() == pytest.approx([1] * 50)
    limits = torch.tensor([100.0, 180.0, 180.0, 100.0, 180.0, 180.0])
    assert parameters.abs().amax(0).tolist() == pytest.approx(limits.tolist())


def test_rows_do_not_depend_on_each_other() -> None:
    model = Clone(PaperConfig())
    state = random_state(17)
    whole = model.predict(state)
    for row in (0, 16):
        alone = model.predict(state.select(slice(row, row + 1)))
        for one, all_ in zip(alone, whole, strict=True):
            assert torch.allclose(one[0], all_[row], atol=1e-2, rtol=1e-3)


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_every_activation_changes_the_answer(activation: str) -> None:
    state = random_state(4)
    answers = []
    for name in ("relu", activation):
        torch.manual_seed(0)
        answers.append(Clone(PaperConfig(activation=name)).predict(state)[0])
    assert torch.equal(*answers) == (activation == "relu")


def test_overfits_sixty_four_samples() -> None:
    model = Clone(PaperConfig())
    state = random_state(64)
    kind = torch.randint(0, 4, (64,))
    limits = torch.tensor([[100.0, 180.0], [180.0, 0.0], [100.0, 180.0], [180.0, 0.0]])
    target = Target(kind=kind, parameters=(torch.rand(64, 2) * 1.6 - 0.8) * limits[kind])
    model.inputs.fit([model.inputs.project(state)])
    optimiser = torch.optim.Adam(model.parameters(), lr=1e-3)
    for _ in range(200):
        loss = model.loss(model.answer(state), target)
        optimiser.zero_grad()
        loss.total.backward()
        optimiser.step()
    prediction = model(state)
    assert torch.equal(prediction.logits.argmax(1), kind)
    assert loss.parameters.item() < 1e-3


RELATIVE = EgocentricConfig(
    blocks=("self", "role", "type", "ball", "reach", "lines"),
    kick_blocks=("self", "last", "ball", "mates", "opponents"),
    target_points=4,
    target_hidden=(32,),
    parameter_hidden=(64,),
    kick_hidden=(64,),
    hidden=(128, 64),
    kick_attention=0,
    kick_dropout=0.0,
    target_weight=0.0,
)
SMALL = replace(RELATIVE, hidden=(16,), parameter_hidden=(16,), kick_hidden=(16,), target_hidden=(8,))
MODELS = {
    "mixture": SMALL,
    "no target points": replace(SMALL, target_points=0, target_hidden=()),
    "one target point": replace(SMALL, target_points=1),
    "no kick blocks": replace(SMALL, kick_blocks=()),
    "no role": replace(SMALL, blocks=("ball",)),
    "point": EgocentricPointConfig(
        blocks=RELATIVE.blocks, target_points=4, target_hidden=(8,), hidden=(16,), parameter_loss="paper"
    ),
    "past": replace(SMALL, blocks=("self", "past")),
    "attention": replace(SMALL, kick_attention=8),
    "plan": replace(SMALL, kick_attention=8, kick_blocks=("ball", "plan")),
    "all": replace(SMALL, blocks=BLOCKS, kick_blocks=BLOCKS, kick_attention=4, dropout=0.2, kick_dropout=0.2),
}


@pytest.mark.parametrize("config", MODELS.values(), ids=MODELS)
def test_egocentric_models_answer_alike_alone_and_in_batches(config: ModelConfig) -> None:
    model = Clone(config).eval()
    state = situations(17, history=model.inputs.history)
    model.inputs.fit([model.inputs.project(state)])
    probabilities, parameters = model.predict(state)
    assert probabilities.sum(1).tolist() == pytest.approx([1] * 17)
    assert parameters.isfinite().all()
    limits = torch.tensor([100.0, 180.0, 180.0, 100.0, 180.0, 180.0])
    assert (parameters.abs() <= limits + 1e-3).all()
    if isinstance(config, EgocentricConfig):
        assert (parameters[:, [0, 3]] >= 0).all()
    for rows in (slice(0, 1), slice(16, 17), slice(4, 7)):
        part = model.predict(state.select(rows))
        for one, whole in zip(part, (probabilities, parameters), strict=True):
            assert torch.allclose(one, whole[rows], atol=1e-2, rtol=1e-3)


def test_kicks_are_decided_on_their_own_blocks() -> None:
    model = Clone(SMALL)
    state = situations(20)
    model.inputs.fit([model.inputs.project(state)])
    other = state._replace(players=state.players.clone())
    # What he did last is among the blocks of a kick only, whom he can see among none.
    other.players[..., CHANNEL["last_command"]] = (state.players[..., CHANNEL["last_command"]] + 1) % 5
    other.players[..., CHANNEL["neck"]] += 20
    (logits, before), (other_logits, after) = model(state), model(other)
    assert torch.equal(logits, other_logits)
    assert torch.equal(before[:, :3], after[:, :3])
    assert not torch.equal(before[:, 3:5], after[:, 3:5])
    for one, two in zip(model.answer(state).distribution.kick, model.answer(other).distribution.kick, strict=True):
        assert not torch.equal(one.tackle, two.tackle)


def kick_logits(model: Clone, state: State) -> Tensor:
    logits: Tensor = model.answer(state).distribution.kick[0].power.logits
    return logits


def test_dropout_is_for_training_only() -> None:
    state = situations(5)
    plain, kicks = Clone(replace(SMALL, dropout=0.5)), Clone(replace(SMALL, kick_dropout=0.5))
    for model, of_command, of_kick in ((plain, True, False), (kicks, False, True)):
        assert torch.equal(model(state).logits, model(state).logits) != of_command
        assert torch.equal(kick_logits(model, state), kick_logits(model, state)) != of_kick
        model.eval()
        assert torch.equal(model(state).logits, model(state).logits)
        assert torch.equal(kick_logits(model, state), kick_logits(model, state))


def likely_target(state: State) -> Target:
    """Commands as agents of the league give them: powers at their bound, clipped turns, directions in steps."""
    n = len(state.ball)
    kind = torch.arange(n) % 4
    power = torch.where(torch.rand(n) < 0.5, 100.0, torch.rand(n) * 99)
    moment = (torch.rand(n) * 400 - 200).clamp(-180, 180)
    direction = torch.rand(n) * 360 - 180
    first = torch.stack([power, moment, power, (direction / 9).round() * 9], 1)
    second = torch.stack([(direction / 15).round() * 15, torch.zeros(n), direction, torch.zeros(n)], 1)
    both = torch.stack([first, second], 2)
    return Target(kind, both[torch.arange(n), kind])


def test_a_mixture_overfits_sixty_four_samples() -> None:
    model = Clone(RELATIVE)
    state = situations(64)
    target = likely_target(state)
    model.inputs.fit([model.inputs.project(state)])
    inputs = model.features(state)
    optimiser = torch.optim.Adam(model.parameters(), lr=5e-3)
    likelihoods = []
    for _ in range(120):
        loss = model.loss(model.answer_inputs(inputs), target)
        optimiser.zero_grad()
        loss.total.backward()
        optimiser.step()
        likelihoods.append(-loss.parameters.item())
    assert likelihoods[-1] > likelihoods[0] + 4
    with torch.no_grad():
        prediction = model(state)
    assert torch.equal(prediction.logits.argmax(1), target.kind)
    away = []
    for parameter, values in zip(PARAMETERS, prediction.parameters.T, strict=True):
        rows = target.kind == CLONED_KINDS.index(parameter.kind)
        error = values[rows] - target.parameters[rows, parameter.argument]
        error = torch.remainder(error + 180, 360) - 180 if parameter.angle else error
        away.append(float(error.abs().median()))
    # Directions of dashes and tackles are classes; the others come near.
    assert away == pytest.approx([0, 0, 0, 0, 0, 0], abs=5)
    assert (away[1], away[5]) == pytest.approx((0, 0), abs=1e-3)


def test_every_weight_of_the_mixture_learns() -> None:
    model = Clone(RELATIVE)
    state = situations(64)
    model.inputs.fit([model.inputs.project(state)])
    model.loss(model.answer(state), likely_target(state)).total.backward()
    for name, weights in model.named_parameters():
        assert weights.grad is not None, name
        assert weights.grad.isfinite().all(), name
        assert weights.grad.abs().max() > 0, name


def taught(loss: Tensor, model: Clone) -> set[str]:
    """Which parts of a model, two levels deep, the gradient of an error reaches."""
    names, weights = zip(*model.named_parameters(), strict=True)
    gradients = torch.autograd.grad(loss, weights, allow_unused=True, retain_graph=True)
    reached = [name for name, gradient in zip(names, gradients, strict=True) if gradient is not None and gradient.any()]
    return {".".join(name.split(".")[:2]) for name in reached}


def test_parameters_teach_neither_the_layers_of_the_command_nor_the_aims() -> None:
    model = Clone(RELATIVE)
    state = situations(64)
    target = likely_target(state)
    model.inputs.fit([model.inputs.project(state)])
    output = model.answer(state)
    by_kind = {
        CommandKind.DASH: {"trunk.parameters_of", "head.dash", "head.incomes", "head.powers"},
        CommandKind.TURN: {"trunk.parameters_of", "head.turn"},
        CommandKind.KICK: {"trunk.kick", "head.kick"},
        CommandKind.TACKLE: {"trunk.kick", "head.tackle"},
    }
    likelihood = output.log_likelihood(target)
    for index, kind in enumerate(CLONED_KINDS):
        assert taught(likelihood[target.kind == index].sum(), model) == by_kind[kind]
    loss = model.loss(output, target)
    assert taught(loss.parameters, model) == set.union(*by_kind.values())
    assert taught(loss.cross_entropy, model) == {"trunk.targets", "trunk.command", "head.command"}


def test_turns_teach_the_target_points_and_nothing_else_by_their_own_density() -> None:
    model = Clone(RELATIVE)
    state = situations(64)
    target = likely_target(state)
    model.inputs.fit([model.inputs.project(state)])
    output = model.answer(state)

    def loss_of(answer: Answer, target: Target, *, targets: float, balance: Balance | None = None) -> Loss:
        model.head.target_weight = targets
        return model.loss(answer, target, balance=balance)

    plain, aimed = (loss_of(output, target, targets=weight) for weight in (0.0, 0.5))
    assert aimed.parameters == plain.parameters
    assert aimed.total > plain.total
    nothing_else = Balance(weight=torch.zeros(4), shift=torch.zeros(4))
    model.head.parameter_weight = 0.0
    alone = loss_of(output, target, targets=0.5, balance=nothing_else)
    model.head.parameter_weight = 1.0
    assert alone.total.item() == pytest.approx((aimed.total - plain.total).item(), rel=1e-4)
    assert taught(alone.total, model) == {"trunk.targets"}
    turns = target.kind == CLONED_KINDS.index(CommandKind.TURN)
    without = Target(target.kind[~turns], target.parameters[~turns])
    others = model.answer(state.select(~turns))
    assert loss_of(others, without, targets=0.5).total == loss_of(others, without, targets=0.0).total


@pytest.mark.parametrize(
    "config",
    [replace(SMALL, target_weight=0.3), replace(SMALL, ensemble_size=2), MODELS["plan"]],
    ids=("one", "two", "plan"),
)
def test_kicks_may_be_answered_where_they_are_asked_for(config: ModelConfig) -> None:
    """What is asked for is the same, and the rest of the answer, too."""
    model = Clone(config).eval()
    state = situations(40)
    target = likely_target(state)
    model.inputs.fit([model.inputs.project(state)])
    inputs = model.features(state)
    rows = with_ball(target)
    assert rows.tolist() == [row for row in range(40) if row % 4 >= 2]
    with torch.no_grad():
        whole, asked = model.answer_inputs(inputs), model.answer_inputs(inputs, kick_rows=rows)
        likelihoods = [output.log_likelihood(target) for output in (whole, asked)]
        losses = [torch.stack(model.loss(output, target)) for output in (whole, asked)]
        points = [output.point() for output in (whole, asked)]
    torch.testing.assert_close(*likelihoods, atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(*losses, atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(points[0].logits, points[1].logits)
    torch.testing.assert_close(points[0].parameters[rows], points[1].parameters[rows], atol=1e-2, rtol=1e-3)
    others = [row for row in range(40) if row % 4 < 2]
    torch.testing.assert_close(points[0].parameters[others, :3], points[1].parameters[others, :3])
    assert (points[0].parameters[others, 3:] != 0).any()
    assert (points[1].parameters[others, 3:] == 0).all()


@pytest.mark.parametrize("config", [SMALL, MODELS["plan"]], ids=("free", "plan"))
def test_a_batch_without_kicks_learns(config: ModelConfig) -> None:
    model = Clone(config)
    state = situations(12)
    target = likely_target(state)._replace(kind=torch.arange(12) % 2)
    model.inputs.fit([model.inputs.project(state)])
    loss = model.loss(model.answer_inputs(model.features(state), kick_rows=with_ball(target)), target)
    whole = model.loss(model.answer(state), target)
    assert loss.total.item() == pytest.approx(whole.total.item(), rel=1e-4)
    loss.total.backward()
    for name, weights in model.named_parameters():
        assert weights.grad is not None, name
        assert weights.grad.isfinite().all(), name


class Exported(torch.nn.Module):
    """From the tensors of a state to the single best answer."""

    def __init__(self, model: Clone) -> None:
        super().__init__()
        self.model = model

    def forward(self, ball: Tensor, players: Tensor, types: Tensor, actor: Tensor) -> tuple[Tensor, Tensor]:
        logits, parameters = self.model(State.now(ball=ball, players=players, types=types, actor=actor))
        return logits, parameters


@pytest.mark.parametrize("candidates", [0, 8])
def test_the_preset_best_can_be_exported_for_any_batch(candidates: int) -> None:
    model = Exported(Clone(load_config("best", [f"model.kick_candidates={candidates}"]).model).eval())
    batch = torch.export.Dim("batch", min=1)

    def tensors(n: int) -> tuple[Tensor, ...]:
        state = situations(n, seed=n)
        return state.ball, state.players, state.types, state.actor

    exported = torch.export.export(model, tensors(3), dynamic_shapes=({0: batch},) * 4).module()
    for n in (1, 3, 17):
        for one, other in zip(exported(*tensors(n)), model(*tensors(n)), strict=True):
            assert one.shape[0] == n
            assert torch.allclose(one, other, atol=1e-2)


@pytest.mark.parametrize("members", [1, 2])
def test_inputs_of_kicks_are_normalised_among_kicks(members: int) -> None:
    """Where the others have the ball far away, inputs near it would hardly differ."""
    model = Clone(replace(RELATIVE, ensemble_size=members))
    every = model.inputs.project(situations(200, seed=1))
    model.fit([every], [every[:30], every[30:50]])
    trunks = model.trunk.members if isinstance(model.trunk, Trunks) else [model.trunk]
    assert len(trunks) == members
    for trunk in trunks:
        assert isinstance(trunk, EgocentricTrunk)
        columns = trunk.of_kicks(model.inputs.normalise(every[:50]).index_select(1, trunk.kick_columns))
        plain = trunk.signs[trunk.kick_columns] > 0
        told_apart = plain & (trunk.of_kicks.std > LEAST_KICK_DEVIATION) & (columns.std(0) > 0)
        assert told_apart.sum() > 20
        assert columns[:, told_apart].mean(0).abs().max() < 1e-4
        assert (columns[:, told_apart].std(0, correction=0) - 1).abs().max() < 1e-4
        # What changes its sign in the mirror is not shifted.
        assert (trunk.of_kicks.mean[~plain] == 0).all()


def test_without_kicks_their_inputs_stay_as_they_are() -> None:
    model = Clone(RELATIVE)
    model.fit([model.inputs.project(situations(20, seed=1))])
    assert isinstance(model.trunk, EgocentricTrunk)
    assert (model.trunk.of_kicks.std == 1).all()
