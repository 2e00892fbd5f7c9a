"""`teamclone similar`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer


def similar(
    store: Annotated[str, typer.Argument(metavar="STORE", help="Store with matches of the teams, a folder or a URL.")],
    run: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Run folders of clones, one of each team.")],
    team: Annotated[
        list[str] | None, typer.Option(help="Ask about this team of the store only; repeatable.", show_default=False)
    ] = None,
    log: Annotated[
        list[Path] | None,
        typer.Option(help="Say whom the teams of this game log play like; repeatable.", show_default=False),
    ] = None,
    most: Annotated[int, typer.Option(min=1, help="Predict the newest so many matches of each team.")] = 4,
    checkpoint: Annotated[str, typer.Option(help="Which weights.")] = "best-loss",
    out: Annotated[Path, typer.Option(help="Folder to write similar.html and similar.json into.")] = Path("similar"),
    seed: Annotated[int, typer.Option(min=0, help="Of the resamples.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print similar.json.")] = False,
) -> None:
    """Say which teams play alike, by how well the clone of each predicts the commands of each."""
    from teamclone.cli.common import fail, print_json, progress, say
    from teamclone.similarity.page import sentences
    from teamclone.similarity.similar import similar as compared
    from teamclone.similarity.similar import write_similarity
    from teamclone.store import open_store

    with progress("similar") as bar:
        task = bar.add_task("", total=None)
        found = compared(
            open_store(store),
            run,
            teams=team or (),
            logs=log or (),
            most=most,
            checkpoint=checkpoint,
            seed=seed,
            on_progress=lambda work, done, total: bar.update(task, completed=done, total=total, description=work),
        )
        bar.update(task, description="write the page", total=None)
        write_similarity(found, out)
    if as_json:
        print_json(found.document)
    else:
        show(found.document)
        for text in sentences(found.document):
            say(text)
        say(f"Wrote {out / 'similar.html'} and {out / 'similar.json'}")
    if found.failed:
        fail("; ".join(found.failed), code=1)


def show(document: Mapping[str, Any]) -> None:
    """Print the tables."""
    from teamclone.cli.common import print_table, say

    clones = [one["team"] for one in document["clones"]]
    print_table(
        ("team", "matches", *(f"clone of {clone}" for clone in clones), "its shares"),
        [
            (
                row["team"],
                len(row["matches"]),
                *(f"{one['value']:.3f}" for one in row["loss"]),
                f"{row['constant']:.3f}",
            )
            for row in document["teams"]
        ],
        title="log loss, nats a command",
        numeric=range(1, len(clones) + 3),
    )
    say()
    print_table(
        ("of a match", "stretches", "right"),
        [
            (one["window"], one["stretches"], f"{one['right'] / one['stretches']:.1%}" if one["stretches"] else "")
            for one in document["guesses"]
        ],
        title="whose match is it",
        numeric=(1, 2),
    )
    say()
    for text in document["left_out"]:
        say(f"Left out: {text}")
