"""What comes out of packed files: whole, cut, damaged, several in one, and bombs."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import os
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
import zstandard

from teamclone.errors import LogError
from teamclone.logs import inflate as opening
from teamclone.logs.inflate import read_bytes

CONTENT = b"".join(
    b"(show %d ((b) %d.%04d 0 0 0))\n" % (row, row * 7919 % 53, row * 104729 % 10000) for row in range(9000)
)
PACK: dict[str, Callable[[bytes], bytes]] = {
    "gz": gzip.compress,
    "xz": lzma.compress,
    "zst": zstandard.compress,
    "bz2": bz2.compress,
}


def read(data: bytes, *, max_bytes: int = opening.MAX_BYTES) -> tuple[bytes, str | None]:
    return read_bytes(io.BytesIO(data), max_bytes=max_bytes)


@pytest.fixture(params=["with ISA-L", "without"])
def inflater(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Machines without a wheel of ISA-L read the same."""
    if request.param == "without":
        packings = tuple(packing.careful or packing for packing in opening._PACKINGS)
        monkeypatch.setattr(opening, "_PACKINGS", packings)
    return request.param


@pytest.mark.parametrize("packing", PACK)
def test_whole_files_several_in_one_and_padding(inflater: str, packing: str):
    packed = PACK[packing](CONTENT)
    assert read(packed) == (CONTENT, None)
    assert read(packed + PACK[packing](b"end\n")) == (CONTENT + b"end\n", None)
    assert read(packed + bytes(1000)) == (CONTENT, None)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.5, 0.999])
def test_of_a_cut_gzip_stays_what_zlib_can_inflate(inflater: str, share: float):
    packed = gzip.compress(CONTENT)
    packed = packed[: int(len(packed) * share)]
    data, problem = read(packed)
    assert data == zlib.decompressobj(wbits=31).decompress(packed)
    assert CONTENT.startswith(data)
    assert problem == "compressed data ends early"


def test_of_a_damaged_gzip_stays_what_stands_before(inflater: str):
    packed = bytearray(gzip.compress(CONTENT))
    packed[len(packed) // 2 : len(packed) // 2 + 60] = bytes(60)
    data, problem = read(bytes(packed))
    assert problem is not None
    assert problem.startswith("compressed data is damaged")
    intact = zlib.decompressobj(wbits=31).decompress(packed[: len(packed) // 2 - opening._GZIP.chunk])
    assert data.startswith(intact)
    assert len(intact) > len(CONTENT) // 4


def test_a_wrong_checksum_is_a_problem(inflater: str):
    packed = gzip.compress(CONTENT)
    _, problem = read(packed[:-8] + bytes(4) + packed[-4:])
    assert problem is not None
    assert "incorrect data check" in problem


MAKERS = {
    "gz": lambda: zlib.compressobj(wbits=31),
    "xz": lambda: lzma.LZMACompressor(preset=0),
    "zst": lambda: zstandard.ZstdCompressor().compressobj(),
    "bz2": bz2.BZ2Compressor,
}


@pytest.fixture(scope="module", params=MAKERS)
def bomb(request: pytest.FixtureRequest) -> bytes:
    """256 MiB of zeros, packed."""
    maker = MAKERS[request.param]()
    zeros = bytes(1 << 22)
    return b"".join(maker.compress(zeros) for _ in range(64)) + maker.flush()


def test_a_bomb_is_refused_before_it_fills_the_memory(inflater: str, bomb: bytes):
    tracemalloc.start()
    try:
        with pytest.raises(LogError, match="more than the limit of 1000000 bytes"):
            read(bomb, max_bytes=1_000_000)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 160 << 20


@pytest.mark.parametrize("outer", PACK)
@pytest.mark.parametrize("inner", PACK)
def test_what_was_packed_twice_is_unpacked_twice(inflater: str, inner: str, outer: str):
    assert read(PACK[outer](PACK[inner](CONTENT))) == (CONTENT, None)


def test_what_was_packed_three_times_is_no_log(inflater: str):
    assert read(gzip.compress(gzip.compress(gzip.compress(CONTENT))))[0][:2] == b"\x1f\x8b"


def test_an_xz_stream_that_asks_for_much_memory_is_refused():
    filters = [{"id": lzma.FILTER_LZMA2, "preset": 0, "dict_size": 1 << 30}]
    packed = lzma.compress(CONTENT[:100], filters=filters)
    with pytest.raises(LogError, match="Memory usage limit exceeded"):
        read(packed)


def test_a_file_is_refused_by_its_size_before_it_is_read(tmp_path: Path):
    path = tmp_path / "sparse.rcg"
    path.touch()
    os.truncate(path, 30 << 30)
    tracemalloc.start()
    try:
        with pytest.raises(LogError, match="more than the limit of"):
            read_bytes(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 1 << 20


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path):
    path = tmp_path / "pipe.rcg"
    os.mkfifo(path)
    with pytest.raises(LogError, match="is a pipe or device, expected a file"):
        read_bytes(path)
