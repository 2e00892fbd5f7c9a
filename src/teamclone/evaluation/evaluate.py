"""Runs a model over the splits of a dataset and says how good it is: the numbers behind tables, figures and report."""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray

import teamclone
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import DatasetError, RunError
from teamclone.evaluation import baselines as rules
from teamclone.evaluation import bootstrap, metrics
from teamclone.evaluation.metrics import Scores, Sums
from teamclone.evaluation.outcome import Outcome
from teamclone.models.clone import model_id, parameter_count
from teamclone.models.heads.mixture import PointHead, with_ball
from teamclone.rcss.commands import CLONED, parameters_of
from teamclone.rcss.playmodes import RESTARTS, PlayMode
from teamclone.system.documents import read_document, write_document
from teamclone.world.state import Target

if TYPE_CHECKING:
    from teamclone.models.clone import Clone
    from teamclone.training.run import Run

FORMAT = 2
"""Of evaluation.json; raised whenever a reader of the old one would misread the new one."""

BATCH = 8192
POSITIONS_PER_KIND = 2500
"""Points of Fig. 4: enough for a picture, few enough for a file."""
TURN_EDGES = np.arange(-181.5, 182.0, 3.0)
"""Bins of Fig. 6 in degrees; the one in the middle holds 0."""

SPLITS = (Split.TEST, Split.UNSEEN, Split.VALIDATION)

Progress = Callable[[int, int], None]
"""Called with rows done and rows in all."""
Value = dict[str, float | None]
"""A figure as ``value``, ``low``, ``high``: the ends of its 95 % interval, None where there is none."""


def predict(
    model: Clone,
    dataset: Dataset,
    rows: NDArray[np.int64],
    *,
    inputs: torch.Tensor | None = None,
    batch: int = BATCH,
    on_batch: Callable[[int], None] | None = None,
) -> Outcome:
    """A model's answers for some samples of a dataset, beside what happened.

    Parameters of kicks and tackles are those of the samples in which one was given; nobody measures the others.

    Args:
        model: a clone; it is put into evaluation mode.
        dataset: where the samples lie.
        rows: (n,) indices of samples.
        inputs: (n, columns) what the features project from these samples, for who has it already; None makes it.
        batch: samples per pass.
        on_batch: called with the number of samples just done.

    Raises:
        DatasetError: a match lacks what the model needs.
    """
    n = len(rows)
    dataset.need(model.inputs.channels, rows)
    model.eval()
    device = next(model.parameters()).device
    outcome, mode = _empty(n, dataset.commands), np.empty(n, np.int64)
    with torch.inference_mode():
        for start in range(0, n, batch):
            part = rows[start : start + batch]
            stop = start + len(part)
            target = Target(*(tensor.to(device) for tensor in dataset.target(part)))
            kicks = with_ball(target)
            if inputs is None:
                output = model.output(dataset.state(part, history=model.inputs.history).to(device), kicks=kicks)
            else:
                output = model.answer(model.inputs.normalise(inputs[start:stop].to(device)), kicks=kicks)
            answer = model.head.point(output)
            if model.config.head == "mixture" and not isinstance(model.head, PointHead):
                likelihood = model.head.log_likelihood(output, target)
                outcome.parameter_log_loss[start:stop] = -likelihood.float().cpu().numpy()
            kind, issued, last = truth(dataset, part)
            outcome.parameter_log_loss[start:stop][np.isnan(issued).all(1)] = np.nan
            outcome.probabilities[start:stop] = answer.logits.float().softmax(1).cpu().numpy()
            outcome.parameters[start:stop] = answer.parameters.float().cpu().numpy()
            outcome.kind[start:stop] = kind
            outcome.issued[start:stop] = issued
            outcome.last[start:stop] = last
            outcome.match[start:stop] = dataset.match(part).numpy()
            mode[start:stop] = dataset.mode(part).numpy()
            frame, actor = dataset.samples["frame"].numpy()[part], dataset.samples["player"].numpy()[part]
            outcome.position[start:stop] = dataset.frames["position"].numpy()[frame, actor]
            if on_batch is not None:
                on_batch(len(part))
    return replace(outcome, mode=mode)


def _empty(n: int, commands: tuple[str, ...]) -> Outcome:
    n_parameters = len(parameters_of(commands))
    return Outcome(
        probabilities=np.empty((n, len(commands)), np.float32),
        parameters=np.empty((n, n_parameters), np.float32),
        parameter_log_loss=np.full(n, np.nan, np.float32),
        kind=np.empty(n, np.int64),
        issued=np.empty((n, n_parameters), np.float32),
        last=np.empty(n, np.int64),
        match=np.empty(n, np.int64),
        position=np.empty((n, 2), np.float32),
        commands=commands,
    )


def truth(
    dataset: Dataset, rows: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.int64]]:
    """kind (n,), issued (n, parameters) and last (n,) as in `Outcome`, of some samples."""
    target = dataset.target(rows)
    kind, arguments = target.kind.numpy(), target.parameters.numpy()
    items = parameters_of(dataset.commands)
    issued = np.full((len(rows), len(items)), np.nan, np.float32)
    for column, parameter in enumerate(items):
        carries = kind == dataset.commands.index(parameter.kind.name.lower())
        issued[carries, column] = arguments[carries, parameter.argument]
    return kind, issued, dataset.last_kind(rows).numpy()


def count_training(dataset: Dataset, *, on_batch: Callable[[int], None] | None = None) -> rules.Baselines:
    """What the baselines know: the training split of a dataset, counted."""
    counter = rules.Counter.empty(dataset.commands)
    rows = dataset.split(Split.TRAIN)
    for start in range(0, len(rows), 32 * BATCH):
        part = rows[start : start + 32 * BATCH]
        kind, issued, last = truth(dataset, part)
        counter.add(kind=kind, last=last, issued=issued)
        if on_batch is not None:
            on_batch(len(part))
    return counter.finish()


def evaluate(
    run: Run,
    *,
    dataset: Dataset | Path | str | None = None,
    checkpoint: str = "best-loss",
    seed: int = 0,
    on_progress: Progress | None = None,
) -> dict[str, Any]:
    """Everything the report needs to know about a run; JSON types only, undefined figures are None.

    Args:
        run: a finished or interrupted training run.
        dataset: another dataset than the run's own: all its splits are evaluated, and matches that the run was trained
            on are named, as are those of the run that it was adapted from.
        checkpoint: which weights.
        seed: of the bootstrap and of the sample of positions.
        on_progress: called with rows done and rows in all.

    Raises:
        DatasetError: the dataset is missing, has nothing to evaluate, or other commands than the model.
        RunError: the run or checkpoint cannot be read.
    """
    own = _own_dataset(run, needed=dataset is None)
    if dataset is None:
        assert own is not None
        data = own
    else:
        data = dataset if isinstance(dataset, Dataset) else open_dataset(dataset)
    foreign = own is None or data.id != own.id
    if data.commands != run.config.model.commands:
        raise DatasetError(
            f"{data.path}: has the commands {', '.join(data.commands)}, the model answers with "
            f"{', '.join(run.config.model.commands)}; make the dataset with the options of that of the run"
        )
    splits = (*SPLITS, Split.TRAIN) if foreign else SPLITS
    rows = {split: data.split(split) for split in splits}
    rows = {split: index for split, index in rows.items() if len(index)}
    if not rows:
        names = ", ".join(split.name.lower() for split in splits)
        raise DatasetError(f"{data.path}: no samples in {names}; build the dataset from more matches")
    model = run.load_model(checkpoint)
    trained_on = own if own is not None else data
    todo = sum(map(len, rows.values())) + len(trained_on.split(Split.TRAIN))
    done = 0

    def on_batch(count: int) -> None:
        nonlocal done
        done += count
        if on_progress is not None:
            on_progress(done, todo)

    counted = count_training(trained_on, on_batch=on_batch)
    known = {match["match_id"] for match in _used(trained_on, Split.TRAIN)} if foreign and own is not None else set()
    of_base = set((run.environment.get("base") or {}).get("trained_on") or ())
    evaluated = {match["match_id"] for split in rows for match in _used(data, split)}
    known |= of_base & evaluated
    trained_numbers = _players(trained_on, trained_on.split(Split.TRAIN))
    sections = {}
    for split, index in rows.items():
        outcome = predict(model, data, index, on_batch=on_batch)
        section = describe(outcome, baselines=counted, matches=data.matches, seed=seed)
        section["strangers"] = strangers(outcome, players=_players(data, index), trained=trained_numbers)
        sections[split.name.lower()] = section
    return {
        "format": FORMAT,
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "versions": {"teamclone": teamclone.__version__, "torch": torch.__version__, "numpy": np.__version__},
        "run": {
            "path": str(run.path),
            "checkpoint": checkpoint,
            "model_id": model_id(model),
            "weights": parameter_count(model),
            "base": run.environment.get("base"),
        },
        "dataset": {
            "path": str(data.path),
            "id": data.id,
            "team": data.meta["team"],
            "teams": data.meta.get("teams", [data.meta["team"]]),
            "own": not foreign,
            "baselines_counted_on": str(trained_on.path),
            "trained_on_before": sorted({match["match_id"] for match in data.matches} & known),
            "matches": data.matches,
            "cleaning": _without_matches(data.meta.get("cleaning")),
            "options": data.meta.get("options"),
        },
        "seed": seed,
        "resamples": bootstrap.N_RESAMPLES,
        "splits": sections,
        "data": characterise(data, seed=seed),
    }


def _players(dataset: Dataset, rows: NDArray[np.int64]) -> NDArray[np.uint8]:
    """(n,) who gave the commands: 0..10 for the numbers 1..11."""
    players: NDArray[np.uint8] = dataset.samples["player"].numpy()[rows]
    return players


def strangers(
    outcome: Outcome, *, players: NDArray[np.uint8], trained: NDArray[np.uint8]
) -> dict[str, dict[str, float | int]]:
    """Numbers that play in a split but never played in training, each with its rows and accuracy.

    Teams now and then give the goalkeeper another number than 1. A network that knows players by their number, as the
    paper's does, has then never seen the field player who wears his.

    Args:
        outcome: the split. players: (n,) who acted in it. trained: who acted in the rows of training.
    """
    right = outcome.probabilities.argmax(axis=1) == outcome.kind
    return {
        str(int(player) + 1): {
            "rows": int((players == player).sum()),
            "accuracy": float(right[players == player].mean()),
        }
        for player in np.setdiff1d(players, trained)
    }


def _without_matches(cleaning: dict[str, Any] | None) -> dict[str, Any] | None:
    """The cleaning report over all matches."""
    return None if cleaning is None else {key: value for key, value in cleaning.items() if key != "matches"}


def _own_dataset(run: Run, *, needed: bool) -> Dataset | None:
    """The dataset the run was trained on; None when it is gone and another is given."""
    try:
        return open_dataset(run.dataset_path)
    except DatasetError as error:
        if needed:
            raise DatasetError(f"{error}, or name another dataset with --data") from None
        return None


def _used(dataset: Dataset, split: Split) -> list[dict[str, Any]]:
    """The matches that have samples in a split."""
    used = np.unique(dataset.match(dataset.split(split)).numpy())
    return [dataset.matches[index] for index in used]


def number(value: Any) -> float | None:
    """For JSON: a Python float, None where it is undefined."""
    scalar = float(value)
    return scalar if math.isfinite(scalar) else None


def _value(point: Any, spread: NDArray[np.float64] | None) -> Value:
    """A figure with its interval, from its resampled values (n_resamples,)."""
    if spread is None:
        return {"value": number(point), "low": None, "high": None}
    low, high = bootstrap.interval(spread)
    return {"value": number(point), "low": number(low), "high": number(high)}


def _scores(point: Scores, spread: Scores | None) -> dict[str, Value]:
    return {
        name: _value(getattr(point, name), None if spread is None else getattr(spread, name)) for name in Scores._fields
    }


def describe(
    outcome: Outcome, *, baselines: rules.Baselines, matches: Sequence[dict[str, Any]], seed: int = 0
) -> dict[str, Any]:
    """All figures of one split; intervals where it has two matches or more.

    Args:
        outcome: the split.
        baselines: counts of the training split.
        matches: what is known of each match, indexed by ``outcome.match``; ``match_id`` and ``opponent`` are read. The
            two entries of a match in which both teams are modelled count as one.
        seed: of the bootstrap.
    """
    used, by_entry = metrics.measure(outcome)
    sums, entries = _by_match(by_entry, used, matches)
    total = sums.total()
    several = len(entries) > 1
    occurrences = bootstrap.draw(len(entries), seed=seed) if several else None
    resampled = bootstrap.resample(sums, occurrences) if occurrences is not None else None
    point = metrics.scores(total)
    spread = metrics.scores(resampled) if resampled is not None else None
    section: dict[str, Any] = {
        "rows": len(outcome),
        "matches": [
            _match([matches[index] for index in of_match], sums.select(np.array([place])))
            for place, of_match in enumerate(entries)
        ],
        "model": _scores(point, spread),
        "confusion": total.confusion.astype(int).tolist(),
        "commands": _commands(outcome.commands, total, resampled),
        "parameters": _parameters(outcome, total, resampled),
        "calibration": {
            "predicted_command": _curve(metrics.top_label_curve(total)),
            "commands": {
                name: _curve(metrics.command_curve(outcome, kind)) for kind, name in enumerate(outcome.commands)
            },
        },
        "baselines": {},
        **_situations(outcome),
        "opponents": _opponents(used, by_entry, matches, seed=seed),
    }
    for name in rules.NAMES:
        answer = baselines.answer(name, outcome)
        other, _ = _by_match(metrics.measure(answer)[1], used, matches)
        other_point = metrics.scores(other.total())
        other_spread = metrics.scores(bootstrap.resample(other, occurrences)) if occurrences is not None else None
        gain, skill = _gain(point, other_point)
        gains, skills = _gain(spread, other_spread) if spread is not None and other_spread is not None else (None, None)
        section["baselines"][name] = {
            **_scores(other_point, other_spread),
            "accuracy_gain": _value(gain, gains),
            "cross_entropy_skill": _value(skill, skills),
        }
        # Made for networks that answer zero for parameters not issued; of a constant guess it says nothing.
        del section["baselines"][name]["paper_mae"]
    guess = baselines.answer("majority", outcome)
    medians = metrics.median_errors(guess.parameters, guess.issued, guess.commands)
    means = metrics.ratio(metrics.measure(guess)[1].total().parameter_error, total.parameter_count)
    for index, parameter in enumerate(parameters_of(outcome.commands)):
        constant = {
            "guess": number(baselines.parameters[index]),
            "mean": number(means[index]),
            "median": number(medians[index]),
        }
        section["parameters"][parameter.name]["constant"] = constant
    return section


def _situations(outcome: Outcome) -> dict[str, Any]:
    """``situations``: rows, accuracy and cross-entropy in play_on and by who restarts; nothing where all is play_on."""
    if outcome.mode is None or (outcome.mode == PlayMode.PLAY_ON).all():
        return {}
    restarts = RESTARTS[outcome.mode]
    masks = {
        "play_on": outcome.mode == PlayMode.PLAY_ON,
        "own restart": restarts > 0,
        "their restart": restarts < 0,
    }
    table = {}
    for name, mask in masks.items():
        point = metrics.scores(metrics.measure(outcome.rows(mask))[1].total())
        table[name] = {
            "rows": int(mask.sum()),
            "accuracy": number(point.accuracy),
            "cross_entropy": number(point.cross_entropy),
        }
    return {"situations": table}


def _gain(model: Scores, other: Scores) -> tuple[Any, Any]:
    """By how much accuracy is higher, and which share of the other's cross-entropy is gone."""
    return model.accuracy - other.accuracy, 1.0 - metrics.ratio(model.cross_entropy, other.cross_entropy)


def _by_match(sums: Sums, used: NDArray[np.int64], matches: Sequence[dict[str, Any]]) -> tuple[Sums, list[list[int]]]:
    """Sums of entries, those indexed by ``used``, as sums of matches, and the entries of each.

    Two entries of one match, each of another team, are the same game: no independent draws.
    """
    places: dict[str, list[int]] = {}
    for place, index in enumerate(used):
        places.setdefault(matches[index]["match_id"], []).append(place)
    grouped = [sums.select(np.array(of_match)).total() for of_match in places.values()]
    joined = Sums(*map(np.stack, zip(*grouped, strict=True))) if grouped else sums
    return joined, [[int(used[place]) for place in of_match] for of_match in places.values()]


def _match(entries: Sequence[dict[str, Any]], sums: Sums) -> dict[str, Any]:
    point = metrics.scores(sums.total())
    return {
        "match_id": entries[0]["match_id"],
        "opponent": " and ".join(entry["opponent"] for entry in entries),
        "rows": int(sums.confusion.sum()),
        "accuracy": number(point.accuracy),
        "cross_entropy": number(point.cross_entropy),
    }


def _commands(commands: Sequence[str], total: Sums, resampled: Sums | None) -> dict[str, Any]:
    point = metrics.rates(total.confusion)
    spread = metrics.rates(resampled.confusion) if resampled is not None else None
    losses = metrics.ratio(total.parameter_log_loss, total.likelihood_count)
    loss_spread = (
        metrics.ratio(resampled.parameter_log_loss, resampled.likelihood_count) if resampled is not None else None
    )
    counts = ("support", "predicted")
    table: dict[str, Any] = {}
    for kind, name in enumerate(commands):
        row: dict[str, Any] = {field: int(getattr(point, field)[kind]) for field in counts}
        for field in point._fields:
            if field not in counts:
                values = None if spread is None else getattr(spread, field)[:, kind]
                row[field] = _value(getattr(point, field)[kind], values)
        row["parameter_log_loss"] = _value(losses[kind], None if loss_spread is None else loss_spread[:, kind])
        table[name] = row
    return table


def _parameters(outcome: Outcome, total: Sums, resampled: Sums | None) -> dict[str, Any]:
    means = metrics.ratio(total.parameter_error, total.parameter_count)
    spread = metrics.ratio(resampled.parameter_error, resampled.parameter_count) if resampled is not None else None
    medians = metrics.median_errors(outcome.parameters, outcome.issued, outcome.commands)
    right = outcome.rows(outcome.probabilities.argmax(axis=1) == outcome.kind)
    _, sums = metrics.measure(right)
    when_right = metrics.ratio(sums.total().parameter_error, sums.total().parameter_count)
    return {
        parameter.name: {
            "command": parameter.kind.name.lower(),
            "unit": parameter.unit,
            "rows": int(total.parameter_count[index]),
            "mean": _value(means[index], None if spread is None else spread[:, index]),
            "median": number(medians[index]),
            "mean_when_command_right": number(when_right[index]),
        }
        for index, parameter in enumerate(parameters_of(outcome.commands))
    }


def _curve(curve: metrics.Curve) -> dict[str, list[Any]]:
    return {
        "rows": curve.rows.astype(int).tolist(),
        "said": [round(float(value), 6) for value in curve.said],
        "came_true": [round(float(value), 6) for value in curve.came_true],
    }


def _opponents(
    used: NDArray[np.int64], sums: Sums, matches: Sequence[dict[str, Any]], *, seed: int
) -> list[dict[str, Any]]:
    """The split by opponent, the best understood first."""
    names = np.array([str(matches[index]["opponent"]) for index in used], object)
    table = []
    for name in sorted(set(names)):
        mine = sums.select(np.flatnonzero(names == name))
        n_matches = len(mine.log_loss)
        point = metrics.scores(mine.total())
        draws = bootstrap.draw(n_matches, seed=seed) if n_matches > 1 else None
        spread = metrics.scores(bootstrap.resample(mine, draws)) if draws is not None else None
        figures = _scores(point, spread)
        table.append(
            {
                "opponent": name,
                "matches": n_matches,
                "rows": int(mine.confusion.sum()),
                "accuracy": figures["accuracy"],
                "cross_entropy": figures["cross_entropy"],
            }
        )
    return sorted(table, key=lambda row: -(row["accuracy"]["value"] or 0.0))


def characterise(dataset: Dataset, *, seed: int = 0) -> dict[str, Any]:
    """What the rows look like: commands by split, turn moments, where each command was given (Figs 4 to 6)."""
    kinds, splits = dataset.samples["kind"].numpy(), dataset.samples["split"].numpy()
    names = dataset.commands
    square = np.bincount(splits.astype(np.int64) * len(names) + kinds, minlength=len(Split) * len(names))
    by_split = square.reshape(len(Split), len(names))
    turns = np.flatnonzero(kinds == CLONED.index("turn"))
    histogram = np.zeros(len(TURN_EDGES) - 1, np.int64)
    zero = 0
    arguments, turn_zero = dataset.samples["parameters"].numpy(), dataset.samples["turn_zero"].numpy()
    for part in np.array_split(turns, max(len(turns) // 1_000_000, 1)):
        histogram += np.histogram(arguments[part, 0], bins=TURN_EDGES)[0]
        zero += int(turn_zero[part].sum())
    generator = np.random.default_rng(seed)
    places: dict[str, list[list[float]]] = {}
    for kind, name in enumerate(names):
        rows = np.flatnonzero(kinds == kind)
        if len(rows) > POSITIONS_PER_KIND:
            rows = np.sort(generator.choice(rows, POSITIONS_PER_KIND, replace=False))
        frames, players = dataset.samples["frame"].numpy()[rows], dataset.samples["player"].numpy()[rows]
        spots = dataset.frames["position"].numpy()[frames, players]
        places[name] = np.round(spots.astype(np.float64), 1).tolist()
    return {
        "rows": len(dataset),
        "matches": len({match["match_id"] for match in dataset.matches}),
        "commands_by_split": {
            split.name.lower(): dict(zip(names, by_split[split].tolist(), strict=True)) for split in Split
        },
        "turns": len(turns),
        "turn_zero": zero,
        "turn_moments": {"edges": TURN_EDGES.tolist(), "counts": histogram.tolist()},
        "positions": places,
    }


def evaluation_path(run: Run, evaluation: dict[str, Any]) -> Path:
    """Where an evaluation belongs: RUN/evaluation.json, or by the dataset's name if it is another than the run's."""
    if evaluation["dataset"]["own"]:
        return Path(run.path) / "evaluation.json"
    return Path(run.path) / f"evaluation-{Path(evaluation['dataset']['path']).name}.json"


def save_evaluation(run: Run, evaluation: dict[str, Any]) -> Path:
    """Write an evaluation into its run, whole or not at all; where it went."""
    path = evaluation_path(run, evaluation)
    write_document(path, evaluation)
    return path


def load_evaluation(path: Path | str) -> dict[str, Any]:
    """Read an evaluation back; raises as `read_document`."""
    return read_document(Path(path), what="an evaluation", number=FORMAT, command="teamclone evaluate", error=RunError)
