"""`teamclone bench`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from teamclone.cli.common import print_json, print_table, progress


def bench(
    run: Annotated[Path, typer.Argument(help="Run folder made by `teamclone train`.")],
    n: Annotated[int, typer.Option("-n", "--predictions", min=1, help="Single predictions to time.")] = 20_000,
    data: Annotated[Path | None, typer.Option(help="Take the situations from another dataset.")] = None,
    checkpoint: Annotated[str, typer.Option(help="Which weights.")] = "best-loss",
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Time single answers of a clone on one thread, and answers for 22 players at once."""
    from teamclone.evaluation.latency import measure_run
    from teamclone.training.run import open_run

    opened = open_run(run)
    with progress("bench") as bar:
        task = bar.add_task("", total=n)
        result, path = measure_run(
            opened,
            dataset=data,
            checkpoint=checkpoint,
            n=n,
            on_progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
    if as_json:
        print_json(result)
        return
    keys = ("mean_us", "std_us", "p50_us", "p99_us", "max_us")
    print_table(
        ["one thread", "predictions", "mean", "std", "p50", "p99", "max"],
        [
            (name, f"{row['n']:,}", *(f"{row[key]:,.0f} µs" for key in keys))
            for name, row in (
                ("1 state, PyTorch", result["single"]),
                (f"{result['team']['states']} states, PyTorch", result["team"]),
                ("1 state, kernels", result["kernels"]["single"]),
                (f"{result['team']['states']} states, kernels", result["kernels"]["team"]),
            )
        ],
        numeric=range(1, 7),
    )
    print(f"{result['team']['states_per_second']:,.0f} states/s in batches of {result['team']['states']}")
    print(f"Wrote {path}")
