"""`teamclone dataset`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from teamclone.cli.common import choice, print_json, print_table, progress, say

if TYPE_CHECKING:
    from teamclone.dataset.build import DatasetConfig


def dataset(
    store: Annotated[
        str, typer.Option(help="The store to read: a folder or postgresql://USER:PASSWORD@HOST/DATABASE.")
    ],
    team: Annotated[list[str], typer.Option(help="The team to clone, as its logs name it; repeatable.")],
    out: Annotated[Path, typer.Option(help="The folder to write.")],
    unseen: Annotated[list[str] | None, typer.Option(help="An opponent to keep out of training; repeatable.")] = None,
    split: Annotated[str, typer.Option(help="match: whole matches; rows: the paper's, which leaks.")] = "match",
    commands: Annotated[
        str, typer.Option(help="executed: those that the server carried out; received: also refused ones.")
    ] = ("executed"),
    turn_zero: Annotated[str, typer.Option(help="keep or drop (turn 0), which means doing nothing.")] = "keep",
    source: Annotated[
        str,
        typer.Option(
            help="logged: commands of command logs; recovered: those that game logs imply; any: logged, but recovered "
            "where there is no command log."
        ),
    ] = "any",
    train_goalkeepers: Annotated[
        bool, typer.Option("--train-goalkeepers", help="Train on goalkeepers' commands, too; never test on them.")
    ] = False,
    goalkeepers: Annotated[
        bool, typer.Option("--goalkeepers", help="Model goalkeepers like the other players, and catch as a command.")
    ] = False,
    set_plays: Annotated[
        bool, typer.Option("--set-plays", help="Take all play modes, not only play_on, and move as a command.")
    ] = False,
    idle: Annotated[
        bool, typer.Option("--idle", help="Take cycles without a body command as samples of a command none.")
    ] = False,
    percepts: Annotated[
        bool,
        typer.Option(
            "--percepts", help="Take situations as players without the full state believe them, from what they saw."
        ),
    ] = False,
    test: Annotated[float, typer.Option(help="Share of the matches for the test.", min=0, max=0.9)] = 0.15,
    validation: Annotated[float, typer.Option(help="Share of the matches for validation.", min=0, max=0.9)] = 0.15,
    test_match: Annotated[
        list[str] | None, typer.Option(help="Match id or part of a log name that must be a test match; repeatable.")
    ] = None,
    validation_match: Annotated[
        list[str] | None, typer.Option(help="As --test-match, for validation; repeatable.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the split.")] = 0,
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; one a processor unless given.")] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Work on the Dask cluster of this scheduler: tcp://host:port.")
    ] = None,
    replace: Annotated[bool, typer.Option(help="Put it in the place of a dataset that is already there.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the cleaning report as JSON.")] = False,
) -> None:
    """Clean a store and bind every command of one or more teams to the state it was decided on."""
    from teamclone.dataset.build import DatasetConfig, Sources, SplitBy
    from teamclone.dataset.clean import Commands, TurnZero

    config = DatasetConfig(
        teams=tuple(team),
        unseen=tuple(unseen or ()),
        split=choice(SplitBy, split, option="--split"),
        commands=choice(Commands, commands, option="--commands"),
        turn_zero=choice(TurnZero, turn_zero, option="--turn-zero"),
        source=choice(Sources, source, option="--source"),
        train_goalkeepers=train_goalkeepers,
        goalkeepers=goalkeepers,
        set_plays=set_plays,
        idle=idle,
        percepts=percepts,
        test_matches=tuple(test_match or ()),
        validation_matches=tuple(validation_match or ()),
        test=test,
        validation=validation,
        seed=seed,
    )
    report = _build(config, store, out, scheduler=scheduler, jobs=jobs, replace=replace)
    if as_json:
        print_json(report)
    else:
        _print(report, out, where="in play" if set_plays else "in play_on")


def _build(
    config: DatasetConfig, store: str, out: Path, *, scheduler: str | None, jobs: int | None, replace: bool
) -> dict[str, Any]:
    """Build the dataset behind a progress bar; return the cleaning report."""
    from teamclone.dataset.build import build_dataset
    from teamclone.store import open_store
    from teamclone.system.cluster import executor_of

    with executor_of(scheduler, jobs=jobs) as executor, progress("dataset") as bar:
        task = bar.add_task("", total=None)
        return build_dataset(
            config,
            store=open_store(store),
            out=out,
            executor=executor,
            jobs=jobs,
            replace=replace,
            on_progress=lambda done, total: bar.update(task, completed=done, total=total),
        )


def _print(report: dict[str, Any], out: Path, *, where: str) -> None:
    print_table(
        ["cleaning rule", "before", "after", "dropped"],
        [
            (rule["name"], f"{rule['before']:,}", f"{rule['after']:,}", f"{rule['before'] - rule['after']:,}")
            for rule in report["rules"]
        ],
        numeric=(1, 2, 3),
    )
    print()
    kinds = list(next(iter(report["rows"].values())))
    splits = {split: counts for split, counts in report["rows"].items() if sum(counts.values())}
    # Once each, though a match of two of the teams has an entry of either.
    matches_of = {
        split: len({match["match_id"] for match in report["matches"] if match["split"] == split}) for split in splits
    }
    print_table(
        ["split", "matches", *kinds, "rows"],
        [
            (split, matches_of[split] or "-", *(f"{count:,}" for count in counts.values()), f"{sum(counts.values()):,}")
            for split, counts in splits.items()
        ],
        numeric=range(1, len(kinds) + 3),
    )
    print()
    share = report["idle"] / max(report["player_cycles"], 1)
    print(
        f"{report['idle']:,} of {report['player_cycles']:,} player-cycles {where} ({share:.1%}) have no body "
        f"command, {report['frozen']:,} of them after a tackle or foul."
    )
    print(f"{report['turn_zero']:,} rows are (turn 0).")
    if report["recovered"]:
        print(f"{report['recovered']:,} rows are recovered: they are what game logs imply.")
    for match in report["matches"]:
        if match["left_out"]:
            say(f"{match['name']} is left out: {match['left_out']}.")
        elif match["odd_frames"]:
            odd = "missing or impossible numbers or unknown player types"
            say(f"{match['name']}: {match['odd_frames']} frames with {odd} are left out.")
    if without := report["matches_without_commands"]:
        names = ", ".join(without[:3]) + (", ..." if len(without) > 3 else "")
        say(f"{len(without)} match(es) have no commands to take and are in no split: {names}.")
    if report["matches_without_team"]:
        say(f"{report['matches_without_team']} match(es) of the store are without {report['team']}.")
    say(f"Wrote {out}")
