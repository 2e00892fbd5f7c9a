"""`teamclone report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from teamclone.cli.common import progress


def report(
    run: Annotated[Path, typer.Argument(help="Run folder made by `teamclone train`.")],
    out: Annotated[
        Path | None, typer.Option(help="The HTML file to write; RUN/report.html by default.", show_default=False)
    ] = None,
) -> None:
    """Write one HTML page about a clone: tables, figures, words. Evaluates the clone first where needed."""
    from teamclone.report.page import make_report
    from teamclone.training.run import open_run

    opened = open_run(run)
    with progress("report") as bar:
        task = bar.add_task("", total=None)
        path = make_report(
            opened,
            out=out,
            on_progress=lambda work, done, total: bar.update(task, completed=done, total=total, description=work),
        )
    print(path)
