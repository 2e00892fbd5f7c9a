"""``find_events``: the events of a match as one table of columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from teamclone.events import own, possession, referee, transfers
from teamclone.events.definitions import COLUMNS, EventKind, typed
from teamclone.events.expected_goals import expected_goals
from teamclone.events.found import Found
from teamclone.events.touches import Play
from teamclone.logs.match import Columns


def find_events(frames: Columns, players: Columns, params: Mapping[str, float | str]) -> Columns:
    """Return the events of a match, in the order of their frames.

    Args:
        frames: ``columns.FRAMES``, (n_frames,). players: ``columns.PLAYERS``, (n_frames, 22).
        params: the server's parameters as the log lists them.

    Returns:
        ``definitions.COLUMNS``, (n_events,) each; texts are NumPy text arrays.
    """
    if not len(frames["cycle"]):
        return typed({column.name: np.empty(0) for column in COLUMNS})
    # Logs may hold any number as a place; what follows from one that is none is none.
    with np.errstate(all="ignore"):
        play = Play.of(frames, players, params)
        return _table(play, list(_all(play)))


def _all(play: Play) -> Iterator[Found]:
    goal, scored = transfers.goals(play)
    yield goal
    yield scored
    yield transfers.out_of_bounds(play)
    for found in (*transfers.transfers(play), *own.touches_of_one(play, scored)):
        yield found
        if found.kind is EventKind.PASS:
            yield own.through_passes(play, found)
        elif found.kind is EventKind.DRIBBLE:
            yield own.self_passes(play, found)
    yield from own.duels(play)
    yield from possession.possession(play)
    yield from referee.by_mode(play)
    yield from referee.of_players(play)


def _table(play: Play, found: Sequence[Found]) -> Columns:
    order = list(EventKind)
    frame = np.concatenate([one.frame for one in found])
    end = np.concatenate([one.end_frame for one in found])
    rank = np.concatenate([np.full(len(one.frame), order.index(one.kind)) for one in found])
    side = np.concatenate([one.side for one in found])
    touched = np.concatenate([np.full(len(one.frame), one.touched) for one in found])
    shot, expected = rank == order.index(EventKind.SHOT), np.full(len(frame), np.nan)
    expected[shot] = expected_goals(play.frames, play.players, frame=frame[shot], side=side[shot])
    start, stop = play.ball[frame], play.ball[end]
    made: Columns = {
        "kind": np.concatenate([np.full(len(one.frame), one.kind.value) for one in found]),
        "outcome": np.concatenate([one.outcome for one in found]),
        "frame": frame,
        "cycle": play.frames["cycle"][frame],
        "stoppage": play.frames["stoppage"][frame],
        "playmode": play.frames["playmode"][frame],
        "end_frame": end,
        "end_cycle": play.frames["cycle"][end],
        "side": side,
        "unum": np.concatenate([one.unum for one in found]),
        "other_side": np.concatenate([one.other_side for one in found]),
        "other_unum": np.concatenate([one.other_unum for one in found]),
        "x": start[:, 0],
        "y": start[:, 1],
        "end_x": stop[:, 0],
        "end_y": stop[:, 1],
        "length": np.hypot(*(stop - start).T),
        "speed": np.where(touched, np.hypot(*play.step[frame].T), np.nan),
        "expected_goals": expected,
    }
    sort = np.lexsort((rank, frame))
    return typed({name: values[sort] for name, values in made.items()})
