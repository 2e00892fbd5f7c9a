"""What roll-outs leave in their folder: figures, trajectories, a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from teamclone import __version__
from teamclone.dynamics.bodies import BALL, N_BODIES
from teamclone.evaluation.prediction_file import writing
from teamclone.plots.style import LIGHT, style
from teamclone.rcss.players import N_TEAM
from teamclone.rollouts.run import MatchRollouts, RolloutConfig, figures
from teamclone.system.documents import write_document
from teamclone.system.files import write_atomic

FORMAT = 1
"""Format number of rollouts.json."""
PICTURES = 6
"""Starts in the picture of fans."""
_CODES = {"truth": -1, "likeliest": -2, "stand": -3, "coast": -4, "last": -5}
"""``sample`` of the trajectories that are none."""


def write_rollouts(
    out: Path, matches: Sequence[MatchRollouts], config: RolloutConfig, about: dict[str, Any], *, trajectories: bool
) -> dict[str, Any]:
    """Write ``rollouts.json``, ``fans.svg`` and, if asked for, ``trajectories.parquet``; return the document.

    Args:
        about: what else the document should say: run, checkpoint, team.
    """
    out.mkdir(parents=True, exist_ok=True)
    document = {
        "kind": "teamclone rollouts",
        "format": FORMAT,
        "teamclone": __version__,
        **about,
        "options": asdict(config),
        "matches": [
            {
                "path": match.path.name,
                "match_id": match.match_id,
                "side": "left" if match.side > 0 else "right",
                "starts": len(match.starts),
                "error": match.error,
            }
            for match in matches
        ],
        "ahead": figures(matches),
    }
    write_document(out / "rollouts.json", document)
    # Those of an earlier call are of other roll-outs.
    for name in ("fans.svg", "trajectories.parquet"):
        (out / name).unlink(missing_ok=True)
    done = [match for match in matches if match.error is None]
    if done:
        write_atomic(out / "fans.svg", _fans(done))
        if trajectories:
            _write_trajectories(out / "trajectories.parquet", done)
    return document


def _write_trajectories(path: Path, matches: Sequence[MatchRollouts]) -> None:
    """Write one row a body, cycle and sample; ``sample`` is -1 for what happened, see _CODES."""
    with writing(path) as write:
        for match in matches:
            for name, values in {"truth": match.truth[:, None], **match.places}.items():
                for start in range(len(match.starts)):
                    write(_rows(match, start, name, values[start]))


_SCHEMA = pa.schema(
    [
        ("match_id", pa.string()),
        ("frame", pa.int32()),
        ("cycle", pa.int32()),
        ("ahead", pa.int16()),
        ("sample", pa.int16()),
        ("side", pa.int8()),
        ("unum", pa.uint8()),
        ("x", pa.float32()),
        ("y", pa.float32()),
    ]
)


def _rows(match: MatchRollouts, start: int, name: str, values: NDArray[np.float32]) -> pa.Table:
    """Return the rows of (samples, horizon + 1, 23, 2) places."""
    shape = values.shape[:3]
    sample, ahead, body = (index.ravel() for index in np.indices(shape))
    side = np.where(body == BALL, 0, np.where(body < N_TEAM, 1, -1))
    unum = np.where(body == BALL, 0, body % N_TEAM + 1)
    columns = {
        "match_id": [match.match_id] * len(body),
        "frame": np.full(len(body), match.starts[start]),
        "cycle": np.full(len(body), match.cycles[start]),
        "ahead": ahead,
        "sample": np.full(len(body), _CODES[name]) if name in _CODES else sample,
        "side": side,
        "unum": unum,
        "x": values[..., 0].ravel(),
        "y": values[..., 1].ravel(),
    }
    return pa.table({field.name: pa.array(columns[field.name], field.type) for field in _SCHEMA})


def _fans(matches: Sequence[MatchRollouts]) -> bytes:
    """Draw some starts on the pitch: the samples of the clone's players and of the ball, and where they really went."""
    import io

    import matplotlib as mpl

    mpl.use("svg")
    from matplotlib import pyplot as plt

    from teamclone.plots.pitch import draw_pitch

    # The starts whose play goes on longest, of all matches in turn.
    order = [(match, start) for match in matches for start in np.argsort(-match.reach, kind="stable")[:PICTURES]]
    chosen = sorted(order, key=lambda one: -int(one[0].reach[one[1]]))[:PICTURES]
    with mpl.rc_context(style(LIGHT)):
        figure, axes = plt.subplots(
            (len(chosen) + 1) // 2, 2, figsize=(11, 3.8 * ((len(chosen) + 1) // 2)), squeeze=False
        )
        for at in axes.flat:
            at.set_axis_off()
        for at, (match, start) in zip(axes.flat, chosen, strict=False):
            draw_pitch(at, colour=LIGHT.rule)
            until = int(min(match.reach[start], match.truth.shape[1] - 1)) + 1
            _fan(at, match, start, until)
            at.set_title(f"cycle {match.cycles[start]}, {until - 1} cycles ahead")
        figure.tight_layout()
        buffer = io.BytesIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None})
        plt.close(figure)
    return buffer.getvalue()


def _fan(axes: Any, match: MatchRollouts, start: int, until: int) -> None:
    own = np.append(match.own[start], True)
    for body in range(N_BODIES):
        truth = match.truth[start, :until, body]
        colour = LIGHT.second if body == BALL else LIGHT.accent
        if own[body]:
            for path in match.places["samples"][start, :, :until, body]:
                axes.plot(*path.T, color=colour, linewidth=0.5, alpha=0.25, zorder=2)
            axes.plot(*truth.T, color=LIGHT.ink, linewidth=1.2, zorder=3)
        axes.plot(*truth[0], "o", color=colour if own[body] else LIGHT.muted, markersize=3, zorder=4)
