"""Plain quantities beside the inputs of a network, for layers that turn places and motions into commands.

Features end in these columns as they are, neither normalised nor limited. Layers read them by name, see `Inputs`, and
`engine.inputs.layout` for what they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from teamclone.engine.inputs.layout import GEOMETRY, MATES, OTHER, OTHERS, TACKLE, WAY
from teamclone.planner.columns import WAYS

_PLACE = {name: index for index, name in enumerate(GEOMETRY)}


def geometry_of(geometry: Tensor, *names: str) -> list[Tensor]:
    """Return columns of GEOMETRY, (batch, 1) each."""
    return [geometry[:, _PLACE[name], None] for name in names]


def mates_of(geometry: Tensor) -> Tensor:
    """Return (batch, MATES, 2) the positions of the team mates."""
    first = _PLACE["mate_0_x"]
    return geometry[:, first : first + 2 * MATES].reshape(-1, MATES, 2)


class Inputs(NamedTuple):
    """The parts of egocentric inputs.

    Attributes:
        columns: (batch, columns) of the blocks, normalised.
        geometry: (batch, len(GEOMETRY)).
        others: (batch, OTHERS, len(OTHER)).
        tackle: (batch, len(TACKLE)).
        ways: (batch, len(WAYS), 3): of each way whether there is one, and the velocity of the ball, metres per cycle.
            The last three are empty where the inputs leave them out.
    """

    columns: Tensor
    geometry: Tensor
    others: Tensor
    tackle: Tensor
    ways: Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class InputLayout:
    """The order of `Inputs` in the one tensor in which they are made, cached and mirrored.

    Attributes:
        columns: number of columns of the blocks. others, plan: whether these parts are there.
    """

    columns: int
    others: bool
    plan: bool

    @property
    def tail(self) -> tuple[str, ...]:
        """Names of what follows the columns of the blocks."""
        return (
            *GEOMETRY,
            *(f"other_{i}_{name}" for i in range(OTHERS * self.others) for name in OTHER),
            *((TACKLE + WAY) * self.plan),
        )

    def unpack(self, packed: Tensor) -> Inputs:
        """Return the parts of (batch, columns + len(tail)) inputs, as views."""
        widths = [
            *(self.columns, len(GEOMETRY), OTHERS * len(OTHER) * self.others),
            *(len(TACKLE) * self.plan, len(WAY) * self.plan),
        ]
        columns, geometry, others, tackle, ways = torch.split(packed, widths, 1)
        n = packed.shape[0]
        return Inputs(
            columns,
            geometry,
            others.reshape(n, OTHERS * self.others, len(OTHER)),
            tackle,
            ways.reshape(n, len(WAYS) * self.plan, 3),
        )
