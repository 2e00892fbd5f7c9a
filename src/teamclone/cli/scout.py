"""`teamclone scout`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from teamclone.scout.scout import Report


def scout(
    store: Annotated[str, typer.Argument(metavar="STORE", help="Store with matches of the team, a folder or a URL.")],
    team: Annotated[str, typer.Option(help="Name of the team.")],
    opponent: Annotated[
        list[str] | None, typer.Option(help="Count matches against this opponent only; repeatable.", show_default=False)
    ] = None,
    against: Annotated[
        str | None, typer.Option(help="Your team: its own numbers, from its matches in the store, stand beside.")
    ] = None,
    since: Annotated[
        str | None,
        typer.Option(
            metavar="DATE",
            help="Report the matches from then on, `2026-11-22` or `2026-11-22 11:30`, and what has changed since "
            "those before.",
        ),
    ] = None,
    earlier: Annotated[
        str | None, typer.Option(metavar="STORE", help="Take the matches before from this store.")
    ] = None,
    run: Annotated[
        Path | None,
        typer.Option(help="Run folder made by `teamclone train`: how predictable the team is to its clone."),
    ] = None,
    checkpoint: Annotated[str, typer.Option(help="Which weights of the run.")] = "best-loss",
    predict_matches: Annotated[
        int,
        typer.Option(min=1, help="In how many matches the clone is asked: those it did not learn from, the newest."),
    ] = 10,
    out: Annotated[
        Path,
        typer.Option(help="The HTML file to write; numbers as .json of the same name, replays in a folder beside it."),
    ] = Path("scout.html"),
    replays: Annotated[
        int, typer.Option(min=0, help="Of how many matches, the newest, moments are shown, each with its replay.")
    ] = 3,
    csv: Annotated[Path | None, typer.Option(help="Folder to write each table into, as CSV.")] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes that read matches; one a processor unless given.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Report how a team plays and where it can be hurt, from its matches in a store, as a page of five minutes."""
    from teamclone.cli.common import fail, print_json, progress
    from teamclone.scout.scout import scout_team
    from teamclone.scout.write import write_scout
    from teamclone.store import open_store

    opened = open_store(store)
    with progress("scout") as bar:
        task = bar.add_task("", total=None)

        def telling(work: str, done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, description=work)

        report = scout_team(
            opened,
            team=team,
            opponents=opponent or (),
            against=against,
            since=since,
            earlier=None if earlier is None else open_store(earlier),
            run=run,
            checkpoint=checkpoint,
            most_predicted=predict_matches,
            most_shown=replays,
            jobs=jobs,
            on_progress=telling,
        )
        failed = [
            *report.failed,
            *write_scout(report, out, store=opened, csv_folder=csv, on_progress=telling),
        ]
    if as_json:
        print_json(report.document)
    else:
        show(report)
        print(f"Wrote {out} and {out.with_suffix('.json')}")
    if failed:
        fail("; ".join(failed), code=1)


def show(report: Report) -> None:
    """Print what a report says, section by section."""
    from teamclone.cli.common import visible

    for chapter in report.chapters:
        print(chapter.title)
        for text in (*(claim.text for claim in chapter.findings.claims), *chapter.findings.notes):
            print(visible(f"  {text}"))
