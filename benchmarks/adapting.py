"""How few matches of a team are enough: a clone of other teams adapted to it, beside a fresh network.

    python benchmarks/adapting.py MATCHES --base RUN --team NAME [--matches 1 2 3 5 10] [--json]

MATCHES is a folder of logs, or a store that `teamclone ingest` made. RUN is a clone of other teams, best one that never
met these matches: test matches that it was trained on are reported. The training matches of the team are taken in
one order for all, so that the 3 hold the 1; validation matches, which choose the checkpoint, and test matches are the
same for all. The fresh network is the base's, with normalisation fitted and weights drawn anew; it goes through as many
batches of the same size, so that it takes the same time; its learning rate is that with which the base was trained.
Seconds are of a whole training, inputs and validation included.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from teamclone.cli.common import print_json, print_table, progress
from teamclone.dataset.build import DatasetConfig, build_dataset
from teamclone.dataset.clean import Commands
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.dataset.write import write_dataset
from teamclone.errors import TeamcloneError
from teamclone.evaluation import metrics
from teamclone.evaluation.predict import predict
from teamclone.models.clone import Clone
from teamclone.store import Store, create_store, open_store
from teamclone.store.ingest import ingest
from teamclone.training.adapt import CHECKPOINT, adaptation
from teamclone.training.config import Config
from teamclone.training.loop import train
from teamclone.training.run import Base, open_run


def store_of(matches: str, folder: Path, *, jobs: int | None) -> Store:
    """The store at ``matches``, or a new one with the logs there."""
    if matches.startswith("postgresql://") or (Path(matches) / "store.json").is_file():
        return open_store(matches)
    store = create_store(folder / "store")
    ingest([Path(matches)], store, jobs=jobs)
    return store


def part(dataset: Dataset, matches: np.ndarray, folder: Path) -> Dataset:
    """The same with only the training samples of some matches, given by their index."""
    every = np.arange(len(dataset))
    kept = (dataset.samples["split"].numpy() != Split.TRAIN) | np.isin(dataset.match(every).numpy(), matches)
    write_dataset(
        folder,
        frames={name: array.numpy() for name, array in dataset.frames.items()},
        samples={name: array.numpy()[kept] for name, array in dataset.samples.items()},
        player_types=dataset.player_types.numpy(),
        meta={"team": dataset.meta["team"], "matches": dataset.matches},
    )
    return open_dataset(folder)


def figures(model: Clone, dataset: Dataset, split: Split) -> dict[str, float]:
    outcome = predict(model, dataset, dataset.split(split))
    scores = metrics.scores(metrics.measure(outcome)[1].total())
    return {"accuracy": float(scores.accuracy), "cross_entropy": float(scores.cross_entropy)}


def learned(config: Config, dataset: Dataset, folder: Path, *, base: Base | None, split: Split) -> dict[str, float]:
    """Seconds of a training, and how good its best epoch is."""
    began = time.perf_counter()
    run = train(config, dataset, folder, base=base)
    seconds = time.perf_counter() - began
    return {"seconds": seconds, **figures(run.load_model("best-loss"), dataset, split)}


def curve(options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    run = open_run(options.base)
    adapted, base = adaptation(run, options.set)
    fresh = replace(adapted, train=replace(adapted.train, learning_rate=run.config.train.learning_rate))
    wanted = DatasetConfig(
        teams=(options.team,),
        unseen=tuple(options.unseen),
        commands=Commands(options.commands),
        test_matches=tuple(options.test_match),
        validation_matches=tuple(options.validation_match),
        seed=options.seed,
    )
    store = store_of(options.store, folder, jobs=options.jobs)
    build_dataset(wanted, store=store, out=folder / "all", jobs=options.jobs)
    dataset = open_dataset(folder / "all")
    split = Split[options.split.upper()]
    used = {each: np.unique(dataset.match(dataset.split(each)).numpy()) for each in Split}
    for each in (Split.TRAIN, Split.VALIDATION, split):
        if not len(used[each]):
            sys.exit(f"no {each.name.lower()} match of {options.team} in {options.store}; give it more matches")
    order = np.random.default_rng(options.seed).permutation(used[Split.TRAIN])
    counts = [count for count in sorted(set(options.matches)) if count <= len(order)]
    met = {dataset.matches[index]["match_id"] for index in used[split]} & set(base.origin["trained_on"] or ())
    result: dict[str, Any] = {
        "team": options.team,
        "base": base.origin,
        "split": split.name.lower(),
        "rows": len(dataset.split(split)),
        "matches": [dataset.matches[index]["name"] for index in used[split]],
        "met_by_base": sorted(met),
        "training_matches": len(order),
        "unadapted": figures(run.load_model(CHECKPOINT), dataset, split),
        "curve": [],
    }
    # The first training of a process compiles.
    short = replace(
        adapted,
        data=replace(adapted.data, batches_per_epoch=1, validation_batches=1),
        train=replace(adapted.train, epochs=1),
    )
    result["environment"] = train(
        short, part(dataset, order[:1], folder / "first"), folder / "warm", base=base
    ).environment
    with progress("adapting") as bar:
        task = bar.add_task("", total=2 * len(counts))
        for count in counts:
            few = part(dataset, order[:count], folder / f"{count}")
            row: dict[str, Any] = {"matches": count, "samples": len(few.split(Split.TRAIN))}
            for name, config, start in (("adapted", adapted, base), ("fresh", fresh, None)):
                row[name] = learned(config, few, folder / f"{name}-{count}", base=start, split=split)
                bar.advance(task)
            result["curve"].append(row)
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store", metavar="MATCHES", help="a folder of logs, or a store")
    parser.add_argument("--base", type=Path, required=True, help="run of other teams")
    parser.add_argument("--team", required=True, help="the team to adapt to")
    parser.add_argument("--matches", type=int, nargs="+", default=[1, 2, 3, 5, 10], help="how many to train on")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="as of `teamclone adapt`")
    parser.add_argument("--split", choices=("test", "unseen", "validation"), default="test", help="what to test on")
    parser.add_argument("--unseen", action="append", default=[], help="as of `teamclone dataset`, as are these:")
    parser.add_argument("--test-match", action="append", default=[])
    parser.add_argument("--validation-match", action="append", default=[])
    parser.add_argument("--commands", choices=[each.value for each in Commands], default=Commands.EXECUTED.value)
    parser.add_argument("--seed", type=int, default=0, help="of the split and of the order of the training matches")
    parser.add_argument("--jobs", type=int)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    options = parser.parse_args()
    if min(options.matches) < 1:
        parser.error(f"--matches: expected numbers from 1, got {min(options.matches)}")
    try:
        with tempfile.TemporaryDirectory() as name:
            result = curve(options, Path(name))
    except TeamcloneError as error:
        sys.exit(str(error))
    if options.json:
        print_json(result)
        return

    def cells(row: dict[str, float]) -> tuple[str, ...]:
        seconds = f"{row['seconds']:.1f} s" if "seconds" in row else ""
        return seconds, f"{row['accuracy']:.4f}", f"{row['cross_entropy']:.4f}"

    print_table(
        (
            *("training matches", "samples"),
            *("adapted", "accuracy", "CE, nats"),
            *("fresh", "accuracy", "CE, nats"),
        ),
        [
            ("0", "0", *cells(result["unadapted"]), "", "", ""),
            *(
                (row["matches"], f"{row['samples']:,}", *cells(row["adapted"]), *cells(row["fresh"]))
                for row in result["curve"]
            ),
        ],
        title=f"{options.team} on {len(result['matches'])} {result['split']} match(es), {result['rows']:,} commands",
        numeric=range(8),
    )
    if result["met_by_base"]:
        print(f"The base was trained on {len(result['met_by_base'])} of these matches, seen from the other side.")
    if max(options.matches) > result["training_matches"]:
        print(f"There are {result['training_matches']} training matches.")


if __name__ == "__main__":
    main()
