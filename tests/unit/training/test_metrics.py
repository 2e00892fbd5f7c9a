from __future__ import annotations

import pytest
import torch

from teamclone.models.clone import Prediction
from teamclone.models.loss import Loss
from teamclone.rcss.commands import CLONED
from teamclone.training.metrics import RunningMetrics
from teamclone.world.state import Target

CPU = torch.device("cpu")


def test_figures_by_hand_over_unequal_batches() -> None:
    scores = RunningMetrics(CPU)
    one_hot = torch.eye(4)
    # Truth dash, dash, turn; said dash, kick, turn. Dash power predicted 100 for 50, else zeros.
    scores.add(
        Loss(torch.tensor(0.33), torch.tensor(0.3), torch.tensor(0.06)),
        Prediction(one_hot[[0, 2, 1]], torch.tensor([[100.0, 0, 0, 0, 0, 0], [0.0] * 6, [0.0] * 6])),
        Target(torch.tensor([0, 0, 1]), torch.tensor([[50.0, 0.0], [0.0, 90.0], [0.0, 0.0]])),
    )
    # Truth kick; said kick, but with a turn moment of 36 degrees that was not issued.
    scores.add(
        Loss(torch.tensor(0.71), torch.tensor(0.7), torch.tensor(0.02)),
        Prediction(one_hot[[2]], torch.tensor([[0.0, 0, 36, 0, 0, 0]])),
        Target(torch.tensor([2]), torch.tensor([[20.0, 0.0]])),
    )
    table = scores.table()
    assert table == pytest.approx(
        {
            "loss": (3 * 0.33 + 0.71) / 4,
            "cross_entropy": (3 * 0.3 + 0.7) / 4,
            "parameter_loss": (3 * 0.06 + 0.02) / 4,
            "accuracy": 3 / 4,
            # .5 of dash power, .5 of dash direction, .2 of the turn moment not issued, .2 of kick power; 4 rows of 6.
            "parameter_mae": (0.5 + 0.5 + 0.2 + 0.2) / 24,
            # The same without the turn moment; issued are 2 + 2 + 1 + 2 parameters.
            "issued_mae": (0.5 + 0.5 + 0.2) / 7,
            "recall_dash": 1 / 2,
            "recall_turn": 1,
            "recall_kick": 1,
        }
    )
    assert "recall_tackle" not in table


def test_further_commands_are_counted() -> None:
    """A move of 57.5 m where -57.5 was right, beside a cycle without a command."""
    scores = RunningMetrics(CPU, (*CLONED, "move", "none"))
    said = torch.zeros(2, 8)
    said[0, 6] = 57.5
    scores.add(
        Loss(torch.tensor(1.0), torch.tensor(1.0), torch.tensor(0.0)),
        Prediction(torch.eye(6)[[4, 0]], said),
        Target(torch.tensor([4, 5]), torch.tensor([[-57.5, 0.0], [0.0, 0.0]])),
    )
    table = scores.table()
    assert (table["recall_move"], table["recall_none"]) == (1, 0)
    assert table["parameter_mae"] == pytest.approx(2 / 16)
    assert table["issued_mae"] == pytest.approx(2 / 2)
