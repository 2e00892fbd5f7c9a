"""`teamclone search`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from teamclone.cli.common import choice, fail, print_json, print_table, progress
from teamclone.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable

    from teamclone.search.trials import Search, Trial


def search(
    dataset: Annotated[Path, typer.Argument(help="Dataset made by `teamclone dataset`.")],
    out: Annotated[Path, typer.Option("--out", help="Folder of the search to make, or to go on with.")],
    mode: Annotated[str, typer.Option(help="What to search: beam, study or optimisers.")],
    preset: Annotated[str, typer.Option(help="Settings that trials start from.")] = "paper",
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change one setting of all trials: train.epochs=50."),
    ] = None,
    objective: Annotated[str, typer.Option(help="What to look for: accuracy or cross-entropy.")] = "accuracy",
    jobs: Annotated[int, typer.Option(min=1, help="Processes that train at a time.")] = 1,
    beam: Annotated[
        int | None,
        typer.Option(min=1, help="beam: architectures kept after each step; default 3.", show_default=False),
    ] = None,
    iterations: Annotated[
        int | None, typer.Option(min=0, help="beam: steps after the first; default 5.", show_default=False)
    ] = None,
    smallest: Annotated[
        int | None, typer.Option(min=1, help="beam: least width of a layer; default 32.", show_default=False)
    ] = None,
    largest: Annotated[
        int | None, typer.Option(min=1, help="beam: greatest width of a layer; default 1024.", show_default=False)
    ] = None,
    start: Annotated[
        list[str] | None,
        typer.Option(metavar="WIDTHS", help="beam: an architecture to start from, 256,128; repeatable."),
    ] = None,
    trials: Annotated[
        int | None, typer.Option(min=1, help="study: how many trials; default 30.", show_default=False)
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Train many times to find settings: layers, the rest by Optuna, or optimisers compared. Give it again to go on."""
    from teamclone.training.config import load_config

    # Before PyTorch is imported, so that a wrong setting is reported at once.
    base = load_config(preset, overrides or [])

    from teamclone.dataset.reader import open_dataset
    from teamclone.search.run import search as run_search
    from teamclone.search.trials import Objective, SearchConfig, Status
    from teamclone.system.settings import assignment

    options: dict[str, Any] = {
        "beam": beam,
        "iterations": iterations,
        "smallest": smallest,
        "largest": largest,
        "trials": trials,
    }
    options["start"] = tuple(map(_widths, start)) if start else None
    config = SearchConfig(
        base=base,
        held=tuple(sorted({assignment(text)[0] for text in overrides or []})),
        objective=choice(Objective, objective, option="--objective"),
        **_of_mode(mode, options),
    )
    opened = open_dataset(dataset)
    try:
        with progress("search") as bar:
            report = _bar(bar.add_task("", total=None), bar.update) if not bar.disable else _lines()
            found = run_search(config, opened, out, jobs=jobs, on_progress=report)
    except KeyboardInterrupt:
        fail(f"interrupted; all finished trials and epochs are kept in {out}; give the same command to go on", code=130)
    _summary(found, as_json=as_json)
    if not any(trial.status is Status.FINISHED for trial in found.trials):
        fail(f"{out}: every trial failed, the first with: {found.trials[0].error}", code=1)


def _of_mode(mode: str, options: dict[str, Any]) -> dict[str, Any]:
    """Return the mode and the options that were given.

    Raises:
        UsageError: there is no such mode, or it does not have one of the options.
    """
    from teamclone.search.trials import OPTIONS, Mode

    kind = choice(Mode, mode, option="--mode")
    given = {name: value for name, value in options.items() if value is not None}
    if foreign := [f"--{name}" for name in given if name not in OPTIONS[kind]]:
        raise UsageError(f"--mode {kind} has no {', '.join(foreign)}; leave it out")
    return {"mode": kind, **given}


def _widths(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"--start: expected widths like 256,128, got {text!r}") from None


def _settled(search: Search) -> list[Trial]:
    from teamclone.search.trials import SETTLED

    return [trial for trial in search.trials if trial.status in SETTLED]


def _bar(task: int, update: Callable[..., None]) -> Callable[[Search], None]:
    """Show progress as a bar, one step a trial; the trials of a beam search's next step are not known yet."""

    def report(search: Search) -> None:
        from teamclone.search.trials import Mode, Status

        running = [
            f"{trial.name} epoch {len(trial.curve) + 1}" for trial in search.trials if trial.status is Status.RUNNING
        ]
        total = search.config.trials if search.config.mode is Mode.STUDY else len(search.trials)
        update(task, total=total, completed=len(_settled(search)), description=", ".join(running))

    return report


def _lines() -> Callable[[Search], None]:
    """Show progress as lines for a log: one for every trial that ended."""
    reported: set[str] | None = None

    def report(search: Search) -> None:
        nonlocal reported
        settled = _settled(search)
        if reported is None:  # nothing has ended yet but in earlier calls
            reported = {trial.name for trial in settled}
        for trial in settled:
            if trial.name not in reported:
                reported.add(trial.name)
                print(f"{trial.name}: {_line(trial)}", file=sys.stderr, flush=True)

    return report


def _line(trial: Trial) -> str:
    if trial.error:
        return f"failed: {trial.error}"
    figures = trial.figures
    return (
        f"{trial.status} after {figures['epochs']} epochs: accuracy {figures['accuracy']:.4f}  "
        f"cross-entropy {figures['cross_entropy']:.4f}"
    )


def _summary(search: Search, *, as_json: bool) -> None:
    from dataclasses import asdict

    from teamclone.search.trials import Mode

    ranked = search.ranked()
    if as_json:
        trials = [{"run": str(search.path / "trials" / trial.name)} | asdict(trial) for trial in ranked]
        print_json({"search": str(search.path), "mode": search.config.mode, "trials": trials})
        return
    named = search.config.mode is not Mode.STUDY
    rows = []
    for place, trial in enumerate(ranked, 1):
        figures, settings = trial.figures, "" if named else _settings(trial)
        numbers = [f"{figures[name]:.4f}" if figures else "" for name in ("accuracy", "cross_entropy", "loss")]
        counts = [f"{figures[name]:,.0f}" if figures else "" for name in ("weights", "epochs")]
        counts.append(f"{figures['seconds']:,.1f}" if figures else "")
        rows.append([place, trial.name, trial.status, *numbers, *counts, trial.error or settings])
    print_table(
        ("", "trial", "status", "accuracy", "cross-entropy", "loss", "weights", "epochs", "seconds", ""),
        rows,
        title=f"{search.path}: {len(ranked)} trials, best first by {search.config.objective} on the validation matches",
        numeric=(0, 3, 4, 5, 6, 7, 8),
    )
    written = sorted(path.name for path in search.path.glob("search.*"))
    print(f"{search.path} holds {', '.join(written)}, and every trial's run in trials/NAME")


def _settings(trial: Trial) -> str:
    """Return settings as text: ``learning_rate 0.0021, dropout 0.1``."""

    def text(value: Any) -> str:
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    return ", ".join(f"{key.partition('.')[2]} {text(value)}" for key, value in trial.settings.items())
