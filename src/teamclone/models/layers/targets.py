"""Target points: places on the pitch to which a player may be running, predicted by a small network.

Most commands off the ball serve to come to a place that follows from the ball, the offside line and the player's role:
first a turn towards it, then dashes. A network that only sees numbers would have to learn the rotation into the
player's axes from examples; here it learns the place, and geometry does the rest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from teamclone.engine.network.constants import PLACE_X, PLACE_Y, TURN_DEG
from teamclone.models.inputs.geometry import geometry_of


def layers(widths: Sequence[int], activation: type[nn.Module], dropout: float = 0.0) -> nn.Sequential:
    """Return linear layers, each with its activation; for fewer than two widths the identity."""
    parts: list[nn.Module] = []
    for width_in, width_out in pairwise(widths):
        parts += [nn.Linear(width_in, width_out), activation()]
        if dropout:
            parts.append(nn.Dropout(dropout))
    return nn.Sequential(*parts)


class TargetPoints(nn.Module):
    """``count`` places; the first half of them stays a metre behind the offside line, as players do.

    Args:
        width: of the inputs they follow from.
        count: of places.
        hidden: widths of the layers between.
    """

    scale: Tensor

    def __init__(self, width: int, count: int, hidden: Sequence[int], activation: type[nn.Module]) -> None:
        super().__init__()
        self.count = count
        if not count:
            return
        self.body = layers((width, *hidden), activation)
        self.place = nn.Linear((width, *hidden)[-1], 2 * count)
        self.register_buffer("scale", torch.tensor([PLACE_X, PLACE_Y]), persistent=False)

    def forward(self, context: Tensor, geometry: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return the inputs of the places, and the bearing and dash power to each.

        Args:
            context: (batch, width). geometry: (batch, len(GEOMETRY)).

        Returns:
            (batch, TARGET_COLUMNS * count) inputs; (batch, count) radians from the body to the place, from where the
            player comes to rest; (batch, count) dash power after which the player rolls as far as from there to the
            place. It counts the present velocity twice, but agents of the league compute it so.
        """
        if not self.count:
            nothing = context.new_zeros(context.shape[0], 0)
            return nothing, nothing, nothing
        hidden = self.body(context).float()
        # In single precision: in bfloat16 a place would be known to a quarter of a metre.
        with torch.autocast(context.device.type, enabled=False):
            places = functional.linear(hidden, self.place.weight, self.place.bias).view(-1, self.count, 2) * self.scale
            x, y, cos, sin, line = geometry_of(geometry, "coast_x", "coast_y", "cos", "sin", "line_x")
            half = self.count // 2
            kept = torch.minimum(places[:, :half, 0], line - 1.0)
            ahead = torch.cat([kept, places[:, half:, 0]], 1) - x
            aside = places[..., 1] - y
            ahead, aside = ahead * cos + aside * sin, aside * cos - ahead * sin
            distance = torch.sqrt(ahead.square() + aside.square() + 1e-4)
            bearing = torch.atan2(aside, ahead + 1e-6)
            degrees = bearing * (180 / math.pi)
            near, forward, decay, gain = geometry_of(geometry, "near_m", "forward", "decay", "dash_gain")
            power = (ahead * (1 - decay) - forward) / gain.clamp(min=1e-4)
            columns = torch.stack(
                [
                    ahead / 20,
                    aside / 20,
                    torch.log(distance + 0.1),
                    ahead / distance,
                    aside / distance,
                    ((degrees.abs() - TURN_DEG) / 10).clamp(-1, 1),
                    (degrees / 10).clamp(-1, 1),
                    # Whether a straight run passes within ``near`` of the place, and whether the player is there.
                    (aside.abs() - near).clamp(-1, 1),
                    (distance - near).clamp(-2, 2) / 2,
                    (power / 100).clamp(-0.5, 1.5),
                ],
                -1,
            )
        return columns.flatten(1), bearing, power
