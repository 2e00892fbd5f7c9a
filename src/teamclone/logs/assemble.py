"""Steps that all readers of game logs share: stoppage counter, play modes, scores, teams, player types.

A log states the play mode and the teams only when they change, before the first frame they hold for. Readers collect
these statements as *marks*, each with the index of the frame that follows it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.logs import columns
from teamclone.logs.match import Columns, Team, default_player_types, empty_columns
from teamclone.rcss import player_types

SCORES = tuple(column.name for column in columns.FRAMES if column.name.startswith(("left_", "right_")))
"""Columns of the scores in the order of a text log's ``(team ...)`` line and of ``TeamMark.scores``."""

MAX_TYPES = 256
"""A player's ``type`` is one byte. Servers use 18 types."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TeamMark:
    """Names and scores from frame ``frame`` on. ``scores`` stand in the order of ``SCORES``."""

    frame: int
    left: str | None
    right: str | None
    scores: tuple[int, int, int, int, int, int]


MAX_SCORE = 32767
"""The greatest score that its column holds."""
MAX_CYCLE = 2**31 - 1
"""The greatest cycle that its column holds."""


def stoppage_of(cycle: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return how often each cycle was seen just before: ``[7 7 7 8]`` gives ``[0 1 2 0]``. Shape (n_frames,).

    Text and binary logs do not write the stoppage counter, but show the frames of a stopped clock one by one.
    """
    index = np.arange(len(cycle), dtype=np.int32)
    first = np.zeros(len(cycle), np.int32)
    changed = np.flatnonzero(cycle[1:] != cycle[:-1]) + 1
    first[changed] = changed
    stoppage: NDArray[np.int32] = index - np.maximum.accumulate(first)
    return stoppage


def fill_marks(n_frames: int, marks: Sequence[tuple[int, tuple[int, ...]]], width: int) -> NDArray[np.int64]:
    """Return the values of each frame, (n_frames, width): those of the last mark at or before it, else zeros.

    Args:
        marks: (frame index, ``width`` values), by ascending frame. Marks after the last frame change nothing.
    """
    values = np.zeros((len(marks) + 1, width), np.int64)
    for row, (_, mark) in enumerate(marks, start=1):
        values[row] = mark
    starts = np.array([frame for frame, _ in marks], np.int64)
    filled: NDArray[np.int64] = values[np.searchsorted(starts, np.arange(n_frames), side="right")]
    return filled


def frame_columns(
    *,
    cycle: NDArray[np.int32],
    ball: NDArray[np.floating],
    modes: Sequence[tuple[int, int]],
    teams: Sequence[TeamMark],
    stoppage: NDArray[np.int32] | None = None,
) -> Columns:
    """Return the columns ``columns.FRAMES``.

    Args:
        cycle: shape (n_frames,).
        ball: x, y in metres and vx, vy in metres per cycle, shape (n_frames, 4); or x, y alone, shape (n_frames, 2).
        modes: (frame index, play mode id), by ascending frame.
        teams: by ascending frame.
        stoppage: shape (n_frames,); None counts the repetitions of the cycle.
    """
    n_frames = len(cycle)
    made = empty_columns(columns.FRAMES, n_frames)
    made["cycle"][:] = cycle
    made["stoppage"][:] = stoppage_of(cycle) if stoppage is None else stoppage
    made["playmode"][:] = fill_marks(n_frames, [(frame, (mode,)) for frame, mode in modes], 1)[:, 0]
    scores = fill_marks(n_frames, [(mark.frame, mark.scores) for mark in teams], len(SCORES))
    for index, name in enumerate(SCORES):
        made[name][:] = scores[:, index]
    for index, name in enumerate(("ball_x", "ball_y", "ball_vx", "ball_vy")[: ball.shape[1]]):
        made[name][:] = ball[:, index]
    return made


def team_mark(
    frame: int, names: tuple[str | None, str | None], scores: Sequence[float], before: Sequence[TeamMark]
) -> tuple[TeamMark, bool]:
    """Return a statement about the teams, and whether its scores and penalties are numbers that their columns hold.

    Where they are not, a damaged log's, those of the statement ``before`` it stay.

    Args:
        frame, names, scores: of the `TeamMark`.
        before: the statements of the log so far.
    """
    known = all(0 <= score <= MAX_SCORE for score in scores)
    kept = tuple(int(score) for score in scores) if known else before[-1].scores if before else (0,) * len(SCORES)
    first, second, third, fourth, fifth, sixth = kept
    left, right = names
    return TeamMark(frame=frame, left=left, right=right, scores=(first, second, third, fourth, fifth, sixth)), known


def limited_cycle(digits: bytes) -> int:
    """Return a cycle limited to its column's range, from as many digits as a damaged log has."""
    return int(min(float(digits), MAX_CYCLE))


def final_teams(marks: Sequence[TeamMark]) -> tuple[Team, Team]:
    """Return the left and right team with the last score of the log.

    A name once stated stays, even if later marks leave it out.
    """
    left = next((mark.left for mark in reversed(marks) if mark.left is not None), None)
    right = next((mark.right for mark in reversed(marks) if mark.right is not None), None)
    last = marks[-1].scores if marks else (0, 0, 0, 0, 0, 0)
    return (
        Team(name=left, score=last[0], penalties_scored=last[2], penalties_missed=last[3]),
        Team(name=right, score=last[1], penalties_scored=last[4], penalties_missed=last[5]),
    )


def checked_type(fields: Mapping[str, float | str]) -> tuple[int, dict[str, float]]:
    """Return the number (``id``) and the known parameters of a player type.

    Raises:
        ValueError: the number is not in 0..255, or a parameter is no finite number.
    """
    known = {name: fields[name] for name in ("id", *player_types.FIELDS) if name in fields}
    numbers = {name: float(value) for name, value in known.items()}
    if not all(map(math.isfinite, numbers.values())):
        raise ValueError("a parameter of a player type is no finite number")
    number = numbers.pop("id", -1.0)
    if number not in range(MAX_TYPES):
        raise ValueError(f"player type {number:g}, expected 0 to {MAX_TYPES - 1}")
    return int(number), numbers


def player_type_columns(types: Mapping[int, Mapping[str, float]]) -> Columns:
    """Return the columns of ``player_types.FIELDS``, row = type id; missing values are the server's defaults."""
    made = default_player_types(max(types, default=-1) + 1)
    for row, fields in types.items():
        for name, value in fields.items():
            made[name][row] = value
    return made
