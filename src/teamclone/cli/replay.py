"""`teamclone replay`."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from teamclone.cli.common import print_json, progress, say


def replay(
    match: Annotated[
        str, typer.Argument(help="Game log, beside which the command log is found; with --store the id of a match.")
    ],
    out: Annotated[Path, typer.Option(help="The HTML file to write.")],
    run: Annotated[
        Path | None, typer.Option(help="Run folder made by `teamclone train`: shows what its clone predicts.")
    ] = None,
    team: Annotated[
        list[str] | None,
        typer.Option(
            help="Predict the team of this name, or left or right; repeatable. Unless given, those that the clone "
            "learned from."
        ),
    ] = None,
    checkpoint: Annotated[str, typer.Option(help="Which weights of the run.")] = "best-loss",
    rollouts: Annotated[
        Path | None, typer.Option(help="fans.json or trajectories.parquet of `teamclone rollout`: shows the futures.")
    ] = None,
    store: Annotated[
        str | None,
        typer.Option(help="Take the match from this store: a folder or postgresql://USER:PASSWORD@HOST/DATABASE."),
    ] = None,
    jasmin: Annotated[
        Path | None, typer.Option(help="Write the match for the 3-D player JaSMIn, too (.replay).")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")] = False,
) -> None:
    """Write a match as one HTML file that plays it in a browser, with what a clone predicted beside what happened."""
    from teamclone.replay.page import make_replay
    from teamclone.store import open_store

    with progress("replay") as bar:
        task = bar.add_task("", total=None)
        made = make_replay(
            match,
            out,
            store=None if store is None else open_store(store),
            run=run,
            teams=tuple(team or ()),
            checkpoint=checkpoint,
            rollouts=rollouts,
            jasmin=jasmin,
            on_progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
    if as_json:
        print_json(asdict(made))
        return
    for note in made.notes:
        say(f"teamclone: {note}", file=sys.stderr)
    say(str(made.path))
