"""What agents of the league choose between when they have the ball, as velocities for it.

Most teams grew from librcsc and HELIOS Base, whose agents do not kick anywhere. They bring the ball to one of some
places around them, from where to kick it on or where to keep it, or send it ahead to where they have it again after so
many turns and dashes. The angles, distances and counts below are theirs; which of all is chosen is learned.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from teamclone.models.features import BALL_DECAY, BALL_SPEED_MAX
from teamclone.models.mixture import LEAST_ANGLE, LEAST_POWER, Mixture
from teamclone.models.physics import covered, tackle_failure
from teamclone.models.relative import MATES, OTHER, geometry_of, others_of
from teamclone.rcss import pitch

KICK_ON = ((0.3, 12), (0.5, 15), (0.7, 20))
"""Places from which to kick it on: parts of the kickable margin, and how many around the body."""
N_KICK_ON = sum(count for _, count in KICK_ON)
KEEP = ((0.4, 20), (0.6, 20), (0.75, 20))
"""Places where to keep it, around the player in the axes of the pitch."""
KEPT_OFF_M = 0.1, 0.2
"""How far a place to kick it on from is at least off the player's edge, and within his reach."""
DRIBBLE_TURNS, DRIBBLE_DASHES, DRIBBLE_AHEAD = 16, (2, 3, 4), 0.2
"""Directions of a dribble around the body, its dashes, and the part of the margin by which the ball is then ahead."""
DRIBBLE_TURN_CYCLES = 2
"""Most turns of a dribble."""
FACED_DEG = 10.0
"""From which on a dribbler turns, and once more."""
RUN_STEP_DEG, RUN_SIDE, RUN_DASHES = 6.0, 8, tuple(range(5, 21))
"""Directions of a run behind the ball: their distance, how many to each side; at most one turn; its dashes."""
RUN_MOST = (20.0, 15), (10.0, 13), (0.0, 7), (-20.0, 6)
"""Most dashes of a usual run where the ball's x is less; elsewhere all."""
OWN_GOAL_M, DRIBBLE_BACK_X_M, DRIBBLE_WIDEST_DEG = (-36.0, 20.0), 16.0, (45.0, 100.0, 180.0)
"""Usual dribbles go at most so far round from +x: near the own goal, behind an x, elsewhere."""
RUN_BACK_X_M, RUN_WIDEST_DEG = 41.5, 85.0
"""Usual runs do, but for those from beyond this x."""
DRIBBLE_INSIDE_M, RUN_INSIDE_M = (1.0, 1.0), (2.5, 3.0)
"""How far within the lines they end."""
KINDS = 4
"""Kick on, keep, dribble, run."""
_DRIBBLE = 2
COLUMNS, ASIDE = 30, (10, 12)
"""Inputs of each: `Options.columns`; and which of them change their sign where left and right are exchanged."""
HIDDEN = 32
"""Width of the layers that decide on shares."""
OPPONENTS = 6
"""The nearest, who are looked at."""
NEAR_M, FAR_M = 5.0, 1000.0
"""From where on a place is out of his way; where one who is missing is thought to be."""
REACH_M, DASH_AND_KICK_M = 1.285, 1.8
"""How near an opponent has to come to the ball; how near he can kick it after one more dash."""
RUN_SPEED, OPPONENT_DECAY, COASTED = 1.0, 0.4, 1.6
"""Of an opponent of the default type: at full speed; and for how many cycles' way his velocity carries him."""
RISE = OPPONENT_DECAY / (1 - OPPONENT_DECAY)
"""Cycles that he loses until he is at full speed."""
FACED, TURN_CYCLES, WAY_M = math.cos(math.radians(15)), 2.0, 0.8
"""Who does not face the place has to turn first; who is so far ahead of the ball is in its way."""
BOLD_CYCLES, CARE_X_M = 1.5, (0.0, 30.0)
"""By how much sooner a dribbler thinks that he has the ball, and behind which lines it is a cycle less."""
NEAR_GOAL_M, GAIN_WORTH = 40.0, 10.0
"""From where on a ball nearer to the goal is worth more; and what the power of the next kick is worth beside metres."""
SAFE = -1.0, -0.5, 0.0
"""Cycles by which he is to have the ball first."""
IMPOSSIBLE = -30.0
"""Logit of what cannot be done."""
AT_FIRST = -3.0
"""Logit of an option before training: the free components are to learn first."""
USUAL_ERROR = 0.003
"""Metres per cycle by which the velocity of the ball misses what was wanted, before training."""
_THERE = OTHER.index("there")


class Choice(NamedTuple):
    """All options of some situations, as seen from the player's body.

    Attributes:
        velocity: (batch, options, 2) of the ball after the kick. place: where he has it again, from where he is.
        cycles: until then. possible: whether one kick does it. usual: whether agents think of it there.
    """

    velocity: Tensor
    place: Tensor
    cycles: Tensor
    possible: Tensor
    usual: Tensor


class Options(nn.Module):
    """Components of power and direction of a kick, one for each option.

    Args:
        width: of what a kick is decided on. target_width: of what is known of each of `crowd.TARGETS`.

    Attributes:
        error: (KINDS,) logarithm of the velocities by which kicks miss what was wanted, in USUAL_ERROR.
    """

    kinds: Tensor
    places: Tensor
    divisions: Tensor
    dribbles: Tensor
    runs: Tensor
    signs: Tensor

    def __init__(self, width: int, target_width: int) -> None:
        super().__init__()
        self.option = nn.Linear(COLUMNS, HIDDEN)
        self.situation = nn.Linear(width, HIDDEN)
        self.both = nn.Linear(HIDDEN, HIDDEN)
        self.share = nn.Linear(HIDDEN, 1)
        self.toward = nn.Linear(target_width, HIDDEN + 1)
        self.error = nn.Parameter(torch.zeros(KINDS))
        rings = [ring for rings in (KICK_ON, KEEP) for ring in rings]
        self.counts = [sum(count for _, count in kind) for kind in (KICK_ON, KEEP)]
        self.counts += [DRIBBLE_TURNS * len(DRIBBLE_DASHES), (2 * RUN_SIDE + 1) * len(RUN_DASHES)]
        constants = {
            "kinds": torch.arange(KINDS).repeat_interleave(torch.tensor(self.counts)),
            "places": torch.cat([torch.arange(count) * (2 * math.pi / count) - math.pi for _, count in rings]),
            "divisions": torch.cat([torch.full((count,), part) for part, count in rings]),
            "dribbles": torch.arange(DRIBBLE_TURNS) * (360.0 / DRIBBLE_TURNS) - 180.0,
            "runs": torch.arange(-RUN_SIDE, RUN_SIDE + 1) * RUN_STEP_DEG,
            "signs": torch.tensor([-1.0 if column in ASIDE else 1.0 for column in range(COLUMNS)]),
        }
        for name, constant in constants.items():
            self.register_buffer(name, constant, persistent=False)

    def forward(self, hidden: Tensor, geometry: Tensor, targets: Tensor) -> tuple[Mixture, Mixture]:
        """Power and direction (radians from the body), of situations and then of their mirror images.

        The options of the latter are those of the former, mirrored, and come in the same order.

        Args:
            hidden: (2 * batch, width). geometry: GEOMETRY and OTHER of all OTHERS, (2 * batch, columns).
            targets: (2 * batch, TARGETS, target width).
        """
        geometry = geometry[: geometry.shape[0] // 2]
        with torch.autocast(geometry.device.type, enabled=False):
            choice = self.choose(geometry)
            columns = self.columns(choice, geometry)
            columns = torch.cat([columns, columns * self.signs])
        seen = torch.relu(self.option(columns) + self.situation(hidden)[:, None])
        known = torch.relu(self.both(seen))
        share = self.share(known)[..., 0].float()
        # Who kicks it on has someone in mind to kick it to.
        wish, key = self.toward(targets).split([1, HIDDEN], 2)
        suits = (known[:, :N_KICK_ON] @ key.transpose(1, 2) + wish.transpose(1, 2)).float().logsumexp(2)
        share = share + functional.pad(suits, (0, share.shape[1] - N_KICK_ON))
        with torch.autocast(geometry.device.type, enabled=False):
            logits = torch.where(choice.possible.repeat(2, 1), share + AT_FIRST, IMPOSSIBLE)
            added = choice.velocity - _ball_velocity(geometry)[:, None]
            gain = geometry_of(geometry, "kick_gain")[0].clamp(min=5e-3)
            speed = torch.sqrt(added.square().sum(-1) + 1e-6)
            error = USUAL_ERROR * self.error.exp()[self.kinds]
            power, power_scale = (speed / gain).clamp(max=150.0), LEAST_POWER + error / gain
            angle, angle_scale = torch.atan2(added[..., 1], added[..., 0]), LEAST_ANGLE + error / speed
            return (
                Mixture(logits, power.repeat(2, 1), power_scale.repeat(2, 1)),
                Mixture(logits, torch.cat([angle, -angle]), angle_scale.repeat(2, 1)),
            )

    def choose(self, geometry: Tensor) -> Choice:
        """What there is to choose from."""
        parts = [self._places(geometry), self._dribbles(geometry), self._runs(geometry)]
        velocity, place, cycles, possible, usual = (torch.cat(part, 1) for part in zip(*parts, strict=True))
        possible = possible & (_power(velocity, geometry) <= 100.5) & (velocity.norm(dim=-1) <= BALL_SPEED_MAX + 0.01)
        return Choice(velocity, place, cycles, possible, usual)

    def _places(self, geometry: Tensor) -> Choice:
        """The ball beside him in the next cycle, when he has rolled on."""
        area, margin, cos, sin = geometry_of(geometry, "kick_area", "kick_margin", "cos", "sin")
        distance = area - margin + margin * self.divisions
        to_kick_on = self.kinds[: len(self.places)] == 0
        least, most = KEPT_OFF_M
        distance = torch.where(
            to_kick_on, torch.minimum(torch.maximum(distance, area - margin + least), area - most), distance
        )
        to_pitch = torch.stack([torch.cos(self.places), torch.sin(self.places)])
        x = torch.where(to_kick_on, to_pitch[0], to_pitch[0] * cos + to_pitch[1] * sin)
        y = torch.where(to_kick_on, to_pitch[1], to_pitch[1] * cos - to_pitch[0] * sin)
        place = distance[..., None] * torch.stack([x, y], -1) + _motion(geometry)[:, None]
        one = torch.ones_like(x)
        return Choice(place - _ball(geometry)[:, None], place, one, one > 0, one > 0)

    def _dribbles(self, geometry: Tensor) -> Choice:
        """The ball just ahead after as many turns as the direction needs, and a few dashes."""
        decay, factor = geometry_of(geometry, "decay", "turn_factor")
        left = self.dribbles.abs().expand(geometry.shape[0], -1)
        turns = torch.zeros_like(left)
        drag = (factor - 1) * decay  # the first cycle is the kick's
        for _ in range(DRIBBLE_TURN_CYCLES):
            needed = left > FACED_DEG
            left = torch.where(needed, (left - 180.0 / (1 + drag * decay**turns)).clamp(min=0.0), left)
            turns = turns + needed.to(turns.dtype)
        # He dashes as far round as he comes.
        angle = self.dribbles - torch.sign(self.dribbles) * left
        area, margin = geometry_of(geometry, "kick_area", "kick_margin")
        ahead = area - margin + margin * DRIBBLE_AHEAD
        choice = self._ahead(geometry, (angle, turns, left <= FACED_DEG), DRIBBLE_DASHES, ahead)
        x, y = geometry_of(geometry, "x", "y")
        near_own_goal = (x < OWN_GOAL_M[0]) & (y.abs() < OWN_GOAL_M[1])
        at_own_goal, behind, elsewhere = DRIBBLE_WIDEST_DEG
        widest = torch.where(near_own_goal, at_own_goal, torch.where(x < DRIBBLE_BACK_X_M, behind, elsewhere))
        direction = _direction(geometry, self.dribbles).repeat_interleave(len(DRIBBLE_DASHES), 1)
        return choice._replace(usual=(direction <= widest) & _inside(geometry, choice.place, DRIBBLE_INSIDE_M))

    def _runs(self, geometry: Tensor) -> Choice:
        """The ball where he is himself after many dashes, with at most one turn before them."""
        decay, factor = geometry_of(geometry, "decay", "turn_factor")
        angle = self.runs.expand(geometry.shape[0], -1)
        turns = (angle != 0).to(angle.dtype)
        possible = angle.abs() <= 180.0 / (1 + (factor - 1) * decay)
        choice = self._ahead(geometry, (angle, turns, possible), RUN_DASHES, torch.zeros_like(decay))
        ball_x = geometry_of(geometry, "ball_x")[0]
        dashes = torch.tensor(RUN_DASHES, device=angle.device).repeat(len(self.runs))
        most = torch.full_like(ball_x, RUN_DASHES[-1])
        for edge, fewer in RUN_MOST:
            most = torch.where(ball_x < edge, fewer, most)
        direction = _direction(geometry, self.runs).repeat_interleave(len(RUN_DASHES), 1)
        forward = (direction <= RUN_WIDEST_DEG) | (ball_x >= RUN_BACK_X_M)
        return choice._replace(usual=(dashes <= most) & forward & _inside(geometry, choice.place, RUN_INSIDE_M))

    def _ahead(
        self, geometry: Tensor, directions: tuple[Tensor, Tensor, Tensor], dashes: tuple[int, ...], ahead: Tensor
    ) -> Choice:
        """The ball where he is after a kick, some turns and each of ``dashes`` at full power, or so far ahead.

        Args:
            directions: (batch, directions) of the dashes, degrees from the body; turns before them; whether so many do.
            ahead: (batch, 1) metres.
        """
        angle, turns, possible = directions
        decay, dash_gain = geometry_of(geometry, "decay", "dash_gain")
        count = torch.tensor(dashes, dtype=angle.dtype, device=angle.device)
        shape = (geometry.shape[0], angle.shape[1] * len(dashes))
        cycles = (1 + turns[..., None] + count).reshape(shape)
        run = (covered(count, 100.0 * dash_gain, decay) + ahead)[:, None].expand(-1, angle.shape[1], -1).reshape(shape)
        angle = (angle * (math.pi / 180.0)).repeat_interleave(len(dashes), 1)
        way = run[..., None] * torch.stack([torch.cos(angle), torch.sin(angle)], -1)
        coasted = (1 - decay**cycles) / (1 - decay)
        place = way + coasted[..., None] * _motion(geometry)[:, None]
        rolled = (1 - BALL_DECAY**cycles) / (1 - BALL_DECAY)
        velocity = (place - _ball(geometry)[:, None]) / rolled[..., None]
        possible = possible.repeat_interleave(len(dashes), 1)
        return Choice(velocity, place, cycles, possible, possible)

    def columns(self, choice: Choice, geometry: Tensor) -> Tensor:
        """(batch, options, COLUMNS) what is known of each."""
        area, margin, cos, sin = geometry_of(geometry, "kick_area", "kick_margin", "cos", "sin")
        velocity, place = choice.velocity, choice.place
        speed = torch.sqrt(velocity.square().sum(-1) + 1e-6)
        # From where the player is in the next cycle.
        beside = _ball(geometry)[:, None] + velocity - _motion(geometry)[:, None]
        off = torch.sqrt(beside.square().sum(-1) + 1e-6)
        away = torch.atan2(beside[..., 1].abs(), beside[..., 0]) / math.pi
        # As of `physics.kick_rate`.
        next_gain = 1 - 0.25 * away - 0.25 * ((off - area + margin) / margin).clamp(0.0, 1.0)
        x, y = _on_pitch(geometry, place)
        to_goal = torch.hypot(pitch.HALF_LENGTH - x, y)
        heading = velocity / speed[..., None]
        single = [
            speed / BALL_SPEED_MAX,
            (_power(velocity, geometry) / 100).clamp(max=2.0),
            off.clamp(max=3.0),
            away,
            next_gain,
            speed * BALL_DECAY / (BALL_SPEED_MAX * next_gain),
            x / pitch.HALF_LENGTH,
            y.abs() / pitch.HALF_WIDTH,
            to_goal / 50,
            heading[..., 0] * cos - heading[..., 1] * sin,
            heading[..., 0] * sin + heading[..., 1] * cos,
            heading[..., 0],
            heading[..., 1],
            choice.cycles / 10,
            choice.usual.to(x.dtype),
        ]
        opponents = _opponents(geometry)
        n_places = len(self.places)
        pressure = _pressure(place[:, :n_places], opponents)
        ahead = ((opponents[..., :2] - _ball(geometry)[:, None])[:, None] * heading[:, n_places:, None]).sum(-1)
        first = _first(place[:, n_places:], choice.cycles[:, n_places:], opponents, ahead)
        first = functional.pad(first, (n_places, 0))
        # Dribblers are bold, but not where much is at stake.
        stakes = (x < CARE_X_M[0]).to(x.dtype) + (x < CARE_X_M[1])
        first = first + torch.where(self.kinds == _DRIBBLE, BOLD_CYCLES - stakes, 0.0)
        worth = torch.where(self.kinds < _DRIBBLE, GAIN_WORTH * next_gain, x + (NEAR_GOAL_M - to_goal).clamp(min=0.0))
        able = choice.possible & choice.usual
        lacking = [worth - self._best(torch.where(able & (first > safe), worth, -100.0)) for safe in SAFE]
        single += [first.clamp(-3.0, 3.0) / 3]
        single += [lack.clamp(-most, most) / most for lack in lacking for most in (10.0, 1.0)]
        kind = functional.one_hot(self.kinds, KINDS).to(x.dtype).expand(x.shape[0], -1, -1)
        pressure = functional.pad(pressure, (0, 0, 0, place.shape[1] - n_places))
        return torch.cat([torch.stack(single, -1), pressure, kind], -1)

    def _best(self, values: Tensor) -> Tensor:
        """(batch, options) the greatest value of an option of the same kind."""
        return torch.cat(
            [part.amax(1, keepdim=True).expand_as(part) for part in torch.split(values, self.counts, dim=1)], 1
        )


def _pressure(place: Tensor, opponents: Tensor) -> Tensor:
    """(batch, options, 4) opponents about a ball that stays: the nearest; tackles; dashes and kicks; who faces it."""
    ahead, aside, apart = _seen_by(opponents, place, cycles=1.0)
    tackles = (1 - tackle_failure(ahead, aside)).clamp(min=0.0).sum(-1)
    kicks = (DASH_AND_KICK_M - apart).clamp(min=0.0).sum(-1)
    lines = torch.where(apart < NEAR_M, (REACH_M - aside.abs()).clamp(min=0.0), 0.0).sum(-1)
    return torch.stack([apart.amin(-1).clamp(max=NEAR_M) / NEAR_M, tackles, kicks, lines], -1)


def _first(place: Tensor, cycles: Tensor, opponents: Tensor, ahead: Tensor) -> Tensor:
    """(batch, options) cycles by which a ball sent ahead is met before any opponent has it.

    Args:
        place, cycles: as of `Choice`. ahead: (batch, options, OPPONENTS) metres by which an opponent is ahead of the
            ball in its direction: he has it a cycle sooner.
    """
    forward, _, apart = _seen_by(opponents, place, cycles=COASTED)
    way = (apart - REACH_M).clamp(0.0, 50.0)
    steps = way / RUN_SPEED + RISE * (1 - OPPONENT_DECAY**way)
    margin = (REACH_M / apart).clamp(max=1.0)
    faces = forward >= apart * torch.sqrt(1 - margin.square()).clamp(max=FACED)
    steps = steps + torch.where(faces, 0.0, TURN_CYCLES) - (ahead > WAY_M).to(steps.dtype)
    return steps.amin(-1) - cycles


def _direction(geometry: Tensor, angles: Tensor) -> Tensor:
    """(batch, angles) degrees between +x and directions, which are degrees from the body."""
    cos, sin = geometry_of(geometry, "cos", "sin")
    way = angles * (math.pi / 180.0)
    ahead, aside = torch.cos(way), torch.sin(way)
    return torch.atan2((ahead * sin + aside * cos).abs(), ahead * cos - aside * sin) * (180.0 / math.pi)


def _on_pitch(geometry: Tensor, place: Tensor) -> tuple[Tensor, Tensor]:
    """(batch, options) x and y of places seen from the body."""
    x, y, cos, sin = geometry_of(geometry, "x", "y", "cos", "sin")
    return x + place[..., 0] * cos - place[..., 1] * sin, y + place[..., 0] * sin + place[..., 1] * cos


def _inside(geometry: Tensor, place: Tensor, off: tuple[float, float]) -> Tensor:
    """(batch, options) whether places lie so far within the lines, along the pitch and across it."""
    x, y = _on_pitch(geometry, place)
    return (x.abs() <= pitch.HALF_LENGTH - off[0]) & (y.abs() <= pitch.HALF_WIDTH - off[1])


def _opponents(geometry: Tensor) -> Tensor:
    """(batch, OPPONENTS, 6) the nearest opponents: place, velocity and body direction as seen from the player."""
    x, y, cos, sin = geometry_of(geometry, "x", "y", "cos", "sin")
    others = others_of(geometry)[:, MATES : MATES + OPPONENTS]
    there = others[..., _THERE] > 0
    pairs = [
        (torch.where(there, others[..., 0] - x, FAR_M), torch.where(there, others[..., 1] - y, FAR_M)),
        (others[..., 2], others[..., 3]),
        (others[..., 4], others[..., 5]),
    ]
    return torch.stack([part for a, b in pairs for part in (a * cos + b * sin, b * cos - a * sin)], -1)


def _seen_by(opponents: Tensor, place: Tensor, *, cycles: float) -> tuple[Tensor, Tensor, Tensor]:
    """(batch, options, OPPONENTS) how far a place is ahead of each, beside him and off, when he has rolled on."""
    x, y, vx, vy, cos, sin = opponents[:, None].unbind(-1)
    x, y = place[..., 0, None] - x - cycles * vx, place[..., 1, None] - y - cycles * vy
    return x * cos + y * sin, y * cos - x * sin, torch.sqrt(x.square() + y.square() + 1e-6)


def _power(velocity: Tensor, geometry: Tensor) -> Tensor:
    """(batch, options) of the kick that gives the ball a velocity."""
    gain = geometry_of(geometry, "kick_gain")[0]
    added: Tensor = (velocity - _ball_velocity(geometry)[:, None]).norm(dim=-1)
    return added / gain.clamp(min=5e-3)


def _turned(geometry: Tensor, x: Tensor, y: Tensor) -> Tensor:
    """(batch, 2) a vector of the pitch as seen from the body."""
    cos, sin = geometry_of(geometry, "cos", "sin")
    return torch.cat([x * cos + y * sin, y * cos - x * sin], 1)


def _ball(geometry: Tensor) -> Tensor:
    x, y, ball_x, ball_y = geometry_of(geometry, "x", "y", "ball_x", "ball_y")
    return _turned(geometry, ball_x - x, ball_y - y)


def _ball_velocity(geometry: Tensor) -> Tensor:
    return _turned(geometry, *geometry_of(geometry, "ball_vx", "ball_vy"))


def _motion(geometry: Tensor) -> Tensor:
    return torch.cat(geometry_of(geometry, "forward", "aside"), 1)
