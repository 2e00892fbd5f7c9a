"""`teamclone percepts`."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from teamclone.percepts.agreement import Agreement
    from teamclone.percepts.table import FoundPercepts, KnownAtAge

_OFFLINE_LOG = re.compile(r"-\d+\.ocl(\.\w+)?$")
"""Names of players' logs; their coach writes TEAM-coach.ocl."""


def percepts(
    logs: Annotated[list[Path], typer.Argument(help="Game logs (.rcg, also .gz, .xz, .zst, .bz2) or folders.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Write all of it to NAME.parquet, NAME.csv or NAME.jsonl.")
    ] = None,
    team: Annotated[
        list[str] | None, typer.Option(help="Show and write what players of this team see only; repeatable.")
    ] = None,
    offline_logs: Annotated[
        Path | None,
        typer.Option("--offline-logs", help="Compare with NAME.ocl, which players wrote: a file or a folder."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what is known as JSON.")] = False,
) -> None:
    """Work out what each player saw and believes without the full state: how old it is, how far off, as a file.

    1 if a log failed.
    """
    from teamclone.cli.common import fail, print_json, progress
    from teamclone.logs import find_matches
    from teamclone.percepts.table import percepts_of_logs

    with progress("percepts") as bar:
        task = bar.add_task("", total=None)
        found = percepts_of_logs(
            find_matches(logs),
            out=out,
            teams=team or (),
            offline_logs=_offline_logs(offline_logs) if offline_logs else (),
            on_progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
    failed = [one.error for one in found if one.error is not None]
    written = out is not None and len(failed) < len(found)
    failed += [fault for one in found for fault in one.faults]
    if as_json:
        print_json({"out": str(out) if written else None, "matches": [_as_object(one) for one in found]})
    else:
        for one in found:
            _show(one)
        if written:
            print(f"Wrote {out}")
    if failed:
        fail("; ".join(failed), code=1)


def _offline_logs(place: Path) -> list[Path]:
    from teamclone.errors import UsageError

    paths = sorted(path for path in place.rglob("*") if _OFFLINE_LOG.search(path.name)) if place.is_dir() else [place]
    if not paths:
        raise UsageError(f"{place}: no file TEAM-NUMBER.ocl in it; librcsc's players write them with --offline_logging")
    return paths


def _as_object(one: FoundPercepts) -> dict[str, Any]:
    from dataclasses import asdict

    return {
        "path": str(one.path),
        "match_id": one.match_id,
        "error": one.error,
        "faults": list(one.faults),
        "teams": [asdict(team) for team in one.teams],
        "agreement": {str(path): {**asdict(each), "shares": each.shares()} for path, each in one.agreement.items()},
    }


def _show(one: FoundPercepts) -> None:
    from teamclone.cli.common import print_table

    for team in one.teams:
        print(f"{one.path.name}: field players of {team.team}, {team.cycles:,} player-cycles in play_on")
        print(f"a visual message in {team.messages:.1%} of them")
        print_table(
            ["last seen, cycles ago", "ball", "off by, m", "other players", "off by, m"],
            [(_ages(ball), *_words(ball), *_words(other)) for ball, other in zip(team.ball, team.others, strict=True)],
            numeric=(1, 2, 3, 4),
        )
        print()
    if one.agreement:
        _show_agreement(one.agreement)


def _ages(known: KnownAtAge) -> str:
    from teamclone.percepts.memory import MAX_AGE

    if known.last == MAX_AGE:
        return f"{known.first} or more, or never"
    return f"{known.first}" if known.first == known.last else f"{known.first} to {known.last}"


def _words(known: KnownAtAge) -> tuple[str, str]:
    return f"{known.share:.1%}", "-" if math.isnan(known.error_m) else f"{known.error_m:.2f}"


def _show_agreement(of_players: Mapping[Path, Agreement]) -> None:
    from teamclone.cli.common import print_table
    from teamclone.percepts.agreement import Agreement

    total = sum(of_players.values(), Agreement())
    rows = [(path.name, each) for path, each in of_players.items()] + [("all", total)]
    names = ("cycles", "shown", "distance", "direction", "distance_change", "direction_change")
    print("the same as the players wrote down:")
    print_table(
        ["", "objects", "message or none", *(name.replace("_", " ") for name in names[1:])],
        [(name, f"{each.shown:,}", *(_percent(each.shares()[key]) for key in names)) for name, each in rows],
        numeric=range(1, len(names) + 2),
    )


def _percent(share: float) -> str:
    return "-" if math.isnan(share) else f"{share:.3%}"
