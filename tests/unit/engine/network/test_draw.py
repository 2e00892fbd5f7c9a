"""Commands are drawn from an answer as `models.answer.Answer.sample` draws them."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from tests.situations import situations
from tests.unit.engine.network.test_answer import MODELS, varied

from teamclone.engine.network.draw import UNIFORMS
from teamclone.engine.network.network import Network
from teamclone.engine.network.result import Mixture
from teamclone.models.clone import Clone
from teamclone.models.heads.mixture import MixtureAnswer
from teamclone.models.packing import pack
from teamclone.rcss import pitch
from teamclone.rcss.commands import REPERTOIRE, parameters_of

DRAWS = 40_000
NOISE = 5 / math.sqrt(DRAWS)
"""Five standard deviations of a share, at most."""


@cache
def network(name: str) -> tuple[Clone, Network, torch.Tensor]:
    model = varied(MODELS[name])
    with torch.no_grad():
        for weights in model.head.parameters():
            weights.mul_(0.5)  # so that all commands are given
    return model, Network(pack(model)), model.inputs.project(situations(3, seed=2, history=model.inputs.history))


def uniforms(n: int) -> NDArray[np.float64]:
    return np.random.default_rng(3).random((n, UNIFORMS))


def drawn(name: str, row: int = 0) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    _, net, packed = network(name)
    out = np.repeat(net.answers(packed[row : row + 1].numpy()), DRAWS, 0)
    return net.samples(out, uniforms(DRAWS))


def distribution(mixture: Mixture, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Analytic share of values of a mixture below ``at``, before they are clipped."""
    z = (at[:, None] - mixture.centre) / mixture.scale
    share: NDArray[np.float64] = (mixture.share / (1 + np.exp(-np.clip(z, -50, 50)))).sum(1)
    return share


def angles(mixture: Mixture, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Analytic share of angles below ``at`` radians, from -pi on, of bells cut off half a turn to each side."""

    def bell(away: NDArray[np.float64]) -> NDArray[np.float64]:
        return 1 / (1 + np.exp(-np.clip(away / mixture.scale, -50, 50)))

    whole = bell(np.full_like(mixture.centre, math.pi)) - bell(np.full_like(mixture.centre, -math.pi))
    total = np.zeros(len(at))
    for turn in (-2 * math.pi, 0.0, 2 * math.pi):
        low = np.clip(-math.pi + turn - mixture.centre, -math.pi, math.pi)
        high = np.clip(at[:, None] + turn - mixture.centre, -math.pi, math.pi)
        total += (mixture.share * (bell(high) - bell(low)) / whole).sum(1)
    return total


def assert_distributed(values: NDArray[np.float64], at: NDArray[np.float64], share: NDArray[np.float64]) -> None:
    found = (values[:, None] <= at).mean(0)
    assert np.abs(found - share).max() < 5 / math.sqrt(len(values))


def assert_classes(degrees: NDArray[np.float64], shares: NDArray[np.float32]) -> None:
    """Shares of directions, and that they are even within each."""
    step = 360 / len(shares)
    assert (np.abs(degrees) <= 180).all()
    found = np.bincount((np.round(degrees / step).astype(int)) % len(shares), minlength=len(shares)) / len(degrees)
    assert np.abs(found - shares).max() < 5 / math.sqrt(len(degrees))
    within = (degrees / step + 0.5) % 1.0
    assert_distributed(within, np.linspace(0.05, 0.95, 10), np.linspace(0.05, 0.95, 10))


@pytest.mark.parametrize("name", ["relu", "two"])
def test_draws_are_distributed_as_the_answer(name: str) -> None:
    kinds, numbers = drawn(name)
    _, net, packed = network(name)
    answer = net.answer(packed[0].numpy())
    found = np.bincount(kinds, minlength=len(REPERTOIRE)) / DRAWS
    assert np.abs(found - answer.probabilities).max() < NOISE
    assert found.min() > 0.01, "every command is drawn often enough to be looked at"
    of = {command: numbers[kinds == index] for index, command in enumerate(REPERTOIRE)}
    for command, mixture, index in (("dash", answer.dash_power, 0), ("kick", answer.kick_power, 0)):
        values = of[command][:, index]
        assert ((values >= 0) & (values <= 100)).all()
        at = np.linspace(0, 99, 40)  # at 0 all that is clipped
        assert_distributed(values, at, distribution(mixture, at))
    radians = np.linspace(-3, 3, 40)
    assert_distributed(np.radians(of["kick"][:, 1]), radians, angles(answer.kick_direction, radians))
    factor = float(answer.turn_factor[0])
    assert factor > 1.05
    inside = radians[np.abs(radians) * factor < math.pi]
    assert_distributed(np.radians(of["turn"][:, 0]) / factor, inside, angles(answer.turn, inside))
    assert np.abs(of["turn"][:, 0]).max() <= 180
    for command, shares, index in (
        ("dash", answer.dash_direction, 1),
        ("tackle", answer.tackle, 0),
        ("catch", answer.catch, 0),
    ):
        assert_classes(of[command][:, index], shares)
    power, direction = of["dash"].T
    for half in (power < np.median(power), power > np.median(power)):  # one says nothing of the other
        assert_classes(direction[half], answer.dash_direction)
    for mixture, limit, index in ((answer.move_x, pitch.MAX_X, 0), (answer.move_y, pitch.MAX_Y, 1)):
        at = np.linspace(-limit + 0.5, limit - 0.5, 40)
        assert_distributed(of["move"][:, index], at, distribution(mixture, at))
    assert (of["none"] == 0).all()
    assert all((of[command][:, 1] == 0).all() for command in ("turn", "tackle", "catch"))


def test_both_numbers_come_from_one_component() -> None:
    """Draws of PyTorch have the same mean of products, which two independent components would not have."""
    model, _, packed = network("relu")
    kinds, numbers = drawn("relu")
    generator = torch.Generator().manual_seed(4)
    with torch.inference_mode():
        answer = model.answer_inputs(model.inputs.normalise(packed[:1].expand(DRAWS // 4, -1)))
        assert isinstance(answer, MixtureAnswer)
        theirs = answer.sample(generator)
    for command in ("kick", "move"):
        index = REPERTOIRE.index(command)
        mine, other = numbers[kinds == index], theirs.parameters[theirs.kind == index].double().numpy()
        both = [(part[:, 0] - numbers[kinds == index, 0].mean()) * part[:, 1] for part in (mine, other)]
        noise = math.hypot(*(part.std() / math.sqrt(len(part)) for part in both))
        assert abs(both[0].mean() - both[1].mean()) < 5 * noise


def test_no_kick_is_drawn_where_none_was_asked_for() -> None:
    _, net, packed = network("relu")
    out = np.repeat(net.answers(packed[:1].numpy(), with_ball=np.zeros(1, np.bool_)), DRAWS, 0)
    kinds, _ = net.samples(out, uniforms(DRAWS))
    answer = net.view(out[0])
    rest = answer.probabilities.copy()
    rest[[2, 3]] = 0
    found = np.bincount(kinds, minlength=len(REPERTOIRE)) / DRAWS
    assert np.abs(found - rest / rest.sum()).max() < NOISE
    net.answer(packed[0].numpy(), with_ball=False)
    assert net.likeliest() == REPERTOIRE[rest.argmax()]


@pytest.mark.parametrize("name", ["three papers of all commands", "point"])
def test_a_head_that_answers_with_values_draws_commands_alone(name: str) -> None:
    model, net, packed = network(name)
    kinds, numbers = drawn(name, 1)
    answer = net.answer(packed[1].numpy())
    commands = model.config.commands
    found = np.bincount(kinds, minlength=len(commands)) / DRAWS
    assert np.abs(found - answer.probabilities).max() < NOISE
    for index, command in enumerate(commands):
        expected = [0.0, 0.0]
        for item, value in zip(parameters_of(commands), answer.parameters, strict=True):
            if item.kind.name.lower() == command:
                expected[item.argument] = float(value)
        assert (numbers[kinds == index] == expected).all()
    assert net.likeliest() == commands[answer.probabilities.argmax()]


@pytest.mark.parametrize("uniform", [0.0, 0.5, np.nextafter(1.0, 0.0)])
def test_extreme_random_numbers_give_numbers_within_bounds(uniform: float) -> None:
    _, net, packed = network("relu")
    limit = {"dash": (100, 180), "turn": (180, 0), "kick": (100, 180), "tackle": (180, 0), "catch": (180, 0)}
    limit |= {"move": (pitch.MAX_X, pitch.MAX_Y), "none": (0, 0)}
    net.answer(packed[0].numpy())
    for first in np.linspace(0, 1, 50, endpoint=False):
        command, numbers = net.sample(np.array([first, *[uniform] * (UNIFORMS - 1)]))
        assert all(abs(number) <= most for number, most in zip(numbers, limit[command], strict=True))
