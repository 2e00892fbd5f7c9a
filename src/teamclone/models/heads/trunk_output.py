"""What a trunk hands to its head."""

from __future__ import annotations

from typing import NamedTuple

from torch import Tensor


class KickFeatures(NamedTuple):
    """What kicks and tackles are decided on: first the situations as they are, then their mirror images.

    Attributes:
        hidden: (2 * kicks, kick width). geometry: (2 * kicks, columns of geometry).
        targets: (2 * kicks, TARGETS, width) what `PlayerEncoder` knows of each team mate and of the goal; None without
            an encoder.
    """

    hidden: Tensor
    geometry: Tensor
    targets: Tensor | None


class TrunkOutput(NamedTuple):
    """What the trunk of the egocentric family makes of a batch of situations.

    Attributes:
        hidden: (batch, width) features of the command.
        parameters: (batch, parameter width) features of dashes and turns; empty where the head has no use for them.
        at_ball: features of kicks and tackles; empty where the head has no use for them.
        kicks: (kicks,) indices of the situations that ``at_ball`` describes; None for all.
        geometry: (batch, at least len(GEOMETRY)).
        bearing: (batch, targets) radians from the body to each of the `TargetPoints`.
        power: (batch, targets) dash power towards each of them.
    """

    hidden: Tensor
    parameters: Tensor
    at_ball: KickFeatures
    kicks: Tensor | None
    geometry: Tensor
    bearing: Tensor
    power: Tensor
