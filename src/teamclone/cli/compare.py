"""`teamclone compare`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer


def compare(
    original: Annotated[
        str, typer.Argument(metavar="ORIGINAL_STORE", help="Store with matches of the team, a folder or a URL.")
    ],
    clone: Annotated[
        str, typer.Argument(metavar="CLONE_STORE", help="Store with matches of the clone against the same opponents.")
    ],
    team: Annotated[str, typer.Option(help="Name of the team.")],
    clone_team: Annotated[
        str | None, typer.Option(help="Name under which the clone plays; the team's unless given.")
    ] = None,
    opponent: Annotated[
        list[str] | None, typer.Option(help="Compare against this opponent only; repeatable.", show_default=False)
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder to write compare.html and compare.json into.")] = Path("compare"),
    seed: Annotated[int, typer.Option(min=0, help="Of random halves and resamples.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print compare.json.")] = False,
) -> None:
    """Compare a clone with the team in whose place it plays: how far, in units of the team's own spread."""
    from teamclone.cli.common import fail, print_json, progress
    from teamclone.comparison.compare import compare as compared
    from teamclone.comparison.compare import write_comparison
    from teamclone.store import open_store

    with progress("compare") as bar:
        task = bar.add_task("", total=None)
        found = compared(
            open_store(original),
            open_store(clone),
            team=team,
            clone_team=clone_team,
            opponents=opponent or (),
            seed=seed,
            on_progress=lambda work, done, total: bar.update(task, completed=done, total=total, description=work),
        )
        bar.update(task, description="write the page", total=None)
        write_comparison(found, out)
    if as_json:
        print_json(found.document)
    else:
        for group in found.document["groups"]:
            show(found.document, group)
        for text in summary(found.document):
            print(text)
        print(f"Wrote {out / 'compare.html'} and {out / 'compare.json'}")
    if found.failed:
        fail("; ".join(found.failed), code=1)


def show(document: Mapping[str, Any], group: Mapping[str, Any]) -> None:
    """Print a group as a table."""
    from teamclone.cli.common import print_table
    from teamclone.comparison import words

    unit = {one["name"]: one["unit"] for one in document["statistics"]}
    numbers = "{original} matches of the original, {clone} of the clone".format(**group["matches"])
    print_table(
        ("statistic", "unit", "original", "clone", "own distance", "distance", "in units"),
        [
            (
                words.name_of(name := row["statistic"]),
                "" if unit[name] == "share" else unit[name],
                words.with_interval(row["original"], unit[name]),
                words.with_interval(row["clone"], unit[name]),
                words.amount(row.get("own"), unit[name]),
                words.amount(row.get("distance"), unit[name]),
                words.units(row),
            )
            for row in group["statistics"]
        ],
        title=f"{words.label_of(group)}: {numbers}",
        numeric=range(2, 7),
    )
    print()


def summary(document: Mapping[str, Any]) -> list[str]:
    """Return the finding, and how many matches were left out for which reason."""
    from collections import Counter

    from teamclone.cli.common import visible
    from teamclone.comparison.page import sentence

    reasons = Counter((one["whose"], one["opponent"], one["reason"]) for one in document["left_out"])
    return [
        sentence(document),
        *(
            visible(f"Left out {count} of the {whose}'s matches, against {opponent or 'nobody'}: {reason}")
            for (whose, opponent, reason), count in sorted(reasons.items())
        ),
    ]
