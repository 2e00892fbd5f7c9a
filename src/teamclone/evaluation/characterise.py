"""``characterise``: the distribution of a dataset's commands, without a model."""

from __future__ import annotations

from typing import Any

import numpy as np

from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset
from teamclone.rcss.commands import CLONED

POSITIONS_PER_KIND = 2500
"""Points of Fig. 4: enough for a picture, few enough for a file."""
TURN_EDGES = np.arange(-181.5, 182.0, 3.0)
"""Bins of Fig. 6 in degrees; the one in the middle holds 0."""


def characterise(dataset: Dataset, *, seed: int = 0) -> dict[str, Any]:
    """Count the rows: commands by split, turn moments, where each command was given (Figs 4 to 6)."""
    kinds, splits = dataset.samples["kind"].numpy(), dataset.samples["split"].numpy()
    names = dataset.commands
    square = np.bincount(splits.astype(np.int64) * len(names) + kinds, minlength=len(Split) * len(names))
    by_split = square.reshape(len(Split), len(names))
    turns = np.flatnonzero(kinds == CLONED.index("turn"))
    histogram = np.zeros(len(TURN_EDGES) - 1, np.int64)
    zero = 0
    arguments, turn_zero = dataset.samples["parameters"].numpy(), dataset.samples["turn_zero"].numpy()
    for part in np.array_split(turns, max(len(turns) // 1_000_000, 1)):
        histogram += np.histogram(arguments[part, 0], bins=TURN_EDGES)[0]
        zero += int(turn_zero[part].sum())
    generator = np.random.default_rng(seed)
    places: dict[str, list[list[float]]] = {}
    for kind, name in enumerate(names):
        rows = np.flatnonzero(kinds == kind)
        if len(rows) > POSITIONS_PER_KIND:
            rows = np.sort(generator.choice(rows, POSITIONS_PER_KIND, replace=False))
        frames, players = dataset.samples["frame"].numpy()[rows], dataset.samples["player"].numpy()[rows]
        spots = dataset.frames["position"].numpy()[frames, players]
        places[name] = np.round(spots.astype(np.float64), 1).tolist()
    return {
        "rows": len(dataset),
        "matches": len({match["match_id"] for match in dataset.matches}),
        "commands_by_split": {
            split.name.lower(): dict(zip(names, by_split[split].tolist(), strict=True)) for split in Split
        },
        "turns": len(turns),
        "turn_zero": zero,
        "turn_moments": {"edges": TURN_EDGES.tolist(), "counts": histogram.tolist()},
        "positions": places,
    }
