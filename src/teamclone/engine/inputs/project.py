"""The inputs of many samples: frames as arrays, and of each sample its frame and actor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone import planner, rcss
from teamclone.engine import inputs
from teamclone.engine.inputs import blocks
from teamclone.engine.inputs.frame import FLAGS, LAST, Frame, fill_frame, new_frame
from teamclone.engine.inputs.layout import PARTS, PAST_FRAMES
from teamclone.engine.inputs.look import Look, look
from teamclone.planner.columns import PLAN
from teamclone.planner.plan import orders_of, plan_scene
from teamclone.planner.scene import BODY, STAMINA, Array
from teamclone.system import compiling
from teamclone.system.compiling import cached_kernel, kernel, tell_when_compiled, version_of
from teamclone.world import channels

(CORE, SELF, ROLE, TYPE, LAST_COMMANDS, VIEW, BALL_SEEN, REACH, LINES, PLAN_SEEN, MATES, OPPONENTS, RIVALS, PAST, MODE,
 AGE_SEEN, GEOMETRY, OTHERS, WAYS) = range(len(PARTS))  # fmt: skip
"""Places of PARTS."""
Places = NDArray[np.int64]


class Frames(NamedTuple):
    """The frames of `world.state.State`, of the same names, shapes and units, as arrays."""

    ball: NDArray[np.float32]
    players: NDArray[np.float32]
    types: NDArray[np.float32]
    server: NDArray[np.float32]
    past_ball: NDArray[np.float32]
    past_players: NDArray[np.float32]
    past_known: NDArray[np.bool_]
    mode: NDArray[np.int64]
    mode_cycles: NDArray[np.float32]


_KINDS = (*[np.float32] * 6, np.bool_, np.int64, np.float32)
"""Types of `Frames`. Kernels are compiled for these alone."""


@kernel
def fill_actor(frame: Frame, view: Look, planned: Array, places: Places, out: blocks.Out) -> None:
    """Fill the columns of a sample that follow from its frame alone, where ``places`` says; the others stay."""
    if places[CORE] >= 0:
        blocks.put_core(frame, view, out, places[CORE])
    if places[SELF] >= 0:
        blocks.put_self(frame, view, out, places[SELF])
    if places[ROLE] >= 0:
        blocks.put_role(view, out, places[ROLE])
    if places[LAST_COMMANDS] >= 0:
        blocks.put_last(frame.more[:, LAST], view.actor, out, places[LAST_COMMANDS])
    if places[VIEW] >= 0:
        blocks.put_view(frame, view, out, places[VIEW])
    if places[BALL_SEEN] >= 0:
        blocks.put_ball(frame, view, out, places[BALL_SEEN])
    if places[REACH] >= 0:
        blocks.put_reach(view, out, places[REACH])
    if places[LINES] >= 0:
        blocks.put_lines(frame, view, out, places[LINES])
    if places[PLAN_SEEN] >= 0:
        blocks.put_plan(planned, out, places[PLAN_SEEN])
    if places[MATES] >= 0:
        blocks.put_mates(frame, view, out, places[MATES])
    if places[OPPONENTS] >= 0:
        blocks.put_opponents(frame, view, out, places[OPPONENTS])
    if places[RIVALS] >= 0:
        blocks.put_rivals(frame, view, out, places[RIVALS])
    if places[AGE_SEEN] >= 0:
        blocks.put_age(frame, view, out, places[AGE_SEEN])
    blocks.put_geometry(frame, view, out, places[GEOMETRY])
    if places[OTHERS] >= 0:
        blocks.put_others(frame, view, out, places[OTHERS])
    if places[WAYS] >= 0:
        blocks.put_ways(planned, out, places[WAYS])


@kernel
def fill_rest(frames: Frames, index: int, frame: Frame, view: Look, places: Places, out: blocks.Out) -> None:
    """Fill the columns of a sample that follow from more than its frame: the type, the frames before, the mode."""
    if places[TYPE] >= 0:
        blocks.put_type(frames.types[index, view.actor], out, places[TYPE])
    if places[PAST] >= 0:
        me, at = frame.scene[view.actor], places[PAST]
        for back in range(PAST_FRAMES):
            ball, players = frames.past_ball[index, back], frames.past_players[index, back]
            known = frames.past_known[index, back]
            at = blocks.put_past(view, me[BODY], me[STAMINA], ball, players, known, out, at)
    if places[MODE] >= 0:
        flags = int(frame.more[view.actor, FLAGS])
        blocks.put_mode(flags, frames.mode[index], frames.mode_cycles[index], out, places[MODE])


@kernel
def fill_inputs(
    frames: Frames, index: int, frame: Frame, actor: int, order: NDArray[np.int64], places: Places, out: blocks.Out
) -> bool:
    """Fill the inputs of an actor, and return whether it may reach the ball with a kick or a tackle.

    Args:
        index: of the frame among ``frames``; ``frame`` is filled with it, see `frame.fill_frame`.
        order: see `kick_sequences.kick_order`. places: see `layout.places`.
    """
    planned = np.zeros(len(PLAN))
    near = blocks.near_the_ball(frame, actor)
    if near and places[PLAN_SEEN] >= 0:
        plan_scene(frame.scene.copy(), actor, order, planned)
    view = look(frame, actor)
    fill_actor(frame, view, planned, places, out)
    fill_rest(frames, index, frame, view, places, out)
    return near


def _compiled() -> Any:
    """Return a kernel that fills the inputs of many samples."""
    version = version_of(inputs, planner, rcss, channels, compiling)

    @cached_kernel(nogil=True, error_model="numpy")
    def project_all(
        frames: Frames,
        samples: NDArray[np.int64],
        orders: NDArray[np.int64],
        which: NDArray[np.int64],
        places: Places,
        out: NDArray[np.float32],
        near: NDArray[np.bool_],
        plans: Array,
    ) -> int:
        frame, now = new_frame(), -1
        for sample in range(len(samples)):
            row, index, actor = samples[sample, 0], samples[sample, 1], samples[sample, 2]
            if index != now:
                fill_frame(frame, frames.ball[index], frames.players[index], frames.types[index], frames.server[index])
                now = index
            order = orders[which[index]]
            if len(plans):
                plans[row] = 0.0
                if blocks.near_the_ball(frame, actor):
                    plan_scene(frame.scene.copy(), actor, order, plans[row])
            else:
                near[row] = fill_inputs(frames, index, frame, actor, order, places, out[row])
        return version

    return project_all


_project_all = _compiled()
tell_when_compiled({_project_all: "compiling the inputs of the network, once (three to four minutes)"})


def as_arrays(frames: Frames) -> Frames:
    """Return frames as the kernels take them: of the types of `Frames`, without gaps in memory."""
    return Frames(*(np.ascontiguousarray(part, kind) for part, kind in zip(frames, _KINDS, strict=True)))


def project(
    frames: Frames, frame: NDArray[np.int64], actor: NDArray[np.int64], places: Sequence[int], columns: int
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return (n, columns) inputs of samples, before normalisation, and (n,) which of the actors are near the ball.

    Args:
        frames: with the frames before, if they are asked for. frame: (n,) of each sample. actor: (n,) 0..10.
        places, columns: see `layout.places`.

    Raises:
        ValueError: the frames have fewer frames before them than the inputs read.
    """
    if places[PAST] >= 0 and frames.past_known.shape[1] < PAST_FRAMES:
        raise ValueError(
            f"expected a state with {PAST_FRAMES} frames before it, got {frames.past_known.shape[1]}; "
            "ask for them: dataset.state(rows, history=model.inputs.history)"
        )
    out, near = np.empty((len(frame), columns), np.float32), np.empty(len(frame), np.bool_)
    if len(frame):
        _project_all(*_arguments(frames, frame, actor), np.array(places), out, near, np.empty((0, len(PLAN))))
    return out, near


def plans(frames: Frames, frame: NDArray[np.int64], actor: NDArray[np.int64]) -> Array:
    """Return (n, len(PLAN)) the plans of actors with the ball, or near it; see `planner.columns.PLAN`.

    Arguments are those of `project`; no frames before are needed.
    """
    made = np.empty((len(frame), len(PLAN)))
    if len(frame):
        nothing = np.empty(0, np.int64), np.empty((0, 0), np.float32), np.empty(0, np.bool_)
        _project_all(*_arguments(frames, frame, actor), *nothing, made)
    return made


def _arguments(frames: Frames, frame: NDArray[np.int64], actor: NDArray[np.int64]) -> tuple[Any, ...]:
    """Return the first arguments of the kernel: samples in the order of their frames, so that each is filled once."""
    frames = as_arrays(frames)
    order = np.argsort(frame, kind="stable")
    return frames, np.stack([order, frame[order], actor[order]], axis=1), *orders_of(frames.server)
