"""Answers are sampled from the distributions whose densities they report."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch
from tests.situations import situations
from torch import Tensor

from teamclone.models.answer import Answer
from teamclone.models.clone import Clone
from teamclone.models.config import EgocentricConfig, ModelConfig, PaperConfig
from teamclone.models.distributions import (
    Mixture,
    angle_terms,
    clipped_terms,
    draw_angle,
    draw_component,
    draw_direction,
    draw_value,
    log_class,
    log_likelihood,
)
from teamclone.models.heads.ensemble import EnsembleAnswer
from teamclone.models.heads.point import POINT_SCALE, PointAnswer
from teamclone.rcss.commands import CLONED, REPERTOIRE, parameters_of
from teamclone.world.state import Target

PAPER = PaperConfig(hidden=(16,), commands=REPERTOIRE)
MIXTURE = EgocentricConfig(
    blocks=("self", "role", "ball"),
    kick_blocks=("ball", "mates"),
    target_points=2,
    target_hidden=(16,),
    parameter_hidden=(16,),
    kick_hidden=(16,),
    hidden=(16,),
    commands=REPERTOIRE,
    kick_attention=0,
    kick_dropout=0.0,
    target_weight=0.0,
)
HEADS = {
    "point": PAPER,
    "point ensemble": replace(PAPER, ensemble_size=3),
    "mixture": MIXTURE,
    "mixture ensemble": replace(MIXTURE, ensemble_size=2),
}
N = 20_000
EVERY = pytest.mark.parametrize("config", HEADS.values(), ids=HEADS.keys())


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def clone_of(config: ModelConfig) -> Clone:
    torch.manual_seed(0)
    model = Clone(config).eval()
    model.inputs.fit([model.inputs.project(situations(50))])
    return model


def answer_to_one(config: ModelConfig, n: int) -> Answer:
    """The answer to ``n`` equal situations."""
    with torch.no_grad():
        model = clone_of(config)
        return model.answer_inputs(model.features(situations(1, seed=3)).expand(n, -1))


def same(logits: list[float], centre: list[float], scale: list[float]) -> Mixture:
    """A mixture for each of N samples."""
    return Mixture(*(torch.tensor([part], dtype=torch.float64).expand(N, -1) for part in (logits, centre, scale)))


def assert_uniform(values: Tensor) -> None:
    """The Kolmogorov-Smirnov distance to the uniform distribution is one that a thousand of a million exceed."""
    ordered = values.double().sort().values
    steps = (torch.arange(len(ordered)) + 0.5) / len(ordered)
    assert float((ordered - steps).abs().max()) < 1.95 / math.sqrt(len(ordered))


def integral_transform(values: Tensor, grid: Tensor, density: Tensor) -> Tensor:
    """What share of the probability lies below each value; ``grid`` has even steps."""
    middle = (density[1:] + density[:-1]) / 2 * (grid[1] - grid[0])
    below = torch.cat([torch.zeros(1), middle.cumsum(0)])
    assert float(below[-1]) == pytest.approx(1, abs=1e-3)
    place = ((values - grid[0]) / (grid[1] - grid[0])).clamp(0, len(grid) - 1.001)
    index = place.long()
    return below[index] + (place - index) * (below[index + 1] - below[index])


def density(parts: Mixture, grid: Tensor, factor: float = 1.0) -> Tensor:
    row = Mixture(*(part[:1].expand(len(grid), -1) for part in parts))
    return log_likelihood(row.logits, angle_terms(row, grid, factor=torch.full_like(grid, factor))).exp()


@EVERY
def test_narrow_intervals_have_the_likelihood_of_numbers(config: ModelConfig) -> None:
    n = 12 * len(REPERTOIRE)
    answer, source = answer_to_one(config, n), generator(5)
    kind = torch.arange(n) % len(REPERTOIRE)
    parameters = 25 * torch.rand(n, 2, generator=source) + 5
    exact = answer.log_likelihood(Target(kind, parameters))
    narrow = answer.log_likelihood(Target(kind, parameters, torch.zeros(n, 2, 2)))
    torch.testing.assert_close(narrow, exact, rtol=1e-3, atol=5e-3)
    unknown = torch.tensor([-math.inf, math.inf]).expand(n, 2, 2)
    nothing = answer.log_likelihood(Target(kind, torch.zeros(n, 2), unknown))
    torch.testing.assert_close(nothing, torch.zeros(n), rtol=0, atol=1e-5)


def test_angles_are_drawn_from_their_density_around_the_circle() -> None:
    parts = same([0.0, 1.0, -1.0], [-3.0, 0.5, 2.0], [0.3, 0.05, 2.5])
    source = generator()
    degrees = draw_angle(parts, draw_component(parts.logits, source), source)
    assert degrees.min() >= -180
    assert degrees.max() <= 180
    grid = torch.linspace(-180, 180, 7_201, dtype=torch.float64)
    assert_uniform(integral_transform(degrees, grid, density(parts, grid)))


def test_turns_of_a_moving_player_are_clipped_as_the_density_counts_them() -> None:
    parts, factor = same([0.0, 0.5], [1.0, 2.4], [0.1, 0.4]), 1.6
    source = generator()
    component = draw_component(parts.logits, source)
    degrees = draw_angle(parts, component, source, factor=torch.full((N,), factor, dtype=torch.float64))
    for bound in (-180.0, 180.0):
        there = float((degrees == bound).double().mean())
        expected = float(density(parts, torch.tensor([bound], dtype=torch.float64), factor))
        assert there == pytest.approx(expected, abs=4 * math.sqrt(max(expected, 1e-4) / N))
    free = degrees[degrees.abs() < 180]
    grid = torch.linspace(-179.95, 179.95, 7_201, dtype=torch.float64)
    inside = density(parts, grid, factor)
    inside = inside / (inside.sum() * (grid[1] - grid[0]))
    assert_uniform(integral_transform(free, grid, inside))


def test_powers_are_clipped_as_the_density_counts_them() -> None:
    parts = same([0.0, 0.0], [3.0, 95.0], [4.0, 6.0])
    source = generator()
    power = draw_value(parts, draw_component(parts.logits, source), source, low=0.0, high=100.0)
    for bound in (0.0, 100.0):
        row = Mixture(*(part[:1] for part in parts))
        value = torch.tensor([bound], dtype=torch.float64)
        expected = float(log_likelihood(row.logits, clipped_terms(row, value, low=0.0, high=100.0)).exp())
        assert expected > 0.1
        assert float((power == bound).double().mean()) == pytest.approx(expected, abs=4 * math.sqrt(expected / N))
    inside = power[(power > 0) & (power < 100)]
    cumulative = sum(torch.sigmoid((inside - centre) / scale) for centre, scale in ((3.0, 4.0), (95.0, 6.0))) / 2
    low, high = (
        sum(1 / (1 + math.exp(-(bound - centre) / scale)) for centre, scale in ((3.0, 4.0), (95.0, 6.0))) / 2
        for bound in (0.0, 100.0)
    )
    assert_uniform((cumulative - low) / (high - low))


def test_directions_are_even_within_their_class() -> None:
    logits = torch.tensor([[0.0, 1.0, -1.0, 0.5]]).expand(N, -1)
    degrees = draw_direction(logits, generator())
    assert degrees.min() >= -180
    assert degrees.max() <= 180
    grid = torch.linspace(-180, 180, 7_201)
    assert_uniform(integral_transform(degrees, grid, log_class(logits[:1].expand(len(grid), -1), grid).exp()))


@EVERY
def test_commands_are_drawn_with_their_calibrated_probabilities(config: ModelConfig) -> None:
    model = clone_of(config)
    model.head.temperature.fill_(1.7)
    with torch.no_grad():
        answer = model.answer_inputs(model.features(situations(1, seed=3)).expand(N, -1))
        target = answer.sample(generator())
    shares = torch.bincount(target.kind, minlength=len(REPERTOIRE)) / N
    expected = answer.probabilities[0]
    assert torch.allclose(answer.logits, answer.raw_logits / 1.7)
    assert ((shares - expected).abs() < 4 * (expected / N).sqrt() + 1e-4).all()
    assert torch.allclose(answer.command_log_likelihood(target.kind).exp(), answer.probabilities[0, target.kind])


@EVERY
def test_samples_follow_from_the_generator_alone(config: ModelConfig) -> None:
    answer = answer_to_one(config, 200)
    first, again, other = (answer.sample(generator(seed)) for seed in (1, 1, 2))
    assert torch.equal(first.kind, again.kind)
    assert torch.equal(first.parameters, again.parameters)
    assert not torch.equal(first.kind, other.kind)


@EVERY
def test_samples_are_what_the_server_takes(config: ModelConfig) -> None:
    target = answer_to_one(config, 4000).sample(generator())
    assert target.parameters.shape == (4000, 2)
    owned = {(of.kind.name.lower(), of.argument): of.limit for of in parameters_of(REPERTOIRE)}
    for index, name in enumerate(REPERTOIRE):
        for argument in (0, 1):
            values = target.parameters[target.kind == index, argument]
            assert (values.abs() <= owned.get((name, argument), 0.0) + 1e-3).all()


@pytest.mark.parametrize("config", [HEADS["mixture"], HEADS["mixture ensemble"]])
@pytest.mark.parametrize("kind", range(len(CLONED)))
def test_log_likelihood_is_the_density_of_the_samples(config: ModelConfig, kind: int) -> None:
    """The mean of 1 / density over samples is the volume that they can fill: here over a box with no clipped value."""
    answer = answer_to_one(config, N)
    kinds = torch.full((N,), kind)
    drawn = answer.draw_parameters(kinds, generator())
    box = {"dash": (90.0, 340.0), "turn": (340.0,), "kick": (90.0, 340.0), "tackle": (340.0,)}[CLONED[kind]]
    uniform = torch.rand(N, 2, generator=generator(1))
    place = torch.zeros(N, 2)
    inside = torch.ones(N, dtype=torch.bool)
    for argument, width in enumerate(box):
        start = 5.0 if width == 90.0 else -170.0
        place[:, argument] = start + width * uniform[:, argument]
        inside &= (drawn[:, argument] >= start) & (drawn[:, argument] <= start + width)
    densities = answer.log_likelihood(Target(kinds, place)).exp()
    volume = math.prod(box)
    expected, error = float(densities.mean()) * volume, float(densities.std()) * volume / math.sqrt(N)
    assert float(inside.float().mean()) == pytest.approx(expected, abs=4 * error + 0.015)


def test_a_point_is_its_own_sample_and_its_density_has_a_fixed_width() -> None:
    answer = answer_to_one(PAPER, 500)
    assert isinstance(answer, PointAnswer)
    assert not answer.has_density
    target = answer.sample(generator())
    point = answer.point().parameters
    for column, of in enumerate(parameters_of(REPERTOIRE)):
        given = target.kind == REPERTOIRE.index(of.kind.name.lower())
        assert torch.equal(target.parameters[given, of.argument], point[given, column])
    turn = torch.full((1,), CLONED.index("turn"))
    degrees = torch.linspace(-180, 180, 3601)[:, None]
    one = answer_to_one(PAPER, 3601)
    likelihood = one.log_likelihood(Target(turn.expand(3601), torch.cat([degrees, 0 * degrees], 1)))
    assert float(likelihood.exp().sum() * 0.1) == pytest.approx(1, abs=1e-3)
    assert float(degrees[likelihood.argmax()]) == pytest.approx(float(point[0, 2]), abs=0.1)
    assert float(likelihood.max()) == pytest.approx(-math.log(POINT_SCALE * 180 * math.sqrt(2 * math.pi)), abs=1e-3)


def test_an_ensemble_draws_parameters_of_each_member() -> None:
    answer = answer_to_one(HEADS["mixture ensemble"], N)
    assert isinstance(answer, EnsembleAnswer)
    kinds = torch.full((N,), CLONED.index("turn"))
    together = answer.draw_parameters(kinds, generator())[:, 0]
    alone = torch.cat([of.draw_parameters(kinds, generator(i))[:, 0] for i, of in enumerate(answer.members)])
    for bound in (-90.0, -30.0, 0.0, 30.0, 90.0):
        shares = [float((values < bound).float().mean()) for values in (together, alone)]
        assert shares[0] == pytest.approx(shares[1], abs=0.02)


@pytest.mark.parametrize("name", ["mixture", "mixture ensemble"])
def test_kicks_that_were_left_out_are_not_drawn(name: str) -> None:
    clone = clone_of(HEADS[name])
    with torch.no_grad():
        answer = clone.answer(situations(4), kick_rows=torch.tensor([1]))
        kinds = torch.stack([answer.sample(generator(seed)).kind for seed in range(300)])
        nobody = clone.answer(situations(4), kick_rows=torch.tensor([], dtype=torch.int64)).sample(generator())
    with_ball = torch.tensor([CLONED.index("kick"), CLONED.index("tackle")])
    on_ball = torch.isin(kinds, with_ball)
    assert on_ball[:, 1].any()
    assert not on_ball[:, [0, 2, 3]].any()
    assert not torch.isin(nobody.kind, with_ball).any()
