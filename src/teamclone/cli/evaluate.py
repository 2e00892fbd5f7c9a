"""`teamclone evaluate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from teamclone.cli.common import print_json, print_table, progress, say


def evaluate(
    run: Annotated[Path, typer.Argument(help="Run folder made by `teamclone train`.")],
    data: Annotated[Path | None, typer.Option(help="Evaluate on another dataset than the run's own.")] = None,
    checkpoint: Annotated[str, typer.Option(help="Which weights: best-loss, best-accuracy, last and so on.")] = (
        "best-loss"
    ),
    seed: Annotated[int, typer.Option(help="Seed of the bootstrap.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Measure how good a clone is: on test matches, on unseen opponents, and beside rules without a network."""
    from teamclone.evaluation.evaluate import evaluate_and_save
    from teamclone.training.run import open_run

    opened = open_run(run)
    with progress("evaluate") as bar:
        task = bar.add_task("", total=None)
        result, path = evaluate_and_save(
            opened,
            dataset=data,
            checkpoint=checkpoint,
            seed=seed,
            on_progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
    if as_json:
        print_json(result)
        return
    print_summary(result)
    say(f"Wrote {path}")


def print_summary(evaluation: dict[str, Any]) -> None:
    """Print the figures of an evaluation that fit on a screen."""
    splits = evaluation["splits"]
    say(f"{evaluation['dataset']['team']}, checkpoint {evaluation['run']['checkpoint']}")
    seen = evaluation["dataset"]["trained_on_before"]
    if seen:
        print(f"Caution: {len(seen)} of these matches were in training.")
    print()
    _print_splits(splits)
    for name in [name for name in ("test", "unseen") if name in splits] or list(splits):
        _print_commands(name, splits[name])
        _print_parameters(name, splits[name])
    print()


def _print_splits(splits: dict[str, Any]) -> None:
    """Print the figures of every split beside those of the baselines, and their limits."""
    from teamclone.evaluation.bootstrap import FEW_MATCHES

    figures = (("accuracy", "accuracy", 3), ("cross_entropy", "CE, nats", 3), ("ece", "ECE", 3), ("brier", "Brier", 3))
    rows = []
    for name, split in splits.items():
        size = (name, len(split["matches"]), f"{split['rows']:,}")
        rows.append((*size, "clone", *(_cell(split["model"][key], digits) for key, _, digits in figures)))
        rows += [
            ("", "", "", rule, *(_cell(row[key], digits) for key, _, digits in figures))
            for rule, row in split["baselines"].items()
        ]
    print_table(["split", "matches", "rows", "", *(name for _, name, _ in figures)], rows, numeric=(1, 2, 4, 5, 6, 7))
    if any(len(split["matches"]) == 1 for split in splits.values()):
        print("No interval where a split has one match: matches, not rows, vary independently.")
    if any(1 < len(split["matches"]) < FEW_MATCHES for split in splits.values()):
        print(f"Intervals from fewer than {FEW_MATCHES} matches are too narrow: take them as the spread seen so far.")
    for name, split in splits.items():
        for number, row in split["unseen_numbers"].items():
            print(
                f"{name}: number {number} gives {row['rows']:,} commands (accuracy {row['accuracy']:.3f}) and none in "
                "training: inputs that know players by their number do not know this one."
            )


def _print_commands(name: str, split: dict[str, Any]) -> None:
    """Print the rates of each command in a split, and the figures by situation where there are several."""
    print()
    print_table(
        [name, "given", "predicted", "precision", "recall", "specificity", "F1"],
        [
            (
                command,
                f"{row['support']:,}",
                f"{row['predicted']:,}",
                *(_cell(row[key], 3) for key in ("precision", "recall", "specificity", "f1")),
            )
            for command, row in split["commands"].items()
        ],
        numeric=range(1, 7),
    )
    if "situations" in split:
        print()
        print_table(
            [name, "rows", "accuracy", "CE, nats"],
            [
                (situation, f"{row['rows']:,}", _number(row["accuracy"], 3), _number(row["cross_entropy"], 3))
                for situation, row in split["situations"].items()
            ],
            numeric=range(1, 4),
        )


def _print_parameters(name: str, split: dict[str, Any]) -> None:
    """Print the errors of each parameter in a split, and the log loss where the head has a density."""
    from teamclone.evaluation.metrics import even_log_loss

    print()
    print_table(
        [name, "unit", "commands", "mean error", "median error", "constant guess, mean error"],
        [
            (
                parameter.replace("_", " "),
                row["unit"],
                f"{row['rows']:,}",
                _cell(row["mean"], 1),
                _number(row["median"], 1),
                _number(row["constant"]["mean"], 1),
            )
            for parameter, row in split["parameters"].items()
        ],
        numeric=range(2, 6),
    )
    losses = {command: row["parameter_log_loss"] for command, row in split["commands"].items()}
    if any(loss["value"] is not None for loss in losses.values()):
        print()
        print_table(
            [name, "log loss of its parameters, nats", "even guess"],
            [
                (command, _cell(losses[command], 2), _number(even, 2))
                for command, even in even_log_loss(list(losses)).items()
                if command != "none"
            ],
            numeric=(1, 2),
        )


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _cell(figure: dict[str, float | None], digits: int) -> str:
    text = _number(figure["value"], digits)
    if figure["low"] is None or figure["high"] is None:
        return text
    return f"{text} [{figure['low']:.{digits}f}, {figure['high']:.{digits}f}]"
