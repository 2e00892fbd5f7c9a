"""One HTML file that shows how good a clone is: without a network, on paper, in light and dark mode."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure

from teamclone.errors import RunError
from teamclone.evaluation import bootstrap, metrics, paper
from teamclone.evaluation.evaluate import evaluate_and_save, load_evaluation
from teamclone.evaluation.latency import load_bench, measure_run
from teamclone.models.clone import model_id
from teamclone.models.config import EgocentricPointConfig, PaperConfig
from teamclone.plots.page import page_template, svg
from teamclone.plots.style import page_css
from teamclone.report import figures
from teamclone.rollouts.files import load_rollouts
from teamclone.rollouts.run import MOVERS
from teamclone.system.files import write_atomic
from teamclone.training.config import Config, to_toml
from teamclone.training.run import Run

NOTHING = "\N{EN DASH}"
_DAMAGED = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""What a document of wrong shape ends in where it is read."""
SPLIT_NAMES = {
    "train": "training matches of another dataset",
    "validation": "validation matches",
    "test": "test matches",
    "unseen": "unseen opponents",
}
FIGURES = (
    ("accuracy", "accuracy", "share of commands predicted right"),
    ("cross_entropy", "cross-entropy, nats", "surprise at the true commands; lower is better"),
    ("brier", "Brier score", "squared error of the probabilities, 0 to 2; lower is better"),
    ("ece", "calibration error", "gap between confidence and accuracy; lower is better"),
    ("balanced_accuracy", "balanced accuracy", "mean recall of the commands"),
    ("macro_f1", "macro F1", "mean F1 of the commands"),
    ("paper_mae", "the paper's MAE", "mean absolute error of all six outputs, zeros included"),
)
PITCHES = {4: "Four", 5: "Five", 6: "Six", 7: "Seven"}
PERCENT = {"accuracy", "balanced_accuracy", "ece"}


def percent(value: float | None, digits: int = 1) -> str:
    """Return 0.8455 as ``84.6 %``; an undefined value as a dash."""
    return NOTHING if value is None else f"{number(100 * value, digits)}\N{NARROW NO-BREAK SPACE}%"


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with so many decimals, thousands grouped; an undefined value as a dash."""
    return NOTHING if value is None else f"{value:,.{digits}f}".replace("-", "\N{MINUS SIGN}")


def points(value: float | None, digits: int = 1) -> str:
    """Return a difference of accuracies, 0.012 as ``+1.2``."""
    return NOTHING if value is None else f"{100 * value:+.{digits}f}".replace("-", "\N{MINUS SIGN}")


def figure(value: Mapping[str, Any] | None, kind: str = "number", digits: int = 3) -> Markup:
    """Return a figure and, small beside it, its interval."""
    if value is None or value["value"] is None:
        return Markup(NOTHING)
    write = {"percent": percent, "number": number, "points": points}[kind]
    text = Markup("{}").format(write(value["value"], digits))
    if value["low"] is None:
        return text
    low, high = write(value["low"], digits), write(value["high"], digits)
    if kind == "percent":
        low = low.removesuffix("\N{NARROW NO-BREAK SPACE}%")
    return text + Markup(' <small class="interval">{} to {}</small>').format(low, high)


def split_by_rows(evaluation: Mapping[str, Any]) -> bool:
    """Return whether rows of one match are in several splits, as in the paper."""
    return str((evaluation["dataset"]["options"] or {}).get("split")) == "rows"


def primary_split(evaluation: Mapping[str, Any]) -> str:
    """Return the split of the headline: test, or the next best there is."""
    there = evaluation["splits"]
    return next(name for name in ("test", "unseen", "validation", "train") if name in there)


def best_epoch(history: Sequence[Mapping[str, Any]]) -> int | None:
    """Return the epoch of the lowest validation loss."""
    known = [row for row in history if row.get("validation_loss") is not None]
    return int(min(known, key=lambda row: row["validation_loss"])["epoch"]) if known else None


def sentences(evaluation: Mapping[str, Any]) -> list[str]:
    """Return the main findings as sentences; each claim depends on the figures."""
    name = primary_split(evaluation)
    section = evaluation["splits"][name]
    team, model, others = evaluation["dataset"]["team"], section["model"], section["baselines"]
    n_matches = len(section["matches"])
    where = {
        "test": "it never saw",
        "unseen": "against opponents it never saw",
        "validation": "that only chose its checkpoint",
        "train": "of another dataset",
    }[name]
    if split_by_rows(evaluation) and name != "unseen":
        where = "whose neighbouring moments it was trained on (split by row, as in the paper)"
    matches = "one match" if n_matches == 1 else f"{n_matches} matches"
    text = (
        f"In {matches} {where}, the clone names the next command of a {team} player right "
        f"{percent(model['accuracy']['value'])} of the time"
    )
    if model["accuracy"]["low"] is not None:
        low = percent(model["accuracy"]["low"]).removesuffix("\N{NARROW NO-BREAK SPACE}%")
        text += f" (95 % interval {low} to {percent(model['accuracy']['high'])})"
    found = [f"{text}."]

    persistence, majority = others["persistence"], others["majority"]
    found.append(
        f"Repeating the player's last command would be right {percent(persistence['accuracy']['value'])} of the time, "
        f"always predicting the most frequent one {percent(majority['accuracy']['value'])}."
    )
    found.append(verdict(section))

    unseen = evaluation["splits"].get("unseen")
    if unseen is not None and name == "test":
        names = listing([row["opponent"] for row in unseen["opponents"]])
        difference = 100 * (unseen["model"]["accuracy"]["value"] - model["accuracy"]["value"])
        how = (
            "the same"
            if abs(difference) < 0.05
            else f"{abs(difference):.1f} points {'more' if difference > 0 else 'less'}"
        )
        found.append(
            f"Against {names}, never met in training, it is right {percent(unseen['model']['accuracy']['value'])} "
            f"of the time, {how}."
        )
    return found


def verdict(section: Mapping[str, Any]) -> str:
    """Return whether the clone beats the strongest rule, by accuracy and else by its probabilities."""
    others = section["baselines"].values()
    gain = max(others, key=lambda other: other["accuracy"]["value"])["accuracy_gain"]
    if (gain["value"] if gain["low"] is None else gain["low"]) > 0:
        return f"That is {100 * gain['value']:.1f} points above the strongest rule without a network."
    skill = min(others, key=lambda other: other["cross_entropy"]["value"])["cross_entropy_skill"]["value"]
    but = (
        f", though its probabilities leave {percent(skill, 0)} less surprise than any rule's" if skill >= 0.005 else ""
    )
    if gain["value"] > 0:
        return f"Whether that beats the strongest rule without a network is not certain{but}: test on more matches."
    return f"That does not beat the strongest rule without a network{but}: train longer or on more matches."


def listing(names: Sequence[str], most: int = 4) -> str:
    """Join some names for a sentence."""
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def ladder(evaluation: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the accuracy of rules and clone as rows, the best last, and the paper's for orientation."""
    section = evaluation["splits"][primary_split(evaluation)]
    names = {"majority": "most frequent command", "persistence": "repeat the last command", "markov": "Markov table"}
    rows = [
        {"name": names[key], "kind": "rule", **section["baselines"][key]["accuracy"]} for key in section["baselines"]
    ]
    rows.append({"name": "this clone", "kind": "clone", **section["model"]["accuracy"]})
    rows.sort(key=lambda row: row["value"] or 0.0)
    published = {"value": paper.PUBLISHED["accuracy"], "low": None, "high": None}
    rows.append({"name": f"the paper's clone of {paper.TEAM}", "kind": "paper", **published})
    return rows


def calibration_sentence(section: Mapping[str, Any]) -> str:
    """Return a sentence on calibration, at the most and at the least confident bin."""
    curve = section["calibration"]["predicted_command"]
    if not curve["confidence"]:
        return ""
    confidence, observed = curve["confidence"], curve["observed_frequency"]
    low, high = 0, len(confidence) - 1
    return (
        f"When it is {percent(confidence[high], 0)} sure it is right {percent(observed[high], 0)} of the "
        f"time, and {percent(observed[low], 0)} when it is {percent(confidence[low], 0)} sure."
    )


def commands(evaluation: Mapping[str, Any], *, trained_on: Path) -> list[str]:
    """Return the commands that lead from match logs to this report; unknown arguments are in capitals."""
    data, run = evaluation["dataset"], evaluation["run"]
    options = data["options"] or {}
    build = ["teamclone dataset --store STORE", *(f"--team {shlex.quote(team)}" for team in data["teams"])]
    for key, value in options.items():
        if key == "team" or value is None or value is False or value == []:
            continue
        if not key.isidentifier():  # no option, and not to be copied into a shell
            continue
        name = {"test_matches": "test-match", "validation_matches": "validation-match"}.get(key, key.replace("_", "-"))
        if value is True:
            build.append(f"--{name}")
            continue
        build += [f"--{name} {shlex.quote(str(item))}" for item in (value if isinstance(value, list) else [value])]
    source, base = shlex.quote(str(trained_on)), run["base"]
    learn = f"adapt {shlex.quote(base['path'])} {source}" if base else f"train {source}"
    other = "" if data["own"] else f" --data {shlex.quote(data['path'])}"
    path = shlex.quote(run["path"])
    return [
        "teamclone ingest MATCHES --store STORE",
        _wrapped([*build, f"--out {shlex.quote(data['path'])}"]),
        f"teamclone {learn} --out {path}  # with the settings below",
        f"teamclone evaluate {path}{other} --checkpoint {shlex.quote(run['checkpoint'])}",
        f"teamclone bench {path}",
        f"teamclone report {path}",
    ]


def _wrapped(parts: Sequence[str], width: int = 88) -> str:
    """Return a long command over several lines, as a shell takes it."""
    lines = [""]
    for part in parts:
        if lines[-1] and len(lines[-1]) + len(part) >= width:
            lines.append("   ")
        lines[-1] = f"{lines[-1]} {part}" if lines[-1] else part
    return " \\\n".join(lines)


def make_report(
    run: Run,
    *,
    out: Path | None = None,
    quick_predictions: int = 2000,
    on_progress: Callable[[str, int, int], None] | None = None,
) -> Path:
    """Write the report of a run; missing parts are computed first.

    RUN/evaluation.json is made if it is missing or belongs to other weights, RUN/bench.json likewise, with fewer
    predictions than `teamclone bench` takes.

    Args:
        run: the run.
        out: the file; None is RUN/report.html.
        quick_predictions: how many single predictions are timed if none were.
        on_progress: called with the name of the work, the steps done and their number.

    Returns:
        The file.
    """

    def telling(work: str) -> Callable[[int, int], None] | None:
        return None if on_progress is None else lambda done, total: on_progress(work, done, total)

    evaluation = fresh_evaluation(run)
    if evaluation is None:
        evaluation, _ = evaluate_and_save(run, on_progress=telling("evaluate"))
    bench = fresh_bench(run, checkpoint=evaluation["run"]["checkpoint"])
    if bench is None and quick_predictions:
        bench, _ = measure_run(
            run,
            dataset=evaluation["dataset"]["path"],
            checkpoint=evaluation["run"]["checkpoint"],
            n=quick_predictions,
            on_progress=telling("response times"),
        )
    ahead = fresh_rollouts(run, checkpoint=evaluation["run"]["checkpoint"])
    path = out or run.path / "report.html"
    history = run.history()
    try:
        html = render(
            run,
            evaluation,
            bench,
            history=history,
            ahead=ahead,
            replays=pages_of(run, path.parent, "replay"),
            scouts=pages_of(run, path.parent, "scout"),
        )
    except (*_DAMAGED, jinja2.TemplateError) as error:
        raise RunError(
            f"{run.path}: evaluation.json or bench.json is not what teamclone wrote ({error!r}); make them again with "
            "`teamclone evaluate` and `teamclone bench`"
        ) from error
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(path, html.encode())
    return path


def pages_of(run: Run, folder: Path, command: str) -> list[tuple[str, str]]:
    """Return the pages of a command in the folder of a run: name, and address as seen from a folder."""
    names = sorted(page.name for page in run.path.glob(f"{command}*.html"))
    beside = Path(os.path.relpath(run.path.resolve(), folder.resolve())).as_posix()
    return [(name, quote(f"{beside}/{name}")) for name in names]


def fresh_evaluation(run: Run) -> dict[str, Any] | None:
    """Return the saved evaluation, if it is of the run's present weights and dataset."""
    try:
        evaluation = load_evaluation(run.path / "evaluation.json")
        weights = model_id(run.load_model(evaluation["run"]["checkpoint"]))
    except (RunError, KeyError):
        return None
    fresh = weights == evaluation["run"]["model_id"] and evaluation["dataset"]["id"] == run.dataset_id
    return evaluation if fresh else None


def fresh_bench(run: Run, *, checkpoint: str) -> dict[str, Any] | None:
    """Return the saved response times, if they are of these weights."""
    try:
        bench = load_bench(run.path / "bench.json")
        return bench if bench["model_id"] == model_id(run.load_model(checkpoint)) else None
    except (RunError, KeyError):
        return None


@dataclass(frozen=True, slots=True)
class Ahead:
    """What the page shows of the roll-outs of a run.

    Attributes:
        starts: from how much they begin, in words. samples: of each start. others: see ``RolloutConfig``.
        cycles: ahead, of the columns. tables: of ``players`` and the ``ball``: who moves the players, and the mean
            displacement in metres by ``cycles``.
        picture: the fans.
    """

    starts: str
    samples: int
    others: str
    cycles: list[int]
    tables: dict[str, list[tuple[str, list[float | None]]]]
    picture: Figure

    @classmethod
    def of(cls, document: Mapping[str, Any], fans: Sequence[Mapping[str, Any]]) -> Ahead:
        """Return what ``rollouts.json`` and ``fans.json`` hold."""
        counts = [match["starts"] for match in document["matches"] if match["starts"]]
        ahead = document["ahead"]
        cycles = [row["cycles"] for row in ahead["samples"]["players"]]
        tables: dict[str, list[tuple[str, list[float | None]]]] = {}
        for group in ("players", "ball"):
            found = {name: {row["cycles"]: row["fde"] for row in ahead[name][group]} for name in MOVERS}
            tables[group] = [(who, [found[name].get(one) for one in cycles]) for name, who in MOVERS.items()]
        return cls(
            starts=f"{sum(counts):,} moments of {'one match' if len(counts) == 1 else f'{len(counts)} matches'}",
            samples=int(document["options"]["samples"]),
            others=str(document["options"]["others"]),
            cycles=cycles,
            tables=tables,
            picture=figures.fans(fans),
        )


def fresh_rollouts(run: Run, *, checkpoint: str) -> Ahead | None:
    """Return the roll-outs in the run, if they are whole and of these weights."""
    try:
        document, fans = load_rollouts(run.path / "rollouts")
        fresh = document["model_id"] == model_id(run.load_model(checkpoint))
        return Ahead.of(document, fans) if fresh else None
    except (RunError, *_DAMAGED):  # what is damaged is not shown
        return None


def trained_error(config: Config) -> str:
    """What a run took as the error of parameters, in words."""
    if not isinstance(config.model, PaperConfig | EgocentricPointConfig):
        return "negative log-likelihood, nats"
    where = "all outputs" if config.model.parameter_loss == "paper" else "those issued"
    return f"mean square over {where}"


def _plots(
    evaluation: Mapping[str, Any], bench: Mapping[str, Any] | None, history: Sequence[Any], ahead: Ahead | None
) -> dict[str, Markup]:
    """Return the figures by name; those without data are missing."""
    data, splits = evaluation["data"], evaluation["splits"]
    team = evaluation["dataset"]["team"]
    kinds = tuple(data["positions"])
    totals = {kind: sum(counts[kind] for counts in data["commands_by_split"].values()) for kind in kinds}
    drawn: dict[str, Any] = {
        "positions": (
            figures.positions(data["positions"], totals),
            f"{PITCHES[len(kinds)]} pitches, one per command, with dots where players of {team} gave it",
        ),
        "frequencies": (
            figures.frequencies(totals),
            "Bars of commands by kind: " + ", ".join(f"{kind} {totals[kind]:,}" for kind in kinds),
        ),
        "turn-moments": (
            figures.turn_moments(
                data["turn_moments"]["edges"],
                data["turn_moments"]["counts"],
                zero=data["turn_zero"],
                turns=data["turns"],
            ),
            f"Histogram of turn moments in degrees; {data['turn_zero']:,} of {data['turns']:,} turns are zero",
        ),
        "reliability": (
            figures.reliability(splits[primary_split(evaluation)]["calibration"]),
            "Two reliability diagrams: share that came true against predicted probability; the diagonal is perfect",
        ),
    }
    compared = {name: split["model"] for name, split in splits.items()}
    if len(compared) > 1:
        drawn["seen-unseen"] = (
            figures.seen_unseen(compared),
            "Accuracy, cross-entropy, calibration error and mean absolute error of each split with 95 % intervals",
        )
    rows = [{"split": name, **row} for name in compared for row in splits[name]["opponents"]]
    if len(rows) > 1:
        drawn["opponents"] = (
            figures.opponents(rows),
            "Accuracy by opponent with 95 % intervals, as in the table below",
        )
    if history:
        drawn["training-curves"] = (
            figures.training_curves(history, best_epoch=best_epoch(history)),
            "Training and validation curves by epoch",
        )
    if bench is not None:
        drawn["response-times"] = (
            figures.response_times(
                bench["histogram"]["edges_us"],
                bench["histogram"]["counts"],
                p50_us=bench["single"]["p50_us"],
                p99_us=bench["single"]["p99_us"],
            ),
            f"Histogram of response times, half of them below {bench['single']['p50_us']:.0f} microseconds",
        )
    if ahead is not None:
        drawn["fans"] = (ahead.picture, "Pitches with sampled paths of players and ball, and the paths that they took")
    return {name: Markup(svg(drawing, name=name, alt=alt)) for name, (drawing, alt) in drawn.items()}


def render(
    run: Run,
    evaluation: Mapping[str, Any],
    bench: Mapping[str, Any] | None,
    *,
    history: Sequence[Mapping[str, Any]],
    ahead: Ahead | None = None,
    replays: Sequence[tuple[str, str]] = (),
    scouts: Sequence[tuple[str, str]] = (),
) -> str:
    """Return the report as HTML.

    Args:
        run: the run; its settings are shown.
        evaluation: from `evaluate.evaluate`.
        bench: from `latency.measure_latency`; None leaves the response times out.
        history: from ``run.history()``; empty leaves the training curves out.
        ahead: from `fresh_rollouts`; None leaves the roll-outs out.
        replays, scouts: pages of these commands, from `pages_of`.
    """
    template = page_template(
        __package__, "report.html.j2", percent=percent, number=number, figure=figure, points=points
    )
    name = primary_split(evaluation)
    section = evaluation["splits"][name]
    support = [sum(row) for row in section["confusion"]]
    return template.render(
        evaluation=evaluation,
        run=run,
        bench=bench,
        history=history,
        best_epoch=best_epoch(history),
        primary=name,
        section=section,
        splits=evaluation["splits"],
        split_names=SPLIT_NAMES,
        figures=FIGURES,
        percents=PERCENT,
        kinds=tuple(section["commands"]),
        theme=Markup(page_css()),
        even_log_loss=metrics.even_log_loss(tuple(section["commands"])),
        support=support,
        sentences=sentences(evaluation),
        ladder=ladder(evaluation),
        calibration=calibration_sentence(section),
        cleaning={"rules": [], "player_cycles": 0} | (evaluation["dataset"]["cleaning"] or {}),
        by_rows=split_by_rows(evaluation),
        few_matches=bootstrap.FEW_MATCHES,
        commands=commands(evaluation, trained_on=run.dataset_path),
        paper=paper,
        plots=_plots(evaluation, bench, history, ahead),
        ahead=ahead,
        replays=replays,
        scouts=scouts,
        trained_error=trained_error(run.config),
        settings=to_toml(run.config),
        versions={**run.environment, **evaluation["versions"]},
        listing=listing,
    )
