from __future__ import annotations

import pytest
import torch
from torch.nn import functional

from teamclone.training.calibration import COLDEST, HOTTEST, Calibration

CPU = torch.device("cpu")


def calibrated(logits: torch.Tensor, kind: torch.Tensor, *, batch: int = 100) -> tuple[float, float]:
    calibration = Calibration(CPU)
    for part in zip(logits.split(batch), kind.split(batch), strict=True):
        calibration.add(*part)
    return calibration.fit()


@pytest.mark.parametrize("too_sure", [0.05, 0.4, 1.0, 2.5, 40.0])
def test_finds_by_how_much_a_model_is_too_sure(too_sure: float) -> None:
    generator = torch.Generator().manual_seed(0)
    honest = torch.randn(20_000, 4, generator=generator) * 2
    kind = torch.multinomial(honest.softmax(1), 1, generator=generator).squeeze(1)
    temperature, gained = calibrated(honest * too_sure, kind)
    assert temperature == pytest.approx(too_sure, rel=0.03)
    before, after = (float(functional.cross_entropy(honest * too_sure / by, kind)) for by in (1, temperature))
    assert gained == pytest.approx(before - after, abs=1e-5)
    assert gained >= 0
    for other in (0.98, 1.02):
        assert float(functional.cross_entropy(honest * too_sure / (other * temperature), kind)) > after


@pytest.mark.parametrize(("kind", "bound"), [(0, COLDEST), (1, HOTTEST)])
def test_a_model_always_right_or_wrong_ends_at_a_bound(kind: int, bound: float) -> None:
    logits = torch.tensor([[1.0, 0.0, 0.0, 0.0]]).repeat(50, 1)
    temperature, _ = calibrated(logits, torch.full((50,), kind))
    assert temperature == pytest.approx(bound, rel=1e-6)


def test_logits_that_say_nothing_stay() -> None:
    temperature, gained = calibrated(torch.zeros(10, 4), torch.zeros(10, dtype=torch.int64))
    assert COLDEST <= temperature <= HOTTEST
    assert gained == 0
