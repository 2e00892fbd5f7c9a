"""``Motion``: how commands set ball and players moving, up to the noise (rcssserver `player.cpp`, `leg.cpp`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.dynamics.bodies import BALL, Bodies, Commands, of_types
from teamclone.dynamics.received import Caught
from teamclone.dynamics.rules import Rules
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import BALL_KICKED, BALL_TACKLED

Index = tuple[NDArray[np.intp], NDArray[np.intp]]
"""Cycle and place of some players."""

_LEAST_COST = 1e-5
"""Legs that would take less stamina together stand still."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Velocities and directions after the commands of n cycles, before noise, collisions and decay.

    Attributes:
        vx, vy: (n, 23) metres per cycle, limited as the server does.
        noise: (n, 23) metres per cycle, the greatest length of the noise that the server adds to a velocity: for the
            ball that of kicks with that of its movement.
        body, neck: (n, 22) degrees.
        body_noise: (n, 22) degrees by which noise turns a body further or less at most.
        stamina: (n, 22) after dashes, before recovery.
        pushed: (n, 22) bool, who kicked or tackled the ball.
        froze: (n, 22) int64, the cycles that tackles and fouls of this cycle freeze a player for; 0 none.
    """

    vx: NDArray[np.float64]
    vy: NDArray[np.float64]
    noise: NDArray[np.float64]
    body: NDArray[np.float64]
    neck: NDArray[np.float64]
    body_noise: NDArray[np.float64]
    stamina: NDArray[np.float64]
    pushed: NDArray[np.bool_]
    froze: NDArray[np.int64]


def set_off(
    bodies: Bodies,
    commands: Commands,
    rules: Rules,
    *,
    caught: Caught,
    rng: np.random.Generator | None = None,
    succeeded: NDArray[np.bool_] | None = None,
) -> Motion:
    """Return the motion that commands give to ball and players.

    Args:
        bodies: after `receive`. caught: what it says of the catches.
        rng: draws the noise of kicks, of turns and of the rotation by legs, which is then in the motion and no longer
            in its ``noise`` and ``body_noise``; and whether tackles succeed. None for the mean and the likelier.
        succeeded: (n, 22) whether tackles succeed, where that is known.
    """
    push = _Push(bodies, commands, rules, rng)
    push.x += caught.x
    push.y += caught.y
    push.kick()
    push.tackle(succeeded)
    ax, ay, rotation, stamina = _dashes(bodies, commands, rules)
    rotation += _turns(bodies, commands, rules)
    body_noise = np.abs(rotation) * rules.server["player_rand"]
    if rng is not None:
        rotation += body_noise * rng.uniform(-1.0, 1.0, rotation.shape)
        body_noise = np.zeros_like(body_noise)
    vx, vy, noise = _velocities(bodies, rules, np.column_stack([ax, push.x]), np.column_stack([ay, push.y]), push.noise)
    limit = rules.server
    moment = np.clip(commands.turn_neck, limit["minneckmoment"], limit["maxneckmoment"])
    return Motion(
        vx=vx,
        vy=vy,
        noise=noise,
        body=formulas.degrees(np.radians(bodies.body) + rotation),
        body_noise=np.degrees(body_noise),
        neck=np.where(
            moment != 0, np.clip(bodies.neck + moment, limit["minneckang"], limit["maxneckang"]), bodies.neck
        ),
        stamina=stamina,
        pushed=push.by,
        froze=push.froze,
    )


def slowness(bodies: Bodies, rules: Rules) -> NDArray[np.float64]:
    """Return (n, 22) the factor by which players are slower on the upper half of the pitch; 1 in an ordinary match."""
    of_team = [rules.server[f"slowness_on_top_for_{side}_team"] for side in ("left", "right")]
    factors: NDArray[np.float64] = np.where(bodies.y[:, :BALL] < 0, np.repeat(of_team, N_TEAM), 1.0)
    return factors


def _velocities(
    bodies: Bodies, rules: Rules, ax: NDArray[np.float64], ay: NDArray[np.float64], kick_noise: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return (n, 23) velocities after accelerations, and the greatest length of their noise (`object.cpp`)."""
    server, slow = rules.server, slowness(bodies, rules)

    def most(players: NDArray[np.float64], ball: float) -> NDArray[np.float64]:
        return np.column_stack([players, np.full(len(bodies), ball)])

    ax, ay = formulas.limited(ax, ay, most(server["player_accel_max"] * slow, server["ball_accel_max"]))
    fast = most(of_types(bodies, rules, "player_speed_max") * slow, server["ball_speed_max"])
    # A velocity is limited only where it was changed.
    fast[(ax == 0) & (ay == 0)] = np.inf
    vx, vy = formulas.limited(bodies.vx + ax, bodies.vy + ay, fast)
    rand = np.full(bodies.x.shape[1], server["player_rand"])
    rand[BALL] = server["ball_rand"]
    noise = np.hypot(vx, vy) * rand
    noise[:, BALL] += kick_noise * (1.0 + server["ball_rand"])
    return vx, vy, noise


def _dashes(
    bodies: Bodies, commands: Commands, rules: Rules
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return (n, 22) accelerations x and y, rotations in radians, and stamina after dashes."""
    shape = bodies.body.shape
    ax, ay, rotation, stamina = np.zeros(shape), np.zeros(shape), np.zeros(shape), bodies.stamina.copy()
    has_leg = ~np.isnan(commands.legs[..., 0])
    at = np.nonzero(has_leg.any(axis=-1) & bodies.on_field)
    server, legs = rules.server, commands.legs[at]
    power = np.clip(np.nan_to_num(legs[..., 0]), server["min_dash_power"], server["max_dash_power"])
    angle = formulas.dash_angle(np.nan_to_num(legs[..., 1]), server=server)
    rate = formulas.dash_rate(
        np.abs(angle), side_dash_rate=server["side_dash_rate"], back_dash_rate=server["back_dash_rate"]
    )
    types, of = rules.types, bodies.type[at]
    per_power = bodies.effort[at] * types["dash_power_rate"][of] / slowness(bodies, rules)[at]
    available = bodies.stamina[at] + types["extra_stamina"][of]
    if rules.legs:
        used, cost = _by_legs(power, available, rules)
        dashed = per_power[:, None] * used * rate
        ahead = dashed * np.cos(np.radians(angle))
        turned = (ahead[:, 0] - ahead[:, 1]) / (2.0 * types["player_size"][of])
        rotation[at] = np.where(has_leg[at][:, 0], turned, 0.0)
        forward, aside = ahead.mean(axis=-1), (dashed * np.sin(np.radians(angle))).mean(axis=-1)
    else:
        cost = np.minimum(formulas.dash_cost(power[:, 0]), available)
        dashed = per_power * np.where(power[:, 0] < 0, -0.5 * cost, cost) * rate[:, 0]
        forward, aside = dashed * np.cos(np.radians(angle[:, 0])), dashed * np.sin(np.radians(angle[:, 0]))
    body = np.radians(bodies.body[at])
    ax[at] = forward * np.cos(body) - aside * np.sin(body)
    ay[at] = forward * np.sin(body) + aside * np.cos(body)
    stamina[at] = np.maximum(bodies.stamina[at] - cost, 0.0)
    return ax, ay, rotation, stamina


def _by_legs(
    power: NDArray[np.float64], available: NDArray[np.float64], rules: Rules
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (m, 2) the power that each leg really has, and (m,) the stamina that both take."""
    wanted = np.where(power < 0, -power, 0.5 * power).sum(axis=-1)
    moves = wanted >= _LEAST_COST
    with np.errstate(invalid="ignore", divide="ignore"):
        costs = np.stack(formulas.leg_costs(power[:, 0], power[:, 1], available), axis=-1)
    costs = np.where(moves[:, None], costs, 0.0)
    used = np.where(power < 0, -costs, 2.0 * costs)
    used = np.where(moves[:, None], np.clip(used, rules.server["min_dash_power"], rules.server["max_dash_power"]), 0.0)
    return used, np.where(moves, np.minimum(wanted, available), 0.0)


def _turns(bodies: Bodies, commands: Commands, rules: Rules) -> NDArray[np.float64]:
    """Return (n, 22) the radians by which turns turn the players."""
    turned = np.zeros(bodies.body.shape)
    at = np.nonzero((commands.kind == CommandKind.TURN) & bodies.on_field)
    moment = np.clip(commands.numbers[..., 0][at], rules.server["minmoment"], rules.server["maxmoment"])
    speed = np.hypot(bodies.vx[at], bodies.vy[at])
    turned[at] = formulas.turn(np.radians(moment), speed, rules.types["inertia_moment"][bodies.type[at]])
    return turned


class _Push:
    """What kicks and tackles of n cycles do to the ball.

    Attributes:
        x, y: (n,) acceleration of the ball. noise: (n,) the greatest length of the noise in it.
        by: (n, 22) bool, whose. froze: see `Motion`.
    """

    def __init__(self, bodies: Bodies, commands: Commands, rules: Rules, rng: np.random.Generator | None) -> None:
        n = len(bodies)
        self._bodies, self._commands, self._rules, self._rng = bodies, commands, rules, rng
        self.x, self.y, self.noise = np.zeros(n), np.zeros(n), np.zeros(n)
        self.by = np.zeros((n, N_PLAYERS), np.bool_)
        self.froze = np.zeros((n, N_PLAYERS), np.int64)

    def kick(self) -> None:
        """Add the kicks of players that have the ball kickable."""
        bodies, server = self._bodies, self._rules.server
        at = self._who(CommandKind.KICK)
        distance, off_body = self._ball_from(at)
        of_type = self._types(at)
        size, margin = of_type["player_size"], of_type["kickable_margin"]
        near = distance <= formulas.kickable_area(size, margin, server["ball_size"])
        near &= BALL_KICKED[bodies.mode[at[0]]]
        at, distance, off_body, size, margin = (
            (at[0][near], at[1][near]),
            distance[near],
            off_body[near],
            size[near],
            margin[near],
        )
        power = np.clip(self._commands.numbers[..., 0][at], server["minpower"], server["maxpower"])
        rate = formulas.kick_rate(
            distance,
            off_body,
            kick_power_rate=of_type["kick_power_rate"][near],
            player_size=size,
            kickable_margin=margin,
            ball_size=server["ball_size"],
        )
        noise = formulas.kick_noise(
            power,
            distance,
            off_body,
            self._ball_speed(at),
            kick_rand=of_type["kick_rand"][near],
            player_size=size,
            kickable_margin=margin,
            server=server,
        )
        self._add(at, rate * power, self._commands.numbers[..., 1][at], noise)

    def tackle(self, succeeded: NDArray[np.bool_] | None) -> None:
        """Add the tackles that succeed, and freeze the tacklers and those whom an intended foul meets."""
        bodies, server = self._bodies, self._rules.server
        at = self._who(CommandKind.TACKLE)
        distance, off_body = self._ball_from(at)
        kickable = self._kickable(at[0])
        opponents = kickable & (np.arange(N_PLAYERS) // N_TEAM != (at[1] // N_TEAM)[:, None])
        foul = self._commands.foul[at] & opponents.any(axis=-1)
        failure = formulas.tackle_failure(
            distance * np.cos(off_body),
            distance * np.sin(off_body),
            tackle_dist=server["tackle_dist"],
            tackle_back_dist=server["tackle_back_dist"],
            tackle_width=server["tackle_width"],
            exponent=np.where(foul, server["foul_exponent"], server["tackle_exponent"]),
        )
        if succeeded is not None:
            success = succeeded[at]
        elif self._rng is not None:
            success = self._rng.random(len(failure)) >= failure
        else:
            success = failure < 0.5
        success = success & (failure < 1)
        fouled = success & foul
        self.froze[at] = np.where(fouled, 0, int(server["tackle_cycles"]))
        if self._rules.referee:
            np.maximum.at(self.froze, at[0][fouled], opponents[fouled] * int(server["foul_cycles"]))
        success &= BALL_TACKLED[bodies.mode[at[0]]]
        at, failure, off_body = (at[0][success], at[1][success]), failure[success], off_body[success]
        direction = np.clip(self._commands.numbers[..., 0][at], server["minmoment"], server["maxmoment"])
        power = formulas.tackle_power(
            np.radians(direction),
            off_body,
            max_tackle_power=server["max_tackle_power"],
            max_back_tackle_power=server["max_back_tackle_power"],
            tackle_power_rate=server["tackle_power_rate"],
        )
        noise = formulas.tackle_noise(
            failure, self._ball_speed(at), kick_rand=self._types(at)["kick_rand"], server=server
        )
        self._add(at, power, direction, noise)

    def _who(self, kind: CommandKind) -> Index:
        cycle, place = np.nonzero((self._commands.kind == kind) & self._bodies.on_field)
        return cycle, place

    def _types(self, at: Index) -> dict[str, NDArray[np.float64]]:
        of = self._bodies.type[at]
        return {name: values[of] for name, values in self._rules.types.items()}

    def _ball_from(self, at: Index) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return metres to the ball, and its angle off the body in radians."""
        bodies = self._bodies
        dx, dy = bodies.x[at[0], BALL] - bodies.x[at], bodies.y[at[0], BALL] - bodies.y[at]
        return np.hypot(dx, dy), formulas.wrap(np.arctan2(dy, dx) - np.radians(bodies.body[at]))

    def _ball_speed(self, at: Index) -> NDArray[np.float64]:
        speed: NDArray[np.float64] = np.hypot(self._bodies.vx[at[0], BALL], self._bodies.vy[at[0], BALL])
        return speed

    def _kickable(self, cycles: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Return (m, 22) who can kick the ball in some cycles."""
        bodies, types = self._bodies, self._rules.types
        of = bodies.type[cycles]
        area = formulas.kickable_area(
            types["player_size"][of], types["kickable_margin"][of], self._rules.server["ball_size"]
        )
        dx, dy = (values[cycles, :BALL] - values[cycles, BALL:] for values in (bodies.x, bodies.y))
        near: NDArray[np.bool_] = (np.hypot(dx, dy) <= area) & bodies.on_field[cycles]
        return near

    def _add(
        self, at: Index, power: NDArray[np.float64], direction: NDArray[np.float64], noise: NDArray[np.float64]
    ) -> None:
        """Add accelerations of a length and a direction off the body in degrees."""
        angle = np.radians(self._bodies.body[at] + np.clip(direction, -180.0, 180.0))
        x, y = power * np.cos(angle), power * np.sin(angle)
        if self._rng is not None:
            length, off = self._rng.uniform(0.0, noise), self._rng.uniform(-np.pi, np.pi, len(noise))
            x, y, noise = x + length * np.cos(off), y + length * np.sin(off), np.zeros_like(noise)
        for total, part in ((self.x, x), (self.y, y), (self.noise, noise)):
            np.add.at(total, at[0], part)
        self.by[at] = True
