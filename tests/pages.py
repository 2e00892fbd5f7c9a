"""A reader of replay pages for the tests, written by the description of the data alone."""

from __future__ import annotations

import base64
import json
import re
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Unpacked:
    """The data of a page: what stands in its head, and its columns, (n_frames,) or (n_frames, 22), NaN for unknown."""

    head: dict[str, Any]
    columns: dict[str, NDArray[np.float64]]

    def step(self, name: str) -> float:
        return float(next(column["step"] for column in self.head["columns"] if column["name"] == name))


def unpack_page(html: str) -> Unpacked:
    [data] = re.findall(r'<script type="application/octet-stream" id="data">([^<]*)</script>', html)
    return unpack(base64.b64decode(data, validate=True))


def unpack(data: bytes) -> Unpacked:
    plain = zlib.decompress(data)
    length = int.from_bytes(plain[:4], "little")
    head = json.loads(plain[4 : 4 + length])
    at, columns = 4 + length, {}
    for column in head["columns"]:
        size, rows, frames = column["bytes"], column["rows"], head["frames"]
        planes = np.frombuffer(plain, np.uint8, size * rows * frames, at).reshape(size, rows, frames).astype(object)
        at += size * rows * frames
        folded = sum(planes[place] << (8 * place) for place in range(size))
        numbers = np.where(folded & 1, -(folded + 1) // 2, folded // 2)
        bound = 1 << (8 * size - 1)
        for _ in range(column["order"]):
            numbers = (np.cumsum(numbers, axis=1) + bound) % (2 * bound) - bound
        values = np.where(numbers == -bound, np.nan, numbers * column["step"]).astype(np.float64)
        columns[column["name"]] = values.T if rows > 1 else values[0]
    assert at == len(plain), "nothing is left over"
    return Unpacked(head, columns)
