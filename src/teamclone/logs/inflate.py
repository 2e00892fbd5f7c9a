"""Bytes of a log: from a path or a stream, plain or compressed; the first bytes show which."""

from __future__ import annotations

import io
import lzma
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
"""A decompressed log of more than this is refused. A full match has 26 MB."""


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
            noticed (gzip makes up to 1032 bytes of one, xz 7000, zstd 32000). The bytes behind an error in a chunk are
            lost.
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
    _Packing(magic=b"\xfd7zXZ\x00", inflater=lzma.LZMADecompressor, chunk=1 << 13),
    _Packing(magic=b"\x28\xb5\x2f\xfd", inflater=lambda: zstandard.ZstdDecompressor().decompressobj(), chunk=1 << 11),
)
_ERRORS: tuple[type[Exception], ...] = (zlib.error, lzma.LZMAError, zstandard.ZstdError, EOFError)
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
        if source.is_dir():
            raise LogError("is a folder, expected a game log (.rcg) or command log (.rcl)", path=path)
        try:
            raw = source.read_bytes()
        except OSError as error:
            raise LogError(f"cannot be read: {error.strerror or error}", path=path) from error
    else:
        raw = source.read()
    if not raw:
        raise LogError("is empty, expected a game log (.rcg) or command log (.rcl)", path=path)
    for packing in _PACKINGS:
        if raw.startswith(packing.magic):
            return _inflate(raw, packing, path=path, max_bytes=max_bytes)
    if len(raw) > max_bytes:
        raise LogError(f"has {len(raw)} bytes, more than the limit of {max_bytes}", path=path)
    return raw, None


def _inflate(raw: bytes, packing: _Packing, *, path: Path | None, max_bytes: int) -> tuple[bytes, str | None]:
    """Inflate all members of a stream in chunks, so that a bomb is met before it fills the memory."""
    content = io.BytesIO()  # grows in place, where joining pieces would need the memory twice
    problem = None
    inflater = packing.inflater()
    position = 0
    while position < len(raw):
        chunk = raw[position : position + packing.chunk]
        position += len(chunk)
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
    else:
        if not inflater.eof:
            problem = "compressed data ends early"
    if problem and packing.careful:
        return _inflate(raw, packing.careful, path=path, max_bytes=max_bytes)
    if not content.tell():
        raise LogError(problem or "is empty after decompression", path=path)
    return content.getvalue(), problem
