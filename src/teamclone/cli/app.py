"""The `teamclone` command: registers the commands and turns errors into one line and an exit code."""

from __future__ import annotations

import logging
import os
import re
import sys

import typer

from teamclone.cli import (
    adapt,
    bench,
    compare,
    dataset,
    evaluate,
    events,
    export,
    info,
    ingest,
    live,
    matches,
    percepts,
    pipeline,
    play,
    predict,
    replay,
    report,
    rollout,
    scout,
    search,
    similar,
    sql,
    train,
    validate,
)
from teamclone.cli.common import fail
from teamclone.cli.streams import open_streams
from teamclone.errors import TeamcloneError, UsageError

EXTRAS = {
    "torch": "train",
    "safetensors": "train",
    "tensorboard": "train",
    "matplotlib": "report",
    "scipy": "report",
    "jinja2": "report",
    "optuna": "search",
    "distributed": "cluster",
    "psutil": "play",
    "adbc_driver_postgresql": "postgresql",
    "adbc_driver_manager": "postgresql",
}
"""The extra that installs a package which the base does not."""

app = typer.Typer(
    name="teamclone",
    help="Learn how a RoboCup Soccer Simulation 2D team plays, from the logs of its matches.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for command in (
    pipeline.pipeline,
    play.play,
    info.info,
    validate.validate,
    ingest.ingest,
    events.events,
    percepts.percepts,
    matches.matches,
    sql.sql,
    dataset.dataset,
    train.train,
    adapt.adapt,
    search.search,
    predict.predict,
    rollout.rollout,
    replay.replay,
    evaluate.evaluate,
    report.report,
    bench.bench,
    compare.compare,
    similar.similar,
    scout.scout,
    export.export,
):
    app.command()(command)
app.add_typer(live.app, name="live")
app.command("run", hidden=True)(pipeline.run)


@app.callback(invoke_without_command=True)
def root(version: bool = typer.Option(False, "--version", help="Print the version and stop.")) -> None:
    """Set up logging to a terminal and answer ``--version``."""
    if sys.stderr.isatty():
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter("teamclone: %(message)s"))
        logging.getLogger("teamclone").addHandler(handler)
        logging.getLogger("teamclone").setLevel(logging.INFO)
    if version:
        from teamclone import __version__

        typer.echo(__version__)
        raise typer.Exit


_NO_MEMORY = "this needs more memory than there is; ask for less at once, or close other programs"
_OUT_OF_MEMORY = re.compile("can't allocate memory|out of memory", re.IGNORECASE)
"""What PyTorch says, whose error has no class of its own on processors."""


def main() -> None:
    """Run a command. Exit codes: 0 fine, 1 the work failed, 2 wrong usage, 130 interrupted."""
    open_streams()
    try:
        app()
    except UsageError as error:
        fail(str(error), code=2)
    except TeamcloneError as error:
        fail(str(error), code=1)
    except ModuleNotFoundError as error:
        missing = (error.name or "").partition(".")[0]
        if missing not in EXTRAS:
            raise
        fail(f"this needs {missing}: pip install 'teamclone[{EXTRAS[missing]}]'", code=1)
    except MemoryError:
        fail(_NO_MEMORY, code=1)
    except RuntimeError as error:
        if not _OUT_OF_MEMORY.search(str(error)):
            raise
        fail(_NO_MEMORY, code=1)
    except KeyboardInterrupt:
        fail("interrupted", code=130)
    except BrokenPipeError:
        # The reader of our output went away (`| head`); leave without a traceback at interpreter exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        fail(f"{where}{error.strerror or error}", code=1)
