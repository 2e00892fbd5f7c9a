"""Kicks: power and direction from a wanted velocity by hand, and that left and right are alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
import torch
from benchmarks.kicks import plans
from tests.situations import situations

from teamclone.engine.inputs.layout import GEOMETRY, MATES
from teamclone.engine.network.constants import (
    AHEAD_M,
    BALL_COMPONENTS,
    DEGREE,
    DRIBBLES,
    IMPOSSIBLE,
    LEAD_M,
    LEAST_ANGLE,
    LEAST_POWER,
    N_COMPONENTS,
    TOUCH_M,
    USUAL_ERROR,
)
from teamclone.models.clone import Clone
from teamclone.models.config import EgocentricConfig
from teamclone.models.distributions import Mixture, wrap
from teamclone.models.heads.kick import KickMixture
from teamclone.models.heads.mixture import TACKLE_DIRECTIONS, MixtureHead, class_of
from teamclone.models.inputs.geometry import InputLayout, Inputs
from teamclone.planner.columns import PLAN, WAYS
from teamclone.rcss.commands import CLONED_KINDS, PARAMETERS, CommandKind
from teamclone.world.mirror import mirror_state, mirror_target
from teamclone.world.state import State, Target

GOAL, AIMED = MATES, MATES + 1 + BALL_COMPONENTS
"""Places of the goal's component and of the first dribble."""
USUAL = 1 / (1 + math.exp(-3))
"""What an output of 0 leaves of a typical scale."""
OUTPUTS = ("share", "ahead", "aside", "speed", "power", "direction")


def geometry(**values: float) -> Inputs:
    """One situation: the player at (10, -5) faces +y; the ball lies at (10, -4), unmoving; mates are where he is."""
    usual = {"x": 10, "y": -5, "cos": 0, "sin": 1, "decay": 0.4, "dash_gain": 0.006, "ball_x": 10, "ball_y": -4}
    usual |= {"kick_gain": 0.02, "ball_decay": 0.94, "ball_speed_max": 3.0}
    usual |= {f"mate_{mate}_{axis}": usual[axis] for mate in range(MATES) for axis in "xy"}
    columns = torch.tensor([[float((usual | values).get(name, 0.0)) for name in GEOMETRY]])
    return InputLayout(columns=0, others=False, plan=False).unpack(columns)


def kick(*, component: int = 0, outputs: dict[str, float] | None = None, **values: float) -> list[float]:
    """Power and degrees of a component whose outputs are 0 but for the given ones."""
    kicks = KickMixture(3)
    with torch.no_grad():
        kicks.layer.weight.zero_()
        kicks.layer.bias.zero_()
        for name, value in (outputs or {}).items():
            kicks.layer.bias.view(6, N_COMPONENTS)[OUTPUTS.index(name), component] = value
        power, direction = kicks(torch.zeros(1, 3), geometry(**values))
    assert power.logits is direction.logits
    return [float(power.centre[0, component]), float(direction.centre[0, component]) / DEGREE]


def planned(ways: dict[str, tuple[float, float]]) -> Inputs:
    """The same situation with ways to go on, and the velocities that they give the ball."""
    columns = [[1.0, *ways[name]] if name in ways else [0.0, 0.0, 0.0] for name in WAYS]
    return geometry(ball_vx=0.3, ball_vy=-0.2)._replace(ways=torch.tensor([columns]))


def needed(wanted: Sequence[float], *, gain: float = 0.02, motion: Sequence[float] = (0.0, 0.0)) -> list[float]:
    """The kick of one who faces +y that gives the ball a velocity."""
    x, y = wanted[0] - motion[0], wanted[1] - motion[1]
    return [math.hypot(x, y) / gain, math.degrees(math.atan2(-x, y))]


def towards(x: float, y: float, speed: float) -> list[float]:
    """A velocity from where the ball is."""
    way = math.hypot(x - 10, y + 4)
    return [speed * (x - 10) / way, speed * (y + 4) / way]


def test_a_pass_at_half_speed() -> None:
    """An output of 0 is half of the ball's greatest speed, straight to the team mate."""
    got = kick(component=2, mate_2_x=30.0, mate_2_y=-4.0)
    assert got == pytest.approx([1.5 / 0.02, -90.0], abs=1e-2)


def test_a_pass_stops_what_the_ball_does() -> None:
    """Straight +x at 1.5, of a ball that already moves (0.5, -0.3): (1.0, 0.3) is lacking."""
    got = kick(component=2, mate_2_x=30.0, mate_2_y=-4.0, ball_vx=0.5, ball_vy=-0.3)
    assert got == pytest.approx(needed((1.5, 0), motion=(0.5, -0.3)), abs=1e-2)
    assert got == pytest.approx([math.hypot(1, 0.3) / 0.02, -math.degrees(math.atan2(1, 0.3))], abs=1e-2)


def test_a_pass_leads_the_team_mate() -> None:
    """Outputs of 1 and -0.5: 12 m before him and 6 m to his right, on the pitch."""
    got = kick(component=0, outputs={"ahead": 1.0, "aside": -0.5, "speed": 2.0}, mate_0_x=20.0, mate_0_y=11.0)
    speed = 3 / (1 + math.exp(-2))
    assert got == pytest.approx(needed(towards(20 + LEAD_M, 11 - LEAD_M / 2, speed)), abs=2e-2)


def test_a_shot_goes_to_the_middle_of_the_goal() -> None:
    assert kick(component=GOAL) == pytest.approx(needed(towards(52.5, 0, 1.5)), abs=1e-2)


def test_a_free_kick_goes_where_its_outputs_say() -> None:
    """Seen from the ball: with no way at all the ball is stopped."""
    outputs = {"ahead": -0.25, "aside": 0.25}
    assert kick(component=GOAL + 1, outputs=outputs) == pytest.approx(needed(towards(7, -1, 1.5)), abs=1e-2)
    assert kick(component=GOAL + BALL_COMPONENTS, ball_vy=0.8)[0] == pytest.approx(0.8 / 0.02, abs=0.1)


@pytest.mark.parametrize("number", range(len(DRIBBLES)))
def test_a_dribble_has_the_ball_before_him_after_a_kick_and_dashes(number: int) -> None:
    """Played cycle by cycle: the kick, then full dashes straight on, until the ball lies AHEAD_M before him."""
    cycles = DRIBBLES[number]
    motion, ball_motion = (-0.05, 0.3), (0.1, 0.2)
    values = {"forward": 0.3, "aside": 0.05, "ball_vx": ball_motion[0], "ball_vy": ball_motion[1]}
    power, degrees = kick(component=AIMED + number, **values)
    assert power < 150
    # He faces +y: to the left is -x.
    ball_vx = ball_motion[0] - 0.02 * power * math.sin(math.radians(degrees))
    ball_vy = ball_motion[1] + 0.02 * power * math.cos(math.radians(degrees))
    (x, y), (vx, vy), (ball_x, ball_y) = (10.0, -5.0), motion, (10.0, -4.0)
    for cycle in range(cycles):
        vy += 0.6 if cycle else 0.0
        x, y, ball_x, ball_y = x + vx, y + vy, ball_x + ball_vx, ball_y + ball_vy
        vx, vy, ball_vx, ball_vy = 0.4 * vx, 0.4 * vy, 0.94 * ball_vx, 0.94 * ball_vy
    assert (ball_x - x, ball_y - y) == pytest.approx((0.0, AHEAD_M), abs=1e-3)


def test_a_dribble_may_go_aside() -> None:
    """In one cycle a player at rest stays; 3 m an output, forward and to the left, which is -x."""
    got = kick(component=AIMED, outputs={"ahead": 0.2, "aside": 0.5})
    assert got == pytest.approx(needed((-TOUCH_M * 0.5, -5 + AHEAD_M + TOUCH_M * 0.2 + 4)), abs=1e-2)


def test_powers_beyond_reach_are_bounded() -> None:
    """So that a component that nobody could kick still has a gradient near what the server clips."""
    assert kick(component=GOAL, kick_gain=0.0)[0] == 150
    assert kick(component=GOAL, outputs={"speed": -9.0}, kick_gain=0.0)[0] == pytest.approx(0.37 / 5, abs=0.3)


def test_scales_are_typical() -> None:
    kicks = KickMixture(3)
    with torch.no_grad():
        kicks.layer.weight.zero_()
        kicks.layer.bias.zero_()
        power, direction = kicks(torch.zeros(1, 3), geometry())
    assert power.scale[0].tolist() == pytest.approx([LEAST_POWER + 5 * USUAL] * N_COMPONENTS)
    assert direction.scale[0].tolist() == pytest.approx([LEAST_ANGLE + 6 * DEGREE * USUAL] * N_COMPONENTS)


# Left and right.

MODEL = EgocentricConfig(
    blocks=("self", "role", "ball"),
    kick_blocks=("self", "type", "last", "ball", "reach", "lines", "mates", "opponents", "rivals"),
    target_points=2,
    target_hidden=(8,),
    parameter_hidden=(8,),
    kick_hidden=(32,),
    kick_dropout=0.3,
    hidden=(16,),
    kick_attention=0,
    target_weight=0.0,
)


@pytest.fixture(scope="module", params=["plain", "attention", "candidates"])
def model(request: pytest.FixtureRequest) -> Clone:
    torch.manual_seed(0)
    attention, candidates = {"plain": (0, 0), "attention": (8, 0), "candidates": (8, 4)}[request.param]
    model = Clone(replace(MODEL, kick_attention=attention, kick_candidates=candidates))
    # Of samples that lean to one side.
    state = situations(100, seed=5)
    leaning = model.inputs.project(state.select(state.ball[:, 1] > 0))
    model.fit([leaning], [leaning[::2]])
    return model.eval()


def test_each_way_that_is_planned_is_a_component() -> None:
    """Those that there are; beside them the free ones."""
    kicks = KickMixture(3, planned=True)
    ways = {"pass": (1.2, 0.7), "hold": (-0.1, 0.2)}
    with torch.no_grad():
        power, direction = kicks(torch.zeros(1, 3), planned(ways))
    assert power.logits.shape == direction.logits.shape == (1, N_COMPONENTS + len(WAYS))
    for place, name in enumerate(WAYS, N_COMPONENTS):
        if name in ways:
            found = [float(power.centre[0, place]), float(direction.centre[0, place]) / DEGREE]
            assert found == pytest.approx(needed(ways[name], motion=(0.3, -0.2)), abs=0.1)
            assert power.logits[0, place] > IMPOSSIBLE
        else:
            assert power.logits[0, place] == direction.logits[0, place] == IMPOSSIBLE
    # The free ones are as without a plan.
    alone = KickMixture(3)
    alone.load_state_dict(kicks.state_dict(), strict=False)
    with torch.no_grad():
        free, _ = alone(torch.zeros(1, 3), geometry(ball_vx=0.3, ball_vy=-0.2))
    torch.testing.assert_close(power.centre[:, :N_COMPONENTS], free.centre)


def test_errors_of_what_is_planned_are_of_the_ball_velocity() -> None:
    """The harder a kick, the less a wrong velocity turns it."""
    kicks = KickMixture(3, planned=True)
    assert kicks.planned is not None
    with torch.no_grad():
        kicks.planned.error[WAYS.index("pass")] = math.log(2.0)
        power, direction = kicks(torch.zeros(1, 3), planned({"pass": (1.2, 0.7), "self_pass": (0.5, -0.2)}))
    for name, factor, added in (("pass", 2.0, math.hypot(0.9, 0.9)), ("self_pass", 1.0, 0.2)):
        place = N_COMPONENTS + WAYS.index(name)
        error = factor * USUAL_ERROR
        assert power.scale[0, place].item() == pytest.approx(LEAST_POWER + error / 0.02)
        assert direction.scale[0, place].item() == pytest.approx(LEAST_ANGLE + error / added, rel=1e-2)


def mirrored(state: State) -> State:
    return mirror_state(state, torch.arange(22))


def assert_alike(one: Mixture, other: Mixture, *, turned: bool) -> None:
    for part, mirror in ((one.logits, other.logits), (one.scale, other.scale)):
        torch.testing.assert_close(part, mirror, atol=1e-3, rtol=1e-3)
    away = wrap(one.centre + other.centre) if turned else one.centre - other.centre
    assert away.abs().max() < 1e-2


def test_a_mirrored_situation_has_the_mirrored_kicks(model: Clone) -> None:
    state = situations(60)
    with torch.no_grad():
        answers, turned = model.answer(state).distribution.kick, model.answer(mirrored(state)).distribution.kick
    for one, other in zip(answers, reversed(turned), strict=True):
        assert_alike(one.power, other.power, turned=False)
        assert_alike(one.direction, other.direction, turned=True)
        opposite = [-k % one.tackle.shape[1] for k in range(one.tackle.shape[1])]
        torch.testing.assert_close(one.tackle, other.tackle[:, opposite], atol=1e-3, rtol=1e-3)
    # Neither answer by itself is.
    assert (answers[0].power.centre - turned[0].power.centre).abs().max() > 1


def test_mirrored_kicks_are_as_likely(model: Clone) -> None:
    state = situations(60)
    generator = torch.Generator().manual_seed(0)
    kick, tackle = (CLONED_KINDS.index(kind) for kind in (CommandKind.KICK, CommandKind.TACKLE))
    kind = torch.tensor([kick, tackle]).repeat(30)
    values = torch.rand(60, 2, generator=generator)
    power, direction = 100 * values[:, 0], 360 * values[:, 1] - 180
    first = torch.where(kind == kick, power, (direction / 9).round() * 9)
    target = Target(kind, torch.stack([first, torch.where(kind == kick, direction, 0.0)], 1))
    with torch.no_grad():
        likelihood = model.answer(state).log_likelihood(target)
        turned = model.answer(mirrored(state)).log_likelihood(mirror_target(target))
    torch.testing.assert_close(likelihood, turned, atol=2e-2, rtol=1e-3)


def test_the_single_answer_is_mirrored(model: Clone) -> None:
    state = situations(60)
    parameters, turned = (model.predict(of)[1] for of in (state, mirrored(state)))
    for parameter, values, others in zip(PARAMETERS[3:], parameters.T[3:], turned.T[3:], strict=True):
        away = wrap((values + others) * DEGREE) / DEGREE if parameter.angle else values - others
        # Of two components that are as near to the median rounding may take either.
        assert (away.abs() < 0.5).float().mean() > 0.95, parameter.name


def test_a_planned_tackle_is_trusted_as_far_as_training_says() -> None:
    torch.manual_seed(0)
    model = Clone(replace(MODEL, kick_blocks=("ball", "plan"))).eval()
    state = situations(300, seed=5)
    made = plans(state)
    there, degrees = made[:, PLAN.index("tackle_there")] > 0, made[:, PLAN.index("tackle_degrees")]
    assert there.sum() > 10
    head = model.head
    assert isinstance(head, MixtureHead)
    assert head.planned_tackle is not None
    place = [parameter.name for parameter in PARAMETERS].index("tackle_direction")
    with torch.no_grad():
        head.planned_tackle.weight.zero_()
        doubted = model.predict(state)[1][:, place]
        head.planned_tackle.bias.fill_(30.0)
        trusted = model.predict(state)[1][:, place]
        answers = model.answer(state).distribution.kick
    # On the left as on the right.
    for answer in answers:
        assert torch.equal(answer.tackle.argmax(1)[there], class_of(degrees, TACKLE_DIRECTIONS)[there])
    assert (wrap((trusted - degrees)[there] * DEGREE).abs() < 1e-4).all()
    assert torch.equal(trusted[~there], doubted[~there])
    assert (wrap((doubted - degrees)[there] * DEGREE).abs() > 0.1).float().mean() > 0.5
