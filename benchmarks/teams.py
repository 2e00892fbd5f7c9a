"""Clones of several teams, one clone of them all, and how it adapts to a team that it never played as.

    python benchmarks/teams.py MATCHES --out DIR [--teams A B C] [--new NAME] [--page docs/explanation/teams.md]

MATCHES is a folder of logs. Each of the teams gets a dataset and a clone of its own by preset best, split by whole
match, and so do all of them together: the base. `adapting.py` then adapts the base to the new team, whose test matches
the base does not see from its side either. What is there in DIR is not done again.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fidelity import TEST_MATCHES
from fidelity_page import filled, machines, table
from measure import Commands, cost_of

from teamclone.system.documents import write_document
from teamclone.system.files import write_atomic
from teamclone.training.config import load_config
from teamclone.training.run import open_run

BASE = "all of them"
COUNTS = (1, 3, 10)
OF_TWO = ("accuracy", "cross-entropy, nats")
HEADERS = (
    "clone of", "training matches", "samples", "minutes", "test matches", "rows", "accuracy", "cross-entropy, nats",
    "ECE", "kick, recall", "kick direction, median, mean error, deg", "turn, mean error, deg", "dash power, mean error",
    "last command, accuracy",
)  # fmt: skip


class Work:
    """The folder of the benchmark."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options, self.out = options, Path(options.out)
        self.held_out = [part for match in options.test_match for part in ("--test-match", match)]
        self.commands = Commands({options.matches: "MATCHES", self.out: "DIR"})

    def clone(self, name: str, teams: Sequence[str]) -> dict[str, Any]:
        """Dataset, clone and figures of some teams."""
        data, run = self.out / "datasets" / name, self.out / "runs" / name
        ended = self.out / "runs" / f"{name}.json"
        held_out = self.held_out if name == "base" else []
        self.commands.run(
            *("dataset", "--store", self.out / "store", *(part for team in teams for part in ("--team", team))),
            *("--commands", "received", "--train-goalkeepers", *held_out, "--out", data),
            made=data,
        )
        settings = [part for setting in self.options.set for part in ("--set", setting)]
        if not ended.is_file():
            shutil.rmtree(run, ignore_errors=True)
        seconds = self.commands.run("train", data, "--preset", "best", *settings, "--out", run, made=ended)
        if seconds is not None:
            write_document(ended, {"seconds": seconds})
        self.commands.run("evaluate", run, made=run / "evaluation.json")
        figures = json.loads((run / "evaluation.json").read_text(encoding="utf-8"))["splits"]["test"]
        matches = json.loads((data / "dataset.json").read_text(encoding="utf-8"))["matches"]
        return {
            "seconds": json.loads(ended.read_text(encoding="utf-8"))["seconds"],
            "training_matches": sum(match["split"] == "train" for match in matches),
            "samples": open_run(run).history()[-1]["samples"],
            "machine": open_run(run).environment,
            "test": figures,
        }

    def adapted(self) -> dict[str, Any]:
        """What `adapting.py` finds of the new team."""
        path = self.out / "adapted.json"
        command = [
            *(str(Path(__file__).with_name("adapting.py")), str(self.out / "store")),
            *("--base", str(self.out / "runs" / "base"), "--team", self.options.new),
            *("--commands", "received", *self.held_out, "--json"),
            *("--matches", *map(str, COUNTS)),
        ]
        text = " ".join(("python benchmarks/adapting.py", *command[1:]))
        self.commands.shown.append(text.replace(str(self.out), "DIR"))
        if not path.is_file():
            print(f"{path} ...", file=sys.stderr, flush=True)
            with path.with_suffix(".part").open("wb") as file:
                cost_of(sys.executable, *command, output=file)
            path.with_suffix(".part").replace(path)
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return found


def figures_of(name: str, clone: Mapping[str, Any]) -> list[str]:
    test = clone["test"]
    model, kick, parameters = test["model"], test["commands"]["kick"], test["parameters"]
    return [
        name,
        str(clone["training_matches"]),
        f"{clone['samples']:,}",
        f"{clone['seconds'] / 60:.1f}",
        str(len(test["matches"])),
        f"{test['rows']:,}",
        f"{model['accuracy']['value']:.3f}",
        f"{model['cross_entropy']['value']:.3f}",
        f"{model['ece']['value']:.4f}",
        f"{kick['recall']['value']:.2f}",
        f"{parameters['kick_direction']['median']:.1f}, {parameters['kick_direction']['mean']['value']:.1f}",
        f"{parameters['turn_moment']['mean']['value']:.1f}",
        f"{parameters['dash_power']['mean']['value']:.1f}",
        f"{test['baselines']['persistence']['accuracy']['value']:.3f}",
    ]


def page(work: Work, clones: Mapping[str, Mapping[str, Any]], adapted: Mapping[str, Any]) -> str:
    new = work.options.new
    met = len(adapted["met_by_base"])
    rows = [["0", "0", "", *_pair(adapted["unadapted"]), "", "", ""]]
    rows += [
        [str(row["matches"]), f"{row['samples']:,}", *_cells(row["adapted"]), *_cells(row["fresh"])]
        for row in adapted["curve"]
    ]
    settings = f" with {', '.join(f'`{setting}`' for setting in work.options.set)}" if work.options.set else ""
    seen = "None of them is among the base's training matches, seen from the other side."
    if met:
        seen = f"The base was trained on {met} of them, seen from the other side."
    parts = [
        "# Several teams",
        f"""Clones of {len(work.options.teams)} teams, one clone of them all, and how that one adapts to a team that it
was not trained on. `python benchmarks/teams.py MATCHES --out DIR --page docs/explanation/teams.md` makes all and
writes this page.""",
        "## A clone for each team",
        f"""Preset `best`{settings}; whole matches for training, validation or test. Samples are those of an epoch. A
match of two of these teams counts twice for the clone of them all, seen from either side.""",
        table(HEADERS, [figures_of(name, clone) for name, clone in clones.items()]),
        "## Few matches of a new team",
        f"""The clone of them all, adapted to {new} ([adapt](../reference/commands/adapt.md)) with some matches,
beside a fresh network of the
same form that goes through as many batches, on {adapted["environment"]["threads"]} threads; both are tested on
{len(adapted["matches"])} matches of {adapted["rows"]:,} commands. {seen}""",
        table(("training matches", "samples", "adapted, s", *OF_TWO, "fresh, s", *OF_TWO), rows),
        "## Reproduce",
        "```\n" + "\n".join(work.commands.shown) + "\n```",
        machines([*(clone["machine"] for clone in clones.values()), adapted["environment"]]),
    ]
    return "\n\n".join(filled(part) for part in parts)


def _pair(figures: Mapping[str, float]) -> tuple[str, str]:
    return f"{figures['accuracy']:.3f}", f"{figures['cross_entropy']:.3f}"


def _cells(figures: Mapping[str, float]) -> tuple[str, str, str]:
    return (f"{figures['seconds']:.0f}", *_pair(figures))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("matches", type=Path, help="folder of logs")
    parser.add_argument("--out", type=Path, required=True, help="folder of the benchmark")
    parser.add_argument("--teams", nargs="+", default=["WEBase", "Cyrus2DBase", "YuShan2024"])
    parser.add_argument("--new", default="HELIOS_base", help="the team to adapt to")
    parser.add_argument("--test-match", nargs="*", default=list(TEST_MATCHES), help="of the new team")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="beside preset best")
    parser.add_argument("--page", type=Path, help="the page to write; default DIR/teams.md")
    options = parser.parse_args()
    load_config("best", options.set)  # a wrong setting is reported before the work
    work = Work(options)
    work.commands.run("ingest", options.matches, "--store", work.out / "store", made=work.out / "store")
    clones = {team: work.clone(team, [team]) for team in options.teams}
    clones[BASE] = work.clone("base", options.teams)
    adapted = work.adapted()
    written = options.page or work.out / "teams.md"
    write_atomic(written, (page(work, clones, adapted) + "\n").encode())
    print(written)


if __name__ == "__main__":
    main()
