"""`teamclone ingest`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def ingest(
    paths: Annotated[list[Path], typer.Argument(help="Logs (.rcg, .rcl, also .gz, .xz, .zst, .bz2) or folders.")],
    store: Annotated[str, typer.Option(help="A folder or postgresql://USER:PASSWORD@HOST/DATABASE; made if missing.")],
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; one a processor unless given.")] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Work on the Dask cluster of this scheduler: tcp://host:port.")
    ] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Stop at the first file that is not perfect.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Read match logs into a store. Files that were read before and have not changed are skipped."""
    from teamclone.cli.common import print_json, print_table, progress
    from teamclone.store import create_store
    from teamclone.store.ingest import ingest as run
    from teamclone.store.status import FileOutcome
    from teamclone.system.cluster import executor_of

    with executor_of(scheduler, jobs=jobs) as executor, progress("ingest") as bar:
        task = bar.add_task("", total=None)
        report = run(
            paths,
            create_store(store),
            executor=executor,
            jobs=jobs,
            strict=strict,
            on_progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
    if as_json:
        print_json(report.to_json())
    else:
        odd = [status for status in report.files if status.outcome is not FileOutcome.OK]
        if odd:
            print_table(
                ("status", "rows", "first problem"),
                [(status.outcome, status.rows, status.error or status.path) for status in odd],
                numeric=(1,),
            )
        counts = ", ".join(f"{report.count(outcome)} {outcome}" for outcome in FileOutcome)
        print(f"files: {counts}")
        print(
            f"matches: {report.added} added, {report.replaced} replaced, {report.unchanged} there before; "
            f"{report.seconds:.1f} s"
        )
    if report.count(FileOutcome.FAILED):
        raise typer.Exit(1)
