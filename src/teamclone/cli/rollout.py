"""`teamclone rollout`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from teamclone.cli.common import fail, print_json, print_table, progress

_WHO = {
    "samples": "clone, samples",
    "likeliest": "clone, likeliest",
    "last": "go on as in the last cycle",
    "coast": "coast",
    "stand": "stand",
}


def rollout(
    run: Annotated[Path, typer.Argument(help="Run folder made by `teamclone train`.")],
    logs: Annotated[
        list[Path], typer.Argument(help="Game logs, or folders of logs; command logs are found beside them.")
    ],
    out: Annotated[Path | None, typer.Option(help="Folder to write; RUN/rollouts unless given.")] = None,
    team: Annotated[
        str | None, typer.Option(help="The clone plays this team; the one it was trained on unless given.")
    ] = None,
    side: Annotated[str | None, typer.Option(help="It plays the team on this side instead: left or right.")] = None,
    horizon: Annotated[int, typer.Option(min=1, max=1000, help="Cycles ahead.")] = 50,
    samples: Annotated[int, typer.Option(min=1, max=1000, help="Samples of each start.")] = 32,
    starts: Annotated[int, typer.Option(min=1, help="Starts in each match, drawn from its cycles of play_on.")] = 50,
    others: Annotated[
        str, typer.Option(help="The other team: logged, last (goes on as in the last cycle) or clone:RUN.")
    ] = "logged",
    checkpoint: Annotated[str, typer.Option(help="Which weights.")] = "best-loss",
    seed: Annotated[int, typer.Option(min=0, help="Of starts, samples and noise.")] = 0,
    trajectories: Annotated[
        bool, typer.Option("--trajectories", help="Write trajectories.parquet, too: every body, cycle and sample.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print rollouts.json.")] = False,
) -> None:
    """Play a clone many cycles ahead from frames of matches. Exit code 1 if a log failed."""
    from teamclone.errors import UsageError
    from teamclone.logs import find_matches
    from teamclone.models.clone import model_id
    from teamclone.rollouts.files import write_rollouts
    from teamclone.rollouts.run import RolloutConfig, in_matches
    from teamclone.training.run import open_run

    kind, _, other = others.partition(":")
    if kind not in {"logged", "last", "clone"} or (kind == "clone") != bool(other):
        raise UsageError(f"--others {others!r} is unknown, choose one of: logged, last, clone:RUN")
    if team is not None and side is not None:
        raise UsageError("name either a team or a side")
    opened = open_run(run)
    model = opened.load_model(checkpoint).eval()
    config = RolloutConfig(horizon=horizon, samples=samples, starts=starts, others=kind, seed=seed)
    with progress("rollout") as bar:
        task = bar.add_task("", total=None)

        def on_match(path: Path) -> Callable[[], None]:
            bar.update(task, description=path.name)
            return lambda: bar.advance(task)

        found = in_matches(
            model,
            [pair.rcg for pair in find_matches(logs) if pair.rcg is not None],
            config,
            team=(team or opened.team) if side is None else None,
            side=side,
            other=open_run(Path(other)).load_model(checkpoint).eval() if other else None,
            on_match=on_match,
        )
    out = out or run / "rollouts"
    plays = None if side is not None else team or opened.team
    about = {"run": str(run), "checkpoint": checkpoint, "model_id": model_id(model), "team": plays, "others": others}
    document = write_rollouts(out, found, config, about, trajectories=trajectories)
    if as_json:
        print_json(document)
    elif document["ahead"]:
        print_table(*_table(document["ahead"]), numeric=range(1, 50))
        print(f"Wrote {out}")
    failed = [match for match in found if match.error is not None]
    if failed:
        fail("; ".join(str(match.error) for match in failed), code=1)


def _table(ahead: dict[str, Any]) -> tuple[list[str], list[list[str]]]:
    """Return headers and rows: mean final displacement in metres by cycles ahead."""
    cycles = [row["cycles"] for row in ahead["samples"]["players"]]
    headers = ["mean final displacement, m", *(f"{ahead_by} ahead" for ahead_by in cycles)]
    rows = []
    for group in ("players", "ball"):
        for name, who in _WHO.items():
            found = {row["cycles"]: row["fde"] for row in ahead[name][group]}
            rows.append(
                [f"{group}: {who}", *(f"{found[one]:.2f}" if found.get(one) is not None else "" for one in cycles)]
            )
    return headers, rows
