"""The head whose answer is a distribution of every parameter."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import torch
from torch import Tensor, nn

from teamclone.engine.network.constants import (
    CATCH_DIRECTIONS,
    CATCH_EDGE_DEG,
    CATCH_LIMIT_DEG,
    DASH_DIRECTIONS,
    DASH_REACH,
    DEGREE,
    FREE_COMPONENTS,
    FREE_HALF_TURNS,
    INCOMES,
    LEAST_ANGLE,
    LEAST_PLACE,
    LEAST_POWER,
    MOVE_PLACES,
    MOVE_REACH_M,
    TURN_REACH,
    TYPICAL_DASH,
    TYPICAL_PLACE,
    TYPICAL_TURN,
)
from teamclone.models import distributions as mixture
from teamclone.models import intervals
from teamclone.models.answer import Answer, Prediction
from teamclone.models.distributions import (
    Mixture,
    class_of,
    direction_of,
    log_class,
    mean_logits,
    wrap,
)
from teamclone.models.heads.kick import KickMixture
from teamclone.models.heads.trunk_output import KickFeatures, TrunkOutput
from teamclone.models.inputs.geometry import geometry_of
from teamclone.models.loss import Balance, Loss, mixture_loss
from teamclone.planner import tackle as tackling
from teamclone.rcss import pitch
from teamclone.rcss.commands import CLONED
from teamclone.world.state import Target

TACKLE_DIRECTIONS = tackling.DIRECTIONS
"""Classes of tackle direction, 9 degrees apart."""
WITH_BALL = CLONED.index("kick"), CLONED.index("tackle")
"""Classes whose parameters the layers of a kick find."""
TARGET_SCALE_DEG = 4.0
"""Scale of the logistic density by which a turn teaches the target points near its direction."""


class KickAnswer(NamedTuple):
    """One answer on what a kick or tackle would be: power, radians, (kicks, TACKLE_DIRECTIONS) logits."""

    power: Mixture
    direction: Mixture
    tackle: Tensor


class Move(NamedTuple):
    """The place of a move, metres: both coordinates with the shares of the same components."""

    x: Mixture
    y: Mixture


class ActionDistribution(NamedTuple):
    """What a `MixtureHead` answers, all for the command that they belong to.

    Attributes:
        logits: (batch, commands).
        dash_power: power. dash_direction: (batch, DASH_DIRECTIONS) logits. turn: radians before the loss by motion.
        turn_factor: (batch,) turn moment for one degree.
        turn_to_targets: the turn, by the target points alone: only they learn from it.
        kick: several answers of which the mean counts.
        kick_rows: (kicks,) of which situations they are; None for all.
        catch: (batch, CATCH_DIRECTIONS) logits. move: a place. None where this is no command of the model.
    """

    logits: Tensor
    dash_power: Mixture
    dash_direction: Tensor
    turn: Mixture
    turn_factor: Tensor
    turn_to_targets: Mixture
    kick: tuple[KickAnswer, ...]
    kick_rows: Tensor | None
    catch: Tensor | None
    move: Move | None


class MixtureAnswer(Answer):
    """Answer of a `MixtureHead`.

    Attributes:
        distribution: of the command and of each parameter.
    """

    def __init__(self, distribution: ActionDistribution, temperature: Tensor) -> None:
        super().__init__(distribution.logits, temperature)
        self.distribution = distribution

    @cached_property
    def _kick(self) -> KickAnswer:
        """The mean of the answers on kicks and tackles."""
        return _mean_kick(self.distribution.kick)

    @property
    def answered_logits(self) -> Tensor:
        """See `Answer.answered_logits`."""
        rows = self.distribution.kick_rows
        if rows is None:
            return self.logits
        left_out = torch.ones_like(self.logits, dtype=torch.bool)
        left_out[:, : min(WITH_BALL)] = False
        left_out[:, max(WITH_BALL) + 1 :] = False
        left_out[rows] = False
        return self.logits.masked_fill(left_out, -math.inf)

    def point(self) -> Prediction:
        """Return the single best answer: of each mixture the weighted medoid of its components."""
        of = self.distribution
        turn = mixture.weighted_medoid(of.turn.logits, of.turn.centre, angle=True) / DEGREE * of.turn_factor
        kick = self._kick
        on_ball = [
            mixture.weighted_medoid(kick.power.logits, kick.power.centre.clamp(0, 100), angle=False),
            mixture.weighted_medoid(kick.direction.logits, kick.direction.centre, angle=True) / DEGREE,
            direction_of(kick.tackle),
        ]
        kick_power, kick_direction, tackle = (_spread(values, of) for values in on_ball)
        parameters = [
            mixture.weighted_medoid(of.dash_power.logits, of.dash_power.centre.clamp(0, 100), angle=False),
            direction_of(of.dash_direction),
            turn.clamp(-180.0, 180.0),
            kick_power,
            kick_direction,
            tackle,
        ]
        if of.catch is not None:
            parameters.append(direction_of(of.catch))
        if of.move is not None:
            x, y = of.move
            parameters += mixture.weighted_medoid_place(
                x.logits, x.centre.clamp(-pitch.MAX_X, pitch.MAX_X), y.centre.clamp(-pitch.MAX_Y, pitch.MAX_Y)
            ).unbind(1)
        return Prediction(self.logits, torch.stack(parameters, 1))

    def log_likelihood(self, target: Target) -> Tensor:
        """Return (batch,) log-likelihood, in nats, of the parameters of the command given."""
        return _chosen(self.distribution, target, [self._kick])

    def draw_parameters(self, kind: Tensor, generator: torch.Generator | None) -> Tensor:
        """Draw (batch, 2) parameters of these commands, see `Answer.draw_parameters`; 0 of kicks left out."""
        of = self.distribution
        ways: list[Callable[[Tensor, torch.Generator | None], tuple[Tensor, ...]]] = [
            self._draw_dash,
            self._draw_turn,
            self._draw_kick,
            self._draw_tackle,
        ]
        if of.catch is not None:
            ways.append(self._draw_catch)
        if of.move is not None:
            ways.append(self._draw_move)
        drawn = of.turn_factor.new_zeros(len(kind), 2)
        for index, way in enumerate(ways):
            rows = torch.nonzero(kind == index).squeeze(1)
            if of.kick_rows is not None and index in WITH_BALL:
                rows = rows[torch.isin(rows, of.kick_rows)]
            for column, values in enumerate(way(rows, generator)):
                drawn[rows, column] = values
        return drawn

    def _draw_dash(self, rows: Tensor, generator: torch.Generator | None) -> tuple[Tensor, ...]:
        power = self.distribution.dash_power.select(rows)
        component = mixture.draw_component(power.logits, generator)
        return (
            mixture.draw_value(power, component, generator, low=0.0, high=100.0),
            mixture.draw_direction(self.distribution.dash_direction[rows], generator),
        )

    def _draw_turn(self, rows: Tensor, generator: torch.Generator | None) -> tuple[Tensor, ...]:
        turn = self.distribution.turn.select(rows)
        component = mixture.draw_component(turn.logits, generator)
        return (mixture.draw_angle(turn, component, generator, factor=self.distribution.turn_factor[rows]),)

    def _draw_kick(self, rows: Tensor, generator: torch.Generator | None) -> tuple[Tensor, ...]:
        power, direction = (part.select(self._asked(rows)) for part in self._kick[:2])
        component = mixture.draw_component(power.logits, generator)
        return (
            mixture.draw_value(power, component, generator, low=0.0, high=100.0),
            mixture.draw_angle(direction, component, generator),
        )

    def _draw_tackle(self, rows: Tensor, generator: torch.Generator | None) -> tuple[Tensor, ...]:
        return (mixture.draw_direction(self._kick.tackle[self._asked(rows)], generator),)

    def _draw_catch(self, rows: Tensor, generator: torch.Generator | None) -> tuple[Tensor, ...]:
        assert self.distribution.catch is not None
        return (mixture.draw_direction(self.distribution.catch[rows], generator),)

    def _draw_move(self, rows: Tensor, generator: torch.Generator | None) -> tuple[Tensor, ...]:
        assert self.distribution.move is not None
        x, y = (part.select(rows) for part in self.distribution.move)
        place = mixture.draw_component(x.logits, generator)
        return (
            mixture.draw_value(x, place, generator, low=-pitch.MAX_X, high=pitch.MAX_X),
            mixture.draw_value(y, place, generator, low=-pitch.MAX_Y, high=pitch.MAX_Y),
        )

    def _asked(self, rows: Tensor) -> Tensor:
        """Return where situations, (n,) indices into the batch, are among those whose kick was asked for."""
        kick_rows = self.distribution.kick_rows
        if kick_rows is None:
            return rows
        order = kick_rows.argsort()
        return order[torch.searchsorted(kick_rows[order], rows)]


class MixtureHead(nn.Module):
    """Command probabilities, and for each command a distribution of its parameters.

    Components depend on what a player may want: to face the ball, the place where it is met, or a target point; to come
    to rest there; to spend a multiple of the stamina recovered in a cycle; to kick as in `heads.kick.KickMixture`. The
    network gives their shares, small corrections and scales.

    A parameter known to a hundredth of a degree pulls a thousand times harder than a command; so the layers that they
    share learn from the commands, and the target points from turns by a logistic density of their own.

    Args:
        width: of what the command is decided on. parameter_width: of what dashes and turns are. kick_width: of what
            kicks are, target_width: of what is known of each player or goal to kick to. planned, candidates,
            candidate_dropout: see `heads.kick.KickMixture`. target_points: of `layers.targets.TargetPoints`.
            commands: the command set.
        parameter_weight: of the parameters' error beside that of the command. target_weight: of the error by which
            turns teach the target points.

    Attributes:
        temperature: as of `PointHead`; of the commands only.
    """

    temperature: Tensor
    places: Tensor

    def __init__(
        self,
        *,
        width: int,
        parameter_width: int,
        kick_width: int,
        target_width: int,
        planned: bool,
        target_points: int,
        candidates: int = 0,
        candidate_dropout: float = 0.0,
        commands: tuple[str, ...] = CLONED,
        parameter_weight: float = 1.0,
        target_weight: float = 0.0,
    ) -> None:
        super().__init__()
        self.parameter_weight, self.target_weight = parameter_weight, target_weight
        self.n_dash = target_points + INCOMES + FREE_COMPONENTS
        self.n_turn = target_points + 2 + FREE_COMPONENTS
        self.command = nn.Linear(width, len(commands))
        self.dash = nn.Linear(parameter_width, 3 * self.n_dash + DASH_DIRECTIONS)
        self.turn = nn.Linear(parameter_width, 3 * self.n_turn)
        self.kick = KickMixture(
            kick_width, target_width, planned=planned, candidates=candidates, dropout=candidate_dropout
        )
        self.tackle = nn.Linear(kick_width, TACKLE_DIRECTIONS)
        self.planned_tackle = nn.Linear(kick_width, 1) if planned else None
        self.incomes = nn.Parameter(torch.linspace(0.25, 2.0, INCOMES))
        self.powers = nn.Parameter(torch.linspace(0.0, 100.0, FREE_COMPONENTS))
        self.catch = nn.Linear(parameter_width, CATCH_DIRECTIONS) if "catch" in commands else None
        if self.catch is not None:
            self.catch_edges = nn.Parameter(torch.tensor([-CATCH_EDGE_DEG, CATCH_EDGE_DEG]) * DEGREE)
            self.catch_sharpness = nn.Parameter(torch.tensor(4.0))
        self.move = nn.Linear(parameter_width, 5 * len(MOVE_PLACES)) if "move" in commands else None
        if self.move is not None:
            self.register_buffer("places", torch.tensor(MOVE_PLACES), persistent=False)
        self.register_buffer("temperature", torch.ones(()))

    def forward(self, situation: TrunkOutput) -> MixtureAnswer:
        """Return the answer to the output of an egocentric trunk."""
        command = self.command(situation.hidden).float()
        dash, turn = (layer(situation.parameters).float() for layer in (self.dash, self.turn))
        kick = self.kick_answers(situation.at_ball)
        with torch.autocast(command.device.type, enabled=False):
            turned, to_targets = self._turn(turn, situation)
            distribution = ActionDistribution(
                logits=command,
                dash_power=self._dash(dash[:, : 3 * self.n_dash], situation),
                dash_direction=dash[:, 3 * self.n_dash :],
                turn=turned,
                turn_factor=geometry_of(situation.geometry, "turn_factor")[0][:, 0],
                turn_to_targets=to_targets,
                kick=kick,
                kick_rows=situation.kick_rows,
                catch=self._catch(situation),
                move=self._move(situation),
            )
        return MixtureAnswer(distribution, self.temperature)

    def _dash(self, raw: Tensor, situation: TrunkOutput) -> Mixture:
        logits, shift, scale = raw.chunk(3, 1)
        income = geometry_of(situation.geometry, "income")[0]
        free = self.powers.expand(raw.shape[0], -1)
        wanted = [situation.power.detach().clamp(-20, 120), income * self.incomes, free]
        return Mixture(
            logits,
            torch.cat(wanted, 1) + DASH_REACH * shift,
            mixture.scale_of(scale, least=LEAST_POWER, typical=TYPICAL_DASH),
        )

    def _turn(self, raw: Tensor, situation: TrunkOutput) -> tuple[Mixture, Mixture]:
        """Return the turn, and the turn by the target points alone."""
        logits, shift, scale = raw.chunk(3, 1)
        to_ball, to_meet = geometry_of(situation.geometry, "turn_to_ball", "turn_to_meet")
        free = (
            torch.linspace(-FREE_HALF_TURNS, FREE_HALF_TURNS, FREE_COMPONENTS, device=raw.device).expand(
                raw.shape[0], -1
            )
            * torch.pi
        )
        centre = torch.cat([to_ball, to_meet, situation.bearing, free], 1)
        # Only the free ones go far from where they begin.
        reach = torch.cat([torch.full_like(centre[:, :-FREE_COMPONENTS], TURN_REACH), torch.ones_like(free)], 1)
        turn = Mixture(
            logits,
            wrap(centre.detach() + reach * shift),
            mixture.scale_of(scale, least=LEAST_ANGLE, typical=TYPICAL_TURN),
        )
        width = torch.full_like(centre, TARGET_SCALE_DEG * DEGREE)
        return turn, Mixture(logits.detach(), wrap(centre), width)

    def _catch(self, situation: TrunkOutput) -> Tensor | None:
        """Return the direction: a catch has the ball at an edge of the catch area, not in its middle."""
        if self.catch is None:
            return None
        names = ("x", "y", "cos", "sin", "ball_x", "ball_y")
        x, y, cos, sin, ball_x, ball_y = geometry_of(situation.geometry, *names)
        x, y = ball_x - x, ball_y - y
        edges = wrap(torch.atan2(y * cos - x * sin, x * cos + y * sin) + self.catch_edges)
        edges = edges.clamp(-CATCH_LIMIT_DEG * DEGREE, CATCH_LIMIT_DEG * DEGREE)
        classes = torch.arange(CATCH_DIRECTIONS, device=x.device) * (2 * math.pi / CATCH_DIRECTIONS)
        bells = self.catch_sharpness.exp() * (torch.cos(classes - edges[..., None]) - 1)
        free: Tensor = self.catch(situation.parameters.float())
        return free + bells.logsumexp(1)

    def _move(self, situation: TrunkOutput) -> Move | None:
        if self.move is None:
            return None
        logits, *raw = self.move(situation.parameters.float()).chunk(5, 1)
        x, y = (base + MOVE_REACH_M * shift for base, shift in zip(self.places.T, raw[:2], strict=True))
        x_scale, y_scale = (mixture.scale_of(scale, least=LEAST_PLACE, typical=TYPICAL_PLACE) for scale in raw[2:])
        return Move(Mixture(logits, x, x_scale), Mixture(logits, y, y_scale))

    def kick_answers(self, seen: KickFeatures) -> tuple[KickAnswer, KickAnswer]:
        """Return the answers on kicks and tackles: from the situation, and from its mirror image mirrored back."""
        both = self.kick(*seen)
        tackle = self.tackle(seen.hidden).float()
        if self.planned_tackle is not None:
            there, degrees = seen.inputs.tackle.unbind(1)
            trust = there[:, None] * self.planned_tackle(seen.hidden).float()
            tackle = tackle.scatter_add(1, class_of(degrees, TACKLE_DIRECTIONS)[:, None], trust)
        (power, power_mirrored), (direction, direction_mirrored) = (mixture.halves(part) for part in both)
        # Class k lies at k steps, its mirror at -k.
        opposite = torch.remainder(-torch.arange(TACKLE_DIRECTIONS, device=tackle.device), TACKLE_DIRECTIONS)
        n = tackle.shape[0] // 2
        return (
            KickAnswer(power, direction, tackle[:n]),
            KickAnswer(power_mirrored, mixture.mirrored(direction_mirrored), tackle[n:, opposite]),
        )

    def merged(self, answers: Sequence[MixtureAnswer]) -> MixtureAnswer:
        """Return one answer: mean probabilities, and mixtures of all components."""
        of = [answer.distribution for answer in answers]
        catches, moves = [one.catch for one in of if one.catch is not None], [one.move for one in of if one.move]
        return MixtureAnswer(
            ActionDistribution(
                logits=mean_logits([one.logits for one in of]),
                dash_power=mixture.merged([one.dash_power for one in of]),
                dash_direction=mean_logits([one.dash_direction for one in of]),
                turn=mixture.merged([one.turn for one in of]),
                turn_factor=of[0].turn_factor,
                turn_to_targets=mixture.merged([one.turn_to_targets for one in of]),
                kick=tuple(kick for one in of for kick in one.kick),
                kick_rows=of[0].kick_rows,
                catch=mean_logits(catches) if catches else None,
                move=_mean_move(moves) if moves else None,
            ),
            self.temperature,
        )

    def loss(
        self,
        answer: MixtureAnswer,
        target: Target,
        *,
        balance: Balance | None = None,
        whole: Tensor | None = None,
    ) -> Loss:
        """Return the negative log-likelihood of command and parameters; arguments as in `loss.point_loss`.

        In training the kick as it is and its mirror image count each by itself, so that each learns as if alone.
        """
        of = answer.distribution
        answers = of.kick if self.training else (_mean_kick(of.kick),)
        to_targets = mixture.log_likelihood(
            of.turn_to_targets.logits,
            _Number.of(target, 0).angle_terms(of.turn_to_targets, factor=of.turn_factor),
        )
        return mixture_loss(
            of.logits,
            _chosen(of, target, answers),
            target,
            to_targets=torch.where(target.kind == CLONED.index("turn"), to_targets, 0.0),
            weight=self.parameter_weight,
            target_weight=self.target_weight,
            balance=balance,
            whole=whole,
        )

    @staticmethod
    def kick_loss(kicks: Sequence[KickAnswer], target: Target, *, of: int) -> Tensor:
        """Return the error of kicks and tackles alone, summed and divided by ``of``; each answer counts by itself."""
        likelihood = _kick_likelihood(kicks, target)
        kind = (target.kind == WITH_BALL[1]).long()
        return -likelihood.gather(1, kind[:, None]).sum() / of


def with_ball(target: Target) -> Tensor:
    """(n,) where a kick or tackle was given."""
    kick, tackle = WITH_BALL
    return torch.nonzero((target.kind == kick) | (target.kind == tackle)).squeeze(1)


def _mean_kick(kicks: Sequence[KickAnswer]) -> KickAnswer:
    return KickAnswer(
        power=mixture.merged([kick.power for kick in kicks]),
        direction=mixture.merged([kick.direction for kick in kicks]),
        tackle=mean_logits([kick.tackle for kick in kicks]),
    )


def _mean_move(moves: Sequence[Move]) -> Move:
    return Move(mixture.merged([move.x for move in moves]), mixture.merged([move.y for move in moves]))


def _spread(values: Tensor, output: ActionDistribution) -> Tensor:
    """(batch, ...) values of the situations whose kick was asked for, 0 for the others."""
    if output.kick_rows is None:
        return values
    return values.new_zeros(output.logits.shape[0], *values.shape[1:]).index_copy(0, output.kick_rows, values)


class _Number(NamedTuple):
    """One number of each command: (batch,) what it is; (batch, 2) ends of its interval, None where it is exact."""

    value: Tensor
    span: Tensor | None

    @classmethod
    def of(cls, target: Target, index: int) -> _Number:
        """Return the first or second number of commands."""
        value = target.parameters[:, index]
        return cls(value, None if target.interval is None else value[:, None] + target.interval[:, index])

    def clipped_terms(self, parts: Mixture, *, low: float, high: float) -> Tensor:
        """Return `distributions.clipped_terms` of it."""
        if self.span is None:
            return mixture.clipped_terms(parts, self.value, low=low, high=high)
        return intervals.clipped_terms(parts, self.span, low=low, high=high)

    def angle_terms(self, parts: Mixture, *, factor: Tensor | None = None) -> Tensor:
        """Return `distributions.angle_terms` of it."""
        if self.span is None:
            return mixture.angle_terms(parts, self.value, factor=factor)
        return intervals.angle_terms(parts, self.span, factor=factor)

    def log_class(self, logits: Tensor) -> Tensor:
        """Return `distributions.log_class` of it."""
        return log_class(logits, self.value) if self.span is None else intervals.log_class(logits, self.span)


def _kick_likelihood(answers: Sequence[KickAnswer], target: Target) -> Tensor:
    """(kicks, 2) log-likelihood of the numbers of (kicks,) commands as those of a kick and of a tackle.

    It is the mean of the answers.
    """
    first, second = _Number.of(target, 0), _Number.of(target, 1)
    each = []
    for kick in answers:
        terms = first.clipped_terms(kick.power, low=0.0, high=100.0) + second.angle_terms(kick.direction)
        both = [mixture.log_likelihood(kick.power.logits, terms), first.log_class(kick.tackle)]
        each.append(torch.stack(both, 1))
    return torch.stack(each).mean(0)


def _chosen(output: ActionDistribution, target: Target, answers: Sequence[KickAnswer]) -> Tensor:
    """(batch,) log-likelihood of the parameters of the command given, of a kick as the mean of ``answers``."""
    of_kicks = target if output.kick_rows is None else target.select(output.kick_rows)
    kick = _spread(_kick_likelihood(answers, of_kicks), output)
    first, second = _Number.of(target, 0), _Number.of(target, 1)
    dash = mixture.log_likelihood(output.dash_power.logits, first.clipped_terms(output.dash_power, low=0.0, high=100.0))
    turn = mixture.log_likelihood(output.turn.logits, first.angle_terms(output.turn, factor=output.turn_factor))
    terms = [dash + second.log_class(output.dash_direction), turn, kick[:, 0], kick[:, 1]]
    if output.catch is not None:
        terms.append(first.log_class(output.catch))
    if output.move is not None:
        x = first.clipped_terms(output.move.x, low=-pitch.MAX_X, high=pitch.MAX_X)
        y = second.clipped_terms(output.move.y, low=-pitch.MAX_Y, high=pitch.MAX_Y)
        terms.append(mixture.log_likelihood(output.move.x.logits, x + y))
    terms += [torch.zeros_like(dash)] * (output.logits.shape[1] - len(terms))  # none has no parameters
    by_kind = torch.stack(terms, 1)
    return by_kind.gather(1, target.kind[:, None]).squeeze(1)
