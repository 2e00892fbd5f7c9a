"""How far `sight` is what players were really sent, by the logs that they wrote."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import LogError
from teamclone.logs.align import frame_of
from teamclone.logs.match import Columns
from teamclone.percepts.offline_log import OfflineLog, ShownObjects
from teamclone.percepts.sight import BALL, HIDDEN, Sight
from teamclone.percepts.vision import CHANGE_STEP, DIRECTION_CHANGE_STEP_DEG, DIRECTION_STEP_DEG, DISTANCE_STEP_M
from teamclone.rcss.players import N_TEAM

_BEFORE = 1
"""The clients of a match connect one after another in cycle 0, of which the log has one frame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """Counts over cycles and objects; they add up.

    Attributes:
        cycles: of which it is known whether there was a visual message, see `Sight.sure`; same_cycles: those where it
            was as expected. unsure: the other cycles.
        shown: players and balls in the messages of cycles in which one was expected, too. same_shown: those of them
            that are expected. not_shown: further expected ones that no message had.
        same_distance, same_direction: of same_shown, within half a step of the server's grid.
        changes: of same_shown, those with a velocity. same_distance_change, same_direction_change: within half a step.
    """

    cycles: int = 0
    same_cycles: int = 0
    unsure: int = 0
    shown: int = 0
    same_shown: int = 0
    not_shown: int = 0
    same_distance: int = 0
    same_direction: int = 0
    changes: int = 0
    same_distance_change: int = 0
    same_direction_change: int = 0

    def __add__(self, other: Agreement) -> Agreement:
        return Agreement(**{each.name: getattr(self, each.name) + getattr(other, each.name) for each in fields(self)})

    def shares(self) -> dict[str, float]:
        """Return shares from 0 to 1, NaN of nothing.

        ``cycles``, ``shown`` (the same of all that either has), ``distance``, ``direction``, ``distance_change`` and
        ``direction_change``.
        """
        whole = {
            "cycles": (self.same_cycles, self.cycles),
            "shown": (self.same_shown, self.shown + self.not_shown),
            "distance": (self.same_distance, self.same_shown),
            "direction": (self.same_direction, self.same_shown),
            "distance_change": (self.same_distance_change, self.changes),
            "direction_change": (self.same_direction_change, self.changes),
        }
        return {name: part / total if total else float("nan") for name, (part, total) in whole.items()}


def agreement(frames: Columns, teams: tuple[str, str], seen: Sight, log: OfflineLog) -> Agreement:
    """Return how far the expected messages of a player are those of its log.

    Args:
        frames: ``cycle`` and ``stoppage`` of the match, (n_frames,). teams: names of the left and the right team.

    Raises:
        LogError: the log has no cycle of the match, or names of other teams.
    """
    foreign = [name for name in log.objects.teams if name not in teams]
    if foreign:
        raise LogError(f"the log of player {log.unum} shows team {foreign[0]!r}, the match has {' and '.join(teams)}")
    frame = frame_of(frames, log.cycle, log.stoppage, has_stoppage=True)
    frame[log.cycle < _BEFORE] = -1
    if not (frame >= 0).any():
        raise LogError(f"the log of player {log.unum} has no cycle of the match")
    me = log.unum - 1 + (N_TEAM if log.side < 0 else 0)
    row = np.flatnonzero(frame >= 0)
    sure, expected = seen.sure[frame[row], me], seen.received[frame[row], me]
    same = expected == log.received[row]
    frame[row[~(expected & log.received[row])]] = -1
    return _objects(seen, log.objects, frame, _places(log, teams), me) + Agreement(
        cycles=int(sure.sum()), same_cycles=int((same & sure).sum()), unsure=int((~sure).sum())
    )


def _objects(
    seen: Sight, objects: ShownObjects, frame: NDArray[np.int32], place: NDArray[np.int64], me: int
) -> Agreement:
    """Return the counts of objects in the messages of one player.

    Args:
        frame: of each row of the log, -1 where not both have a message. place: see `_places`. me: place of the player.
    """
    taken = np.flatnonzero(frame[objects.row] >= 0)
    at, place = frame[objects.row[taken]], place[taken]
    free = seen.what[:, me] != HIDDEN  # what no object of a message was found to be
    distance, direction = objects.distance[taken], objects.direction[taken]
    known = np.flatnonzero(place >= 0)
    found = np.zeros(len(taken), np.bool_)
    found[known] = free[at[known], place[known]]
    free[at[known], place[known]] = False
    for index in np.flatnonzero(place < 0):  # without a number: the free one at this place
        here = free[at[index]].copy()
        here &= np.abs(seen.distance[at[index], me] - distance[index]) < DISTANCE_STEP_M / 2
        here &= np.abs(seen.direction[at[index], me] - direction[index]) < DIRECTION_STEP_DEG / 2
        here[BALL] = False
        if here.any():
            place[index] = np.argmax(here)
            found[index], free[at[index], place[index]] = True, False
    at, place, taken = at[found], place[found], taken[found]
    far, turned = seen.distance[at, me, place], seen.direction[at, me, place]
    told = objects.change[taken]
    off = np.abs(seen.change[at, me, place] - told)
    grid = CHANGE_STEP * np.maximum(far, DISTANCE_STEP_M)
    return Agreement(
        shown=len(found),
        same_shown=int(found.sum()),
        not_shown=int(free[frame[frame >= 0]].sum()),
        same_distance=int((np.abs(far - objects.distance[taken]) < DISTANCE_STEP_M / 2).sum()),
        same_direction=int((np.abs(turned - objects.direction[taken]) < DIRECTION_STEP_DEG / 2).sum()),
        changes=int((~np.isnan(told[:, 0])).sum()),
        same_distance_change=int((off[:, 0] < grid / 2).sum()),
        same_direction_change=int((off[:, 1] < DIRECTION_CHANGE_STEP_DEG / 2).sum()),
    )


def _places(log: OfflineLog, teams: tuple[str, str]) -> NDArray[np.int64]:
    """Return (n_objects,) the place of each object on the axis of `sight`, -1 where its number is not told."""
    objects = log.objects
    right = np.array([N_TEAM * (name == teams[1]) for name in objects.teams] or [0])
    place = objects.unum.astype(np.int64) - 1 + right[np.maximum(objects.team, 0)]
    place[(objects.unum == 0) | (objects.unum > N_TEAM)] = -1
    return np.where(objects.ball, BALL, place)
