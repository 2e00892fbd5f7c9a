"""The kernels answer as the modules of PyTorch do, of every family."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from tests.situations import situations
from tests.synthetic import make_dataset

from teamclone.dataset.reader import open_dataset
from teamclone.engine.inputs.layout import BLOCKS
from teamclone.engine.network.constants import ACTIVATIONS, MEDOID_COMPONENTS
from teamclone.engine.network.network import Network
from teamclone.engine.network.result import Mixture
from teamclone.models import distributions
from teamclone.models.clone import Clone
from teamclone.models.config import EgocentricConfig, EgocentricPointConfig, ModelConfig, PaperConfig
from teamclone.models.heads.ensemble import EnsembleAnswer
from teamclone.models.heads.mixture import KickAnswer, MixtureAnswer
from teamclone.models.packing import pack
from teamclone.rcss import pitch
from teamclone.rcss.commands import CLONED, REPERTOIRE, parameters_of
from teamclone.training.config import load_config
from teamclone.training.loop import train
from teamclone.training.run import open_run

Values = NDArray[np.float64]

PAPER = PaperConfig(hidden=(24, 16))
POINT = EgocentricPointConfig(blocks=("self", "role", "ball"), target_points=3, target_hidden=(8,), hidden=(24, 16))
MIXTURE = EgocentricConfig(
    blocks=("self", "role", "ball", "lines"),
    kick_blocks=("self", "ball", "reach"),
    target_points=4,
    target_hidden=(16, 8),
    parameter_hidden=(24,),
    kick_hidden=(24, 16),
    hidden=(32, 16),
    kick_attention=0,
)
FULL = replace(MIXTURE, kick_attention=8, kick_blocks=("self", "ball", "plan"), commands=REPERTOIRE)
MODELS: dict[str, ModelConfig] = {
    "paper": PAPER,
    "paper of all inputs and commands": replace(PAPER, own_type=True, all_types=("kick",), commands=REPERTOIRE),
    "two papers": replace(PAPER, ensemble_size=2),
    "three papers of all commands": replace(PAPER, ensemble_size=3, commands=REPERTOIRE),
    "point": POINT,
    "point without targets": replace(POINT, target_points=0, target_hidden=()),
    "two points": replace(POINT, ensemble_size=2),
    "mixture": MIXTURE,
    "no targets": replace(MIXTURE, target_points=0, target_hidden=()),
    "one target, no role": replace(MIXTURE, target_points=1, target_hidden=(), blocks=("ball",)),
    "no kick blocks": replace(MIXTURE, kick_blocks=()),
    "plan": replace(MIXTURE, kick_blocks=("ball", "plan")),
    "plan of the command alone": replace(MIXTURE, blocks=("ball", "plan"), kick_attention=4),
    "attention": replace(MIXTURE, kick_attention=16),
    "candidates": replace(MIXTURE, kick_attention=4, kick_candidates=8),
    "candidates without attention": replace(MIXTURE, kick_candidates=3),
    "catch": replace(MIXTURE, commands=(*CLONED, "catch")),
    "move": replace(MIXTURE, commands=(*CLONED, "move", "none")),
    "all": replace(FULL, blocks=BLOCKS, kick_blocks=BLOCKS, kick_candidates=8),
    "two": replace(FULL, ensemble_size=2),
    "five, more components than a median is looked for among": replace(FULL, ensemble_size=5),
    **{name: replace(FULL, activation=name) for name in ACTIVATIONS},
}
ENOUGH = 2e-5
"""Of the range of a number: two ways to add numbers in single precision come as near to each other."""
RANGE = {
    **dict.fromkeys(("dash_power", "kick_power"), 100.0),
    **dict.fromkeys(("turn", "kick_direction"), math.pi),
    **{"move_x": pitch.MAX_X, "move_y": pitch.MAX_Y},
}


def varied(config: ModelConfig, *, seed: int = 0) -> Clone:
    """A model all of whose weights say something, fitted to made situations."""
    torch.manual_seed(seed)
    model = Clone(config).eval()
    with torch.no_grad():
        for weights in model.parameters():
            weights.add_(0.1 * torch.randn_like(weights))
        model.head.temperature.fill_(1.3)
    every = model.inputs.project(situations(300, history=model.inputs.history))
    model.fit([every], [every[::3], every[1::3]])
    return model


def asked(model: Clone, packed: torch.Tensor, rows: torch.Tensor | None = None) -> tuple[dict[str, Values], Values]:
    """The parts of PyTorch's answer by their names in `result.Answer`, and the single best parameters."""
    with torch.inference_mode():
        whole = model.answer_inputs(model.inputs.normalise(packed), kick_rows=rows)
        answer = whole.merged if isinstance(whole, EnsembleAnswer) else whole
        parts = {"logits": answer.logits, "probabilities": answer.probabilities}
        if isinstance(answer, MixtureAnswer):
            of = answer.distribution
            kick = mean_kick(of.kick)
            parts |= {"dash_direction": of.dash_direction.softmax(1), "tackle": kick.tackle.softmax(1)}
            parts |= {"turn_factor": of.turn_factor[:, None]}
            mixtures = {"dash_power": of.dash_power, "turn": of.turn}
            mixtures |= {"kick_power": kick.power, "kick_direction": kick.direction}
            if of.catch is not None:
                parts["catch"] = of.catch.softmax(1)
            if of.move is not None:
                mixtures |= {"move_x": of.move.x, "move_y": of.move.y}
            for name, mixture in mixtures.items():
                parts |= {f"{name}.share": mixture.logits.softmax(1)}
                parts |= {f"{name}.{field}": getattr(mixture, field) for field in ("centre", "scale")}
        return {name: values.double().numpy() for name, values in parts.items()}, whole.point().parameters.numpy()


def mean_kick(kicks: tuple[KickAnswer, ...]) -> KickAnswer:
    return KickAnswer(
        distributions.merged([kick.power for kick in kicks]),
        distributions.merged([kick.direction for kick in kicks]),
        distributions.mean_logits([kick.tackle for kick in kicks]),
    )


def answered(network: Network, packed: torch.Tensor, with_ball: NDArray[np.bool_] | None = None) -> dict[str, Values]:
    """The parts of the kernels' answer by their names."""
    views = [network.view(row) for row in network.answers(packed.numpy(), with_ball=with_ball)]
    parts: dict[str, Values] = {}
    for name in views[0]._fields:
        values = [getattr(view, name) for view in views]
        if isinstance(values[0], Mixture):
            parts |= {f"{name}.{of}": np.stack([getattr(one, of) for one in values]) for of in Mixture._fields}
        else:
            parts[name] = np.stack(values)
    return {name: values.astype(np.float64) for name, values in parts.items()}


def assert_alike(made: dict[str, Values], expected: dict[str, Values], rows: slice | Values = slice(None)) -> None:
    for name, values in expected.items():
        parameter, _, field = name.partition(".")
        away = np.abs(made[name][rows] - values)
        if RANGE.get(parameter) == math.pi and field == "centre":
            away = np.minimum(away, 2 * math.pi - away)
        size = RANGE[parameter] if field == "centre" else 1.0
        assert (away <= ENOUGH * np.maximum(size, np.abs(values))).all(), (name, away.max())


def cost(made: dict[str, Values], name: str, values: Values) -> Values:
    """(n,) the expected distance of values to a parameter, in its range: what its median makes least.

    A median is that of the components with the greatest shares.
    """
    limit = RANGE[name]
    centre = made[f"{name}.centre"]
    if name.endswith("power"):
        centre = centre.clip(0, limit)
    away = np.abs(centre - values[:, None])
    if limit == math.pi:
        away = np.minimum(away, 2 * math.pi - away)
    share = made[f"{name}.share"]
    if share.shape[1] > MEDOID_COMPONENTS:
        main = np.argsort(-share, axis=1, kind="stable")[:, :MEDOID_COMPONENTS]
        share, away = np.take_along_axis(share, main, 1), np.take_along_axis(away, main, 1)
    result: Values = (share * away).sum(1) / limit
    return result


def assert_same_point(made: dict[str, Values], point: Values, commands: tuple[str, ...]) -> None:
    """Equal but where two components are equally near to all others but for rounding, and rarely so."""
    limits = np.array([item.limit for item in parameters_of(commands)])
    away = np.abs(made["parameters"] - point) / limits
    differs = away > ENOUGH
    angle = np.array([item.angle for item in parameters_of(commands)])
    differs &= ~(angle & (np.abs(away - 2) < ENOUGH))
    if "dash_power.share" not in made:
        assert not differs.any(), away.max(0)
        return
    assert differs.mean() < 0.01, differs.mean(0)
    for index, name in ((0, "dash_power"), (3, "kick_power"), (4, "kick_direction")):
        unit = math.pi / 180 if index == 4 else 1.0
        both = [cost(made, name, values[:, index] * unit) for values in (made["parameters"], point)]
        assert np.abs(both[0] - both[1]).max() < ENOUGH, name
    # The others are classes, and those of turns are cut off: no ties but by chance.
    assert not differs[:, [1, 5]].any()


@pytest.mark.parametrize("config", MODELS.values(), ids=MODELS)
def test_all_of_an_answer_is_that_of_pytorch(config: ModelConfig) -> None:
    model = varied(config)
    packed = model.inputs.project(situations(60, seed=5, history=model.inputs.history))
    network = Network(pack(model))
    assert network.commands == config.commands
    expected, point = asked(model, packed)
    made = answered(network, packed)
    assert (made["asked"] == 1).all()
    assert_alike(made, expected)
    assert_same_point(made, point, config.commands)
    lacking = {name for name, values in made.items() if not values.size}
    assert {name.partition(".")[0] for name in set(made) - set(expected) - lacking} == {"parameters", "asked"} | (
        set() if isinstance(config, EgocentricConfig) else {"turn_factor"}
    )


@pytest.mark.parametrize("name", ["mixture", "attention", "all", "two"])
def test_kicks_are_answered_where_they_are_asked_for(name: str) -> None:
    model = varied(MODELS[name])
    packed = model.inputs.project(situations(30, seed=6, history=model.inputs.history))
    rows = torch.arange(0, 30, 3)
    with_ball = np.zeros(30, np.bool_)
    with_ball[rows] = True
    expected, point = asked(model, packed, rows)
    made = answered(Network(pack(model)), packed, with_ball)
    of_kicks = {part: values for part, values in expected.items() if part.startswith(("kick", "tackle"))}
    assert_alike(made, of_kicks, rows.numpy())
    assert_alike(made, {part: values for part, values in expected.items() if part not in of_kicks})
    assert (made["asked"][:, 0] == with_ball).all()
    for part in of_kicks:
        assert (made[part][~with_ball] == 0).all()
    assert (made["parameters"][~with_ball, 3:6] == 0).all()
    assert (point[~with_ball, 3:6] == 0).all()
    np.testing.assert_allclose(made["parameters"][~with_ball][:, :3], point[~with_ball][:, :3], rtol=1e-4, atol=5e-3)


def test_one_situation_is_answered_as_among_many() -> None:
    model = varied(MODELS["two"])
    packed = model.inputs.project(situations(9, seed=7)).numpy()
    network = Network(pack(model))
    flags = np.arange(9) % 2 == 0
    many = network.answers(packed, with_ball=flags)
    for row, flag, expected in zip(packed, flags, many, strict=True):
        one = network.answer(row, with_ball=bool(flag))
        assert one is network.last
        for values, of_many in zip(one, network.view(expected), strict=True):
            np.testing.assert_array_equal(values, of_many)


def test_inputs_of_another_network_are_refused() -> None:
    network = Network(pack(varied(PAPER)))
    with pytest.raises(ValueError, match=r"expected \(n, 119\) inputs and \(n,\) flags, got \(3, 120\) and \(3,\)"):
        network.answers(np.zeros((3, 120)))
    with pytest.raises(ValueError, match=r"got \(3, 119\) and \(2,\)"):
        network.answers(np.zeros((3, 119)), with_ball=np.zeros(2, np.bool_))
    with pytest.raises(ValueError, match=r"expected \(119,\) inputs, got \(1,\)"):
        network.answer(np.zeros(1))


@pytest.mark.parametrize("name", ["two papers", "point", "two"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e30, 0.0])
def test_whatever_the_inputs_are_there_is_an_answer(name: str, value: float) -> None:
    model = varied(MODELS[name])
    packed = model.inputs.project(situations(4, seed=8)).numpy()
    network = Network(pack(model))
    for column in range(0, packed.shape[1], 7):
        odd = packed.copy()
        odd[:, column::11] = value
        out = network.answers(odd)
        drawn, numbers = network.samples(out, np.full((4, 5), 0.7))
        assert ((drawn >= 0) & (drawn < len(network.commands))).all()
        assert numbers.shape == (4, 2)
    with np.errstate(invalid="ignore"):
        network.answer(np.full(packed.shape[1], value))
    assert network.likeliest() in network.commands


def test_a_trained_run_answers_alike(tmp_path: Path) -> None:
    make_dataset(tmp_path / "ds", frames_per_match=60, commands=REPERTOIRE)
    settings = [
        *("model.hidden=[24]", "model.parameter_hidden=[16]", "model.kick_hidden=[16]", "model.target_hidden=[16]"),
        *("model.kick_attention=8", f"model.commands={list(REPERTOIRE)}", "model.extra_kicks=8"),
        *("data.batch_size=128", "data.batches_per_epoch=9", "data.validation_batches=4"),
        *("train.epochs=2", "train.threads=1", "train.precision=fp32", "train.device=cpu"),
    ]
    dataset = open_dataset(tmp_path / "ds")
    train(load_config("best", [item.replace("'", '"') for item in settings]), dataset, tmp_path / "run")
    model = open_run(tmp_path / "run").load_model().eval()
    packed = model.inputs.project(dataset.state(np.arange(200)))
    made = answered(Network(pack(model)), packed)
    expected, point = asked(model, packed)
    assert_alike(made, expected)
    assert_same_point(made, point, REPERTOIRE)
