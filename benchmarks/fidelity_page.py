"""The page of results that `fidelity.py` writes: every number is from its result files, what has none is left out."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

from teamclone.evaluation.metrics import even_log_loss
from teamclone.rcss.commands import CLONED
from teamclone.system.files import write_atomic

Results = Mapping[str, Mapping[str, Any]]
NOTHING = "-"
KINDS = CLONED
WIDTH = 138
COLOURS = ("#1b6fb3", "#c46a12", "#1f9e78", "#c75b9b", "#5d6872")


def _model(name: str) -> Callable[[Mapping[str, Any]], Any]:
    return lambda section: section["model"][name]


def _command(kind: str, name: str) -> Callable[[Mapping[str, Any]], Any]:
    return lambda section: section["commands"][kind][name]


def _parameter(parameter: str, name: str) -> Callable[[Mapping[str, Any]], Any]:
    return lambda section: section["parameters"][parameter][name]


FIGURES: tuple[tuple[str, Callable[[Mapping[str, Any]], Any], int, str], ...] = (
    ("accuracy", _model("accuracy"), 3, ".93 / .925 / .91"),
    ("cross-entropy, nats", _model("cross_entropy"), 3, ".18 / .19 / .22"),
    ("calibration error (ECE)", _model("ece"), 4, "under .004"),
    ("Brier score", _model("brier"), 3, ""),
    ("kick, recall", _command("kick", "recall"), 2, ".98"),
    ("kick, precision", _command("kick", "precision"), 2, ".93"),
    ("tackle, recall", _command("tackle", "recall"), 2, ".5"),
    ("tackle, precision", _command("tackle", "precision"), 2, ".5"),
    *(
        (f"{name.replace('_', ' ')}, {what} error{unit}", _parameter(name, what), 1, goal)
        for name, what, unit, goal in (
            ("dash_power", "mean", "", "3.5"),
            ("dash_power", "median", "", ""),
            ("dash_direction", "mean", ", deg", ""),
            ("dash_direction", "median", ", deg", ""),
            ("turn_moment", "mean", ", deg", "8"),
            ("turn_moment", "median", ", deg", "0.2"),
            ("kick_direction", "mean", ", deg", "35"),
            ("kick_direction", "median", ", deg", "15"),
            ("kick_power", "mean", "", "12"),
            ("kick_power", "median", "", ""),
            ("tackle_direction", "mean", ", deg", ""),
            ("tackle_direction", "median", ", deg", ""),
        )
    ),
)
"""Rows of the table of goals: name, where the figure is, decimals, and the goal over the sets."""
LOST_GOAL, MINUTES_GOAL = "under .01", "under 15"


def write(
    page: Path,
    *,
    results: Results,
    left: Mapping[str, Any],
    variants: Mapping[str, Mapping[str, Sequence[str]]],
    cleaning: Mapping[str, Any] | None,
    commands: Sequence[str],
    situations: Sequence[str],
    sure: float,
) -> None:
    """Write the page, and beside it the plot of the learning curve.

    Args:
        results: by name. left: of step g. variants: settings of steps t, k, d and e by name.
        cleaning: the dataset's report; None where nothing was run. commands: that made store, dataset and runs.
    """
    parts = [_head(results)]
    if results and cleaning is not None:
        parts += [_protocol(cleaning)]
    parts += [_goals(results), _spread(results), _numbers(results), _likelihood(results)]
    parts += [_variants("Training", TRAINING_TEXT, results, variants.get("t", {}), beside="best-0")]
    parts += [_kicks(results, variants.get("k", {})), _plans(left)]
    parts += [_variants("What each part gains", ABLATIONS_TEXT, results, variants.get("d", {}))]
    parts += [_variants("Rare commands", REMEDIES_TEXT, results, variants.get("e", {}), rare=True)]
    curve = left.get("curve")
    if curve:
        parts.append(_curve(curve, results, plot=f"{page.stem}.svg"))
    if "agreement" in left:
        parts.append(_left(left, results, situations=situations, sure=sure))
    parts.append(_reproduce(results, commands))
    page.parent.mkdir(parents=True, exist_ok=True)
    if curve:
        write_atomic(page.with_suffix(".svg"), plot(curve).encode())
    write_atomic(page, ("\n\n".join(filled(part.strip()) for part in parts if part) + "\n").encode())


def filled(text: str) -> str:
    """Paragraphs wrapped to WIDTH; tables, headings, pictures and code stay."""
    blocks = text.split("\n\n")
    kept = ("|", "#", "!", "```")
    return "\n\n".join(
        block
        if block.startswith(kept)
        else textwrap.fill(" ".join(block.split()), WIDTH, break_long_words=False, break_on_hyphens=False)
        for block in blocks
    )


def _sets(results: Results) -> list[str]:
    return list(next(iter(results.values()))["sets"]) if results else []


def seeds(results: Results) -> list[Mapping[str, Any]]:
    return [result for name, result in results.items() if name.startswith("best-")]


def value(figure: Any) -> float:
    """The number of a figure with or without an interval; NaN where it is undefined."""
    if isinstance(figure, Mapping):
        figure = figure["value"]
    return float("nan") if figure is None else float(figure)


def mean(several: Sequence[Mapping[str, Any]], name: str, find: Callable[[Any], Any], who: str = "all") -> float:
    """Of some results, the mean of a figure on a set."""
    return float(np.mean([value(find(result["sets"][name][who])) for result in several]))


def percent(share: float | None) -> str:
    return NOTHING if share is None else f"{100 * share:.0f} %"


def number(figure: float, digits: int) -> str:
    return NOTHING if not np.isfinite(figure) else f"{figure:.{digits}f}"


def signed(figure: float, digits: int) -> str:
    return NOTHING if not np.isfinite(figure) else f"{figure:+.{digits}f}"


def table(headers: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [headers, ["---"] * len(headers), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _head(results: Results) -> str:
    text = """# Fidelity

How well clones of HELIOS_base predict the team, compared with the goals of the project; what each part of the preset
`best` contributes; and which errors remain. Both teams played with the full state; [what the figures
mean](figures.md#full-state) says what changes without it. `make ablations MATCHES=folder` runs everything and writes
this
page; no result on it is typed by hand."""
    if not results:
        text += "\n\nNothing has been run yet: the page holds the goals only."
    return text


def _protocol(cleaning: Mapping[str, Any]) -> str:
    by_split: dict[str, list[Mapping[str, Any]]] = {}
    for match in cleaning["matches"]:
        by_split.setdefault(match["split"], []).append(match)
    rows = []
    for split, matches in by_split.items():
        for opponent in sorted({match["opponent"] for match in matches}):
            those = [match for match in matches if match["opponent"] == opponent]
            counts = [sum(match["rows"][kind] for match in those) for kind in KINDS]
            rows.append([split, opponent, str(len(those)), *(f"{count:,}" for count in counts)])
    order = ("train", "validation", "test", "unseen")
    rows.sort(key=lambda row: (order.index(row[0]) if row[0] in order else len(order), row[1]))
    return f"""## Protocol

Whole matches are for training, validation or test, never for two of these. A row is a command that the server
received of a field player in play_on; the goalkeeper is recognised by the state flag of the log, not by the number.
Goalkeepers' commands
are among the rows for training, and in no other split. Validation chose the settings and the checkpoint (`best-loss`);
the test matches and the unseen opponent were used only to write this page. Cells with slashes give the sets in one
order: each test match, then all matches of the unseen opponent.

{table(("split", "opponent", "matches", *KINDS), rows)}"""


def _columns(results: Results) -> list[tuple[str, list[Mapping[str, Any]]]]:
    """Who stands in the table of goals, with their results."""
    columns = []
    if seeds(results):
        n = len(seeds(results))
        columns.append((f"`best`, mean of {n} seeds" if n > 1 else "`best`", seeds(results)))
    for name, title in (
        ("paper", "`paper`"),
        ("tree", "boosted trees"),
        ("markov", "Markov table"),
        ("persistence", "last command"),
        ("majority", "most frequent command"),
    ):
        if name in results:
            columns.append((title, [results[name]]))
    return columns


def _goals(results: Results) -> str:
    names, columns = _sets(results), _columns(results)
    rows = []
    for title, find, digits, goal in FIGURES:
        rows.append([title, goal])
        for _, several in columns:
            # Trees say the command alone.
            silent = several[0]["name"] == "tree" and "error" in title and "ECE" not in title
            cells = [NOTHING if silent else number(mean(several, name, find), digits) for name in names]
            rows[-1].append(NOTHING if set(cells) == {NOTHING} else " / ".join(cells))
    lost, minutes = (
        ["accuracy lost on unseen opponents", LOST_GOAL],
        ["training time, minutes, the quickest seed", MINUTES_GOAL],
    )
    for _, several in columns:
        accuracies = [mean(several, name, FIGURES[0][1]) for name in names]
        known = [figure for figure, name in zip(accuracies, names, strict=True) if name != "unseen"]
        lost.append(signed(np.mean(known) - accuracies[-1], 3) if known and "unseen" in names else NOTHING)
        times = [(result["seconds"] / 60, result["machine"]["threads"]) for result in several if "seconds" in result]
        minutes.append("{:.1f} on {} threads".format(*min(times)) if times else NOTHING)
    about = ""
    if results:
        tackles = [next(iter(results.values()))["sets"][name]["all"]["commands"]["tackle"]["support"] for name in names]
        kicks = [next(iter(results.values()))["sets"][name]["all"]["commands"]["kick"]["support"] for name in names]
        about = f"""
Sets: {" / ".join(names)}. There are {" / ".join(f"{count:,}" for count in tackles)} tackles and
{" / ".join(f"{count:,}" for count in kicks)} kicks in them, so the recall of tackles is uncertain. `-` stands where
nothing is predicted or nothing occurs. Rules give a constant for each parameter, the median of training.
"""
    return f"""## Goals and figures

Goals with slashes are for the test match against WEBase, the one against Cyrus2DBase, and the unseen opponent.
{about}
{table(("figure", "goal", *(title for title, _ in columns)), [*rows, lost, minutes])}"""


def _spread(results: Results) -> str:
    """Seeds apart, and intervals where a set has several matches."""
    several = [result for result in (*seeds(results), results.get("paper")) if result is not None]
    if not several:
        return ""
    rows = []
    for result in several:
        for name in _sets(results):
            section = result["sets"][name]["all"]
            cells = []
            for figure, digits in (("accuracy", 4), ("cross_entropy", 4), ("ece", 4)):
                item = section["model"][figure]
                text = number(value(item), digits)
                if item["low"] is not None:
                    text += f" [{item['low']:.{digits}f}, {item['high']:.{digits}f}]"
                cells.append(text)
            rows.append([f"`{result['name']}`", name, f"{section['rows']:,}", str(section["matches"]), *cells])
    headers = ("result", "set", "rows", "matches", "accuracy", "cross-entropy", "ECE")
    return f"""## Seeds and intervals

Brackets are 95 % intervals by bootstrap over whole matches. One match gives none, and from fewer than ten they are
too narrow: take them as the spread seen so far.

{table(headers, rows)}"""


def _numbers(results: Results) -> str:
    rows = []
    for title, several in _columns(results):
        cells = [
            " / ".join(number(mean(several, name, find, who), 3) for name in _sets(results))
            for find in (FIGURES[0][1], FIGURES[1][1])
            for who in ("all", "2-11")
        ]
        rows.append([title, *cells])
    if not rows:
        return ""
    headers = ("", "accuracy, field players", "players 2-11", "cross-entropy, field players", "players 2-11")
    return f"""## Field players, and players 2 to 11

A team may give its goalkeeper another number than 1. Then number 1 plays in the field, where a model that identifies
players by number has never seen that number. The first column counts every field player; the second leaves number 1
out.

{table(headers, rows)}"""


def _likelihood(results: Results) -> str:
    several = seeds(results)
    if not several:
        return ""
    rows = []
    for kind, even in even_log_loss(KINDS).items():
        losses = [mean(several, name, _command(kind, "parameter_log_loss")) for name in _sets(results)]
        rows.append([kind, *(number(loss, 2) for loss in losses), number(float(even), 2)])
    return f"""## Likelihood of parameters

Mean -ln of the likelihood that `best` gave to the parameters of the command given, nats per unit of power and
degree; lower is better.

{table(("command", *_sets(results), "an even guess"), rows)}"""


ABLATIONS_TEXT = """`without-X` leaves out a block of inputs, for the command and for the kick; `with-X` adds one for
the command; the others change the settings shown. Changes are to `plain`, which gets the other players as lists of the
nearest and is trained by Adam without mirrored samples, on the shorter schedule. Positive nats are worse, for the
cross-entropy of the command and for the log loss of parameters."""
TRAINING_TEXT = """Variants of how the preset is trained, compared with `best-0`, each in full length: `adam` updates
all weights by Adam, as the paper does; `without-mirror` trains without mirrored samples."""
REMEDIES_TEXT = """Common remedies for rare commands, compared with `plain` on the same shorter schedule. The
class probabilities of balanced trainings are corrected for the balance unless `train.prior_correction`
is off. `ensemble` trains three networks side by side."""


KICKS_TEXT = {
    "short": "`short` is the preset `best` on the shorter schedule.",
    "without-plan": "`without-plan` has no block `plan`.",
    "plan-of-kicks": "`plan-of-kicks` gives it to the kick layers only.",
    "without-attention": """In `without-attention` the kick layers get, of the other players, only the plan and the two
of each side that are nearest to the ball.""",
    "without-kicks": "`without-kicks` shows no extra kicks beside the batches.",
    "plain": """`plain` has no plan and gets the other players as lists of the nearest; it is trained by Adam, without
mirrored samples and without extra kicks.""",
}


def _kicks(results: Results, variants: Mapping[str, Sequence[str]]) -> str:
    """Of step k."""
    made = [name for name in ("short", *variants, "plain") if name in results]
    if len(made) < 2:
        return ""
    names = _sets(results)

    def cell(name: str, find: Callable[[Any], Any], digits: int) -> str:
        return " / ".join(number(mean([results[name]], item, find), digits) for item in names)

    rows = [
        [
            f"`{name}`",
            ", ".join(f"`{setting}`" for setting in variants.get(name, ())),
            *(cell(name, _parameter("kick_direction", what), 1) for what in ("mean", "median")),
            cell(name, _parameter("kick_power", "mean"), 1),
            cell(name, _command("kick", "parameter_log_loss"), 2),
            number(results[name]["seconds"] / 60, 1),
        ]
        for name in made
    ]
    headers = (
        *("variant", "settings", "kick direction, mean error, deg", "median error, deg", "kick power, mean error"),
        *("log loss of both, nats", "minutes"),
    )
    return f"""## Kicks

Errors of kicks, by what the network gets of plans with the ball and of the other players, and by how often kicks are
shown. {" ".join(KICKS_TEXT[name] for name in made if name in KICKS_TEXT)}

{table(headers, rows)}"""


def _variants(
    heading: str,
    text: str,
    results: Results,
    variants: Mapping[str, Sequence[str]],
    *,
    beside: str = "plain",
    rare: bool = False,
) -> str:
    """Results of one step beside another result."""
    made = [name for name in variants if name in results]
    if not made or beside not in results:
        return ""
    names, base = _sets(results), results[beside]
    accuracy, entropy = FIGURES[0][1], FIGURES[1][1]
    rows = []
    for name in (beside, *made):
        several = [results[name]]

        def change(find: Callable[[Any], Any], digits: int, factor: float = 1.0, *, of: Any = several) -> str:
            return " / ".join(
                signed(factor * (mean(of, item, find) - mean([base], item, find)), digits) for item in names
            )

        cells = [
            " / ".join(number(mean(several, item, entropy), 3) for item in names),
            NOTHING if name == beside else change(entropy, 4),
            " / ".join(number(mean(several, item, accuracy), 3) for item in names),
            NOTHING if name == beside else change(accuracy, 2, 100),
        ]
        if rare:
            for kind in ("kick", "tackle"):
                pairs = [
                    [number(mean(several, item, _command(kind, what)), 2) for what in ("recall", "precision")]
                    for item in names
                ]
                cells.append(" / ".join(", ".join(pair) for pair in pairs))
            cells.append(" / ".join(number(mean(several, item, _model("ece")), 4) for item in names))
        else:
            for kind in ("dash", "turn", "kick"):
                loss = _command(kind, "parameter_log_loss")
                cells.append(NOTHING if name == beside else change(loss, 3))
        settings = "" if name == beside else ", ".join(f"`{setting}`" for setting in variants[name])
        rows.append([f"`{name}`", settings, *cells, number(results[name]["seconds"] / 60, 1)])
    headers = ["variant", "settings", "cross-entropy", "change, nats", "accuracy", "change, points"]
    if rare:
        headers += ["kick: recall, precision", "tackle: recall, precision", "ECE"]
    else:
        headers += [f"parameters of {kind}, change, nats" for kind in ("dash", "turn", "kick")]
    noise = ""
    if len(seeds(results)) > 1:
        spans = [np.ptp([value(entropy(result["sets"][item]["all"])) for result in seeds(results)]) for item in names]
        noise = (
            "\n\nOne seed each. The cross-entropies of the seeds of `best` lie "
            f"{' / '.join(number(float(span), 4) for span in spans)} nats apart: smaller changes are within that."
        )
    return f"## {heading}\n\n{text}{noise}\n\n{table([*headers, 'minutes'], rows)}"


def _curve(curve: Mapping[str, Any], results: Results, *, plot: str) -> str:
    names = list(curve)
    counts = next(iter(curve.values()))["matches"]
    points = {result["training_matches"]: result for name, result in results.items() if name.startswith("curve-")}
    points[results["plain"]["training_matches"]] = results["plain"]
    rows = []
    for place, count in enumerate(counts):
        entropies = " / ".join(number(curve[name]["cross_entropy"][place], 3) for name in names)
        accuracies = " / ".join(number(mean([points[count]], name, FIGURES[0][1]), 3) for name in names)
        rows.append([str(count), entropies, accuracies, number(points[count]["seconds"] / 60, 1)])
    fits = [
        [
            name,
            number(fit["floor"], 3),
            f"{number(fit['floor_low'], 3)} to {number(fit['floor_high'], 3)}",
            number(fit["exponent"], 2),
            *(f"{number(entropy, 3)} ({count} matches)" for count, entropy in fit["leads_to"].items()),
        ]
        for name, fit in curve.items()
    ]
    headers = ("set", "floor, nats", "without any one point", "exponent", "twice the matches", "ten times")
    return f"""## Learning curve

`plain`, see above; with few matches an epoch makes several passes (`data.repeat`). Every smaller set of matches is a
subset of the larger ones.

![Cross-entropy by training matches]({plot})

{table(("training matches", "cross-entropy", "accuracy", "minutes"), rows)}

A power law that falls to a floor, `floor + scale * matches ^ -exponent`, fitted by least squares. The floor is the
estimated cross-entropy with unlimited matches. From so few points it is a rough estimate, as the fits without any one
point show.

{table(headers, fits)}"""


def _plans(left: Mapping[str, Any]) -> str:
    """What is planned and what is done, of step g."""
    if "kicks" not in left:
        return ""
    kicks = [
        [name, f"{row['kicks']:,}", *(percent(row[key]) for key in ("as_planned", "among", "clone"))]
        for name, row in left["kicks"].items()
    ]
    tackles = [
        [name, f"{row['tackles']:,}", *(percent(row[key]) for key in ("as_planned", "clone"))]
        for name, row in left["tackles"].items()
    ]
    done = [
        [name, f"{row['rows']:,}"]
        + [percent(row[key]) for key in ("as_planned", "other_kick", "dash", "turn", "tackle")]
        for name, row in left["choices"].items()
    ]
    headers = ("set", "kicks", "as planned", "one of the ways planned", "as `best-0` says")
    return f"""What [plans](network.md#plans-with-the-ball) by the rules of HELIOS Base predict by themselves: the
share of kicks that give the ball the planned velocity, to four millimetres per cycle; the velocity of any planned
candidate; and the one that `best-0` gives as its answer.

{table(headers, kicks)}

Tackles in the planned direction, one of 40, and in the one that `best-0` gives.

{table(("set", "tackles", "as planned", "as `best-0` says"), tackles)}

Commands of players who can kick the ball, by the planned action. A player that continues an earlier plan dashes or
turns; the log does not show this.

{table(("planned", "commands", "kick as planned", "another kick", "dash", "turn", "tackle"), done)}"""


def _left(left: Mapping[str, Any], results: Results, *, situations: Sequence[str], sure: float) -> str:
    agreements = [
        [
            name,
            f"{100 * row['error']:.1f} %",
            *(f"{100 * row[key]:.0f} %" for key in ("systematic", "shared", "by_seed")),
            *(number(row[key], 3) for key in ("entropy", "chance", "doubt")),
        ]
        for name, row in left["agreement"].items()
    ]
    where = [
        [
            name,
            situation,
            f"{row['rows']:,}",
            f"{100 * row['share']:.1f} %",
            f"{100 * row['error']:.1f} %",
            number(row["cross_entropy"], 3),
            f"{100 * row['share_of_errors']:.0f} %",
            f"{100 * row['share_of_nats']:.0f} %",
        ]
        for name, found in left["situations"].items()
        for situation in situations
        if (row := found.get(situation)) is not None
    ]
    ensemble = []
    for name, found in left["ensemble"].items():
        section = found["all"]
        single = [mean(seeds(results), name, find) for find in (FIGURES[0][1], FIGURES[1][1], FIGURES[2][1])]
        cells = [value(find(section)) for find in (FIGURES[0][1], FIGURES[1][1], FIGURES[2][1])]
        ensemble.append(
            [name, *(f"{number(one, 4)} ({number(other, 4)})" for one, other in zip(cells, single, strict=True))]
        )
    return f"""## What is left

Errors of {left["seeds"]} seeds of `best`. Systematic: all seeds make the error and are
{100 * sure:.0f} % sure of it on average, so the inputs lack the cause, or the agent acted on something that is not in
the log (its noisy sight, its memory). Shared, unsure: all make it with low confidence. By seed: only some make it,
which more training data or an ensemble can correct. The entropy is what a calibrated model expects of its own
cross-entropy; the part on which the seeds agree is randomness given these inputs, the rest is uncertainty about the
weights.

{
        table(
            ("set", "errors", "systematic", "shared, unsure", "by seed", "entropy, nats", "chance", "doubt"),
            agreements,
        )
    }

The mean of the probabilities of all seeds; in brackets a single seed.

{table(("set", "accuracy", "cross-entropy", "ECE"), ensemble)}

Errors by situation. To find the first player at the ball, the ball is assumed to roll on freely.

{table(("set", "situation", "rows", "share", "errors", "cross-entropy", "of all errors", "of all nats"), where)}"""


def _reproduce(results: Results, commands: Sequence[str]) -> str:
    text = "## Reproduce\n\n```sh\nmake ablations MATCHES=folder\n```"
    if commands:
        listing = "\n".join(commands)
        text += "\n\nruns these commands, and the measurements between them, with the logs in `MATCHES`:"
        text += f"\n\n```\n{listing}\n```"
    if results:
        text += "\n\n" + machines(result["machine"] for result in results.values())
    return text


def machines(found: Iterable[Mapping[str, Any]]) -> str:
    """A sentence on where results were made, and with which versions."""
    found = {
        f"{machine['processor']}, {machine['threads']} threads; teamclone {machine['teamclone']}, "
        f"PyTorch {machine['torch']}, NumPy {machine['numpy']}, Python {machine['python']}"
        for machine in found
    }
    return f"Machine and versions: {'; and '.join(sorted(found))}."


def plot(curve: Mapping[str, Any]) -> str:
    """Cross-entropy by training matches with the fitted curves and their floors, as SVG for light and dark pages."""
    style = {
        "svg.hashsalt": "teamclone",
        "font.size": 9.0,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "legend.frameon": False,
    }
    with mpl.rc_context(style):
        figure = Figure(figsize=(7.4, 3.6), layout="constrained", facecolor="white")
        axes = figure.subplots()
        for colour, (name, fit) in zip(COLOURS, curve.items(), strict=False):
            axes.plot(fit["matches"], fit["cross_entropy"], "o", color=colour, label=name, markersize=5)
            along = np.geomspace(fit["matches"][0], 4 * fit["matches"][-1], 100)
            axes.plot(along, fit["floor"] + fit["scale"] * along ** -fit["exponent"], color=colour, linewidth=1.2)
            axes.axhline(fit["floor"], color=colour, linewidth=0.9, linestyle=(0, (3, 3)))
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(FixedLocator(next(iter(curve.values()))["matches"]))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(ScalarFormatter())
        axes.set_xlabel("training matches, log scale")
        axes.set_ylabel("cross-entropy, nats")
        axes.set_title("dashed: the floor of each fit", fontsize=9, loc="right", color="#5d6872")
        axes.legend()
        stream = io.StringIO()
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    text = stream.getvalue()
    return "\n".join(line.rstrip() for line in text.splitlines()) + "\n"
