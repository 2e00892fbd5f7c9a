"""`teamclone pipeline`."""

from __future__ import annotations

import shlex
import sys
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer


def pipeline(
    schedule: Annotated[Path, typer.Argument(help="Schedule (TOML): matches to play, settings of the stages.")],
    out: Annotated[
        Path, typer.Option("--out", help="Folder for all that is made; one that was begun is gone on with.")
    ],
    jobs: Annotated[
        int | None, typer.Option("-j", "--jobs", min=1, help="Matches at once; one a processor unless given.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Play and clean on the Dask cluster of this scheduler: tcp://host:port.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result of each stage and match as JSON.")] = False,
) -> None:
    """Play, store, make the dataset, train, evaluate and report. Finished parts are kept."""
    from teamclone.cli.common import print_json, print_table, progress, say, visible
    from teamclone.cli.play import ENDING, LISTENS, failed_before, line_of
    from teamclone.cli.train import reporter
    from teamclone.pipeline import Stage, Watch, load_pipeline, run_pipeline
    from teamclone.system.cluster import executor_of

    asked = load_pipeline(schedule)
    with executor_of(scheduler, jobs=jobs) as executor, progress("pipeline") as bar:
        task = bar.add_task("", total=len(asked.schedule.fixtures))
        warned = False

        def tell(text: str) -> None:
            bar.console.print(visible(text), markup=False, highlight=False, soft_wrap=True)

        def show(stage: Stage, done: int, total: int) -> None:
            nonlocal warned
            if stage is Stage.PLAY and done < total and not warned:
                tell(LISTENS)
                warned = True
            bar.update(task, description=stage, completed=done, total=total)

        report, stages = run_pipeline(
            asked,
            out,
            executor=executor,
            jobs=jobs,
            watch=Watch(
                on_progress=show,
                on_training=reporter(bar, task),
                on_record=lambda record: tell(line_of(record)),
                on_stop=lambda: tell(ENDING),
            ),
        )
    if as_json:
        rows = [
            {"stage": result.stage, "done": result.done, "seconds": round(result.seconds, 2), "text": result.text}
            for result in stages
        ]
        print_json({"stages": rows, **report.to_json()})
    else:
        print_table(
            ("stage", "", "s", ""),
            [
                (result.stage, "done" if result.done else "kept", f"{result.seconds:.1f}", result.text)
                for result in stages
            ],
            numeric=(2,),
        )
        for record in report.failed:
            say(line_of(record))
        if report.failed_before:
            again = f"teamclone play {shlex.quote(str(schedule))} --out {shlex.quote(str(out))} --retry-failed"
            say(f"{failed_before(report)}; try them again by {again}")
    if report.failed:
        raise typer.Exit(1)


@wraps(pipeline)
def run(**options: Any) -> None:
    """Run `pipeline` by the name that it had before."""
    print("teamclone: run is now called pipeline; call teamclone pipeline instead", file=sys.stderr)
    pipeline(**options)
