"""Writes a dataset to disk: all of it or nothing. The layout is `dataset/layout.py`."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset.layout import DETAIL_CHANNELS, FORMAT, FRAME_ARRAYS, SAMPLE_ARRAYS, Array, Split
from teamclone.errors import DatasetError
from teamclone.rcss.commands import CLONED_KINDS
from teamclone.rcss.player_types import FIELDS

_TYPE = [channel.name for channel in DETAIL_CHANNELS].index("type")


def write_dataset(
    folder: Path | str,
    *,
    frames: Mapping[str, NDArray[Any]],
    samples: Mapping[str, NDArray[Any]],
    player_types: NDArray[np.floating],
    meta: Mapping[str, Any],
    replace: bool = False,
) -> Path:
    """Write a dataset; the folder appears complete or not at all.

    Args:
        folder: where to.
        frames: FRAME_ARRAYS by name, shape (n_frames, ...).
        samples: SAMPLE_ARRAYS by name, shape (n_samples, ...).
        player_types: (n_matches, n_types, len(FIELDS)), SI units; unused types of a match as type 0.
        meta: goes into ``dataset.json``; must hold ``team`` and ``matches``, a list of dictionaries, one per match.
        replace: put it in the place of a dataset that is already there.

    Raises:
        DatasetError: the arrays do not fit the layout or each other, or something is already there.
    """
    folder = Path(folder)
    if folder.exists() and not replace:
        raise DatasetError(f"{folder}: already exists; choose another folder or remove it")
    if folder.exists() and not (folder / "dataset.json").is_file():
        raise DatasetError(f"{folder}: is not a dataset, so it is not replaced; choose another folder")
    missing = [key for key in ("team", "matches") if key not in meta]
    if missing:
        raise DatasetError(f"{folder}: dataset.json needs {', '.join(missing)}")
    tables = {
        "frames": _rows(FRAME_ARRAYS, frames, where=f"{folder}/frames"),
        "samples": _rows(SAMPLE_ARRAYS, samples, where=f"{folder}/samples"),
    }
    types = np.ascontiguousarray(player_types, np.float32)
    _check_references(tables, types, len(meta["matches"]), where=str(folder))

    folder.parent.mkdir(parents=True, exist_ok=True)
    temporary = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    digest = hashlib.blake2b(digest_size=8)
    try:
        for table, arrays in tables.items():
            (temporary / table).mkdir(parents=True)
            for name, values in arrays.items():
                np.save(temporary / table / f"{name}.npy", values)
                digest.update(values.data)
        np.save(temporary / "player_types.npy", types)
        digest.update(types.data)
        document = {
            "format": FORMAT,
            "id": digest.hexdigest(),
            **meta,
            "n_frames": len(tables["frames"]["match"]),
            "n_samples": len(tables["samples"]["frame"]),
        }
        text = json.dumps(document, ensure_ascii=False, indent=2, default=str)
        (temporary / "dataset.json").write_text(text + "\n", encoding="utf-8")
        if folder.exists():
            shutil.rmtree(folder)
        temporary.rename(folder)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return folder


def _rows(spec: tuple[Array, ...], given: Mapping[str, NDArray[Any]], *, where: str) -> dict[str, NDArray[Any]]:
    """The arrays of a table in the layout's types, all of one length."""
    names = [array.name for array in spec]
    if sorted(given) != sorted(names):
        raise DatasetError(f"{where}: expected the arrays {', '.join(names)}, got {', '.join(given)}")
    rows = {array.name: np.ascontiguousarray(given[array.name], array.dtype) for array in spec}
    length = len(rows[names[0]])
    for array in spec:
        if rows[array.name].shape != (length, *array.shape):
            got = rows[array.name].shape
            raise DatasetError(f"{where}/{array.name}: expected shape {(length, *array.shape)}, got {got}")
    return rows


def _check_references(
    tables: dict[str, dict[str, NDArray[Any]]], types: NDArray[np.float32], n_matches: int, *, where: str
) -> None:
    """Every index points at something: the readers gather without looking."""
    frames, samples = tables["frames"], tables["samples"]
    if types.ndim != 3 or types.shape[0] != n_matches or types.shape[2] != len(FIELDS):
        raise DatasetError(
            f"{where}/player_types: expected shape ({n_matches}, types, {len(FIELDS)}), got {types.shape}"
        )
    bounds = (
        ("frames/match", frames["match"], n_matches),
        ("frames/detail type", frames["detail"][..., _TYPE], types.shape[1]),
        ("samples/frame", samples["frame"], len(frames["match"])),
        ("samples/player", samples["player"], 11),
        ("samples/kind", samples["kind"], len(CLONED_KINDS)),
        ("samples/split", samples["split"], len(Split)),
    )
    for name, values, stop in bounds:
        if len(values) and not (values.min() >= 0 and values.max() < stop):
            raise DatasetError(f"{where}/{name}: expected 0..{stop - 1}, got {values.min()}..{values.max()}")
