"""``Observed``: how fast bodies moved in each cycle of a game log, before the server slowed them down."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.bodies import BALL, Bodies, decays
from teamclone.dynamics.contacts import BOUNCE
from teamclone.dynamics.logged import RESOLUTION, bodies_of
from teamclone.dynamics.rules import Rules
from teamclone.logs.align import follows
from teamclone.logs.match import Columns
from teamclone.rcss import pitch, state_bits

At = tuple[NDArray[np.signedinteger[Any]], ...]
"""Frame and place of some players."""

_AGREE = 1e-3
"""Metres per cycle by which a displacement and the velocity logged after it may differ: both are rounded."""
_PUSHED = 0.7
"""Metres by which collisions move a body at most, but for crowds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Observed:
    """The bodies of a match with the velocity of each in the cycle after its frame.

    Attributes:
        before: of all n frames.
        vx, vy: (n, 23) metres per cycle, after commands and noise and before decay. NaN where the log does not show
            them: a body that a referee placed or that met a post, a lost frame, the last frame.
        contact: (n, 23) bool, the body collided, so that only its velocity shows how fast it was.
        blur: (n, 23) metres per cycle by which rounding may change ``vx`` and ``vy``.
    """

    before: Bodies
    rules: Rules
    vx: NDArray[np.float64]
    vy: NDArray[np.float64]
    contact: NDArray[np.bool_]
    blur: NDArray[np.float64]

    def of(self, at: At, name: str) -> NDArray[np.float64]:
        """Return (m,) a parameter of the types of some players."""
        values: NDArray[np.float64] = self.rules.types[name][self.before.type[at]]
        return values


def observe(frames: Columns, players: Columns, rules: Rules) -> Observed:
    """Return the velocities of all bodies in the cycle after each frame of a match."""
    bodies = _with_ball(bodies_of(frames, players), rules)
    decay = decays(bodies, rules)
    left = {name: np.full(bodies.x.shape, np.nan) for name in ("vx", "vy")}
    contact = np.zeros(bodies.x.shape, np.bool_)
    after = bodies.select(slice(1, None))
    before = bodies.select(slice(None, -1))
    moved = [after.x - before.x, after.y - before.y]
    faster = np.where(after.touched, 1.0 / BOUNCE, 1.0) / decay[:-1]
    logged = [after.vx * faster, after.vy * faster]
    apart = np.hypot(moved[0] - logged[0], moved[1] - logged[1])
    # At the edge of the field the server clips places and keeps velocities.
    clipped = (np.abs(after.x) >= pitch.MAX_X) | (np.abs(after.y) >= pitch.MAX_Y)
    clipped[:, BALL] = False
    for name, displacement, velocity in zip(("vx", "vy"), moved, logged, strict=True):
        shown = np.where(apart < _AGREE, displacement, np.nan)
        left[name][:-1] = np.where((after.touched & (apart < _PUSHED)) | clipped, velocity, shown)
    unknown = ~follows(frames)
    hit_post = (players["state"][1:] & state_bits.POST_COLLIDE) != 0
    changed = (before.type != after.type) | ~before.on_field | ~after.on_field | hit_post
    for values in left.values():
        values[unknown] = np.nan
        values[:-1, :BALL][changed] = np.nan
    contact[:-1] = after.touched
    # Two places and the velocity before are rounded, by half of it each, along both axes.
    blur = np.where(contact, RESOLUTION / (-BOUNCE * decay), 2.0 * RESOLUTION)
    return Observed(before=bodies, rules=rules, **left, contact=contact, blur=blur)


def _with_ball(bodies: Bodies, rules: Rules) -> Bodies:
    """Return bodies with the ball's velocity across the field as it moved, where the log repeats that along the field.

    A converter of the league writes version 3 so. Where the ball was touched its velocity is NaN then.
    """
    vx, vy = bodies.vx[:, BALL], bodies.vy[:, BALL]
    if np.isnan(vx).any() or (vx != vy).any() or not vx.any():
        return bodies
    moved = np.diff(bodies.y[:, BALL], prepend=np.nan) * rules.server["ball_decay"]
    across = bodies.vy.copy()
    across[:, BALL] = np.where(bodies.touched[:, BALL], np.nan, moved)
    return replace(bodies, vy=across)
