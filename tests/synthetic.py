"""A small made dataset with something to learn: commands follow from where a player stands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from teamclone.dataset.layout import CATEGORICAL_INDEX, MEASURED_INDEX, STEP, STEPS, Split
from teamclone.dataset.write import write_dataset
from teamclone.rcss.commands import CLONED, CLONED_KINDS, CommandKind
from teamclone.rcss.player_types import DEFAULTS, FIELDS, GROUPS, RANGES
from teamclone.world.channels import FLAG_GOALIE, FLAG_ON_FIELD, MEASURED

N_TYPES = 18


def make_dataset(
    folder: Path, *, frames_per_match: int = 300, seed: int = 0, commands: tuple[str, ...] = CLONED, **changes: Any
) -> Path:
    """Four matches, one per split; ``changes`` replace whole arrays ("frames/ball") before writing.

    What a player does follows from where he stands: beyond x = 35 he kicks, beyond |y| = 28 he tackles, in his own
    half he turns, else he dashes; parameters follow from his place and body. Further ``commands`` are given in strips
    of eleven metres from the half-way line on.
    """
    rng = np.random.default_rng(seed)
    splits = list(Split)
    n = frames_per_match * len(splits)
    position = rng.uniform((-52, -34), (52, 34), (n, 22, 2)).astype(np.float32)
    ball = np.concatenate([rng.uniform((-52, -34), (52, 34), (n, 2)), rng.normal(0, 0.8, (n, 2))], 1)
    values = {
        "vx": rng.uniform(-0.4, 0.4, (n, 22)),
        "vy": rng.uniform(-0.4, 0.4, (n, 22)),
        "body": rng.uniform(-180, 180, (n, 22)),
        "neck": rng.uniform(-90, 90, (n, 22)),
        "view_width": np.full((n, 22), 120.0),
        "stamina": rng.uniform(3000, 8000, (n, 22)),
        "effort": np.full((n, 22), 1.0),
        "recovery": np.full((n, 22), 1.0),
        "capacity": rng.uniform(0, 130600, (n, 22)),
        "type": rng.integers(0, N_TYPES, (n, 22)),
        "flags": np.broadcast_to(FLAG_ON_FIELD + FLAG_GOALIE * (np.arange(22) % 11 == 0), (n, 22)),
        "last_command": rng.choice([int(kind) for kind in (0, *CLONED_KINDS, CommandKind.CATCH)], (n, 22)),
        "age": np.zeros((n, 22)),
    }
    detail = np.stack([np.rint(values[channel.name] / STEP[channel.name]) for channel in MEASURED], -1)
    code = np.stack([values[name] for name in CATEGORICAL_INDEX], -1)

    frame = np.repeat(np.arange(n), 10)
    player = np.tile(np.arange(1, 11), n)
    x, y = position[frame, player].T
    body = detail[frame, player, MEASURED_INDEX["body"]] * STEPS[MEASURED_INDEX["body"]]
    kind = np.select([x > 35, np.abs(y) > 28, x < 0], [2, 3, 1], 0)
    parameters = np.zeros((len(kind), 2))
    parameters[kind == 0] = np.stack([100 - 2 * x, -body], 1)[kind == 0]
    parameters[kind == 1, 0] = -body[kind == 1]
    parameters[kind == 2] = np.stack([x, y * 4], 1)[kind == 2]
    parameters[kind == 3, 0] = -y[kind == 3]
    for index, name in enumerate(commands[len(CLONED) :]):
        strip = (kind == 0) & (x >= 11 * index) & (x < 11 * index + 11)
        kind[strip] = len(CLONED) + index
        given = {"catch": (-2 * y, 0 * y), "move": (-x, y / 2), "none": (0 * x, 0 * y)}[name]
        parameters[strip] = np.stack(given, 1)[strip]

    match = np.repeat(np.arange(len(splits)), frames_per_match)
    frames = {
        "match": match,
        "cycle": np.tile(np.arange(1, frames_per_match + 1), len(splits)),
        "playmode": np.full(n, 3),
        "mode_cycles": np.zeros(n),
        "score": np.zeros((n, 2)),
        "ball": ball,
        "position": position,
        "measured": detail,
        "categorical": code,
    }
    samples = {
        "frame": frame,
        "player": player,
        "kind": kind,
        "parameters": parameters,
        "interval": np.zeros((len(frame), 2, 2)),
        "executed": np.ones(len(frame), bool),
        "turn_zero": np.zeros(len(frame), bool),
        "split": np.asarray(splits)[match[frame]],
    }
    for name, value in changes.items():
        table, _, array = name.partition("/")
        (frames if table == "frames" else samples)[array] = value
    meta = {
        "team": "Made",
        **({"commands": commands} if commands != CLONED else {}),
        "matches": [
            {"match_id": f"{index:016x}", "opponent": f"Other{index}", "side": "left", "split": split.name.lower()}
            for index, split in enumerate(splits)
        ],
    }
    return write_dataset(folder, frames=frames, samples=samples, player_types=_types(rng), meta=meta)


def _types(rng: np.random.Generator) -> np.ndarray:
    """(4, N_TYPES, fields): type 0 the server's default, the others drawn as the server draws them."""
    types = np.tile(np.array(list(DEFAULTS.values()), np.float32), (len(Split), N_TYPES, 1))
    for name in (name for group in GROUPS.values() for name in group):
        types[:, 1:, FIELDS.index(name)] = rng.uniform(*RANGES[name], (len(Split), N_TYPES - 1))
    return types
