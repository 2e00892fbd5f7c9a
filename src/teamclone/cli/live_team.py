"""`teamclone live team`."""

from __future__ import annotations

import signal
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from teamclone.cli.common import choice, print_json, say
from teamclone.errors import UsageError

if TYPE_CHECKING:
    from teamclone.live.team import Summary

NEEDED = ("catch", "move")
"""Commands without which a clone cannot play a whole match."""

NAMES = "a server takes 1 to 15 letters, digits and signs of _.+-"


def team(
    run: Annotated[Path, typer.Argument(help="Run folder of a clone that was trained on whole matches.")],
    port: Annotated[int, typer.Option(min=1, max=65535, help="The server's port for players.")] = 6000,
    coach_port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="Its port for online coaches; --port + 2 unless given, 0: no coach."),
    ] = None,
    host: Annotated[str, typer.Option(help="The server's host.")] = "127.0.0.1",
    name: Annotated[str | None, typer.Option(help="The team's name; that of the original unless given.")] = None,
    draw: Annotated[
        str, typer.Option(help="What is random: commands, cases (also which of several cases), all (also the numbers).")
    ] = "commands",
    deterministic: Annotated[
        bool, typer.Option("--deterministic", help="Draw nothing: always the likeliest command.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Seed of the draws.")] = 0,
    checkpoint: Annotated[str, typer.Option(help="Which weights.")] = "best-loss",
    connect_s: Annotated[float, typer.Option(min=0, help="Seconds to wait for the server.")] = 60.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Play a match with the clone as a team: eleven players and a coach."""
    from teamclone.protocol.agent import NAME

    if name is not None and not NAME.fullmatch(name):
        raise UsageError(f"--name {name!r}: {NAMES}")
    from teamclone.api import load
    from teamclone.live.decisions import Decisions, Draw
    from teamclone.live.team import Team
    from teamclone.training.line_up import read_line_up

    signal.signal(signal.SIGTERM, _stop)
    clone = load(run, checkpoint=checkpoint)
    if missing := [command for command in NEEDED if command not in clone.commands]:
        raise UsageError(
            f"{run}: this clone knows no {' and no '.join(missing)}, so it cannot play whole matches; make its dataset "
            "with `teamclone dataset --goalkeepers --set-plays --idle` and train it with --preset play"
        )
    clone.model.need_log_view("a full state")
    line_up = read_line_up(clone.run.path)
    called = name or line_up.team
    if not NAME.fullmatch(called):
        raise UsageError(f"{run}: its team is called {called!r}; give a --name: {NAMES}")
    drawn = Draw.NOTHING if deterministic else choice(Draw, draw, option="--draw")
    decisions = Decisions(clone.compiled(), draw=drawn, seed=seed)
    decisions.load()
    playing = Team(
        decisions,
        line_up,
        name=called,
        host=host,
        port=port,
        coach_port=min(port + 2, 65535) if coach_port is None else coach_port,
    )
    usual = signal.getsignal(signal.SIGINT)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, playing.stop)
    try:
        playing.play(connect_s=connect_s)
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)  # what is left is to say what became of it
        signal.signal(signal.SIGINT, usual)
        _report(playing.summary, called, as_json=as_json)


def _stop(*_: object) -> None:
    """End as with Ctrl-C: `teamclone play` ends its teams so."""
    raise KeyboardInterrupt


def _report(summary: Summary, name: str, *, as_json: bool) -> None:
    """Print what became of the match."""
    times = summary.percentiles()
    if as_json:
        document: dict[str, Any] = asdict(summary)
        document |= {"team": name, "answer_ms": times}
        print_json(document)
        return
    if not summary.cycles:
        return
    own, other = summary.scores
    say(f"{name} {own} : {other}, {summary.cycles:,} cycles answered, {summary.missed:,} missed")
    say("answer, ms: " + ", ".join(f"{quantile} {value:.2f}" for quantile, value in times.items()))
