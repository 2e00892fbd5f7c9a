"""What the players of a cloned team do in a cycle."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.engine.clone import CompiledClone
from teamclone.engine.inputs.layout import PAST_FRAMES
from teamclone.engine.network.draw import COMPONENT, DASH_DIRECTION, FIRST, KIND, SECOND, UNIFORMS
from teamclone.live.asking import ask, load_kernels
from teamclone.rcss.commands import CommandKind, parameters_of
from teamclone.world.world import World

HISTORY = PAST_FRAMES
"""Cycles before the present that a world needs to have."""


class Order(NamedTuple):
    """A body command: its kind, None for none, and its numbers."""

    kind: CommandKind | None
    numbers: tuple[float, ...]


class Draw(StrEnum):
    """What is drawn from a clone's answer; the rest is the likeliest."""

    NOTHING = "nothing"
    COMMANDS = "commands"
    CASES = "cases"
    """Commands, and which of the cases that their numbers fall into: which of several places, for one."""
    ALL = "all"
    """Commands and their numbers."""


_MOST_PROBABLE = {
    Draw.NOTHING: (KIND, COMPONENT, DASH_DIRECTION),
    Draw.COMMANDS: (COMPONENT, DASH_DIRECTION),
    Draw.CASES: (DASH_DIRECTION,),
    Draw.ALL: (),
}
"""Random numbers in whose place the most probable is taken."""


class Decisions:
    """The decisions of a clone.

    Args:
        draw: what is drawn. seed: of the random numbers for it.
    """

    def __init__(self, clone: CompiledClone, *, draw: Draw = Draw.COMMANDS, seed: int = 0) -> None:
        self._clone, self._draw = clone, draw
        self._random = np.random.default_rng(seed)
        self._kinds = [None if name == "none" else CommandKind[name.upper()] for name in clone.commands]
        given = [parameter.kind for parameter in parameters_of(clone.commands)]
        self._lengths = {kind: given.count(kind) for kind in given}

    def load(self) -> None:
        """Load or compile the kernels, which else happens at the first answer; use it before time matters."""
        answers = load_kernels(self._clone, history=HISTORY)
        self._clone.network.samples(answers, np.zeros((len(answers), UNIFORMS)))

    def of(
        self, world: World, unums: Sequence[int], *, movers: Collection[int] = (), catchers: Collection[int] = ()
    ) -> dict[int, Order]:
        """Return the commands of players of the team, by their numbers, in the last frame of a world.

        Args:
            movers, catchers: whose move or catch the server would take; of the others it would leave a hole.
        """
        if not unums:
            return {}
        answers, _ = ask(self._clone, world, np.asarray(unums, np.int64) - 1, history=HISTORY)
        network = self._clone.network
        for unum, answer in zip(unums, answers, strict=True):
            self._bar(network.view(answer).probabilities, unum in movers, unum in catchers)
        uniforms = self._random.random((len(unums), UNIFORMS))
        uniforms[:, _MOST_PROBABLE[self._draw]] = -1.0
        if self._draw is not Draw.ALL:
            uniforms[:, (FIRST, SECOND)] = 0.5  # power and direction of a kick stay those of one component
        chosen, numbers = network.samples(answers, uniforms)
        orders = {}
        for unum, place, values in zip(unums, chosen.tolist(), numbers.tolist(), strict=True):
            kind = self._kinds[place]
            orders[unum] = Order(kind, () if kind is None else tuple(values[: self._lengths[kind]]))
        return orders

    def _bar(self, probabilities: NDArray[np.float32], moves: bool, catches: bool) -> None:
        """Take commands that the server would not take out of a player's probabilities, in place."""
        for kind, taken in ((CommandKind.MOVE, moves), (CommandKind.CATCH, catches)):
            if not taken and kind in self._kinds:
                probabilities[self._kinds.index(kind)] = 0.0
