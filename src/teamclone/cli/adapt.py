"""`teamclone adapt`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def adapt(
    base: Annotated[Path, typer.Argument(help="Run folder of the clone to go on from.")],
    dataset: Annotated[Path, typer.Argument(help="Dataset of the new team, made by `teamclone dataset`.")],
    out: Annotated[Path, typer.Option("--out", help="Run folder to make.")],
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="Change one setting of data, train or the loss: train.epochs=4."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Adapt a trained clone to another team, from a few of its matches. The result is a run like any other."""
    from teamclone.cli.train import run_training
    from teamclone.training.adapt import adaptation
    from teamclone.training.run import open_run

    config, start = adaptation(open_run(base), overrides or [])
    run_training(config, dataset, out, base=start, as_json=as_json)
