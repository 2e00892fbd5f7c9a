"""Inputs seen from the player who acts: places relative to him and his body, times to the ball, what happened before.

They come in blocks, each of which can be left out. None but ``role`` knows a player by his uniform number.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from teamclone.models.config import BLOCKS
from teamclone.models.inputs.paper import Normalisation, TypeParameters
from teamclone.models.inputs.reach import (
    NEVER,
    STEPS,
    Reach,
    ball_after,
    kick_rate,
    kickable_area,
    radians,
    reach_ball,
    tackle_failure,
)
from teamclone.planner.plan import CHOICES, PLAN, UNDERWAY, WAYS, WORTHS, plans
from teamclone.planner.plan import FAR_M as WORTH_M
from teamclone.rcss import pitch
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.player_types import DEFAULTS, GROUPS
from teamclone.rcss.playmodes import RESTARTS, SITUATION, PlayMode, Situation
from teamclone.world.channels import (
    CHANNEL,
    FLAG_CHARGED,
    FLAG_COLLIDED,
    FLAG_GOALIE,
    FLAG_ON_FIELD,
    FLAG_TACKLING,
    TYPE_FIELD,
)
from teamclone.world.mirror import TEAM, mirror_state
from teamclone.world.state import State

PAST_FRAMES = 3
NEAREST_OPPONENTS = 6
RIVALS = 3
MATES = 10
FAR_M = 100.0
"""Further than anything on the pitch; for players who are not there."""
CLIP = 10.0
"""Standard deviations to which inputs are limited, so that nothing unheard of leads far astray."""
NEAR_M = 1.0
NEAR_SHARE = 0.1
"""How close to where he belongs a player lets it be: a metre, or this share of the distance to the ball."""

GEOMETRY = (
    "x", "y", "coast_x", "coast_y", "cos", "sin", "forward", "aside", "turn_factor", "decay", "dash_gain", "income",
    "line_x", "near_m", "ball_x", "ball_y", "ball_vx", "ball_vy", "kick_gain", "turn_to_ball", "turn_to_meet",
    "kick_area", "kick_margin",
    *(f"mate_{mate}_{axis}" for mate in range(MATES) for axis in "xy"),
)  # fmt: skip
"""What makes a command of a place on the pitch or of a wanted motion; metres, metres per cycle, radians:

x, y: the actor. coast_x, coast_y: where he comes to rest without a dash. cos, sin: of his body direction.
forward, aside: his velocity along and across the body. turn_factor: turn moment for one degree. decay: of his velocity.
dash_gain: speed that one unit of dash power gives. income: stamina that one cycle gives back.
line_x: the offside line, or where a team mate meets the ball if that is further. near_m: see NEAR_SHARE.
ball_x, ball_y, ball_vx, ball_vy: the ball. kick_gain: speed that one unit of kick power gives it.
turn_to_ball, turn_to_meet: angles to face the ball in the next cycle, and from where he rolls out to where he meets it.
kick_area: see `kickable_area`; kick_margin: the part of it beyond the edges of player and ball.
mate_0_x, ...: the team mates, the nearest first; where one is missing, the actor.
"""
_SIDED = Situation.KICK_OFF
"""The first Situation that is one of the two teams', as all after it are."""
MODES = _SIDED + 2 * (len(Situation) - _SIDED)
_MODE_COLUMN = np.where(SITUATION < _SIDED, SITUATION, 2 * SITUATION - _SIDED + (RESTARTS < 0)).astype(np.int64)
"""(256,) which of MODES a play mode is: a Situation that is nobody's, or one and who restarts, the own team first."""
_PLACE = {name: index for index, name in enumerate(GEOMETRY)}

OTHERS = MATES + 11
"""The other players: the team mates, then the opponents, of each side the nearest first."""
OTHER = ("x", "y", "vx", "vy", "cos", "sin", "there", "keeper")
"""What is said of each: where he is, metres, his velocity, metres per cycle, his body direction, whether he is there,
whether he keeps the goal. All 0 where he is not.
"""


WAY = tuple(f"{name}_{what}" for name in WAYS for what in ("there", "vx", "vy"))
"""Of each way to kick that a plan knows: whether there is one, and the velocity of the ball, metres per cycle."""
TACKLE = ("tackle_there", "tackle_degrees")
"""Whether he may tackle the ball, and where to a plan says, degrees from his body."""
SIDED = frozenset((*(f"{name}_vy" for name in WAYS), "tackle_degrees"))


def geometry_of(geometry: Tensor, *names: str) -> list[Tensor]:
    """Columns of GEOMETRY, (batch, 1) each."""
    return [geometry[:, _PLACE[name], None] for name in names]


def mates_of(geometry: Tensor) -> Tensor:
    """(batch, MATES, 2) where the team mates are."""
    first = _PLACE["mate_0_x"]
    return geometry[:, first : first + 2 * MATES].reshape(-1, MATES, 2)


def others_of(geometry: Tensor) -> Tensor:
    """(batch, OTHERS, len(OTHER)) of features that have them."""
    return geometry[:, len(GEOMETRY) : len(GEOMETRY) + OTHERS * len(OTHER)].reshape(-1, OTHERS, len(OTHER))


def ways_of(geometry: Tensor) -> Tensor:
    """(batch, len(WAYS), 3) of features with the block ``plan``: whether there is one, and the ball's velocity."""
    return geometry[:, -len(WAY) :].reshape(-1, len(WAYS), 3)


def tackle_of(geometry: Tensor) -> Tensor:
    """(batch, 2) TACKLE of such features."""
    return geometry[:, -len(WAY) - len(TACKLE) : -len(WAY)]


class RelativeFeatures(nn.Module):
    """The columns of the chosen blocks, normalised and limited, then GEOMETRY as it is; TACKLE and WAY with the
    block ``plan``.

    Args:
        blocks: some of BLOCKS; ``scene`` is always among the columns.
        others: have OTHER of all OTHERS, as they are, right after GEOMETRY.
    """

    signs: Tensor
    mode_column: Tensor

    def __init__(self, blocks: tuple[str, ...] = BLOCKS, *, others: bool = False) -> None:
        super().__init__()
        self.others = others
        self.blocks = tuple(block for block in BLOCKS if block in blocks)
        self.history = PAST_FRAMES if "past" in blocks else 0
        self.channels = (
            *("x", "y", "vx", "vy", "body", "stamina", "effort", "recovery", "capacity", "type", "flags"),
            *(("neck", "view_width") if "view" in blocks else ()),
            "last_command",
        )
        self.own_type = TypeParameters(tuple(GROUPS))
        self.register_buffer("mode_column", torch.from_numpy(_MODE_COLUMN), persistent=False)
        parts = self._parts(_blank(self.history))
        self.names = (
            *(f"{name}_{i}" for name in ("scene", *self.blocks) for i in range(parts[name].shape[1])),
            *GEOMETRY,
            *(f"other_{i}_{name}" for i in range(OTHERS if others else 0) for name in OTHER),
            *((*TACKLE, *WAY) if "plan" in self.blocks else ()),
        )
        self.n_inputs = self.names.index(GEOMETRY[0])
        self.normalisation = Normalisation(self.n_inputs)
        self.register_buffer("signs", self._signs(), persistent=False)

    def _signs(self) -> Tensor:
        """(len(names),) -1 for columns that change their sign where left and right are exchanged, else 1."""
        state = _any(self.history)
        plain, mirrored = self.project(state), self.project(mirror_state(state, torch.arange(22)))
        turned = (plain + mirrored).abs().amax(0) < (plain - mirrored).abs().amax(0)
        # Nobody has the ball in these, so that of what is planned there is nothing to be seen.
        turned |= torch.tensor([name in SIDED for name in self.names])
        return torch.where(turned, -1.0, 1.0)

    def counterparts(self, places: Tensor) -> Tensor:
        """As of `PaperFeatures`: only the role knows a player by his number."""
        order = list(range(len(self.names)))
        if "role" in self.blocks:
            first = self.names.index("role_0")
            order[first : first + TEAM] = (first + places[:TEAM]).tolist()
        return torch.tensor(order)

    def columns(self, blocks: tuple[str, ...]) -> list[int]:
        """Places of the columns of ``scene`` and of some blocks."""
        return [
            i for i, name in enumerate(self.names[: self.n_inputs]) if name.rpartition("_")[0] in ("scene", *blocks)
        ]

    def project(self, state: State) -> Tensor:
        """(batch, len(names)) before normalisation."""
        parts = self._parts(state)
        after = ("geometry", *(("others",) if self.others else ()), *(("ways",) if "plan" in self.blocks else ()))
        return torch.cat([parts[name] for name in ("scene", *self.blocks, *after)], dim=1)

    def fit(self, chunks: Iterable[Tensor]) -> None:
        """Fit the normalisation on what `project` makes of the training samples, chunk by chunk."""
        self.normalisation.fit(chunk[:, : self.n_inputs] for chunk in chunks)
        # What changes its sign in the mirror must do so after normalisation, too.
        self.normalisation.mean[self.signs[: self.n_inputs] < 0] = 0.0

    def normalise(self, columns: Tensor) -> Tensor:
        """(batch, len(names)) of what `project` gives; GEOMETRY and what follows stay."""
        inputs, geometry = columns[:, : self.n_inputs], columns[:, self.n_inputs :]
        return torch.cat([self.normalisation(inputs).clamp(-CLIP, CLIP), geometry], dim=1)

    def forward(self, state: State) -> Tensor:
        return self.normalise(self.project(state))

    def _parts(self, state: State) -> dict[str, Tensor]:
        """Every block by name, and ``geometry``; (batch, columns) each."""
        ball, players, types, actor = state.ball, state.players, state.types, state.actor
        me, my_type = _of(players, actor), _of(types, actor)
        body = radians(me[:, CHANNEL["body"]])
        view = _View(me[:, [CHANNEL["x"], CHANNEL["y"]]], body)
        flags = players[..., CHANNEL["flags"]].long()
        on_field = (flags & FLAG_ON_FIELD) != 0
        position = players[..., [CHANNEL["x"], CHANNEL["y"]]]
        motion = players[..., [CHANNEL["vx"], CHANNEL["vy"]]]
        own_motion = view.turn(_of(motion, actor))
        speed = own_motion.norm(dim=1)
        number = torch.arange(22, device=ball.device)
        mate = on_field & (number < 11) & (number != actor[:, None])
        opponent = on_field & (number >= 11)

        # Who has the ball now.
        to_ball = (position - ball[:, None, :2]).norm(dim=2)
        own_ball_m = _of(to_ball, actor)
        to_me = (position - view.origin[:, None]).norm(dim=2)
        areas = kickable_area(types)
        free = (flags & FLAG_TACKLING) == 0
        doubt = (0.02 * (to_me + own_ball_m[:, None])).clamp(max=0.5)
        mate_has_it = (mate & free & (to_ball < areas)).any(1)
        opponent_gap = torch.where(opponent & free, to_ball - areas - doubt, FAR_M).amin(1)
        held = opponent_gap < 0
        reach = reach_ball(ball, players, types, held=held, actor=actor)

        # Times to the ball, and where it will be then.
        own_steps = _of(reach.steps, actor)
        mates, opponents = torch.where(mate, reach.steps, NEVER), torch.where(opponent, reach.steps, NEVER)
        mates2, opponents2 = (-(-side).topk(2, dim=1).values for side in (mates, opponents))
        first = torch.minimum(torch.minimum(own_steps, mates2[:, 0]), opponents2[:, 0])
        meetings = [ball_after(reach, steps) for steps in (own_steps, mates2[:, 0], opponents2[:, 0], first)]
        relative = [view.polar(place) for place in meetings]
        steps = torch.stack([own_steps, mates2[:, 0], mates2[:, 1], opponents2[:, 0], opponents2[:, 1], first], 1)
        rank = (mates < own_steps[:, None]).sum(1).to(ball.dtype)

        # Lines.
        defenders = torch.where(opponent, position[..., 0], -FAR_M).topk(2, dim=1).values[:, 1]
        next_ball = ball[:, :2] + ball[:, 2:]
        line = torch.stack([defenders, torch.zeros_like(defenders), next_ball[:, 0], meetings[3][:, 0]], 1).amax(1)
        limit = torch.maximum(line, torch.where(mates2[:, 0] < STEPS, meetings[1][:, 0], line))
        ours = torch.where(on_field & (number < 11), position[..., 0], FAR_M)
        last_line = torch.minimum((-(-ours).topk(2, dim=1).values)[:, 1].clamp(max=0.0), ball[:, 0])
        x = view.origin[:, 0]

        parts = {
            "scene": torch.cat(
                [
                    _pitch(view.origin),
                    _pitch(ball[:, :2]),
                    ball[:, 2:],
                    *(_pitch(place) for place in meetings),
                    steps.clamp(max=STEPS) / 20,
                    torch.stack([line, limit, last_line], 1) / pitch.HALF_LENGTH,
                ],
                1,
            ),
            "self": torch.cat(
                [
                    torch.stack([view.cos, view.sin, speed], 1),
                    own_motion,
                    torch.stack(
                        [
                            me[:, CHANNEL["stamina"]] / 8000,
                            (me[:, CHANNEL["stamina"]] - 2400).clamp(-100, 100) / 100,
                            (me[:, CHANNEL["stamina"]] - 4800).clamp(-800, 800) / 800,
                            me[:, CHANNEL["effort"]],
                            me[:, CHANNEL["recovery"]],
                            me[:, CHANNEL["capacity"]] / 130600,
                        ],
                        1,
                    ),
                    torch.stack(
                        [((_of(flags, actor) & flag) != 0) for flag in (FLAG_TACKLING, FLAG_CHARGED, FLAG_COLLIDED)], 1
                    ).to(ball.dtype),
                ],
                1,
            ),
            "role": functional.one_hot(actor, 11).to(ball.dtype),
            "type": self.own_type(my_type[:, None]).flatten(1),
            "last": _last(players, actor),
            "view": _sight(me),
            "ball": _ball(ball, view, own_motion, areas=_of(areas, actor)),
            "reach": torch.cat(
                [
                    own_steps[:, None].clamp(max=6) / 6,
                    torch.stack(
                        [
                            own_steps - mates2[:, 0],
                            own_steps - opponents2[:, 0],
                            mates2[:, 0] - opponents2[:, 0],
                            torch.minimum(own_steps, mates2[:, 0]) - opponents2[:, 0],
                        ],
                        1,
                    ).clamp(-6, 6)
                    / 6,
                    torch.stack([rank / 5, mate_has_it.to(ball.dtype), held.to(ball.dtype)], 1),
                    opponent_gap[:, None].clamp(-1, 1),
                    *relative,
                ],
                1,
            ),
            "lines": torch.stack(
                [
                    (line - x) / 20,
                    (line - x).clamp(-2, 2),
                    (limit - x).clamp(-3, 3),
                    (last_line - x) / 20,
                    (last_line - x).clamp(-1, 1),
                    (ball[:, 0] - last_line - 20).clamp(-2, 2),
                    (ball[:, 0] - x - 10).clamp(-5, 5) / 5,
                ],
                1,
            ),
        }
        others = _others(players, view, body, reach, to_ball)
        parts["mode"] = self._mode(state, goalkeeper=(_of(flags, actor) & FLAG_GOALIE) != 0)
        parts["mates"] = _nearest(others, to_me, mate, MATES)
        parts["opponents"] = _nearest(others, to_me, opponent, NEAREST_OPPONENTS)
        parts["rivals"] = _nearest(others, to_ball, opponent, RIVALS)
        if self.others:
            parts["others"] = _all_others(players, to_me, mate, opponent)
        if "plan" in self.blocks:
            parts["plan"], parts["ways"] = _plan(state)
        if self.history:
            parts["past"] = _past(state, me, view, frames=self.history)

        decay = my_type[:, TYPE_FIELD["player_decay"]]
        inertia = my_type[:, TYPE_FIELD["inertia_moment"]]
        coast = view.origin + _of(motion, actor) / (1 - decay)[:, None]
        rolled = (1 - decay ** own_steps.clamp(max=STEPS)) / (1 - decay)
        at_meeting = view.origin + _of(motion, actor) * rolled[:, None]
        parts["geometry"] = torch.cat(
            [
                view.origin,
                coast,
                torch.stack([view.cos, view.sin], 1),
                own_motion,
                torch.stack(
                    [
                        1 + inertia * speed,
                        decay,
                        me[:, CHANNEL["effort"]] * my_type[:, TYPE_FIELD["dash_power_rate"]],
                        me[:, CHANNEL["recovery"]] * my_type[:, TYPE_FIELD["stamina_inc_max"]],
                        limit,
                        (NEAR_SHARE * own_ball_m).clamp(min=NEAR_M),
                    ],
                    1,
                ),
                ball,
                torch.stack(
                    [
                        kick_rate(ball[:, :2] - view.origin, body, my_type),
                        view.angle(next_ball - view.origin - _of(motion, actor)),
                        view.angle(meetings[0] - at_meeting),
                        _of(areas, actor),
                        my_type[:, TYPE_FIELD["kickable_margin"]],
                    ],
                    1,
                ),
                _nearest(position - view.origin[:, None], to_me, mate, MATES) + view.origin.repeat(1, MATES),
            ],
            1,
        )
        return parts

    def _mode(self, state: State, *, goalkeeper: Tensor) -> Tensor:
        """(batch, MODES + 3) the play mode one-hot, how long it lasts already, whether the actor is the goalkeeper."""
        mode = functional.one_hot(self.mode_column[state.mode], MODES).to(state.ball.dtype)
        cycles = state.mode_cycles.to(state.ball.dtype)
        rest = [cycles.clamp(max=10) / 10, cycles.clamp(max=100) / 100, goalkeeper.to(state.ball.dtype)]
        return torch.cat([mode, torch.stack(rest, 1)], 1)


class _View:
    """The acting player's frame of reference: he is the origin (batch, 2), his body points along the first axis."""

    def __init__(self, origin: Tensor, body: Tensor) -> None:
        self.origin, self.cos, self.sin = origin, torch.cos(body), torch.sin(body)

    def turn(self, vector: Tensor) -> Tensor:
        """(batch, ..., 2) vectors of the pitch in his axes."""
        shape = (-1, *(1 for _ in vector.shape[1:-1]))
        cos, sin = self.cos.view(shape), self.sin.view(shape)
        x, y = vector[..., 0], vector[..., 1]
        return torch.stack([x * cos + y * sin, y * cos - x * sin], -1)

    def see(self, place: Tensor) -> Tensor:
        """(batch, ..., 2) places on the pitch relative to him."""
        shape = (-1, *(1 for _ in place.shape[1:-1]), 2)
        return self.turn(place - self.origin.view(shape))

    def polar(self, place: Tensor) -> Tensor:
        """(batch, 5) relative place in 20 m, its distance (logarithm) and direction (cosine, sine)."""
        return _polar(self.see(place))

    def angle(self, vector: Tensor) -> Tensor:
        """(batch,) radians from his body to a vector of the pitch."""
        turned = self.turn(vector)
        return torch.atan2(turned[:, 1], turned[:, 0])


def _polar(relative: Tensor) -> Tensor:
    distance = torch.sqrt(relative.square().sum(-1, keepdim=True) + 1e-8)
    return torch.cat([relative / 20, torch.log(distance + 0.1), relative / distance], -1)


def _of(values: Tensor, actor: Tensor) -> Tensor:
    """(batch, ...) the acting player's part of (batch, players, ...)."""
    index = actor.view(-1, 1, *(1 for _ in values.shape[2:])).expand(-1, 1, *values.shape[2:])
    return values.gather(1, index).squeeze(1)


def _pitch(place: Tensor) -> Tensor:
    """(batch, 2) a place on the pitch, in halves of its length and width."""
    return torch.stack([place[:, 0] / pitch.HALF_LENGTH, place[:, 1] / pitch.HALF_WIDTH], 1)


def _sight(me: Tensor) -> Tensor:
    """(batch, 3) where the actor looks, relative to his body, and how wide."""
    neck = radians(me[:, CHANNEL["neck"]])
    return torch.stack([torch.cos(neck), torch.sin(neck), me[:, CHANNEL["view_width"]] / 180], 1)


def _last(players: Tensor, actor: Tensor) -> Tensor:
    """(batch, 9) what the actor did in the cycle before, one-hot, and whether a team mate or an opponent kicked."""
    kinds = players[..., CHANNEL["last_command"]].long().clamp(0, CommandKind.MOVE)
    own = functional.one_hot(_of(kinds, actor), CommandKind.MOVE + 1).to(players.dtype)
    kicked = (kinds == CommandKind.KICK).to(players.dtype).scatter(1, actor[:, None], 0.0)
    return torch.cat([own, kicked[:, :11].amax(1, keepdim=True), kicked[:, 11:].amax(1, keepdim=True)], 1)


def _plan(state: State) -> tuple[Tensor, Tensor]:
    """What is planned with the ball, (batch, columns), zeros for who cannot kick it; TACKLE and WAY."""
    made = plans(state)
    column = {name: made[:, index, None] for index, name in enumerate(PLAN)}
    worths = torch.cat([column[f"{name}_worth"] for name in WORTHS], 1)
    seen = [
        column["able"],
        *(column[f"choose_{name}"] for name in CHOICES),
        *(column[f"{name}_there"] for name in WAYS),
    ]
    seen += [worths / WORTH_M, worths.clamp(-1.0, 1.0), column["pass_kicks"] / 3, column["pass_cycles"] / 20]
    for name in UNDERWAY:
        value = column[f"underway_{name}"]
        # What misses by centimetres was meant, what misses by more was not.
        seen += [value / 20] if name.endswith("dashes") else [value, (value * 5).clamp(max=1.0)]
    return torch.cat(seen, 1), torch.cat([column[name] for name in (*TACKLE, *WAY)], 1)


def _ball(ball: Tensor, view: _View, motion: Tensor, *, areas: Tensor) -> Tensor:
    """(batch, 19) the ball as the actor has it before him, now and in the next cycle."""
    now = view.see(ball[:, :2])
    ahead = view.see(ball[:, :2] + ball[:, 2:]) - motion
    velocity = view.turn(ball[:, 2:])
    gap, next_gap = now.norm(dim=1) - areas, ahead.norm(dim=1) - areas
    turn = torch.atan2(ahead[:, 1], ahead[:, 0]) * (180 / math.pi)
    return torch.cat(
        [
            _polar(now),
            _polar(ahead),
            velocity,
            velocity.norm(dim=1, keepdim=True),
            torch.stack(
                [
                    gap.clamp(-0.5, 0.5) * 4,
                    (gap <= -0.055).to(ball.dtype),
                    next_gap.clamp(-1, 1) * 2,
                    1 - tackle_failure(now[:, 0], now[:, 1]).clamp(max=2.0),
                    (turn / 10).clamp(-1, 1),
                    turn.clamp(-2, 2) / 2,
                ],
                1,
            ),
        ],
        1,
    )


def _others(players: Tensor, view: _View, body: Tensor, reach: Reach, to_ball: Tensor) -> Tensor:
    """(batch, 22, 11) every player as the actor has him before him."""
    place = view.see(players[..., [CHANNEL["x"], CHANNEL["y"]]])
    motion = view.turn(players[..., [CHANNEL["vx"], CHANNEL["vy"]]])
    facing = radians(players[..., CHANNEL["body"]]) - body[:, None]
    rest = torch.stack(
        [torch.cos(facing), torch.sin(facing), reach.steps.clamp(max=STEPS) / 20, to_ball.clamp(max=60) / 20], -1
    )
    return torch.cat([_polar(place), motion, rest], -1)


def _nearest(others: Tensor, distance: Tensor, there: Tensor, count: int) -> Tensor:
    """(batch, count * columns) the nearest first; zeros for those who are not there."""
    nearest = torch.where(there, -distance, -math.inf).topk(count, dim=1).indices
    chosen = others.gather(1, nearest[..., None].expand(-1, -1, others.shape[2]))
    return (chosen * there.gather(1, nearest)[..., None]).flatten(1)


def _all_others(players: Tensor, distance: Tensor, mate: Tensor, opponent: Tensor) -> Tensor:
    """(batch, OTHERS * len(OTHER))."""
    body = radians(players[..., CHANNEL["body"]])
    keeper = (players[..., CHANNEL["flags"]].long() & FLAG_GOALIE) != 0
    place_and_motion = players[..., [CHANNEL[name] for name in ("x", "y", "vx", "vy")]]
    rest = torch.stack([torch.cos(body), torch.sin(body), torch.ones_like(body), keeper.to(body.dtype)], -1)
    all_of_them = torch.cat([place_and_motion, rest], -1)
    sides = [
        _nearest(all_of_them, distance, side, count) for side, count in ((mate, MATES), (opponent, OTHERS - MATES))
    ]
    return torch.cat(sides, 1)


def _past(state: State, me: Tensor, view: _View, *, frames: int) -> Tensor:
    """(batch, frames * columns) the actor and the ball in the frames before, from where he is now; zeros if unknown.

    Raises:
        ValueError: the state has fewer.
    """
    if state.past_known.shape[1] < frames:
        raise ValueError(
            f"expected a state with {frames} frames before it, got {state.past_known.shape[1]}; "
            "ask for them: dataset.state(rows, history=model.inputs.history)"
        )
    columns = []
    for back in range(frames):
        then, known = _of(state.past_players[:, back], state.actor), state.past_known[:, back, None]
        turned = radians(me[:, CHANNEL["body"]] - then[:, CHANNEL["body"]])
        seen = torch.cat(
            [
                view.see(then[:, [CHANNEL["x"], CHANNEL["y"]]]),
                view.turn(then[:, [CHANNEL["vx"], CHANNEL["vy"]]]),
                view.see(state.past_ball[:, back, :2]) / 20,
                view.turn(state.past_ball[:, back, 2:]),
                torch.stack([torch.cos(turned), torch.sin(turned)], 1),
                (me - then)[:, CHANNEL["stamina"], None] / 100,
                _last(state.past_players[:, back], state.actor),
                torch.ones_like(then[:, :1]),
            ],
            1,
        )
        columns.append(torch.where(known, seen, 0.0))
    return torch.cat(columns, 1)


def _any(history: int) -> State:
    """A few situations in which nothing is zero, equal or straight ahead."""
    random = torch.Generator().manual_seed(0)
    n, n_channels = 8, len(CHANNEL)

    def between(low: float, high: float, *shape: int) -> Tensor:
        return low + (high - low) * torch.rand(*shape, generator=random)

    players = between(-0.4, 0.4, n, 1 + history, 22, n_channels)
    for name, low, high in (("x", -50, 50), ("y", -30, 30), ("body", -170, 170), ("neck", -80, 80)):
        players[..., CHANNEL[name]] = between(low, high, n, 1 + history, 22)
    for name, value in (
        ("effort", 1.0),
        ("recovery", 1.0),
        ("flags", FLAG_ON_FIELD),
        ("last_command", CommandKind.DASH),
    ):
        players[..., CHANNEL[name]] = value
    players[..., CHANNEL["stamina"]] = between(2000, 8000, n, 1 + history, 22)
    ball = between(-1, 1, n, 1 + history, 4) * torch.tensor([50.0, 30.0, 1.0, 1.0])
    types = torch.tensor(list(DEFAULTS.values())).expand(n, 22, -1)
    return State(
        ball=ball[:, 0],
        players=players[:, 0],
        types=types,
        actor=torch.arange(n),
        past_ball=ball[:, 1:],
        past_players=players[:, 1:],
        past_known=torch.ones(n, history, dtype=torch.bool),
        mode=torch.full((n,), PlayMode.PLAY_ON),
        mode_cycles=torch.ones(n),
    )


def _blank(history: int) -> State:
    """One situation of zeros: to see how many columns there are."""
    n_channels, n_fields = len(CHANNEL), len(TYPE_FIELD)
    return State(
        ball=torch.zeros(1, 4),
        players=torch.zeros(1, 22, n_channels),
        types=torch.full((1, 22, n_fields), 0.5),
        actor=torch.zeros(1, dtype=torch.int64),
        past_ball=torch.zeros(1, history, 4),
        past_players=torch.zeros(1, history, 22, n_channels),
        past_known=torch.zeros(1, history, dtype=torch.bool),
        mode=torch.full((1,), PlayMode.PLAY_ON),
        mode_cycles=torch.zeros(1),
    )
