"""Candidates of kicks, played cycle by cycle with what the server does to a ball and to players who dash."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from teamclone.engine.inputs.layout import GEOMETRY, MATES, OTHER, OTHERS
from teamclone.engine.network.candidates import CLEAR, CLOSE, KINDS, PASS, RUN, SHOT, fill_candidates
from teamclone.engine.network.constants import (
    AHEAD_M,
    CANDIDATE_COLUMNS,
    CANDIDATE_DIRECTIONS,
    CLEARANCES,
    CLOSE_SHARES,
    N_CANDIDATES,
    PASS_ARRIVALS,
    PASSES,
    PASSES_TO_EACH,
    RUN_CYCLES,
    SHOT_YS,
)

AREA, DECAY, BALL_DECAY, TOP = 1.1, 0.4, 0.94, 3.0
RUNS = PASSES + len(SHOT_YS) + CLEARANCES
"""Place of the first run."""
CLOSES = RUNS + len(RUN_CYCLES) * CANDIDATE_DIRECTIONS
POWER, CUT, THEIRS, MATES_FIRST, OFFSIDE, KEEPER = (KINDS + column for column in (1, 11, 12, 13, 25, 26))
"""Places of columns."""


class Made(NamedTuple):
    there: NDArray[np.float32]
    velocity: NDArray[np.float32]
    columns: NDArray[np.float32]


def made(players: dict[int, dict[str, float]] | None = None, **values: float) -> Made:
    """Candidates of a player at (10, -5) who faces +y; the ball lies at (10, -4). Nobody else is there but ``players``.

    Args:
        players: by their places among the others what is known of them.
    """
    usual = {"x": 10, "y": -5, "cos": 0, "sin": 1, "decay": DECAY, "dash_gain": 0.006, "ball_x": 10, "ball_y": -4}
    usual |= {"kick_gain": 0.02, "kick_area": AREA, "ball_decay": BALL_DECAY, "ball_speed_max": TOP}
    geometry = np.array([(usual | values).get(name, 0.0) for name in GEOMETRY], np.float32)
    others = np.zeros((OTHERS, len(OTHER)), np.float32)
    for place, known in (players or {}).items():
        others[place] = [({"there": 1.0} | known).get(name, 0.0) for name in OTHER]
    wanted = np.full(3 * N_CANDIDATES, np.nan, np.float32)
    columns = np.full((N_CANDIDATES, CANDIDATE_COLUMNS), np.nan, np.float32)
    fill_candidates(geometry, others.reshape(-1), wanted, columns)
    assert np.isfinite(wanted).all()
    assert np.isfinite(columns).all()
    return Made(wanted[::3], np.stack([wanted[1::3], wanted[2::3]], 1), columns)


def kinds(candidates: Made) -> list[int]:
    return candidates.columns[:, :KINDS].argmax(1).tolist()


def rolled(velocity: NDArray[np.float32], cycles: int, start: tuple[float, float] = (10.0, -4.0)) -> list[float]:
    """Where a ball is, moved cycle by cycle."""
    (x, y), (vx, vy) = start, velocity.tolist()
    for _ in range(cycles):
        x, y, vx, vy = x + vx, y + vy, BALL_DECAY * vx, BALL_DECAY * vy
    return [x, y]


def test_they_are_in_their_order() -> None:
    candidates = made({mate: {"x": 20.0 + mate, "y": 3.0} for mate in range(MATES)})
    expected = [PASS] * PASSES + [SHOT] * len(SHOT_YS) + [CLEAR] * CLEARANCES
    expected += [RUN] * len(RUN_CYCLES) * CANDIDATE_DIRECTIONS
    expected += [CLOSE] * (len(CLOSE_SHARES) * CANDIDATE_DIRECTIONS + 1)
    assert kinds(candidates) == expected
    assert candidates.there.tolist() == [1.0] * N_CANDIDATES


def test_there_is_no_pass_to_who_is_not_there() -> None:
    candidates = made({2: {"x": 20.0, "y": 3.0}})
    first, last = 2 * PASSES_TO_EACH, 3 * PASSES_TO_EACH
    assert candidates.there[:PASSES].nonzero()[0].tolist() == list(range(first, last))
    assert candidates.there[PASSES:].all()


@pytest.mark.parametrize("arrival", range(len(PASS_ARRIVALS)))
def test_a_pass_arrives_with_its_speed_where_the_mate_is_next(arrival: int) -> None:
    """The ball passes the place as fast as it should, when it has lost what it loses on the way."""
    velocity = made({0: {"x": 21.7, "y": -4.0, "vx": 0.3}}).velocity[arrival]
    assert velocity[1] == pytest.approx(0.0, abs=1e-6)
    x, speed = 10.0, float(velocity[0])
    while x + speed < 22.0:
        x, speed = x + speed, speed * BALL_DECAY
    # Between two cycles a ball loses speed as the metres that it goes.
    assert speed - (22.0 - x) * (1 - BALL_DECAY) == pytest.approx(PASS_ARRIVALS[arrival], abs=1e-3)


def test_no_pass_is_faster_than_a_ball_can_be() -> None:
    candidates = made({0: {"x": -40.0, "y": 30.0}})
    assert np.hypot(*candidates.velocity.T).max() == pytest.approx(TOP, abs=1e-4)


def test_shots_cross_the_line_where_they_should() -> None:
    for velocity, y in zip(made().velocity[PASSES:], SHOT_YS, strict=False):
        assert math.hypot(*velocity) == pytest.approx(TOP, abs=1e-4)
        assert -4.0 + velocity[1] / velocity[0] * 42.5 == pytest.approx(y, abs=1e-3)


@pytest.mark.parametrize("number", range(len(RUN_CYCLES)))
def test_a_run_has_the_ball_before_the_player(number: int) -> None:
    """Straight on: a kick, then full dashes, until the ball lies AHEAD_M before the player."""
    cycles = int(RUN_CYCLES[number])
    velocity = made(forward=0.3, aside=0.05).velocity[RUNS + number * CANDIDATE_DIRECTIONS]
    x, y, vx, vy = 10.0, -5.0, -0.05, 0.3
    for cycle in range(cycles):
        vy += 0.6 if cycle else 0.0
        x, y, vx, vy = x + vx, y + vy, DECAY * vx, DECAY * vy
    assert rolled(velocity, cycles) == pytest.approx([x, y + AHEAD_M], abs=1e-3)


def test_what_is_kept_close_can_be_kicked_again() -> None:
    candidates = made(forward=0.3, aside=0.05)
    for index, share in enumerate(CLOSE_SHARES):
        for turn in range(CANDIDATE_DIRECTIONS):
            velocity = candidates.velocity[CLOSES + index * CANDIDATE_DIRECTIONS + turn]
            x, y = rolled(velocity, 1)
            assert math.hypot(x - 9.95, y + 4.7) == pytest.approx(share * AREA, abs=1e-4)
    assert candidates.velocity[-1].tolist() == [0.0, 0.0]


def test_an_opponent_in_the_way_cuts_a_pass_off() -> None:
    mate = {"x": 30.0, "y": -4.0}
    free, guarded = made({0: mate}), made({0: mate, MATES: {"x": 20.0, "y": -4.0}})
    behind = made({0: mate, MATES: {"x": 38.0, "y": -4.0}})
    assert free.columns[0, CUT] > 0 > guarded.columns[0, CUT]
    # One behind the mate is at the ball only when it has gone by.
    assert behind.columns[1, CUT] > 0
    assert behind.columns[1, THEIRS] < behind.columns[1, CUT]
    assert guarded.columns[0, MATES_FIRST] == free.columns[0, MATES_FIRST] <= 0


def test_who_stands_behind_the_last_but_one_is_offside() -> None:
    defenders = {MATES: {"x": 50.0, "keeper": 1.0}, MATES + 1: {"x": 30.0}, MATES + 2: {"x": 12.0}}
    for x, offside in ((29.0, 0.0), (31.0, 1.0)):
        assert made(defenders | {0: {"x": x}}).columns[0, OFFSIDE] == offside
    assert made({0: {"x": -20.0, "keeper": 1.0}}).columns[0, KEEPER] == 1.0


def test_a_kick_needs_what_the_ball_lacks() -> None:
    """A ball at (0.5, 0) that is to rest needs a kick that gives it (-0.5, 0): 25 of 100, to the left of +y."""
    candidates = made(ball_vx=0.5)
    assert candidates.columns[-1, POWER : POWER + 3] == pytest.approx([0.25, 0.0, 1.0], abs=1e-2)


def test_left_and_right_are_alike() -> None:
    players = {0: {"x": 20.0, "y": 7.0, "vy": 0.2}, MATES: {"x": 15.0, "y": 2.0, "vx": -0.3, "vy": 0.1}}
    mirrored = {
        place: {name: -value if name in ("y", "vy") else value for name, value in known.items()}
        for place, known in players.items()
    }
    one = made(players, aside=0.1, ball_vy=0.2)
    other = made(mirrored, aside=-0.1, ball_vy=-0.2, y=5, sin=-1, ball_y=4)
    flipped = other.velocity * np.array([1.0, -1.0], np.float32)
    for kind in range(KINDS):
        of_kind = np.array(kinds(one)) == kind
        away = np.hypot(*np.moveaxis(one.velocity[of_kind][:, None] - flipped[of_kind][None], 2, 0))
        assert away.min(1).max() < 1e-4
