"""`teamclone train`."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from teamclone.cli.common import fail, print_json, print_table, progress
from teamclone.errors import TeamcloneError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.progress import Progress as Bar
    from rich.progress import TaskID

    from teamclone.training.config import Config
    from teamclone.training.loop import Progress
    from teamclone.training.run import Base, Run


def _show_preset(name: str | None) -> None:
    if name is not None:
        from teamclone.training.config import preset_text

        typer.echo(preset_text(name), nl=False)
        raise typer.Exit


def train(
    dataset: Annotated[Path, typer.Argument(help="Dataset made by `teamclone dataset`.")],
    out: Annotated[Path, typer.Option("--out", help="Run folder to make, or to go on with.")],
    preset: Annotated[
        str | None,
        typer.Option(help="Settings to start from: best, play, paper or small; default best.", show_default=False),
    ] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change one setting: train.epochs=50.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on where the run in --out stopped.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
    show_preset: Annotated[
        str | None,
        typer.Option(metavar="NAME", is_eager=True, callback=_show_preset, help="Print a preset and stop."),
    ] = None,
) -> None:
    """Train a clone on a dataset. The run folder is all that evaluation and export need."""
    from teamclone.training.config import load_config, override

    if resume and preset is None:
        from teamclone.training.run import open_run

        config = override(open_run(out).config, overrides or [])
    else:  # Before PyTorch is imported, so that a wrong setting is reported at once.
        config = load_config(preset or "best", overrides or [])
    run_training(config, dataset, out, resume=resume, as_json=as_json)


def run_training(
    config: Config, dataset: Path, out: Path, *, resume: bool = False, base: Base | None = None, as_json: bool = False
) -> None:
    """Train on a terminal: progress, what to do after Ctrl-C, a summary at the end."""
    from teamclone.dataset.reader import open_dataset
    from teamclone.training import loop
    from teamclone.training.group import is_first
    from teamclone.training.run import is_run, open_run

    opened = open_dataset(dataset)
    try:
        if not is_first():
            _in_silence(lambda: loop.train(config, opened, out, resume=resume, base=base))
            return
        with progress("train" if base is None else "adapt") as bar:
            report = reporter(bar, bar.add_task("", total=None))
            run = loop.train(config, opened, out, resume=resume, base=base, on_progress=report)
    except KeyboardInterrupt:
        finished = len(open_run(out).history()) if is_run(out) else 0
        again = f"teamclone train {dataset} --out {out} --resume"
        fail(f"interrupted; {finished} finished epochs are kept; go on with `{again}`", code=130)
    _summary(run, as_json=as_json)


def _in_silence(work: Callable[[], object]) -> None:
    """Train without output, as one of several processes of which another reports."""
    try:
        work()
    except TeamcloneError:
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        raise typer.Exit(130) from None


def reporter(bar: Bar, task: TaskID) -> Callable[[Progress], None]:
    """Return a function that shows the progress of a training: a bar, or lines where there is no terminal."""
    return _lines() if bar.disable else _bar(task, bar.update)


def _bar(task: TaskID, update: Callable[..., None]) -> Callable[[Progress], None]:
    """Show progress as a bar, one step a batch."""
    text = ""

    def report(at: Progress) -> None:
        nonlocal text
        if at.record is not None:
            text = _line(at)
        if not at.epoch:
            update(task, total=at.batches, completed=at.batch, description="making the inputs")
            return
        update(
            task,
            total=at.epochs * at.batches,
            completed=(at.epoch - 1) * at.batches + at.batch,
            description=f"epoch {at.epoch}/{at.epochs}  {text}",
        )

    return report


def _lines() -> Callable[[Progress], None]:
    """Show progress as lines for a log: one for every tenth of the epochs, and at least one a minute."""
    reported_at = float("-inf")

    def report(at: Progress) -> None:
        nonlocal reported_at
        if not at.epoch:
            return
        now, tenths = time.monotonic(), 10 * at.epoch // at.epochs - 10 * (at.epoch - 1) // at.epochs
        if at.record is not None and (tenths or now - reported_at > 60):
            reported_at = now
            print(f"epoch {at.epoch}/{at.epochs}: {_line(at)}", file=sys.stderr, flush=True)

    return report


def _line(at: Progress) -> str:
    record = at.record or {}
    return (
        f"loss {record['validation_loss']:.4f}  accuracy {record['validation_accuracy']:.4f}  "
        f"{record['samples_per_s']:,.0f} samples/s"
    )


def _summary(run: Run, *, as_json: bool) -> None:
    history = run.history()
    if as_json:
        best = {
            best.checkpoint: {"figure": best.figure, "epoch": best.epoch, "value": best.value} for best in run.best()
        }
        print_json({"run": str(run.path), "epochs": len(history), "best": best, "last": history[-1]})
        return
    print_table(
        ("checkpoint", "epoch", "figure", "value"),
        [(best.checkpoint, best.epoch, best.figure, f"{best.value:.4f}") for best in run.best()],
        title=f"{run.path}: {len(history)} epochs, {history[-1]['samples_per_s']:,.0f} samples/s",
        numeric=(1, 3),
    )
