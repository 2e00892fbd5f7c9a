"""``simulate``: worlds of a match many cycles ahead."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.bodies import N_BODIES
from teamclone.dynamics.step import step
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS
from teamclone.rollouts.policies import Policy, nothing
from teamclone.rollouts.worlds import Worlds


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectories:
    """What ball and players do over the cycles of roll-outs.

    Attributes:
        x, y: (n, horizon + 1, 23) float32 metres in the log's frame of reference; the first is the start.
        kind: (n, horizon, 22) the CommandKind that each player executed in each cycle, 0 none.
    """

    x: NDArray[np.float32]
    y: NDArray[np.float32]
    kind: NDArray[np.uint8]


def simulate(
    worlds: Worlds,
    frames: NDArray[np.int64],
    policies: Sequence[Policy],
    *,
    horizon: int,
    rng: np.random.Generator | None,
    on_cycle: Callable[[], None] | None = None,
) -> Trajectories:
    """Return where ball and players go.

    Args:
        worlds: n worlds at their start. frames: (n,) the frames of the match that they start from; ``horizon`` more
            follow in the log.
        policies: who moves the players. Whom none moves stands.
        horizon: cycles. rng: draws the server's noise; None for its mean.
        on_cycle: called after each.
    """
    n = len(frames)
    x, y = (np.empty((n, horizon + 1, N_BODIES), np.float32) for _ in range(2))
    kind = np.empty((n, horizon, N_PLAYERS), np.uint8)
    x[:, 0], y[:, 0] = worlds.bodies.x, worlds.bodies.y
    for ahead in range(horizon):
        commands = nothing(n)
        for policy in policies:
            policy.command(worlds, frames + ahead, commands)
        bodies = step(worlds.bodies, commands, worlds.rules, rng)
        for policy in policies:
            policy.settle(bodies, frames + ahead + 1)
        dashed = ~np.isnan(commands.legs[..., 0]).all(axis=-1)
        executed = np.where(commands.kind == 0, dashed * int(CommandKind.DASH), commands.kind).astype(np.uint8)
        worlds = worlds.after(bodies, commands, executed)
        x[:, ahead + 1], y[:, ahead + 1], kind[:, ahead] = bodies.x, bodies.y, executed
        if on_cycle is not None:
            on_cycle()
    return Trajectories(x=x, y=y, kind=kind)
