"""`teamclone matches`."""

from __future__ import annotations

from typing import Annotated, Any

import typer


def matches(
    store: Annotated[str, typer.Option(help="A folder or postgresql://USER:PASSWORD@HOST/DATABASE.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print all columns of the table matches as JSON.")] = False,
) -> None:
    """List the matches of a store."""
    from teamclone.cli.common import print_json, print_table
    from teamclone.store import open_store

    rows = open_store(store).matches().to_pylist()
    if as_json:
        print_json(rows)
        return
    print_table(
        ("match", "started", "left", "score", "right", "frames", "play_on", "commands", "source", "log", "complete"),
        [
            (
                row["match_id"],
                row["started_at"] or "",
                row["left_name"] or "-",
                score(row),
                row["right_name"] or "-",
                row["n_frames"],
                row["n_play_on_frames"],
                row["n_commands"],
                source(row),
                row["log_version"],
                "yes" if row["complete"] else "no",
            )
            for row in rows
        ],
        numeric=(5, 6, 7),
    )
    print(f"{len(rows)} matches")


def source(row: dict[str, Any]) -> str:
    """Return where the commands of a match are known from."""
    return "logged" if row["command_log"] else "recovered" if row["n_commands"] else "-"


def score(row: dict[str, int]) -> str:
    """Return a score, ``2 : 1``, with the penalties of a shoot-out in brackets: ``0 (3) : 0 (4)``."""
    penalties = any(row[f"{side}_penalties_{what}"] for side in ("left", "right") for what in ("scored", "missed"))
    return " : ".join(
        f"{row[f'{side}_score']} ({row[f'{side}_penalties_scored']})" if penalties else f"{row[f'{side}_score']}"
        for side in ("left", "right")
    )
