"""Heads: from what a network has made of a situation to an answer, its training error and its single best guess."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import torch
from torch import Tensor, nn

from teamclone.models import distributions as mixture
from teamclone.models.distributions import DEGREE, LEAST_ANGLE, LEAST_PLACE, LEAST_POWER, Mixture, wrap
from teamclone.models.heads.kick import Kicks
from teamclone.models.inputs.geometry import geometry_of, tackle_of
from teamclone.models.loss import Balance, Loss, ParameterLoss, mixture_loss, on, point_loss
from teamclone.planner import tackle as tackling
from teamclone.rcss import pitch
from teamclone.rcss.commands import CLONED, parameters_of
from teamclone.world.state import Target

INCOMES = 6
"""Components of dash power that are a learned multiple of what the player recovers in a cycle."""
FREE = 4
"""Components of dash power and turn moment that hang on nothing."""
DASH_DIRECTIONS = 24
"""Classes of dash direction, 15 degrees apart."""
TACKLE_DIRECTIONS = tackling.DIRECTIONS
"""Classes of tackle direction, 9 degrees apart."""
CATCH_DIRECTIONS = 40
"""Classes of catch direction, 9 degrees apart."""
CATCH_EDGE_DEG = 22.6
"""Angle from the middle of the catch area to its far corners, 1.2 m ahead and 0.5 m aside."""
CATCH_LIMIT_DEG = 90.0
"""To which the server clips the direction of a catch (since version 17)."""
MOVE_PLACES = tuple((x, y) for x in (-45.0, -30.0, -15.0, -5.0) for y in (-12.0, 12.0))
"""Where the components of a move begin to learn, metres: places of the own half."""
MOVE_REACH_M = 10.0
"""How far from there one goes for an output of 1."""
WITH_BALL = CLONED.index("kick"), CLONED.index("tackle")
"""Classes whose parameters the layers of a kick find."""
AIM_SCALE_DEG = 4.0
"""Scale of the bell by which a turn teaches the aims that are near its direction."""


class Prediction(NamedTuple):
    """One answer per situation: ``logits`` (batch, commands), ``parameters`` (batch, parameters) in power, degrees and
    metres, each as it would be if its command were given."""

    logits: Tensor
    parameters: Tensor


class AtBall(NamedTuple):
    """What kicks and tackles are decided on, first of the situations as they are, then of the same mirrored.

    Attributes:
        hidden: (2 * kicks, kick width). geometry: (2 * kicks, columns of geometry).
        targets: (2 * kicks, TARGETS, width) what `crowd.Crowd` says of those to kick to; None without one.
    """

    hidden: Tensor
    geometry: Tensor
    targets: Tensor | None


class Situation(NamedTuple):
    """What a network has made of a state.

    Attributes:
        hidden: (batch, width) what the command is decided on.
        parameters: (batch, parameter width) what dashes and turns are.
        at_ball: what kicks and tackles are; nothing where the head does not ask for it, as for ``parameters``.
        kicks: (kicks,) of which situations; None for all.
        geometry: (batch, at least len(GEOMETRY)).
        bearing, power: (batch, aims) as of `aims.Aims`.
    """

    hidden: Tensor
    parameters: Tensor
    at_ball: AtBall
    kicks: Tensor | None
    geometry: Tensor
    bearing: Tensor
    power: Tensor


class PointHead(nn.Module):
    """The paper's two heads: a softmax over the commands, by default four, their parameters, then six, bounded by tanh.

    Attributes:
        temperature: () what the logits are divided by in an answer, not in training; see `training.calibration`.
    """

    limits: Tensor
    temperature: Tensor

    def __init__(self, width: int, commands: tuple[str, ...] = CLONED) -> None:
        super().__init__()
        self.commands = commands
        self.command = nn.Linear(width, len(commands))
        self.parameter = nn.Linear(width, len(parameters_of(commands)))
        self.register_buffer("limits", on(torch.device("cpu"), commands)[0].clone(), persistent=False)
        self.register_buffer("temperature", torch.ones(()))

    def forward(self, seen: Tensor | Situation) -> tuple[Tensor, Tensor]:
        """Logits (batch, commands) and parameters in [-1, 1], (batch, parameters)."""
        hidden = seen.hidden if isinstance(seen, Situation) else seen
        # Out of autocast's bfloat16: a degree is 1/180, finer than its steps near 1.
        return self.command(hidden).float(), torch.tanh(self.parameter(hidden).float())

    def merged(self, outputs: Sequence[tuple[Tensor, Tensor]]) -> tuple[Tensor, Tensor]:
        """The answers of several heads as one: mean probabilities, of each parameter the one nearest to all."""
        logits, projected = zip(*outputs, strict=True)
        values = torch.stack(projected, 2) * math.pi
        even = torch.zeros_like(values[:, 0])
        chosen = [
            mixture.middle(even, values[:, i], angle=of.angle) for i, of in enumerate(parameters_of(self.commands))
        ]
        return mean_logits(logits), torch.stack(chosen, 1) / math.pi

    @staticmethod
    def logits(output: tuple[Tensor, Tensor]) -> Tensor:
        """(batch, commands) as they are trained, before the temperature."""
        return output[0]

    def point(self, output: tuple[Tensor, Tensor]) -> Prediction:
        """The single best answer, in power and degrees."""
        logits, projected = output
        return Prediction(logits / self.temperature, projected * self.limits)

    def loss(
        self,
        output: tuple[Tensor, Tensor],
        target: Target,
        *,
        parameter_loss: ParameterLoss = "paper",
        weight: float = 1.0,
        aim_weight: float = 0.0,
        balance: Balance | None = None,
        whole: Tensor | None = None,
    ) -> Loss:
        """The paper's; ``aim_weight`` does not apply."""
        logits, projected = output
        return point_loss(
            logits,
            projected,
            target,
            commands=self.commands,
            parameter_loss=parameter_loss,
            weight=weight,
            balance=balance,
            whole=whole,
        )


class Kick(NamedTuple):
    """One answer on what a kick or tackle would be: power, radians, (kicks, TACKLE_DIRECTIONS) logits."""

    power: Mixture
    direction: Mixture
    tackle: Tensor


class Move(NamedTuple):
    """The place of a move, metres: both coordinates with the shares of the same components."""

    x: Mixture
    y: Mixture


class Distribution(NamedTuple):
    """What a `MixtureHead` answers, all for the command that they belong to.

    Attributes:
        logits: (batch, commands).
        dash_power: power. dash_direction: (batch, DASH_DIRECTIONS) logits. turn: radians before the loss by motion.
        turn_factor: (batch,) turn moment for one degree.
        aim: the turn again, by the aims alone: only they are to learn from it.
        kick: several answers of which the mean counts.
        kicks: (kicks,) of which situations they are; None for all.
        catch: (batch, CATCH_DIRECTIONS) logits. move: a place. None where this is no command of the model.
    """

    logits: Tensor
    dash_power: Mixture
    dash_direction: Tensor
    turn: Mixture
    turn_factor: Tensor
    aim: Mixture
    kick: tuple[Kick, ...]
    kicks: Tensor | None
    catch: Tensor | None
    move: Move | None


class MixtureHead(nn.Module):
    """Command probabilities, and for each command a distribution of its parameters.

    Components hang on what a player may want: to face the ball, where he meets it or where he makes for; to come to
    rest there; to spend a multiple of what he recovers; to kick as `kicks.Kicks` says. The network gives their shares,
    small corrections and scales.

    A parameter known to a hundredth of a degree pulls a thousand times harder than a command; so the layers that they
    share learn from the commands, and the aims from turns by a bell of their own.

    Args:
        width: of what the command is decided on. parameter_width: of what dashes and turns are. kick_width: of what
            kicks are, target_width: of what is known of each target. planned: see `kicks.Kicks`. aims: places of
            `aims.Aims`. commands: what it answers with.

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
        aims: int,
        commands: tuple[str, ...] = CLONED,
    ) -> None:
        super().__init__()
        self.n_dash, self.n_turn = aims + INCOMES + FREE, aims + 2 + FREE
        self.command = nn.Linear(width, len(commands))
        self.dash = nn.Linear(parameter_width, 3 * self.n_dash + DASH_DIRECTIONS)
        self.turn = nn.Linear(parameter_width, 3 * self.n_turn)
        self.kick = Kicks(kick_width, target_width, planned=planned)
        self.tackle = nn.Linear(kick_width, TACKLE_DIRECTIONS)
        self.planned_tackle = nn.Linear(kick_width, 1) if planned else None
        self.incomes = nn.Parameter(torch.linspace(0.25, 2.0, INCOMES))
        self.powers = nn.Parameter(torch.linspace(0.0, 100.0, FREE))
        self.catch = nn.Linear(parameter_width, CATCH_DIRECTIONS) if "catch" in commands else None
        if self.catch is not None:
            self.catch_edges = nn.Parameter(torch.tensor([-CATCH_EDGE_DEG, CATCH_EDGE_DEG]) * DEGREE)
            self.catch_sharpness = nn.Parameter(torch.tensor(4.0))
        self.move = nn.Linear(parameter_width, 5 * len(MOVE_PLACES)) if "move" in commands else None
        if self.move is not None:
            self.register_buffer("places", torch.tensor(MOVE_PLACES), persistent=False)
        self.register_buffer("temperature", torch.ones(()))

    def forward(self, situation: Situation) -> Distribution:
        command = self.command(situation.hidden).float()
        dash, turn = (layer(situation.parameters).float() for layer in (self.dash, self.turn))
        kick = self.kicks(situation.at_ball)
        with torch.autocast(command.device.type, enabled=False):
            turned, aim = self._turn(turn, situation)
            return Distribution(
                logits=command,
                dash_power=self._dash(dash[:, : 3 * self.n_dash], situation),
                dash_direction=dash[:, 3 * self.n_dash :],
                turn=turned,
                turn_factor=geometry_of(situation.geometry, "turn_factor")[0][:, 0],
                aim=aim,
                kick=kick,
                kicks=situation.kicks,
                catch=self._catch(situation),
                move=self._move(situation),
            )

    def _dash(self, raw: Tensor, situation: Situation) -> Mixture:
        logits, shift, scale = raw.chunk(3, 1)
        income = geometry_of(situation.geometry, "income")[0]
        free = self.powers.expand(raw.shape[0], -1)
        wanted = [situation.power.detach().clamp(-20, 120), income * self.incomes, free]
        return Mixture(
            logits, torch.cat(wanted, 1) + 5 * shift, mixture.scale_of(scale, least=LEAST_POWER, typical=3.0)
        )

    def _turn(self, raw: Tensor, situation: Situation) -> tuple[Mixture, Mixture]:
        """The turn, and by the aims alone."""
        logits, shift, scale = raw.chunk(3, 1)
        to_ball, to_meet = geometry_of(situation.geometry, "turn_to_ball", "turn_to_meet")
        free = torch.linspace(-0.75, 0.75, FREE, device=raw.device).expand(raw.shape[0], -1) * torch.pi
        centre = torch.cat([to_ball, to_meet, situation.bearing, free], 1)
        # Only the free ones go far from where they begin.
        reach = torch.cat([torch.full_like(centre[:, :-FREE], 0.05), torch.ones_like(free)], 1)
        turn = Mixture(
            logits,
            wrap(centre.detach() + reach * shift),
            mixture.scale_of(scale, least=LEAST_ANGLE, typical=2 * DEGREE),
        )
        width = torch.full_like(centre, AIM_SCALE_DEG * DEGREE)
        return turn, Mixture(logits.detach(), wrap(centre), width)

    def _catch(self, situation: Situation) -> Tensor | None:
        """Goalkeepers aim such that the ball lies at an edge of the catch area, not in its middle."""
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

    def _move(self, situation: Situation) -> Move | None:
        if self.move is None:
            return None
        logits, *raw = self.move(situation.parameters.float()).chunk(5, 1)
        x, y = (base + MOVE_REACH_M * shift for base, shift in zip(self.places.T, raw[:2], strict=True))
        x_scale, y_scale = (mixture.scale_of(scale, least=LEAST_PLACE, typical=2.0) for scale in raw[2:])
        return Move(Mixture(logits, x, x_scale), Mixture(logits, y, y_scale))

    def kicks(self, seen: AtBall) -> tuple[Kick, Kick]:
        """As the situation is and from its mirror: what is right on the left is right on the right."""
        both = self.kick(*seen)
        tackle = self.tackle(seen.hidden).float()
        if self.planned_tackle is not None:
            there, degrees = tackle_of(seen.geometry).unbind(1)
            trust = there[:, None] * self.planned_tackle(seen.hidden).float()
            tackle = tackle.scatter_add(1, class_of(degrees, TACKLE_DIRECTIONS)[:, None], trust)
        (power, power_mirrored), (direction, direction_mirrored) = (mixture.halves(part) for part in both)
        # Class k lies at k steps, its mirror at -k.
        opposite = torch.remainder(-torch.arange(TACKLE_DIRECTIONS, device=tackle.device), TACKLE_DIRECTIONS)
        n = tackle.shape[0] // 2
        return (
            Kick(power, direction, tackle[:n]),
            Kick(power_mirrored, mixture.mirrored(direction_mirrored), tackle[n:, opposite]),
        )

    @staticmethod
    def merged(outputs: Sequence[Distribution]) -> Distribution:
        """The answers of several heads as one: mean probabilities, and mixtures of all their components."""
        return Distribution(
            logits=mean_logits([output.logits for output in outputs]),
            dash_power=mixture.merged([output.dash_power for output in outputs]),
            dash_direction=mean_logits([output.dash_direction for output in outputs]),
            turn=mixture.merged([output.turn for output in outputs]),
            turn_factor=outputs[0].turn_factor,
            aim=mixture.merged([output.aim for output in outputs]),
            kick=tuple(kick for output in outputs for kick in output.kick),
            kicks=outputs[0].kicks,
            catch=mean_logits(catches) if (catches := [o.catch for o in outputs if o.catch is not None]) else None,
            move=_mean_move(moves) if (moves := [o.move for o in outputs if o.move is not None]) else None,
        )

    @staticmethod
    def logits(output: Distribution) -> Tensor:
        """(batch, commands) as they are trained, before the temperature."""
        return output.logits

    def point(self, output: Distribution) -> Prediction:
        """The single best answer, in power and degrees: of each mixture the component nearest to its median.

        Where the kick was not asked for, its parameters are 0.
        """
        turn = mixture.middle(output.turn.logits, output.turn.centre, angle=True) / DEGREE * output.turn_factor
        kick = _mean_kick(output.kick)
        on_ball = [
            mixture.middle(kick.power.logits, kick.power.centre.clamp(0, 100), angle=False),
            mixture.middle(kick.direction.logits, kick.direction.centre, angle=True) / DEGREE,
            direction_of(kick.tackle),
        ]
        kick_power, kick_direction, tackle = (_spread(values, output) for values in on_ball)
        parameters = [
            mixture.middle(output.dash_power.logits, output.dash_power.centre.clamp(0, 100), angle=False),
            direction_of(output.dash_direction),
            turn.clamp(-180.0, 180.0),
            kick_power,
            kick_direction,
            tackle,
        ]
        if output.catch is not None:
            parameters.append(direction_of(output.catch))
        if output.move is not None:
            x, y = output.move
            parameters += mixture.middle_place(
                x.logits, x.centre.clamp(-pitch.MAX_X, pitch.MAX_X), y.centre.clamp(-pitch.MAX_Y, pitch.MAX_Y)
            ).unbind(1)
        return Prediction(output.logits / self.temperature, torch.stack(parameters, 1))

    def loss(
        self,
        output: Distribution,
        target: Target,
        *,
        parameter_loss: ParameterLoss = "paper",
        weight: float = 1.0,
        aim_weight: float = 0.0,
        balance: Balance | None = None,
        whole: Tensor | None = None,
    ) -> Loss:
        """Negative log-likelihood of command and parameters together; ``parameter_loss`` does not apply.

        In training each answer on a kick counts by itself, so that it learns as if alone.
        """
        answers = output.kick if self.training else (_mean_kick(output.kick),)
        aims = mixture.log_likelihood(
            output.aim.logits,
            mixture.angle_terms(output.aim, target.parameters[:, 0], factor=output.turn_factor),
        )
        return mixture_loss(
            output.logits,
            _chosen(output, target, answers),
            target,
            aims=torch.where(target.kind == CLONED.index("turn"), aims, 0.0),
            weight=weight,
            aim_weight=aim_weight,
            balance=balance,
            whole=whole,
        )

    @staticmethod
    def kick_loss(kicks: Sequence[Kick], target: Target, *, of: int) -> Tensor:
        """That of kicks and tackles alone, summed over them and divided by ``of``; each answer counts by itself."""
        likelihood = _kick_likelihood(kicks, target.parameters)
        kind = (target.kind == WITH_BALL[1]).long()
        return -likelihood.gather(1, kind[:, None]).sum() / of

    @staticmethod
    def log_likelihood(output: Distribution, target: Target) -> Tensor:
        """(batch,) log-likelihood of the parameters of the command given, per unit of power and degree."""
        return _chosen(output, target, [_mean_kick(output.kick)])


def with_ball(target: Target) -> Tensor:
    """(n,) where a kick or tackle was given."""
    kick, tackle = WITH_BALL
    return torch.nonzero((target.kind == kick) | (target.kind == tackle)).squeeze(1)


def _mean_kick(kicks: Sequence[Kick]) -> Kick:
    return Kick(
        power=mixture.merged([kick.power for kick in kicks]),
        direction=mixture.merged([kick.direction for kick in kicks]),
        tackle=mean_logits([kick.tackle for kick in kicks]),
    )


def _mean_move(moves: Sequence[Move]) -> Move:
    return Move(mixture.merged([move.x for move in moves]), mixture.merged([move.y for move in moves]))


def _spread(values: Tensor, output: Distribution) -> Tensor:
    """(batch, ...) values of the situations whose kick was asked for, 0 for the others."""
    if output.kicks is None:
        return values
    return values.new_zeros(output.logits.shape[0], *values.shape[1:]).index_copy(0, output.kicks, values)


def _kick_likelihood(answers: Sequence[Kick], parameters: Tensor) -> Tensor:
    """(kicks, 2) log-likelihood of (kicks, 2) parameters as those of a kick and of a tackle, the mean of answers."""
    first, second = parameters[:, 0], parameters[:, 1]
    each = []
    for kick in answers:
        terms = mixture.power_terms(kick.power, first) + mixture.angle_terms(kick.direction, second)
        both = [mixture.log_likelihood(kick.power.logits, terms), log_class(kick.tackle, first)]
        each.append(torch.stack(both, 1))
    return torch.stack(each).mean(0)


def _chosen(output: Distribution, target: Target, answers: Sequence[Kick]) -> Tensor:
    """(batch,) log-likelihood of the parameters of the command given, of a kick as the mean of ``answers``."""
    of_kicks = target.parameters if output.kicks is None else target.parameters[output.kicks]
    kick = _spread(_kick_likelihood(answers, of_kicks), output)
    first, second = target.parameters[:, 0], target.parameters[:, 1]
    dash = mixture.log_likelihood(output.dash_power.logits, mixture.power_terms(output.dash_power, first))
    turn = mixture.log_likelihood(
        output.turn.logits, mixture.angle_terms(output.turn, first, factor=output.turn_factor)
    )
    terms = [dash + log_class(output.dash_direction, second), turn, kick[:, 0], kick[:, 1]]
    if output.catch is not None:
        terms.append(log_class(output.catch, first))
    if output.move is not None:
        x = mixture.clipped_terms(output.move.x, first, low=-pitch.MAX_X, high=pitch.MAX_X)
        y = mixture.clipped_terms(output.move.y, second, low=-pitch.MAX_Y, high=pitch.MAX_Y)
        terms.append(mixture.log_likelihood(output.move.x.logits, x + y))
    terms += [torch.zeros_like(dash)] * (output.logits.shape[1] - len(terms))  # none has no parameters
    by_kind = torch.stack(terms, 1)
    return by_kind.gather(1, target.kind[:, None]).squeeze(1)


class EnsembleHead(nn.Module):
    """Heads of several trunks, which learn side by side and answer together.

    What it answers to a situation is the list of its members' answers; `merged` makes one of them.

    Attributes:
        temperature: as of `PointHead`, of the merged logits; the members keep 1.
    """

    temperature: Tensor

    def __init__(self, members: Sequence[PointHead | MixtureHead]) -> None:
        super().__init__()
        self.members = nn.ModuleList(members)
        self.register_buffer("temperature", torch.ones(()))

    @property
    def _first(self) -> Any:
        return self.members[0]

    def forward(self, seen: Sequence[Any]) -> list[Any]:
        return [member(of) for member, of in zip(self.members, seen, strict=True)]

    def merged(self, outputs: Sequence[Any]) -> Any:
        return self._first.merged(outputs)

    def logits(self, outputs: Sequence[Any]) -> Tensor:
        """(batch, commands) of the mean probabilities, before the temperature."""
        logits: Tensor = self._first.logits(self.merged(outputs))
        return logits

    def point(self, outputs: Sequence[Any]) -> Prediction:
        prediction: Prediction = self._first.point(self.merged(outputs))
        return prediction._replace(logits=prediction.logits / self.temperature)

    def kicks(self, seen: Sequence[AtBall]) -> list[tuple[Kick, Kick]]:
        """As of `MixtureHead`, which its members have to be."""
        return [cast(MixtureHead, member).kicks(of) for member, of in zip(self.members, seen, strict=True)]

    def kick_loss(self, kicks: Sequence[Sequence[Kick]], target: Target, *, of: int) -> Tensor:
        """The mean of the members' errors, as of `MixtureHead`."""
        return torch.stack([self._first.kick_loss(answers, target, of=of) for answers in kicks]).mean()

    def log_likelihood(self, outputs: Sequence[Any], target: Target) -> Tensor:
        """As of `MixtureHead`, which its members have to be."""
        likelihood: Tensor = self._first.log_likelihood(self.merged(outputs), target)
        return likelihood

    def loss(self, outputs: Sequence[Any], target: Target, **settings: Any) -> Loss:
        """In training the mean of the members' errors, so that each learns as if alone; else that of their answer."""
        if not self.training:
            loss: Loss = self._first.loss(self.merged(outputs), target, **settings)
            return loss
        losses = [self._first.loss(output, target, **settings) for output in outputs]
        return Loss(*(torch.stack(part).mean() for part in zip(*losses, strict=True)))


def mean_logits(logits: Sequence[Tensor]) -> Tensor:
    """(batch, classes) logarithms of the mean probabilities."""
    return torch.stack([torch.log_softmax(of, 1) for of in logits]).logsumexp(0) - math.log(len(logits))


def class_of(degrees: Tensor, count: int) -> Tensor:
    """(batch,) which of ``count`` directions, the first of them straight ahead, is the nearest."""
    return torch.round(degrees * (count / 360.0)).long() % count


def log_class(logits: Tensor, degrees: Tensor) -> Tensor:
    """(batch,) log-likelihood of a direction, taken as even within its class."""
    count = logits.shape[1]
    chosen = torch.log_softmax(logits, 1).gather(1, class_of(degrees, count)[:, None]).squeeze(1)
    return chosen - math.log(360.0 / count)


def direction_of(logits: Tensor) -> Tensor:
    """(batch,) degrees of the most probable direction."""
    count = logits.shape[1]
    degrees = logits.argmax(1).to(logits.dtype) * (360.0 / count)
    return torch.where(degrees > 180.0, degrees - 360.0, degrees)
