"""The file of a network's weights: all that its kernels need, for Python and for other languages.

Little-endian, without gaps:

    8 bytes   "TCLONENN"
    uint32    FORMAT
    uint32    CRC-32 of all bytes that follow
    16 bytes  id of the model, ASCII
    int64     number of integers
    int64     number of weights
    int64 []  the integers, see `spec`
    float32 [] the weights
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from teamclone.engine.network.spec import N_VALUES, Floats, Ints, commands_of, faults
from teamclone.errors import RunError
from teamclone.system.files import write_atomic

MAGIC = b"TCLONENN"
FORMAT = 1
_START, _COUNTS = struct.Struct("<8sII"), struct.Struct("<16sqq")


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """A network as kernels take it.

    Attributes:
        spec: see `spec`. values: (spec[N_VALUES],). model_id: hash of the weights that they are made from.
    """

    spec: Ints
    values: Floats
    model_id: str

    @property
    def commands(self) -> tuple[str, ...]:
        """The command set."""
        return commands_of(self.spec)


def write_weights(path: Path, weights: Weights) -> None:
    """Write a network; the file appears whole or not at all."""
    body = b"".join(
        (
            _COUNTS.pack(weights.model_id.encode("ascii"), len(weights.spec), int(weights.spec[N_VALUES])),
            weights.spec.astype("<i8").tobytes(),
            weights.values.astype("<f4").tobytes(),
        )
    )
    write_atomic(path, _START.pack(MAGIC, FORMAT, zlib.crc32(body)) + body)


def read_weights(path: Path) -> Weights:
    """Read what `write_weights` wrote.

    Raises:
        RunError: there is no such file, it is no file of weights, of another format number, or damaged.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise RunError(f"{path}: cannot read the weights of a network ({error.strerror})") from None
    if len(data) < _START.size + _COUNTS.size or data[: len(MAGIC)] != MAGIC:
        raise RunError(f"{path}: no weights of a network: it does not begin with {MAGIC.decode()}")
    _, number, crc = _START.unpack_from(data)
    if number != FORMAT:
        raise RunError(f"{path}: weights of format {number}, expected {FORMAT}: write them anew from the run")
    body = memoryview(data)[_START.size :]
    name, n_spec, n_values = _COUNTS.unpack_from(body)
    expected = _COUNTS.size + 8 * n_spec + 4 * n_values
    if zlib.crc32(body) != crc:
        raise RunError(
            f"{path}: damaged: its checksum is not that of its {len(data):,} bytes"
            f" ({_START.size + expected:,} expected): write it anew from the run"
        )
    if n_spec < 0 or n_values < 0 or expected != len(body):
        raise RunError(f"{path}: {len(data):,} bytes, {_START.size + expected:,} expected: write it anew from the run")
    spec = np.frombuffer(body, "<i8", n_spec, _COUNTS.size).astype(np.int64)
    values = np.frombuffer(body, "<f4", n_values, _COUNTS.size + 8 * n_spec).astype(np.float32)
    if fault := faults(spec, n_values):
        raise RunError(f"{path}: {fault}: write it anew from the run")
    return Weights(spec=spec, values=values, model_id=name.rstrip(b"\0").decode("ascii", "replace"))
