"""A clone as the engine's kernels take it: `engine.network.spec` says in which order its weights are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from teamclone.engine.inputs.paper import fields
from teamclone.engine.network import spec as of
from teamclone.engine.network.constants import ACTIVATIONS
from teamclone.engine.network.spec import EGOCENTRIC, PAPER, Ints, Shape, size_of, spec_of
from teamclone.engine.network.weights import Weights
from teamclone.errors import RunError
from teamclone.models.clone import Clone, EgocentricTrunk, Trunks, model_id
from teamclone.models.config import EgocentricConfig, EgocentricTrunkConfig
from teamclone.models.heads.ensemble import EnsembleHead
from teamclone.models.heads.mixture import MixtureHead
from teamclone.models.heads.point import PointHead
from teamclone.models.inputs.egocentric import CLIP, EgocentricFeatures
from teamclone.models.inputs.paper import Normalisation, PaperFeatures
from teamclone.planner.kick_sequences import DEFAULT_RULES, kick_order
from teamclone.rcss.commands import parameters_of


def pack(model: Clone) -> Weights:
    """Return the weights and normalisation of a clone as `engine.network` takes them.

    Raises:
        RunError: a weight is not a finite number, or the engine does not know the activation of the hidden layers.
    """
    if model.config.activation not in ACTIVATIONS:
        raise RunError(f"activation {model.config.activation!r}, expected one of {', '.join(ACTIVATIONS)}")
    for name, tensor in model.state_dict().items():
        if not torch.isfinite(tensor).all():
            raise RunError(f"{name} has weights that are no finite numbers: the training of this model failed")
    shape = _shape(model)
    spec = spec_of(shape)
    values = np.zeros(spec[of.N_VALUES], np.float32)
    for field, shared in _shared(model, shape):
        values[spec[field] : spec[field] + len(shared)] = shared
    many = isinstance(model.trunk, Trunks)
    trunks = list(model.trunk.members) if isinstance(model.trunk, Trunks) else [model.trunk]
    heads = list(cast(EnsembleHead, model.head).members) if many else [model.head]
    for member, (trunk, head) in enumerate(zip(trunks, heads, strict=True)):
        for row, made in _rows(spec, trunk, head):
            first = spec[row + of.WEIGHTS] + member * spec[of.MEMBER_VALUES]
            size = size_of(spec[row + of.INS : row + of.ROW_FIELDS].tolist())
            if len(made) != size:
                raise AssertionError(f"row at {row}: {len(made)} values, {size} expected")
            values[first : first + size] = made
    return Weights(
        spec=spec,
        values=values,
        model_id=model_id(model),
        inputs=_inputs(model.features),
        order=kick_order(DEFAULT_RULES).reshape(-1).astype(np.uint8) if shape.ways else np.empty(0, np.uint8),
    )


def _inputs(features: PaperFeatures | EgocentricFeatures) -> Ints:
    """Return how the kernels make the inputs, see `Weights`."""
    if isinstance(features, EgocentricFeatures):
        return np.array([EGOCENTRIC, *features.places], np.int64)
    of_types = (() if part is None else part.names for part in (features.own_type, features.all_types))
    return np.concatenate([[PAPER], fields(*of_types)])


def _shape(model: Clone) -> Shape:
    config, features = model.config, model.features
    general: dict[str, Any] = {
        "inputs": len(features.names),
        "commands": config.commands,
        "members": config.ensemble_size,
        "mixture": isinstance(config, EgocentricConfig),
        "activation": config.activation,
        "hidden": config.hidden,
    }
    if not isinstance(features, EgocentricFeatures):
        return Shape(columns=len(features.names), seen=tuple(range(len(features.names))), **general)
    config = cast(EgocentricTrunkConfig, config)
    trunk = cast(EgocentricTrunk, model.trunk.members[0] if isinstance(model.trunk, Trunks) else model.trunk)
    mixture: dict[str, Any] = (
        {
            "parameter_hidden": config.parameter_hidden,
            "kicked": tuple(trunk.kick_columns.tolist()),
            "kick_hidden": config.kick_hidden,
            "attention": config.kick_attention,
            "planned": "plan" in config.kick_blocks,
            "candidates": config.kick_candidates,
        }
        if isinstance(config, EgocentricConfig)
        else {}
    )
    return Shape(
        columns=features.n_inputs,
        seen=tuple(trunk.command_columns.tolist()),
        placed=tuple(trunk.target_columns.tolist()) if config.target_points else (),
        target_points=config.target_points,
        target_hidden=config.target_hidden,
        others=features.layout.others,
        ways=features.layout.plan,
        **mixture,
        **general,
    )


def _shared(model: Clone, shape: Shape) -> Iterator[tuple[int, NDArray[np.float32]]]:
    """Values of all members, by the field of their place."""
    features = model.features
    limits = [item.limit for item in parameters_of(shape.commands)]
    yield of.MEAN, _array(features.normalisation.mean)
    yield of.STD, _array(features.normalisation.std)
    yield of.SIGNS, _array(features.signs)
    yield of.LIMITS, np.array(limits, np.float32)
    yield of.CLIP, np.array([CLIP if isinstance(features, EgocentricFeatures) else np.inf], np.float32)
    yield of.TEMPERATURE, _array(model.head.temperature)


def _rows(spec: Ints, trunk: nn.Module, head: nn.Module) -> Iterator[tuple[int, NDArray[np.float32]]]:
    """Values of the rows of a member, by their places."""
    stacks: list[nn.Module] = [trunk]
    if isinstance(trunk, EgocentricTrunk):
        stacks = [trunk.command, trunk.parameters_of, trunk.kick] if trunk.answers else [trunk.command]
        if trunk.targets.count:
            stacks = [trunk.targets.body, *stacks]
            yield spec[of.PLACES], _layer(trunk.targets.place)
    linear = [one for stack in stacks for one in stack.modules() if isinstance(one, nn.Linear)]
    first = spec[of.ROWS_AT] + of.ROW_FIELDS * len(of.ROW_NAMES)
    at_ball = next(trunk.kick.children()) if isinstance(trunk, EgocentricTrunk) and trunk.answers else None
    for index, one in enumerate(linear):
        of_kicks = cast(EgocentricTrunk, trunk).of_kicks if one is at_ball else None
        yield first + of.ROW_FIELDS * index, _layer(one) if of_kicks is None else _normalised(one, of_kicks)
    if isinstance(head, PointHead):
        yield spec[of.COMMAND], _layer(head.command)
        yield spec[of.PARAMETER], _layer(head.parameter)
    else:
        rows = _mixture_rows(cast(EgocentricTrunk, trunk), cast(MixtureHead, head))
        yield from ((spec[row], values) for row, values in rows)


def _mixture_rows(trunk: EgocentricTrunk, head: MixtureHead) -> Iterator[tuple[int, NDArray[np.float32]]]:
    players, kick = trunk.players, head.kick
    layers: dict[int, nn.Module | None] = {
        of.COMMAND: head.command,
        of.DASH: head.dash,
        of.TURN: head.turn,
        of.CATCH_CLASS: head.catch,
        of.MOVE_PLACE: head.move,
        of.KICK: kick.layer,
        of.KICK_TARGET: kick.target,
        of.TACKLE_CLASS: head.tackle,
        of.TACKLE_TRUST: head.planned_tackle,
        of.WAY_SHARE: None if kick.planned is None else kick.planned.share,
    }
    if players is not None:
        layers |= {
            of.OTHER_IN: players.other[0],
            of.OTHER_OUT: players.other[2],
            of.SITUATION: players.situation,
            of.BEFORE: players.before,
            of.BETWEEN: players.between,
            of.AFTER: players.after,
            of.ASK: players.ask,
            of.HEARD: players.heard,
            of.THINK_IN: players.think[0],
            of.THINK_OUT: players.think[2],
        }
    if kick.candidates is not None:
        layers |= {
            of.CANDIDATE: kick.candidates.candidate,
            of.CANDIDATE_SITUATION: kick.candidates.situation,
            of.CANDIDATE_TARGET: kick.candidates.target,
            of.CANDIDATE_BETWEEN: kick.candidates.between,
            of.CANDIDATE_SCORE: kick.candidates.score,
        }
    yield from ((row, _layer(one)) for row, one in layers.items() if one is not None)
    yield of.INCOME, _array(head.incomes)
    yield of.POWER, _array(head.powers)
    if head.catch is not None:
        yield of.CATCH_EDGES, _array(head.catch_edges)
        yield of.CATCH_SHARPNESS, _array(head.catch_sharpness)
    if kick.planned is not None:
        yield of.WAY_ERROR, _array(kick.planned.error)


def _layer(module: nn.Module) -> NDArray[np.float32]:
    """Weights, those of one input next to each other, then biases."""
    weight, bias = cast(Tensor, module.weight), cast(Tensor, module.bias)
    weight = weight.mT if weight.dim() > 1 else weight
    return np.concatenate([_array(weight), _array(bias)])


def _normalised(layer: nn.Linear, inputs: Normalisation) -> NDArray[np.float32]:
    """Weights and biases as of `_layer`, of a layer after a normalisation, which they contain."""
    weight, bias = layer.weight.detach().double(), layer.bias.detach().double()
    scaled = weight / inputs.std.double()
    return np.concatenate([_array(scaled.mT), _array(bias - scaled @ inputs.mean.double())])


def _array(tensor: Tensor) -> NDArray[np.float32]:
    return tensor.detach().cpu().float().reshape(-1).numpy()
