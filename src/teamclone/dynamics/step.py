"""``step``: what rcssserver makes of a cycle, but for its referee (`stadium.cpp`, step)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.dynamics.bodies import BALL, Bodies, Commands, decays, of_types, radii
from teamclone.dynamics.contacts import BOUNCE, collide, move_past_posts
from teamclone.dynamics.motion import Motion, set_off
from teamclone.dynamics.received import hold, receive
from teamclone.dynamics.rules import Rules
from teamclone.rcss import pitch
from teamclone.rcss.playmodes import SITUATION, PlayMode, Situation

_BEGINS = np.isin(
    SITUATION,
    (
        Situation.KICK_OFF,
        Situation.KICK_IN,
        Situation.FREE_KICK,
        Situation.INDIRECT_FREE_KICK,
        Situation.CORNER_KICK,
        Situation.FAULT,
    ),
)
"""Play modes that a kick turns into play_on at once. A goal kick has to leave the penalty area first."""


def step(
    bodies: Bodies,
    commands: Commands,
    rules: Rules,
    rng: np.random.Generator | None = None,
    *,
    succeeded: NDArray[np.bool_] | None = None,
) -> Bodies:
    """Return the next cycle of n independent ones: commands, movement, collisions, recovery, in the server's order.

    The referee is not in it: no ball is put down, no goal counted, nobody sent off or away. Two changes of play mode
    are made while commands are read, and so are here: a kick in a set play begins play_on, a catch gives a free kick.
    That a goalkeeper holds the ball is known in the cycle of the catch alone, and a ``move`` is taken in the play
    modes that allow it, whether or not its player holds the ball.

    Args:
        bodies: n cycles. commands: of the same cycles.
        rng: draws the noise of the server and the success of tackles and catches; None for the mean of the noise and
            the likelier outcome.
        succeeded: (n, 22) whether tackles and catches succeed, where that is known; others are ignored.

    Raises:
        IndexError: a player has a type that the rules do not list.
    """
    if (bodies.type < 0).any():
        raise IndexError("a player has a negative type")
    bodies, caught = receive(bodies, commands, rules, rng=rng, succeeded=succeeded)
    motion = set_off(bodies, commands, rules, caught=caught, rng=rng, succeeded=succeeded)
    return hold(_moved(bodies, motion, rules, rng), caught, rules)


def _moved(bodies: Bodies, motion: Motion, rules: Rules, rng: np.random.Generator | None) -> Bodies:
    """Return bodies after their movement: noise, posts, decay, collisions, recovery."""
    vx, vy = motion.vx.copy(), motion.vy.copy()
    if rng is not None:
        length, angle = rng.uniform(0.0, motion.noise), rng.uniform(-np.pi, np.pi, vx.shape)
        vx += length * np.cos(angle)
        vy += length * np.sin(angle)
    radius = radii(bodies, rules)
    still = np.isinf(radius) | (bodies.mode == PlayMode.BEFORE_KICK_OFF)[:, None]
    vx[still] = vy[still] = 0.0
    x, y, touched = move_past_posts(bodies.x, bodies.y, vx, vy, radius)
    decay = decays(bodies, rules)
    vx *= decay
    vy *= decay
    begins = motion.pushed.any(axis=-1) & _BEGINS[bodies.mode]
    mode = np.where(begins, PlayMode.PLAY_ON, bodies.mode).astype(np.uint8)
    collided = collide(x, y, radius, ball_stays=mode != PlayMode.PLAY_ON, rng=rng)
    vx[collided] *= BOUNCE
    vy[collided] *= BOUNCE
    if rules.referee:
        x[:, :BALL] = np.clip(x[:, :BALL], -pitch.MAX_X, pitch.MAX_X)
        y[:, :BALL] = np.clip(y[:, :BALL], -pitch.MAX_Y, pitch.MAX_Y)
    stamina, effort, recovery, capacity = formulas.rested(
        motion.stamina,
        bodies.effort,
        bodies.recovery,
        bodies.capacity,
        server=rules.server,
        **{name: of_types(bodies, rules, name) for name in ("stamina_inc_max", "effort_min", "effort_max")},
    )
    return replace(
        bodies,
        x=x,
        y=y,
        vx=vx,
        vy=vy,
        body=motion.body,
        neck=motion.neck,
        stamina=stamina,
        effort=effort,
        recovery=recovery,
        capacity=capacity,
        frozen=np.maximum(np.maximum(bodies.frozen, motion.froze) - 1, 0),
        banned=np.maximum(bodies.banned - 1, 0),
        touched=touched | collided,
        mode=mode,
    )
