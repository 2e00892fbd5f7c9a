"""Is a match what the step of a cycle makes of it, to the resolution of its log?"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.bodies import BALL, Bodies, Commands
from teamclone.dynamics.logged import Logged
from teamclone.dynamics.residuals import residuals
from teamclone.dynamics.rules import Rules
from teamclone.dynamics.step import step
from teamclone.logs.match import Match

HALF_STEP = {
    "x": 5e-5,
    "y": 5e-5,
    "vx": 5e-5,
    "vy": 5e-5,
    "body": 5e-4,
    "neck": 5e-4,
    "stamina": 5e-3,
    "effort": 5e-7,
    "recovery": 5e-7,
    "capacity": 0.5,
}
"""Half of the step by which a text log rounds each value."""
FLOAT32 = 1e-7
"""By which share of it a value is rounded in memory."""
REPLICAS = 24


@dataclass(frozen=True)
class Transitions:
    """Cycles of a match whose next one is in its log, all of whose commands are known and in which no referee acts."""

    before: Bodies
    commands: Commands
    succeeded: NDArray[np.bool_]
    after: Bodies
    rules: Rules
    cycle: NDArray[Any]


def transitions(match: Match) -> Transitions:
    """The cycles of play_on in which nothing but the physics acts."""
    logged = Logged.of(match)
    rules = Rules.of(match.game.server_params, match.game.player_types)
    rows = residuals(logged, rules).frame
    rows = rows[~logged.unknown[rows].any(axis=-1)]
    before, after = logged.bodies.select(rows), logged.bodies.select(rows + 1)
    same = ((before.on_field == after.on_field) & (before.type == after.type)).all(axis=-1)
    rows = rows[same]
    return Transitions(
        before=before.select(same),
        commands=logged.commands.select(rows),
        succeeded=logged.succeeded[rows],
        after=after.select(same),
        rules=rules,
        cycle=match.frames["cycle"][rows],
    )


def outside(moves: Transitions) -> dict[str, NDArray[np.bool_]]:
    """Of each value whether it is none that the step gives for what the log may have rounded.

    The step is computed for bodies as logged and for REPLICAS of them, each anywhere within the resolution. What it
    gives is a range, widened by its own width, since few replicas do not reach its ends, and by the resolution of
    the result.
    """
    base = step(moves.before, moves.commands, moves.rules, succeeded=moves.succeeded)
    results = [base, *(_replica(moves, np.random.default_rng(seed)) for seed in range(REPLICAS))]
    found = {}
    for name, half in HALF_STEP.items():
        off = np.stack([getattr(result, name) - getattr(base, name) for result in results])
        error = getattr(moves.after, name) - getattr(base, name)
        if name == "body":
            off, error = ((values + 180.0) % 360.0 - 180.0 for values in (off, error))
        least, most = off.min(axis=0), off.max(axis=0)
        slack = half + FLOAT32 * np.abs(getattr(base, name)) + (most - least)
        # Written so that NaN is outside.
        found[name] = ~((error >= least - slack) & (error <= most + slack))
        found[name][:, :BALL] &= moves.after.on_field
    return found


def _replica(moves: Transitions, rng: np.random.Generator) -> Bodies:
    rounded = {
        name: getattr(moves.before, name) + rng.uniform(-half, half, getattr(moves.before, name).shape)
        for name, half in HALF_STEP.items()
    }
    return step(replace(moves.before, **rounded), moves.commands, moves.rules, succeeded=moves.succeeded)


def told(moves: Transitions, found: dict[str, NDArray[np.bool_]]) -> list[str]:
    """The first of the values that are outside, for an assertion to show."""
    return [
        f"cycle {moves.cycle[row]}: {name} of {'the ball' if body == BALL else f'player {body}'} "
        f"is {getattr(moves.after, name)[row, body]:.4f}"
        for name, wrong in found.items()
        for row, body in np.argwhere(wrong)[:5]
    ]
