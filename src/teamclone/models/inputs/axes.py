"""The acting player's axes: the player is the origin, the first axis points along the body, the second to the right."""

from __future__ import annotations

import torch
from torch import Tensor


class Axes:
    """Axes of one player a sample.

    Attributes:
        origin: (batch, 2) metres. cos, sin: (batch,) of the body direction.
    """

    def __init__(self, origin: Tensor, body: Tensor) -> None:
        self.origin, self.cos, self.sin = origin, torch.cos(body), torch.sin(body)

    def turn(self, vector: Tensor) -> Tensor:
        """Return (batch, ..., 2) vectors of the pitch in these axes."""
        shape = (-1, *(1 for _ in vector.shape[1:-1]))
        cos, sin = self.cos.view(shape), self.sin.view(shape)
        x, y = vector[..., 0], vector[..., 1]
        return torch.stack([x * cos + y * sin, y * cos - x * sin], -1)

    def see(self, place: Tensor) -> Tensor:
        """Return (batch, ..., 2) places on the pitch in these axes."""
        shape = (-1, *(1 for _ in place.shape[1:-1]), 2)
        return self.turn(place - self.origin.view(shape))

    def polar(self, place: Tensor) -> Tensor:
        """Return (batch, 5) columns of a place on the pitch in these axes, see `polar`."""
        return polar(self.see(place))

    def angle(self, vector: Tensor) -> Tensor:
        """Return (batch,) radians from the body to a vector of the pitch."""
        turned = self.turn(vector)
        return torch.atan2(turned[:, 1], turned[:, 0])


def polar(relative: Tensor) -> Tensor:
    """Return (..., 5) relative places (..., 2): both coordinates in 20 m, log distance, cosine and sine."""
    distance = torch.sqrt(relative.square().sum(-1, keepdim=True) + 1e-8)
    return torch.cat([relative / 20, torch.log(distance + 0.1), relative / distance], -1)
