"""Bytes of a log: from a path or a stream, plain or compressed; the first bytes show which."""

from __future__ import annotations

import bz2
import io
import lzma
import os
import stat
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO, Protocol, cast

import zstandard

from teamclone.errors import LogError

try:
    from isal import isal_zlib
except ImportError:  # there is no wheel for every machine; zlib does the same in two to three times the time
    isal_zlib = None  # type: ignore[assignment]

MAX_BYTES = 1 << 30
"""A log of more than this is refused, packed or decompressed. A full match has 26 MB."""
_FIRST_CHUNK = 1 << 9
"""Bytes of a member that are inflated first; then twice as many each time, up to the packing's chunk.

In a file of many tiny members a whole chunk would be copied for each of them.
"""
_LEVELS = 2
"""How often a log may be packed: tools that pack what was packed already are common."""
_XZ_MEMORY = 1 << 28
"""Memory that an xz stream may ask for; xz -9 asks for 65 MB, a hostile header for 4 GB."""


class _Inflater(Protocol):
    """The interface that zlib, lzma and zstandard decompressors have in common."""

    @property
    def eof(self) -> bool: ...
    @property
    def unused_data(self) -> bytes: ...
    def decompress(self, data: bytes, /) -> bytes: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class _Packing:
    """A way to compress.

    Attributes:
        magic: its first bytes.
        inflater: makes a decompressor of one member.
        chunk: how many bytes to inflate in one step, chosen so that they become at most about 64 MiB before a bomb is
            noticed (gzip makes up to 1032 bytes of one, xz 7000, zstd 32000, bz2 46 MB of 40 bytes). The bytes
            behind an error in a chunk are lost.
        careful: another inflater, for streams that this one cannot inflate.
    """

    magic: bytes
    inflater: Callable[[], _Inflater]
    chunk: int
    careful: _Packing | None = None


_GZIP = _Packing(magic=b"\x1f\x8b", inflater=lambda: zlib.decompressobj(wbits=31), chunk=1 << 12)
_PACKINGS = (
    # ISA-L is the quicker one. Of a broken stream zlib gives the last bytes too, and the same ones on every machine.
    _GZIP
    if isal_zlib is None
    else replace(_GZIP, inflater=lambda: isal_zlib.decompressobj(wbits=31), chunk=1 << 16, careful=_GZIP),
    _Packing(magic=b"\xfd7zXZ\x00", inflater=lambda: lzma.LZMADecompressor(memlimit=_XZ_MEMORY), chunk=1 << 13),
    _Packing(magic=b"\x28\xb5\x2f\xfd", inflater=lambda: zstandard.ZstdDecompressor().decompressobj(), chunk=1 << 11),
    _Packing(magic=b"BZh", inflater=bz2.BZ2Decompressor, chunk=1 << 6),
)
# bz2 has no class of errors of its own.
_ERRORS: tuple[type[Exception], ...] = (zlib.error, lzma.LZMAError, zstandard.ZstdError, EOFError, OSError)
if isal_zlib is not None:
    _ERRORS += (cast(type[Exception], isal_zlib.IsalError),)  # its stub has it as an instance


def read_bytes(
    source: Path | BinaryIO, *, path: Path | None = None, max_bytes: int = MAX_BYTES
) -> tuple[bytes, str | None]:
    """Return the decompressed content of a log, as far as it can be had.

    Args:
        source: a file, or a binary stream at its beginning.
        path: the name for errors where the source is a stream.
        max_bytes: refuse more than this after decompression.

    Returns:
        The bytes, and the error that broke off the decompression: None where it went to the end.

    Raises:
        LogError: nothing could be read, or there is more than ``max_bytes``.
    """
    if isinstance(source, Path):
        path = source
        raw = _content(source, max_bytes=max_bytes)
    else:
        raw = source.read(max_bytes + 1)
    if not raw:
        raise LogError("is empty, expected a game log (.rcg) or command log (.rcl)", path=path)
    if len(raw) > max_bytes:
        raise LogError(f"has more than the limit of {max_bytes} bytes", path=path)
    problem = None
    for _ in range(_LEVELS):
        packing = next((packing for packing in _PACKINGS if raw.startswith(packing.magic)), None)
        if packing is None:
            break
        raw, broken = _inflate(raw, packing, path=path, max_bytes=max_bytes)
        problem = problem or broken
    return raw, problem


def _content(path: Path, *, max_bytes: int) -> bytes:
    """Return the bytes of a file, whose size is looked at first: a sparse file may claim to have any."""
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise LogError("is a folder, expected a game log (.rcg) or command log (.rcl)", path=path)
        if not stat.S_ISREG(mode):
            raise LogError("is a pipe or device, expected a file: write its content to one", path=path)
        # Of what was a file a moment ago another process may have made a pipe, which would keep us waiting.
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | getattr(os, "O_NONBLOCK", 0))) as file:
            size = os.fstat(file.fileno()).st_size
            if size > max_bytes:
                raise LogError(f"has {size} bytes, more than the limit of {max_bytes}", path=path)
            return file.read(size)
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror or error}", path=path) from error


def _inflate(raw: bytes, packing: _Packing, *, path: Path | None, max_bytes: int) -> tuple[bytes, str | None]:
    """Inflate all members of a stream in chunks, so that a bomb is met before it fills the memory."""
    content = io.BytesIO()  # grows in place, where joining pieces would need the memory twice
    problem = None
    inflater = packing.inflater()
    position = 0
    size = min(_FIRST_CHUNK, packing.chunk)
    while position < len(raw):
        chunk = raw[position : position + size]
        position += len(chunk)
        size = min(2 * size, packing.chunk)
        try:
            content.write(inflater.decompress(chunk))
        except _ERRORS as error:
            problem = f"compressed data is damaged ({error})"
            break
        if content.tell() > max_bytes:
            raise LogError(f"decompresses to more than the limit of {max_bytes} bytes", path=path)
        if inflater.eof:
            position -= len(inflater.unused_data)
            if position < len(raw):
                if not raw.startswith(packing.magic[:2], position):
                    break  # padding behind the last member
                inflater = packing.inflater()
                size = min(_FIRST_CHUNK, packing.chunk)
    else:
        if not inflater.eof:
            problem = "compressed data ends early"
    if problem and packing.careful:
        return _inflate(raw, packing.careful, path=path, max_bytes=max_bytes)
    if not content.tell():
        raise LogError(problem or "is empty after decompression", path=path)
    return content.getvalue(), problem
