"""`teamclone live watch`."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.console import RenderableType

_DONE = 6
"""Commands of the newest cycle that the terminal shows."""


def watch(
    run: Annotated[Path, typer.Argument(help="Run folder made by `teamclone train`.")],
    host: Annotated[str, typer.Option(help="Machine that the server runs on; this one unless named.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port of the server for players and monitors.")] = 6000,
    team: Annotated[str | None, typer.Option(help="Watch the team of this name instead of the run's.")] = None,
    side: Annotated[str | None, typer.Option(help="Watch the team on this side instead: left or right.")] = None,
    checkpoint: Annotated[str, typer.Option(help="Which weights.")] = "best-loss",
    save: Annotated[Path | None, typer.Option(help="Keep a game log of what was seen: NAME.rcg.")] = None,
    wait: Annotated[
        float | None, typer.Option(min=0, help="Seconds to wait for a server; for ever if left out.")
    ] = None,
    silence: Annotated[float, typer.Option(min=0.1, help="Seconds without a cycle that end the watch.")] = 30.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print every event as JSON, each on a line.")] = False,
) -> None:
    """Predict every cycle of a match that is being played, and score each prediction one cycle later."""
    import signal
    from threading import Event

    from teamclone.live.watch import WatchConfig
    from teamclone.live.watch import watch as watch_match
    from teamclone.training.run import open_run

    stopped = Event()

    def stop(*_: object) -> None:
        if stopped.is_set():
            raise KeyboardInterrupt
        stopped.set()

    config = WatchConfig(
        host=host,
        port=port,
        team=team,
        side=side,
        save=save,
        wait_s=wait,
        silence_s=silence,
        score_every=10 if sys.stdout.isatty() and not as_json else 100,
    )
    # The first signal ends the watch after the cycle at hand, with its score and whole lines; a second one at once.
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        with _Screen(as_json=as_json) as screen:
            end = watch_match(open_run(run), config, checkpoint=checkpoint, on_event=screen.show, stop=stopped)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if not as_json:
        _print_end(end)


class _Screen:
    """Shows events: as JSON lines, on a terminal as a picture that changes, else as a line now and then."""

    def __init__(self, *, as_json: bool) -> None:
        from rich.console import Console
        from rich.live import Live

        self._as_json = as_json
        self._live: Live | None = None
        if sys.stdout.isatty() and not as_json:
            # Drawn after a score, so that no thread of its own is in the way when a cycle comes.
            self._live = Live(console=Console(highlight=False, markup=False), auto_refresh=False, transient=True)
        self._start: dict[str, Any] = {}
        self._done: dict[str, Any] = {}

    def __enter__(self) -> _Screen:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def show(self, event: dict[str, Any]) -> None:
        """Show an event, see `live.watch.watch`."""
        from teamclone.cli.common import json_line, say

        if self._as_json:
            print(json_line(event), flush=True)
            return
        match event["event"]:
            case "ready":
                without = "" if event["baselines"] else ", without baselines: the dataset of the run is gone"
                say(f"Waiting for {' or '.join(event['teams'])}{without}", file=sys.stderr)
            case "start":
                self._start = event
            case "done":
                self._done = event
            case "score":
                self._draw(event)

    def _draw(self, event: dict[str, Any]) -> None:
        from teamclone.cli.common import say

        if self._live is not None:
            self._live.update(_picture(self._start, self._done, event), refresh=True)
            return
        clone = event["scores"].get("model", {})
        rules = {name: of["accuracy"] for name, of in event["scores"].items() if name != "model"}
        say(
            f"cycle {event['cycle']}: {event['rows']:,} commands, accuracy {_number(clone.get('accuracy'))}"
            + "".join(f", {name} {_number(accuracy)}" for name, accuracy in rules.items())
            + f"; {_number(clone.get('cross_entropy'))} nats; p99 {event['latency'].get('p99_ms', 0.0):.1f} ms"
        )


def _picture(start: dict[str, Any], done: dict[str, Any], score: dict[str, Any]) -> RenderableType:
    """Return what the terminal shows: the score, the latest commands, the most surprising ones."""
    from rich.console import Group
    from rich.text import Text

    from teamclone.cli.common import visible

    goals = " : ".join(map(str, score["goals"] or ()))
    head = f"{start.get('left') or 'nobody'} {goals} {start.get('right') or 'nobody'}, cycle {score['cycle']}"
    latency = score["latency"]
    times = f"prediction after p50 {latency.get('p50_ms', 0):.1f}, p99 {latency.get('p99_ms', 0):.1f} ms"
    latest = [
        f"  {player['unum']:>2} {player['command']} "
        + " ".join(f"{number['value']:.0f} [{number['low']:.0f}, {number['high']:.0f}]" for number in numbers)
        for player in done.get("players", ())[:_DONE]
        for numbers in [player["parameters"].values()]
    ]
    moments = [f"  {_moment(moment)}" for moment in score["moments"][:_DONE]]
    lines = [head, f"{score['rows']:,} commands; {times}", f"done in cycle {done.get('cycle', '-')}:", *latest]
    lines += ["most surprising:", *moments]
    return Group(_scores(score["scores"]), *(Text(visible(line)) for line in lines))


def _scores(scores: dict[str, dict[str, float]]) -> RenderableType:
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for index, name in enumerate(("", "accuracy", "CE, nats", "Brier")):
        table.add_column(name, justify="right" if index else "left")
    for name, of in scores.items():
        figures = (_number(of[key]) for key in ("accuracy", "cross_entropy", "brier"))
        table.add_row("clone" if name == "model" else name, *figures)
    return table


def _print_end(end: dict[str, Any]) -> None:
    """Print the score of the whole match, and how it was come by."""
    from teamclone.cli.common import print_table, say

    why = {"time_over": "the match ended", "silence": "no cycle came any more", "interrupted": "interrupted"}
    say(f"{why[end['ended']]} at cycle {end['cycle']}; {end['rows']:,} commands scored")
    print_table(
        ["", "accuracy", "CE, nats", "Brier"],
        [
            (
                "clone" if name == "model" else name,
                *(_number(of[key]) for key in ("accuracy", "cross_entropy", "brier")),
            )
            for name, of in end["scores"].items()
        ],
        numeric=(1, 2, 3),
    )
    if "parameters" in end:
        print_table(
            ["parameter", "commands", "mean error"],
            [(name, f"{of['rows']:,}", _number(of["mean"], 1)) for name, of in end["parameters"].items() if of["rows"]],
            numeric=(1, 2),
        )
    for moment in end["moments"][:_DONE]:
        say(f"surprising: {_moment(moment)}")
    latency, counts = end["latency"], end["datagrams"]
    if latency["n"]:
        say(
            f"{latency['n']:,} cycles predicted after p50 {latency['p50_ms']:.2f}, p99 {latency['p99_ms']:.2f}, "
            f"at most {latency['max_ms']:.2f} ms; {latency['late']} after more than 5 ms"
        )
    told = ", ".join(f"{counts[name]} {name}" for name in ("frames", "lost", "late", "doubled", "dropped"))
    say(f"datagrams: {told}")
    if end["saved"]:
        say(f"Wrote {end['saved']}")


def _moment(moment: dict[str, Any]) -> str:
    return (
        f"cycle {moment['cycle']}, number {moment['unum']}: {moment['command']} at {moment['probability']:.1%}, "
        f"expected {moment['likeliest']}"
    )


def _number(value: float | None, digits: int = 3) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.{digits}f}"
