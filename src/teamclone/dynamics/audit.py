"""The physics of a match put to the test: what in it cannot have happened under the rules that it states."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.bodies import BALL
from teamclone.dynamics.logged import Logged
from teamclone.dynamics.residuals import Residual, residuals
from teamclone.dynamics.rules import Rules
from teamclone.errors import UsageError
from teamclone.logs.align import plays_on
from teamclone.logs.match import Columns
from teamclone.rcss.players import N_TEAM

_MANY = 0.02
"""From this share of all values on it is no single value that is wrong, but a parameter or a rule."""
_MOST = 0.5
"""From this share of the bodies of one cycle on it is the frame that is wrong."""
_FEW = 5
"""Fewer bodies, or cycles, show nothing."""
_FAST = 0.1
"""Metres per cycle from which on the decay of a velocity can be read off a movement."""

_STATED = ("ball_decay", "player_rand", "min_dash_power", "dash_angle_step", "side_dash_rate", "back_dash_rate")
"""Parameters without which nothing can be said, since they were not always the same. Logs of version 3 lack some."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """A law of the server; ``off`` is how a body breaks it, with room for the number."""

    name: str
    about: str
    off: str
    parameters: str


LAWS = {
    "position": Law(
        name="physics-position",
        about="a body moves by its velocity before decay",
        off="is {:.4f} m from where its velocity takes it",
        parameters="ball_decay or player_decay",
    ),
    "velocity": Law(
        name="physics-velocity",
        about="a velocity is that of the cycle before with the commands, up to the server's noise",
        off="is {:.4f} m/cycle faster or slower than its commands make it",
        parameters="dash_power_rate, kick_power_rate, player_rand, ball_rand or the like",
    ),
    "rebound": Law(
        name="physics-rebound",
        about="a collision turns a velocity around and leaves a tenth of it",
        off="is {:.4f} m/cycle off after a collision",
        parameters="player_decay, player_rand or the like",
    ),
    "body": Law(
        name="physics-body",
        about="a body turns by its commands, up to the server's noise",
        off="has turned {:.3f} degrees too far or too little",
        parameters="inertia_moment or player_rand",
    ),
    "neck": Law(
        name="physics-neck",
        about="a neck turns by its commands",
        off="has its neck {:.3f} degrees off",
        parameters="maxneckang or minneckang",
    ),
    "stamina": Law(
        name="physics-stamina",
        about="dashes cost stamina, and a part of it recovers",
        off="has {:.2f} of stamina too much or too little",
        parameters="stamina_inc_max, stamina_max or extra_stamina",
    ),
    "effort": Law(
        name="physics-effort",
        about="effort falls while stamina is low and rises while it is high",
        off="has {:.5f} of effort too much or too little",
        parameters="effort_dec, effort_inc, effort_max or a threshold",
    ),
    "recovery": Law(
        name="physics-recovery",
        about="recovery falls while stamina is low",
        off="has {:.5f} of recovery too much or too little",
        parameters="recover_dec, recover_min or a threshold",
    ),
    "capacity": Law(
        name="physics-capacity",
        about="what recovers is taken from the stamina capacity",
        off="has {:.1f} of capacity too much or too little",
        parameters="stamina_capacity",
    ),
}
"""The laws by the quantity of `Residuals` that obeys them."""

MISSING_FRAMES = Law(
    name="physics-frames",
    about="every cycle has its frame",
    off="cycles without a frame: {:.0f}",
    parameters="",
)

SUBSTITUTIONS = Law(
    name="physics-type",
    about="nobody changes the player type while play goes on",
    off="has type {:.0f} in place of",
    parameters="",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """A law that a match breaks: how often, and the first time with its size and most likely cause."""

    law: Law
    rows: int
    cycle: int
    what: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Audit:
    """What the audit of a match gives.

    Attributes:
        cycles: how many were compared with the next. compared: values by quantity of `Residuals`.
        unknown: executed commands that no log has the numbers of; what they change was not compared.
        deviations: the laws that the match breaks.
    """

    cycles: int
    compared: Mapping[str, int]
    unknown: int
    deviations: tuple[Deviation, ...]


def audit(match: Logged, rules: Rules) -> Audit:
    """Return what in a match cannot have happened under its rules.

    Raises:
        UsageError: it cannot be judged, and why: the log has no velocities, or a player's type is not listed.
    """
    if np.isnan(match.bodies.vx[match.bodies.mode != 0][:, BALL]).any():
        raise UsageError("expected a game log of version 3 or later, got one without velocities")
    need_types(match, rules)
    # Values that are no numbers are not compared: other checks speak of them.
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        found = residuals(match, rules)
    judge = _Judge(match, rules, found.frame)
    return Audit(
        cycles=len(found.frame),
        compared={name: int((~np.isnan(residual.error)).sum()) for name, residual in found.of.items()},
        unknown=found.unknown,
        deviations=(
            *_missing_frames(match.frames, rules),
            *_substitutions(match),
            *(deviation for name, residual in found.of.items() for deviation in judge.deviations(name, residual)),
        ),
    )


def need_types(match: Logged, rules: Rules) -> None:
    """Raise unless the rules list the types of all players.

    Raises:
        UsageError: they do not.
    """
    listed = len(next(iter(rules.types.values())))
    if not listed:
        raise UsageError("expected a log that lists player types, got one without")
    if (match.bodies.type[match.bodies.on_field] >= listed).any():
        raise UsageError(f"expected player types 0 to {listed - 1}, which the log lists, got a player of another")


def rules_of(params: Mapping[str, float | str], types: Columns) -> Rules:
    """Return the rules by which a match can be judged.

    Raises:
        UsageError: its log does not state them, or states some that are not computed.
    """
    missing = [name for name in _STATED if name not in params]
    if missing:
        raise UsageError(f"expected a log that lists the server's parameters, got one without {', '.join(missing)}")
    return Rules.of(params, types)


def _missing_frames(frames: Columns, rules: Rules) -> Iterator[Deviation]:
    """Yield the one deviation of a log with cycles that have no frame.

    The last cycle of a half has none, since it is one of before_kick_off.
    """
    cycle = frames["cycle"].astype(np.int64)
    gap = np.diff(cycle)
    ends = rules.ends_half(cycle[:-1] + 1)
    missing = np.where((gap == 2) & ends, 0, np.maximum(gap - 1, 0))
    if missing.any():
        first = int(np.flatnonzero(missing)[0])
        yield Deviation(
            law=MISSING_FRAMES,
            rows=int(missing.sum()),
            cycle=int(cycle[first]),
            what=MISSING_FRAMES.off.format(missing[first]) + ", likely since frames were cut out or lost",
        )


def _substitutions(match: Logged) -> Iterator[Deviation]:
    """Yield the one deviation of a log in which players change types in play_on, which the server refuses coaches."""
    at = np.flatnonzero(plays_on(match.frames) & ~match.trainer)
    kind, there = match.bodies.type, match.bodies.on_field
    changed = there[at] & there[at + 1] & (kind[at] != kind[at + 1])
    if changed.any():
        row, player = (int(place) for place in np.argwhere(changed)[0])
        yield Deviation(
            law=SUBSTITUTIONS,
            rows=int(changed.sum()),
            cycle=int(match.frames["cycle"][at[row] + 1]),
            what=f"{_name(player)} {SUBSTITUTIONS.off.format(kind[at[row] + 1, player])} {kind[at[row], player]}; "
            "likely this value was changed after the match; what it did in this cycle is not compared",
        )


def _name(body: int) -> str:
    if body == BALL:
        return "the ball"
    return f"{'left' if body < N_TEAM else 'right'} {body % N_TEAM + 1}"


class _Judge:
    """Says of the deviations of a match what they are and what they most likely come from.

    Attributes:
        at: (n,) the frames from which steps were compared.
    """

    def __init__(self, match: Logged, rules: Rules, at: NDArray[np.int64]) -> None:
        self.match, self.rules, self.at = match, rules, at

    def deviations(self, name: str, residual: Residual) -> Iterator[Deviation]:
        """Yield the one deviation from a law, if there is any."""
        with np.errstate(invalid="ignore"):
            wrong = residual.excess > 0
        if not wrong.any():
            return
        row, body = (int(place) for place in np.argwhere(wrong)[0])
        explained = residual.noise[row, body] + residual.rounding[row, body]
        off = LAWS[name].off.format(residual.error[row, body])
        cause = self._cause(name, ~np.isnan(residual.error), wrong)
        yield Deviation(
            law=LAWS[name],
            rows=int(wrong.sum()),
            cycle=int(self.match.frames["cycle"][self.at[row] + 1]),
            what=f"{_name(body)} {off}, of which noise and rounding explain {explained:.2g}; likely {cause}",
        )

    def _cause(self, name: str, compared: NDArray[np.bool_], wrong: NDArray[np.bool_]) -> str:
        """Return the most likely cause of the deviations from a law."""
        of_cycle = wrong.sum(axis=1) / np.maximum(compared.sum(axis=1), _FEW)
        if 0 < (of_cycle >= _MOST).sum() <= _MANY * len(wrong):
            return "frames were lost or exchanged, or teams changed places"
        if wrong[:, BALL:].sum() > max(_MANY * compared[:, BALL:].sum(), 1):
            return self._parameter_of_ball(name)
        rows = np.flatnonzero(wrong.any(axis=1))
        if wrong[:, :BALL].sum() > _MANY * compared[:, :BALL].sum() / BALL or (
            len(rows) >= _FEW and not wrong[:, BALL:].any()
        ):
            return self._parameter_of_players(name, wrong[:, :BALL])
        if wrong.any(axis=0).sum() == 1 and rows[-1] - rows[0] <= 1:
            return "this value was changed after the match"
        return "values were changed after the match, or somebody moved bodies whom no log tells of"

    def _parameter_of_ball(self, name: str) -> str:
        if name == "position":
            shown, stated = self._decay(np.arange(len(self.at)), BALL), self.rules.server["ball_decay"]
            return f"ball_decay is {shown:.4g}, not {stated:.4g} as the header says"
        return f"{LAWS[name].parameters} is not as the header says"

    def _parameter_of_players(self, name: str, wrong: NDArray[np.bool_]) -> str:
        rows, places = np.nonzero(wrong)
        types = np.unique(self.match.bodies.type[self.at[rows], places])
        of_type = f" of type {types[0]}" if len(types) == 1 else ""
        if name == "position" and of_type:
            shown, stated = self._decay(rows, places), self.rules.types["player_decay"][types[0]]
            return f"player_decay{of_type} is {shown:.4g}, not {stated:.4g} as the header says"
        return f"{LAWS[name].parameters}{of_type} is not as the header says, or the server has another rule"

    def _decay(self, rows: NDArray[np.int64], body: NDArray[np.int64] | int) -> float:
        """Return the decay that movements show: the velocity after a cycle over the way in it, in the median."""
        bodies, at = self.match.bodies, self.at[rows]
        way = np.hypot(bodies.x[at + 1, body] - bodies.x[at, body], bodies.y[at + 1, body] - bodies.y[at, body])
        speed = np.hypot(bodies.vx[at + 1, body], bodies.vy[at + 1, body])
        fast = way > _FAST
        return float(np.median(speed[fast] / way[fast])) if fast.any() else float("nan")
