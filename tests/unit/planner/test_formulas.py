"""Scalar kernels of the planner that restate a formula of the server: equal to `dynamics.formulas`."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from teamclone.dynamics import formulas
from teamclone.planner import ball, motion, players, scene, tackle
from teamclone.rcss.player_types import DEFAULTS as TYPE
from teamclone.rcss.server_params import FIELDS, SERVER_DEFAULTS
from teamclone.world.channels import CHANNEL, FLAG_ON_FIELD, TYPE_FIELD

Random = np.random.Generator


def drawn(random: Random) -> tuple[dict[str, float], dict[str, float], scene.Array, scene.Array]:
    """Return parameters of a server and of a type by name, and rows of a scene with them."""
    # An effort that is to rise must not fall: thresholds keep their order.
    server = SERVER_DEFAULTS * random.uniform(0.95, 1.05, len(FIELDS))
    types = np.zeros((1, 22, len(TYPE_FIELD)))
    of_type = {name: value * float(random.uniform(0.9, 1.1)) for name, value in TYPE.items()}
    for name, value in of_type.items():
        types[..., TYPE_FIELD[name]] = value
    channels = np.zeros((1, 22, len(CHANNEL)))
    channels[..., CHANNEL["flags"]] = FLAG_ON_FIELD
    channels[..., CHANNEL["vx"]] = random.uniform(0, 0.5)
    made = np.zeros((scene.ROWS, scene.COLUMNS))
    scene.fill_scene(np.zeros(4), channels[0], types[0], server, made)
    scene.complete(made, 0)
    return dict(zip(FIELDS, server.tolist(), strict=True)), of_type, made[scene.SERVER], made[scene.ACTOR]


def kick_rate(random: Random) -> tuple[float, float]:
    server, of_type, _, me = drawn(random)
    metres, aside = random.uniform(0.3, 1.1), random.uniform(-400, 400)
    names = ("kick_power_rate", "player_size", "kickable_margin")
    wanted = formulas.kick_rate(
        metres, math.radians(aside), ball_size=server["ball_size"], **{name: of_type[name] for name in names}
    )
    return ball.kick_rate(me, metres, aside), wanted


def kickable_area(random: Random) -> tuple[float, float]:
    server, of_type, _, me = drawn(random)
    wanted = formulas.kickable_area(of_type["player_size"], of_type["kickable_margin"], server["ball_size"])
    return me[scene.AREA], wanted


def dash_rate(random: Random) -> tuple[float, float]:
    server, _, row, _ = drawn(random)
    degrees = random.uniform(0, 180)
    names = ("side_dash_rate", "back_dash_rate")
    sign = random.choice([-1, 1])
    return motion.dash_rate(row, sign * degrees), float(
        formulas.dash_rate(degrees, **{name: server[name] for name in names})
    )


def limited(random: Random) -> tuple[object, object]:
    x, y, most = random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(0, 3)
    return ball.limited(x, y, most), tuple(float(part) for part in formulas.limited(x, y, most))


def fastest(random: Random) -> tuple[float, float]:
    angle = random.uniform(-4, 4)
    velocity, toward = tuple(random.uniform(-2, 2, 2).tolist()), (math.cos(angle), math.sin(angle))
    most, limit = random.uniform(0.5, 3), random.uniform(0.5, 3)
    wanted = formulas.fastest(velocity, toward, most_added=most, ball_speed_max=limit)
    return ball.fastest((most, limit), toward, velocity), float(wanted)


def turn(random: Random) -> tuple[float, float]:
    _, of_type, _, me = drawn(random)
    speed = random.uniform(0, 1)
    return scene.most_turn(me, speed), formulas.turn(180.0, speed, of_type["inertia_moment"])


def turns(random: Random) -> tuple[float, float]:
    """Turns one after the other, each by the speed that is left."""
    _, of_type, _, me = drawn(random)
    off, speed, wanted = random.uniform(0, 180), math.hypot(me[scene.VX], me[scene.VY]), 0
    left = off - players.FACED_DEG
    while left > 0:
        left -= formulas.turn(180.0, speed, of_type["inertia_moment"])
        speed *= of_type["player_decay"]
        wanted += 1
    return players.turns(me, off, 50.0, 0.1), wanted


def tackle_failure(random: Random) -> tuple[float, float]:
    server, _, row, _ = drawn(random)
    ahead, aside = random.uniform(0.01, 2), random.uniform(-1.2, 1.2)
    names = ("tackle_dist", "tackle_back_dist", "tackle_width")
    exponent = server["foul_exponent"]
    wanted = formulas.tackle_failure(ahead, aside, exponent=exponent, **{name: server[name] for name in names})
    return players.tackle_chance(row, ahead, aside, exponent), 1.0 - float(wanted)


def tackle_power(random: Random) -> tuple[float, float]:
    server, _, row, _ = drawn(random)
    degrees, off = random.uniform(-180, 180), random.uniform(-180, 180)
    names = ("max_tackle_power", "max_back_tackle_power", "tackle_power_rate")
    wanted = formulas.tackle_power(math.radians(degrees), math.radians(off), **{name: server[name] for name in names})
    return tackle.tackle_speed(row, degrees, off), wanted


def roll(random: Random) -> tuple[float, float]:
    cycles, decay = random.uniform(0, 60), random.uniform(0.3, 0.97)
    return scene.roll(cycles, decay), formulas.roll(cycles, decay)


def inertia_point(random: Random) -> tuple[float, float]:
    _, of_type, _, me = drawn(random)
    cycle = int(random.integers(0, 70))
    return scene.inertia_point(me, cycle)[0], me[scene.VX] * formulas.roll(cycle, of_type["player_decay"])


def cycles_over(random: Random) -> tuple[float, float]:
    speed, decay = random.uniform(1, 3), random.uniform(0.9, 0.97)
    metres = random.uniform(0.1, 0.9) * speed / (1 - decay)
    return ball.cycles_over(metres, speed, decay), math.ceil(formulas.cycles_over(metres, speed, decay))


def covered(random: Random) -> tuple[float, float]:
    _, of_type, _, me = drawn(random)
    me[scene.TOP] = me[scene.DASH_ACCEL] / (1 - of_type["player_decay"])
    count = int(random.integers(0, 60))
    return players.covered(me, count), formulas.covered(count, me[scene.DASH_ACCEL], of_type["player_decay"])


def dashes(random: Random) -> tuple[float, float]:
    """So many dashes cover the way, and one less does not."""
    _, of_type, _, me = drawn(random)
    metres = random.uniform(0.01, 15)
    count = players.dashes(me, metres)
    covered = [formulas.covered(n, me[scene.DASH_ACCEL], of_type["player_decay"]) for n in (count - 1, count)]
    top = me[scene.DASH_ACCEL] / (1 - of_type["player_decay"]) <= of_type["player_speed_max"]
    return float(not top or covered[0] < metres - players.HARDLY_M <= covered[1] + 1e-9), 1.0


def rested(random: Random) -> tuple[object, object]:
    server, of_type, row, me = drawn(random)
    state = [random.uniform(0, 8000), random.uniform(0.6, 1), random.uniform(0.5, 1), random.choice([0.0, 20.0, 9e4])]
    left = np.array(state)
    motion.recover(row, me, left)
    names = ("stamina_inc_max", "effort_min", "effort_max")
    return left, [
        float(part) for part in formulas.rested(*state, server=server, **{name: of_type[name] for name in names})
    ]


FORMULAS = (kick_rate, kickable_area, dash_rate, limited, fastest, turn, turns, tackle_failure, tackle_power, roll,
            inertia_point, cycles_over, covered, dashes, rested)  # fmt: skip


@pytest.mark.parametrize("both", FORMULAS, ids=lambda both: both.__name__)
def test_kernels_equal_the_formulas(both: Callable[[Random], tuple[float, float]]) -> None:
    random = np.random.default_rng(3)
    for _ in range(100):
        kernel, formula = both(random)
        assert kernel == pytest.approx(formula, rel=1e-9, abs=1e-12)
