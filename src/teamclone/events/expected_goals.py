"""Expected goals: the chance that a shot scores, from what can be seen in the frame on which it is decided.

A logistic regression on four terms. `benchmarks/expected_goals.py` fits it to matches and writes the file beside this
module; the page on events of the documentation has its figures.
"""

from __future__ import annotations

from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics.formulas import wrap
from teamclone.errors import TeamcloneError
from teamclone.logs.columns import column
from teamclone.logs.match import Columns
from teamclone.rcss import pitch, state_bits
from teamclone.rcss.players import SLOT_SIDES
from teamclone.rcss.playmodes import SITUATION, Situation
from teamclone.system.documents import read_document

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

FORMAT = 1
PATH = Path(str(resources.files("teamclone.events") / "expected_goals.json"))
"""The fitted model: its numbers, the matches that it was fitted to, and how well it did on matches left out."""
FRAME_COLUMNS = ("playmode", "ball_x", "ball_y")
PLAYER_COLUMNS = ("state", "x", "y")
"""Columns of a match's tables that are needed."""

SHADOW_M = 2.0
"""An opponent hides the directions in which the ball would pass it nearer than this."""
_WIDEST_DEG = 90.0
"""At this angle from the far post a goalkeeper is beside the ball, and no better placed than behind it."""

SITUATIONS = (
    column("distance", "float64", "m", "from the ball to the middle of the goal"),
    column("opening", "float64", "deg", "angle between the posts, seen from the ball"),
    column(
        "free_opening",
        "float64",
        "deg",
        f"the part of it that passes all field players of the other team by {SHADOW_M:g} m",
    ),
    column("blockers", "float64", "", "opponents between the ball and the goal, in the triangle of ball and posts"),
    column(
        "opponent_distance",
        "float64",
        "m",
        "from the ball to the nearest opponent but the goalkeeper; infinite where there is none",
    ),
    column("goalkeeper_distance", "float64", "m", "from the ball to the goalkeeper"),
    column("goalkeeper_off_line", "float64", "m", "from the goalkeeper to the goal line"),
    column("goalkeeper_gap", "float64", "deg", "angle between the goalkeeper and the post that is farther from it"),
    column("set_play", "float64", "", "1 in a set play, 0 in play_on"),
)
"""What is known of a place to shoot from: shape (n,). ``situations`` makes them."""

TERMS = ("free_opening", "log_goalkeeper_gap", "log_goalkeeper_distance", "set_play")
"""What the chance depends on, in the order of ``terms``."""

_SHAPE: dict[str, Any] = {
    "intercept": float,
    "coefficients": dict.fromkeys(TERMS, float),
    "shots": int,
    "goals": int,
    "matches": [str],
    "left_out": {"*": {"log_loss": float, "brier": float, "auc": float}},
}


def expected_goals(frames: Columns, players: Columns, *, frame: NDArray[Any], side: NDArray[Any]) -> Floats:
    """Return the chance that a shot scores, (n,); NaN where the log lacks what is needed.

    Nothing of the shot itself enters, so that this is the chance of an average shot from there. Of a moment in which
    nobody shot it is what those who do shoot from such places make of them.

    Args:
        frames: FRAME_COLUMNS, (n_frames,). players: PLAYER_COLUMNS, (n_frames, 22).
        frame: (n,) index of the frame. side: (n,) of the team that shoots, 1 left or -1 right.
    """
    return chance(situations(frames, players, frame=frame, side=side))


# Logs may hold any number as a place.
@np.errstate(all="ignore")
def situations(frames: Columns, players: Columns, *, frame: NDArray[Any], side: NDArray[Any]) -> Columns:
    """Return SITUATIONS, (n,) each, as the team on the side sees them. See `expected_goals` for the arguments.

    All of a row is NaN where the ball or an opponent is nowhere, the other team has no goalkeeper on the field, or the
    play mode is one of no play or of a penalty shoot-out.
    """
    towards = np.asarray(side, np.float64)[:, None]
    ball_x, ball_y = (frames[name][frame][:, None] * towards for name in ("ball_x", "ball_y"))
    away_x, away_y = (players[name][frame] * towards - ball for name, ball in (("x", ball_x), ("y", ball_y)))
    state = players["state"][frame]
    opponent = (towards == -SLOT_SIDES) & ((state & state_bits.STAND) != 0)
    goalkeeper = opponent & ((state & state_bits.GOALIE) != 0)
    outfield = opponent & ~goalkeeper
    to_line = pitch.HALF_LENGTH - ball_x
    post = pitch.GOAL_WIDTH / 2
    low, high = (np.arctan2(y - ball_y, np.maximum(to_line, 0.0)) for y in (-post, post))
    distance, direction = np.hypot(away_x, away_y), np.arctan2(away_y, away_x)
    mode = SITUATION[frames["playmode"][frame]][:, None]
    known = (
        np.isfinite(np.hypot(ball_x, ball_y))
        & (np.isfinite(distance) | ~opponent).all(1, keepdims=True)
        & goalkeeper.any(1, keepdims=True)
        & (mode != Situation.OTHER)
    )
    between = outfield & (direction > low) & (direction < high) & (away_x < to_line)
    off_middle = np.abs(wrap(direction - (low + high) / 2))
    made = {
        "distance": np.hypot(to_line, ball_y),
        "opening": np.degrees(high - low),
        "free_opening": np.degrees(high - low - _hidden(low, high, direction, distance, outfield)),
        "blockers": between.sum(1, keepdims=True),
        "opponent_distance": np.where(outfield, distance, np.inf).min(1, keepdims=True),
        "goalkeeper_distance": _at(goalkeeper, distance),
        "goalkeeper_off_line": _at(goalkeeper, to_line - away_x),
        "goalkeeper_gap": np.degrees((high - low) / 2 + _at(goalkeeper, off_middle)),
        "set_play": mode != Situation.PLAY_ON,
    }
    return {name: np.where(known, values, np.nan)[:, 0] for name, values in made.items()}


def _at(goalkeeper: Bools, values: Floats) -> Floats:
    """Return (n, 1) the values (n, 22) of the goalkeeper; any where there is none."""
    found: Floats = np.take_along_axis(values, goalkeeper.argmax(1)[:, None], 1)
    return found


def _hidden(low: Floats, high: Floats, direction: Floats, distance: Floats, outfield: Bools) -> Floats:
    """Return (n, 1) how much of the angle between the posts players hide, rad.

    Args:
        low, high: (n, 1) directions of the posts, rad. direction, distance: (n, 22) of the players from the ball.
        outfield: (n, 22) whose shadows count.
    """
    half = np.arcsin(SHADOW_M / np.maximum(distance, SHADOW_M))
    start, end = (np.where(outfield, np.clip(edge, low, high), low) for edge in (direction - half, direction + half))
    order = np.argsort(start, axis=1)
    start, end = (np.take_along_axis(edge, order, 1) for edge in (start, end))
    # What shadows that begin before have hidden already counts once.
    before = np.maximum.accumulate(np.concatenate([low, end[:, :-1]], axis=1), axis=1)
    hidden: Floats = np.maximum(end - np.maximum(start, before), 0.0).sum(1, keepdims=True)
    return hidden


def terms(found: Columns) -> Floats:
    """Return (n, len(TERMS)) the terms of situations."""
    gap = np.clip(found["goalkeeper_gap"], 1.0, _WIDEST_DEG)
    distance = np.maximum(found["goalkeeper_distance"], 1.0)
    return np.stack([found["free_opening"], np.log(gap), np.log(distance), found["set_play"]], axis=-1)


def chance(found: Columns) -> Floats:
    """Return (n,) the chance of situations; NaN where they are."""
    intercept, coefficients = _model()
    made: Floats = 1.0 / (1.0 + np.exp(-(intercept + terms(found) @ coefficients)))
    return made


@cache
def _model() -> tuple[float, Floats]:
    """Return the intercept and the coefficients of TERMS."""
    document = read_document(
        PATH,
        what="a model of expected goals",
        number=FORMAT,
        command="python benchmarks/expected_goals.py MATCHES --write",
        error=TeamcloneError,
        shape=_SHAPE,
    )
    return document["intercept"], np.array([document["coefficients"][name] for name in TERMS])
