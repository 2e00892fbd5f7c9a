"""``Recovered``: the commands that a game log implies."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Basis(IntEnum):
    """What the numbers of a command are known by. Ids are stable."""

    MOVEMENT = 0
    """What it did, but for the noise of the server."""
    CONTACT = 1
    """So too, but the body that it moved collided: its velocity alone shows what it did, to one more digit less."""
    BOUND = 2
    """A limit of the server hides part of it: the power is only bounded."""
    LEGS = 3
    """A dash of two legs: its numbers are those of the sum of both, see ``turned``."""
    SHARED = 4
    """Several players pushed the ball in one cycle: nothing is known but the kind."""
    HIDDEN = 5
    """Nothing is known but the kind, and of a dash its power.

    It had no effect, a referee or a post came between, or the log lacks what it takes.
    """


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovered:
    """The executed commands of a match that its game log implies, n body commands and turns of the neck.

    They are in the order of frames and, within one, of players; a turn of the neck follows its player's body command,
    and so does a dash with two legs beside a kick.

    Numbers are as the server uses them, clipped and rounded (see `commands.used_arguments`), in the order of the
    command's syntax: power and direction of a dash or kick, moment of a turn, direction of a tackle or catch, place
    of a move as its player sends it; degrees, metres.

    Intervals hold the truth in nine of ten cases by the server's noise alone, whatever players like to do. A value
    knows habits, too: what its team does often is the likelier truth. So it may lie outside of its interval.

    Attributes:
        frame: (n,) int32, index of the frame that the command acts on.
        slot: (n,) int8, place on the player axis: left 1..11, then right 1..11.
        kind: (n,) uint8, the CommandKind.
        value: (n, 2) float64, NaN where unknown and for numbers that the command does not have.
        low, high: (n, 2) float64, ends of the interval; the whole range where ``value`` is unknown. Of directions one
            end may lie beyond 180 degrees. NaN for numbers that the command does not have.
        basis: (n,) uint8, the Basis.
        turned: (n,) float64, degrees by which a dash of two legs turned the body, with noise; else 0.
        gaps: what the log cannot give at all, a line each.
    """

    frame: NDArray[np.int32]
    slot: NDArray[np.int8]
    kind: NDArray[np.uint8]
    value: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    basis: NDArray[np.uint8]
    turned: NDArray[np.float64]
    gaps: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.frame)

    def select(self, rows: NDArray[Any] | slice) -> Recovered:
        """Return some of the commands: indices, a mask or a slice."""
        return Recovered(
            frame=self.frame[rows],
            slot=self.slot[rows],
            kind=self.kind[rows],
            value=self.value[rows],
            low=self.low[rows],
            high=self.high[rows],
            basis=self.basis[rows],
            turned=self.turned[rows],
            gaps=self.gaps,
        )
