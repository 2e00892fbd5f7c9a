"""`teamclone live`: clones in a match that is being played."""

from __future__ import annotations

import typer

from teamclone.cli import live_team, live_watch

app = typer.Typer(help="Put a clone into a match that is being played.", no_args_is_help=True, rich_markup_mode=None)
app.command("team")(live_team.team)
app.command("watch")(live_watch.watch)
