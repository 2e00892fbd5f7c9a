"""How far a logged match is from what the server's rules make of each of its cycles, beside noise and rounding.

Compared are cycles of play_on whose next frame is play_on, too: elsewhere a referee moves players and ball.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.dynamics.bodies import BALL, N_BODIES, Bodies, decays, of_types, radii
from teamclone.dynamics.contacts import BOUNCE, near_a_post
from teamclone.dynamics.logged import RESOLUTION, Logged
from teamclone.dynamics.motion import set_off
from teamclone.dynamics.received import receive
from teamclone.dynamics.rules import Rules
from teamclone.logs.align import plays_on
from teamclone.rcss import pitch
from teamclone.rcss.commands import CommandKind

_EXACT = {"neck": 2e-3, "stamina": 0.03, "effort": 3e-5, "recovery": 3e-5, "capacity": 1.1}
"""What the rounding of a log explains of values that no noise changes."""
_NEAR_THRESHOLD = 0.03
"""Stamina this near to a threshold may be on the other side of it."""
_FREE_M = 9.15
"""A dropped ball has nobody within this (rcssserver `referee.cpp`)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Residual:
    """One quantity of n cycles: how far the log is from the rules, and how far it may be.

    NaN in ``error`` is what was not compared: nobody there, something unknown, a contact, or an act of the referee.

    Attributes:
        error: (n, 22), (n, 23) with the ball. noise: of the same shape, what the server's noise explains at most.
        rounding: what the resolution of the log explains at most, a number or of the same shape.
    """

    error: NDArray[np.float64]
    noise: NDArray[np.float64]
    rounding: NDArray[np.float64]

    @property
    def excess(self) -> NDArray[np.float64]:
        """What neither noise nor rounding explains: positive where the rules were broken, NaN where not compared."""
        excess: NDArray[np.float64] = self.error - self.noise - self.rounding
        return excess


@dataclass(frozen=True, slots=True, kw_only=True)
class Residuals:
    """The residuals of a match.

    Attributes:
        frame: (n,) the frames from which a step was compared with the next.
        of: by quantity. ``position`` where a body is against where its own velocity takes it, metres; ``velocity``
            against the one before and the commands, metres per cycle; ``rebound`` the same after a collision; ``body``
            and ``neck`` degrees; ``stamina``, ``effort``, ``recovery``, ``capacity``.
        touching: how many contacts of bodies there were. dropped: cycles in which the referee dropped the ball, and
            caught: in which a goalkeeper caught it; both are left out, since players are moved.
        unknown: commands that were executed and are in no command log.
    """

    frame: NDArray[np.int64]
    of: dict[str, Residual]
    touching: int
    dropped: int
    caught: int
    unknown: int


def residuals(match: Logged, rules: Rules) -> Residuals:
    """Return the residuals of a match."""
    at = np.flatnonzero(plays_on(match.frames) & ~match.trainer)
    dropped = _dropped(match.bodies.select(at), match.bodies.select(at + 1))
    held = ((match.commands.kind[at] == CommandKind.CATCH) & match.succeeded[at]).any(axis=-1)
    at = at[~dropped & ~held]
    compare = _Compare(match, at, rules)
    return Residuals(
        frame=at,
        of={
            **compare.moved(),
            "body": compare.turned(),
            **{name: compare.exact(name, value) for name, value in compare.rested().items()},
        },
        touching=int(match.bodies.touched[at + 1].sum()),
        dropped=int(dropped.sum()),
        caught=int(held.sum()),
        unknown=int(compare.unknown.sum()),
    )


def _dropped(before: Bodies, after: Bodies) -> NDArray[np.bool_]:
    """Return (n,) in which cycles the referee dropped the ball: it rests, and someone was put on the circle around it.

    No play mode tells of it (rcssserver `referee.cpp`).
    """
    rests = (after.vx[:, BALL] == 0) & (after.vy[:, BALL] == 0)
    dx, dy = (values[:, :BALL] - values[:, BALL:] for values in (after.x, after.y))
    off = np.hypot(dx, dy)
    stands = (after.vx[:, :BALL] == 0) & (after.vy[:, :BALL] == 0) & after.on_field
    jumped = np.hypot(after.x - before.x, after.y - before.y)[:, :BALL] > 2.0
    put = stands & jumped & (off > _FREE_M)
    dropped: NDArray[np.bool_] = rests & put.any(axis=-1)
    return dropped


class _Compare:
    """The comparisons of n cycles; see `Residuals` for what they give."""

    def __init__(self, match: Logged, at: NDArray[np.int64], rules: Rules) -> None:
        before, after = match.bodies.select(at), match.bodies.select(at + 1)
        commands, succeeded = match.commands.select(at), match.succeeded[at]
        self.unknown = match.unknown[at]
        received, caught = receive(before, commands, rules, succeeded=succeeded)
        self.before, self.after, self.rules = before, after, rules
        self.motion = set_off(received, commands, rules, caught=caught, succeeded=succeeded)
        self.there = before.on_field & after.on_field & (before.type == after.type)
        self.known = self.there & ~self.unknown
        pushes = (commands.kind == CommandKind.KICK) | succeeded
        self.ball_known = ~(self.unknown & pushes).any(axis=-1)

    def moved(self) -> dict[str, Residual]:
        """Return ``position``, ``velocity`` and ``rebound``."""
        before, after, motion = self.before, self.after, self.motion
        decay = decays(before, self.rules)
        dx, dy = after.x - before.x, after.y - before.y
        there, known = self._with_ball(self.there, np.True_), self._with_ball(self.known, self.ball_known)
        at_post = near_a_post(
            before.x, before.y, motion.vx, motion.vy, radii(before, self.rules) + motion.noise + RESOLUTION
        )
        free = there & ~after.touched & ~at_post & ~self._at_the_edge()
        rounding = 1.5 * RESOLUTION
        position = np.hypot(dx - after.vx / decay, dy - after.vy / decay)
        velocity = np.hypot(dx - motion.vx, dy - motion.vy)
        rebound = np.hypot(after.vx - BOUNCE * decay * motion.vx, after.vy - BOUNCE * decay * motion.vy)
        collided = after.touched & ~at_post
        return {
            "position": _residual(position, free, rounding=rounding + 0.8 * RESOLUTION / decay),
            "velocity": _residual(velocity, free & known, noise=motion.noise, rounding=3 * RESOLUTION),
            "rebound": _residual(
                rebound,
                known & collided,
                noise=-BOUNCE * decay * motion.noise,
                rounding=2 * RESOLUTION,
            ),
        }

    def turned(self) -> Residual:
        """Return ``body``."""
        error = np.abs(self.after.body - self.motion.body)
        off = np.minimum(error, 360.0 - error)
        turned = self.motion.body - self.before.body
        turned = np.abs((turned + 180.0) % 360.0 - 180.0)
        # The speed that slows a turn is known to the log's resolution.
        inertia = of_types(self.before, self.rules, "inertia_moment")
        return _residual(
            off, self.known, noise=self.motion.body_noise, rounding=2e-3 + 1.2 * turned * inertia * RESOLUTION
        )

    def rested(self) -> dict[str, NDArray[np.float64]]:
        """Return (n, 22) what neck, stamina and the like should be."""
        before, rules = self.before, self.rules
        of_type = {name: of_types(before, rules, name) for name in ("stamina_inc_max", "effort_min", "effort_max")}
        values = formulas.rested(
            self.motion.stamina, before.effort, before.recovery, before.capacity, server=rules.server, **of_type
        )
        return dict(zip(("stamina", "effort", "recovery", "capacity"), values, strict=True), neck=self.motion.neck)

    def exact(self, name: str, expected: NDArray[np.float64]) -> Residual:
        """Return the residual of a value that no noise changes."""
        server, compared = self.rules.server, self.known
        if name in ("effort", "recovery"):
            for threshold in ("recover_dec_thr", "effort_dec_thr", "effort_inc_thr"):
                near = np.abs(self.motion.stamina - server[threshold] * server["stamina_max"]) < _NEAR_THRESHOLD
                compared = compared & ~near
        return _residual(np.abs(getattr(self.after, name) - expected), compared, rounding=_EXACT[name])

    def _with_ball(self, players: NDArray[np.bool_], ball: NDArray[np.bool_] | np.bool_) -> NDArray[np.bool_]:
        made = np.empty((len(players), N_BODIES), np.bool_)
        made[:, :BALL], made[:, BALL] = players, ball
        return made

    def _at_the_edge(self) -> NDArray[np.bool_]:
        """Return (n, 23) who is where the referee keeps players from leaving the pitch's surroundings."""
        x, y = np.abs(self.after.x), np.abs(self.after.y)
        edge: NDArray[np.bool_] = (x >= pitch.MAX_X - RESOLUTION) | (y >= pitch.MAX_Y - RESOLUTION)
        edge[:, BALL] = False
        return edge


def _residual(
    error: NDArray[np.float64],
    compared: NDArray[np.bool_],
    *,
    noise: NDArray[np.float64] | float = 0.0,
    rounding: NDArray[np.float64] | float,
) -> Residual:
    return Residual(
        error=np.where(compared, error, np.nan),
        noise=np.broadcast_to(noise, error.shape),
        rounding=np.broadcast_to(rounding, error.shape),
    )
