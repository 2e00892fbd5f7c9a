"""The game reflected at the long axis: left becomes right, and players change places with their counterparts.

The simulator does not know left from right, so the mirrored command is right in the mirrored situation, if the team
plays the same on both sides. A player's role goes with the number, hence the left back becomes the right back.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from teamclone.rcss.commands import CLONED, parameters_of
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.world.channels import CHANNEL
from teamclone.world.state import State, Target

_BALL = torch.tensor([1.0, -1.0, 1.0, -1.0])
_CHANNELS = torch.ones(len(CHANNEL))
_CHANNELS[[CHANNEL[name] for name in ("y", "vy", "body", "neck")]] = -1.0


@cache
def _arguments(commands: tuple[str, ...]) -> Tensor:
    """Return (commands, 2), -1 for arguments that change their sign."""
    signs = torch.ones(len(commands), 2)
    for item in parameters_of(commands):
        if item.sided:
            signs[commands.index(item.kind.name.lower()), item.argument] = -1.0
    return signs


def mirror_state(state: State, places: Tensor) -> State:
    """Return the situations reflected: y, vy, body and neck negated, now and before; players in exchanged places.

    Args:
        state: the situations.
        places: (22,) int64, each player's counterpart, see `mirror_places`.
    """
    ball, channels = _BALL.to(state.ball), _CHANNELS.to(state.players)
    return state._replace(
        ball=state.ball * ball,
        players=state.players.index_select(1, places) * channels,
        types=state.types.index_select(1, places),
        past_ball=state.past_ball * ball,
        past_players=state.past_players.index_select(2, places) * channels,
        actor=places[state.actor],
    )


def mirror_target(target: Target, commands: tuple[str, ...] = CLONED) -> Target:
    """Return the commands reflected: turn moments, directions and the y of places negated."""
    signs = _arguments(commands).to(target.parameters)[target.kind]
    interval = target.interval
    if interval is not None:
        interval = torch.where(signs[..., None] > 0, interval, -interval.flip(2))
    return Target(target.kind, target.parameters * signs, interval)


def mirror_places(mean: NDArray[np.floating]) -> Tensor:
    """Return (22,) int64 each player's counterpart, whose counterpart is that player again.

    Counterparts in the modelled team have the least squared distance, summed over the team, between where each player
    stands on average and where each stands mirrored. Opponents keep their places: they are many teams, whose numbers
    mean different roles, and no input but the paper's knows an opponent by number.

    Args:
        mean: (22, 2) metres, each player's mean position; NaN for a player that never played, its own counterpart.
    """
    from scipy.optimize import linear_sum_assignment

    # Far away, a player that never played costs nothing as its own counterpart and much as another's.
    team = np.where(np.isfinite(mean[:N_TEAM]), mean[:N_TEAM], (1e4, 0.0))
    cost = np.square(team[:, None] - team[None] * (1.0, -1.0)).sum(-1)
    # The costs are symmetric, so that the best matching is its own inverse, unless several are equally good.
    found = linear_sum_assignment(cost)[1]
    number = np.arange(N_TEAM)
    pairs = np.where(found[found] == number, found, number)
    return torch.from_numpy(np.concatenate([pairs, np.arange(N_TEAM, N_PLAYERS)]))
