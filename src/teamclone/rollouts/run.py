"""``roll_out``: a clone many cycles ahead from frames of matches, beside what happened and what plain guesses give."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray

from teamclone.dynamics.audit import need_types, rules_of
from teamclone.dynamics.bodies import BALL, N_BODIES
from teamclone.dynamics.inverse.recover import recover
from teamclone.dynamics.logged import Logged
from teamclone.dynamics.rules import Rules
from teamclone.errors import TeamcloneError, UsageError
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.logs import read_match
from teamclone.logs.align import plays_on
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS
from teamclone.rollouts.measure import Ahead, measure
from teamclone.rollouts.policies import AsLogged, BallAsLogged, Cloned, GoingOn, Policy
from teamclone.rollouts.simulate import Trajectories, simulate
from teamclone.rollouts.worlds import Worlds, slots_of
from teamclone.world.view import view
from teamclone.world.world import World

if TYPE_CHECKING:
    from teamclone.models.clone import Clone

MOVERS = {
    "samples": "clone, samples",
    "likeliest": "clone, likeliest",
    "last": "go on as in the last cycle",
    "coast": "coast",
    "stand": "stand",
}
"""Who moves the players, in words, by the keys of `MatchRollouts.places`."""
MOST_WORLDS = 512
"""Worlds that go ahead together; bounds memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RolloutConfig:
    """What is rolled out.

    Attributes:
        horizon: cycles ahead. samples: of each start. starts: of each match, drawn from all cycles of play_on.
        others: what the other team does: "logged", "last" (go on as in the last cycle), or "clone".
        ball: "free": moved by the players' commands alone; "touched": after each kick, tackle and catch that the other
            team has in the log, as the log has it; "logged": always as the log has it.
        cycles: where to start, in place of drawn starts.
        seed: of starts, samples and noise.
    """

    horizon: int = 50
    samples: int = 32
    starts: int = 50
    others: str = "logged"
    ball: str = "free"
    cycles: tuple[int, ...] = ()
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchRollouts:
    """The roll-outs of one match.

    Attributes:
        path, match_id, side: the match, and the side of the team that the clone plays. error: why there are none.
        starts: (starts,) frames of the match. reach: (starts,) cycles that their stretch of play goes on.
        own: (starts, 22) which players the clone moves. on_field: (starts, 22) who is there.
        truth: (starts, horizon + 1, 23, 2) metres in the log's frame of reference.
        agreed: (starts, horizon, 22) float, 1 where a player's likeliest command is of the kind that the log has in
            that cycle, 0 where it is not, NaN where the log has none or the player is not the clone's.
        places: by who moves the players, (starts, samples, horizon + 1, 23, 2) metres: ``samples``, ``likeliest``, and
            the guesses ``stand``, ``coast`` and ``last``.
    """

    path: Path
    match_id: str | None = None
    side: int = 1
    error: str | None = None
    starts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    cycles: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    reach: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    own: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, N_PLAYERS), np.bool_))
    on_field: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, N_PLAYERS), np.bool_))
    truth: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 1, N_BODIES, 2), np.float32))
    agreed: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 0, N_PLAYERS), np.float32))
    places: dict[str, NDArray[np.float32]] = field(default_factory=dict)


def roll_out(
    model: Clone,
    path: Path,
    config: RolloutConfig,
    *,
    team: str | None,
    side: str | None = None,
    other: Clone | None = None,
    on_cycle: Callable[[], None] | None = None,
) -> MatchRollouts:
    """Return the roll-outs of a clone in one match.

    Args:
        model: the clone; it plays the field players of its team, and the goalkeeper if it knows catch.
        path: the game log; the command log is found beside it.
        team: name of the team that it plays. side: "left" or "right", in its place.
        other: the clone that plays the other team where ``config.others`` is "clone".
        on_cycle: called after each cycle of each batch of worlds.

    Raises:
        UsageError: the team does not play, the log does not state its rules, or no play goes on for a cycle.
        LogError: the log cannot be read.
    """
    for one in (model, other):
        if one is not None:
            one.need_log_view("a roll-out")
    match = read_match(path)
    ours = MatchColumns.of(match).side_of(team, side)
    rules = rules_of(match.game.server_params, match.game.player_types)
    logged, world = Logged.of(match), view(match, side=1)
    need_types(logged, rules)
    if match.log is None:
        _recover_pushes(logged, rules)
    left = _cycles_left(logged)
    starts = _starts(path, config, match.frames["cycle"], (left > 0) & _is_whole(logged))
    job = _Job(model, other, logged, world, rules, ours, config, on_cycle)
    last = len(left) - 1
    at = np.minimum(starts[:, None] + np.arange(config.horizon + 1), last)
    likeliest, kind = job.likeliest(starts)
    truth = np.stack([logged.bodies.x[at], logged.bodies.y[at]], axis=-1).astype(np.float32)
    return MatchRollouts(
        path=path,
        match_id=match.match_id,
        side=ours,
        starts=starts,
        cycles=match.frames["cycle"][starts],
        reach=left[starts],
        own=job.moved(starts),
        on_field=logged.bodies.on_field[starts],
        truth=truth,
        agreed=_agreed(kind, logged.commands.kind[at[:, :-1]], job.moved(starts)),
        places={"samples": job.samples(starts), "likeliest": likeliest, **job.guesses(starts, truth)},
    )


def _starts(
    path: Path, config: RolloutConfig, cycle: NDArray[np.int32], possible: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Return the frames to start from; ``possible`` (n_frames,) are those that play goes on from."""
    frames = np.flatnonzero(possible)
    if not len(frames):
        raise UsageError(f"{path}: expected cycles of play_on with all positions, got none")
    if not config.cycles:
        rng = np.random.default_rng(config.seed)
        return np.sort(rng.choice(frames, min(config.starts, len(frames)), replace=False))
    found = frames[np.isin(cycle[frames], config.cycles)]
    if missing := sorted({*config.cycles} - {*cycle[found].tolist()}):
        raise UsageError(f"{path}: no play_on goes on from cycle {', '.join(map(str, missing))}")
    return found


def _agreed(kind: NDArray[np.uint8], logged: NDArray[np.uint8], own: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return `MatchRollouts.agreed` of (starts, horizon, 22) commands of roll-outs and of the log."""
    return np.where((logged > 0) & own[:, None], kind == logged, np.nan).astype(np.float32)


def in_matches(
    model: Clone,
    paths: Sequence[Path],
    config: RolloutConfig,
    *,
    team: str | None,
    side: str | None = None,
    other: Clone | None = None,
    on_match: Callable[[Path], Callable[[], None] | None] | None = None,
) -> list[MatchRollouts]:
    """Return the roll-outs of all matches; one that fails costs no other, and says why. See `roll_out`."""
    found = []
    for path in paths:
        try:
            on_cycle = None if on_match is None else on_match(path)
            found.append(roll_out(model, path, config, team=team, side=side, other=other, on_cycle=on_cycle))
        except (TeamcloneError, OSError) as error:
            text = str(error)
            found.append(MatchRollouts(path=path, error=text if str(path) in text else f"{path}: {text}"))
    return found


def figures(matches: Sequence[MatchRollouts]) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Return the errors of all matches together: by who moves the players, of ``players`` and of the ``ball``."""
    done = [match for match in matches if match.error is None]
    if not done:
        return {}
    truth, reach = np.concatenate([match.truth for match in done]), np.concatenate([match.reach for match in done])
    own = np.concatenate([match.own for match in done])
    ball = np.zeros((len(own), N_BODIES), np.bool_)
    ball[:, BALL] = True
    players = np.concatenate([own, np.zeros((len(own), 1), np.bool_)], axis=1)
    agreed = np.concatenate([match.agreed for match in done])
    found: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for name in done[0].places:
        sampled = np.concatenate([match.places[name] for match in done])
        found[name] = {
            group: [_finite(one) for one in measure(sampled, truth, there, reach)]
            for group, there in (("players", players), ("ball", ball))
        }
    for row in found["likeliest"]["players"]:
        of_cycle = agreed[reach >= row["cycles"], row["cycles"] - 1]
        row["agreement"] = float(np.nanmean(of_cycle)) if np.isfinite(of_cycle).any() else None
    return found


def _finite(ahead: Ahead) -> dict[str, Any]:
    return {name: value if math.isfinite(value) else None for name, value in asdict(ahead).items()}


def _cycles_left(match: Logged) -> NDArray[np.int64]:
    """Return (n_frames,) for how many cycles play_on goes on after each frame."""
    goes_on = plays_on(match.frames)
    # The next frame after which it does not go on.
    ends = np.flatnonzero(~goes_on)
    place = np.arange(len(goes_on))
    left: NDArray[np.int64] = ends[np.searchsorted(ends, place)] - place
    return left


def _recover_pushes(match: Logged, rules: Rules) -> None:
    """Fill in, in place, the numbers of kicks and tackles that only a command log would state."""
    found = recover(match.frames, match.players, rules)
    rows = np.isin(found.kind, (CommandKind.KICK, CommandKind.TACKLE)) & ~np.isnan(found.value[:, 0])
    match.commands.numbers[found.frame[rows], found.slot[rows]] = found.value[rows]


def _is_whole(match: Logged) -> NDArray[np.bool_]:
    """Return (n_frames,) in which frames ball and players have all their numbers."""
    bodies = match.bodies
    places = [bodies.x, bodies.y, bodies.vx, bodies.vy]
    lacks = ~np.isfinite(np.sum(places, axis=0))
    lacks[:, :BALL] |= ~np.isfinite(np.sum([getattr(bodies, name) for name in _NUMBERS], axis=0))
    lacks[:, :BALL] &= bodies.on_field
    whole: NDArray[np.bool_] = ~lacks.any(axis=1)
    return whole


def _places(went: Trajectories) -> NDArray[np.float32]:
    """Return (n, horizon + 1, 23, 2)."""
    return np.stack([went.x, went.y], axis=-1)


_NUMBERS = ("body", "neck", "stamina", "effort", "recovery", "capacity")


@dataclass(frozen=True, slots=True)
class _Job:
    """Roll-outs of one match; the fields are those of `roll_out`."""

    model: Clone
    other: Clone | None
    match: Logged
    world: World
    rules: Rules
    side: int
    config: RolloutConfig
    on_cycle: Callable[[], None] | None

    def moved(self, starts: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return (starts, 22) whom the clone moves."""
        own = np.zeros((len(starts), N_PLAYERS), np.bool_)
        own[:, slots_of(self.side)] = True
        own &= self.match.bodies.on_field[starts]
        if "catch" not in self.model.config.commands:
            own &= ~self.match.bodies.goalie[starts]
        return own

    def samples(self, starts: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return (starts, samples, horizon + 1, 23, 2) the clone's samples, with the server's noise."""
        count = self.config.samples
        at_once = max(MOST_WORLDS // count, 1)
        generator = torch.Generator().manual_seed(self.config.seed)
        rng = np.random.default_rng((self.config.seed, 1))
        parts = [
            _places(
                self._run(np.repeat(starts[begin : begin + at_once], count), point=False, generator=generator, rng=rng)
            )
            for begin in range(0, len(starts), at_once)
        ]
        places = np.concatenate(parts)
        return places.reshape(len(starts), count, *places.shape[1:])

    def likeliest(self, starts: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return where the likeliest commands lead, without noise, and which they are.

        (starts, 1, horizon + 1, 23, 2) places and (starts, horizon, 22) kinds.
        """
        went = self._run(starts, point=True, generator=torch.Generator(), rng=None)
        return _places(went)[:, None], went.kind

    def guesses(self, starts: NDArray[np.int64], truth: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
        """Return the plain guesses: that bodies stand, coast, or go on with their last velocity; the ball rolls on."""
        worlds = self._worlds(starts)
        goes_on = simulate(
            worlds,
            starts,
            [GoingOn.of(worlds, np.ones(N_PLAYERS, np.bool_))],
            horizon=self.config.horizon,
            rng=None,
        )
        coast = simulate(self._worlds(starts), starts, [], horizon=self.config.horizon, rng=None)
        return {
            "stand": np.repeat(truth[:, None, :1], self.config.horizon + 1, axis=2),
            "coast": np.stack([coast.x, coast.y], axis=-1)[:, None],
            "last": np.stack([goes_on.x, goes_on.y], axis=-1)[:, None],
        }

    def _run(
        self,
        starts: NDArray[np.int64],
        *,
        point: bool,
        generator: torch.Generator,
        rng: np.random.Generator | None,
    ) -> Trajectories:
        worlds = self._worlds(starts)
        policies = [
            *self._others(worlds, point=point, generator=generator),
            Cloned(self.model, self.side, point, generator),
            *self._ball(),
        ]
        return simulate(worlds, starts, policies, horizon=self.config.horizon, rng=rng, on_cycle=self.on_cycle)

    def _ball(self) -> list[Policy]:
        if self.config.ball == "logged":
            return [BallAsLogged.throughout(self.match)]
        if self.config.ball == "touched":
            return [BallAsLogged.touched_by(self.match, self._theirs())]
        return []

    def _theirs(self) -> NDArray[np.bool_]:
        """Return (22,) the other team's players."""
        theirs = np.ones(N_PLAYERS, np.bool_)
        theirs[slots_of(self.side)] = False
        return theirs

    def _others(self, worlds: Worlds, *, point: bool, generator: torch.Generator) -> list[Policy]:
        theirs = self._theirs()
        if self.config.others == "logged":
            # A goalkeeper that the clone does not know does as logged, too.
            if "catch" not in self.model.config.commands:
                theirs |= self.match.bodies.goalie.any(axis=0)
            return [AsLogged(self.match, theirs)]
        if self.config.others == "last":
            return [GoingOn.of(worlds, theirs)]
        if self.other is None:
            raise UsageError('others = "clone" needs the clone of the other team')
        return [Cloned(self.other, -self.side, point, generator)]

    def _worlds(self, starts: NDArray[np.int64]) -> Worlds:
        return Worlds.of(self.match, self.world, self.rules, starts)
