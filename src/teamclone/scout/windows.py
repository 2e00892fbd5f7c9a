"""What follows a frame within some cycles, and moments to look at."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.scout.measures import Look, Moment
from teamclone.scout.seen import Bools, Floats, Ints, Seen

AnyInts = NDArray[np.integer[Any]]

MOST_MOMENTS = 4
"""Of a kind that are kept of a match: more than are shown of all."""


def until(seen: Seen, frames: AnyInts, cycles: int) -> Ints:
    """Return the last frame (n,) of the play that goes on for so many cycles after frames (n,), or its stop before."""
    cycle = seen.world.cycle
    last = np.searchsorted(cycle, cycle[frames] + cycles, side="right") - 1
    stops = np.append(np.flatnonzero(~seen.play_on), len(cycle) - 1)
    stop = stops[np.minimum(np.searchsorted(stops, frames + 1), len(stops) - 1)]
    found: Ints = np.maximum(np.minimum(last, stop), frames).astype(np.int64)
    return found


def followed(frames: AnyInts, start: AnyInts, end: AnyInts) -> Bools:
    """Return whether one of some frames, ascending, lies between start and end (n,), these included."""
    found: Bools = np.searchsorted(frames, start, side="left") < np.searchsorted(frames, end, side="right")
    return found


def moment(seen: Seen, frame: int, text: str, *, unum: int = 0, own: bool = True, weight: float = 1.0) -> Moment:
    """Return a frame as a moment to look at; its text is what happens."""
    return Moment(
        match_id=seen.match_id,
        cycle=int(seen.world.cycle[frame]),
        stoppage=int(seen.world.stoppage[frame]),
        unum=int(unum),
        own=own,
        text=text,
        weight=float(weight),
    )


def foremost(
    seen: Seen, frame: AnyInts, unum: AnyInts, weight: Floats, text: Callable[[int], str], *, own: bool = True
) -> list[Moment]:
    """Return those of some frames with the greatest weight as moments, at most MOST_MOMENTS.

    Args:
        frame, unum, weight: (n,) of each. text: what happens in the one of this index.
        own: it is the team's.
    """
    return [
        moment(seen, int(frame[at]), text(int(at)), unum=unum[at], own=own, weight=weight[at])
        for at in np.argsort(-weight, kind="stable")[:MOST_MOMENTS]
    ]


def who(unum: int) -> str:
    """Return a player by number, or that the log does not tell it."""
    return str(unum) if unum else "somebody"


def as_one(*looks: Look) -> Look:
    """Return parts of a look as one."""
    return Look(
        numbers={key: value for look in looks for key, value in look.numbers.items()},
        arrays={key: value for look in looks for key, value in look.arrays.items()},
        moments={key: value for look in looks for key, value in look.moments.items()},
    )
