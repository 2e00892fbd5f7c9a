"""Datagrams as rcssserver sends them to monitors."""

from __future__ import annotations

from collections.abc import Mapping

AFTER_STATE = {
    3: b"-50 0.5 0.25 -0.125 90 -45 (v h 120) (s 8000 1 1) (c 0 1 2 3 4 5 6 7 8 9 10)",
    4: b"-50 0.5 0.25 -0.125 90 -45 (v h 120) (s 8000 1 1 130600) (c 0 1 2 3 4 5 6 7 8 9 10)",
    5: b"-50 0.5 0.25 -0.125 90 -45 (v h 120) (fp 12 3) (s 8000 1 1 130600) (c 0 1 2 3 4 5 6 7 8 9 10 11)",
}
"""A player as text versions have it."""


def packet(
    states: Mapping[tuple[str, int], str] = {},
    *,
    cycle: int = 7,
    pm: int = 3,
    teams: bytes = b"Red null 1 2",
    version: int = 3,
) -> bytes:
    players = b" ".join(
        b"((%s %d) 0 %s %s)" % (side.encode(), unum, states.get((side, unum), "0").encode(), AFTER_STATE[version])
        for side in "lr"
        for unum in range(1, 12)
    )
    return b"(show %d (pm %d) (tm %s) ((b) 1.5 -2 0.25 0) " % (cycle, pm, teams) + players + b")\0"


WHOLE = packet({("l", 1): "0x9"})
