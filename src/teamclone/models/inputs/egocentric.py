"""Inputs in the actor's axes: places relative to the body, times to the ball, the frames before.

They come in blocks, each of which can be left out. None but ``role`` knows a player by its uniform number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from teamclone.dynamics import formulas
from teamclone.dynamics.formulas import radians, roll
from teamclone.models.config import BLOCKS
from teamclone.models.inputs.actor_view import ActorView
from teamclone.models.inputs.axes import polar
from teamclone.models.inputs.geometry import (
    MATES,
    OTHERS,
    SIDED,
    TACKLE,
    WAY,
    InputLayout,
)
from teamclone.models.inputs.paper import Normalisation, TypeParameters
from teamclone.models.inputs.reach import REACH_CYCLES
from teamclone.planner.plan import CHOICES, MOST_VALUE_M, PLAN, UNDERWAY, VALUED, WAYS
from teamclone.rcss import pitch
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.player_types import DEFAULTS, GROUPS
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import RESTARTS, SITUATION, Situation
from teamclone.world.channels import (
    CHANNEL,
    FLAG_CHARGED,
    FLAG_COLLIDED,
    FLAG_GOALIE,
    FLAG_ON_FIELD,
    FLAG_TACKLING,
    TYPE_FIELD,
)
from teamclone.world.mirror import mirror_state
from teamclone.world.state import State

PAST_FRAMES = 3
NEAREST_OPPONENTS = 6
RIVALS = 3
CLIP = 10.0
"""Standard deviations to which inputs are limited, so that unseen values do no great harm."""
NEAR_M = 1.0
NEAR_SHARE = 0.1
"""A player takes itself to be in its place within this many metres, or this share of the distance to the ball."""
RECOVER_BAND, EFFORT_BAND = 100.0, 800.0
"""Stamina around the thresholds of recovery and effort within which the input ``self`` is finer."""
_SIDED = Situation.KICK_OFF
"""The first Situation that is one of the two teams', as all after it are."""
MODES = _SIDED + 2 * (len(Situation) - _SIDED)
_MODE_COLUMN = np.where(SITUATION < _SIDED, SITUATION, 2 * SITUATION - _SIDED + (RESTARTS < 0)).astype(np.int64)
"""(256,) the MODES column of a play mode: a Situation without a side, or one and the side that restarts, own first."""


class EgocentricFeatures(nn.Module):
    """The columns of the chosen blocks, normalised and limited, then the other parts of `Inputs` as they are.

    Args:
        blocks: some of BLOCKS; ``core`` is always among the columns, and tackle and ways are with ``plan``.
        others: have OTHER of all OTHERS.

    Attributes:
        names: of all columns. n_inputs: how many of them are normalised. layout: where each part is.
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
        blank = ActorView(_blank(self.history))
        widths = {name: _BLOCKS[name](self, blank).shape[1] for name in ("core", *self.blocks)}
        self.layout = InputLayout(columns=sum(widths.values()), others=others, plan="plan" in self.blocks)
        self.n_inputs = self.layout.columns
        self.names = (
            *(f"{name}_{i}" for name, width in widths.items() for i in range(width)),
            *self.layout.tail,
        )
        self.normalisation = Normalisation(self.n_inputs)
        self.register_buffer("signs", self._signs(), persistent=False)

    def _signs(self) -> Tensor:
        """Return (len(names),) -1 for columns that change their sign where left and right are exchanged, else 1."""
        state = _any(self.history)
        plain, mirrored = self.project(state), self.project(mirror_state(state, torch.arange(N_PLAYERS)))
        turned = (plain + mirrored).abs().amax(0) < (plain - mirrored).abs().amax(0)
        # No player has the ball in these situations, so the columns of plans are zero.
        turned |= torch.tensor([name in SIDED for name in self.names])
        return torch.where(turned, -1.0, 1.0)

    def counterparts(self, places: Tensor) -> Tensor:
        """Return the column permutation of a left-right reflection, (len(names),); signs are in `signs`.

        Only the block ``role`` depends on ``places``.
        """
        order = list(range(len(self.names)))
        if "role" in self.blocks:
            first = self.names.index("role_0")
            order[first : first + N_TEAM] = (first + places[:N_TEAM]).tolist()
        return torch.tensor(order)

    def columns(self, blocks: tuple[str, ...]) -> list[int]:
        """Return the places of the columns of ``core`` and of some blocks."""
        return [i for i, name in enumerate(self.names[: self.n_inputs]) if name.rpartition("_")[0] in ("core", *blocks)]

    def project(self, state: State) -> Tensor:
        """Return (batch, len(names)) inputs before normalisation."""
        view = ActorView(state)
        columns = [_BLOCKS[name](self, view) for name in ("core", *self.blocks)]
        columns.append(_geometry(view))
        if self.others:
            columns.append(_all_others(view))
        if "plan" in self.blocks:
            columns.append(_ways(view))
        return torch.cat(columns, dim=1)

    def fit(self, chunks: Iterable[Tensor]) -> None:
        """Fit the normalisation to projected training samples, chunk by chunk."""
        self.normalisation.fit(chunk[:, : self.n_inputs] for chunk in chunks)
        # Columns that change their sign in the mirror must do so after normalisation, too.
        self.normalisation.mean[self.signs[: self.n_inputs] < 0] = 0.0

    def normalise(self, columns: Tensor) -> Tensor:
        """Return (batch, len(names)) normalised columns of `project`; GEOMETRY and the columns after it stay."""
        inputs, geometry = columns[:, : self.n_inputs], columns[:, self.n_inputs :]
        return torch.cat([self.normalisation(inputs).clamp(-CLIP, CLIP), geometry], dim=1)

    def forward(self, state: State) -> Tensor:
        """Return (batch, len(names)) normalised inputs."""
        return self.normalise(self.project(state))


def _core(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return positions on the pitch, the time to meet the ball, and the lines."""
    return torch.cat(
        [
            _on_pitch(view.axes.origin),
            _on_pitch(view.ball[:, :2]),
            view.ball[:, 2:],
            *(_on_pitch(place) for place in view.meetings),
            view.steps.clamp(max=REACH_CYCLES) / 20,
            torch.stack([view.line, view.limit, view.last_line], 1) / pitch.HALF_LENGTH,
        ],
        1,
    )


def _self(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return the actor's body, motion, stamina and whether it is frozen or has collided."""
    me, stamina = view.me, view.me[:, CHANNEL["stamina"]]
    most = view.of_server("stamina_max")
    tires, rises = (view.of_server(name) * most for name in ("recover_dec_thr", "effort_inc_thr"))
    flags = [(view.own_flags & flag) != 0 for flag in (FLAG_TACKLING, FLAG_CHARGED, FLAG_COLLIDED)]
    return torch.cat(
        [
            torch.stack([view.axes.cos, view.axes.sin, view.speed], 1),
            view.own_motion,
            torch.stack(
                [
                    stamina / most,
                    (stamina - tires).clamp(-RECOVER_BAND, RECOVER_BAND) / RECOVER_BAND,
                    (stamina - rises).clamp(-EFFORT_BAND, EFFORT_BAND) / EFFORT_BAND,
                    me[:, CHANNEL["effort"]],
                    me[:, CHANNEL["recovery"]],
                    me[:, CHANNEL["capacity"]] / view.of_server("stamina_capacity").clamp(min=1.0),
                ],
                1,
            ),
            torch.stack(flags, 1).to(view.ball.dtype),
        ],
        1,
    )


def _role(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return the actor's uniform number, one-hot."""
    return functional.one_hot(view.actor, N_TEAM).to(view.ball.dtype)


def _type(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return the parameters of the actor's type."""
    columns: Tensor = features.own_type(view.my_type[:, None])
    return columns.flatten(1)


def _last(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return the commands of the actor and the others in the cycle before."""
    return _last_commands(view.players, view.actor)


def _last_commands(players: Tensor, actor: Tensor) -> Tensor:
    """Return (batch, 9) the actor's last command, one-hot, and whether a team mate or an opponent kicked."""
    kinds = players[..., CHANNEL["last_command"]].long().clamp(0, CommandKind.MOVE)
    own = functional.one_hot(_of(kinds, actor), CommandKind.MOVE + 1).to(players.dtype)
    kicked = (kinds == CommandKind.KICK).to(players.dtype).scatter(1, actor[:, None], 0.0)
    return torch.cat([own, kicked[:, :N_TEAM].amax(1, keepdim=True), kicked[:, N_TEAM:].amax(1, keepdim=True)], 1)


def _sight(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return (batch, 3) the view direction relative to the body, and the view width."""
    neck = radians(view.me[:, CHANNEL["neck"]])
    return torch.stack([torch.cos(neck), torch.sin(neck), view.me[:, CHANNEL["view_width"]] / 180], 1)


def _ball(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return (batch, 19) the ball in the actor's axes, now and in the next cycle."""
    now = view.axes.see(view.ball[:, :2])
    ahead = view.axes.see(view.next_ball) - view.own_motion
    velocity = view.axes.turn(view.ball[:, 2:])
    gap, next_gap = now.norm(dim=1) - view.own_area, ahead.norm(dim=1) - view.own_area
    turn = torch.atan2(ahead[:, 1], ahead[:, 0]) * (180 / math.pi)
    failure = formulas.tackle_failure(
        now[:, 0],
        now[:, 1],
        tackle_dist=view.of_server("tackle_dist"),
        tackle_back_dist=view.of_server("tackle_back_dist"),
        tackle_width=view.of_server("tackle_width"),
        exponent=view.of_server("tackle_exponent"),
    )
    return torch.cat(
        [
            polar(now),
            polar(ahead),
            velocity,
            velocity.norm(dim=1, keepdim=True),
            torch.stack(
                [
                    gap.clamp(-0.5, 0.5) * 4,
                    (gap <= -0.055).to(view.ball.dtype),
                    next_gap.clamp(-1, 1) * 2,
                    1 - failure.clamp(max=2.0),
                    (turn / 10).clamp(-1, 1),
                    turn.clamp(-2, 2) / 2,
                ],
                1,
            ),
        ],
        1,
    )


def _reach(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return the control of the ball, the times in which players can have it, and the places."""
    own, mate, opponent = view.own_steps, view.mates2[:, 0], view.opponents2[:, 0]
    margins = [own - mate, own - opponent, mate - opponent, torch.minimum(own, mate) - opponent]
    has = [view.rank / 5, view.mate_has_it.to(view.ball.dtype), view.held.to(view.ball.dtype)]
    return torch.cat(
        [
            own[:, None].clamp(max=6) / 6,
            torch.stack(margins, 1).clamp(-6, 6) / 6,
            torch.stack(has, 1),
            view.opponent_gap[:, None].clamp(-1, 1),
            *(view.axes.polar(place) for place in view.meetings),
        ],
        1,
    )


def _lines(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return how far the actor is from the offside line, the limit of a run, the own last line and the ball."""
    x, ball_x, line, limit, last_line = view.axes.origin[:, 0], view.ball[:, 0], view.line, view.limit, view.last_line
    return torch.stack(
        [
            (line - x) / 20,
            (line - x).clamp(-2, 2),
            (limit - x).clamp(-3, 3),
            (last_line - x) / 20,
            (last_line - x).clamp(-1, 1),
            (ball_x - last_line - 20).clamp(-2, 2),
            (ball_x - x - 10).clamp(-5, 5) / 5,
        ],
        1,
    )


def _plan(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return the plans with the ball, zeros for an actor that cannot kick it."""
    column = {name: view.plans[:, index, None] for index, name in enumerate(PLAN)}
    values = torch.cat([column[f"{name}_value"] for name in VALUED], 1)
    seen = [
        column["able"],
        *(column[f"choose_{name}"] for name in CHOICES),
        *(column[f"{name}_there"] for name in WAYS),
    ]
    seen += [values / MOST_VALUE_M, values.clamp(-1.0, 1.0), column["pass_kicks"] / 3, column["pass_cycles"] / 20]
    for name in UNDERWAY:
        value = column[f"underway_{name}"]
        # A miss of centimetres was meant, one of more was not.
        seen += [value / 20] if name.endswith("dashes") else [value, (value * 5).clamp(max=1.0)]
    return torch.cat(seen, 1)


def _ways(view: ActorView) -> Tensor:
    """Return (batch, columns) TACKLE and WAY."""
    return view.plans[:, [PLAN.index(name) for name in (*TACKLE, *WAY)]]


def _mates(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return all team mates, the nearest first."""
    return _nearest(view.others, view.to_me, view.mate, MATES)


def _opponents(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return the nearest opponents."""
    return _nearest(view.others, view.to_me, view.opponent, NEAREST_OPPONENTS)


def _rivals(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return the opponents nearest to the ball."""
    return _nearest(view.others, view.to_ball, view.opponent, RIVALS)


def _past(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return (batch, history * columns) the actor and the ball in the frames before, from the actor's present axes.

    Frames that are not known are zeros.

    Raises:
        ValueError: the state has fewer frames than the features read.
    """
    state, me, axes = view.state, view.me, view.axes
    if state.past_known.shape[1] < features.history:
        raise ValueError(
            f"expected a state with {features.history} frames before it, got {state.past_known.shape[1]}; "
            "ask for them: dataset.state(rows, history=model.inputs.history)"
        )
    columns = []
    for back in range(features.history):
        players = state.past_players[:, back].index_select(0, state.frame)
        ball = state.past_ball[:, back].index_select(0, state.frame)
        then, known = _of(players, view.actor), state.past_known[:, back].index_select(0, state.frame)[:, None]
        turned = radians(me[:, CHANNEL["body"]] - then[:, CHANNEL["body"]])
        seen = torch.cat(
            [
                axes.see(then[:, [CHANNEL["x"], CHANNEL["y"]]]),
                axes.turn(then[:, [CHANNEL["vx"], CHANNEL["vy"]]]),
                axes.see(ball[:, :2]) / 20,
                axes.turn(ball[:, 2:]),
                torch.stack([torch.cos(turned), torch.sin(turned)], 1),
                (me - then)[:, CHANNEL["stamina"], None] / 100,
                _last_commands(players, view.actor),
                torch.ones_like(then[:, :1]),
            ],
            1,
        )
        columns.append(torch.where(known, seen, 0.0))
    return torch.cat(columns, 1)


def _mode(features: EgocentricFeatures, view: ActorView) -> Tensor:
    """Return (batch, MODES + 3) the play mode one-hot, how long it has lasted, whether the actor is the goalkeeper."""
    frame, dtype = view.state.frame, view.ball.dtype
    mode = functional.one_hot(features.mode_column[view.state.mode[frame]], MODES).to(dtype)
    cycles = view.state.mode_cycles[frame].to(dtype)
    goalkeeper = (view.own_flags & FLAG_GOALIE) != 0
    return torch.cat([mode, torch.stack([cycles.clamp(max=10) / 10, cycles.clamp(max=100) / 100, goalkeeper], 1)], 1)


_BLOCKS: dict[str, Callable[[EgocentricFeatures, ActorView], Tensor]] = {
    "core": _core,
    "self": _self,
    "role": _role,
    "type": _type,
    "last": _last,
    "view": _sight,
    "ball": _ball,
    "reach": _reach,
    "lines": _lines,
    "plan": _plan,
    "mates": _mates,
    "opponents": _opponents,
    "rivals": _rivals,
    "past": _past,
    "mode": _mode,
}
"""The function of each of `config.BLOCKS` that makes its columns, (batch, columns)."""


def _geometry(view: ActorView) -> Tensor:
    """Return (batch, len(GEOMETRY)); see there."""
    me, my_type, origin, motion = view.me, view.my_type, view.axes.origin, view.motion_on_pitch
    decay, inertia = my_type[:, TYPE_FIELD["player_decay"]], my_type[:, TYPE_FIELD["inertia_moment"]]
    to_ball = view.ball[:, :2] - origin
    edges = my_type[:, TYPE_FIELD["player_size"]] + view.of_server("ball_size")
    margin = my_type[:, TYPE_FIELD["kickable_margin"]]
    gain = formulas.kick_rate(
        # Beyond the reach of a kick, or in a collision, the formula means nothing.
        torch.clamp(torch.hypot(to_ball[:, 0], to_ball[:, 1]), edges - 0.2 * margin, edges + margin),
        torch.atan2(to_ball[:, 1], to_ball[:, 0]) - view.body,
        kick_power_rate=my_type[:, TYPE_FIELD["kick_power_rate"]],
        player_size=my_type[:, TYPE_FIELD["player_size"]],
        kickable_margin=margin,
        ball_size=view.of_server("ball_size"),
    )
    at_meeting = origin + motion * roll(view.own_steps.clamp(max=REACH_CYCLES), decay)[:, None]
    quantities = {
        "coast": origin + motion / (1 - decay)[:, None],
        "turn_factor": 1 + inertia * view.speed,
        "dash_gain": me[:, CHANNEL["effort"]] * my_type[:, TYPE_FIELD["dash_power_rate"]],
        "income": me[:, CHANNEL["recovery"]] * my_type[:, TYPE_FIELD["stamina_inc_max"]],
        "near_m": (NEAR_SHARE * view.own_ball_m).clamp(min=NEAR_M),
        "turn_to_ball": view.axes.angle(view.next_ball - origin - motion),
        "turn_to_meet": view.axes.angle(view.meetings[0] - at_meeting),
    }
    columns = [
        origin,
        quantities["coast"],
        view.axes.cos,
        view.axes.sin,
        view.own_motion,
        quantities["turn_factor"],
        decay,
        quantities["dash_gain"],
        quantities["income"],
        view.limit,
        quantities["near_m"],
        view.ball,
        gain,
        quantities["turn_to_ball"],
        quantities["turn_to_meet"],
        view.own_area,
        margin,
        view.of_server("ball_decay"),
        view.of_server("ball_speed_max"),
        _nearest(view.position - origin[:, None], view.to_me, view.mate, MATES) + origin.repeat(1, MATES),
    ]
    return torch.cat([column[:, None] if column.dim() == 1 else column for column in columns], 1)


def _of(values: Tensor, actor: Tensor) -> Tensor:
    """Return (batch, ...) the actor's part of (batch, players, ...)."""
    index = actor.view(-1, 1, *(1 for _ in values.shape[2:])).expand(-1, 1, *values.shape[2:])
    return values.gather(1, index).squeeze(1)


def _on_pitch(place: Tensor) -> Tensor:
    """Return (batch, 2) a place on the pitch, in halves of its length and width."""
    return torch.stack([place[:, 0] / pitch.HALF_LENGTH, place[:, 1] / pitch.HALF_WIDTH], 1)


def _nearest(others: Tensor, distance: Tensor, there: Tensor, count: int) -> Tensor:
    """Return (batch, count * columns) the nearest first; zeros for missing players."""
    nearest = torch.where(there, -distance, -math.inf).topk(count, dim=1).indices
    chosen = others.gather(1, nearest[..., None].expand(-1, -1, others.shape[2]))
    return (chosen * there.gather(1, nearest)[..., None]).flatten(1)


def _all_others(view: ActorView) -> Tensor:
    """Return (batch, OTHERS * len(OTHER))."""
    body = radians(view.players[..., CHANNEL["body"]])
    keeper = (view.flags & FLAG_GOALIE) != 0
    place_and_motion = view.players[..., [CHANNEL[name] for name in ("x", "y", "vx", "vy")]]
    rest = torch.stack([torch.cos(body), torch.sin(body), torch.ones_like(body), keeper.to(body.dtype)], -1)
    everyone = torch.cat([place_and_motion, rest], -1)
    sides = ((view.mate, MATES), (view.opponent, OTHERS - MATES))
    return torch.cat([_nearest(everyone, view.to_me, side, count) for side, count in sides], 1)


def _any(history: int) -> State:
    """Return a few situations in which nothing is zero, equal or straight ahead."""
    random = torch.Generator().manual_seed(0)
    n, n_channels = 8, len(CHANNEL)

    def between(low: float, high: float, *shape: int) -> Tensor:
        return low + (high - low) * torch.rand(*shape, generator=random)

    players = between(-0.4, 0.4, n, 1 + history, N_PLAYERS, n_channels)
    for name, low, high in (("x", -50, 50), ("y", -30, 30), ("body", -170, 170), ("neck", -80, 80)):
        players[..., CHANNEL[name]] = between(low, high, n, 1 + history, N_PLAYERS)
    for name, value in (
        ("effort", 1.0),
        ("recovery", 1.0),
        ("flags", FLAG_ON_FIELD),
        ("last_command", CommandKind.DASH),
    ):
        players[..., CHANNEL[name]] = value
    players[..., CHANNEL["stamina"]] = between(2000, 8000, n, 1 + history, N_PLAYERS)
    ball = between(-1, 1, n, 1 + history, 4) * torch.tensor([50.0, 30.0, 1.0, 1.0])
    types = torch.tensor(list(DEFAULTS.values())).expand(n, N_PLAYERS, -1)
    state = State.now(
        ball=ball[:, 0], players=players[:, 0], types=types, actor=torch.arange(n), mode_cycles=torch.ones(n)
    )
    return state._replace(
        past_ball=ball[:, 1:], past_players=players[:, 1:], past_known=torch.ones(n, history, dtype=torch.bool)
    )


def _blank(history: int) -> State:
    """Return one situation of zeros, to count the columns."""
    state = State.now(
        ball=torch.zeros(1, 4),
        players=torch.zeros(1, N_PLAYERS, len(CHANNEL)),
        types=torch.full((1, N_PLAYERS, len(TYPE_FIELD)), 0.5),
        actor=torch.zeros(1, dtype=torch.int64),
    )
    return state._replace(
        past_ball=torch.zeros(1, history, 4),
        past_players=torch.zeros(1, history, N_PLAYERS, len(CHANNEL)),
        past_known=torch.zeros(1, history, dtype=torch.bool),
    )
