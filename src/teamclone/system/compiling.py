"""Numba kernels: a log message before each compilation."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

from numba.core import event


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
