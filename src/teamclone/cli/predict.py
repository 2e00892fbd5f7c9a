"""`teamclone predict`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from teamclone.cli.common import print_json, print_table, progress


def predict(
    run: Annotated[Path, typer.Argument(help="Run folder made by `teamclone train`.")],
    logs: Annotated[list[Path], typer.Argument(help="Game logs; command logs are found beside them.")],
    out: Annotated[Path, typer.Option("--out", help="File to write: NAME.parquet, NAME.csv or NAME.jsonl.")],
    team: Annotated[str | None, typer.Option(help="Predict the team of this name.")] = None,
    side: Annotated[str | None, typer.Option(help="Predict the team on this side instead: left or right.")] = None,
    checkpoint: Annotated[str, typer.Option(help="Which weights.")] = "best-loss",
    goalkeepers: Annotated[
        bool, typer.Option("--goalkeepers", help="Predict goalkeepers even if the clone does not know catch.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Predict the commands of a team in matches: a row for each player and cycle. Exit code 1 if a log failed."""
    from dataclasses import asdict

    from teamclone.cli.common import fail
    from teamclone.evaluation.prediction_file import predict_logs
    from teamclone.training.run import open_run

    model = open_run(run).load_model(checkpoint)
    with progress("predict") as bar:
        task = bar.add_task("", total=None)
        results = predict_logs(
            model,
            logs,
            out,
            team=team,
            side=side,
            goalkeepers=goalkeepers,
            on_progress=lambda path, done, total: bar.update(task, completed=done, total=total, description=path.name),
        )
    failed = [result for result in results if result.error is not None]
    written = len(failed) < len(results)
    if as_json:
        print_json({"out": str(out) if written else None, "matches": [asdict(result) for result in results]})
    elif written:
        print_table(
            ["log", "rows", "with command", "log loss, nats"],
            [
                (
                    result.path.name,
                    f"{result.rows:,}",
                    f"{result.known:,}",
                    "-" if result.log_loss is None else f"{result.log_loss:.3f}",
                )
                for result in results
                if result.error is None
            ],
            numeric=(1, 2, 3),
        )
        print(f"Wrote {out}")
    if failed:
        fail("; ".join(f"{result.path}: {result.error}" for result in failed), code=1)
