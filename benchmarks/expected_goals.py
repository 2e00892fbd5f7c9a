"""Fits the model of expected goals, and says how good it is on matches that it has not seen.

    python benchmarks/expected_goals.py FOLDER... [--write]

FOLDER holds game logs, at any depth; a match that lies there twice counts once. Every figure is of matches left out,
a tenth at a time, and the trees show what more there is to learn from the same columns. `--write` writes the file that
`teamclone.events.expected_goals` reads.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import brier_score_loss, roc_auc_score
from sklearn.model_selection import GroupKFold, cross_val_predict
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

from teamclone.cli.common import print_table, progress
from teamclone.events.definitions import SHOT_RANGE_M, SHOT_SPEED, EventKind, Outcome
from teamclone.events.expected_goals import FORMAT, PATH, SITUATIONS, TERMS, chance, situations, terms
from teamclone.events.find import find_events
from teamclone.logs import Match, find_matches, read_pair
from teamclone.logs.match import Columns
from teamclone.rcss import server_params
from teamclone.system.documents import write_document

MODEL, ONE_RATE = "the model", "the same rate always"
SHRINKAGE = 1.0
"""Of the coefficients of standardised terms. It keeps that of set plays finite where none of them scored."""
N_FOLDS = 10
"""Of whole matches."""
BINS = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Shots:
    """Shots of matches, (n,) each."""

    found: Columns
    """SITUATIONS."""
    goal: NDArray[np.bool_]
    by_outcome: NDArray[np.bool_]
    """A shot only because it scored: too slow or from too far to be one otherwise."""
    match: NDArray[np.int64]
    by: NDArray[Any]
    against: NDArray[Any]

    def __len__(self) -> int:
        return len(self.goal)


def of_match(match: Match, index: int) -> Shots | None:
    """The shots of a match whose situation is known; None where it has none."""
    params = match.game.server_params
    events = find_events(match.frames, match.players, params)
    events = {name: values[events["kind"] == EventKind.SHOT] for name, values in events.items()}
    found = situations(match.frames, match.players, frame=events["frame"], side=events["side"])
    known = np.isfinite(found["distance"])
    if not known.any():
        return None
    names = np.array([match.left.name or "", match.right.name or ""])
    left = events["side"] > 0
    fast = SHOT_SPEED * server_params.number(params, "ball_speed_max", version=server_params.OLDEST)
    goal = events["outcome"] == Outcome.GOAL
    made = {
        "goal": goal,
        "by_outcome": goal & ((events["speed"] < fast) | (found["distance"] > SHOT_RANGE_M)),
        "match": np.full(len(known), index),
        "by": names[np.where(left, 0, 1)],
        "against": names[np.where(left, 1, 0)],
    }
    return Shots(
        found={name: values[known] for name, values in found.items()},
        **{name: values[known] for name, values in made.items()},
    )


def read(folders: list[Path]) -> tuple[Shots, list[str]]:
    """The shots of all matches below the folders, and the names of the logs that have some."""
    pairs = find_matches(folders)
    parts: list[Shots] = []
    names: list[str] = []
    seen: set[str] = set()
    with progress("matches") as bar:
        for pair in bar.track(pairs):
            match = read_pair(pair)
            made = None if match.match_id in seen else of_match(match, len(names))
            seen.add(match.match_id)
            if made is not None and match.rcg_path is not None:
                parts.append(made)
                names.append(match.rcg_path.name)
    if not parts:
        sys.exit("no match there has a shot; name folders with game logs (.rcg)")
    joined = {
        name: np.concatenate([getattr(one, name) for one in parts])
        for name in ("goal", "by_outcome", "match", "by", "against")
    }
    found = {one.name: np.concatenate([part.found[one.name] for part in parts]) for one in SITUATIONS}
    return Shots(found=found, **joined), names


def regression() -> Pipeline:
    return make_pipeline(StandardScaler(), LogisticRegression(C=1.0 / SHRINKAGE))


def candidates(shots: Shots) -> Iterator[tuple[str, Any, Floats]]:
    """Name, estimator and columns of everything that is compared; the model itself first."""
    made = shots.found
    everything = np.stack([np.minimum(made[one.name], 1e3) for one in SITUATIONS], -1)
    simple = np.stack([made["distance"], made["opening"]], -1)
    trees = HistGradientBoostingClassifier(
        learning_rate=0.05, max_iter=100, max_leaf_nodes=6, min_samples_leaf=20, l2_regularization=1.0, random_state=0
    )
    yield MODEL, regression(), terms(made)
    yield "distance and opening", regression(), simple
    for left in range(len(TERMS)):
        yield f"without {TERMS[left]}", regression(), np.delete(terms(made), left, axis=1)
    yield "with all columns", regression(), np.concatenate([terms(made), everything], -1)
    yield "boosted trees, all columns", trees, everything


def left_out(estimator: Any, columns: Floats, shots: Shots, *, groups: NDArray[Any]) -> Floats:
    """(n,) the chance of each shot by a fit to groups, (n,) matches or teams, of which its own is none."""
    folds = GroupKFold(min(N_FOLDS, len(np.unique(groups))), shuffle=True, random_state=0)
    made: Floats = cross_val_predict(estimator, columns, shots.goal, groups=groups, cv=folds, method="predict_proba")[
        :, 1
    ]
    return made


def losses(shots: Shots, chances: Floats) -> Floats:
    """(n,) nats."""
    return -np.log(np.where(shots.goal, chances, 1.0 - chances))


def difference(shots: Shots, first: Floats, second: Floats) -> tuple[float, float]:
    """How much greater the first mean loss is, and its standard error over matches."""
    apart = losses(shots, first) - losses(shots, second)
    mean = apart.mean()
    by_match = np.bincount(shots.match, apart - mean)
    return float(mean), float(np.sqrt((by_match**2).sum()) / len(apart))


def figures(shots: Shots, chances: Floats) -> dict[str, float]:
    return {
        "log_loss": round(float(losses(shots, chances).mean()), 4),
        "brier": round(float(brier_score_loss(shots.goal, chances)), 4),
        "auc": round(float(roc_auc_score(shots.goal, chances)), 3),
    }


def print_candidates(shots: Shots, chances: dict[str, Floats]) -> None:
    rows = []
    for name, made in chances.items():
        mean, error = difference(shots, made, chances[MODEL])
        apart = "" if name == MODEL else f"{mean:+.3f} ± {error:.3f}"
        rows.append((name, *(f"{value:.3f}" for value in figures(shots, made).values()), apart))
    print_table(["", "log loss", "Brier score", "AUC", "log loss beside the model's"], rows, numeric=range(1, 5))
    print()


def print_groups(title: str, groups: Iterator[tuple[str, NDArray[np.bool_]]], shots: Shots, chances: Floats) -> None:
    """Shots, goals expected and scored, and how many standard deviations these are apart."""
    rows = []
    for name, these in groups:
        if these.any():
            expected, scored = chances[these].sum(), int(shots.goal[these].sum())
            spread = np.sqrt((chances[these] * (1.0 - chances[these])).sum())
            apart = f"{(scored - expected) / spread:+.1f}"
            rows.append((name, f"{these.sum()}", f"{expected:.1f}", f"{scored}", apart))
    print_table([title, "shots", "expected", "goals", "deviations"], rows, numeric=range(1, 5))
    print()


def in_bins(chances: Floats) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    at = np.clip(np.searchsorted(BINS, chances, side="right") - 1, 0, len(BINS) - 2)
    for index, (low, high) in enumerate(pairwise(BINS)):
        yield f"{low:.1f} to {high:.1f}", at == index


def of_each(names: NDArray[Any]) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    for name in np.unique(names):
        yield str(name), names == name


def fitted(shots: Shots) -> tuple[float, dict[str, float]]:
    """Intercept and coefficients of TERMS as they stand in the data, not standardised."""
    scaler, model = regression().fit(terms(shots.found), shots.goal)
    coefficients = model.coef_[0] / scaler.scale_
    intercept = float(model.intercept_[0] - (coefficients * scaler.mean_).sum())
    return intercept, {name: round(float(value), 4) for name, value in zip(TERMS, coefficients, strict=True)}


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER", help="game logs, at any depth")
    parser.add_argument("--write", action="store_true", help=f"write {PATH.name} into the package")
    options = parser.parse_args(arguments)
    shots, names = read(options.folders)
    print(f"{len(names)} matches, {len(shots)} shots, {shots.goal.sum()} goals; {shots.by_outcome.sum()} of these are")
    print("shots only because they scored. Each match by a fit to others:\n")
    chances = {
        name: left_out(estimator, columns, shots, groups=shots.match) for name, estimator, columns in candidates(shots)
    }
    chances["fitted to other teams"] = left_out(regression(), terms(shots.found), shots, groups=shots.by)
    chances[ONE_RATE] = np.full(len(shots), shots.goal.mean())
    print_candidates(shots, chances)
    print_groups("chance", in_bins(chances[MODEL]), shots, chances[MODEL])
    print_groups("shots by", of_each(shots.by), shots, chances[MODEL])
    print_groups("shots against", of_each(shots.against), shots, chances[MODEL])
    intercept, coefficients = fitted(shots)
    print_table(["term", "coefficient"], [(name, f"{value:+.4f}") for name, value in coefficients.items()], numeric=[1])
    if options.write:
        kept = (MODEL, ONE_RATE, "distance and opening", "boosted trees, all columns")
        document = {
            "format": FORMAT,
            "intercept": round(intercept, 4),
            "coefficients": coefficients,
            "shots": len(shots),
            "goals": int(shots.goal.sum()),
            "left_out": {name: figures(shots, chances[name]) for name in kept},
            "matches": names,
        }
        write_document(PATH, document)
        print(f"Wrote {PATH}")
    else:
        print(f"\nThe model of the package on the same shots: {figures(shots, chance(shots.found))}")


if __name__ == "__main__":
    main()
