"""``similar``: teams beside each other, each match predicted by the clones of all."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from teamclone import __version__
from teamclone.dataset.layout import Split
from teamclone.errors import TeamcloneError, UsageError, choose
from teamclone.evaluation import bootstrap
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.logs import read_match
from teamclone.similarity import geometry
from teamclone.similarity.guess import guesses
from teamclone.similarity.watched import Floats, Watched, watch
from teamclone.store.of_team import TeamMatch, matches_by_team
from teamclone.store.postgres.location import masked
from teamclone.store.store import Store
from teamclone.system.documents import write_document

if TYPE_CHECKING:
    from teamclone.models.clone import Clone
    from teamclone.training.run import Run

FORMAT = 1
"""Format number of similar.json."""
MOST = 4
"""Matches of a team that are predicted unless told otherwise."""
LEAST_TEAMS = 3
"""So many teams with a clone and matches make a tree and a map."""

Progress = Callable[[str, int, int], None]
"""Called with the work, the steps done and their number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Similarity:
    """What `similar` found.

    Attributes:
        document: as in ``similar.json``.
        failed: an error for each match or log that could not be read.
    """

    document: dict[str, Any] = field(repr=False)
    failed: tuple[str, ...]


def similar(
    store: Store,
    runs: Sequence[Path | str],
    *,
    teams: Collection[str] = (),
    logs: Sequence[Path] = (),
    most: int = MOST,
    checkpoint: str = "best-loss",
    seed: int = 0,
    on_progress: Progress | None = None,
) -> Similarity:
    """Say which teams play alike: how well the clone of each predicts the commands of each.

    A clone is asked about matches of its own team only if it did not learn from them. A match that cannot be read does
    not stop the others.

    Args:
        store: matches of the teams.
        runs: run folders of clones, each of one team, no two of the same.
        teams: those of the store to ask about; empty for all.
        logs: game logs of teams that nobody knows, each side of which is attributed to a clone's team.
        most: the newest so many matches of each team are predicted.
        checkpoint: which weights of each run.
        seed: of the resamples.
        on_progress: called with the name of the work, the steps done and their number.

    Raises:
        UsageError: there are not two clones, or they do not fit together; a team is not in the store; nothing is left
            to predict.
        RunError: a run or checkpoint cannot be read.
        StoreError: the store cannot be read at all.
    """
    telling = on_progress or (lambda work, done, total: None)
    opened = _opened(runs)
    models = {run.team: run.load_model(checkpoint).eval() for run in opened}
    _same_commands(opened)
    chosen, left_out, failed = _chosen(store, opened, teams, most)
    if not chosen:
        raise UsageError("; ".join([f"{masked(store.location)}: no match is left to predict", *failed, *left_out]))
    watched = list(_watched(store, models, chosen, failed, telling))
    attributed = list(_attributed(models, logs, failed, telling))
    if not watched and not attributed:
        raise UsageError("; ".join(failed))
    return Similarity(
        document={
            "kind": "teamclone similarity",
            "format": FORMAT,
            "teamclone": __version__,
            "store": masked(store.location),
            "options": {"most": most, "checkpoint": checkpoint, "seed": seed, "level": bootstrap.LEVEL},
            "clones": [
                {"team": run.team, "run": str(run.path), "dataset": run.dataset_id, "family": run.config.model.family}
                for run in opened
            ],
            **_compared(watched, list(models), seed),
            "logs": attributed,
            "left_out": left_out,
            "failed": failed,
        },
        failed=tuple(failed),
    )


def write_similarity(similarity: Similarity, out: Path) -> None:
    """Write ``similar.json`` and ``similar.html`` into a folder."""
    from teamclone.similarity.page import render
    from teamclone.system.files import write_atomic

    out.mkdir(parents=True, exist_ok=True)
    write_document(out / "similar.json", similarity.document)
    write_atomic(out / "similar.html", render(similarity.document).encode())


# What is asked


def _opened(runs: Sequence[Path | str]) -> list[Run]:
    """Open the runs of at least two teams.

    Raises:
        UsageError: there are fewer, two of one team, or one of several teams. RunError: one cannot be read.
    """
    from teamclone.training.run import open_run

    found: dict[str, Run] = {}
    for run in map(open_run, map(Path, runs)):
        if " + " in run.team:
            raise UsageError(
                f"{run.path}: this clone is of several teams, {run.team}; expected clones of one team each"
            )
        if run.team in found:
            raise UsageError(
                f"{run.path}: {found[run.team].path} is of {run.team}, too; expected one clone of each team"
            )
        found[run.team] = run
    if len(found) < 2:
        raise UsageError("expected the runs of at least two teams")
    return list(found.values())


def _same_commands(runs: Sequence[Run]) -> None:
    """Raise UsageError unless all clones know the same commands, so that they are asked about the same ones."""
    first, *others = runs
    for run in others:
        if set(run.config.model.commands) != set(first.config.model.commands):
            raise UsageError(
                f"{run.path}: knows {', '.join(run.config.model.commands)}, {first.path} "
                f"{', '.join(first.config.model.commands)}; expected clones with the same commands"
            )


def _chosen(
    store: Store, runs: Sequence[Run], teams: Collection[str], most: int
) -> tuple[list[tuple[str, TeamMatch]], list[str], list[str]]:
    """Return the newest matches of each team that its clone did not learn from, what was left out, and what failed.

    Raises:
        UsageError: a team is not in the store.
    """
    by_team, unread = matches_by_team(store)
    if unknown := sorted(set(teams) - set(by_team)):
        remedy = choose(unknown[0], sorted(by_team))
        raise UsageError(f"{masked(store.location)}: no matches of {unknown[0]!r}; {remedy}")
    learned = {run.team: run.learned_from(Split.TRAIN, Split.VALIDATION) for run in runs}
    chosen: list[tuple[str, TeamMatch]] = []
    left_out: list[str] = []
    for team in sorted(teams or by_team):
        found = [one for one in by_team[team] if not one.uncontested]
        seen = learned.get(team, set())
        if seen is None:
            left_out.append(f"{team}: nobody knows what its clone learned from, as its dataset is gone")
            continue
        new = sorted((one for one in found if one.match_id not in seen), key=lambda one: (one.started, one.match_id))
        if len(found) > len(new):
            left_out.append(f"{team}: its clone learned from {len(found) - len(new)} of {len(found)} matches")
        chosen += ((team, one) for one in new[-most:])
    return chosen, left_out, [one.error for one in unread if one.error]


# What is predicted


def _watched(
    store: Store,
    models: Mapping[str, Clone],
    chosen: Sequence[tuple[str, TeamMatch]],
    failed: list[str],
    telling: Progress,
) -> Iterator[Watched]:
    """Yield what the clones think of every match; errors are added to ``failed``."""
    for done, (team, match) in enumerate(chosen):
        telling(team, done, len(chosen))
        try:
            yield watch(models, MatchColumns.of_store(store, match.match_id), side=match.side)
        except TeamcloneError as error:
            failed.append(str(error))
    telling("", len(chosen), len(chosen))


def _attributed(
    models: Mapping[str, Clone], logs: Sequence[Path], failed: list[str], telling: Progress
) -> Iterator[dict[str, Any]]:
    """Yield whose each side of some logs may be; errors are added to ``failed``."""
    for done, path in enumerate(logs):
        telling(path.name, done, len(logs))
        try:
            match = MatchColumns.of(read_match(path))
        except TeamcloneError as error:
            failed.append(str(error))
            continue
        for name, side, called in (("left", 1, match.left), ("right", -1, match.right)):
            try:
                one = watch(models, match, side=side)
            except TeamcloneError as error:
                failed.append(str(error))
                continue
            loss = one.loss.sum(1) / one.commands.sum()
            yield {
                **{"log": str(path), "side": name, "name": called, "commands": int(one.commands.sum())},
                "loss": dict(zip(models, loss.tolist(), strict=True)),
                "most_like": list(models)[int(loss.argmin())],
            }


# What is made of it


def _compared(watched: Sequence[Watched], clones: list[str], seed: int) -> dict[str, Any]:
    """Return the parts of the document that come from matches of the store."""
    teams = sorted({one.team for one in watched}, key=lambda team: (team not in clones, team))
    rows: list[dict[str, Any]] = []
    for team in teams:
        of_team = [one for one in watched if one.team == team]
        sums = np.stack([one.loss.sum(1) for one in of_team])
        commands = np.array([one.commands.sum() for one in of_team])
        rows.append(
            {
                "team": team,
                "matches": [one.match_id for one in of_team],
                "commands": int(commands.sum()),
                "constant": _entropy(np.sum([one.kinds for one in of_team], axis=0)),
                "loss": _with_intervals(sums, commands, seed),
            }
        )
    both = [team for team in clones if team in teams]
    found: dict[str, Any] = {"teams": rows, "guesses": guesses(watched, clones), "distances": None}
    if len(both) >= 2:
        loss = np.array([[rows[teams.index(a)]["loss"][clones.index(b)]["value"] for b in both] for a in both])
        found["distances"] = {"teams": both, "nats": (distance := geometry.distances(loss)).tolist()}
        if len(both) >= LEAST_TEAMS:
            places, explained = geometry.flat(distance)
            found["distances"] |= {
                "tree": geometry.tree(distance),
                "map": {"places": places.tolist(), "explained": explained},
            }
    return found


def _entropy(kinds: Any) -> float:
    """The log loss of always predicting a team's own shares of commands, nats."""
    shares = kinds[kinds > 0] / kinds.sum()
    return float(-(shares * np.log(shares)).sum())


def _with_intervals(sums: Floats, commands: Any, seed: int) -> list[dict[str, float | None]]:
    """Return the mean log loss of each clone with its interval over matches; one match gives none."""
    value = sums.sum(0) / commands.sum()
    if len(sums) < 2:
        return [{"value": one, "low": None, "high": None} for one in value.tolist()]
    weights = bootstrap.draw(len(sums), seed=seed)
    low, high = bootstrap.interval((weights @ sums) / (weights @ commands)[:, None])
    return [
        {"value": one, "low": least, "high": greatest}
        for one, least, greatest in zip(value.tolist(), low.tolist(), high.tolist(), strict=True)
    ]
