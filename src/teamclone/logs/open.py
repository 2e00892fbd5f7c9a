"""Bytes of a log: from a path or a stream, plain or compressed, told apart by their first bytes."""

from __future__ import annotations

import lzma
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, Protocol

import zstandard

from teamclone.errors import LogError

MAX_BYTES = 1 << 30
"""A decompressed log of more than this is refused. A full match has 26 MB."""

_CHUNK = 1 << 20


class _Inflater(Protocol):
    """What zlib, lzma and zstandard objects have in common."""

    @property
    def eof(self) -> bool: ...
    @property
    def unused_data(self) -> bytes: ...


def _gzip() -> tuple[_Inflater, Callable[[bytes], bytes]]:
    inflater = zlib.decompressobj(wbits=31)
    return inflater, inflater.decompress


def _xz() -> tuple[_Inflater, Callable[[bytes], bytes]]:
    inflater = lzma.LZMADecompressor()
    return inflater, inflater.decompress


def _zstd() -> tuple[_Inflater, Callable[[bytes], bytes]]:
    inflater = zstandard.ZstdDecompressor().decompressobj()
    return inflater, inflater.decompress


_MAGIC = {b"\x1f\x8b": _gzip, b"\xfd7zXZ\x00": _xz, b"\x28\xb5\x2f\xfd": _zstd}


def read_bytes(
    source: Path | BinaryIO, *, path: Path | None = None, max_bytes: int = MAX_BYTES
) -> tuple[bytes, str | None]:
    """The decompressed content of a log, as far as it can be had.

    Args:
        source: a file, or a binary stream at its beginning.
        path: the name for errors where the source is a stream.
        max_bytes: refuse more than this after decompression.

    Returns:
        The bytes, and what broke off the decompression: None where it went to the end.

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
    for magic, inflater in _MAGIC.items():
        if raw.startswith(magic):
            return _inflate(raw, inflater, path=path, max_bytes=max_bytes)
    if len(raw) > max_bytes:
        raise LogError(f"has {len(raw)} bytes, more than the limit of {max_bytes}", path=path)
    return raw, None


def _inflate(
    raw: bytes,
    make: Callable[[], tuple[_Inflater, Callable[[bytes], bytes]]],
    *,
    path: Path | None,
    max_bytes: int,
) -> tuple[bytes, str | None]:
    """Inflates all members of a stream in chunks, so that a bomb is met before it fills the memory."""
    parts: list[bytes] = []
    total = 0
    problem = None
    inflater, decompress = make()
    position = 0
    while position < len(raw):
        chunk = raw[position : position + _CHUNK]
        position += len(chunk)
        try:
            part = decompress(chunk)
        except (zlib.error, lzma.LZMAError, zstandard.ZstdError, EOFError) as error:
            problem = f"compressed data is damaged ({error})"
            break
        parts.append(part)
        total += len(part)
        if total > max_bytes:
            raise LogError(f"decompresses to more than the limit of {max_bytes} bytes", path=path)
        if inflater.eof:
            rest = inflater.unused_data
            position -= len(rest)
            if position < len(raw):
                if raw[position : position + 2] != raw[:2]:
                    break  # padding behind the last member
                inflater, decompress = make()
    else:
        if not inflater.eof:
            problem = "compressed data ends early"
    if not total:
        raise LogError(problem or "is empty after decompression", path=path)
    return b"".join(parts), problem
