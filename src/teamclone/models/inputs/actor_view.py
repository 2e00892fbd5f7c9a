"""Quantities that egocentric blocks share: positions, control of the ball, times to reach it, and the lines."""

from __future__ import annotations

from functools import cached_property

import torch
from torch import Tensor

from teamclone.dynamics.formulas import radians
from teamclone.models.inputs.axes import Axes, polar
from teamclone.models.inputs.planned import plans
from teamclone.models.inputs.reach import (
    NEVER_CYCLES,
    REACH_CYCLES,
    ball_after,
    kickable_area,
    reach_ball,
)
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.world.channels import CHANNEL, FLAG_ON_FIELD, FLAG_TACKLING
from teamclone.world.state import State

FAR_M = 100.0
"""Farther than anything on the pitch; the place of players off the field."""
DOUBT_SHARE, DOUBT_M = 0.02, 0.5
"""An actor's error about the place of an opponent near the ball: a share of the distances, and its maximum."""


class ActorView:
    """A batch of samples as their actors see them. Quantities of a single block are computed there.

    Attributes, (batch, ...) unless noted otherwise:
        ball: (batch, 4). me: channels of the actor. my_type: fields of the actor's type. server: server fields.
        axes: the actor's. body: radians.
        players: (batch, 22, channels); position, motion: (batch, 22, 2) of them; flags: (batch, 22) int64.
        mate, opponent: (batch, 22) bool, players on the field beside the actor.
        to_ball, to_me: (batch, 22) metres.
        areas: (batch, 22) metres up to which each player can kick the ball.
    """

    def __init__(self, state: State) -> None:
        self.state, self.actor = state, state.actor
        frame = state.frame
        # Quantities that all players of a frame share are computed once.
        position, motion = state.players[..., _XY], state.players[..., _VXY]
        flags = state.players[..., CHANNEL["flags"]].long()
        on_field = (flags & FLAG_ON_FIELD) != 0
        number = torch.arange(N_PLAYERS, device=frame.device)
        to_ball = (position - state.ball[:, None, :2]).norm(dim=2)
        x = position[..., 0]
        theirs = torch.where(on_field & (number >= N_TEAM), x, -FAR_M).topk(2, dim=1).values[:, 1]
        ours = -torch.where(on_field & (number < N_TEAM), x, FAR_M)
        last_line = torch.minimum(-ours.topk(2, dim=1).values[:, 1].clamp(min=0.0), state.ball[:, 0])
        areas = kickable_area(state.types, state.server)

        self.ball, self.players, self.position, self.motion, self.flags, self.to_ball, self.areas = (
            part.index_select(0, frame) for part in (state.ball, state.players, position, motion, flags, to_ball, areas)
        )
        self.defenders, self.last_line, self.server, on_field = (
            part.index_select(0, frame) for part in (theirs, last_line, state.server, on_field)
        )
        self.me, self.my_type = state.players[frame, self.actor], state.types[frame, self.actor]
        self.body = radians(self.me[:, CHANNEL["body"]])
        self.axes = Axes(self.me[:, _XY], self.body)
        self.mate = on_field & (number < N_TEAM) & (number != self.actor[:, None])
        self.opponent = on_field & (number >= N_TEAM)
        self.to_me = (self.position - self.axes.origin[:, None]).norm(dim=2)
        self.own_ball_m, self.own_area, self.own_flags = (
            part.gather(1, self.actor[:, None])[:, 0] for part in (self.to_ball, self.areas, self.flags)
        )
        self.motion_on_pitch = self.me[:, _VXY]
        self.own_motion = self.axes.turn(self.motion_on_pitch)
        self.speed = self.own_motion.norm(dim=1)
        self.next_ball = self.ball[:, :2] + self.ball[:, 2:]
        self._who_has_the_ball()
        self._who_meets_it()

    def _who_has_the_ball(self) -> None:
        """Set mate_has_it and held, (batch,) bool, and opponent_gap, (batch,) metres that an opponent lacks."""
        free = (self.flags & FLAG_TACKLING) == 0
        doubt = (DOUBT_SHARE * (self.to_me + self.own_ball_m[:, None])).clamp(max=DOUBT_M)
        self.mate_has_it = (self.mate & free & (self.to_ball < self.areas)).any(1)
        self.opponent_gap = torch.where(self.opponent & free, self.to_ball - self.areas - doubt, FAR_M).amin(1)
        self.held = self.opponent_gap < 0

    def _who_meets_it(self) -> None:
        """Set cycles to the ball, where it will be then, and the lines.

        own_steps: (batch,) of the actor; mates2, opponents2: (batch, 2) of the first two of each side; rank: how many
        mates are before the actor. meetings: where the actor, the first mate, the first opponent and the first of all
        meet it. line: the offside line; limit: how far ahead a player goes.
        """
        self.reach = reach_ball(self.state, held=self.held)
        self.own_steps = self.reach.steps.gather(1, self.actor[:, None])[:, 0]
        mates = torch.where(self.mate, self.reach.steps, NEVER_CYCLES)
        opponents = torch.where(self.opponent, self.reach.steps, NEVER_CYCLES)
        self.mates2, self.opponents2 = (-(-side).topk(2, dim=1).values for side in (mates, opponents))
        first = torch.minimum(torch.minimum(self.own_steps, self.mates2[:, 0]), self.opponents2[:, 0])
        moments = (self.own_steps, self.mates2[:, 0], self.opponents2[:, 0], first)
        self.meetings = [ball_after(self.reach, steps) for steps in moments]
        self.steps = torch.cat([self.own_steps[:, None], self.mates2, self.opponents2, first[:, None]], 1)
        self.rank = (mates < self.own_steps[:, None]).sum(1).to(self.ball.dtype)
        zero = torch.zeros_like(self.defenders)
        self.line = torch.stack([self.defenders, zero, self.next_ball[:, 0], self.meetings[3][:, 0]], 1).amax(1)
        ahead = torch.where(self.mates2[:, 0] < REACH_CYCLES, self.meetings[1][:, 0], self.line)
        self.limit = torch.maximum(self.line, ahead)

    def of_server(self, name: str) -> Tensor:
        """Return (batch,) a parameter of the server."""
        return self.server[:, SERVER_FIELD[name]]

    @cached_property
    def plans(self) -> Tensor:
        """Return (batch, len(PLAN)) the plans with the ball."""
        return plans(self.state)

    @cached_property
    def others(self) -> Tensor:
        """Return (batch, 22, 11) every player in the actor's axes."""
        place = self.axes.see(self.position)
        motion = self.axes.turn(self.motion)
        facing = radians(self.players[..., CHANNEL["body"]]) - self.body[:, None]
        rest = torch.stack(
            [
                torch.cos(facing),
                torch.sin(facing),
                self.reach.steps.clamp(max=REACH_CYCLES) / 20,
                self.to_ball.clamp(max=60) / 20,
            ],
            -1,
        )
        return torch.cat([polar(place), motion, rest], -1)


_XY, _VXY = [CHANNEL["x"], CHANNEL["y"]], [CHANNEL["vx"], CHANNEL["vy"]]
