"""Command logs: the messages of all clients, as the server received them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from teamclone.errors import LogError
from teamclone.logs import scan
from teamclone.logs.columns import EVENTS
from teamclone.logs.match import Columns, CommandLog, Problem, Severity, empty_columns
from teamclone.logs.rcg_text import count_byte, line_bounds

FIRST_LINE = re.compile(rb"\s*\d{1,9}(,\d{1,9})?\t")
"""The first bytes of a command log."""
_SENDER = re.compile(rb"^\d+(?:,\d+)?\tRecv (\S+)_(?:\d{1,2}|Coach): ", re.MULTILINE)


def read_commands(data: bytes, *, left: str | None, right: str | None, path: Path | None = None) -> CommandLog:
    """Read a command log.

    Args:
        data: the decompressed log.
        left, right: the teams' names in the game log. Lines of other senders are counted as a problem.
        path: its name, for messages.

    Raises:
        LogError: no line is one of a command log.
    """
    buffer = np.frombuffer(data, np.uint8)
    starts, stops = line_bounds(buffer)
    # A command begins at its parenthesis; one that does not ends its message.
    capacity = count_byte(buffer, ord("(")) + data.count(b"\tRecv ")
    # In few large arrays, which the system backs with large pages: each first touch of a small one costs a fault.
    integers = np.empty((4, capacity), np.int32)
    small = np.empty((5, capacity), np.uint8)
    args = np.empty((4, capacity), np.float32)
    texts = np.empty((2, capacity), np.int64)
    made: Columns = {
        **dict(zip(("cycle", "stoppage", "line", "order"), integers, strict=True)),
        **dict(zip(("side", "unum", "kind", "legs", "valid"), small, strict=True)),
        **dict(zip(("arg0", "arg1", "arg2", "arg3"), args, strict=True)),
        **dict(zip(("text_start", "text_stop"), texts, strict=True)),
    }
    made["side"] = made["side"].view(np.int8)
    made["valid"] = made["valid"].view(np.bool_)
    classes = np.empty(len(starts), np.uint8)
    stamps = np.empty((len(starts), 2), np.int32)
    n = scan.scan_commands(
        buffer,
        starts,
        stops,
        np.frombuffer((left or "").encode(), np.uint8),
        np.frombuffer((right or "").encode(), np.uint8),
        integers,
        made["side"],
        made["unum"],
        made["kind"],
        made["legs"],
        made["valid"],
        args,
        texts,
        classes,
        stamps,
        np.empty((3, 12, 3), np.int64),
    )
    stamped = stamps[:, 0] >= 0
    if not stamped.any():
        raise LogError("no line begins with a time stamp like '57,0<tab>': not a command log", path=path, line=1)
    # A log that ends inside a line was cut off: its last command is not whole.
    cut = not data.endswith(b"\n") and n > 0 and made["line"][n - 1] == len(starts) and not made["valid"][n - 1]
    n -= cut
    # Views of the arrays for the worst case: the rows behind n were never touched and take no memory.
    commands: Columns = {"frame": np.zeros(n, np.int32)} | {name: values[:n] for name, values in made.items()}
    has_stoppage = bool((stamps[stamped, 1] >= 0).any())
    np.maximum(commands["stoppage"], 0, out=commands["stoppage"])
    events, event_texts = _events(data, starts, stops, classes, stamps)
    return CommandLog(
        commands=commands,
        text=data,
        events=events,
        event_texts=event_texts,
        has_stoppage=has_stoppage,
        problems=tuple(_problems(data, classes, starts, stops, commands, cut=cut, path=path)),
    )


def sender_names(data: bytes) -> list[str]:
    """Return the team names in order of their first messages; the first to connect plays on the left."""
    return list(dict.fromkeys(name.decode("utf-8", "replace") for name in _SENDER.findall(data)))


def _events(
    data: bytes,
    starts: np.ndarray,
    stops: np.ndarray,
    classes: np.ndarray,
    stamps: np.ndarray,
) -> tuple[Columns, tuple[str, ...]]:
    lines: list[int] = []
    texts: list[str] = []
    for index in np.flatnonzero(classes == 1):
        _, _, body = data[starts[index] : stops[index]].partition(b"\t")
        word, _, text = body.strip().rstrip(b")").partition(b" ")
        if word == b"(referee":
            lines.append(int(index))
            texts.append(text.decode("utf-8", "replace"))
    events = empty_columns(EVENTS, len(lines))
    events["line"][:] = np.array(lines, np.int32) + 1
    events["cycle"][:] = stamps[lines, 0]
    events["stoppage"][:] = np.maximum(stamps[lines, 1], 0)
    return events, tuple(texts)


def _problems(
    data: bytes,
    classes: np.ndarray,
    starts: np.ndarray,
    stops: np.ndarray,
    commands: Columns,
    *,
    cut: bool,
    path: Path | None,
) -> list[Problem]:
    problems = []
    odd = np.flatnonzero(classes == scan.LINE_ODD)
    if len(odd) and odd[-1] == len(starts) - 1 and stops[odd[-1]] == len(data):
        cut = True
        odd = odd[:-1]
    if cut:
        problems.append(
            Problem(
                code="truncated",
                severity=Severity.WARNING,
                text="the last line is cut off; its last command is left out",
                path=path,
                line=len(starts),
            )
        )
    if len(odd):
        problems.append(
            Problem(
                code="odd-line",
                severity=Severity.WARNING,
                text=f"{len(odd)} line(s) have no time stamp or sender, the first is "
                f"{data[starts[odd[0]] : stops[odd[0]]][:40]!r}; left out",
                path=path,
                line=int(odd[0]) + 1,
            )
        )
    strangers = np.flatnonzero(classes == scan.LINE_STRANGER)
    if len(strangers):
        first = int(strangers[0])
        names = sender_names(data[starts[first] : stops[first]])
        problems.append(
            Problem(
                code="unknown-sender",
                severity=Severity.WARNING,
                text=f"{len(strangers)} message(s) of a team that is not in the match"
                + (f" ({names[0]})" if names else "")
                + " are left out",
                path=path,
                line=first + 1,
            )
        )
    refused = np.flatnonzero(~commands["valid"] & (commands["unum"] > 0))
    if len(refused):
        first = int(refused[0])
        who = "left" if commands["side"][first] > 0 else "right"
        begin = int(starts[commands["line"][first] - 1])
        end = int(stops[commands["line"][first] - 1])
        message = data[begin:end].partition(b": ")[2][:40].decode("utf-8", "replace")
        problems.append(
            Problem(
                code="refused-command",
                severity=Severity.NOTE,
                text=f"{len(refused)} command(s) that the server cannot parse (or behind one in the same message), "
                f"the first by {who} {commands['unum'][first]}: {message!r}",
                path=path,
                line=int(commands["line"][first]),
                cycle=int(commands["cycle"][first]),
            )
        )
    return problems
