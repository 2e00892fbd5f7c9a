"""A game log of what a monitor saw, in the server's words: text version 4, 5 or 6."""

from __future__ import annotations

import re
import time
from contextlib import AbstractContextManager
from pathlib import Path

from teamclone.errors import LiveError
from teamclone.live.watch_frames import known_mode
from teamclone.protocol.monitor import Show
from teamclone.protocol.monitor_stream import Frame
from teamclone.protocol.parameters import Parameters
from teamclone.rcss.playmodes import PlayMode
from teamclone.system.documents import write_errors

_FLUSH_S = 1.0
"""Seconds of a match that a killed process may cost."""
_GROUPS = re.compile(rb"\(show (\d+) \(pm \d+\) \(tm ([^()]*)\) ?")
"""What monitors get in each record, and logs have in lines of their own."""


class RcgWriter:
    """Writes a log aside, as ``.NAME.part``, and gives it its name when it is closed.

    What a killed process leaves aside is a log that ends early.
    """

    def __init__(self, path: Path, parameters: Parameters, *, version: int) -> None:
        self._path, self._aside = path, path.with_name(f".{path.name}.part")
        self._mode, self._teams, self._flush_at = PlayMode.NULL, b"", 0.0
        self._last: Show | None = None
        with self._errors():
            # What has this name, in a folder that may be somebody else's, may be a link to anywhere.
            self._aside.unlink(missing_ok=True)
            self._file = self._aside.open("xb")
        words = (
            b"(server_param",
            b"(player_param",
            *(b"(player_type %d" % number for number in sorted(parameters.types)),
        )
        lines = [b"ULG%d" % (version + 1), *(parameters.texts[word] for word in words if word in parameters.texts)]
        self._write(b"\n".join(lines) + b"\n")

    def message(self, text: bytes) -> None:
        """Write a ``(msg ...)``."""
        self._write(text + b"\n")

    def frame(self, frame: Frame) -> None:
        """Write a cycle, and before it play mode and teams where they changed."""
        show, groups = frame.show, _GROUPS.match(frame.text)
        assert groups is not None, "a show without the groups of monitors"
        lines = []
        if (mode := known_mode(show)) != self._mode:
            self._mode = mode
            lines.append(b"(playmode %d %s)" % (show.cycle, mode.name.lower().encode()))
        if groups[2] != self._teams:
            self._teams = groups[2]
            lines.append(b"(team %d %s)" % (show.cycle, groups[2]))
        # A line ends with its record, whatever white space a datagram has inside.
        record = b"(show %b %b" % (groups[1], frame.text[groups.end() :].replace(b"\n", b" ").replace(b"\r", b" "))
        self._write(b"\n".join([*lines, record, b""]))
        self._last = show
        now = time.monotonic()
        if now >= self._flush_at:
            self._flush_at = now + _FLUSH_S
            with self._errors():
                self._file.flush()

    def close(self) -> None:
        """Write the server's last line if the match ended, and give the file its name; one without a frame goes."""
        show = self._last
        if show is not None and show.over:
            names = zip(show.names, show.scores, strict=True)
            left, right = ("null" if name is None else f"{name}_{score}" for name, score in names)
            when = time.strftime("%Y%m%d%H%M")
            self._write(f'(msg {show.cycle} 1 "(result {when} {left}-vs-{right})")\n'.encode())
            self._write(b"(team %d %s)\n" % (show.cycle, self._teams))
        with self._errors():
            self._file.close()
            if show is None:
                self._aside.unlink()
            else:
                self._aside.replace(self._path)

    def _write(self, data: bytes) -> None:
        with self._errors():
            self._file.write(data)

    def _errors(self) -> AbstractContextManager[None]:
        return write_errors(
            self._path,
            error=LiveError,
            full="free some room, or save elsewhere",
            denied="name a place that can be written with --save",
        )
