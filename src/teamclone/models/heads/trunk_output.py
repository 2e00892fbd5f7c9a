"""The output of a trunk, the input of its head."""

from __future__ import annotations

from typing import NamedTuple

from torch import Tensor

from teamclone.models.inputs.geometry import Inputs


class KickFeatures(NamedTuple):
    """Features for kicks and tackles: first of the situations, then of their mirror images.

    Attributes:
        hidden: (2 * kicks, kick width). inputs: of (2 * kicks) situations.
        targets: (2 * kicks, TARGETS, width) embedding by `PlayerEncoder` of each team mate and of the goal; None
            without an encoder.
    """

    hidden: Tensor
    inputs: Inputs
    targets: Tensor | None


class TrunkOutput(NamedTuple):
    """Output of the egocentric family's trunk for a batch of situations.

    Attributes:
        hidden: (batch, width) features of the command.
        parameters: (batch, parameter width) features of dashes and turns; empty where the head has no use for them.
        at_ball: features of kicks and tackles; empty where the head has no use for them.
        kick_rows: (kicks,) indices of the situations that ``at_ball`` describes; None for all.
        geometry: (batch, len(GEOMETRY)).
        bearing: (batch, targets) radians from the body to each of the `TargetPoints`.
        power: (batch, targets) dash power towards each of them.
    """

    hidden: Tensor
    parameters: Tensor
    at_ball: KickFeatures
    kick_rows: Tensor | None
    geometry: Tensor
    bearing: Tensor
    power: Tensor
