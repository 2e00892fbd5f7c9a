"""A clone as the engine takes it: every weight once, nothing that is no number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from tests.unit.engine.network.test_answer import FULL, MODELS, varied

from teamclone.engine.network import spec as of
from teamclone.errors import RunError
from teamclone.models.clone import EgocentricTrunk, parameter_count
from teamclone.models.config import ModelConfig
from teamclone.models.inputs.paper import Normalisation
from teamclone.models.packing import pack


@pytest.mark.parametrize("config", MODELS.values(), ids=MODELS)
def test_every_weight_has_a_place_of_its_own(config: ModelConfig) -> None:
    model = varied(config)
    with torch.no_grad():
        for index, weights in enumerate(model.parameters()):
            weights.fill_(index + 1)
    for module in model.modules():
        if isinstance(module, EgocentricTrunk) and module.answers:
            module.of_kicks = Normalisation(len(module.kick_columns))  # which changes nothing
    weights = pack(model)
    members = weights.values[weights.spec[of.N_VALUES] - config.ensemble_size * weights.spec[of.MEMBER_VALUES] :]
    assert len(members) == parameter_count(model)
    found = dict(zip(*np.unique(members, return_counts=True), strict=True))
    assert found == {index + 1: part.numel() for index, part in enumerate(model.parameters())}


def test_packing_again_gives_the_same_bytes() -> None:
    first, second = (pack(varied(FULL, seed=3)) for _ in range(2))
    assert first.spec.tobytes() == second.spec.tobytes()
    assert first.values.tobytes() == second.values.tobytes()
    assert first.model_id == second.model_id


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_weights_that_are_no_numbers_are_refused(value: float) -> None:
    model = varied(FULL)
    with torch.no_grad():
        model.head.kick.planned.error[2] = value
    with pytest.raises(RunError, match=r"head\.kick\.planned\.error has weights that are no finite numbers"):
        pack(model)


def test_an_activation_without_a_kernel_is_refused() -> None:
    model = varied(FULL)
    model.config = replace(FULL, activation="mish")
    with pytest.raises(RunError, match="activation 'mish', expected one of relu, gelu, silu, tanh"):
        pack(model)
