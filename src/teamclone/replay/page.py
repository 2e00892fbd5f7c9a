"""One HTML file that plays a match in a browser: no server, no network, nothing in it that a log could run.

Everything of the match, names and messages included, is in one block of base64 that the page's script decodes and shows
as text. The page allows itself no other script than its own, by hash, and no connection.
"""

from __future__ import annotations

import base64
import hashlib
import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from teamclone import __version__
from teamclone.errors import UsageError
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.events.definitions import EventKind
from teamclone.events.find import find_events
from teamclone.logs import Match, read_match
from teamclone.logs.align import slot_of
from teamclone.logs.columns import Source
from teamclone.plots.style import theme_css
from teamclone.rcss import server_params
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.playmodes import PlayMode
from teamclone.replay.channels import of_commands, of_match
from teamclone.replay.events import NOT_LISTED, Event, listed
from teamclone.replay.fans import STEP_M, read_fans
from teamclone.replay.jasmin import write_jasmin
from teamclone.replay.payload import packed
from teamclone.replay.predictions import Predictions, predicted
from teamclone.system.files import write_atomic

if TYPE_CHECKING:
    from teamclone.evaluation.prediction_table import PredictionTable
    from teamclone.store import Store

SCRIPTS = (
    "decode.js",
    "match.js",
    "clock.js",
    "theme.js",
    "camera.js",
    "pitch.js",
    "overlays.js",
    "timeline.js",
    "events.js",
    "panel.js",
    "capture.js",
    "link.js",
    "keys.js",
    "main.js",
)
"""Modules of the page, each after those that it imports."""
MOST_BYTES = 3_000_000
"""Size of a page above which the players' messages are left out."""
Says = tuple[list[int], list[int], list[str]]
"""Frames, as differences, places on the player axis, and words of what players said."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """What `make_replay` wrote.

    Attributes:
        path: of the page. size: its bytes. frames: of the match. events: their number by kind.
        predicted: names of the teams with predictions. notes: what could not be shown, and why, a line each.
    """

    path: Path
    size: int
    frames: int
    events: dict[str, int]
    predicted: tuple[str, ...]
    notes: tuple[str, ...]


def make_replay(
    match: Match | Path | str,
    out: Path | str,
    *,
    store: Store | None = None,
    run: Path | str | None = None,
    teams: Sequence[str] = (),
    checkpoint: str = "best-loss",
    rollouts: Path | str | None = None,
    jasmin: Path | str | None = None,
    home: str | None = None,
    made: Mapping[int, PredictionTable] | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> Replay:
    """Write a match as one HTML file that plays it in a browser.

    What the log lacks is left out of the page: commands, stamina, a team.

    Args:
        match: a match; the path of its game log, beside which the command log is found; or, with ``store``, the id of a
            match of it.
        out: the file to write.
        store: where ``match`` is an id.
        run: a run whose clone's predictions are shown beside what happened; None for none.
        teams: the teams that are predicted, by name or as ``left`` and ``right``; empty for those that the clone
            learned from.
        checkpoint: which weights of the run.
        rollouts: ``fans.json`` or ``trajectories.parquet`` of `teamclone rollout`, whose fans of futures are shown.
        jasmin: where to write the match for the 3-D player JaSMIn, too.
        home: address of the page that the replay belongs to, as seen from it; None for the report of the run, if it
            lies beside.
        made: predictions of the run by side, 1 left or -1 right, that are there already; see
            ``replay.predictions.predicted``.
        on_progress: called with the predictions made and their number.

    Returns:
        What was written.

    Raises:
        LogError: the log cannot be read.
        UsageError: the log has no frame; a team is named that does not play.
        StoreError: the store has no such match. RunError: the run or the roll-outs cannot be read.
    """
    columns, says = _read(match, store)
    if not len(columns.frames["cycle"]):
        raise UsageError(
            f"match {columns.match_id}: expected frames to show, the log has none; name its game log (.rcg)"
        )
    expected = Predictions()
    if run is not None:
        from teamclone.training.run import open_run

        expected = predicted(
            open_run(Path(run)), columns, teams=teams, checkpoint=checkpoint, made=made, on_progress=on_progress
        )
    fans = [] if rollouts is None else read_fans(Path(rollouts), columns)
    events = listed(find_events(columns.frames, columns.players, columns.params), columns.frames)
    path = Path(out)
    if home is None and run is not None and path.parent.resolve() == Path(run).resolve():
        home = "report.html"
    page, notes = _page(columns, expected, fans=fans, events=events, says=says, home=home)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(path, page)
    if jasmin is not None:
        write_jasmin(Path(jasmin), columns)
    counts = Counter(event.kind.value for event in events)
    return Replay(
        path=path,
        size=len(page),
        frames=len(columns.frames["cycle"]),
        events={kind.value: counts[kind.value] for kind in EventKind if counts[kind.value]},
        predicted=tuple(str(getattr(columns, side)) for side in expected.of),
        notes=notes,
    )


def _read(match: Match | Path | str, store: Store | None) -> tuple[MatchColumns, Says]:
    """Return the columns of a match, and what its players said."""
    if store is not None:
        if isinstance(match, Match):
            raise UsageError("expected the id of a match of the store, got a match; leave out the store")
        columns = MatchColumns.of_store(store, str(match))
        texts = columns.commands["text"]
        return columns, _says(columns, lambda index: str(texts[index] or ""))
    read = match if isinstance(match, Match) else read_match(match)
    columns = MatchColumns.of(read)
    return columns, _says(columns, read.command_text)


def _says(columns: MatchColumns, text_of: Callable[[int], str]) -> Says:
    commands = columns.commands
    said = np.flatnonzero(
        (commands["kind"] == CommandKind.SAY) & (commands["frame"] >= 0) & (commands["unum"] > 0) & commands["valid"]
    )
    said = said[np.argsort(commands["frame"][said], kind="stable")]
    slot = slot_of(commands["side"][said], commands["unum"][said])
    return np.diff(commands["frame"][said], prepend=0).tolist(), slot.tolist(), [text_of(int(at)) for at in said]


def _page(
    match: MatchColumns,
    expected: Predictions,
    *,
    fans: list[dict[str, Any]],
    events: Sequence[Event],
    says: Says,
    home: str | None,
) -> tuple[bytes, tuple[str, ...]]:
    """Return the page and the notes on it; ``home``: address of the page that it belongs to."""
    channels = [
        *of_match(match.frames, match.players),
        *of_commands(match.frames, match.players, match.commands, match.params),
        *expected.channels,
    ]
    notes = [*expected.notes, *_notes(match, {channel.name for channel in channels})]
    head = {**_head(match, expected, fans=fans, events=events), "home": home}
    page = _assembled(packed({**head, "says": says, "notes": notes}, channels))
    if len(page) > MOST_BYTES and says[0]:
        notes.append("What players said is left out: with it the page would be larger than 3 MB.")
        page = _assembled(packed({**head, "says": ([], [], []), "notes": notes}, channels))
    return page, tuple(notes)


def _notes(match: MatchColumns, channels: set[str]) -> list[str]:
    """Return what the log lacks."""
    notes = []
    if "kind" not in channels:
        notes.append("The log has no commands, and its frames do not imply them.")
    elif match.source is Source.RECOVERED:
        notes.append("There is no command log: commands are those that the game log implies.")
    elif "argument0" not in channels:
        notes.append("There is no command log: of the commands only their kind is known.")
    if np.isnan(match.players["stamina"]).all():
        notes.append("Logs of this version have no stamina.")
    notes += [f"No team on the {side}." for side in ("left", "right") if not getattr(match, side)]
    return notes


def _head(
    match: MatchColumns, expected: Predictions, *, fans: list[dict[str, Any]], events: Sequence[Event]
) -> dict[str, Any]:
    """Return what the page knows of the match beside its channels."""

    def parameter(name: str) -> float | None:
        return _finite(server_params.number(match.params, name, version=server_params.OLDEST))

    return {
        "teamclone": __version__,
        "match": match.match_id,
        "left": match.left,
        "right": match.right,
        "frames": len(match.frames["cycle"]),
        "playmodes": [mode.name.lower() for mode in PlayMode],
        "commands": [kind.name.lower() for kind in CommandKind],
        "recovered": match.source is Source.RECOVERED,
        "server": {
            name: parameter(name)
            for name in ("stamina_max", "effort_dec_thr", "ball_size", "ball_decay", "recover_dec_thr")
        },
        "types": {name: [_finite(value) for value in match.types[name]] for name in FIELDS},
        "kinds": [kind.value for kind in EventKind if kind not in NOT_LISTED],
        "events": [list(asdict(event).values()) for event in events],
        "predictions": expected.about if expected.of else None,
        "fans": {"step": STEP_M, "of": fans},
    }


def _finite(value: float) -> float | None:
    """Return a number as JSON has it; None for one that JSON has not."""
    return round(float(value), 5) if math.isfinite(value) else None


def _assembled(data: bytes) -> bytes:
    """Return the page around the data."""
    assets = resources.files(__package__).joinpath("assets")
    script = joined({name: assets.joinpath(name).read_text("utf-8") for name in SCRIPTS})
    style = theme_css() + assets.joinpath("page.css").read_text("utf-8")
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; img-src data: blob:; "
        "media-src blob:; base-uri 'none'; form-action 'none'"
    )
    page = assets.joinpath("page.html").read_text("utf-8")
    for name, text in (
        ("policy", policy),
        ("style", style),
        ("script", script),
        ("data", base64.b64encode(data).decode("ascii")),
    ):
        page = page.replace(f"{{{{ {name} }}}}", text, 1)
    return page.encode()


def joined(modules: dict[str, str]) -> str:
    """Return JavaScript modules as one script: without their imports and exports, so names must differ between them."""
    parts = []
    for name, text in modules.items():
        body = re.sub(r"^import \{[^}]*\} from \"\./\w+\.js\";\n", "", text, flags=re.MULTILINE)
        parts.append(f"// {name}\n{re.sub(r'^export ', '', body, flags=re.MULTILINE)}")
    return '"use strict";\n(() => {\n' + "\n".join(parts) + "})();\n"


def _hash(text: str) -> str:
    """Return the source expression by which a Content-Security-Policy allows an inline element of this text."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}"
