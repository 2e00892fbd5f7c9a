"""How faithful a clone is: baselines, presets, what each part gains, and why it stops; then writes the results page.

    python benchmarks/fidelity.py MATCHES --out DIR [--only c,t,b,a,k,f,d,e,g] [--page docs/explanation/fidelity.md]

MATCHES is a folder of logs. Steps, in the order in which --only names them:

    c  preset best, three seeds          f  learning curve over 1, 2, 5, 10 and all training matches
    b  preset paper, eight minutes       d  preset best without each of its parts, on a shorter schedule
    a  rules, gradient-boosted trees     e  remedies for rare commands, on the same shorter schedule
    k  what the layers of a kick know    g  what is left: from the results of c and f
    t  preset best, otherwise trained

--only also takes single results by name. Each result is a file DIR/results/NAME.json; what is there is not done again,
and a training that was interrupted goes on. The page is written anew at the end from the results that there are.
"""

from __future__ import annotations

import argparse
import json
import platform
import re
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import fidelity_page
import numpy as np
import torch
from kicks import EXACT, EXACT_DEG, as_planned, kicked, plans, tackles_as_planned
from measure import cost_of
from numpy.typing import NDArray

import teamclone
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import open_dataset
from teamclone.dataset.write import write_dataset
from teamclone.engine.inputs.layout import BLOCKS
from teamclone.engine.inputs.reach import reach_ball
from teamclone.errors import TeamcloneError
from teamclone.evaluation import baselines, metrics
from teamclone.evaluation.describe import describe
from teamclone.evaluation.evaluate import count_training
from teamclone.evaluation.predict import predict, truth
from teamclone.evaluation.predictions import Predictions
from teamclone.models.clone import parameter_count
from teamclone.models.config import FAMILIES, of_targets
from teamclone.models.inputs.egocentric import EgocentricFeatures
from teamclone.planner.columns import CHOICES
from teamclone.rcss.commands import CLONED, PARAMETERS
from teamclone.system.documents import write_document
from teamclone.system.machine import processor
from teamclone.system.settings import assignment
from teamclone.training.config import Config, config_from, load_config, to_table
from teamclone.training.run import is_run, open_run
from teamclone.world.state import State

FORMAT = 1
"""Of the result files; raised whenever they would be misread."""
TEST_MATCHES = ("20261122110359", "20261122112951")
STEPS = "ctbakfdeg"
SEEDS = (0, 1, 2)
PAPER_MINUTES = 8.0
SHORT_EPOCHS = 6
"""Of the schedule on which variants are compared."""
CURVE = (1, 2, 5, 10)
TREE_ROWS = 200_000
TREE_ITERATIONS = 200
CHUNK = 16384
"""Rows whose states are made at once; bounds memory."""
SURE = 0.8
"""Confidence from which an error that all seeds make counts as systematic."""

PLANLESS = (
    "model.blocks=self,role,type,last,ball,reach,lines",
    "model.kick_blocks=self,type,last,ball,reach,lines",
)
"""The preset's blocks without what is planned with the ball."""
PLAIN = (
    PLANLESS[0],
    "model.kick_blocks=self,type,last,ball,reach,lines,mates,opponents,rivals",
    "model.kick_attention=0",
    "model.extra_kicks=0",
    "train.optimiser=adam",
    "data.mirror=0.0",
)
"""Nothing planned, kicks without attention, samples as they are, Adam: what changes none of these is compared with
these settings, which take a third of the time."""
TRAINING: dict[str, tuple[str, ...]] = {
    "adam": ("train.optimiser=adam",),
    "without-mirror": ("data.mirror=0.0",),
}
"""How the preset is trained: name and settings beside its own, in its full length; what keeps a network from learning
its matches by heart pays in the last epochs only."""
KICKS: dict[str, tuple[str, ...]] = {
    "without-plan": PLANLESS,
    "plan-of-kicks": PLANLESS[:1],
    "without-attention": ("model.kick_attention=0",),
    "without-kicks": ("model.extra_kicks=0",),
}
"""What may be known of plans with the ball and of the other players, and how often kicks are shown: name and settings
beside the preset's."""
REMEDIES: dict[str, tuple[str, ...]] = {
    "oversample": ("train.balance=oversample", "train.balance_strength=0.5"),
    "undersample": ("train.balance=undersample", "train.balance_strength=0.5"),
    "weights": ("train.balance=weights", "train.balance_strength=0.5"),
    "weights-uncorrected": (
        "train.balance=weights",
        "train.balance_strength=0.5",
        "train.prior_correction=false",
    ),
    "mirror": ("data.mirror=0.5",),
    "ensemble": ("model.ensemble_size=3",),
    "without-temperature": ("train.calibrate=false",),
}
"""Remedies for rare commands: name and settings beside those of the short schedule."""

TINY = (
    *("data.batch_size=512", "data.batches_per_epoch=4", "data.validation_batches=2", "model.hidden=[32]"),
    "train.epochs=1",
)
"""Settings of --quick, for the paper's network too."""
TINY_EGOCENTRIC = ("model.kick_hidden=[16]", "model.parameter_hidden=[16]", "model.target_hidden=[32]")


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """One training: its result's name, the step it belongs to, and what it is trained with.

    Attributes:
        preset: settings to start from. overrides: those changed.
        matches: how many training matches; None for all.
    """

    name: str
    step: str
    preset: str
    overrides: tuple[str, ...]
    matches: int | None = None

    @property
    def settings(self) -> dict[str, Any]:
        """All that decides its result, beside the dataset."""
        return {"config": to_table(load_config(self.preset, self.overrides)), "matches": self.matches}


def without(blocks: Sequence[str], *names: str) -> str:
    return ",".join(block for block in blocks if block not in names)


def with_effect(overrides: tuple[str, ...]) -> tuple[str, ...]:
    """Return the overrides of `best` without those that another family or no target points leave without effect."""
    values = dict(assignment(text) for text in overrides)
    family = FAMILIES[values.get("model.family", "egocentric")]
    known = {"family", *(item.name for item in fields(family))}
    if values.get("model.target_points") == 0:
        known -= {*of_targets(family)}
    return tuple(text for text in overrides if not text.startswith("model.") or text[6:].partition("=")[0] in known)


def ablations() -> dict[str, tuple[str, ...]]:
    """`plain` without each of its parts, and with those it leaves out: name and settings beside PLAIN."""
    model = load_config("best", PLAIN).model
    found: dict[str, tuple[str, ...]] = {}
    for block in dict.fromkeys((*model.blocks, *model.kick_blocks)):
        found[f"without-{block}"] = tuple(
            f"model.{name}={without(getattr(model, name), block)}"
            for name in ("blocks", "kick_blocks")
            if block in getattr(model, name)
        )
    for block in ("view", "past", "plan"):
        if block not in model.blocks:
            found[f"with-{block}"] = (f"model.blocks={','.join((*model.blocks, block))}",)
    found["without-targets"] = ("model.target_points=0",)
    found["point-head"] = ("model.family=egocentric-point",)
    found["gelu" if model.activation != "gelu" else "relu"] = (
        f"model.activation={'gelu' if model.activation != 'gelu' else 'relu'}",
    )
    return found


def experiments(*, n_train: int, scale: float, short_epochs: int, quick: bool) -> list[Experiment]:
    """All trainings, for so many training matches.

    Args:
        scale: of all lengths, minutes and epochs. short_epochs: before scaling. quick: tiny networks, an epoch each.
    """
    tiny = (*TINY, *TINY_EGOCENTRIC) if quick else ()

    def epochs(count: float) -> tuple[str, ...]:
        return () if quick else (f"train.epochs={max(1, round(count * scale))}",)

    usual = load_config("best").train.epochs
    full = (*tiny, *(epochs(usual) if scale != 1 else ()))
    made = [
        Experiment(
            name=f"best-{seed}",
            step="c",
            preset="best",
            overrides=(*full, f"train.seed={seed}"),
        )
        for seed in SEEDS
    ]
    made += [
        Experiment(name=name, step="t", preset="best", overrides=(*full, *changes))
        for name, changes in TRAINING.items()
    ]
    minutes = (f"train.max_minutes={PAPER_MINUTES * scale:g}",)
    made.append(Experiment(name="paper", step="b", preset="paper", overrides=TINY if quick else minutes))
    short = (*tiny, *epochs(short_epochs))
    for count in (count for count in CURVE if count < n_train):
        made.append(
            Experiment(name=f"curve-{count}", step="f", preset="best", overrides=(*short, *PLAIN), matches=count)
        )
    # Beside which the others of k stand, and those of d and e; the second is the last point of f, too.
    made.append(Experiment(name="short", step="k", preset="best", overrides=short))
    made.append(Experiment(name="plain", step="def", preset="best", overrides=(*short, *PLAIN)))
    for step, beside, variants in (("k", (), KICKS), ("d", PLAIN, ablations()), ("e", PLAIN, REMEDIES)):
        made += [
            Experiment(name=name, step=step, preset="best", overrides=with_effect((*short, *beside, *changes)))
            for name, changes in variants.items()
        ]
    return made


class Work:
    """The folder of a benchmark, its dataset, and what is done with it."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.out: Path = options.out
        (self.out / "results").mkdir(parents=True, exist_ok=True)
        (self.out / "answers").mkdir(exist_ok=True)
        self.commands: list[list[str]] = []
        self._prepare()

    def teamclone(self, *arguments: object) -> list[str]:
        return [sys.executable, "-m", "teamclone", *map(str, arguments)]

    def _prepare(self) -> None:
        """The store and the dataset, if they are not there."""
        options, store, folder = self.options, self.out / "store", self.out / "dataset"
        split = [part for match in options.test_match for part in ("--test-match", match)]
        unseen = [part for name in options.unseen for part in ("--unseen", name)]
        ingest = self.teamclone("ingest", options.matches, "--store", store)
        build = self.teamclone(
            *("dataset", "--store", store, "--team", options.team, *unseen),
            *("--commands", "received", "--train-goalkeepers", *split, "--out", folder),
        )
        self.commands += [ingest, build]
        if not folder.is_dir():
            cost_of(*ingest)
            cost_of(*build)
        self.dataset = open_dataset(folder)
        wanted, made = list(options.test_match), list(self.dataset.meta["options"]["test_matches"])
        if wanted != made:
            sys.exit(f"{folder}: made with the test matches {made}, got {wanted}; choose another --out")
        self.rows = np.concatenate([self.dataset.split(split) for split in (Split.TEST, Split.UNSEEN)])
        if not len(self.rows):
            sys.exit(f"{folder}: no test and no unseen matches; give more matches")

    @cached_property
    def counted(self) -> baselines.Baselines:
        return count_training(self.dataset)

    @cached_property
    def training_matches(self) -> list[int]:
        """Indices of the training matches, opponents taking turns, those with most matches first."""
        by_opponent: dict[str, list[int]] = {}
        used = np.unique(self.dataset.match(self.dataset.split(Split.TRAIN)).numpy())
        for index in used.tolist():
            by_opponent.setdefault(self.dataset.matches[index]["opponent"], []).append(index)
        turns = [
            (turn, -len(found), name, index) for name, found in by_opponent.items() for turn, index in enumerate(found)
        ]
        return [index for *_, index in sorted(turns)]

    @cached_property
    def sets(self) -> dict[str, NDArray[np.bool_]]:
        """Masks of ``rows``: the test matches by opponent, and the unseen opponents' matches together."""
        split = self.dataset.samples["split"].numpy()[self.rows]
        match = self.dataset.match(self.rows).numpy()
        opponent = np.array([row["opponent"] for row in self.dataset.matches], object)[match]
        found = {
            f"test {name}": (split == Split.TEST) & (opponent == name)
            for name in sorted(set(opponent[split == Split.TEST]), reverse=True)
        }
        if (split == Split.UNSEEN).any():
            found["unseen"] = split == Split.UNSEEN
        return found

    @cached_property
    def columns(self) -> tuple[EgocentricFeatures, torch.Tensor]:
        """All blocks of inputs of ``rows``, (n, columns): they cost more than a network's answers, so once for all."""
        features = EgocentricFeatures(BLOCKS, others=True)
        made = torch.empty(len(self.rows), len(features.names))
        start = 0
        for part in chunks(self.rows):
            made[start : start + len(part)] = features.project(self.dataset.state(part, history=features.history))
            start += len(part)
        return features, made

    def inputs_of(self, features: EgocentricFeatures) -> torch.Tensor:
        """(n, columns) what features of some blocks project of ``rows``."""
        everything, made = self.columns
        place = {name: index for index, name in enumerate(everything.names)}
        return made[:, [place[name] for name in features.names]]

    def figures(self, outcome: Predictions) -> dict[str, Any]:
        """Of all sets: ``all`` field players, and ``2-11`` of them by number."""
        numbered = self.dataset.samples["player"].numpy()[self.rows] >= 1
        return {
            name: {
                who: self._section(outcome.rows(mask & chosen))
                for who, chosen in (("all", np.ones_like(numbered)), ("2-11", numbered))
            }
            for name, mask in self.sets.items()
        }

    def _section(self, outcome: Predictions) -> dict[str, Any]:
        section = describe(outcome, baselines=self.counted, matches=self.dataset.matches)
        kept = {key: section[key] for key in ("rows", "model", "commands", "parameters", "confusion")}
        return {**kept, "matches": len(section["matches"])}

    def folder_of(self, count: int | None) -> Path:
        """Of the dataset with so many training matches; None for all."""
        return self.out / ("dataset" if count is None else f"dataset-{count}")

    def subset(self, count: int) -> Path:
        """A dataset whose training matches are the first so many, with the same validation matches."""
        folder = self.folder_of(count)
        if folder.is_dir():
            return folder
        data, kept = self.dataset, self.training_matches[:count]
        split, match = data.samples["split"].numpy(), data.match(np.arange(len(data))).numpy()
        rows = np.flatnonzero((split == Split.VALIDATION) | ((split == Split.TRAIN) & np.isin(match, kept)))
        names = ("team", "options", "matches")
        return write_dataset(
            folder,
            frames={name: array.numpy() for name, array in data.frames.items()},
            samples={name: array.numpy()[rows] for name, array in data.samples.items()},
            player_types=data.player_types.numpy(),
            meta={name: data.meta[name] for name in names if name in data.meta},
        )

    def result(self, name: str, settings: dict[str, Any], make: Callable[[], dict[str, Any]]) -> None:
        """Make a result that is not there.

        Raises:
            SystemExit: it is there, of other settings.
        """
        path = self.out / "results" / f"{name}.json"
        if path.is_file():
            self.check(name, settings)
            print(f"{name}: done before", file=sys.stderr)
            return
        print(f"{name} ...", file=sys.stderr, flush=True)
        machine = {
            "processor": processor(),
            "threads": torch.get_num_threads(),
            "python": platform.python_version(),
            "torch": torch.__version__,
            "numpy": np.__version__,
            "teamclone": teamclone.__version__,
        }
        head = {"format": FORMAT, "name": name, "settings": self.all_of(settings)}
        write_document(path, {**head, **make(), "machine": machine})

    def all_of(self, settings: dict[str, Any]) -> dict[str, Any]:
        return {**settings, "dataset": self.dataset.id}

    def check(self, name: str, settings: dict[str, Any]) -> None:
        """Whether a result that is there was made with these settings.

        Raises:
            SystemExit: with others.
        """
        path = self.out / "results" / f"{name}.json"
        found, wanted = json.loads(path.read_text(encoding="utf-8")), self.all_of(settings)
        if found.get("format") != FORMAT or _whole(found.get("settings", {})) != _whole(wanted):
            sys.exit(
                f"{path}: made with other settings ({found.get('settings')}, now {wanted}); "
                "remove it, or choose another --out"
            )

    def load(self) -> dict[str, dict[str, Any]]:
        """All results by name."""
        found = {}
        for path in sorted((self.out / "results").glob("[!.]*.json")):
            result = json.loads(path.read_text(encoding="utf-8"))
            if result["format"] != FORMAT:
                sys.exit(f"{path}: format {result['format']}, this version reads {FORMAT}; remove it")
            found[result["name"]] = result
        return found

    def train(self, experiment: Experiment) -> dict[str, Any]:
        """Train, answer and measure."""
        folder, data = self.out / "runs" / experiment.name, self.folder_of(experiment.matches)
        if experiment.matches is not None:
            self.subset(experiment.matches)
        config = load_config(experiment.preset, experiment.overrides)
        ended = self.out / "runs" / f"{experiment.name}.json"
        if not ended.is_file() or not _is_of(folder, config, data):
            ended.unlink(missing_ok=True)
            before = 0.0
            # A resumed run would count its minutes afresh.
            if config.train.max_minutes or not _is_of(folder, config, data):
                shutil.rmtree(folder, ignore_errors=True)
            if is_run(folder):
                before = sum(record["seconds"] for record in open_run(folder).history())
                cost = cost_of(*self.teamclone("train", data, "--out", folder, "--resume"))
            else:
                cost = cost_of(*self.training(experiment))
            write_document(ended, {"seconds": before + cost.wall, "peak_bytes": cost.peak})
        run = open_run(folder)
        model = run.load_model()
        inputs = self.inputs_of(model.features) if isinstance(model.features, EgocentricFeatures) else None
        outcome = predict(model, self.dataset, self.rows, inputs=inputs)
        if experiment.step == "c":
            np.savez(self.out / "answers" / f"{experiment.name}.npz", probabilities=outcome.probabilities)
        best = {row.checkpoint: row.epoch for row in run.best()}
        return {
            **json.loads(ended.read_text(encoding="utf-8")),
            "epochs": len(run.history()),
            "best_epoch": best.get("best-loss"),
            "weights": parameter_count(model),
            "training_matches": experiment.matches or len(self.training_matches),
            "sets": self.figures(outcome),
        }

    def training(self, experiment: Experiment) -> list[str]:
        """The command of an experiment."""
        sets = [part for setting in experiment.overrides for part in ("--set", setting)]
        folder = self.out / "runs" / experiment.name
        data = self.folder_of(experiment.matches)
        return self.teamclone("train", data, "--preset", experiment.preset, *sets, "--out", folder)

    def shown(self, command: Sequence[str]) -> str:
        """A command as a person types it, on MATCHES and with results in DIR."""
        text = " ".join(command).replace(f"{sys.executable} -m teamclone", "teamclone")
        return text.replace(str(self.options.matches), "MATCHES").replace(str(self.out), "DIR")

    def bare(self) -> Predictions:
        """What happened in ``rows``, with even probabilities as answers."""
        kind, issued, last = truth(self.dataset, self.rows)
        n = len(self.rows)
        return Predictions(
            probabilities=np.full((n, len(CLONED)), 1 / len(CLONED), np.float32),
            parameters=np.zeros((n, len(PARAMETERS)), np.float32),
            parameter_log_loss=np.full(n, np.nan, np.float32),
            kind=kind,
            issued=issued,
            last=last,
            match=self.dataset.match(self.rows).numpy(),
            position=np.zeros((n, 2), np.float32),
        )

    def rule(self, name: str) -> dict[str, Any]:
        return {"sets": self.figures(self.counted.answer(name, self.bare()))}

    def tree(self, *, rows: int, iterations: int) -> dict[str, Any]:
        """Gradient-boosted trees on all blocks of relative inputs, stopped by the validation matches."""
        from sklearn.ensemble import HistGradientBoostingClassifier

        features = EgocentricFeatures()

        def columns(index: NDArray[np.int64]) -> NDArray[np.float32]:
            parts = [self._columns(features, part) for part in chunks(index)]
            return np.concatenate(parts)

        def spread(split: Split, most: int) -> NDArray[np.int64]:
            index = self.dataset.split(split)
            return index[np.linspace(0, len(index) - 1, min(most, len(index))).astype(np.int64)]

        trained, held = spread(Split.TRAIN, rows), spread(Split.VALIDATION, rows // 4)
        classifier = HistGradientBoostingClassifier(
            learning_rate=0.1, max_iter=iterations, early_stopping=True, random_state=0
        )
        kinds = self.dataset.samples["kind"].numpy()
        # What training never saw cannot be scored, and says nothing about when to stop.
        held = held[np.isin(kinds[held], kinds[trained])]
        began = time.perf_counter()
        classifier.fit(columns(trained), kinds[trained], X_val=columns(held), y_val=kinds[held])
        seconds = time.perf_counter() - began
        bare = self.counted.answer("majority", self.bare())  # parameters: the constant guess
        probabilities = np.zeros_like(bare.probabilities)
        inputs = self.inputs_of(features)[:, : features.n_inputs].numpy()
        probabilities[:, classifier.classes_] = classifier.predict_proba(inputs)
        outcome = replace(bare, probabilities=probabilities)
        return {
            "seconds": seconds,
            "rows": len(trained),
            "columns": features.n_inputs,
            "iterations": int(classifier.n_iter_),
            "sets": self.figures(outcome),
        }

    def _columns(self, features: EgocentricFeatures, rows: NDArray[np.int64]) -> NDArray[np.float32]:
        state = self.dataset.state(rows, history=features.history)
        found: NDArray[np.float32] = features.project(state)[:, : features.n_inputs].numpy()
        return found

    def what_is_left(self, results: dict[str, dict[str, Any]]) -> dict[str, Any]:
        """Why it stops: the seeds' agreement, where errors lie, and where the learning curve leads."""
        found: dict[str, Any] = {}
        curve = sorted(
            (result["training_matches"], result)
            for name, result in results.items()
            if name.startswith("curve-") or name == "plain"
        )
        if len(curve) > 3:
            found["curve"] = {
                name: learning_curve(
                    [matches for matches, _ in curve],
                    [result["sets"][name]["all"]["model"]["cross_entropy"]["value"] for _, result in curve],
                )
                for name in self.sets
            }
        files = [self.out / "answers" / f"{name}.npz" for name in results if name.startswith("best-")]
        answers = [np.load(path)["probabilities"] for path in files if path.is_file()]
        if len(answers) > 1:
            bare, stacked = self.bare(), np.stack(answers)
            where = np.concatenate([situations(self.dataset.state(part)) for part in chunks(self.rows)])
            together = Predictions(
                **{**{name: getattr(bare, name) for name in bare.__slots__}, "probabilities": stacked.mean(0)}
            )
            found["seeds"] = len(answers)
            found["agreement"] = {
                name: agreement(stacked[:, mask], bare.kind[mask]) for name, mask in self.sets.items()
            }
            found["situations"] = {
                name: by_situation(stacked[:, mask], bare.kind[mask], where[mask]) for name, mask in self.sets.items()
            }
            found["ensemble"] = self.figures(together)
        if is_run(self.out / "runs" / "best-0"):
            found["kicks"], found["choices"] = self.plans()
            found["tackles"] = self.tackles()
        return found

    def plans(self) -> tuple[dict[str, dict[str, Any]], dict[str, dict[str, Any]]]:
        """By set, how many kicks are as planned, and for each planned action what the player does.

        Kicks are compared by the velocity that they give the ball, to EXACT metres per cycle.
        """
        rows, made, given = self._with_ball()
        kinds = self.dataset.samples["kind"].numpy()[rows]
        kicked = kinds == CLONED.index("kick")
        exact, chosen, choice = as_planned(made, given)
        followed = kicked & chosen
        of_clone = self._kicks_of_clone(rows[kicked])
        right = np.zeros(len(rows), np.bool_)
        right[kicked] = np.hypot(*(of_clone - given[kicked]).T) < EXACT
        member = {name: np.isin(rows, self.rows[mask]) for name, mask in self.sets.items()}
        found = {
            name: {
                "kicks": int((mask & kicked).sum()),
                "as_planned": _share(followed[mask & kicked]),
                "among": _share(exact.any(1)[mask & kicked]),
                "clone": _share(right[mask & kicked]),
            }
            for name, mask in member.items()
        }
        choices = {}
        for index, name in enumerate(CHOICES):
            here = choice == index
            other = here & kicked & ~followed
            does = {"as_planned": followed & here, "other_kick": other}
            does |= {kind: here & (kinds == CLONED.index(kind)) for kind in ("dash", "turn", "tackle")}
            choices[name] = {"rows": int(here.sum()), **{what: _share(part[here]) for what, part in does.items()}}
        return found, choices

    def tackles(self) -> dict[str, dict[str, Any]]:
        """By set, how many tackles go where it is planned, and where `best-0` says."""
        rows = self.rows[self.dataset.samples["kind"].numpy()[self.rows] == CLONED.index("tackle")]
        planned = plans(self.dataset.state(rows)).numpy()
        outcome = predict(open_run(self.out / "runs" / "best-0").load_model(), self.dataset, rows)
        place = [item.name for item in PARAMETERS].index("tackle_direction")

        def right(predicted: NDArray[np.float32]) -> NDArray[np.bool_]:
            away = predicted - outcome.issued[:, place]
            found: NDArray[np.bool_] = np.abs((away + 180.0) % 360.0 - 180.0) < EXACT_DEG
            return found

        followed = tackles_as_planned(planned, outcome.issued[:, place])
        of_clone = right(outcome.parameters[:, place])
        return {
            name: {
                "tackles": int(here.sum()),
                "as_planned": _share(followed[here]),
                "clone": _share(of_clone[here]),
            }
            for name, here in ((name, np.isin(rows, self.rows[mask])) for name, mask in self.sets.items())
        }

    def _with_ball(self) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]:
        """Those of ``rows`` whose player can kick the ball, what is planned, (n, len(PLAN)), and the velocity that a
        kick gives the ball, (n, 2)."""
        rows, planned, given = [], [], []
        for part in chunks(self.rows):
            state, target = self.dataset.state(part), self.dataset.target(part)
            made = plans(state)
            able = torch.nonzero(made[:, 0] > 0).squeeze(1)
            rows.append(part[able.numpy()])
            planned.append(made[able].numpy())
            given.append(kicked(state.select(able), target.parameters[able]).numpy())
        return np.concatenate(rows), np.concatenate(planned), np.concatenate(given)

    def _kicks_of_clone(self, rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """(n, 2) velocity of the ball after the kicks that `best-0` says."""
        model = open_run(self.out / "runs" / "best-0").load_model().eval()
        state = self.dataset.state(rows, history=model.inputs.history)
        outcome = predict(model, self.dataset, rows)
        place = [PARAMETERS.index(item) for item in PARAMETERS if item.kind.name == "KICK"]
        found: NDArray[np.float32] = kicked(state, torch.from_numpy(outcome.parameters[:, place])).numpy()
        return found


def _share(of: NDArray[np.bool_]) -> float | None:
    """What part is true; None of nothing."""
    return float(of.mean()) if len(of) else None


def _is_of(folder: Path, config: Config, data: Path) -> bool:
    """Whether a run was begun with these settings on this dataset."""
    if not is_run(folder):
        return False
    run = open_run(folder)
    return run.config == config and run.dataset_id == open_dataset(data).id


def _whole(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings of a result with defaults where it was made before a setting was known."""
    config = settings.get("config")
    return settings if config is None else {**settings, "config": to_table(config_from(config, where="a result"))}


def chunks(rows: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    return (rows[start : start + CHUNK] for start in range(0, len(rows), CHUNK))


SITUATIONS = ("ball kickable", "first of the team to the ball", "off the ball")


def situations(state: State) -> NDArray[np.int64]:
    """(batch,) index into SITUATIONS of the acting player; the ball is taken to roll on freely."""
    actor = state.actor.numpy()
    each = state.each()
    parts = (part.numpy() for part in (each.ball, each.players, each.types, each.server))
    steps = reach_ball(*parts, actor=actor, held=np.zeros(len(actor), np.bool_)).steps[:, :11]
    own = steps[np.arange(len(actor)), actor]
    return np.where(own == 0, 0, np.where(own <= steps.min(1), 1, 2))


def agreement(probabilities: NDArray[np.floating], kind: NDArray[np.int64]) -> dict[str, float]:
    """Whether seeds make the same errors; the shares add up to 1 over all errors of all seeds.

    Args:
        probabilities: (seeds, n, 4). kind: (n,) what was given.

    Returns:
        ``error``: mean share of rows predicted wrong. ``systematic``: of the errors, those that all seeds make, sure
        of them by SURE on average; ``shared``: made by all, less sure; ``by_seed``: by some only. ``entropy``: mean
        entropy of the seeds' mean, nats; ``chance``: mean entropy of each; ``doubt``: their difference, on which the
        seeds do not agree.
    """
    wrong = probabilities.argmax(2) != kind
    everyone = wrong.all(0)
    sure = probabilities.max(2).mean(0) >= SURE
    total = max(int(wrong.sum()), 1)
    n = len(wrong)
    mean = probabilities.astype(np.float64).mean(0)
    entropy, chance = _entropy(mean), float(np.mean([_entropy(one) for one in probabilities.astype(np.float64)]))
    return {
        "error": float(wrong.mean()),
        "systematic": n * int((everyone & sure).sum()) / total,
        "shared": n * int((everyone & ~sure).sum()) / total,
        "by_seed": int(wrong[:, ~everyone].sum()) / total,
        "entropy": entropy,
        "chance": chance,
        "doubt": entropy - chance,
    }


def _entropy(probabilities: NDArray[np.float64]) -> float:
    return float(-(probabilities * np.log(np.clip(probabilities, 1e-12, 1.0))).sum(1).mean())


def by_situation(
    probabilities: NDArray[np.floating], kind: NDArray[np.int64], where: NDArray[np.int64]
) -> dict[str, dict[str, float]]:
    """Means over seeds by situation: rows, error, cross-entropy, and the shares of all rows, errors and nats there."""
    wrong = (probabilities.argmax(2) != kind).mean(0)
    nats = np.mean([metrics.log_loss(one, kind) for one in probabilities], axis=0)
    found = {}
    for index, name in enumerate(SITUATIONS):
        here = where == index
        if here.any():
            found[name] = {
                "rows": int(here.sum()),
                "share": float(here.mean()),
                "error": float(wrong[here].mean()),
                "cross_entropy": float(nats[here].mean()),
                "share_of_errors": float(wrong[here].sum() / max(wrong.sum(), 1e-12)),
                "share_of_nats": float(nats[here].sum() / nats.sum()),
            }
    return found


def power_law(matches: Sequence[float], loss: Sequence[float]) -> tuple[float, float, float]:
    """Floor, scale and exponent of ``floor + scale * matches ** -exponent`` by least squares; none is below 0."""
    x, y = np.asarray(matches, np.float64), np.asarray(loss, np.float64)
    best = (np.inf, 0.0, 0.0, 0.0)
    for exponent in np.geomspace(0.05, 3.0, 400):
        falling = x**-exponent
        design = np.stack([np.ones_like(x), falling], 1)
        floor, scale = np.linalg.lstsq(design, y, rcond=None)[0]
        if floor < 0:
            floor, scale = 0.0, float(falling @ y / (falling @ falling))
        if scale < 0:
            floor, scale = float(y.mean()), 0.0
        error = float(np.square(floor + scale * falling - y).sum())
        if error < best[0]:
            best = (error, float(floor), float(scale), float(exponent))
    return best[1:]


def learning_curve(matches: Sequence[int], loss: Sequence[float]) -> dict[str, Any]:
    """The fit of `power_law`, its floor as each single point left out would have it, and where it leads."""
    floor, scale, exponent = power_law(matches, loss)
    left_out = [
        power_law([*matches[:i], *matches[i + 1 :]], [*loss[:i], *loss[i + 1 :]])[0] for i in range(len(matches))
    ]
    return {
        "matches": list(matches),
        "cross_entropy": list(loss),
        "floor": floor,
        "scale": scale,
        "exponent": exponent,
        "floor_low": min(left_out),
        "floor_high": max(left_out),
        "leads_to": {str(n * matches[-1]): floor + scale * (n * matches[-1]) ** -exponent for n in (2, 10)},
    }


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("matches", type=Path, help="folder of logs")
    made.add_argument("--out", type=Path, required=True, help="folder of the benchmark")
    made.add_argument("--only", default=",".join(STEPS), help="steps and results, in this order")
    made.add_argument("--page", type=Path, help="the page to write, a plot beside it; default DIR/fidelity.md")
    made.add_argument("--team", default="HELIOS_base")
    made.add_argument("--unseen", nargs="*", default=["YuShan2024"], help="opponents kept out of training")
    made.add_argument(
        "--test-match", nargs="*", default=list(TEST_MATCHES), help="ids or parts of names; none: as the split gives"
    )
    made.add_argument("--minutes-scale", type=float, default=1.0, help="of all lengths: minutes and epochs")
    made.add_argument("--short-epochs", type=int, default=SHORT_EPOCHS, help="of the schedule of d, e, f and k")
    made.add_argument("--quick", action="store_true", help="tiny networks, an epoch each: to try the benchmark itself")
    return made


def main() -> None:
    options = parser().parse_args()
    work = Work(options)
    n_train = len(work.training_matches)
    trainings = experiments(
        n_train=n_train, scale=options.minutes_scale, short_epochs=options.short_epochs, quick=options.quick
    )
    for experiment in trainings:  # a wrong setting is reported before the hours of work
        load_config(experiment.preset, experiment.overrides)
    tree = {"rows": TREE_ROWS, "iterations": max(1, round(TREE_ITERATIONS * options.minutes_scale))}
    tree = {"rows": 4000, "iterations": 3} if options.quick else tree
    known = {*STEPS, *baselines.NAMES, "tree", *(experiment.name for experiment in trainings)}
    wanted = [part for part in re.split(r"[,\s]+", options.only) if part]
    wrong = [part for part in wanted if part not in known]
    if wrong:
        sys.exit(f"--only: no {', '.join(wrong)}; there are {', '.join(sorted(known))}")
    for part in wanted:
        for experiment in trainings:
            if part in (*experiment.step, experiment.name):
                work.result(experiment.name, experiment.settings, lambda experiment=experiment: work.train(experiment))
        for rule in baselines.NAMES:
            if part in ("a", rule):
                work.result(rule, {}, lambda rule=rule: work.rule(rule))
        if part in ("a", "tree"):
            work.result("tree", tree, lambda: work.tree(**tree))
        if part == "g":
            write_document(work.out / "left.json", work.what_is_left(work.load()))
    left = work.out / "left.json"
    page = options.page or work.out / "fidelity.md"
    results = work.load()
    there = [experiment for experiment in trainings if experiment.name in results]
    for experiment in there:
        work.check(experiment.name, experiment.settings)
    fidelity_page.write(
        page,
        results=results,
        left=json.loads(left.read_text(encoding="utf-8")) if left.is_file() else {},
        variants={"t": TRAINING, "k": KICKS, "d": ablations(), "e": REMEDIES},
        cleaning=work.dataset.meta["cleaning"],
        commands=[work.shown(command) for command in (*work.commands, *map(work.training, there))],
        situations=SITUATIONS,
        sure=SURE,
    )
    print(page)


if __name__ == "__main__":
    try:
        main()
    except TeamcloneError as error:
        sys.exit(f"fidelity: {error}")
