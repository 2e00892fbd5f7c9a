"""The time in which each player can have the ball, by the physics of the next cycles.

Vectorised over a batch and not differentiable: these are inputs, not layers that learn. Quantities that all players of
a frame share are computed once.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor

from teamclone.dynamics import formulas
from teamclone.dynamics.formulas import covered, radians, roll
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.world.channels import CHANNEL, FLAG_ON_FIELD, TYPE_FIELD
from teamclone.world.state import State

REACH_CYCLES = 40
"""Cycles for which reaching the ball is looked at; beyond it the rest of the way counts at full speed."""
NEVER_CYCLES = 100.0
"""Cycles to the ball of a player off the field, and the maximum for all players."""
MATE_RESERVE_M = 0.2
"""By how much agents of the league take a team mate's reach of the ball to be shorter, so as not to wait for it."""
TURN_MARGIN_DEG = 15.0
"""A player dashes without a turn if the target is at most so far off the body."""
BACKWARD_M = 10.0
"""A target nearer than this may lie behind a player, which then runs backwards instead of turning."""


class Reach(NamedTuple):
    """The times in which players can have the ball, each as the actor judges it.

    Attributes:
        steps: (batch, 22) cycles, 0 for a player that can kick it now, NEVER_CYCLES for one off the field.
        ball: (batch, REACH_CYCLES + 1, 2) the ball's place after 0, 1, ... cycles if no player touches it.
    """

    steps: Tensor
    ball: Tensor


def kickable_area(types: Tensor, server: Tensor) -> Tensor:
    """Return (..., players) metres up to which each player can kick the ball.

    Args:
        types: (..., players, fields). server: (..., server fields).
    """
    area: Tensor = formulas.kickable_area(
        types[..., TYPE_FIELD["player_size"]],
        types[..., TYPE_FIELD["kickable_margin"]],
        server[..., SERVER_FIELD["ball_size"], None],
    )
    return area


def reach_ball(state: State, *, held: Tensor) -> Reach:
    """Compute when each player can have the ball by turning towards it and dashing with full power.

    The simple model that agents of the league use of each other: coast, as many turns as the angle needs, then
    dashes. The actor may also dash sideways, which is the quicker way when the ball is close.

    Args:
        held: (batch,) bool, the ball is under an opponent's control and is taken to stay.
    """
    if torch.compiler.is_exporting():  # each sample by itself: sharing depends on the data
        cases, place = 2 * state.frame + held, torch.arange(state.actor.shape[0], device=held.device)
    else:
        cases, place = torch.unique(2 * state.frame + held, return_inverse=True)
    ours = _Cases(state, frame=cases // 2, held=cases % 2 == 1)
    steps = torch.cat([ours.mates, ours.all[:, N_TEAM:]], 1).index_select(0, place)
    own = ours.actors[place, state.actor]
    return Reach(steps.scatter(1, state.actor[:, None], own[:, None]), ours.path.index_select(0, place))


class _Cases:
    """Frames, each with the ball held or not, with the quantities that reaching it takes.

    Attributes:
        path: (cases, REACH_CYCLES + 1, 2) of the ball.
        all: (cases, 22) cycles of every player.
        mates: (cases, 11) of the team, with the reserve that the actor leaves to a team mate.
        actors: (cases, 11) of each player of the team as the actor, sideways dashes included.
    """

    def __init__(self, state: State, *, frame: Tensor, held: Tensor) -> None:
        ball, players, types, server = (
            part.index_select(0, frame) for part in (state.ball, state.players, state.types, state.server)
        )
        count = torch.arange(REACH_CYCLES + 1, dtype=ball.dtype, device=ball.device)
        velocity = torch.where(held[:, None], 0.0, ball[:, 2:])
        rolled = roll(count, server[:, SERVER_FIELD["ball_decay"], None])
        self.path = ball[:, None, :2] + velocity[:, None] * rolled[..., None]

        position = players[..., [CHANNEL["x"], CHANNEL["y"]]]
        motion = players[..., [CHANNEL["vx"], CHANNEL["vy"]]]
        decay = types[..., TYPE_FIELD["player_decay"], None]
        coasted = roll(count, decay)
        away_x = self.path[:, None, :, 0] - position[..., 0, None] - motion[..., 0, None] * coasted
        away_y = self.path[:, None, :, 1] - position[..., 1, None] - motion[..., 1, None] * coasted
        distance = torch.sqrt(away_x.square() + away_y.square() + 1e-9)
        body = radians(players[..., CHANNEL["body"], None])
        cosine = (away_x * torch.cos(body) + away_y * torch.sin(body)) / distance
        angle = torch.acos(cosine.clamp(-1.0, 1.0))
        back = (distance < BACKWARD_M) & (angle > math.pi / 2)

        speed = torch.hypot(motion[..., 0], motion[..., 1])[..., None]
        inertia = types[..., TYPE_FIELD["inertia_moment"], None]
        first_turn = formulas.turn(math.pi, speed, inertia)
        full = 100.0 * types[..., TYPE_FIELD["dash_power_rate"], None] * types[..., TYPE_FIELD["effort_max"], None]
        dashes = _Dashes(
            distance=distance,
            angle=torch.where(back, math.pi - angle, angle),
            first_turn=first_turn,
            two_turns=first_turn + formulas.turn(math.pi, speed * decay, inertia),
            run=covered(count, full, decay),
            top_speed=(full / (1.0 - decay))[..., 0],
        )
        area = kickable_area(types, server)[..., None]
        on_field = (players[..., CHANNEL["flags"]].long() & FLAG_ON_FIELD) != 0
        team = slice(None, N_TEAM)

        def limited(steps: Tensor) -> Tensor:
            return torch.where(on_field[:, : steps.shape[1]], steps.clamp(max=NEVER_CYCLES), NEVER_CYCLES)

        alone = dashes.steps(area)
        self.all = limited(alone)
        self.mates = limited(dashes.of(team).steps(area[:, team] - MATE_RESERVE_M))
        sideways = formulas.dash_rate(
            angle[:, team] * (180.0 / math.pi),
            side_dash_rate=server[:, SERVER_FIELD["side_dash_rate"], None, None],
            back_dash_rate=server[:, SERVER_FIELD["back_dash_rate"], None, None],
        )
        slides = dashes.run[:, team] * sideways >= distance[:, team] - area[:, team]
        self.actors = limited(torch.minimum(alone[:, team], _first(slides, otherwise=NEVER_CYCLES)))


class _Dashes(NamedTuple):
    """Turns and dashes of players towards the ball, (cases, players, REACH_CYCLES + 1) or 1 in the last axis.

    Attributes:
        distance: to the ball after so many cycles of coasting. angle: that the body is off it, radians.
        first_turn, two_turns: radians that one turn and two turns reach.
        run: metres that so many full dashes cover. top_speed: (cases, players) metres per cycle.
    """

    distance: Tensor
    angle: Tensor
    first_turn: Tensor
    two_turns: Tensor
    run: Tensor
    top_speed: Tensor

    def of(self, players: slice) -> _Dashes:
        """Return the dashes of some players."""
        return _Dashes(*(part[:, players] for part in self))

    def steps(self, area: Tensor) -> Tensor:
        """Return (cases, players) cycles until the ball is within ``area``, (cases, players, 1)."""
        margin = torch.asin((area / self.distance).clamp(max=1.0)).clamp(min=math.radians(TURN_MARGIN_DEG))
        need = self.angle - margin
        turns = (need > 0).long() + (need > self.first_turn) + (need > self.two_turns)
        count = torch.arange(REACH_CYCLES + 1, device=area.device)
        ran = self.run.gather(2, (count - turns).clamp(min=0))
        can = (self.distance <= area) | (ran >= self.distance - area)
        rest = (self.distance[..., -1] - area[..., 0] - self.run[..., -1]).clamp(min=0.0)
        return _first(can, otherwise=REACH_CYCLES + rest / self.top_speed)


def _first(holds: Tensor, *, otherwise: Tensor | float) -> Tensor:
    """Return (cases, players) the first cycle in which something holds, (cases, players, cycles)."""
    cycles = holds.to(torch.uint8).argmax(-1).to(torch.get_default_dtype())
    return torch.where(holds.any(-1), cycles, otherwise)


def ball_after(reach: Reach, steps: Tensor) -> Tensor:
    """Return (batch, 2) the ball's place after ``steps`` (batch,) cycles, at most REACH_CYCLES."""
    place = steps.round().clamp(0, REACH_CYCLES).long()
    return reach.ball.gather(1, place[:, None, None].expand(-1, 1, 2))[:, 0]
