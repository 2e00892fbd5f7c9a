"""What a player does next with the ball: one answer a time that it comes to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teamclone.events.definitions import PRESS_M, EventKind, Outcome
from teamclone.logs.match import Columns
from teamclone.rcss.players import N_TEAM
from teamclone.scout.places import LANES, THIRDS, lane, third
from teamclone.scout.seen import Bools, Floats, Ints, Seen

LOST_PASS, DRIBBLE, SHOT, CLEARANCE, HOLD = range(N_TEAM, N_TEAM + 5)
"""Answers beside a pass, which is its receiver, 0 to 10. Of a pass that is lost nobody knows for whom it was."""
N_ANSWERS = N_TEAM + 5
HOLD_CYCLES = 10
"""A player that touches the ball for longer without a dash holds it."""
CELLS = (N_TEAM, len(THIRDS), len(LANES), 2)
"""A cell: the number, the third and the lane of the ball, and whether an opponent is within PRESS_M of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decisions:
    """What the players of the team did with the ball, in the order of frames.

    Attributes:
        frame: (n,) of the first touch. cell: (4, n) indices into CELLS. answer: (n,) what it did.
        start, end: (n, 2) m, the ball at the first touch and at the next one of somebody else, or of a dribble.
    """

    frame: Ints
    cell: Ints
    answer: Ints
    start: Floats
    end: Floats

    def __len__(self) -> int:
        return len(self.frame)


def decisions(seen: Seen) -> Decisions:
    """Return the decisions of a match.

    Kicks of one player without a dash between are one decision, as a pass may take several; its answer is that of the
    last. Kicks whose meaning nobody knows (both teams touched the ball, a foul) are left out.
    """
    kicks = _kicks(seen)
    answer, end = _answered(seen, kicks)
    n = len(answer)
    who = np.where(kicks["own"], 0, N_TEAM + 1) + kicks["unum"].astype(np.int64)
    begins = np.ones(n, np.bool_)
    begins[1:] = (who[1:] != who[:-1]) | (answer[:-1] >= 0)
    first = np.flatnonzero(begins)
    last = np.append(first[1:], n)[: len(first)] - 1
    held = kicks["frame"][last] - kicks["frame"][first] > HOLD_CYCLES
    answer = np.where(held, HOLD, answer[last])
    keep = kicks["own"][first] & (kicks["unum"][first] > 0) & (answer >= 0)
    first, last, answer = first[keep], last[keep], answer[keep]
    frame = kicks["frame"][first].astype(np.int64)
    start = np.stack([kicks["x"][first], kicks["y"][first]], -1)
    known = np.isfinite(start).all(1)
    cell = np.stack(
        [
            kicks["unum"][first].astype(np.int64) - 1,
            third(start[:, 0]),
            lane(start[:, 1]),
            pressed(seen, frame).astype(np.int64),
        ]
    )
    return Decisions(
        frame=frame[known], cell=cell[:, known], answer=answer[known], start=start[known], end=end[last][known]
    )


def pressed(seen: Seen, frame: Ints) -> Bools:
    """Return (n,) whether an opponent is within PRESS_M of the ball in some frames."""
    apart = np.linalg.norm(seen.places[frame, N_TEAM:] - seen.ball[frame, None], axis=-1)
    found: Bools = (apart <= PRESS_M).any(1)
    return found


def _kicks(seen: Seen) -> Columns:
    """Return the kicks of both teams by frame, those of one frame by team and number."""
    kicks = seen.pick(EventKind.KICK, own=None)
    order = np.lexsort((kicks["unum"], kicks["own"], kicks["frame"]))
    return {name: values[order] for name, values in kicks.items()}


def _answered(seen: Seen, kicks: Columns) -> tuple[Ints, Floats]:
    """Return what each kick (n,) did, -1 where it is no action, and where the ball then is (n, 2) m."""
    answer, end = np.full(len(kicks["frame"]), -1), np.full((len(kicks["frame"]), 2), np.nan)
    kind = np.full(len(seen.events["kind"]), -1)
    for action, code in (
        (EventKind.DRIBBLE, DRIBBLE),
        (EventKind.CLEARANCE, CLEARANCE),
        (EventKind.SHOT, SHOT),
        (EventKind.PASS, LOST_PASS),
    ):
        kind[seen.events["kind"] == action.value] = code
    there = (kind >= 0) & (seen.events["outcome"] != str(Outcome.RESTART)) & (seen.events["unum"] > 0)
    did = {name: values[there] for name, values in seen.events.items()}
    kind = kind[there]
    received = (kind == LOST_PASS) & (did["own"] == did["other_own"]) & (did["other_unum"] > 0)
    kind = np.where(received, did["other_unum"].astype(np.int64) - 1, kind)
    place = {key: at for at, key in enumerate(_keys(kicks))}
    for at, key in enumerate(_keys(did)):
        if key in place:
            answer[place[key]] = kind[at]
            end[place[key]] = did["end_x"][at], did["end_y"][at]
    return answer, end


def _keys(events: Columns) -> list[tuple[int, bool, int]]:
    return list(zip(events["frame"].tolist(), events["own"].tolist(), events["unum"].tolist(), strict=True))
