"""How good a clone is that learned from game logs alone, beside one that learned from command logs, too.

    python benchmarks/sources.py MATCHES --team NAME --out DIR [--unseen NAME] [--test-match TEXT] [--set KEY=VALUE]

MATCHES is a folder of matches with both logs, or a store of them. Both clones learn from the same matches with the same
settings, one from recovered commands, one from logged ones; both are tested on the logged commands of the same test
matches. DIR keeps the datasets and runs: what is there and fits is not made again.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from adapting import store_of

from teamclone.cli.common import print_json, print_table, progress
from teamclone.dataset.build import DatasetConfig, Sources, build_dataset, is_current
from teamclone.dataset.clean import Commands
from teamclone.dataset.reader import open_dataset
from teamclone.errors import TeamcloneError
from teamclone.evaluation.evaluate import evaluate
from teamclone.training.config import Config, differences, load_config
from teamclone.training.loop import train
from teamclone.training.run import Run, is_run, open_run

WANTED = "accuracy within .005, kick direction within 2 degrees"


def trained(config: Config, dataset: Path, folder: Path) -> Run:
    """The run in a folder if it is finished, of this dataset and these settings; else a new one, or the rest of it."""
    data, resume = open_dataset(dataset), False
    if is_run(folder):
        run = open_run(folder)
        if run.dataset_id != data.id or differences(run.config, config):
            sys.exit(f"{folder}: is a run of other data or settings; choose another --out, or remove it")
        if len(run.history()) >= config.train.epochs:
            return run
        resume = True
    with progress("training") as bar:
        task = bar.add_task(folder.name, total=None)
        return train(
            config,
            data,
            folder,
            resume=resume,
            on_progress=lambda done: bar.update(
                task, completed=(done.epoch - 1) * done.batches + done.batch, total=done.epochs * done.batches
            ),
        )


def compare(options: argparse.Namespace) -> dict[str, Any]:
    """Figures of both clones on the splits of the logged dataset."""
    logged = DatasetConfig(
        teams=(options.team,),
        unseen=tuple(options.unseen),
        commands=Commands.RECEIVED,
        source=Sources.LOGGED,
        train_goalkeepers=True,
        test_matches=tuple(options.test_match),
    )
    configs = {"logged": logged, "recovered": replace(logged, source=Sources.RECOVERED)}
    store = store_of(options.matches, options.out, jobs=None)
    for name, config in configs.items():
        folder = options.out / f"dataset-{name}"
        if not (folder.exists() and is_current(folder, config, store)):
            build_dataset(config, store=store, out=folder, replace=folder.exists())
    settings = load_config(options.preset, options.set)
    found: dict[str, Any] = {}
    for name in configs:
        run = trained(settings, options.out / f"dataset-{name}", options.out / f"run-{name}")
        found[name] = evaluate(run, dataset=options.out / "dataset-logged")["splits"]
    return found


def rows_of(found: dict[str, Any]) -> list[tuple[str, ...]]:
    """The table's rows: one for each split and kind of commands learned from."""
    rows = []
    for split in ("test", "unseen"):
        for name, splits in found.items():
            if split not in splits:
                continue
            section = splits[split]
            model, kick = section["model"], section["parameters"]["kick_direction"]
            rows.append(
                (
                    split,
                    name,
                    f"{section['rows']:,}",
                    *(interval(model[figure]) for figure in ("accuracy", "cross_entropy", "ece")),
                    interval(kick["mean"], 1),
                    f"{kick['median']:.1f}",
                    interval(section["parameters"]["dash_power"]["mean"], 2),
                    interval(section["parameters"]["turn_moment"]["mean"], 2),
                )
            )
    return rows


def interval(figure: dict[str, Any], digits: int = 4) -> str:
    """A figure with its interval over matches, where there is one."""
    text = f"{figure['value']:.{digits}f}"
    return text if figure["low"] is None else f"{text} [{figure['low']:.{digits}f}, {figure['high']:.{digits}f}]"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("matches", help="folder of matches with both logs, or a store of them")
    parser.add_argument("--team", required=True)
    parser.add_argument("--out", type=Path, required=True, help="folder for datasets and runs")
    parser.add_argument("--unseen", action="append", default=[])
    parser.add_argument("--test-match", action="append", default=[])
    parser.add_argument("--preset", default="best")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    try:
        found = compare(options)
    except TeamcloneError as error:
        sys.exit(str(error))
    if options.json:
        print_json(found)
        return
    headers = ("split", "learned from", "rows", "accuracy", "CE", "ECE")
    print_table((*headers, "kick direction, deg", "median", "dash power", "turn, deg"), rows_of(found))
    print(f"wanted: {WANTED} of the clone that learned from logged commands")


if __name__ == "__main__":
    main()
