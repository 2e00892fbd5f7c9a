"""How long the prediction of a match takes, beside the network alone.

    python benchmarks/predicting.py RUN MATCH [--side left]

Prints seconds, predictions per second, and how many times as long it takes as the network with states that are made.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch

import teamclone as tc
from teamclone.dataset.clean import players_to_model
from teamclone.evaluation.answers import BATCH
from teamclone.evaluation.prediction_table import near_the_ball
from teamclone.world.state import State


def network_seconds(clone: tc.LoadedClone, match: tc.Match, side: int) -> float:
    """Time the network on the states of a match, kicks and tackles only near the ball."""
    model, world = clone.model, tc.view(match, side=side)
    due = players_to_model(match.frames, match.players, side=side, repertoire=clone.commands)
    frame, actor = np.nonzero(due)
    near = near_the_ball(world, frame, actor)
    seconds = 0.0
    with torch.inference_mode():
        for start in range(0, len(frame), BATCH):
            part = slice(start, start + BATCH)
            state = State.of(world, frame[part], actor[part], history=model.inputs.history)
            inputs = model.features(state)
            kicks = torch.from_numpy(np.flatnonzero(near[part]))
            began = time.perf_counter()
            model.answer_inputs(inputs, kick_rows=kicks)
            seconds += time.perf_counter() - began
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("match", type=Path)
    parser.add_argument("--side", choices=("left", "right"), default="left")
    options = parser.parse_args()
    clone, match = tc.load(options.run), tc.read_match(options.match)
    clone.predict(match, side=options.side, unums=(9,))  # compiles
    began = time.perf_counter()
    rows = len(clone.predict(match, side=options.side))
    seconds = time.perf_counter() - began
    alone = network_seconds(clone, match, 1 if options.side == "left" else -1)
    print(f"{len(match.frames['cycle'])} frames, {rows:,} predictions: {seconds:.2f} s, {rows / seconds:,.0f} per s")
    print(f"the network alone {alone:.2f} s, the whole {seconds / alone:.1f} times that")


if __name__ == "__main__":
    main()
