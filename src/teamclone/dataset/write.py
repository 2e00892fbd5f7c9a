"""Writes a dataset to disk, match by match: all of it or nothing. The layout is `dataset/layout.py`."""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset.layout import CATEGORICAL_INDEX, FORMAT, FRAME_ARRAYS, SAMPLE_ARRAYS, Array, index_stops
from teamclone.errors import DatasetError
from teamclone.rcss.commands import CLONED
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.server_params import SERVER_DEFAULTS, SERVER_FIELD
from teamclone.system.documents import write_document, write_errors
from teamclone.system.files import held

_TABLES = {"frames": FRAME_ARRAYS, "samples": SAMPLE_ARRAYS}


class DatasetWriter:
    """A dataset that is written part by part; its use of memory does not grow."""

    def __init__(self, folder: Path, *, where: Path) -> None:
        """Begin a dataset in an empty folder; ``where`` is its name in errors. Use ``writing_dataset``."""
        self._folder = folder
        self._where = where
        self._files: dict[tuple[str, str], _ArrayFile] = {}
        for table, arrays in _TABLES.items():
            (folder / table).mkdir()
            for array in arrays:
                self._files[table, array.name] = _ArrayFile(folder / table / f"{array.name}.npy", array)
        self._ranges: dict[str, tuple[int, int]] = {}
        self.finished = False

    @property
    def n_frames(self) -> int:
        """Number of frames added so far."""
        return self._files["frames", "match"].rows

    @property
    def n_samples(self) -> int:
        """Number of samples added so far."""
        return self._files["samples", "frame"].rows

    def add(self, *, frames: Mapping[str, NDArray[Any]], samples: Mapping[str, NDArray[Any]]) -> None:
        """Append rows.

        Args:
            frames: FRAME_ARRAYS by name, shape (n_frames, ...).
            samples: SAMPLE_ARRAYS by name, shape (n_samples, ...); ``frame`` counts from the dataset's first.

        Raises:
            DatasetError: the arrays do not fit the layout.
        """
        for table, given in (("frames", frames), ("samples", samples)):
            for name, values in _rows(_TABLES[table], given, where=f"{self._where}/{table}").items():
                self._files[table, name].append(values)
        for name, values in (
            ("frames/match", frames["match"]),
            ("frames/categorical type", frames["categorical"][..., CATEGORICAL_INDEX["type"]]),
            ("samples/frame", samples["frame"]),
            ("samples/player", samples["player"]),
            ("samples/kind", samples["kind"]),
            ("samples/split", samples["split"]),
        ):
            if values.size:
                least, most = self._ranges.get(name, (0, -1))
                self._ranges[name] = min(least, int(values.min())), max(most, int(values.max()))

    def finish(
        self, *, player_types: NDArray[np.floating], server_params: NDArray[np.floating], meta: Mapping[str, Any]
    ) -> None:
        """Complete the dataset.

        Args:
            player_types: (n_matches, n_types, len(FIELDS)), SI units; unused types of a match as type 0.
            server_params: (n_matches, len(server_params.FIELDS)).
            meta: goes into ``dataset.json``; must hold ``team`` and ``matches``, a list of dictionaries, one per match,
                with a ``side`` of "right" where the modelled team was that; and ``commands``, unless they are CLONED.

        Raises:
            DatasetError: the parts added do not fit together.
        """
        missing = [key for key in ("team", "matches") if key not in meta]
        if missing:
            raise DatasetError(f"{self._where}: dataset.json needs {', '.join(missing)}")
        types = np.ascontiguousarray(player_types, np.float32)
        self._check_references(types, len(meta["matches"]), n_commands=len(meta.get("commands", CLONED)))
        array = Array(name="player_types", dtype="float32", shape=types.shape[1:], about="")
        self._files["", array.name] = _ArrayFile(self._folder / f"{array.name}.npy", array)
        self._files["", array.name].append(types)
        server = np.ascontiguousarray(server_params, np.float64)
        if server.shape != (len(meta["matches"]), len(SERVER_FIELD)):
            raise DatasetError(
                f"{self._where}/server_params: expected {(len(meta['matches']), len(SERVER_FIELD))}, got {server.shape}"
            )
        array = Array(name="server_params", dtype="float64", shape=server.shape[1:], about="")
        self._files["", array.name] = _ArrayFile(self._folder / f"{array.name}.npy", array)
        self._files["", array.name].append(server)
        digest = hashlib.blake2b(digest_size=8)
        for file in self._files.values():
            digest.update(file.finish())
        document = {
            "format": FORMAT,
            "id": digest.hexdigest(),
            **meta,
            "n_frames": self.n_frames,
            "n_samples": self.n_samples,
        }
        write_document(self._folder / "dataset.json", document)
        self.finished = True

    def close(self) -> None:
        """Let go of the files, finished or not."""
        for file in self._files.values():
            file.close()

    def _check_references(self, types: NDArray[np.float32], n_matches: int, *, n_commands: int) -> None:
        """Raise unless every index points at something: readers gather without a check."""
        if types.ndim != 3 or types.shape[0] != n_matches or types.shape[2] != len(FIELDS):
            raise DatasetError(
                f"{self._where}/player_types: expected shape ({n_matches}, types, {len(FIELDS)}), got {types.shape}"
            )
        stops = index_stops(n_matches=n_matches, n_types=types.shape[1], n_frames=self.n_frames, n_commands=n_commands)
        for name, (least, most) in self._ranges.items():
            if least < 0 or most >= stops[name]:
                raise DatasetError(f"{self._where}/{name}: expected 0..{stops[name] - 1}, got {least}..{most}")


class _ArrayFile:
    """A .npy file that grows: its header is written again at the end, over the room that NumPy leaves for it."""

    def __init__(self, path: Path, array: Array) -> None:
        self._array = array
        self._file = path.open("wb")
        self._hash = hashlib.blake2b(digest_size=8)
        self.rows = 0
        self._room = self._write_header()

    def append(self, values: NDArray[Any]) -> None:
        data = values.tobytes()
        self._file.write(data)
        self._hash.update(data)
        self.rows += len(values)

    def finish(self) -> bytes:
        """Complete the file and return the hash of its content."""
        self._file.seek(0)
        if self._write_header() != self._room:
            raise AssertionError("the header of an array outgrew its room")
        self._file.close()
        return self._hash.digest()

    def close(self) -> None:
        """Give the file up."""
        with suppress(OSError):  # the disk may be full
            self._file.close()

    def _write_header(self) -> int:
        """Write the header where the file is, and return its length in bytes."""
        dtype, start = np.dtype(self._array.dtype), self._file.tell()
        np.lib.format.write_array_header_1_0(
            self._file, {"descr": dtype.str, "fortran_order": False, "shape": (self.rows, *self._array.shape)}
        )
        return self._file.tell() - start


@contextmanager
def writing_dataset(folder: Path | str, *, replace: bool = False) -> Iterator[DatasetWriter]:
    """Yield a writer of a dataset; its folder appears only when it is finished.

    Args:
        folder: where to.
        replace: put it in the place of a dataset that is already there.

    Raises:
        DatasetError: something is already there, or the folder cannot be written.
    """
    folder = Path(folder)
    if folder.exists() and not replace:
        raise DatasetError(f"{folder}: already exists; choose another folder or remove it")
    if folder.exists() and not (folder / "dataset.json").is_file():
        raise DatasetError(f"{folder}: is not a dataset, so it is not replaced; choose another folder")
    with _in_words(folder):
        folder.parent.mkdir(parents=True, exist_ok=True)
        _tidy(folder)
        temporary = _part(folder, str(os.getpid()))
        shutil.rmtree(temporary, ignore_errors=True)
        temporary.mkdir()
        try:
            with held(temporary):
                writer = DatasetWriter(temporary, where=folder)
                try:
                    yield writer
                finally:
                    writer.close()
                if not writer.finished:
                    return
                _put_in_place(temporary, folder, replace=replace)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


def write_dataset(
    folder: Path | str,
    *,
    frames: Mapping[str, NDArray[Any]],
    samples: Mapping[str, NDArray[Any]],
    player_types: NDArray[np.floating],
    server_params: NDArray[np.floating] | None = None,
    meta: Mapping[str, Any],
    replace: bool = False,
) -> Path:
    """Write a dataset that lies in memory; see ``DatasetWriter`` and ``writing_dataset`` for arguments and errors.

    Without ``server_params`` all matches have the server's defaults.
    """
    if server_params is None:
        server_params = np.tile(SERVER_DEFAULTS, (len(player_types), 1))
    with writing_dataset(folder, replace=replace) as writer:
        writer.add(frames=frames, samples=samples)
        writer.finish(player_types=player_types, server_params=server_params, meta=meta)
    return Path(folder)


def _rows(spec: tuple[Array, ...], given: Mapping[str, NDArray[Any]], *, where: str) -> dict[str, NDArray[Any]]:
    """Return the arrays of a table in the layout's types, all of one length."""
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


def _part(folder: Path, what: str) -> Path:
    """Return the path of a folder beside the dataset for unfinished work."""
    return folder.with_name(f".{folder.name}.{what}.part")


def _tidy(folder: Path) -> None:
    """Remove the remains of killed writers of this dataset."""
    for left in folder.parent.iterdir():
        if left.name.startswith(f".{folder.name}.") and left.suffix == ".part":
            with suppress(OSError), held(left):  # unless its writer lives
                shutil.rmtree(left, ignore_errors=True)


def _put_in_place(made: Path, folder: Path, *, replace: bool) -> None:
    """Give a whole dataset its name.

    Raises:
        DatasetError: another process has put one there.
    """
    taken = DatasetError(f"{folder}: another process has just made it; choose another folder or remove it")
    old = _part(folder, f"{os.getpid()}.old")
    if folder.exists():
        if not replace:
            raise taken
        folder.rename(old)
    try:
        made.rename(folder)
    except OSError as error:
        if error.errno not in (errno.EEXIST, errno.ENOTEMPTY):
            raise
        raise taken from None
    finally:
        shutil.rmtree(old, ignore_errors=True)


def _in_words(folder: Path) -> AbstractContextManager[None]:
    remedy = "choose another folder"
    return write_errors(folder, error=DatasetError, full=f"make room, or {remedy}", denied=remedy)
