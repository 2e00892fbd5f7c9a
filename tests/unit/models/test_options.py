"""Options of a kick: each played out cycle by cycle, and those that agents of real matches chose."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import torch

from teamclone.dataset.build import DatasetConfig, build_dataset
from teamclone.dataset.reader import open_dataset
from teamclone.models.mixture import DEGREE, LEAST_ANGLE, LEAST_POWER, Mixture
from teamclone.models.options import (
    COLUMNS,
    DRIBBLE_DASHES,
    DRIBBLE_TURNS,
    IMPOSSIBLE,
    KEEP,
    KICK_ON,
    RUN_DASHES,
    RUN_SIDE,
    USUAL_ERROR,
    Options,
)
from teamclone.models.relative import GEOMETRY, MATES, OTHER, OTHERS, RelativeFeatures, geometry_of
from teamclone.rcss.commands import CLONED_KINDS, CommandKind
from teamclone.store import create_store
from teamclone.store.ingest import ingest

AREA, MARGIN, EDGES = 1.085, 0.7, 0.385
FIRST = dict(zip(("kick on", "keep", "dribble", "run"), (0, 47, 107, 155), strict=True))
"""Where each kind begins among the options."""


def geometry(*, opponents: list[tuple[float, float]] | None = None, **values: float) -> torch.Tensor:
    """One situation: a player at (10, -5) who faces +y, the ball half a metre before him; opponents who stand."""
    usual = {"x": 10, "y": -5, "cos": 0, "sin": 1, "decay": 0.4, "dash_gain": 0.006, "ball_x": 10, "ball_y": -4.5}
    usual |= {"kick_gain": 0.025, "turn_factor": 1.0, "kick_area": AREA, "kick_margin": MARGIN}
    others = torch.zeros(OTHERS, len(OTHER))
    for index, place in enumerate(opponents or []):
        others[MATES + index, :2], others[MATES + index, OTHER.index("there")] = torch.tensor(place), 1.0
    columns = torch.tensor([float((usual | values).get(name, 0.0)) for name in GEOMETRY])
    return torch.cat([columns, others.flatten()])[None]


BODY = len(GEOMETRY) + len(OTHER) * MATES + OTHER.index("cos")
"""Where the body direction of the nearest opponent is."""


def kicked(situations: torch.Tensor, options: Options | None = None) -> tuple[Mixture, Mixture]:
    """Power and direction of the options, as they are and not mirrored."""
    n = len(situations)
    of = options or Options(3, 4)
    power, direction = of(torch.zeros(2 * n, 3), situations.repeat(2, 1), torch.zeros(2 * n, MATES + 1, 4))
    torch.testing.assert_close(direction.centre[n:], -direction.centre[:n])
    return Mixture(*(part[:n] for part in power)), Mixture(*(part[:n] for part in direction))


def played(option: int, *, turns: int, angle: float, dashes: int, **values: float) -> tuple[list[float], list[float]]:
    """Player and ball after the kick of an option, by the server's physics; ``angle`` of the dashes from the body."""
    situation = geometry(**values)
    (x, y, vx, vy, ball_x, ball_y) = (
        float(value)
        for value in torch.cat(geometry_of(situation, "x", "y", "aside", "forward", "ball_x", "ball_y"), 1)[0]
    )
    vx = -vx  # he faces +y: to his left is -x
    power, direction = kicked(situation)
    turned = float(direction.centre[0, option])
    added = 0.025 * float(power.centre[0, option])
    ball_vx = values.get("ball_vx", 0.0) - added * math.sin(turned)
    ball_vy = values.get("ball_vy", 0.0) + added * math.cos(turned)
    for cycle in range(1 + turns + dashes):
        if cycle > turns:
            vx -= 0.6 * math.sin(math.radians(angle))
            vy += 0.6 * math.cos(math.radians(angle))
        x, y, ball_x, ball_y = x + vx, y + vy, ball_x + ball_vx, ball_y + ball_vy
        vx, vy, ball_vx, ball_vy = 0.4 * vx, 0.4 * vy, 0.94 * ball_vx, 0.94 * ball_vy
    return [x, y], [ball_x, ball_y]


MOVING = {"forward": 0.3, "aside": 0.05, "ball_vx": 0.1, "ball_vy": 0.2}


def test_how_many_there_are() -> None:
    choice = Options(3, 4).choose(geometry())
    assert [sum(count for _, count in rings) for rings in (KICK_ON, KEEP)] == [47, 60]
    assert DRIBBLE_TURNS * len(DRIBBLE_DASHES) == 48
    count = FIRST["run"] + (2 * RUN_SIDE + 1) * len(RUN_DASHES)
    assert choice.velocity.shape == choice.place.shape == (1, count, 2)
    assert choice.possible.shape == (1, count)


@pytest.mark.parametrize(
    ("option", "distance", "from_body"),
    [
        (0, EDGES + 0.3 * MARGIN, -180.0),  # 12 around the body, from straight behind
        (4, EDGES + 0.3 * MARGIN, -60.0),
        (12 + 5, EDGES + 0.5 * MARGIN, -60.0),  # 15
        (27 + 11, EDGES + 0.7 * MARGIN, 18.0),  # 20
        (47, EDGES + 0.4 * MARGIN, 90.0),  # in the axes of the pitch: -x is to the left of one who faces +y
        (67 + 10, EDGES + 0.6 * MARGIN, -90.0),
        (87 + 15, EDGES + 0.75 * MARGIN, 0.0),
    ],
)
def test_a_place_beside_him(option: int, distance: float, from_body: float) -> None:
    (x, y), ball = played(option, turns=0, angle=0.0, dashes=0, **MOVING)
    left, ahead = distance * math.sin(math.radians(from_body)), distance * math.cos(math.radians(from_body))
    assert (ball[0] - x, ball[1] - y) == pytest.approx((-left, ahead), abs=1e-3)


def test_a_place_is_within_reach() -> None:
    """Of a small margin: at least 0.1 m off his edge, and 0.2 m within what he reaches."""
    near, far = (
        played(option, turns=0, angle=0.0, dashes=0, kick_area=EDGES + margin, kick_margin=margin)[1]
        for option, margin in ((0, 0.31), (27, 0.5))
    )
    assert -5 - near[1] == pytest.approx(EDGES + 0.1, abs=1e-3)
    assert -5 - far[1] == pytest.approx(EDGES + 0.3, abs=1e-3)


@pytest.mark.parametrize("dashes", DRIBBLE_DASHES)
@pytest.mark.parametrize(("direction", "turns", "angle"), [(0.0, 0, 0.0), (45.0, 1, 45.0), (-157.5, 1, -157.5)])
def test_a_dribble_has_the_ball_ahead(direction: float, turns: int, angle: float, dashes: int) -> None:
    option = FIRST["dribble"] + 3 * round((direction + 180) / 22.5) + dashes - 2
    (x, y), (ball_x, ball_y) = played(option, turns=turns, angle=angle, dashes=dashes, **MOVING)
    ahead = EDGES + 0.2 * MARGIN
    expected = (-ahead * math.sin(math.radians(angle)), ahead * math.cos(math.radians(angle)))
    assert (ball_x - x, ball_y - y) == pytest.approx(expected, abs=2e-3)


def test_a_dribbler_turns_as_far_as_he_comes() -> None:
    """At 1.5 m a cycle and with inertia 5 he turns 180 / (1 + 5 * 0.6) = 45 deg, then 180 / (1 + 5 * 0.24) = 81.8."""
    factor = 1 + 5 * 1.5
    fast = {"forward": 1.5, "turn_factor": factor}
    first = 180 / (1 + (factor - 1) * 0.4)
    assert first == pytest.approx(45)
    choice = Options(3, 4).choose(geometry(**fast))
    dribbles = choice.possible[0, FIRST["dribble"] : FIRST["run"]].view(DRIBBLE_TURNS, 3).any(1)
    # 135 and more, either way, is beyond two turns of 126.8 deg.
    assert [round(22.5 * index - 180, 1) for index in range(16) if not dribbles[index]] == [-180.0, -157.5, 157.5]
    # The last 8.2 deg of 135 are not worth another turn.
    option = FIRST["dribble"] + 3 * round((135 + 180) / 22.5)
    angle = 45 + 180 / (1 + (factor - 1) * 0.16)
    (x, y), (ball_x, ball_y) = played(option, turns=2, angle=angle, dashes=2, **fast)
    ahead = EDGES + 0.2 * MARGIN
    expected = (-ahead * math.sin(math.radians(angle)), ahead * math.cos(math.radians(angle)))
    assert (ball_x - x, ball_y - y) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize(("steps", "dashes"), [(0, 5), (0, 20), (3, 7), (-8, 9)])
def test_a_run_meets_the_ball(steps: int, dashes: int) -> None:
    """So far as dashes add to the velocity before it decays, what `played` does."""
    option = FIRST["run"] + len(RUN_DASHES) * (RUN_SIDE + steps) + RUN_DASHES.index(dashes)
    player, ball = played(option, turns=int(steps != 0), angle=6.0 * steps, dashes=dashes, **MOVING)
    assert ball == pytest.approx(player, abs=5e-3)


def test_what_one_kick_cannot_do_is_impossible() -> None:
    options = Options(3, 4)
    weak = options.choose(geometry(kick_gain=0.001, ball_vy=2.5)).possible
    assert not weak.any()
    power, direction = kicked(geometry(kick_gain=0.001, ball_vy=2.5))
    assert (power.logits == IMPOSSIBLE).all()
    assert torch.equal(power.logits, direction.logits)
    # A run of 20 dashes goes further than the ball rolls at 3 m a cycle; a turn of 60 deg is too much for who is fast.
    choice = options.choose(geometry(turn_factor=9.0))
    runs = choice.possible[0, FIRST["run"] :].view(-1, len(RUN_DASHES)).any(1)
    assert runs.tolist() == [abs(steps) * 6 <= 180 / (1 + 8 * 0.4) for steps in range(-RUN_SIDE, RUN_SIDE + 1)]


def test_errors_are_of_the_ball_velocity() -> None:
    """The harder a kick, the less a wrong velocity turns it."""
    options = Options(3, 4)
    with torch.no_grad():
        options.error += math.log(2.0)
        power, direction = kicked(geometry(), options)
    assert power.scale[0].tolist() == pytest.approx([LEAST_POWER + 2 * USUAL_ERROR / 0.025] * power.scale.shape[1])
    speed = 0.025 * power.centre[0]
    torch.testing.assert_close(direction.scale[0], LEAST_ANGLE + 2 * USUAL_ERROR / speed, atol=1e-5, rtol=1e-3)


def test_what_is_known_of_a_place() -> None:
    """Of a ball kept 0.385 + 0.42 m straight ahead, 1.5 m before an opponent who faces +x."""
    options = Options(3, 4)
    keep = FIRST["keep"] + 20 + 15
    off = EDGES + 0.6 * MARGIN
    situation = geometry(opponents=[(10.0, -5 + off + 1.5), (30.0, 20.0)])
    situation[0, BODY] = 1.0
    choice = options.choose(situation)
    columns = options.columns(choice, situation)
    assert columns.shape == (1, len(options.kinds), COLUMNS)
    assert choice.velocity[0, keep].tolist() == pytest.approx([off - 0.5, 0.0], abs=1e-5)
    next_gain = 1 - 0.25 * 0.6
    speed = off - 0.5
    expected = [speed / 3, speed / 2.5, off, 0.0, next_gain, speed * 0.94 / (3 * next_gain), 10 / 52.5, (5 - off) / 34]
    assert columns[0, keep, :8].tolist() == pytest.approx(expected, abs=2e-3)
    assert columns[0, keep, 9:15].tolist() == pytest.approx([0, 1, 1, 0, 0.1, 1], abs=2e-3)
    # The nearest place of the three rings straight ahead has the hardest kick next.
    assert columns[0, keep, 17] == pytest.approx(10 * (next_gain - (1 - 0.25 * 0.4)), abs=1e-4)
    assert columns[0, keep - 20, 17] == pytest.approx(0.0, abs=1e-5)
    # No tackle aside at 1.5 m; after a dash he is in reach; he does not face the ball.
    assert columns[0, keep, 22:26].tolist() == pytest.approx([0.3, 0.0, 0.3, 0.0], abs=1e-3)
    assert columns[0, keep, 26:].tolist() == [0, 1, 0, 0]
    situation[0, BODY : BODY + 2] = torch.tensor([0.0, -1.0])
    tackle = 1 - (1.5 / 2.0) ** 6
    facing = options.columns(choice, situation)
    assert facing[0, keep, 22:26].tolist() == pytest.approx([0.3, tackle, 0.3, 1.285], abs=1e-3)


def test_what_is_known_of_a_dribble() -> None:
    """Straight on with two dashes, to y = -3.04 in three cycles; one stands 4 m further and faces him, in his way."""
    options = Options(3, 4)
    straight = FIRST["dribble"] + 3 * 8
    place = -5 + 0.6 + 0.84 + EDGES + 0.2 * MARGIN
    situation = geometry(opponents=[(10.0, place + 4)])
    situation[0, BODY + 1] = -1.0
    choice = options.choose(situation)
    assert choice.place[0, straight].tolist() == pytest.approx([place + 5, 0.0], abs=1e-4)
    columns = options.columns(choice, situation)
    speed = (place + 4.5) / (1 + 0.94 + 0.94**2)
    assert columns[0, straight, 0] == pytest.approx(speed / 3, abs=1e-5)
    assert (columns[0, straight, 22:26] == 0).all()
    assert columns[0, straight, 26:].tolist() == [0, 0, 1, 0]
    way = 4 - 1.285
    # At x = 10 one cycle of his boldness is lost.
    first = way + 2 / 3 * (1 - 0.4**way) - 1 - 3 + 1.5 - 1
    assert columns[0, straight, 15] == pytest.approx(first / 3, abs=1e-4)
    # Turned away he needs two cycles more.
    situation[0, BODY + 1] = 1.0
    turned = options.columns(choice, situation)
    assert turned[0, straight, 15] == pytest.approx((first + 2) / 3, abs=1e-4)


@pytest.mark.parametrize("kind", ["dribble", "run"])
def test_the_best_safe_place_is_told(kind: str) -> None:
    """With nobody there all are safe: the best of a kind is the one furthest ahead, and lacks nothing."""
    options = Options(3, 4)
    situation = geometry(cos=1, sin=0, y=0, ball_x=10.5, ball_y=0)
    choice = options.choose(situation)
    of_kind = choice.possible[0] & choice.usual[0] & (options.kinds == list(FIRST).index(kind))
    columns = options.columns(choice, situation)[0, of_kind]
    ahead = choice.place[0, of_kind, 0]
    assert (columns[:, 15] == 1).all() or kind == "dribble"
    for column in range(16, 22):
        assert columns[:, column].max() == pytest.approx(0.0, abs=1e-5)
        assert columns[ahead.argmax(), column] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize(
    ("kind", "values", "count"),
    [
        ("dribble", {}, 3 * 9),  # at x < 16 not further back than 100 deg
        ("dribble", {"cos": 1, "sin": 0}, 3 * 9),
        ("dribble", {"cos": 1, "sin": 0, "x": 20, "ball_x": 20.5}, 48),
        ("dribble", {"cos": 1, "sin": 0, "x": -40, "ball_x": -39.5}, 3 * 5),  # near the own goal 45 deg
        ("run", {"cos": 1, "sin": 0, "x": -40, "ball_x": -39.5}, 17 * 2),  # 5 and 6 dashes
        ("run", {"cos": 1, "sin": 0, "x": -10, "ball_x": -9.5}, 17 * 3),
        ("run", {"cos": 0, "sin": 1, "x": 5, "ball_x": 5}, 8 * 9),  # to the right, by which he turns to +x
    ],
)
def test_what_is_usual_where(kind: str, values: dict[str, float], count: int) -> None:
    options = Options(3, 4)
    usual = options.choose(geometry(**values)).usual[0]
    assert int((usual & (options.kinds == list(FIRST).index(kind))).sum()) == count


def test_agents_of_real_matches_choose_among_them(samples_dir: Path, tmp_path: Path) -> None:
    """HELIOS_base is HELIOS Base as it is; the log has four digits of each velocity."""
    store = create_store(tmp_path / "store")
    ingest([samples_dir], store)
    build_dataset(DatasetConfig(teams=("HELIOS_base",)), store=store, out=tmp_path / "dataset")
    data = open_dataset(tmp_path / "dataset")
    target = data.target(range(len(data)))
    rows = torch.nonzero(target.kind == CLONED_KINDS.index(CommandKind.KICK))[:, 0]
    assert len(rows) > 100
    features = RelativeFeatures(("ball",), others=True)
    columns = features.project(data.state(rows.numpy()))[:, features.n_inputs :]
    power, direction = kicked(columns)
    gain = geometry_of(columns, "kick_gain")[0]
    given = torch.polar(gain[:, 0] * target.parameters[rows, 0], target.parameters[rows, 1] * DEGREE)
    missed = (torch.polar(gain * power.centre, direction.centre) - given[:, None]).abs()
    missed = torch.where(power.logits > IMPOSSIBLE, missed, 9.0).amin(1)
    assert (missed < 0.002).float().mean() > 0.5


def test_what_is_known_is_mirrored() -> None:
    """Options of a mirrored situation, each beside that of the situation which goes to the other side."""
    options = Options(3, 4)
    values = {"cos": 0.6, "sin": 0.8, "forward": 0.3, "aside": 0.1, "ball_vx": 0.2, "ball_vy": -0.1, "y": -3.0}
    opposite = {name: -value if name in {"sin", "aside", "ball_vy", "y"} else value for name, value in values.items()}
    one = geometry(**values, ball_y=-2.5, opponents=[(12.0, -1.0)])
    other = geometry(**opposite, ball_y=2.5, opponents=[(12.0, 1.0)])
    choice, turned = options.choose(one), options.choose(other)
    away = torch.cdist(choice.velocity * torch.tensor([1.0, -1.0]), turned.velocity)[0]
    same_kind = options.kinds[:, None] == options.kinds
    nearest, partner = torch.where(same_kind, away, 9.0).min(1)
    assert nearest.max() < 1e-3
    columns, expected = options.columns(choice, one) * options.signs, options.columns(turned, other)[:, partner]
    torch.testing.assert_close(columns, expected, atol=2e-3, rtol=1e-3)
