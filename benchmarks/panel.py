"""Clones of a panel of teams, as users meet them: several code bases, with and without the full state, few matches.

    python benchmarks/panel.py MATCHES --out DIR [--only NAME ...] [--seeds N] [--jobs N] [--page PAGE]

MATCHES is a folder of logs in which both teams have the full state, with the folders `tournament/` (neither has it) and
`cyrus2014/`. Each entry of the panel is a team in one of these conditions: its dataset is split by whole matches, one
clone is trained with each seed, or adapted from a clone of other teams, and tested on matches that none of them saw.
Entries whose matches are not there are named and left out. What is there in DIR is not done again, so a benchmark that
was interrupted goes on. The page is written anew at the end, from all results that there are.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from fidelity import SITUATIONS, TEST_MATCHES, agreement, by_situation, chunks, situations
from fidelity_page import filled, machines, number, percent, table, value
from measure import Commands
from numpy.typing import NDArray

from teamclone.dataset.layout import Split
from teamclone.dataset.reader import open_dataset
from teamclone.errors import TeamcloneError
from teamclone.evaluation.predict import predict
from teamclone.system.documents import write_document
from teamclone.system.files import write_atomic
from teamclone.system.workers import available_cpus
from teamclone.training.adapt import adaptation
from teamclone.training.config import load_config
from teamclone.training.run import open_run

SEEDS = 3
STORES = {"full": "*.rc[gl]*", "tournament": "tournament/*.rc[gl]*", "all": "**/*.rc[gl]*"}
"""Which logs of MATCHES each store has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """What a clone is to reach: accuracy, cross-entropy in nats, median and mean error of kick direction in degrees."""

    accuracy: float
    cross_entropy: float
    kick_median: float
    kick_mean: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A team in some conditions.

    Attributes:
        view: in words. others: teams that its clones learn beside it.
        store: of STORES. selection: options of `teamclone dataset` beside teams and store.
        preset: to train with. overrides: settings beside it.
        like: the entry whose clones are tested here, in place of own ones.
        base: the entry whose clones are adapted, in place of training fresh ones. goal: None where there is none.
    """

    name: str
    team: str
    view: str
    store: str
    others: tuple[str, ...] = ()
    selection: tuple[str, ...] = ()
    preset: str = "best"
    overrides: tuple[str, ...] = ()
    like: str | None = None
    base: str | None = None
    goal: Goal | None = None

    def adapted(self, base: str) -> Entry:
        """The same team in the same matches, by clones that are adapted from another entry's."""
        view = f"{self.view}; adapted"
        return replace(self, name=f"{self.name}-adapted", view=view, preset="best", like=None, base=base)

    @property
    def data(self) -> str:
        """What its dataset is called; an adapted clone has the one of the entry beside it."""
        return self.name.removesuffix("-adapted")

    @property
    def teams(self) -> str:
        return ", ".join((self.team, *self.others))


def held_out(*matches: str) -> tuple[str, ...]:
    return tuple(part for match in matches for part in ("--test-match", match))


_HELIOS_IN_TOURNAMENT = Goal(accuracy=0.92, cross_entropy=0.19, kick_median=6, kick_mean=18)
_IN_TOURNAMENT = (*held_out("20261128134452", "20261128134549"), "--validation-match", "20261128134050")
_TRAINED = (
    Entry(
        name="helios",
        team="HELIOS_base",
        view="full state",
        store="full",
        selection=("--unseen", "YuShan2024", *held_out(*TEST_MATCHES)),
        goal=Goal(accuracy=0.955, cross_entropy=0.11, kick_median=0, kick_mean=2),
    ),
    Entry(
        name="helios-in-tournament",
        team="HELIOS_base",
        view="tournament, trained with full state",
        store="tournament",
        selection=_IN_TOURNAMENT,
        like="helios",
    ),
    Entry(
        name="helios-tournament",
        team="HELIOS_base",
        view="tournament",
        store="tournament",
        selection=("--percepts", *_IN_TOURNAMENT),
        preset="tournament",
        goal=_HELIOS_IN_TOURNAMENT,
    ),
    Entry(
        name="yushan",
        team="YuShan2024",
        view="tournament",
        store="all",
        selection=("--test", "0.25", "--validation", "0.13"),
        goal=Goal(accuracy=0.88, cross_entropy=0.29, kick_median=12, kick_mean=32),
    ),
    Entry(
        name="webase",
        team="WEBase",
        view="full state",
        store="full",
        goal=Goal(accuracy=0.90, cross_entropy=0.24, kick_median=5, kick_mean=18),
    ),
    Entry(
        name="cyrus2d",
        team="Cyrus2DBase",
        view="full state",
        store="full",
        goal=Goal(accuracy=0.94, cross_entropy=0.15, kick_median=0, kick_mean=12),
    ),
    Entry(
        name="cyrus2014",
        team="CYRUS2014",
        view="full state",
        store="all",
        goal=Goal(accuracy=0.91, cross_entropy=0.22, kick_median=10, kick_mean=25),
    ),
    Entry(
        name="base",
        team="HELIOS_base",
        others=("WEBase", "Cyrus2DBase"),
        view="full state",
        store="full",
        selection=("--unseen", "YuShan2024", *held_out(*TEST_MATCHES)),
    ),
    Entry(
        name="base-without-webase",
        team="HELIOS_base",
        others=("Cyrus2DBase", "YuShan2024"),
        view="full state, YuShan2024 without",
        store="full",
        selection=("--unseen", "WEBase"),
    ),
)
_TRAINED_BY_NAME = {entry.name: entry for entry in _TRAINED}
PANEL = (
    *_TRAINED,
    replace(
        _TRAINED_BY_NAME["helios-in-tournament"].adapted("base"), view="tournament; adapted", goal=_HELIOS_IN_TOURNAMENT
    ),
    _TRAINED_BY_NAME["yushan"].adapted("base"),
    _TRAINED_BY_NAME["cyrus2014"].adapted("base"),
    _TRAINED_BY_NAME["webase"].adapted("base-without-webase"),
)
BY_NAME = {entry.name: entry for entry in PANEL}


def logs(matches: Path, store: str) -> list[Path]:
    """The logs of a store."""
    return sorted(matches.glob(STORES[store]))


class Work:
    """The folder of the benchmark."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options, self.out = options, Path(options.out)
        self.threads = max(1, available_cpus() // options.jobs)

    def commands(self) -> Commands:
        return Commands({self.options.matches: "MATCHES", self.out: "DIR"})

    def _store(self, name: str, commands: Commands) -> Path:
        """A store of some logs, made if it is not there."""
        made = self.out / "stores" / name
        shown = f"ingest MATCHES/{STORES[name]} --store DIR/stores/{name}"
        commands.run("ingest", *logs(self.options.matches, name), "--store", made, made=made, shown=shown)
        return made

    def data(self, entry: Entry, commands: Commands) -> Path:
        """The dataset of an entry, made if it is not there."""
        made = self.out / "datasets" / entry.data
        teams = (part for team in (entry.team, *entry.others) for part in ("--team", team))
        commands.run(
            *("dataset", "--store", self._store(entry.store, commands), *teams, *entry.selection),
            *("--commands", "received", "--train-goalkeepers", "--out", made),
            made=made,
        )
        return made

    def settings(self, entry: Entry, seed: int) -> list[str]:
        """What a clone is trained with, beside its preset; or adapted with, beside the settings of its base."""
        of_preset = () if entry.base else (*entry.overrides, *self.options.set)
        return [*of_preset, f"train.seed={seed}"]

    def run(self, entry: Entry, seed: int, data: Path, commands: Commands) -> Path:
        """The run of an entry, trained and evaluated if it is not; a base is there before.

        Raises:
            SystemExit: a command failed; or the run is there, of other settings.
        """
        run = self.out / "runs" / f"{entry.name}-{seed}"
        ended = self.out / "runs" / f"{entry.name}-{seed}.json"
        settings = self.settings(entry, seed)
        overrides = (*settings, f"train.threads={self.threads}")
        if not ended.is_file():
            shutil.rmtree(run, ignore_errors=True)
        base = self.out / "runs" / f"{entry.base}-{seed}"
        seconds = commands.run(
            *(("adapt", base, data) if entry.base else ("train", data, "--preset", entry.preset)),
            *(part for setting in overrides for part in ("--set", setting)),
            *("--out", run),
            made=ended,
        )
        if seconds is not None:
            write_document(ended, {"seconds": seconds})
        config = adaptation(open_run(base), settings)[0] if entry.base else load_config(entry.preset, settings)
        if replace(open_run(run).config, train=config.train) != config:
            sys.exit(f"{run}: trained with other settings; remove it, or choose another --out")
        commands.run("evaluate", run, made=run / "evaluation.json")
        return run

    def result(self, entry: Entry, seed: int) -> Path:
        """What an entry's clone of a seed reaches: DIR/results/NAME-SEED.json, and the probabilities beside it.

        Raises:
            SystemExit: a command failed; or what is there was made with other settings.
        """
        path, settings = self.out / "results" / f"{entry.name}-{seed}.json", self.settings(entry, seed)
        if entry.base:
            settings = [*self.settings(BY_NAME[entry.base], seed), *settings]
        if path.is_file():
            if json.loads(path.read_text(encoding="utf-8"))["settings"] != settings:
                sys.exit(f"{path}: made with other settings, now {settings}; remove it, or choose another --out")
            return path
        commands = self.commands()
        folder = self.data(entry, commands)
        if entry.like is None:
            run = self.run(entry, seed, folder, commands)
            evaluation = run / "evaluation.json"
        else:
            run = self.out / "runs" / f"{entry.like}-{seed}"
            evaluation = run / f"evaluation-{entry.name}.json"
            commands.run("evaluate", run, "--data", folder, made=evaluation)
        data = open_dataset(folder)
        rows = data.split(Split.TEST)
        outcome = predict(open_run(run).load_model(), data, rows)
        where = np.concatenate([situations(data.state(part)) for part in chunks(rows)])
        path.parent.mkdir(exist_ok=True)
        np.savez(path.with_suffix(".npz"), probabilities=outcome.probabilities, kind=outcome.kind, where=where)
        trained = open_run(run)
        document = json.loads(evaluation.read_text(encoding="utf-8"))
        write_document(
            path,
            {
                "name": entry.name,
                "settings": settings,
                "dataset": data.id,
                "splits": document["splits"],
                "matches": document["dataset"]["matches"],
                "trained": trained.history()[-1],
                "seconds": json.loads((run.parent / f"{run.name}.json").read_text(encoding="utf-8"))["seconds"],
                "machine": trained.environment,
                "commands": commands.shown,
            },
        )
        return path

    def tried(self, entry: Entry, seed: int) -> str | None:
        """Make a result; what went wrong, so that one failure does not stop the others."""
        try:
            print(self.result(entry, seed), file=sys.stderr, flush=True)
        except (SystemExit, TeamcloneError) as error:
            return f"{entry.name}, seed {seed}: {error}"
        return None

    def results(self) -> dict[str, list[dict[str, Any]]]:
        """All results by entry, by seed."""
        found: dict[str, list[dict[str, Any]]] = {}
        for entry in PANEL:
            paths = sorted((self.out / "results").glob(f"{entry.name}-[0-9]*.json"))
            if paths:
                found[entry.name] = [json.loads(path.read_text(encoding="utf-8")) for path in paths]
        return found

    def answers(self, name: str) -> tuple[NDArray[np.floating], NDArray[np.int64], NDArray[np.int64]]:
        """(seeds, n, commands) probabilities of an entry's test rows, (n,) what was done, and (n,) the situation."""
        loaded: list[dict[str, NDArray[Any]]] = []
        for path in sorted((self.out / "results").glob(f"{name}-[0-9]*.npz")):
            with np.load(path) as file:
                loaded.append(dict(file))
        return np.stack([part["probabilities"] for part in loaded]), loaded[0]["kind"], loaded[0]["where"]


def spread(values: Sequence[float], digits: int) -> str:
    """The mean of the seeds, and how far they lie apart where there are several."""
    text = number(float(np.mean(values)), digits)
    return text if len(values) < 2 else f"{text} ± {number((max(values) - min(values)) / 2, digits)}"


def interval(figure: Mapping[str, float], digits: int) -> str:
    return "-" if figure.get("low") is None else f"{figure['low']:.{digits}f} to {figure['high']:.{digits}f}"


HEADERS = (
    "team", "its view", "matches, training / test", "accuracy", "goal", "cross-entropy, nats", "goal", "ECE",
    "kick direction, median, mean error, deg", "goal", "last command, accuracy",
)  # fmt: skip


def figures_of(
    entry: Entry, results: Sequence[Mapping[str, Any]], trained_on: Sequence[Mapping[str, Any]]
) -> list[str]:
    """The row of an entry in the table of figures."""
    tests = [result["splits"]["test"] for result in results]
    model, kicks = [test["model"] for test in tests], [test["parameters"]["kick_direction"] for test in tests]
    goal = entry.goal
    return [
        entry.teams,
        entry.view,
        f"{sum(match['split'] == 'train' for match in trained_on)} / {len(tests[0]['matches'])}",
        spread([value(one["accuracy"]) for one in model], 3),
        f"{goal.accuracy:g}" if goal else "",
        spread([value(one["cross_entropy"]) for one in model], 3),
        f"{goal.cross_entropy:g}" if goal else "",
        spread([value(one["ece"]) for one in model], 4),
        f"{spread([value(one['median']) for one in kicks], 1)}, {spread([value(one['mean']) for one in kicks], 1)}",
        f"{goal.kick_median:g}, {goal.kick_mean:g}" if goal else "",
        number(value(tests[0]["baselines"]["persistence"]["accuracy"]), 3),
    ]


def intervals_of(entry: Entry, result: Mapping[str, Any]) -> list[str]:
    """Intervals over the matches of one seed."""
    test = result["splits"]["test"]
    kick = test["parameters"]["kick_direction"]
    return [
        entry.teams,
        entry.view,
        f"{test['rows']:,}",
        f"{kick['rows']:,}",
        interval(test["model"]["accuracy"], 3),
        interval(test["model"]["cross_entropy"], 3),
        interval(kick["mean"], 1),
    ]


def commands_of(entry: Entry, results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Recall of the rare commands and errors of parameters."""
    tests = [result["splits"]["test"] for result in results]

    def of(part: str, name: str, figure: str, digits: int) -> str:
        return number(float(np.mean([value(test[part][name][figure]) for test in tests])), digits)

    return [
        entry.teams,
        entry.view,
        *(of("commands", kind, "recall", 2) for kind in ("turn", "kick", "tackle")),
        *(of("parameters", name, "mean", 1) for name in ("dash_power", "dash_direction", "turn_moment", "kick_power")),
        *(of("commands", kind, "parameter_log_loss", 2) for kind in ("dash", "turn", "kick")),
    ]


def left_of(entry: Entry, work: Work, results: Sequence[Mapping[str, Any]]) -> list[str]:
    """What is known of an entry's errors: by situation, learned by heart, and what seeds agree on."""
    probabilities, kind, where = work.answers(entry.name)
    by = by_situation(probabilities, kind, where)
    of_seeds = agreement(probabilities, kind)
    several = len(results) > 1
    test = np.mean([value(result["splits"]["test"]["model"]["cross_entropy"]) for result in results])
    trained = np.mean([result["trained"]["train_cross_entropy"] for result in results])
    return [
        entry.teams,
        entry.view,
        *(percent(by[name]["share_of_nats"] if name in by else None) for name in SITUATIONS),
        "" if entry.like else f"{trained:.3f}, {test:.3f}",
        f"{of_seeds['entropy']:.3f}",
        f"{of_seeds['doubt']:.3f}" if several else "",
        percent(of_seeds["systematic"]) if several else "",
    ]


def page(work: Work, results: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """The page of results."""
    entries = [entry for entry in PANEL if entry.name in results]
    seeds = max(map(len, results.values()))
    typed = dict.fromkeys(command for several in results.values() for one in several for command in one["commands"])
    counted = "one seed" if seeds == 1 else f"{seeds} seeds; ± is half of what lies between the lowest and the highest"
    beside = f", with {', '.join(f'`{setting}`' for setting in work.options.set)}" if work.options.set else ""
    parts = [
        "# The panel",
        """How good clones are where users meet them: teams of four code bases, with the full state and as in
tournaments, from as many matches as there are. `make fidelity MATCHES=folder` runs everything and writes this page; no
figure on it is typed by hand.""",
        "## Goals and figures",
        f"""Commands of field players in play_on, whole test matches, presets as in [the commands](#reproduce){beside};
{counted}. `adapted` clones go on from the clone of several teams that has not seen a match of theirs; that of
HELIOS_base from one that knows it with the full state. The goals are those that we set ourselves. [What the figures
mean](figures.md).""",
        table(
            HEADERS,
            [
                figures_of(entry, results[entry.name], results[entry.like or entry.name][0]["matches"])
                for entry in entries
            ],
        ),
        "## Intervals over matches",
        """95 % intervals of the first seed by bootstrap over whole test matches. One match gives none, and from fewer
than ten they are too narrow: take them as the spread seen so far.""",
        table(
            ("team", "its view", "rows", "kicks", "accuracy", "cross-entropy, nats", "kick direction, mean error, deg"),
            [intervals_of(entry, results[entry.name][0]) for entry in entries],
        ),
        "## Commands and parameters",
        "Recall of commands; mean errors in power and degrees; log loss of parameters in nats, lower is better.",
        table(
            (
                *("team", "its view", "turn, recall", "kick, recall", "tackle, recall", "dash power", "dash direction"),
                *("turn", "kick power", "dash, log loss", "turn, log loss", "kick, log loss"),
            ),
            [commands_of(entry, results[entry.name]) for entry in entries],
        ),
        "## What is missing",
        """Where the nats are lost: shares of the cross-entropy by situation. `training, test` is the cross-entropy in
the last epoch, where samples are also shown mirrored, and on test matches: what lies between them could be won by more
matches, what is left in training by other inputs, or by nobody. `own entropy` is the chance that the clones see
themselves. `doubt` is the part of it on which seeds do not agree, and `sure and wrong` the errors that all seeds make
with a confidence of .8 and more.""",
        table(
            (
                *("team", "its view", *SITUATIONS, "training, test", "own entropy"),
                *(("doubt", "sure and wrong") if seeds > 1 else ()),
            ),
            [left_of(entry, work, results[entry.name])[: None if seeds > 1 else -2] for entry in entries],
        ),
        "## Reproduce",
        "```\n" + "\n".join(typed) + "\n```",
        machines(result["machine"] for several in results.values() for result in several),
    ]
    return "\n\n".join(filled(part) for part in parts)


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("matches", type=Path, help="folder of logs")
    made.add_argument("--out", type=Path, required=True, help="folder of the benchmark")
    made.add_argument(
        "--only", nargs="+", default=[entry.name for entry in PANEL], metavar="NAME", help="entries to do"
    )
    made.add_argument("--seeds", type=int, default=SEEDS, help="clones of each entry")
    made.add_argument("--jobs", type=int, default=1, help="trainings side by side; they share the processors")
    made.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="beside every preset")
    made.add_argument("--page", type=Path, help="the page to write; default DIR/panel.md")
    return made


def wanted(options: argparse.Namespace) -> list[Entry]:
    """The entries to do, those whose clones others use first.

    Raises:
        SystemExit: there is no such entry.
    """
    if unknown := sorted(set(options.only) - set(BY_NAME)):
        sys.exit(f"--only: no {', '.join(unknown)}; there are {', '.join(BY_NAME)}")
    chosen = {*options.only, *(BY_NAME[name].like or BY_NAME[name].base for name in options.only)}
    found = []
    for entry in (entry for entry in PANEL if entry.name in chosen):
        load_config(entry.preset, (*entry.overrides, *options.set))  # a wrong setting is reported before the work
        names = [path.name for path in logs(options.matches, entry.store)]
        missing = [team for team in (entry.team, *entry.others) if not any(team in name for name in names)]
        if missing:
            where = f"{options.matches}/{STORES[entry.store]}"
            print(f"{entry.name}: no match of {', '.join(missing)} in {where}", file=sys.stderr)
        elif entry.base and BY_NAME[entry.base] not in found:
            print(f"{entry.name}: nothing to adapt without {entry.base}", file=sys.stderr)
        else:
            found.append(entry)
    return found


def main() -> None:
    options = parser().parse_args()
    entries = wanted(options)
    work = Work(options)
    for entry in entries:
        work.data(entry, work.commands())
    failed = []
    for of_others in (False, True):
        chosen = [entry for entry in entries if bool(entry.like or entry.base) == of_others]
        tasks = [(entry, seed) for seed in range(options.seeds) for entry in chosen]
        with ThreadPoolExecutor(options.jobs) as pool:
            for error in pool.map(lambda task: work.tried(*task), tasks):
                failed += [error] if error else []
    if results := work.results():
        written = options.page or work.out / "panel.md"
        write_atomic(written, (page(work, results) + "\n").encode())
        print(written)
    if failed:
        sys.exit("\n".join(failed))


if __name__ == "__main__":
    try:
        main()
    except TeamcloneError as error:
        sys.exit(f"panel: {error}")
