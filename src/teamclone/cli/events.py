"""`teamclone events`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from teamclone.events.statistics import TeamStatistics
    from teamclone.events.table import FoundEvents, MatchEvents


def events(
    logs: Annotated[list[Path], typer.Argument(help="Logs (.rcg, .rcl, also .gz, .xz, .zst, .bz2) or folders.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Write the events to NAME.parquet, NAME.csv or NAME.jsonl.")
    ] = None,
    kind: Annotated[list[str] | None, typer.Option(help="Write events of this kind only; repeatable.")] = None,
    team: Annotated[
        list[str] | None, typer.Option(help="Write and show the events of the team of this name only; repeatable.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the statistics as JSON.")] = False,
) -> None:
    """Find passes, shots, tackles and all that: statistics of each team, the events as a file. 1 if a log failed."""
    from teamclone.cli.common import choice, fail, print_json, progress
    from teamclone.events.definitions import EventKind
    from teamclone.events.table import events_of_logs
    from teamclone.logs import find_matches

    kinds = [choice(EventKind, one, option="--kind") for one in kind or []]
    with progress("events") as bar:
        task = bar.add_task("", total=None)
        found = events_of_logs(
            find_matches(logs),
            out=out,
            kinds=kinds,
            teams=team or (),
            on_progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
    failed = [one for one in found if one.error is not None]
    written = out is not None and len(failed) < len(found)
    if as_json:
        print_json({"out": str(out) if written else None, "matches": [as_object(one, team or ()) for one in found]})
    else:
        for one in found:
            if one.events is not None:
                show(one.events, team or ())
        if written:
            print(f"Wrote {out}")
    if failed:
        fail("; ".join(str(one.error) for one in failed), code=1)


def as_object(one: FoundEvents, teams: list[str] | tuple[str, ...]) -> dict[str, Any]:
    """Return the object that ``events --json`` prints of a match."""
    made: dict[str, Any] = {"path": str(one.path), "match_id": None, "error": one.error, "events": {}, "teams": []}
    if one.events is not None:
        made |= {
            "match_id": one.events.match_id,
            "events": one.events.counts(),
            "teams": [
                {"name": one.events.team(side), "side": word, **statistics.to_json()}
                for side, word, statistics in sides(one.events, teams)
            ],
        }
    return made


def sides(events: MatchEvents, teams: list[str] | tuple[str, ...]) -> list[tuple[int, str, TeamStatistics]]:
    """Return side, its word and its statistics for the teams of these names, empty for both."""
    statistics = events.statistics()
    both = ((1, "left", statistics.left), (-1, "right", statistics.right))
    return [each for each in both if not teams or events.team(each[0]) in teams]


def show(events: MatchEvents, teams: list[str] | tuple[str, ...]) -> None:
    """Print the statistics of a match as a table, a column for each team."""
    from teamclone.cli.common import print_table
    from teamclone.events.statistics import described

    shown = sides(events, teams)
    if not shown:
        return
    print_table(
        [events.match_id, *(events.team(side) or "nobody" for side, _, _ in shown)],
        [
            (name.replace("_", " "), *(text(getattr(statistics, name), unit) for _, _, statistics in shown))
            for name, unit, _ in described()
        ],
        numeric=range(1, len(shown) + 1),
    )
    print()


def text(value: float, unit: str) -> str:
    """Return a statistic for the table: shares in percent, a dash where there is none."""
    if math.isnan(value):
        return "-"
    if unit == "share":
        return f"{value:.1%}"
    return f"{value:.1f} {unit}" if unit else f"{value:,}"
