"""Inputs of a network: from the raw state to numbers around zero. Part of the model, so every use shares them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

import torch
from torch import Tensor, nn

from teamclone.engine.inputs.paper import BODY_LIMIT_DEG
from teamclone.rcss import pitch
from teamclone.rcss.player_types import GROUPS, RANGES
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.world.channels import CHANNEL, TYPE_FIELD
from teamclone.world.state import State

PLAYERS = (*(f"team_{number}" for number in range(1, 12)), *(f"opponent_{number}" for number in range(1, 12)))
"""The player axis of a state, by name."""


def logged_ball_speed_max(server: Tensor) -> Tensor:
    """Return (...) the fastest ball of a log, whose velocities are after decay; ``server`` (..., server fields)."""
    return server[..., SERVER_FIELD["ball_speed_max"]] * server[..., SERVER_FIELD["ball_decay"]]


class Features(Protocol):
    """The interface of a network's inputs. A new set of inputs is one such module and its place in `clone.Clone`."""

    names: tuple[str, ...]
    channels: tuple[str, ...]
    """The channels of ``State.players`` that it reads: a log that lacks one of them cannot be used."""
    history: int
    """Frames before the present that it reads."""
    signs: Tensor
    """(columns,) -1 for columns that change their sign where left and right are exchanged, else 1."""

    def fit(self, chunks: Iterable[Tensor]) -> None:
        """Fit the normalisation to projected training samples, (n, len(names)) each, chunk by chunk."""

    def project(self, state: State) -> Tensor:
        """Return (batch, len(names)) inputs before normalisation."""

    def counterparts(self, places: Tensor) -> Tensor:
        """Return the column permutation of a left-right reflection, (len(names),); signs are in ``signs``.

        Args:
            places: (22,) each player's counterpart, see `mirror.mirror_places`.
        """

    def normalise(self, columns: Tensor) -> Tensor:
        """Return (batch, len(names)) normalised columns of `project`."""

    def __call__(self, state: State) -> Tensor:
        """Return (batch, len(names)) normalised inputs."""


class Normalisation(nn.Module):
    """Shifts and scales each column to mean 0 and standard deviation 1 of the training samples, then stays as it is."""

    mean: Tensor
    std: Tensor

    def __init__(self, width: int) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(width))
        self.register_buffer("std", torch.ones(width))

    def fit(self, chunks: Iterable[Tensor]) -> None:
        """Take mean and deviation over all rows of the chunks, (n, width) each; a constant column is only shifted."""
        count, total, squares = 0, torch.zeros(len(self.mean)).double(), torch.zeros(len(self.mean)).double()
        for chunk in chunks:
            values = chunk.double()
            count += len(values)
            total += values.sum(0)
            squares += values.square().sum(0)
        mean = total / count
        std = (squares / count - mean.square()).clamp(min=0).sqrt()
        self.mean.copy_(mean)
        # Below this it is rounding: the columns are of the order of 1 in single precision.
        self.std.copy_(torch.where(std > 1e-6, std, 1.0))

    def forward(self, values: Tensor) -> Tensor:
        """Return normalised values, (n, width)."""
        return (values - self.mean) / self.std


class PaperFeatures(nn.Module):
    """Table I: the ball, every player and once more the actor; 119 columns.

    Every value is divided by its bound, which projects it onto [-1, 1]: x and y by the server's bounds of players,
    body by 180 degrees, velocities by their true maximum in a log, speed limit times decay of the ball or of the
    player's own type. Nothing is clipped. Then comes the input normalisation of Table III.

    Args:
        own_type: add the eight parameters of the acting player's type; 127 columns, as in Table III.
        all_types: names of `GROUPS` whose parameters are added for each of the 22 players.
    """

    channels = ("x", "y", "vx", "vy", "body")
    history = 0
    ball_limit: Tensor
    signs: Tensor

    def __init__(self, *, own_type: bool = False, all_types: tuple[str, ...] = ()) -> None:
        super().__init__()
        self.own_type = TypeParameters(tuple(GROUPS)) if own_type else None
        self.all_types = TypeParameters(all_types) if all_types else None
        order = ("x", "y", "body", "vx", "vy")
        names = [f"ball_{name}" for name in ("x", "y", "vx", "vy")]
        names += [f"{player}_{name}" for name in order for player in PLAYERS]
        names += [f"actor_{name}" for name in order]
        if self.own_type is not None:
            names += [f"actor_{name}" for name in self.own_type.names]
        if self.all_types is not None:
            names += [f"{player}_{name}" for name in self.all_types.names for player in PLAYERS]
        self.names = tuple(names)
        self.normalisation = Normalisation(len(names))
        self.register_buffer("ball_limit", torch.tensor([pitch.MAX_X, pitch.MAX_Y]), persistent=False)
        sided = [name.rpartition("_")[2] in ("y", "vy", "body") for name in names]
        self.register_buffer("signs", torch.where(torch.tensor(sided), -1.0, 1.0), persistent=False)

    def counterparts(self, places: Tensor) -> Tensor:
        """Return the column permutation of a left-right reflection, (len(names),); signs are in `signs`.

        Args:
            places: (22,) each player's counterpart, see `mirror.mirror_places`.
        """
        column = {name: index for index, name in enumerate(self.names)}
        order = list(range(len(self.names)))
        for player, place in zip(PLAYERS, places.tolist(), strict=True):
            for name, index in column.items():
                if name.startswith(f"{player}_"):
                    order[index] = column[PLAYERS[place] + name.removeprefix(player)]
        return torch.tensor(order)

    def project(self, state: State) -> Tensor:
        """Return (batch, len(names)) before normalisation."""
        speed = state.types[..., TYPE_FIELD["player_speed_max"]] * state.types[..., TYPE_FIELD["player_decay"]]
        players = torch.stack(
            (
                state.players[..., CHANNEL["x"]] / pitch.MAX_X,
                state.players[..., CHANNEL["y"]] / pitch.MAX_Y,
                state.players[..., CHANNEL["body"]] / BODY_LIMIT_DEG,
                state.players[..., CHANNEL["vx"]] / speed,
                state.players[..., CHANNEL["vy"]] / speed,
            ),
            dim=1,
        )  # (frames, 5, 22)
        frame, actor = state.frame, state.actor
        ball_speed = logged_ball_speed_max(state.server)[:, None]
        ball = torch.cat([state.ball[:, :2] / self.ball_limit, state.ball[:, 2:] / ball_speed], 1)
        parts = [ball[frame], players.flatten(1)[frame], players[frame, :, actor]]
        if self.own_type is not None:
            parts.append(self.own_type(state.types[frame, actor][:, None]).flatten(1))
        if self.all_types is not None:
            parts.append(self.all_types(state.types).flatten(1)[frame])
        return torch.cat(parts, dim=1)

    def fit(self, chunks: Iterable[Tensor]) -> None:
        """Fit the normalisation to projected training samples, chunk by chunk."""
        self.normalisation.fit(chunks)

    def normalise(self, columns: Tensor) -> Tensor:
        """Return (batch, len(names)) normalised columns of `project`."""
        normalised: Tensor = self.normalisation(columns)
        return normalised

    def forward(self, state: State) -> Tensor:
        """Return (batch, len(names)) normalised inputs."""
        return self.normalise(self.project(state))


class TypeParameters(nn.Module):
    """Parameters of player types, (batch, parameter, player), projected onto [-1, 1] by the server's ranges."""

    places: Tensor
    middle: Tensor
    half_range: Tensor

    def __init__(self, groups: tuple[str, ...]) -> None:
        super().__init__()
        self.names = tuple(name for group in groups for name in GROUPS[group])
        low, high = torch.tensor([RANGES[name] for name in self.names]).unbind(1)
        self.register_buffer("places", torch.tensor([TYPE_FIELD[name] for name in self.names]), persistent=False)
        self.register_buffer("middle", ((low + high) / 2)[:, None], persistent=False)
        self.register_buffer("half_range", ((high - low) / 2)[:, None], persistent=False)

    def forward(self, types: Tensor) -> Tensor:
        """Return the projected parameters of ``types``, (batch, players, fields)."""
        values = types.index_select(2, self.places).transpose(1, 2)
        return (values - self.middle) / self.half_range
