"""`teamclone validate`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from teamclone.store.validate import MatchCheck


def validate(
    paths: Annotated[list[Path] | None, typer.Argument(help="Logs, folders of logs, or stores.")] = None,
    store: Annotated[
        str | None, typer.Option(help="Check this store: a folder or postgresql://USER:PASSWORD@HOST/DATABASE.")
    ] = None,
    physics: Annotated[
        bool, typer.Option("--physics", help="Compare every cycle of play with what the server's rules make of it.")
    ] = False,
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; one a processor unless given.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object a match, each on a line.")] = False,
) -> None:
    """Check logs or a store: can all be read, and is it possible? Exit code 1 if anything is wrong."""
    from itertools import chain

    from teamclone.cli.common import json_text, progress, say
    from teamclone.errors import UsageError
    from teamclone.store import is_store, open_store
    from teamclone.store.validate import validate_logs, validate_store

    logs = [path for path in paths or [] if not is_store(path)]
    stores: list[Path | str] = [path for path in paths or [] if is_store(path)]
    if store is not None:
        stores.append(store)
    if not logs and not stores:
        raise UsageError("expected logs, folders of logs or --store STORE, got nothing to validate")
    wrong = total = 0
    with progress("validate") as bar:
        task = bar.add_task("", total=None)

        def on_progress(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        for checked in chain(
            validate_logs(logs, physics=physics, jobs=jobs, on_progress=on_progress) if logs else (),
            *(
                validate_store(open_store(place), physics=physics, jobs=jobs, on_progress=on_progress)
                for place in stores
            ),
        ):
            say(json_text(as_object(checked)) if as_json else line(checked))
            total += 1
            wrong += bool(checked.wrong)
    if not as_json:
        print(f"{total} matches, {wrong} with something wrong")
    if wrong:
        raise typer.Exit(1)


def line(checked: MatchCheck) -> str:
    """Return a line about a match.

    ``ok     match.rcg.gz: 5999 frames, 700123 commands`` or ``wrong  ...`` with the first problem.
    """
    if not checked.wrong:
        return f"ok     {checked.name}: {checked.frames} frames, {checked.commands} commands" + physics_line(checked)
    first, *more = checked.wrong
    first = " ".join(first.split())
    name = "" if checked.name in first else f"{checked.name}: "
    return f"wrong  {name}{first}" + (f" ({len(more)} more; --json lists all)" if more else "")


def physics_line(checked: MatchCheck) -> str:
    """Return what a line says of the physics: empty where it was not asked for."""
    physics = checked.physics
    if physics is None:
        return ""
    if physics.left_out is not None:
        return f"; physics not checked: {physics.left_out}"
    missing = f", {physics.unknown} commands without a log" if physics.unknown else ""
    return f"; physics of {physics.cycles} cycles{missing}"


def as_object(checked: MatchCheck) -> dict[str, Any]:
    """Return the object that ``validate --json`` prints of a match."""
    from teamclone.cli.info import problem_json

    return {
        "name": checked.name,
        "match_id": checked.match_id,
        "ok": not checked.wrong,
        "frames": checked.frames,
        "commands": checked.commands,
        "error": checked.error,
        "problems": [problem_json(problem) for problem in checked.problems],
        "physics": None
        if checked.physics is None
        else {
            "cycles": checked.physics.cycles,
            "compared": dict(checked.physics.compared),
            "unknown_commands": checked.physics.unknown,
            "left_out": checked.physics.left_out,
        },
        "findings": [
            {
                "check": finding.check.name,
                "about": finding.check.about,
                "rows": finding.rows,
                "cycle": finding.cycle,
                "what": finding.what,
            }
            for finding in checked.findings
        ],
    }
