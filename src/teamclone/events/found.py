"""Events of one kind as they are found, before all of them become one table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.events.definitions import EventKind, Outcome
from teamclone.events.touches import NOBODY, Bools, Ints, side_of, unum_of

Words = NDArray[Any]
"""Outcomes, (n,) of text."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """Events of one kind: arrays (n,).

    Attributes:
        kind: of all of them. outcome: what became of each.
        frame, end_frame: indices of frames.
        slot, other: places on the player axis, NOBODY where there is none or it is not known.
        side, other_side: of the teams, which may be known where the players are not; 0 of none.
        touched: a touch begins them, so that the ball's way in the next cycle is their speed.
    """

    kind: EventKind
    outcome: Words
    frame: Ints
    end_frame: Ints
    slot: Ints
    other: Ints
    side: NDArray[np.int8]
    other_side: NDArray[np.int8]
    touched: bool

    @classmethod
    def of(
        cls,
        kind: EventKind,
        frame: Ints,
        *,
        outcome: Words | str = Outcome.NONE,
        end_frame: Ints | None = None,
        slot: Ints | None = None,
        other: Ints | None = None,
        side: NDArray[np.signedinteger[Any]] | None = None,
        other_side: NDArray[np.signedinteger[Any]] | None = None,
        touched: bool = False,
    ) -> Found:
        """Return events; what is left out is of nobody, ends where it begins, and has no outcome."""
        n = len(frame)
        slot = np.full(n, NOBODY) if slot is None else slot
        other = np.full(n, NOBODY) if other is None else other
        return cls(
            kind=kind,
            outcome=np.full(n, str(outcome)) if isinstance(outcome, str) else outcome,
            frame=frame,
            end_frame=frame if end_frame is None else end_frame,
            slot=slot,
            other=other,
            side=side_of(slot) if side is None else side.astype(np.int8),
            other_side=side_of(other) if other_side is None else other_side.astype(np.int8),
            touched=touched,
        )

    def where(self, these: Bools, kind: EventKind | None = None) -> Found:
        """Return some of them, on request as another kind."""
        return Found(
            kind=self.kind if kind is None else kind,
            outcome=self.outcome[these],
            frame=self.frame[these],
            end_frame=self.end_frame[these],
            slot=self.slot[these],
            other=self.other[these],
            side=self.side[these],
            other_side=self.other_side[these],
            touched=self.touched,
        )

    @property
    def unum(self) -> NDArray[np.uint8]:
        """Numbers of the players, (n,)."""
        return unum_of(self.slot)

    @property
    def other_unum(self) -> NDArray[np.uint8]:
        """Numbers of the other players, (n,)."""
        return unum_of(self.other)


def words(*choices: tuple[Bools, str], default: str = Outcome.NONE) -> Words:
    """Return the word of the first condition (n,) that holds."""
    return np.select([condition for condition, _ in choices], [str(word) for _, word in choices], str(default))
