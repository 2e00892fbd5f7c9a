"""`teamclone play`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from teamclone.play.record import Record
    from teamclone.play.runner import PlayReport
    from teamclone.play.schedule import Schedule

SHOWN = 20
"""Failed matches that are listed."""
COUNTS = ("holes", "clashes", "missed")
LISTENS = (
    "teamclone: the servers of matches listen on all addresses of this machine; unshare -rn or a firewall closes them "
    "(documentation: Play matches, The network)"
)
ENDING = "teamclone: ending the matches that are being played; those that are over stay"


def play(
    out: Annotated[Path, typer.Option("--out", help="Folder for the matches; one that was begun is gone on with.")],
    schedule: Annotated[
        Path | None, typer.Argument(help="Schedule (TOML): teams, pairings, options of the server.")
    ] = None,
    left: Annotated[
        str | None,
        typer.Option(help="Instead of a schedule: command that starts a team, or folder with a start script."),
    ] = None,
    right: Annotated[str | None, typer.Option(help="The other team.")] = None,
    matches: Annotated[int, typer.Option("-n", "--matches", min=1, help="Matches of --left and --right.")] = 1,
    server: Annotated[str | None, typer.Option(help="With --left and --right: the server's program.")] = None,
    options: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="With --left and --right: an option of the server."),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option("-j", "--jobs", min=1, help="Matches at once; one a processor unless given.")
    ] = None,
    store: Annotated[str | None, typer.Option("--ingest", help="Add each match to this store as it ends.")] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Play on the Dask cluster of this scheduler: tcp://host:port.")
    ] = None,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Try matches again that failed in an earlier call.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Play matches on rcssserver, unattended. Given again, the command plays the missing ones."""
    from teamclone.cli.common import fail, print_json, progress, visible
    from teamclone.play.runner import play as run
    from teamclone.store import create_store
    from teamclone.system.cluster import executor_of

    asked = _asked(schedule, left, right, matches=matches, server=server, options=options or [])
    with executor_of(scheduler, jobs=jobs) as executor, progress("play") as bar:
        total = len(asked.fixtures)
        task = bar.add_task("", total=total)
        warned = False

        def tell(text: str) -> None:
            bar.console.print(visible(text), markup=False, highlight=False, soft_wrap=True)

        def count(done: int, total: int) -> None:
            nonlocal warned
            if done < total and not warned:
                tell(LISTENS)
                warned = True
            bar.update(task, completed=done, total=total)

        try:
            report = run(
                asked,
                out,
                store=None if store is None else create_store(store),
                executor=executor,
                jobs=jobs,
                retry_failed=retry_failed,
                on_progress=count,
                on_record=lambda record: tell(f"{int(bar.tasks[task].completed) + 1} of {total}: {line_of(record)}"),
                on_stop=lambda: tell(ENDING),
            )
        except KeyboardInterrupt:
            done = int(bar.tasks[task].completed)
            fail(f"interrupted, {done} of {total} matches are over; the same command plays the others", code=130)
    if as_json:
        print_json(report.to_json())
    else:
        print_report(report)
    if report.failed:
        raise typer.Exit(1)


def _asked(
    schedule: Path | None, left: str | None, right: str | None, *, matches: int, server: str | None, options: list[str]
) -> Schedule:
    """Return the schedule that the options of the command ask for."""
    from teamclone.cli.common import values_of
    from teamclone.errors import UsageError
    from teamclone.play.schedule import load_schedule, quick_schedule

    if (schedule is None) == (left is None and right is None):
        raise UsageError("give a schedule, or --left and --right")
    if schedule is not None:
        if server or options or matches != 1:
            raise UsageError(
                "--server, --set and --matches go with --left and --right; a schedule has these settings itself"
            )
        return load_schedule(schedule)
    if left is None or right is None:
        raise UsageError("--left and --right need each other")
    return quick_schedule(left, right, matches=matches, server=server or "rcssserver", options=values_of(options))


def line_of(record: Record) -> str:
    """Return a line about the outcome of a match."""
    if record.trouble is not None:
        return f"{record.id}: failed after {record.attempt} attempts: {record.trouble.fault}: {record.trouble.text}"
    left, right = record.left, record.right
    started = {"left": left, "right": right}
    lost = [side.team for name, side in started.items() if side.coach is False and f"{name}-coach" in record.commands]
    coaches = f", without the coach of {' and of '.join(lost)}" if lost else ""
    return f"{record.id}: {left.name} {left.score} : {right.score} {right.name}, {record.seconds:.0f} s{coaches}"


def print_report(report: PlayReport) -> None:
    """Print pairings with the outcomes of their matches, then the failed ones."""
    from teamclone.cli.common import print_table, say

    pairings: dict[tuple[str, str], list[Record]] = {}
    for record in report.records:
        pairings.setdefault((record.left.team, record.right.team), []).append(record)
    rows = []
    for (left, right), records in pairings.items():
        whole = [record for record in records if record.complete]
        sides = [side for record in whole for side in (record.left, record.right)]
        rows.append(
            (
                f"{left} : {right}",
                len(records),
                len(whole),
                len(records) - len(whole),
                f"{sum(record.left.score for record in whole)} : {sum(record.right.score for record in whole)}",
                *(_per_match(sum(sum(getattr(side, name) or ()) for side in sides), whole) for name in COUNTS),
                _per_match(sum(record.seconds for record in whole), whole),
            )
        )
    heads = ("left : right", "matches", "complete", "failed", "goals", *(f"{name}/match" for name in COUNTS), "s/match")
    print_table(heads, rows, numeric=range(1, 9))
    failed = report.failed
    for record in failed[:SHOWN]:
        say(line_of(record))
    if len(failed) > SHOWN:
        print(f"and {len(failed) - SHOWN} more that failed")
    rate = f", {3600 * report.played / report.seconds:.0f} an hour" if report.played else ""
    print(
        f"matches: {len(report.records) - len(failed)} complete, {len(failed)} failed, {report.played} played now; "
        f"{report.seconds:.1f} s{rate}"
    )
    if report.failed_before:
        print(f"{failed_before(report)}; with --retry-failed the same command tries them again")


def failed_before(report: PlayReport) -> str:
    """Return a sentence on the matches that were not tried again."""
    number = report.failed_before
    return f"{number} failed in an earlier call and {'was' if number == 1 else 'were'} not tried again"


def _per_match(total: float, matches: list[Record]) -> str:
    return f"{total / len(matches):.1f}" if matches else "-"
