"""`teamclone rollout`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from teamclone.cli.common import fail, print_json, print_table, progress, say

if TYPE_CHECKING:
    from teamclone.rollouts.run import MatchRollouts


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
    ball: Annotated[
        str,
        typer.Option(
            help="free: moved by the players alone; touched: as logged after each touch of the other team; logged: "
            "always as logged."
        ),
    ] = "free",
    from_cycle: Annotated[
        list[int] | None, typer.Option(help="Start from this cycle in place of drawn ones; repeatable.")
    ] = None,
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
    if ball not in {"free", "touched", "logged"}:
        raise UsageError(f"--ball {ball!r} is unknown, choose one of: free, touched, logged")
    opened = open_run(run)
    model = opened.load_model(checkpoint).eval()
    config = RolloutConfig(
        horizon=horizon,
        samples=samples,
        starts=starts,
        others=kind,
        ball=ball,
        cycles=tuple(from_cycle or ()),
        seed=seed,
    )
    plays = None if side is not None else team or opened.team
    paths = [pair.rcg for pair in find_matches(logs) if pair.rcg is not None]
    against = open_run(Path(other)).load_model(checkpoint).eval() if other else None
    found = _watched(partial(in_matches, model, paths, config, team=plays, side=side, other=against))
    out = out or run / "rollouts"
    about = {"run": str(run), "checkpoint": checkpoint, "model_id": model_id(model), "team": plays, "others": others}
    document = write_rollouts(out, found, config, about, trajectories=trajectories)
    if as_json:
        print_json(document)
    elif document["ahead"]:
        print_table(*_table(document["ahead"], ball=ball != "logged"), numeric=range(1, 50))
        print(_realism(document["realism"]))
        say(f"Wrote {out}")
    failed = [match for match in found if match.error is not None]
    if failed:
        fail("; ".join(str(match.error) for match in failed), code=1)


def _watched(roll_out: Callable[..., list[MatchRollouts]]) -> list[MatchRollouts]:
    """Return the roll-outs of matches, behind a progress bar."""
    with progress("rollout") as bar:
        task = bar.add_task("", total=None)

        def on_match(path: Path) -> Callable[[], None]:
            bar.update(task, description=path.name)
            return lambda: bar.advance(task)

        return roll_out(on_match=on_match)


def _realism(scores: dict[str, dict[str, float]]) -> str:
    """Return the realism of the samples between floor and ceiling, in one line."""
    from teamclone.rollouts.run import MOVERS

    names = {name: MOVERS.get(name, name) for name in ("samples", "coast", "last", "other matches")}
    shown = [f"{who} {scores[name]['all']:.3f}" for name, who in names.items() if name in scores]
    return f"realism, 1 is as logged: {', '.join(shown)}"


def _table(ahead: dict[str, Any], *, ball: bool) -> tuple[list[str], list[list[str]]]:
    """Return headers and rows by cycles ahead: mean final displacement in metres, then how many commands agree.

    Args:
        ball: whether there are rows of the ball.
    """
    from teamclone.rollouts.run import MOVERS

    cycles = [row["cycles"] for row in ahead["samples"]["players"]]
    headers = ["mean final displacement, m", *(f"{ahead_by} ahead" for ahead_by in cycles)]
    rows = []
    for group in ("players", "ball") if ball else ("players",):
        for name, who in MOVERS.items():
            found = {row["cycles"]: row["fde"] for row in ahead[name][group]}
            rows.append(
                [f"{group}: {who}", *(f"{found[one]:.2f}" if found.get(one) is not None else "" for one in cycles)]
            )
    agreement = {row["cycles"]: row["agreement"] for row in ahead["likeliest"]["players"]}
    shares = ["" if agreement[one] is None else f"{100 * agreement[one]:.1f} %" for one in cycles]
    rows.append(["commands of the kind that the log has", *shares])
    return headers, rows
