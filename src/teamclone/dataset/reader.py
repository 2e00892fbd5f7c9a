"""A dataset as batches: memory-mapped arrays, gathered by index into the raw state that models take."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from teamclone.dataset.layout import (
    CATEGORICAL_INDEX,
    FORMAT,
    FRAME_ARRAYS,
    MEASURED_INDEX,
    MISSING,
    NO_CODE,
    SAMPLE_ARRAYS,
    STEPS,
    Array,
    Split,
    index_stops,
)
from teamclone.errors import DatasetError
from teamclone.rcss.commands import CLONED, kind_places, not_of_repertoire
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.playmodes import OTHER_SIDE
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.system.documents import read_document
from teamclone.world.channels import CHANNEL
from teamclone.world.state import State, Target

Rows = NDArray[np.int64] | Tensor
"""Indices of samples, (batch,) int64."""
CHECKED_FRAMES = 2**17
"""Frames that are looked at together; bounds memory."""


_META = {
    "id": str,
    "team": str,
    "teams?": [str],
    "commands?": [str],
    "matches": [{"match_id": str, "opponent": str, "side?": str}],
    "n_frames": int,
    "n_samples": int,
    "recovered?": int,
    "options?": (dict, type(None)),
    "cleaning?": (dict, type(None)),
}
"""Of dataset.json, what readers need."""


@cache
def _steps(device: torch.device) -> Tensor:
    return torch.from_numpy(STEPS).to(device)


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """A dataset that has been opened. Its arrays stay on disk; every method reads just the rows it is asked for.

    Attributes:
        path: its folder.
        meta: ``dataset.json``.
        frames: FRAME_ARRAYS by name, (n_frames, ...).
        samples: SAMPLE_ARRAYS by name, (n_samples, ...).
        player_types: (n_matches, n_types, len(player_types.FIELDS)) float32.
        server_params: (n_matches, len(server_params.FIELDS)) float64.
    """

    path: Path
    meta: dict[str, Any]
    frames: dict[str, Tensor]
    samples: dict[str, Tensor]
    player_types: Tensor
    server_params: Tensor

    def __len__(self) -> int:
        return len(self.samples["frame"])

    @property
    def id(self) -> str:
        """A hash of the content: equal for equal datasets, wherever they lie."""
        return str(self.meta["id"])

    @property
    def commands(self) -> tuple[str, ...]:
        """Commands that its samples may have, some of REPERTOIRE in their order."""
        return tuple(self.meta.get("commands", CLONED))

    @property
    def percepts(self) -> bool:
        """Whether each sample has the situation as its player believes it."""
        options = self.meta.get("options")
        return isinstance(options, dict) and bool(options.get("percepts"))

    @property
    def matches(self) -> list[dict[str, Any]]:
        """The matches: ``match_id``, ``opponent``, ``side``, ``split`` and more of each."""
        return list(self.meta["matches"])

    @property
    def nbytes(self) -> int:
        """Size of all arrays in bytes."""
        return sum(
            array.nbytes
            for array in (*self.frames.values(), *self.samples.values(), self.player_types, self.server_params)
        )

    def to(self, device: torch.device) -> Dataset:
        """Return the dataset with all arrays in the memory of a device, for ``rows`` and answers there."""
        return replace(
            self,
            frames={name: array.to(device) for name, array in self.frames.items()},
            samples={name: array.to(device) for name, array in self.samples.items()},
            player_types=self.player_types.to(device),
            server_params=self.server_params.to(device),
        )

    def split(self, split: Split) -> NDArray[np.int64]:
        """Return the samples of a split, ascending."""
        return np.flatnonzero(self.samples["split"].numpy() == int(split))

    def need(self, channels: Sequence[str], rows: NDArray[np.int64], *, history: int = 0) -> None:
        """Raise unless the frames of samples hold the ball and some of CHANNEL: not every log has all.

        Args:
            history: how many frames before each are needed, too.

        Raises:
            DatasetError: a match lacks one, or the age of what players see is asked for where they see everything, or
                frames before where players believe what they see.
        """
        if history and self.percepts:
            raise DatasetError(
                f"{self.path}: situations as players believe them have no past; leave the block past out"
            )
        if "age" in channels and not self.percepts:
            raise DatasetError(
                f"{self.path}: has situations as the log has them, the model knows them as players believe them; "
                "make the dataset with --percepts"
            )
        frames = np.unique(self.samples["frame"].numpy()[rows])
        for start in range(0, len(frames), CHECKED_FRAMES):
            part = frames[start : start + CHECKED_FRAMES]
            ball = self.frames["ball"].numpy()[part]
            measured, categorical = (self.frames[name].numpy()[part] for name in ("measured", "categorical"))
            lacking = {f"ball_{name}": np.isnan(ball[:, index]) for index, name in enumerate(("x", "y", "vx", "vy"))}
            lacking |= {
                name: (measured[..., MEASURED_INDEX[name]] == MISSING).any(1)
                for name in channels
                if name in MEASURED_INDEX
            }
            lacking |= {
                name: (categorical[..., CATEGORICAL_INDEX[name]] == NO_CODE).any(1)
                for name in channels
                if name in CATEGORICAL_INDEX
            }
            for name, column in lacking.items():
                if column.any():
                    match = self.matches[int(self.frames["match"][part[column][0]])]
                    raise DatasetError(
                        f"{self.path}: match {match['match_id']} has no {name} in its log, which the model needs; "
                        "make the dataset without it"
                    )

    def state(self, rows: Rows, *, history: int = 0) -> State:
        """Return the situations in which the commands of these samples were decided, in the order asked for.

        Args:
            history: how many frames before each to give too; with `percepts` none is known.
        """
        rows = torch.as_tensor(rows)
        frame, place = torch.unique(self.samples["frame"].index_select(0, rows).long(), return_inverse=True)
        match = self.frames["match"].index_select(0, frame).long()
        players = self._players(frame)
        n_types = self.player_types.shape[1]
        kinds = match[:, None] * n_types + players[..., CHANNEL["type"]].long()
        types = self.player_types.reshape(-1, len(FIELDS)).index_select(0, kinds.reshape(-1))
        back = torch.arange(1, history + 1, device=rows.device)
        past = (frame[:, None] - back).clamp(min=0)
        known = torch.ones_like(past, dtype=torch.bool)
        for name, step in (("match", 0), ("cycle", 1)):
            value = self.frames[name]
            known &= value[past] == value[frame][:, None] - step * back
        known &= not self.percepts  # the frame before is what somebody else believed
        past = torch.where(known, past, frame[:, None]).reshape(-1)
        return State(
            ball=self.frames["ball"].index_select(0, frame),
            players=players,
            types=types.reshape(len(frame), N_PLAYERS, len(FIELDS)),
            server=self.server_params.index_select(0, match).to(torch.float32),
            past_ball=self.frames["ball"].index_select(0, past).reshape(len(frame), history, 4),
            past_players=self._players(past).reshape(len(frame), history, N_PLAYERS, len(CHANNEL)),
            past_known=known,
            mode=self._mode(frame),
            mode_cycles=self.frames["mode_cycles"].index_select(0, frame).to(torch.float32),
            frame=place,
            actor=self.samples["player"].index_select(0, rows).long(),
        )

    def _mode(self, frame: Tensor) -> Tensor:
        """Return (frames,) int64 the play mode of some frames as the modelled team sees it."""
        turned = torch.tensor([match.get("side") == "right" for match in self.matches], device=frame.device)
        mode = self.frames["playmode"].index_select(0, frame).long()
        other = torch.from_numpy(OTHER_SIDE).to(frame.device).long()[mode]
        return torch.where(turned[self.frames["match"].index_select(0, frame).long()], other, mode)

    def _players(self, frame: Tensor) -> Tensor:
        """Return (frames, 22, len(CHANNEL)) of some frames."""
        stored, codes = (self.frames[name].index_select(0, frame) for name in ("measured", "categorical"))
        players = torch.empty(len(frame), N_PLAYERS, len(CHANNEL), device=frame.device)
        players[..., :2] = self.frames["position"].index_select(0, frame)
        measured, categorical = players[..., 2 : 2 + len(MEASURED_INDEX)], players[..., 2 + len(MEASURED_INDEX) :]
        torch.mul(stored, _steps(frame.device), out=measured)
        measured.masked_fill_(stored == MISSING, math.nan)
        categorical[...] = codes
        categorical.masked_fill_(codes == NO_CODE, math.nan)
        return players

    def target(self, rows: Rows) -> Target:
        """Return the commands of samples."""
        rows = torch.as_tensor(rows)
        recovered = bool(self.meta.get("recovered"))
        return Target(
            kind=self.samples["kind"].index_select(0, rows).long(),
            parameters=self.samples["parameters"].index_select(0, rows),
            interval=self.samples["interval"].index_select(0, rows).float() if recovered else None,
        )

    def last_kind(self, rows: Rows) -> Tensor:
        """Return (batch,) int64: the acting player's command one cycle before, an index into `commands`; else -1."""
        rows = torch.as_tensor(rows)
        frame = self.samples["frame"].index_select(0, rows)
        actor = self.samples["player"].index_select(0, rows)
        kind = self.frames["categorical"][frame.long(), actor.long(), CATEGORICAL_INDEX["last_command"]].long()
        return torch.from_numpy(kind_places(self.commands))[kind]

    def mode(self, rows: Rows) -> Tensor:
        """Return (batch,) int64 the play mode of each sample, as the modelled team sees it."""
        return self._mode(self.samples["frame"].index_select(0, torch.as_tensor(rows)).long())

    def match(self, rows: Rows) -> Tensor:
        """Return (batch,) int64: index of each sample's match in `matches`."""
        frame = self.samples["frame"].index_select(0, torch.as_tensor(rows))
        return self.frames["match"].index_select(0, frame).long()


def open_dataset(path: Path | str) -> Dataset:
    """Open a dataset.

    Raises:
        DatasetError: it is missing, not a dataset, of another format number, or damaged.
    """
    folder = Path(path)
    document = folder / "dataset.json"
    meta = read_document(
        document,
        what="a dataset",
        number=FORMAT,
        command="teamclone dataset",
        error=DatasetError,
        folder=folder,
        shape=_META,
    )
    if wrong := not_of_repertoire(tuple(meta.get("commands", CLONED))):
        raise DatasetError(f"{document}: expected commands {wrong}; make it again with `teamclone dataset`")
    types = _open(folder / "player_types.npy", dtype="float32", shape=(len(meta["matches"]), None, len(FIELDS)))
    server = _open(folder / "server_params.npy", dtype="float64", shape=(len(meta["matches"]), len(SERVER_FIELD)))
    opened = Dataset(
        path=folder.resolve(),
        meta=meta,
        frames=_table(folder / "frames", FRAME_ARRAYS, rows=meta["n_frames"]),
        samples=_table(folder / "samples", SAMPLE_ARRAYS, rows=meta["n_samples"]),
        player_types=types,
        server_params=server,
    )
    _check_indices(opened)
    return opened


def _check_indices(dataset: Dataset) -> None:
    """See that every index points at something: compiled code gathers without a check."""
    frames, samples = dataset.frames, dataset.samples
    stops = index_stops(
        n_matches=len(dataset.matches),
        n_types=dataset.player_types.shape[1],
        n_frames=len(frames["match"]),
        n_commands=len(dataset.commands),
    )
    arrays = {f"frames/{name}": array for name, array in frames.items()}
    arrays |= {f"samples/{name}": array for name, array in samples.items()}
    arrays["frames/categorical type"] = frames["categorical"][..., CATEGORICAL_INDEX["type"]]
    for name, stop in stops.items():
        if not arrays[name].numel():
            continue
        least, most = (int(value) for value in arrays[name].aminmax())
        if least < 0 or most >= stop:
            raise DatasetError(
                f"{dataset.path}/{name}: expected 0..{stop - 1}, got {least}..{most}; "
                "make the dataset again with `teamclone dataset`"
            )


def _table(folder: Path, arrays: tuple[Array, ...], *, rows: int) -> dict[str, Tensor]:
    return {
        array.name: _open(folder / f"{array.name}.npy", dtype=array.dtype, shape=(rows, *array.shape))
        for array in arrays
    }


def _open(path: Path, *, dtype: str, shape: Sequence[int | None]) -> Tensor:
    """Map an array into memory and check it against the layout; None in ``shape`` is any length."""
    try:
        # Copy-on-write, because torch warns of read-only memory. Nothing here writes.
        values: NDArray[Any] = np.load(path, mmap_mode="c", allow_pickle=False)
    except FileNotFoundError:
        raise DatasetError(f"{path}: missing; make the dataset again with `teamclone dataset`") from None
    except (ValueError, EOFError) as error:
        raise DatasetError(f"{path}: damaged ({error}); make the dataset again with `teamclone dataset`") from None
    expected = tuple(got if want is None else want for want, got in zip(shape, values.shape, strict=False))
    if values.dtype != np.dtype(dtype) or values.shape != expected or len(values.shape) != len(shape):
        raise DatasetError(
            f"{path}: expected {dtype} {tuple(shape)}, got {values.dtype} {values.shape}; "
            "make the dataset again with `teamclone dataset`"
        )
    return torch.from_numpy(values)
