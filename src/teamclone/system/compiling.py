"""Numba kernels: how they are compiled, kept on disk where there is a place, and a log message before it."""

from __future__ import annotations

import logging
import multiprocessing
import zlib
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from numba import njit
from numba.core import event

_MORE: dict[str, Any] = {"no_cfunc_wrapper": True}  # which Numba's type hints lack
kernel: Any = njit(nogil=True, error_model="numpy", **_MORE)
"""Compiles a function that other kernels call. It is not cached, since the cache does not see which calls which: the
kernel that Python calls is cached with all of them. What such functions may use: `teamclone.export.rules`. Wrappers for
callers in C, of which there are none, would be compiled with all that they call, too."""


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


def cached_kernel(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles a function with these options of `numba.njit` and keeps its code on disk.

    Where Numba finds no folder that it may write, the code is compiled anew in each process.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        try:
            return njit(**options, cache=True)(function)
        except RuntimeError as error:  # Numba has no class of its own for it
            if "cannot cache" not in str(error):
                raise
            _tell_without_cache()
            return njit(**options)(function)

    return decorate


@cache
def _tell_without_cache() -> None:
    """Warn once, and not from every worker."""
    if multiprocessing.parent_process() is None:
        logging.getLogger(__name__).warning(
            "no folder to keep compiled code in, so every start compiles anew, some minutes: "
            "set NUMBA_CACHE_DIR to a folder that can be written"
        )


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
    event.register("numba:compile", _Teller(texts))
