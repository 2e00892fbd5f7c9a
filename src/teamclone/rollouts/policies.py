"""Who moves a team in a roll-out: a clone, its log, or nobody new."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
import torch
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.dynamics.bodies import BALL, Bodies, Commands, of_types
from teamclone.dynamics.logged import Logged
from teamclone.rcss.commands import CommandKind, parameters_of
from teamclone.rcss.players import N_TEAM
from teamclone.rollouts.worlds import Worlds, slots_of

if TYPE_CHECKING:
    from teamclone.models.clone import Clone

_ROUNDING_M = 1e-3
"""How much further from the ball than a kick or tackle reaches a clone is asked for them."""


class Policy(Protocol):
    """What moves a team. ``frames`` (n,) are the frames of the match in which the worlds would be now."""

    def command(self, worlds: Worlds, frames: NDArray[np.int64], commands: Commands) -> None:
        """Write the commands of the team's players into ``commands``."""

    def settle(self, bodies: Bodies, frames: NDArray[np.int64]) -> None:
        """Put the team's players where the policy has them after a step, in place."""


@dataclass(frozen=True, slots=True)
class Cloned:
    """A clone plays the team on ``side``, but for a goalkeeper that it does not know: that one stands.

    Attributes:
        point: take the likeliest command and parameters, else draw them.
        generator: source of the random numbers.
    """

    model: Clone
    side: int
    point: bool
    generator: torch.Generator

    def command(self, worlds: Worlds, frames: NDArray[np.int64], commands: Commands) -> None:
        """Write what the clone does; see `Policy`."""
        own, bodies = slots_of(self.side), worlds.bodies
        due = bodies.on_field[:, own] & (bodies.frozen[:, own] == 0)
        if "catch" not in self.model.config.commands:
            due &= ~bodies.goalie[:, own]
        world, actor = np.nonzero(due)
        if not len(world):
            return
        state = worlds.state(world, actor, side=self.side)
        near = torch.from_numpy(np.flatnonzero(_near_the_ball(worlds)[:, own][due]))
        with torch.inference_mode():
            answer = self.model.answer(state, kick_rows=near)
            if self.point:
                prediction = answer.point()
                kind = answer.answered_logits.argmax(1).numpy()
                numbers = _of_kind(prediction.parameters.numpy(), kind, self.model.config.commands)
            else:
                drawn = answer.sample(self.generator)
                kind, numbers = drawn.kind.numpy(), drawn.parameters.numpy()
        kinds = np.array(
            [int(CommandKind[name.upper()]) if name != "none" else 0 for name in self.model.config.commands]
        )
        slot = actor + (0 if self.side > 0 else N_TEAM)
        given = Commands.of(kinds[kind][:, None], numbers[:, None].astype(np.float64))
        commands.kind[world, slot] = given.kind[:, 0]
        commands.numbers[world, slot] = given.numbers[:, 0]
        commands.legs[world, slot] = given.legs[:, 0]

    def settle(self, bodies: Bodies, frames: NDArray[np.int64]) -> None:
        """Leave the players where the step has put them."""


@dataclass(frozen=True, slots=True)
class AsLogged:
    """Players do as in the log and are where it has them.

    Attributes:
        slots: (22,) bool, which.
    """

    match: Logged
    slots: NDArray[np.bool_]

    def command(self, worlds: Worlds, frames: NDArray[np.int64], commands: Commands) -> None:
        """Write the commands of the log; see `Policy`."""
        logged = self.match.commands.select(self._there(frames))
        for name in ("kind", "numbers", "legs", "foul", "turn_neck"):
            getattr(commands, name)[:, self.slots] = getattr(logged, name)[:, self.slots]
        # A command of which nothing is known but that it was given does nothing.
        unknown = np.isnan(commands.numbers[..., 0]) & (commands.kind > 0)
        commands.kind[unknown & self.slots] = 0
        commands.turn_neck[np.isnan(commands.turn_neck)] = 0.0

    def settle(self, bodies: Bodies, frames: NDArray[np.int64]) -> None:
        """Put the players where the log has them."""
        logged, places = self.match.bodies.select(self._there(frames)), np.flatnonzero(self.slots)
        for name in _STATE:
            getattr(bodies, name)[:, places] = getattr(logged, name)[:, places]

    def _there(self, frames: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the frames, beyond the end of the log its last."""
        return np.minimum(frames, len(self.match.bodies) - 1)


@dataclass(frozen=True, slots=True)
class BallAsLogged:
    """The ball is where the log has it; a policy of the ball, whoever moves the players.

    Attributes:
        frames: (n_frames,) bool, in which frames. In the others it moves as the step has it.
    """

    match: Logged
    frames: NDArray[np.bool_]

    @classmethod
    def throughout(cls, match: Logged) -> BallAsLogged:
        """Return the policy of a ball that never leaves its logged way."""
        return cls(match, np.ones(len(match.bodies), np.bool_))

    @classmethod
    def touched_by(cls, match: Logged, slots: NDArray[np.bool_]) -> BallAsLogged:
        """Return the policy of a ball that goes where some players kicked, tackled or caught it in the log."""
        kind = match.commands.kind
        touch = (kind == CommandKind.KICK) | match.succeeded
        after = np.zeros(len(match.bodies), np.bool_)
        after[1:] = touch[:-1, slots].any(axis=1)
        return cls(match, after)

    def command(self, worlds: Worlds, frames: NDArray[np.int64], commands: Commands) -> None:
        """Leave the commands as they are."""

    def settle(self, bodies: Bodies, frames: NDArray[np.int64]) -> None:
        """Put the ball where the log has it."""
        frames = np.minimum(frames, len(self.match.bodies) - 1)
        here = self.frames[frames]
        logged = self.match.bodies.select(frames[here])
        for name in ("x", "y", "vx", "vy"):
            getattr(bodies, name)[here, BALL] = getattr(logged, name)[:, BALL]


@dataclass(frozen=True, slots=True)
class GoingOn:
    """Players go on with the velocity that they had, and turn no more.

    Attributes:
        slots: (22,) bool, which. vx, vy: (n, 22) the velocity before decay of each.
    """

    slots: NDArray[np.bool_]
    vx: NDArray[np.float64]
    vy: NDArray[np.float64]

    @classmethod
    def of(cls, worlds: Worlds, slots: NDArray[np.bool_]) -> GoingOn:
        """Return the policy for the velocities of some worlds."""
        decay = of_types(worlds.bodies, worlds.rules, "player_decay")
        return cls(slots, worlds.bodies.vx[:, :BALL] / decay, worlds.bodies.vy[:, :BALL] / decay)

    def command(self, worlds: Worlds, frames: NDArray[np.int64], commands: Commands) -> None:
        """Give the players the velocity again that decay takes; see `Policy`."""
        for name, velocity in (("vx", self.vx), ("vy", self.vy)):
            getattr(worlds.bodies, name)[:, :BALL][:, self.slots] = velocity[:, self.slots]

    def settle(self, bodies: Bodies, frames: NDArray[np.int64]) -> None:
        """Leave the players where the step has put them."""


_STATE = ("x", "y", "vx", "vy", "body", "neck", "stamina", "effort", "recovery", "capacity", "frozen", "on_field")


def nothing(n: int) -> Commands:
    """Return the commands of n cycles in which nobody does anything."""
    return Commands.of(np.zeros((n, BALL), np.uint8), np.full((n, BALL, 2), np.nan))


def _near_the_ball(worlds: Worlds) -> NDArray[np.bool_]:
    """Return (n, 22) who could kick or tackle the ball."""
    bodies, rules = worlds.bodies, worlds.rules
    dx, dy = (values[:, :BALL] - values[:, BALL:] for values in (bodies.x, bodies.y))
    reach = formulas.ball_reach(
        of_types(bodies, rules, "player_size"), of_types(bodies, rules, "kickable_margin"), server=rules.server
    )
    near: NDArray[np.bool_] = np.hypot(dx, dy) < reach + _ROUNDING_M
    return near


def _of_kind(
    parameters: NDArray[np.float32], kind: NDArray[np.int64], commands: tuple[str, ...]
) -> NDArray[np.float32]:
    """Return (batch, 2) the numbers of the commands ``kind`` among (batch, parameters) `parameters_of` all commands."""
    numbers = np.zeros((len(kind), 2), np.float32)
    for column, parameter in enumerate(parameters_of(commands)):
        given = kind == commands.index(parameter.kind.name.lower())
        numbers[given, parameter.argument] = parameters[given, column]
    return numbers
