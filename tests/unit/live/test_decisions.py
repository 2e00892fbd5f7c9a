"""Decisions of a clone in a match."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamclone.engine.clone import CompiledClone
from teamclone.engine.inputs import project
from teamclone.engine.network import network
from teamclone.live.decisions import Decisions
from teamclone.models.clone import Clone
from teamclone.models.config import EgocentricConfig
from teamclone.models.packing import pack
from teamclone.rcss.players import N_PLAYERS
from teamclone.world.view import FRAME_COLUMNS, PLAYER_COLUMNS, view_columns

KERNELS = ((project, "_project_all"), (network, "_answer_all"), (network, "_sample_all"))
SMALL = EgocentricConfig(
    hidden=(8,), parameter_hidden=(8,), kick_hidden=(8,), target_hidden=(8,), target_points=2, kick_attention=0
)


def test_all_that_a_cycle_calls_is_compiled_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    called: list[str] = []

    def noted(name: str, kernel: Any) -> Any:
        return lambda *given: (called.append(name), kernel(*given))[1]

    for module, name in KERNELS:
        monkeypatch.setattr(module, name, noted(name, getattr(module, name)))
    decisions = Decisions(CompiledClone(pack(Clone(SMALL))))
    decisions.load()
    loaded = set(called)
    called.clear()
    frames = {name: np.zeros(1, np.int32) for name in FRAME_COLUMNS}
    players = {name: np.zeros((1, N_PLAYERS), np.int32) for name in PLAYER_COLUMNS}
    decisions.of(view_columns(frames, players, params={}, side=1), [1])
    assert loaded == set(called) == {name for _, name in KERNELS}
