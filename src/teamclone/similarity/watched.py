"""What several clones think of the commands of one team in one match."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import DatasetError
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.evaluation.metrics import MOST_LOSS

if TYPE_CHECKING:
    from teamclone.models.clone import Clone

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Watched:
    """A team in a match, by frames in which it had something to decide.

    Attributes:
        match_id: of the match. team: its name.
        loss: (clones, frames) summed log loss of its players' commands, nats, by clone.
        commands: (frames,) how many commands that is.
        kinds: (commands of the clones,) how often each was given.
    """

    match_id: str
    team: str
    loss: Floats
    commands: Ints
    kinds: Ints


def watch(models: Mapping[str, Clone], match: MatchColumns, *, side: int) -> Watched:
    """Have every clone predict every command that is known of a team in a match.

    A command that a clone holds for impossible counts MOST_LOSS nats.

    Args:
        models: clones with the same commands, by name. side: of the team, 1 left or -1 right.

    Raises:
        DatasetError: the log lacks what a model needs, or no command is known.
    """
    from teamclone.evaluation.prediction_table import predict_match

    names = next(iter(models.values())).config.commands
    n_frames = len(match.frames["cycle"])
    found: list[Floats] = []
    for model in models.values():
        table = predict_match(model, match, side=side).to_arrow()
        loss = table["log_loss"].to_numpy().astype(np.float64)
        known = ~np.isnan(loss)
        frame = table["frame"].to_numpy()[known]
        sums = np.bincount(frame, np.minimum(loss[known], MOST_LOSS), minlength=n_frames)
        found.append(sums.astype(np.float64, copy=False))
    commands = np.bincount(frame, minlength=n_frames)
    if not len(frame):
        raise DatasetError(f"{match.match_id}: no command is known that the clones could have predicted")
    done = table["done"].to_numpy(zero_copy_only=False)[known]
    there = commands > 0
    return Watched(
        match_id=match.match_id,
        team=str(match.left if side > 0 else match.right),
        loss=np.stack(found)[:, there],
        commands=commands[there],
        kinds=np.array([(done == name).sum() for name in names]),
    )
