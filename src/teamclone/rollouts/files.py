"""What roll-outs leave in their folder: figures, trajectories, a picture."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from teamclone import __version__
from teamclone.dynamics.bodies import BALL
from teamclone.errors import RunError
from teamclone.plots.fans import draw_fans
from teamclone.plots.style import LIGHT, style
from teamclone.rcss.players import N_TEAM
from teamclone.rollouts.fans import fans_of
from teamclone.rollouts.realism import realism
from teamclone.rollouts.run import MatchRollouts, RolloutConfig, figures
from teamclone.system.documents import read_document, write_document
from teamclone.system.files import write_atomic
from teamclone.system.tables import writing

FORMAT = 2
"""Format number of rollouts.json and fans.json."""
WIDTH = 11.0
"""Of the picture of fans, inches."""
_CODES = {"truth": -1, "likeliest": -2, "stand": -3, "coast": -4, "last": -5}
"""``sample`` of the trajectories that are none."""


def write_rollouts(
    out: Path, matches: Sequence[MatchRollouts], config: RolloutConfig, about: dict[str, Any], *, trajectories: bool
) -> dict[str, Any]:
    """Write ``rollouts.json``, ``fans.json``, ``fans.svg`` and, if asked for, ``trajectories.parquet``.

    Nothing is written if no match was rolled out; what an earlier call left then stays.

    Args:
        about: what else the document should say: run, checkpoint, model_id, team.

    Returns:
        The document.
    """
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
        "realism": realism(matches),
    }
    done = [match for match in matches if match.error is None]
    if not done:
        return document
    out.mkdir(parents=True, exist_ok=True)
    write_document(out / "rollouts.json", document)
    # Those of an earlier call are of other roll-outs.
    for name in ("fans.json", "fans.svg", "trajectories.parquet"):
        (out / name).unlink(missing_ok=True)
    fans = fans_of(done)
    write_document(out / "fans.json", {"format": FORMAT, "fans": fans})
    write_atomic(out / "fans.svg", _picture(fans))
    if trajectories:
        _write_trajectories(out / "trajectories.parquet", done)
    return document


def load_rollouts(folder: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Read ``rollouts.json`` and the fans of `fans_of` back.

    Raises:
        RunError: one is missing, damaged, or of another format.
    """
    document, fans = (
        read_document(
            folder / name, what="roll-outs", number=FORMAT, command="teamclone rollout", error=RunError, shape=shape
        )
        for name, shape in (("rollouts.json", {"model_id": str}), ("fans.json", {"fans": [dict]}))
    )
    return document, fans["fans"]


def _picture(fans: Sequence[dict[str, Any]]) -> bytes:
    """Return the fans as an SVG file of its own."""
    import matplotlib as mpl

    with mpl.rc_context(style(LIGHT)):
        buffer = io.BytesIO()
        draw_fans(fans, colours=LIGHT, width=WIDTH).savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


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
