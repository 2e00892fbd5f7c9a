"""The file of a network's weights: all that its kernels need, for Python and for other languages.

Little-endian, without gaps:

    8 bytes   "TCLONENN"
    uint32    FORMAT
    uint32    CRC-32 of all bytes that follow
    16 bytes  id of the model, ASCII
    4 int64   lengths of the four parts that follow, see `Weights`
    int64 []  spec
    int64 []  inputs
    float32 [] values
    uint8 []  order
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.network.spec import Floats, Ints, commands_of, faults
from teamclone.errors import RunError
from teamclone.system.files import write_atomic

MAGIC = b"TCLONENN"
FORMAT = 1
_PARTS = {"spec": "<i8", "inputs": "<i8", "values": "<f4", "order": "u1"}
_START, _COUNTS = struct.Struct("<8sII"), struct.Struct("<16s4q")


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """A network as kernels take it.

    Attributes:
        spec: see `spec`. values: (spec[N_VALUES],). model_id: hash of the weights that they are made from.
        inputs: how a state becomes inputs: EGOCENTRIC and `inputs.layout.places`, or PAPER and `inputs.paper.fields`.
        order: `kick_sequences.kick_order` by the server's defaults, flat; empty where nothing is planned.
    """

    spec: Ints
    values: Floats
    model_id: str
    inputs: Ints
    order: NDArray[np.uint8]

    @property
    def commands(self) -> tuple[str, ...]:
        """The command set."""
        return commands_of(self.spec)


def write_weights(path: Path, weights: Weights) -> None:
    """Write a network; the file appears whole or not at all."""
    body = b"".join(
        (
            _COUNTS.pack(weights.model_id.encode("ascii"), *(len(getattr(weights, name)) for name in _PARTS)),
            *(getattr(weights, name).astype(kind).tobytes() for name, kind in _PARTS.items()),
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
    if len(data) < _START.size or data[: len(MAGIC)] != MAGIC:
        raise RunError(f"{path}: no weights of a network: it does not begin with {MAGIC.decode()}")
    _, number, crc = _START.unpack_from(data)
    if number != FORMAT:
        raise RunError(f"{path}: weights of format {number}, expected {FORMAT}: write them anew from the run")
    body = memoryview(data)[_START.size :]
    if len(body) < _COUNTS.size:
        raise RunError(f"{path}: damaged: it ends after {len(data):,} bytes: write it anew from the run")
    model, *lengths = _COUNTS.unpack_from(body)
    ends = np.cumsum([length * np.dtype(kind).itemsize for length, kind in zip(lengths, _PARTS.values(), strict=True)])
    expected = _COUNTS.size + int(ends[-1])
    if zlib.crc32(body) != crc:
        raise RunError(
            f"{path}: damaged: its checksum is not that of its {len(data):,} bytes"
            f" ({_START.size + expected:,} expected): write it anew from the run"
        )
    if min(lengths) < 0 or expected != len(body):
        raise RunError(f"{path}: {len(data):,} bytes, {_START.size + expected:,} expected: write it anew from the run")
    starts = _COUNTS.size + ends - np.diff(ends, prepend=0)
    parts = {
        name: np.frombuffer(body, kind, length, start).astype(np.dtype(kind).newbyteorder("="))
        for (name, kind), length, start in zip(_PARTS.items(), lengths, starts.tolist(), strict=True)
    }
    if fault := faults(parts["spec"], parts["inputs"], len(parts["values"])):
        raise RunError(f"{path}: {fault}: write it anew from the run")
    return Weights(model_id=model.rstrip(b"\0").decode("ascii", "replace"), **parts)
