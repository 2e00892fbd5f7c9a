"""Models of more commands than four: catch, move and none."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
import torch
from tests.situations import situations
from torch import Tensor
from torch.utils._pytree import tree_map

from teamclone.engine.network.constants import CATCH_DIRECTIONS, CATCH_EDGE_DEG
from teamclone.models.clone import Clone
from teamclone.models.config import EgocentricConfig, ModelConfig, PaperConfig
from teamclone.models.heads.ensemble import EnsembleAnswer
from teamclone.models.heads.mixture import MixtureAnswer, MixtureHead
from teamclone.rcss.commands import CLONED, PARAMETERS, REPERTOIRE, parameters_of
from teamclone.rcss.pitch import MAX_X, MAX_Y
from teamclone.world.channels import CHANNEL
from teamclone.world.state import State, Target

PAPER = PaperConfig(hidden=(16,), commands=REPERTOIRE, parameter_loss="masked")
MIXTURE = EgocentricConfig(
    blocks=("self", "role", "ball", "mode"),
    kick_blocks=("ball", "mates"),
    target_points=2,
    target_hidden=(16,),
    parameter_hidden=(64,),
    kick_hidden=(32,),
    hidden=(64, 32),
    commands=REPERTOIRE,
    kick_attention=0,
    kick_dropout=0.0,
    target_weight=0.0,
)
CATCH, MOVE, NONE = (REPERTOIRE.index(name) for name in ("catch", "move", "none"))


@pytest.fixture(autouse=True)
def _seeded() -> None:
    torch.manual_seed(0)


def fitted(config: ModelConfig, state: State) -> Clone:
    model = Clone(config).eval()
    model.inputs.fit([model.inputs.project(state)])
    return model


def test_parameters_of_commands() -> None:
    names = [item.name for item in parameters_of(REPERTOIRE)]
    assert parameters_of(CLONED) == PARAMETERS
    assert names == [*(item.name for item in PARAMETERS), "catch_direction", "move_x", "move_y"]
    assert [item.name for item in parameters_of((*CLONED, "move", "none"))][6:] == ["move_x", "move_y"]


@pytest.mark.parametrize("config", [PAPER, MIXTURE, replace(PAPER, ensemble_size=3), replace(MIXTURE, ensemble_size=2)])
@pytest.mark.parametrize("further", [("catch",), ("move",), ("none",), ("catch", "move", "none")])
def test_answers_of_any_commands(config: ModelConfig, further: tuple[str, ...]) -> None:
    state = situations(9)
    model = fitted(replace(config, commands=(*CLONED, *further)), state)
    probabilities, parameters = model.predict(state)
    assert probabilities.shape == (9, 4 + len(further))
    assert probabilities.sum(1).tolist() == pytest.approx([1] * 9)
    limits = torch.tensor([item.limit for item in parameters_of(model.config.commands)])
    assert parameters.shape == (9, len(limits))
    assert (parameters.abs() <= limits + 1e-3).all()
    alone = model.predict(state.select(slice(4, 5)))
    for one, whole in zip(alone, (probabilities, parameters), strict=True):
        assert torch.allclose(one[0], whole[4], atol=1e-2, rtol=1e-3)


def repeated(answer: Any, n: int) -> MixtureAnswer:
    """The answer to one situation as that to ``n`` equal ones."""
    alone = answer.merged if isinstance(answer, EnsembleAnswer) else answer
    every = tree_map(lambda of: None if of is None else of.expand(n, *of.shape[1:]), alone.distribution)
    return MixtureAnswer(every, alone.temperature)


def likelihoods(model: Clone, kind: int, first: Tensor, second: Tensor) -> Tensor:
    """(n,) of arguments of a command in one situation, in double precision."""
    with torch.no_grad():
        output = repeated(model.answer(situations(1, seed=3)), len(first))
        target = Target(torch.full((len(first),), kind), torch.stack([first, second], 1).float())
        likelihood: Tensor = output.log_likelihood(target).double().exp()
    return likelihood


@pytest.mark.parametrize("members", [1, 2])
def test_catch_directions_make_up_one(members: int) -> None:
    model = fitted(replace(MIXTURE, ensemble_size=members), situations(50))
    degrees = torch.arange(-179.75, 180, 0.5)  # none between two classes
    with torch.no_grad():
        output = model.answer(situations(1, seed=3))
        many = repeated(output, len(degrees))
        target = Target(torch.full((len(degrees),), CATCH), torch.stack([degrees, 0 * degrees], 1))
        assert float(many.log_likelihood(target).exp().sum() * 0.5) == pytest.approx(1, abs=1e-4)


def test_places_of_a_move_make_up_one() -> None:
    model = fitted(MIXTURE, situations(50))
    step = 0.5
    x, y = torch.arange(-MAX_X + step / 2, MAX_X, step), torch.arange(-MAX_Y + step / 2, MAX_Y, step)
    inside = torch.cartesian_prod(x, y)
    total = float(likelihoods(model, MOVE, *inside.T).sum()) * step**2
    # What the server clips: along each side, and in the corners.
    for bound in (-1.0, 1.0):
        total += float(likelihoods(model, MOVE, torch.full_like(y, bound * MAX_X), y).sum()) * step
        total += float(likelihoods(model, MOVE, x, torch.full_like(x, bound * MAX_Y)).sum()) * step
        for other in (-1.0, 1.0):
            corner = torch.tensor([bound * MAX_X]), torch.tensor([other * MAX_Y])
            total += float(likelihoods(model, MOVE, *corner))
    assert total == pytest.approx(1, abs=2e-3)


def test_nothing_has_no_parameters() -> None:
    model = fitted(MIXTURE, situations(50))
    assert likelihoods(model, NONE, torch.tensor([0.0]), torch.tensor([0.0])).tolist() == [1.0]


def target_of(state: State) -> Target:
    """Commands in turn; a player moves to a place of his number, catches go to an edge of the ball."""
    n = len(state.ball)
    kind = torch.arange(n) % len(REPERTOIRE)
    number = state.actor.float()
    first = torch.stack([0 * number + 50] * 4 + [9 * (number - 5), -4 * number, 0 * number], 1)
    second = torch.stack([0 * number] * 5 + [3 * number - 15, 0 * number], 1)
    return Target(kind, torch.stack([first, second], 2)[torch.arange(n), kind])


@pytest.mark.parametrize("config", [PAPER, MIXTURE], ids=["paper", "mixture"])
def test_further_commands_are_learned(config: ModelConfig) -> None:
    state = situations(70)
    model = fitted(replace(config, hidden=(128, 64)), state)
    inputs, target = model.features(state), target_of(state)
    optimiser = torch.optim.Adam(model.parameters(), lr=3e-3)
    for _ in range(120):
        loss = model.loss(model.answer_inputs(inputs), target)
        optimiser.zero_grad()
        loss.total.backward()
        optimiser.step()
    with torch.no_grad():
        prediction = model(state)
    assert torch.equal(prediction.logits.argmax(1), target.kind)
    items = parameters_of(REPERTOIRE)
    for column, bound in ((6, 20.0), (7, 5.0), (8, 5.0)):
        rows = target.kind == REPERTOIRE.index(items[column].kind.name.lower())
        error = prediction.parameters[rows, column] - target.parameters[rows, items[column].argument]
        assert error.abs().median() < bound, items[column].name


def test_every_weight_of_further_commands_learns() -> None:
    state = situations(70)
    model = fitted(MIXTURE, state)
    model.loss(model.answer(state), target_of(state)).total.backward()
    for name, weights in model.head.named_parameters():
        if name.split(".")[0] in ("catch", "catch_edges", "catch_sharpness", "move"):
            assert weights.grad is not None, name
            assert weights.grad.isfinite().all(), name
            assert weights.grad.abs().max() > 0, name


@pytest.mark.parametrize(("bearing", "expected"), [(0, 22.6), (60, 82.6), (-50, 72.6), (120, 90), (170, 90)])
def test_a_catch_has_the_ball_at_an_edge_of_its_area(bearing: float, expected: float) -> None:
    """An untaught head says the edges alone; the server clips at 90 degrees."""
    state = situations(1)
    model = fitted(MIXTURE, situations(50))
    assert isinstance(model.head, MixtureHead)
    assert model.head.catch is not None
    torch.nn.init.zeros_(model.head.catch.weight)
    me = state.players[0, state.actor[0]]
    me[CHANNEL["body"]] = 30.0
    angle = math.radians(30 + bearing)
    state.ball[0, :2] = me[:2] + torch.tensor([math.cos(angle), math.sin(angle)])
    with torch.no_grad():
        catch = model.answer(state).distribution.catch
    shares = torch.softmax(catch, 1)[0]
    width = 360 / CATCH_DIRECTIONS
    degrees = torch.arange(CATCH_DIRECTIONS) * width
    degrees = torch.where(degrees > 180, degrees - 360, degrees)
    likely = degrees[shares > 0.6 * shares.max()]
    edges = torch.tensor([bearing - CATCH_EDGE_DEG, bearing + CATCH_EDGE_DEG])
    edges = (torch.remainder(edges + 180, 360) - 180).clamp(-90, 90)
    assert (likely[:, None] - edges).abs().amin(1).max() < width
    assert ((likely.abs() - expected).abs() < width).any()


def test_the_papers_parameters_of_a_move_are_bounded_by_the_pitch() -> None:
    model = Clone(PAPER)
    with torch.no_grad():
        model.head.parameter.weight.mul_(1000)
    _, parameters = model.predict(situations(50))
    assert parameters.abs().amax(0).tolist() == pytest.approx([100, 180, 180, 100, 180, 180, 180, MAX_X, MAX_Y])


class Exported(torch.nn.Module):
    """From the tensors of a state, the play mode among them, to the single best answer."""

    def __init__(self, model: Clone) -> None:
        super().__init__()
        self.model = model

    def forward(self, *state: Tensor) -> tuple[Tensor, Tensor]:
        names = ("ball", "players", "types", "actor", "mode", "mode_cycles")
        logits, parameters = self.model(State.now(**dict(zip(names, state, strict=True))))
        return logits, parameters


def test_a_model_of_all_commands_can_be_exported() -> None:
    def inputs(n: int) -> tuple[Tensor, ...]:
        state = situations(n, seed=n)
        return (state.ball, state.players, state.types, state.actor, state.mode, state.mode_cycles)

    model = Exported(fitted(MIXTURE, situations(50)))
    batch = torch.export.Dim("batch", min=1)
    exported = torch.export.export(model, inputs(3), dynamic_shapes=(({0: batch},) * 6,)).module()
    for n in (1, 3, 17):
        for one, other in zip(exported(*inputs(n)), model(*inputs(n)), strict=True):
            assert torch.allclose(one, other, atol=1e-2)
