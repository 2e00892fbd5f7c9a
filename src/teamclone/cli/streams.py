"""Standard streams that are closed, or that are not UTF-8."""

from __future__ import annotations

import os
import sys
from pathlib import Path

_STREAMS = (("stdin", "r"), ("stdout", "w"), ("stderr", "w"))


def open_streams() -> None:
    """Make the standard streams usable, whatever the caller made of them.

    A closed one is empty, or takes everything. Of text that the encoding of a stream does not have it gets escapes.
    """
    for number, (name, mode) in enumerate(_STREAMS):
        if getattr(sys, name) is None:
            _open_nothing(number)
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115 - for as long as the process lives
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a test's replacement may lack it
            stream.reconfigure(errors="backslashreplace")


def _open_nothing(number: int) -> None:
    """Open a descriptor on nothing where it is free: the next file would get its number, and what libraries print."""
    try:
        os.fstat(number)
    except OSError:
        opened = os.open(os.devnull, os.O_RDWR)
        if opened != number:
            os.dup2(opened, number)
            os.close(opened)
