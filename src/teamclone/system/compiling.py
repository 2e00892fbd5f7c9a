"""Numba kernels: how they are compiled, and a log message before it."""

from __future__ import annotations

import logging
import zlib
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from numba import njit
from numba.core import event

kernel: Any = njit(nogil=True, error_model="numpy")
"""Decorator of kernels. None of them is cached: the function that calls them all is, since Numba's cache does not see
which calls which."""


def version_of(*modules: ModuleType) -> int:
    """Return a checksum of the sources of modules, and of all in packages.

    Numba keeps what it compiled as long as the file of the cached function stays the same. A function that returns this
    number depends on all that it calls.
    """
    files = [
        path
        for module in modules
        for path in (sorted(Path(module.__path__[0]).glob("*.py")) if hasattr(module, "__path__") else [_file(module)])
    ]
    return zlib.crc32(b"".join(path.read_bytes() for path in files))


def _file(module: ModuleType) -> Path:
    return Path(str(module.__file__))


class _Teller(event.Listener):
    def __init__(self, texts: Mapping[Any, str]) -> None:
        self.texts = texts

    def on_start(self, event: event.Event) -> None:
        if text := self.texts.get(event.data["dispatcher"]):
            logging.getLogger(__name__).info(text)

    def on_end(self, event: event.Event) -> None:
        pass


def tell_when_compiled(texts: Mapping[Any, str]) -> None:
    """Log a text when a kernel is being compiled, which takes long where its code is not in the cache on disk.

    Args:
        texts: by kernel.
    """
    event.register("numba:compile", _Teller(texts))  # type: ignore[no-untyped-call]  # numba lacks the types
