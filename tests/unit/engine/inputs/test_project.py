"""Inputs of many samples at once: whatever their order and company, the same as of each alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.situations import situations

from teamclone.engine.inputs.layout import BLOCKS, GEOMETRY, OTHER, OTHERS, PARTS, PAST_FRAMES, WIDTH, places
from teamclone.engine.inputs.project import Frames, plans, project
from teamclone.planner.columns import PLAN
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.world.channels import CHANNEL

PLACES, COLUMNS = places(BLOCKS, others=True)


def frames(n: int) -> tuple[Frames, NDArray[np.int64], NDArray[np.int64]]:
    *parts, frame, actor = (part.numpy() for part in situations(n, history=PAST_FRAMES))
    return Frames(*parts), frame, actor


def inputs(made: Frames, frame: NDArray[np.int64], actor: NDArray[np.int64]) -> NDArray[np.float32]:
    return project(made, frame, actor, PLACES, COLUMNS)[0]


def test_parts_lie_one_after_the_other() -> None:
    begins, columns = places(("past", "self"), others=False)
    there = {name: at for name, at in zip(PARTS, begins, strict=True) if at >= 0}
    assert there == {"core": 0, "self": WIDTH["core"], "past": 37, "geometry": 37 + WIDTH["past"]}
    assert columns == 37 + WIDTH["past"] + len(GEOMETRY)
    assert sum(WIDTH.values()) + len(GEOMETRY) + OTHERS * len(OTHER) + 2 + 18 == COLUMNS


def test_samples_may_come_in_any_order_and_share_frames() -> None:
    made, frame, _ = frames(40)
    frame, actor = np.repeat(frame, 11), np.tile(np.arange(11), 40)
    whole = inputs(made, frame, actor)
    assert np.isfinite(whole).all()
    order = np.random.default_rng(0).permutation(len(frame))
    assert (inputs(made, frame[order], actor[order]) == whole[order]).all()
    for row in (0, 17, 250):
        alone = Frames(*(part[frame[row]][None] for part in made))
        assert (inputs(alone, np.zeros(1, np.int64), actor[row : row + 1]) == whole[row]).all()


def test_each_match_is_planned_by_its_own_server() -> None:
    made, frame, actor = frames(60)
    slow = made.server.copy()
    slow[::2, SERVER_FIELD["ball_speed_max"]] = 1.5
    mixed = plans(made._replace(server=slow), frame, actor)
    assert (mixed[1::2] == plans(made, frame, actor)[1::2]).all()
    slow[:, SERVER_FIELD["ball_speed_max"]] = 1.5
    assert (mixed[::2] == plans(made._replace(server=slow), frame, actor)[::2]).all()
    assert not (mixed[::6] == plans(made, frame, actor)[::6]).all()


def test_no_samples_give_no_inputs() -> None:
    made, frame, actor = frames(1)
    assert inputs(made, frame[:0], actor[:0]).shape == (0, COLUMNS)
    assert plans(made, frame[:0], actor[:0]).shape == (0, len(PLAN))


def test_frames_before_have_to_be_there() -> None:
    made, frame, actor = frames(2)
    short = made._replace(**{name: getattr(made, name)[:, :1] for name in ("past_ball", "past_players", "past_known")})
    with pytest.raises(ValueError, match="expected a state with 3 frames before it, got 1"):
        inputs(short, frame, actor)


def test_arrays_of_any_type_and_order_in_memory_will_do() -> None:
    made, frame, actor = frames(5)
    whole = inputs(made, frame, actor)
    other = made._replace(
        players=np.asfortranarray(made.players.astype(np.float64)),
        server=np.broadcast_to(made.server[:1], made.server.shape),
        mode_cycles=made.mode_cycles.astype(np.int64),
    )
    assert (inputs(other, frame, actor) == whole).all()


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e30, 3e9])
def test_whatever_a_log_may_hold_ends_in_numbers_of_the_right_shape(value: float) -> None:
    made, frame, actor = frames(30)
    for channel in CHANNEL.values():
        players = made.players.copy()
        players[:, ::3, channel] = value
        assert inputs(made._replace(players=players), frame, actor).shape == (30, COLUMNS)
